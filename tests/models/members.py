"""Which members of which families the tests look at, and many of them in one test."""

from collections.abc import Callable, Iterable
from functools import cache, wraps
from inspect import Parameter, Signature, signature
from itertools import groupby
from typing import Any

import numpy as np
import pytest
from hypothesis import settings
from hypothesis import strategies as st
from numpy.polynomial import Chebyshev, Polynomial
from numpy.polynomial.polynomial import polyfromroots

from chartless.models import MODELS, AbstractModel, InverseEmor
from chartless.types import Floats

FAMILIES: dict[str, list[AbstractModel]] = {
    family: list(models) for family, models in groupby(MODELS.values(), lambda each: each.family)
}
SAMPLE = [
    model
    for models in FAMILIES.values()
    for model in models
    if model.order in {0, 1, 2, 4, models[-1].order}
]
"""Low orders and the highest of every family: what holds there holds between."""

# Where curves are looked at: finely, and in clusters at black and at white.
GRID = np.unique(
    np.concatenate(
        [
            np.linspace(0, 1, 1500),
            np.geomspace(1e-300, 1e-3, 120),
            1 - np.geomspace(1e-16, 1e-3, 120),
        ]
    )
)

LEVELS = np.arange(1024) / 1023

_SPECIAL = [0.0, 1e-300, -1e-300, 1e-12, 1.0, -1.0, 1e3, -1e3, 1e6, -1e6]
REAL = st.one_of(st.floats(-3, 3), st.floats(-30, 30), st.floats(-1e6, 1e6)) | st.sampled_from(
    _SPECIAL
)
POSITIVE = st.floats(-3, 3).map(lambda power: 10.0**power) | st.sampled_from([1e-300, 1e-6, 1e6])
_SHARE = st.sampled_from([1.0, 1 - 1e-9, 0.99]) | st.floats(0, 1)

Draw = Callable[[AbstractModel], st.SearchStrategy[Floats]]


def _vector(*parts: st.SearchStrategy[float]) -> st.SearchStrategy[Floats]:
    return st.tuples(*parts).map(lambda values: np.array(values, dtype=float))


def _reals(model: AbstractModel) -> st.SearchStrategy[Floats]:
    return _vector(*[REAL] * model.n_parameters)


def _first_positive(model: AbstractModel) -> st.SearchStrategy[Floats]:
    return _vector(POSITIVE, *[REAL] * (model.n_parameters - 1))


def polynomials(n: int, size: float = 1.0) -> st.SearchStrategy[Floats]:
    """Coefficients of polynomials of degree n − 1 that turn often within [0, 1]."""
    floats = st.floats(-size, size)

    def from_chebyshev(values: list[float]) -> Floats:
        series = Chebyshev(values, domain=[0, 1]).convert(kind=Polynomial, domain=[-1, 1]).coef
        return np.pad(series, (0, n - series.size))

    waves = st.lists(floats, min_size=n, max_size=n).map(from_chebyshev)
    roots = st.lists(st.floats(0, 1), min_size=n - 1, max_size=n - 1).map(polyfromroots)
    return waves | st.tuples(roots, floats).map(lambda pair: pair[0] * pair[1])


def furthest(model: AbstractModel, direction: Floats, most: float = 1e9) -> Floats:
    """The last member that a family admits on the way from its identity."""
    start = model.identity
    assert model.admits(start)
    low, high = 0.0, most
    if model.admits(start + high * direction):
        return start + high * direction
    for _ in range(90):
        middle = np.sqrt(low * high) if low > 0 else high * 1e-3
        if middle < 1e-30 or high <= low * (1 + 1e-9):
            break
        admitted = bool(model.admits(start + middle * direction))
        low, high = (middle, high) if admitted else (low, middle)
    return start + low * direction


def _gumbel(model: AbstractModel) -> st.SearchStrategy[Floats]:
    if model.order == 0:
        return _reals(model)

    def within(parts: tuple[Floats, float, float]) -> Floats:
        series, share, a = parts
        return np.concatenate([[a], share * furthest(model, np.concatenate([[0], series]))[1:]])

    return st.tuples(polynomials(model.order), _SHARE, REAL).map(within)


def _meegc(model: AbstractModel) -> st.SearchStrategy[Floats]:
    if model.order == 0:
        return _reals(model)

    def admitted(parts: tuple[Floats, float, float]) -> Floats:
        slope, size, a = parts
        alpha = np.concatenate([[a], 10**size * slope / np.arange(1, model.order + 1)])
        return model.repaired(alpha)

    return st.tuples(polynomials(model.order), st.floats(-2, 5), st.floats(-30, 30)).map(admitted)


def _emor_monotone(model: AbstractModel) -> st.SearchStrategy[Floats]:
    n, start = model.n_parameters, model.identity
    rows, limit = model.inequalities(start)

    def within(parts: tuple[list[float], float]) -> Floats:
        direction, share = parts
        towards = rows @ np.array(direction)
        meets = towards > 1e-100
        last = np.min((limit - rows @ start)[meets] / towards[meets], initial=1e9)
        return start + share * last * np.array(direction)

    directions = st.lists(st.floats(-1, 1), min_size=n, max_size=n)
    return st.tuples(directions, _SHARE).map(within)


