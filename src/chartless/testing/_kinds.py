"""Checks of kinds of evidence."""

import json
import pickle
import re
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from chartless.curves.populations import measured_prior
from chartless.curves.space import free_curve
from chartless.evidence.base import AbstractCurveEvidence, AbstractEvidence
from chartless.evidence.kind import AbstractKind, Declined, Inputs
from chartless.evidence.options import Option
from chartless.evidence.registry import KINDS
from chartless.formats.calibration_file import from_json, to_json
from chartless.inference.block import Values, curve_name
from chartless.inference.search import maximise
from chartless.inference.term import AbstractTerm
from chartless.methods import LikelihoodSearch
from chartless.result.calibration import Calibration
from chartless.result.response import Response
from chartless.types import Floats

_STEP = 1e-7  # short: some likelihoods have kinks
_FAR = 0.01  # of a derivative by differences, relative
_CHANNELS = (("Y",), ("R", "G", "B"))


def check_kind(kind: AbstractKind[Any, Any], evidence: AbstractEvidence) -> Calibration:
    """Check the promises of a kind of evidence, given an example of what it gathers.

    It declines frames that hold nothing, describes its options, can be sent to other processes,
    gives terms with true derivatives (see `check_term`), an account that survives the file, and
    figures with words.

    Parameters
    ----------
    kind : AbstractKind
        Registered in `chartless.evidence.registry.KINDS`.
    evidence : AbstractEvidence
        Evidence from which a calibration can be made, by the method likelihood.

    Returns
    -------
    Calibration
        Calibration from the example, for checks of your own.

    Raises
    ------
    AssertionError
        With the promise that does not hold.
    """
    name = kind.name
    assert name in KINDS, f"{name}: register it in KINDS"
    assert KINDS[name] is kind, f"{name}: another kind has this name in KINDS"
    assert kind.title, f"{name}: title should describe it"
    _check_options(kind)
    declined = kind.proposed(Inputs((), (), None), kind.options())
    assert isinstance(declined, Declined), f"{name}: proposes something without inputs"
    assert declined.reason, f"{name}: declines without a reason"
    assert declined.advice, f"{name}: declines without advice"
    assert not str(declined).endswith("."), f"{name}: sentences have no full stop"
    assert evidence.channels in _CHANNELS, f"{name}: channels are Y, or R, G and B"
    pickle.loads(pickle.dumps(evidence))  # noqa: S301 - made here
    flags = kind.screened(evidence, alone=True)
    assert set(flags) <= set(evidence.channels), f"{name}: flags channels that there are not"
    parts = {channel: [evidence.channel(channel)] for channel in evidence.channels}
    for channel, (part,) in parts.items():
        assert isinstance(part, kind.holds), f"{name}: holds is not the type of its channels"
        assert part.kind == name, f"{name}: evidence of a channel has the kind {part.kind}"
        low, high = part.observed_levels
        assert 0 <= low <= high < part.n_levels, f"{name}: sees levels {low} to {high}"
        assert part.n_pixels > 0, f"{name}: compares nothing"
        if isinstance(part, AbstractCurveEvidence):
            check_term(part, channel)
    found = LikelihoodSearch().calibrate_channels(parts)
    for response in found:
        _check_account(kind, response)
    _check_figures(kind, found)
    calibration = Calibration(channels=found, bit_depth=evidence.bit_depth)
    again = from_json(json.loads(json.dumps(to_json(calibration))))
    for one, other in zip(calibration.channels, again.channels, strict=True):
        before, after = one.account(name), other.account(name)
        assert before.values == after.values, f"{name}: its account changes in the file"
        if before.record is not None and after.record is not None:
            kept = after.record.to_json() == before.record.to_json()
            assert kept, f"{name}: its record changes in the file"
    return calibration


def check_term(part: AbstractCurveEvidence, channel: str = "Y") -> None:
    """Check the term of evidence of one channel: names, and derivatives against differences.

    They are taken at the most probable curve, beside it, and where searches begin.

    Parameters
    ----------
    part : AbstractCurveEvidence
    channel : str

    Raises
    ------
    AssertionError
        With the promise that does not hold.
    """
    name, space = curve_name(channel), free_curve(measured_prior(part.n_levels))
    start = part.start(channel, space.edges(space.mean))
    term = part.term(channel, noise_known=False)
    edges = {name: space.edges(space.mean)}
    begun = {**{block.name: block.mean for block in term.blocks}, **start}
    term = term.first_look(edges, begun)
    assert name in term.curves, f"{part.kind}: its term reads {term.curves} and not {name}"
    names = [block.name for block in term.blocks]
    assert len(set(names)) == len(names), f"{part.kind}: two blocks have one name"
    mode = maximise([term], {name: space}, {name: space.mean, **begun})
    generator = np.random.default_rng(0)
    coordinates = mode.values[name]
    beside = coordinates + 0.05 * generator.standard_normal(coordinates.size)
    for values in (mode.values, {**mode.values, name: beside}):
        at = {name: space.edges(values[name])}
        _check_derivatives(term, at, values, part.kind)


