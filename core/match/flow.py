"""Optical flow between two frames as a spline (Szeliski & Coughlan, "Spline-based image registration", IJCV 22, 1997).

The displacement is a cubic B-spline over a control grid, so it is smooth where the motion is and there are no windows
that overlap. It is found coarse to fine with Gauss-Newton (conjugate gradients on the grid, matrix-free). Dense
inverse search (Kroeger et al. 2016, by OpenCV) gives the start; where it breaks at an edge by more than the spline can
follow, its break is kept beside the spline, and the grid is made finer. Every vertex has a covariance from its part of
the normal equations and from how well the frames agree around it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from core.image.mix import grey_bytes
from core.match.flow_kernels import data_term, gather, normal_product, spread

Field = NDArray[np.float32]
BREAK = 0.25  # pixels: what differs more from the spline is an edge of the motion
STIFFNESS = 0.02  # of the strength of the data: keeps the grid still where there is nothing to see
SWEEPS = 6  # of conjugate gradients in a step of Gauss-Newton
LEAST_SIDE = 32
WORSE, LEAST_GREY = 1.0, 0.001  # than where the search left it, of the range of grey: the spline is not believed


class Flow(NamedTuple):
    """Where the pixels of a frame went in the other.

    vectors : (H, W, 2) float32 x, y in pixels. covariance : (H, W, 3) float32 xx, xy, yy in px^2.
    """

    vectors: Field
    covariance: Field


def flow_between(
    first: Field, second: Field, *, spacing: int = 8, rounds: int = 2, cancel: Callable[[], bool] | None = None
) -> Flow:
    """Flow from `first` to `second`, both (H, W, C) float32 of one size.

    spacing : pixels between vertices of the finest grid. rounds : steps of Gauss-Newton on the finest level.
    """
    if first.shape != second.shape:
        raise ValueError("flow needs two frames of one size")
    start = start_flow(first, second)
    a, b = _even(first, second)
    base = start
    for level, step in ((1, 2 * spacing), (0, spacing)):
        smooth = fitted(base, step)
        # where the spline cannot follow an edge of the motion, the break stays beside it
        torn = np.linalg.norm(base - smooth, axis=2) > BREAK
        keep = cv2.blur(cv2.dilate(torn.astype(np.float32), np.ones((5, 5), np.uint8)), (5, 5))[:, :, None]
        base = smooth + keep * (base - smooth)
        ga, gb = (np.asarray(cv2.GaussianBlur(image, (0, 0), 0.8 + level), np.float32) for image in (a, b))
        for _ in range(rounds):
            if cancel is not None and cancel():
                break
            base, covariance = _improved(ga, gb, base, step)
    worse = _disagreement(a, b, base) > WORSE * _disagreement(a, b, start) + LEAST_GREY
    taken = cv2.blur(worse.astype(np.float32), (3, 3))[:, :, None]
    return Flow(base + taken * (start - base), covariance)


def _disagreement(first: Field, second: Field, flow: Field) -> Field:
    """How much the frames differ around every pixel when the second is brought back by the flow."""
    height, width = first.shape
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)
    warped = cv2.remap(second, x + flow[:, :, 0], y + flow[:, :, 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(cv2.blur(np.abs(warped - first), (7, 7)))


def start_flow(first: Field, second: Field) -> Field:
    """Dense inverse search between two frames (H, W, C): (H, W, 2) pixels."""
    search = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    a, b = grey_bytes(np.concatenate((first, second))).reshape(2, *first.shape[:2])
    if min(a.shape) < LEAST_SIDE:
        return np.zeros((*a.shape, 2), np.float32)
    return np.asarray(
        search.calc(np.ascontiguousarray(a), np.ascontiguousarray(b), np.zeros((*a.shape, 2), np.float32))
    )


def fitted(field: Field, step: int) -> Field:
    """The smooth spline near a field (H, W, 2): averaged onto the grid with its own weights, then once corrected."""
    out = np.empty_like(field)
    height, width = field.shape[:2]
    shape = _grid_shape(height, width, step)
    weight = np.empty(shape, np.float32)
    gather(np.ones((height, width), np.float32), step, 1, weight)
    for c in range(2):
        part = np.ascontiguousarray(field[:, :, c])
        total, grid, made = (
            np.zeros(shape, np.float32),
            np.zeros(shape, np.float32),
            np.zeros((height, width), np.float32),
        )
        for _ in range(4):
            gather(part - made, step, 1, total)
            grid += total / np.maximum(weight, 1e-6)
            spread(grid, step, made)
        out[:, :, c] = made
    return out


def _improved(first: Field, second: Field, flow: Field, step: int) -> tuple[Field, Field]:
    """One step of Gauss-Newton on the grid, added to a flow; and the covariance of every pixel."""
    height, width = first.shape
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)
    mx, my = x + flow[:, :, 0], y + flow[:, :, 1]
    inside = ((mx >= 0) & (mx <= width - 1) & (my >= 0) & (my <= height - 1)).astype(np.float32)
    warped = cv2.remap(second, mx, my, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    both = 0.5 * (warped + first)
    gx = cv2.Scharr(both, cv2.CV_32F, 1, 0, scale=1.0 / 32.0)
    gy = cv2.Scharr(both, cv2.CV_32F, 0, 1, scale=1.0 / 32.0)
    difference = (warped - first)[inside > 0]
    scale = 1.4826 * float(np.median(np.abs(difference))) + 1e-6 if len(difference) else 1.0
    xx, xy, yy, bx, by, square = (np.empty((height, width), np.float32) for _ in range(6))
    data_term(
        first, np.asarray(warped, np.float32), inside, np.asarray(gx), np.asarray(gy), scale, xx, xy, yy, bx, by, square
    )
    shape = _grid_shape(height, width, step)

    def onto(field: Field, power: int = 1) -> Field:
        grid = np.empty(shape, np.float32)
        gather(field, step, power, grid)
        return grid

    dxx, dxy, dyy = onto(xx, 2), onto(xy, 2), onto(yy, 2)
    stiff = np.float32(STIFFNESS * float(np.mean(dxx + dyy)) + 1e-12)
    move = _solve(xx, xy, yy, onto(bx), onto(by), (dxx + stiff, dyy + stiff), stiff, step)
    made = np.empty((height, width, 2), np.float32)
    part = np.empty((height, width), np.float32)
    for c in range(2):
        spread(np.clip(move[c], -4.0, 4.0), step, part)
        made[:, :, c] = part
    # how well the frames agree around a vertex, over how much it sees there
    weight, rest = onto(np.ones_like(first)), onto(square)
    seen = onto(inside)
    # pixels outside say nothing: as bad as a whole grey
    variance = np.maximum((rest + (weight - seen)) / np.maximum(weight, 1e-6), 0.25 * scale * scale)
    # far less than the stiffness: what holds the grid still says nothing about where it should be
    least = 1e-3 * stiff
    det = (dxx + least) * (dyy + least) - dxy * dxy
    grids = (variance * (dyy + least) / det, -variance * dxy / det, variance * (dxx + least) / det)
    covariance = np.empty((height, width, 3), np.float32)
    for c, grid in enumerate(grids):
        spread(np.ascontiguousarray(grid, np.float32), step, part)
        covariance[:, :, c] = part
    return flow + made, covariance


def _solve(
    xx: Field, xy: Field, yy: Field, bx: Field, by: Field, diagonal: tuple[Field, Field], stiff: np.float32, step: int
) -> Field:
    """Conjugate gradients, preconditioned by the diagonal: (2, rows, columns) of coefficients."""

    def apply(v: Field) -> Field:
        out = np.empty_like(v)
        normal_product(v, xx, xy, yy, step, out)
        for c in range(2):
            out[c] += stiff * (v[c] - 0.25 * np.asarray(cv2.filter2D(v[c], -1, CROSS, borderType=cv2.BORDER_REPLICATE)))
        return out

    rest = np.stack((bx, by))
    inverse = 1.0 / np.stack(diagonal)
    x = np.zeros_like(rest)
    z = inverse * rest
    p, now = z.copy(), float((rest * z).sum())
    for _ in range(SWEEPS):
        if now <= 1e-12:
            break
        image = apply(p)
        along = now / max(float((p * image).sum()), 1e-20)
        x += np.float32(along) * p
        rest -= np.float32(along) * image
        z = inverse * rest
        before, now = now, float((rest * z).sum())
        p = z + np.float32(now / before) * p
    return x


CROSS = np.array([[0, 1, 0], [1, 0, 1], [0, 1, 0]], np.float32)


def _grid_shape(height: int, width: int, step: int) -> tuple[int, int]:
    return (height - 1) // step + 4, (width - 1) // step + 4


def _even(first: Field, second: Field) -> tuple[Field, Field]:
    """Grey frames on a scale from 0 to 1, alike for both."""
    a, b = first.mean(axis=2), second.mean(axis=2)
    low, high = np.percentile(a[::4, ::4], (0.5, 99.5))
    scale = np.float32(1.0 / max(float(high - low), 1e-6))
    return (a - np.float32(low)) * scale, (b - np.float32(low)) * scale
