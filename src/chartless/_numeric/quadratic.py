"""Linear least squares under linear inequalities, exactly, by way of nonnegative least squares."""

import numpy as np
from scipy.optimize import nnls

from chartless.types import Floats


def constrained_step(triangle: Floats, right: Floats, rows: Floats, room: Floats) -> Floats:
    """Minimiser of |T δ + r|² subject to C δ ≤ s.

    Parameters
    ----------
    triangle : ndarray, shape (Q, P)
        T, of full column rank.
    right : ndarray, shape (Q,)
        r.
    rows : ndarray, shape (M, P)
        C.
    room : ndarray, shape (M,)
        s; δ = 0 is allowed where it is not negative.

    Returns
    -------
    ndarray, shape (P,)

    Raises
    ------
    ValueError
        If no δ satisfies the inequalities.

    Notes
    -----
    Lawson and Hanson, *Solving least squares problems* (1974), chapter 23: with T = QR and
    z = R δ + Qᵀr the problem is that of the least |z| with G z ≥ h, whose dual is one of
    nonnegative least squares.
    """
    orthogonal, upper = np.linalg.qr(triangle)
    projected = orthogonal.T @ right
    free: Floats = -np.linalg.solve(upper, projected)
    if np.all(rows @ free <= room):
        return free
    inward = -np.linalg.solve(upper.T, rows.T).T  # −C R⁻¹
    least = rows @ free - room  # G z ≥ least
    length = np.linalg.norm(inward, axis=1)
    matters = length > 0
    inward, least = inward[matters] / length[matters, None], least[matters] / length[matters]
    unit = least.max()  # |z| is at least this, so that the dual is well scaled
    dual = np.vstack([inward.T, least / unit])
    target = np.zeros(len(dual))
    target[-1] = 1.0
    multipliers, distance = nnls(dual, target, maxiter=30 * len(least))
    residual = target - dual @ multipliers
    if distance <= 0 or residual[-1] <= 0:
        msg = "the inequalities contradict each other"
        raise ValueError(msg)
    # −residual[:-1] / residual[-1] is the shift, but for cancellation: only which inequalities
    # are in force comes from it.
    active = multipliers > 0
    shift = np.linalg.lstsq(inward[active], least[active], rcond=None)[0]
    step: Floats = free + np.linalg.solve(upper, shift)
    return step