def _check_options(kind: AbstractKind[Any, Any]) -> None:
    assert is_dataclass(kind.options), f"{kind.name}: options should be a dataclass"
    for each in fields(kind.options):
        described = each.metadata.get("option")
        assert isinstance(described, Option), f"{kind.name}: describe the option {each.name}"
        assert described.help.endswith("."), f"{kind.name}: the help of {each.name} is a sentence"


def _check_derivatives(
    term: AbstractTerm, edges: Mapping[str, Floats], values: Values, kind: str
) -> None:
    fit = term.fit(edges, values)
    value, gradient, information = fit.expand()
    assert abs(value - fit.log_likelihood()) <= 1e-9 * max(1.0, abs(value)), (
        f"{kind}: expand and log_likelihood differ"
    )
    n = sum(edges[each].size for each in term.curves) + sum(block.size for block in term.blocks)
    assert gradient.shape == (n,), f"{kind}: gradient should have shape ({n},)"
    assert information.shape == (n, n), f"{kind}: information should have shape ({n}, {n})"
    assert np.allclose(information, information.T), f"{kind}: information is not symmetric"
    least = float(np.linalg.eigvalsh(information)[0])
    assert least > -1e-6 * max(1.0, float(np.trace(information))), (
        f"{kind}: information is not positive"
    )
    done = 0
    for name in term.curves:
        width = float(np.diff(edges[name]).min())
        own = gradient[done : done + edges[name].size]
        done += own.size
        for place in _places(own):
            move = np.zeros(own.size)
            move[place] = min(_STEP, 0.1 * width)
            up, down = (
                term.fit({**edges, name: edges[name] + sign * move}, values).log_likelihood()
                for sign in (1, -1)
            )
            seen = (up - down) / (2 * move[place])
            _check_slope(own[place], seen, own, f"{kind}: gradient in edge {place} of {name}")
    for block in term.blocks:
        own = gradient[done : done + block.size]
        done += own.size
        for place in range(0, own.size, max(1, own.size // 8)):
            step = np.zeros(own.size)
            step[place] = _STEP
            up, down = (
                term.fit(
                    edges, {**values, block.name: block.moved(values[block.name], sign * step)}
                ).log_likelihood()
                for sign in (1, -1)
            )
            seen = (up - down) / (2 * _STEP)
            _check_slope(own[place], seen, own, f"{kind}: gradient {place} in {block.name}")


def _places(gradient: Floats) -> list[int]:
    """Some edges: those where the likelihood is steepest, and some between."""
    steepest = np.argsort(-np.abs(gradient))[:3]
    between = np.linspace(2, gradient.size - 3, 5)
    return sorted({*steepest.tolist(), *between.astype(int).tolist()})


def _check_slope(given: float, seen: float, all_of_them: Floats, what: str) -> None:
    scale = max(abs(seen), float(np.sqrt(np.mean(all_of_them**2))), 1e-6)
    assert abs(given - seen) <= _FAR * scale, f"{what} is {given:.6g}, by differences {seen:.6g}"


def _check_account(kind: AbstractKind[Any, Any], response: Response) -> None:
    assert kind.name in response.kinds, f"{kind.name}: gives no account"
    account = response.account(kind.name)
    n_said = len(account.facts) + len(account.fits)
    assert len(account.values) == n_said, f"{kind.name}: two facts have one code"
    for fact in account.facts:
        assert fact.label, f"{kind.name}: the fact {fact.code} needs a label"
        assert fact.text, f"{kind.name}: the fact {fact.code} shows nothing"
    if kind.holds.constrains:
        assert account.fits, f"{kind.name}: does not state how well the curve explains it"
    for fit in account.fits:
        assert np.isfinite(fit.value), f"{kind.name}: the fit {fit.code} is {fit.value}"


def _check_figures(kind: AbstractKind[Any, Any], channels: tuple[Response, ...]) -> None:
    from matplotlib.figure import Figure

    for each in kind.figures(channels):
        axes = Figure().subplots()
        each.draw(axes)
        assert axes.has_data(), f"{kind.name}: the figure {each.name} is empty"
        assert re.search(r"\d", each.words), f"{kind.name}: words of {each.name} give no numbers"
