"""Checks of families of curves."""

import numpy as np

from chartless.models import AbstractModel, Property
from chartless.types import Floats

_STEP = 1e-6
_INVERSE, _ENDS = 1e-9, 1e-12  # of brightness
_GRID = np.linspace(0.02, 0.98, 49)


def check_family(model: AbstractModel, parameters: Floats | None = None) -> None:
    """Check the promises of `chartless.models.AbstractModel` at a member of a family.

    Brightness, its inverse, derivatives against differences, shapes, and the claims among
    `properties` that one member can disprove.

    Parameters
    ----------
    model : AbstractModel
    parameters : ndarray, shape (P,), optional
        Parameters of an increasing member. Without, `model.identity`.

    Raises
    ------
    AssertionError
        With the promise that does not hold.
    """
    x = np.asarray(model.identity if parameters is None else parameters, dtype=np.float64)
    name = model.name
    assert x.shape == (model.n_parameters,), f"{name}: identity should have shape (P,)"
    assert model.admits(x), f"{name}: its identity is not admitted"
    brightness = model.response(_GRID, x)
    assert brightness.shape == _GRID.shape, f"{name}: response should keep the shape"
    assert np.all(np.diff(brightness) >= 0), f"{name}: this member is not increasing"
    again = model.response(model.inverse(brightness, x), x)
    assert np.abs(again - brightness).max() < _INVERSE, f"{name}: f(g(b)) is not b"
    slope = (model.response(_GRID + _STEP, x) - model.response(_GRID - _STEP, x)) / (2 * _STEP)
    given = model.derivative(_GRID, x)
    assert _is_near(given, slope), f"{name}: derivative is not that of response"
    gradient = model.gradient(_GRID, x)
    assert gradient.shape == (_GRID.size, x.size), f"{name}: gradient should have shape (N, P)"
    for place, parameter in enumerate(model.parameter_names):
        move = np.zeros(x.size)
        move[place] = _STEP * max(1.0, abs(x[place]))
        change = model.response(_GRID, x + move) - model.response(_GRID, x - move)
        seen = change / (2 * move[place])
        assert _is_near(gradient[:, place], seen), f"{name}: gradient in {parameter} is wrong"
    if Property.ENDS in model.properties:
        ends = model.response(np.array([0.0, 1.0]), x)
        assert np.abs(ends - [0, 1]).max() < _ENDS, f"{name}: claims f(0) = 0 and f(1) = 1"
    if Property.BOUNDED in model.properties:
        within = (brightness >= 0) & (brightness <= 1)
        assert np.all(within), f"{name}: claims to stay in [0, 1]"


def _is_near(given: Floats, seen: Floats) -> bool:
    """Whether derivatives agree but for kinks, where differences see the mean of two slopes."""
    scale = np.abs(seen).max() + 1e-6
    return bool(np.median(np.abs(given - seen)) < 1e-4 * scale)