def _table(model: AbstractModel) -> st.SearchStrategy[Floats]:
    def rising(parts: tuple[int, float, float]) -> Floats:
        seed, size, zeros = parts
        rng = np.random.default_rng(seed)
        steps = 10**size * rng.exponential(size=model.n_parameters)
        steps[rng.random(steps.size) < zeros] = 0
        return -np.cumsum(steps)[::-1]

    return st.tuples(
        st.integers(0, 2**32 - 1), st.floats(-8, 4), st.sampled_from([0.0, 0.5, 0.99, 1.0])
    ).map(rising)


_DRAWN: dict[str, Draw] = {
    "gamma": _first_positive,
    "eegc": _reals,
    "meegc": _meegc,
    "ameegc": _reals,
    "ameegc-exact": lambda _: _vector(REAL, REAL, st.floats(-99.9, 99.9) | st.floats(-7, 7)),
    "gumbel": _gumbel,
    "pegc": _first_positive,
    "ppisp": _reals,
    "ggc": lambda model: _vector(REAL, POSITIVE, POSITIVE) if model.order else _vector(POSITIVE),
    "poly": _reals,
    "conpoly": _reals,
    "emor": _reals,
    "emor-monotone": _emor_monotone,
    "inverse-emor": _reals,
    "logemor": _reals,
    "table": _table,
}


@cache  # to build a strategy takes longer than to draw from it
def anything(model: AbstractModel) -> st.SearchStrategy[Floats]:
    """Any parameters that the family admits, up to 10⁶ in size and down to 10⁻³⁰⁰."""
    return _DRAWN[model.family](model).filter(lambda values: bool(model.admits(values)))


def typical(model: AbstractModel, seed: int, reach: float = 1.0) -> Floats:
    """A member some way from the linear camera, the same in every run."""
    rng = np.random.default_rng([seed, model.order])
    if model.family in {"gamma", "ggc", "pegc"}:
        away = rng.uniform(-reach, reach, model.n_parameters)
        positive = model.bounds[0] == 0
        return np.where(positive, model.identity * np.exp(away), model.identity + away / 3)
    if isinstance(model, InverseEmor):
        away = rng.uniform(-reach, reach, model.n_parameters) * model.identity.size**-0.5
        while not np.all(np.diff(model.inverse(LEVELS, away)) > 0):
            away = 0.7 * away  # towards the mean, which increases
        return away
    if model.family == "table":
        smooth = np.linspace(0, 1, model.order + 3)[1:-1]
        return (1 + 0.3 * reach * rng.uniform(-1, 1)) * np.log(smooth) - 0.1 * (1 - smooth)
    size = {"gumbel": 1.0, "ameegc-exact": 1.0, "ameegc": 1.0, "eegc": 0.5}.get(model.family, 0.3)
    direction = size * reach * rng.uniform(-1, 1, model.n_parameters)
    if model.constrained:
        last = furthest(model, direction, most=1.0)
        return 0.9 * last + 0.1 * model.identity if model.family == "meegc" else last
    return model.identity + direction


# -- many cases in one test --

Test = Callable[..., None]


def each(names: str, cases: Iterable[Any]) -> Callable[[Test], Test]:
    """Make one test of all cases, where `pytest.mark.parametrize` makes a test of each.

    What pytest spends on a test is more than most cases take. A failure names its case.
    """
    fields, listed = names.split(", "), list(cases)

    def decorated(test: Test) -> Test:
        def of_all(**others: Any) -> None:
            __tracebackhide__ = True
            for case in listed:
                values = case if len(fields) > 1 else [case]
                arguments = dict(zip(fields, values, strict=True))
                try:
                    test(**arguments, **others)
                except BaseException as failure:  # as those of pytest are
                    shown = [f"{name} = {_shown(value)}" for name, value in arguments.items()]
                    failure.add_note(f"with {', '.join(shown)}")
                    raise

        others = [name for name in signature(test).parameters if name not in fields]
        return _in_place_of(test, of_all, others)

    return decorated


def each_by_family(names: str, cases: Iterable[Any]) -> Callable[[Test], Test]:
    """Make one test of all cases of a family; the first of the names is that of the model."""
    families = {
        family: list(group)
        for family, group in groupby(
            cases, lambda case: (case[0] if isinstance(case, tuple) else case).family
        )
    }

    def decorated(test: Test) -> Test:
        def of_one(family: str) -> None:
            __tracebackhide__ = True
            each(names, families[family])(test)()

        return pytest.mark.parametrize("family", families)(_in_place_of(test, of_one, ["family"]))

    return decorated


def _in_place_of(test: Test, other: Test, fixtures: list[str]) -> Test:
    """Let pytest show one function and call another, which takes these fixtures."""
    wraps(test, updated=())(other)  # without the attributes that make it one of Hypothesis
    parameters = [Parameter(name, Parameter.KEYWORD_ONLY) for name in fixtures]
    other.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
    return other


def _shown(value: object) -> str:
    return value.name if isinstance(value, AbstractModel) else repr(value)


def examples(most: int) -> settings:
    """Draw so many examples of each case, or what the profile draws where that is fewer."""
    return settings(max_examples=min(most, settings.default.max_examples))
