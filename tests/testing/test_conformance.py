"""The conformance suite over all that there is, and what it catches."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from raw_cameras import Camera, patches
from typing_extensions import override

from chartless.curves import named_curve
from chartless.evidence.base import AbstractEvidence
from chartless.evidence.bracket.gather import bracket_evidence
from chartless.evidence.noise.gather import noise_evidence
from chartless.evidence.points.gather import Point, PointsEvidence
from chartless.evidence.points.kind import Points
from chartless.evidence.points.term import PointTerm
from chartless.evidence.raw.gather import raw_evidence
from chartless.evidence.registry import KINDS
from chartless.evidence.typical.gather import typical_evidence
from chartless.formats import FORMATS
from chartless.frames.frame import Frame, FrameSource
from chartless.inference.block import Values
from chartless.inference.term import AbstractFit, Expansion
from chartless.models import MODELS, Gamma
from chartless.noise import AffineNoise
from chartless.simulate import simulate_frames
from chartless.testing import check_family, check_format, check_kind, check_term
from chartless.types import Floats

NOISE = AffineNoise.of_sensor(5_000, 5)


def frames(*exposures: float) -> Iterator[Frame]:
    scene = np.random.default_rng(3).uniform(0, 1, size=(150, 200)) ** 2
    for place, exposure in enumerate(exposures):
        light = (scene * exposure).clip(0, 1)
        (levels,) = simulate_frames(light, named_curve("srgb"), NOISE, n_frames=1, seed=place)
        yield Frame(Path(f"{place}.png"), levels[..., np.newaxis])


def points() -> PointsEvidence:
    light = np.geomspace(0.02, 0.9, 15)
    shown = named_curve("srgb").response(light)
    rows = tuple(Point(*each) for each in zip(light.tolist(), shown.tolist(), strict=True))
    return PointsEvidence(rows, (FrameSource(Path("wedge.csv"), "", ()),), n_levels=64)


EXAMPLES: dict[str, Callable[[], AbstractEvidence]] = {
    "raw": lambda: raw_evidence([Camera(curve=named_curve("srgb")).pair(patches())], n_levels=64),
    "bracket": lambda: bracket_evidence(frames(0.25, 0.5, 1), np.log([1, 2, 4]), n_levels=64),
    "points": points,
    "typical": lambda: typical_evidence(frames(1), n_levels=64),
    "noise": lambda: noise_evidence(frames(1, 1), n_levels=64),
}


def test_there_is_an_example_of_every_kind() -> None:
    assert list(EXAMPLES) == list(KINDS)


@pytest.mark.parametrize("name", list(KINDS))
def test_a_kind_keeps_its_promises(name: str) -> None:
    calibration = check_kind(KINDS[name], EXAMPLES[name]())

    assert all(name in each.kinds for each in calibration.channels)


@pytest.mark.slow
def test_families_keep_their_promises() -> None:
    for model in MODELS.values():
        check_family(model)


@pytest.mark.parametrize("name", list(FORMATS))
def test_a_format_keeps_its_promises(name: str) -> None:
    check_format(FORMATS[name])


# What is caught


@cache
def example() -> PointsEvidence:
    return points()


@dataclass(frozen=True, eq=False)
class Bent(AbstractFit):
    """A fit with something wrong about it."""

    fit: AbstractFit
    change: Callable[[Expansion], Expansion]

    @override
    def log_likelihood(self) -> float:
        return self.fit.log_likelihood()

    @override
    def expand(self) -> Expansion:
        return self.change(self.fit.expand())


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda e: e._replace(gradient=1.2 * e.gradient), "gradient in edge"),
        (lambda e: e._replace(value=e.value + 1), "expand and log_likelihood differ"),
        (lambda e: e._replace(gradient=e.gradient[:-1]), "gradient should have shape"),
        (lambda e: e._replace(information=-e.information), "information is not positive"),
        (
            lambda e: e._replace(information=e.information + np.eye(len(e.gradient), k=1)),
            "information is not symmetric",
        ),
    ],
)
def test_a_wrong_derivative_is_caught(
    change: Callable[[Expansion], Expansion], said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where it is checked: the search is left alone, which could not do with some of them."""
    right = PointTerm.fit
    monkeypatch.setattr("chartless.testing._kinds.maximise", lambda *_, **__: mode)
    part = example().channel("Y")
    mode = searched_before()

    def wrong(self: PointTerm, edges: Mapping[str, Floats], values: Values) -> AbstractFit:
        return Bent(right(self, edges, values), change)

    monkeypatch.setattr(PointTerm, "fit", wrong)
    with pytest.raises(AssertionError, match=f"^points: {said}"):
        check_term(part)


@cache
def searched_before() -> Any:
    from chartless.curves.populations import measured_prior
    from chartless.curves.space import free_curve
    from chartless.inference.search import maximise

    part, space = example().channel("Y"), {"curve/Y": free_curve(measured_prior(64))}
    edges = {"curve/Y": space["curve/Y"].edges(space["curve/Y"].mean)}
    start = part.start("Y", edges["curve/Y"])
    term = part.term("Y", noise_known=False).first_look(edges, start)
    return maximise([term], space, start)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"title": ""}, "title should describe it"),
        ({"name": "wedge"}, "register it in KINDS"),
    ],
)
def test_a_kind_that_says_too_little_is_caught(
    change: dict[str, Any], said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in change.items():
        monkeypatch.setattr(Points, name, value)

    with pytest.raises(AssertionError, match=said):
        check_kind(KINDS["points"], example())


def test_a_wrong_family_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    right = Gamma._gradient
    monkeypatch.setattr(Gamma, "_gradient", lambda *args: 2 * right(*args))

    with pytest.raises(AssertionError, match=r"gradient in .* is wrong"):
        check_family(Gamma())


def test_a_format_that_loses_more_than_it_says_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    each = FORMATS["csv"]
    monkeypatch.setattr(type(each), "precision", 0.0, raising=False)

    with pytest.raises(AssertionError, match="after a round trip"):
        check_format(each)
