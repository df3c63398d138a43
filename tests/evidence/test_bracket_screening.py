"""What is refused and what is doubted about exposures: a case for each."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chartless.errors import UnfitFramesError
from chartless.evidence._pair_check import PairCheck
from chartless.evidence.bracket.gather import BracketEvidence
from chartless.evidence.bracket.screening import screen_bracket
from chartless.flags import Flag
from chartless.frames.frame import FrameSource
from chartless.types import Counts

STILL = PairCheck(0.0, 0.0, 0.0, 0.0)
N_PIXELS = 100_000


def spread(first: int, last: int, black: float = 0.0, white: float = 0.0) -> Counts:
    """Histogram of as many pixels of each level from one to another, the rest black and white."""
    row = np.zeros(256)
    row[first : last + 1] = (1 - black - white) * N_PIXELS / (last - first + 1)
    row[[0, 255]] += N_PIXELS * np.array([black, white])
    return np.asarray(np.rint(row).astype(np.int64))


def evidence(*rows: Counts, **changes: Any) -> BracketEvidence:
    if not rows:
        rows = (spread(1, 120), spread(1, 180), spread(1, 254))
    number = len(rows)
    values: dict[str, Any] = {
        "tables": {"Y": ()},
        "log_exposures": np.log(2.0) * np.arange(number),
        "exposure_error": 0.0,
        "histograms": {"Y": np.stack(rows)},
        "clipped": np.stack([row[[0, -1]] / row.sum() for row in rows]),
        "checks": (STILL,) * (number - 1),
        "overlaps": (0.5,) * (number - 1),
        "brightenings": (0.3,) * (number - 1),
        "bit_depth": 8,
        "sources": tuple(FrameSource(Path(f"{place}.jpg"), "", ()) for place in range(number)),
    }
    return BracketEvidence(**{**values, **changes})


def refusal(given: BracketEvidence) -> str:
    with pytest.raises(UnfitFramesError) as caught:
        screen_bracket(given)
    text = str(caught.value)
    assert "\n" not in text
    return text


def test_a_good_bracket_is_not_doubted() -> None:
    assert screen_bracket(evidence()) == {"Y": ()}


def test_channels_are_judged_one_by_one() -> None:
    good, narrow = evidence().histograms["Y"], np.stack([spread(1, 80 + k) for k in range(3)])

    flags = screen_bracket(evidence(histograms={"R": good, "G": narrow, "B": good}))

    assert flags == {"R": (), "G": (Flag.LEVELS_UNSEEN,), "B": ()}


# Refused


@pytest.mark.parametrize(
    ("clipped", "words"),
    [
        (spread(5, 9, white=0.996), ("100% white", "give shorter ones")),
        (spread(5, 9, black=0.996), ("100% black", "give longer ones")),
    ],
)
def test_less_than_two_exposures_with_light(clipped: Counts, words: tuple[str, str]) -> None:
    good = spread(1, 254)

    line = refusal(evidence(good, clipped))

    assert line.startswith("1.jpg is ")
    assert all(word in line for word in words)
    refusal(evidence(clipped, clipped, good))


def test_two_exposures_with_light_are_enough() -> None:
    assert screen_bracket(evidence(spread(1, 200), spread(1, 254), spread(5, 9, white=0.999)))


@pytest.mark.parametrize("order", [(0, 1), (1, 0)], ids=str)
def test_a_longer_exposure_that_is_darker(order: tuple[int, int]) -> None:
    rows = [spread(1, 254), spread(1, 100)]

    line = refusal(
        evidence(*(rows[place] for place in order), log_exposures=np.array([0.0, 1.0])[list(order)])
    )

    longer, shorter = (f"{order.index(place)}.jpg" for place in (1, 0))
    assert line.startswith(f"{longer} is darker than {shorter}, though ")


@pytest.mark.parametrize("share", [0.75, 1.0, 1.5])
def test_a_longer_exposure_may_be_a_little_darker(share: float) -> None:
    """Moving clouds; below 0.7 of the mean level it is a mistake."""
    screen_bracket(evidence(spread(1, 200), spread(1, round(200 * share) - 50 * (share > 1))))


@pytest.mark.parametrize("order", [(0, 1), (1, 0)], ids=str)
def test_exposures_that_are_the_same(order: tuple[int, int]) -> None:
    """Whose times were mistaken: a curve from them would be wrong, and sure of itself."""
    times = np.log([1.0, 2.0])[list(order)]

    line = refusal(evidence(*2 * [spread(1, 254)], log_exposures=times, brightenings=(0.01,)))

    longer, shorter = (f"{order.index(place)}.jpg" for place in (1, 0))
    assert line.startswith(f"{longer} is hardly brighter than {shorter}, though its exposure is ")
    assert "given as 2 times as long" in line
    assert "`evidence='noise'`" in line


def test_exposures_of_too_few_pixels_are_not_judged() -> None:
    assert screen_bracket(evidence(*2 * [spread(1, 254)], brightenings=(np.nan,))) == {"Y": ()}


def test_exposures_that_share_nothing_may_not_be_compared() -> None:
    rows = [spread(1, 254), spread(1, 254), spread(1, 254)]

    assert screen_bracket(evidence(*rows, brightenings=(0.3, 0.0), overlaps=(0.5, 0.0)))


def test_no_overlap() -> None:
    line = refusal(evidence(overlaps=(0.001, 0.0)))

    assert "no two neighbouring exposures show a pixel between black and white in both" in line
    assert screen_bracket(evidence(overlaps=(0.003, 0.0)))


def test_few_levels() -> None:
    line = refusal(evidence(spread(100, 120), spread(110, 150)))

    assert line.startswith("channel Y: the exposures cover 20% of the levels, too few")
    assert "(least 25%)" in line


def test_levels_of_single_pixels_are_not_covered() -> None:
    rows = [spread(100, 120), spread(110, 150)]
    for row in rows:
        row[[3, 250]] = 5  # of 10⁵

    assert "cover 20% of the levels" in refusal(evidence(*rows))
    for row in rows:
        row[[3, 250]] = 20
    assert screen_bracket(evidence(*rows)) == {"Y": ()}


# Doubted


@pytest.mark.parametrize(
    ("changes", "flag"),
    [
        ({"overlaps": (0.5, 0.04)}, Flag.LITTLE_OVERLAP),
        ({"checks": (STILL, replace(STILL, displacement=1.6))}, Flag.MOTION),
        ({"checks": (replace(STILL, displacement_share=0.11), STILL)}, Flag.MOTION),
        (
            {"histograms": {"Y": np.stack([spread(1, 100), spread(1, 150), spread(1, 200)])}},
            Flag.LEVELS_UNSEEN,
        ),
    ],
    ids=["overlap", "displacement", "share", "levels"],
)
def test_a_doubt(changes: dict[str, Any], flag: Flag) -> None:
    assert screen_bracket(evidence(**changes)) == {"Y": (flag,)}


@pytest.mark.parametrize(
    "changes",
    [
        {"overlaps": (0.5, 0.06)},
        {"checks": (STILL, replace(STILL, displacement=1.4))},
        {"checks": (replace(STILL, displacement_share=0.09), STILL)},
        {"histograms": {"Y": np.stack([spread(1, 100), spread(1, 150), spread(1, 210)])}},
    ],
    ids=["overlap", "displacement", "share", "levels"],
)
def test_what_is_not_quite_a_doubt(changes: dict[str, Any]) -> None:
    assert screen_bracket(evidence(**changes)) == {"Y": ()}


def test_doubts_come_in_one_order() -> None:
    (flags,) = screen_bracket(
        evidence(
            spread(1, 100),
            spread(1, 150),
            overlaps=(0.01,),
            checks=(replace(STILL, displacement=9.0),),
        )
    ).values()

    assert flags == (Flag.LEVELS_UNSEEN, Flag.MOTION, Flag.LITTLE_OVERLAP)
