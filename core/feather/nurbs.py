"""NURBS patches: what the quill and the vanes are as smooth surfaces, evaluated and fitted through grids of points."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, make_interp_spline


class Nurbs(NamedTuple):
    """A patch. points : (U, V, 3) float64 control points; weights : (U, V); orders and knots as OpenUSD has them."""

    points: NDArray[np.float64]
    weights: NDArray[np.float64]
    orders: tuple[int, int]
    knots: tuple[NDArray[np.float64], NDArray[np.float64]]


def clamped_knots(count: int, order: int) -> NDArray[np.float64]:
    """Knots from 0 to 1 of a curve with `count` control points that begins and ends at its outer ones."""
    inner = np.linspace(0.0, 1.0, count - order + 2)
    return np.concatenate([np.zeros(order - 1), inner, np.ones(order - 1)])


def evaluate(patch: Nurbs, u: NDArray[Any], v: NDArray[Any]) -> NDArray[np.float64]:
    """Points (len(u), len(v), 3) of the patch; `u` and `v` ascend within its knots."""
    whole = np.concatenate([patch.points * patch.weights[..., None], patch.weights[..., None]], axis=-1)
    along = BSpline(patch.knots[0], whole, patch.orders[0] - 1, axis=0)(np.asarray(u, np.float64))
    both = BSpline(patch.knots[1], along, patch.orders[1] - 1, axis=1)(np.asarray(v, np.float64))
    return np.asarray(both[..., :3] / both[..., 3:])


def through(grid: NDArray[Any]) -> Nurbs:
    """The patch, cubic where there are points enough, that runs through a grid (U, V, 3) at even parameters."""
    points, orders, knots = np.asarray(grid, np.float64), [], []
    for axis in (0, 1):
        degree = min(3, points.shape[axis] - 1)
        spline = make_interp_spline(np.linspace(0.0, 1.0, points.shape[axis]), points, degree, axis=axis)
        points = np.moveaxis(spline.c, 0, axis)  # scipy puts the axis first
        orders.append(degree + 1)
        knots.append(np.asarray(spline.t, np.float64))
    return Nurbs(points, np.ones(points.shape[:2]), (orders[0], orders[1]), (knots[0], knots[1]))
