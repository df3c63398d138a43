"""By how much one picture is displaced against another of the same shot that may be larger."""

from typing import NamedTuple

import numpy as np

from chartless.types import Floats32

_SLACK = 4  # pixels by which the smaller picture may stick out
_FINE, _COARSE = 1.0, 8.0  # pixels: what is finer is noise, what is coarser light and shade


class Registration(NamedTuple):
    """Where a picture lies in another."""

    down: int
    """Row of the larger picture in which the first row of the smaller lies."""
    right: int
    correlation: float
    """Correlation of the detail of both where they overlap, −1 … 1."""


def register(smaller: Floats32, larger: Floats32) -> Registration:
    """Find the whole shift at which the detail of two pictures correlates best.

    Parameters
    ----------
    smaller : ndarray of float32, shape (M, N)
        Picture of any brightness and contrast.
    larger : ndarray of float32, shape (P, Q)
        P ≥ M, Q ≥ N.
    """
    from scipy.fft import irfft2, next_fast_len, rfft2
    from scipy.ndimage import gaussian_filter

    detail = [
        gaussian_filter(each, _FINE) - gaussian_filter(each, _COARSE) for each in (smaller, larger)
    ]
    size = [next_fast_len(length + _SLACK, real=True) for length in larger.shape]
    spectra = [rfft2(each, size) for each in detail]
    products = irfft2(spectra[0].conj() * spectra[1], size)
    rows, columns = (
        np.arange(-_SLACK, big - small + _SLACK + 1)
        for small, big in zip(smaller.shape, larger.shape, strict=True)
    )
    # A shift below 0 is one from the other end.
    near = products[np.ix_(rows, columns)]
    place = np.unravel_index(int(near.argmax()), near.shape)
    down, right = int(rows[place[0]]), int(columns[place[1]])
    one = detail[0][overlap(-down, larger.shape[0], smaller.shape[0]), :]
    one = one[:, overlap(-right, larger.shape[1], smaller.shape[1])]
    other = detail[1][overlap(down, smaller.shape[0], larger.shape[0]), :]
    other = other[:, overlap(right, smaller.shape[1], larger.shape[1])]
    energy = float(np.vdot(one, one)) * float(np.vdot(other, other))
    correlation = float(np.vdot(one, other)) / max(energy, float(np.finfo(float).tiny)) ** 0.5
    return Registration(down, right, correlation)


def overlap(shift: int, other: int, own: int) -> slice:
    """Part of `own` pixels in a row on which `other` pixels lie, shifted by so many."""
    return slice(max(shift, 0), min(shift + other, own))
