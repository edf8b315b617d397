"""Radial kernels of pose spaces: functions of the squared distance, in falloffs.

A Gaussian is exp(-r^2 / 2), so that a falloff is the sigma of Lewis, Cordner and Fong (2000). The formulas are those of
version 1 and never change; a new formula is a new version, stored with every space.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from core.transform import Array

Phi = Callable[[Array], Array]
VERSION = 1
SUPPORT = 3.0  # falloffs at which the Wendland function has ended
POSITIVE = ("gaussian", "inverse-multiquadric", "wendland")  # positive definite in any number of dimensions
AFFINE = ("thin-plate", "cubic")  # conditionally of order 2: they need the affine part


def kernel(name: str, dimensions: int = 1, table: int = 0) -> Phi:
    """The function of squared distances.

    Parameters
    ----------
    dimensions : of the coordinates; the Wendland function is chosen so that it is positive definite there.
    table : entries of a table it is looked up in, linear in the squared distance; 0 computes it.
    """
    phi = _FORMULAS[name] if name != "wendland" else _wendland(dimensions)
    return phi if table == 0 else _tabulated(phi, table)


def _gaussian(squared: Array) -> Array:
    return np.exp(-0.5 * squared)


def _thin_plate(squared: Array) -> Array:
    # r^2 log r, which is 0 at 0
    return 0.5 * squared * np.log(np.where(squared > 0.0, squared, 1.0))


def _multiquadric(squared: Array) -> Array:
    return np.sqrt(1.0 + squared)


def _inverse_multiquadric(squared: Array) -> Array:
    return 1.0 / np.sqrt(1.0 + squared)


def _cubic(squared: Array) -> Array:
    return squared * np.sqrt(squared)


def _wendland(dimensions: int) -> Phi:
    """Of smoothness C2 (Wendland 1995); (1 - r)^4 (4 r + 1) up to three dimensions."""
    power = max(3, dimensions // 2 + 2) + 1

    def phi(squared: Array) -> Array:
        r = np.minimum(np.sqrt(squared) / SUPPORT, 1.0)
        return (1.0 - r) ** power * (power * r + 1.0)

    return phi


def _tabulated(phi: Phi, count: int) -> Phi:
    """Within six falloffs from a table (section 4.2 of the paper), beyond them computed."""
    places = np.linspace(0.0, 36.0, count)
    values = phi(places)

    def looked_up(squared: Array) -> Array:
        return np.where(squared <= 36.0, np.interp(squared, places, values), phi(squared))

    return looked_up


def inverse_squares(squared: Array) -> Array:
    """Shepard's weights (N, C) of squared distances (N, C): in proportion to 1 / r^2, summing to 1, exact at 0."""
    nearest = squared.min(axis=1, keepdims=True)
    if nearest.size and nearest.min() > 0.0:
        share = nearest / squared
    else:
        share = np.where(squared > 0.0, nearest / np.where(squared > 0.0, squared, 1.0), 1.0)
    return share / share.sum(axis=1, keepdims=True)


_FORMULAS: dict[str, Phi] = {
    "gaussian": _gaussian, "thin-plate": _thin_plate, "multiquadric": _multiquadric,
    "inverse-multiquadric": _inverse_multiquadric, "cubic": _cubic, "linear": np.sqrt,
}
