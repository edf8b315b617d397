"""Optical flow between two frames as a spline (Szeliski & Coughlan, "Spline-based image registration", IJCV 22, 1997).

The displacement is a cubic B-spline over a control grid, so it is smooth where the motion is and there are no windows
that overlap. It is found coarse to fine with a step of Gauss-Newton on each grid (conjugate gradients, matrix-free),
begun by dense inverse search (Kroeger et al., "Fast optical flow using dense inverse search", ECCV 2016, by OpenCV).
The grid is subdivided only where it earns it: where the coarse spline explains the frames worse than the search did, or
leaves the search far without explaining them better. What not even the finest grid can follow, an edge of the motion,
stays as the search found it.

Every pixel has a covariance: from the normal equations of the coarsest grid, from how far the search back from the
second frame misses it, and from how much the frames still differ there.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from core.image.mix import even_grey
from core.match.flow_kernels import (
    aim,
    data_term,
    gather,
    mixed_covariance,
    normal_product,
    overlaps,
    smaller_gap,
    spread,
)
from core.workers import serial_ranges

Field = NDArray[np.float32]
Ranges = Callable[[int, Callable[[int, int], object], int], None]
# spacing over the finest; pixels of the Gauss before the frames are compared; of how many rows and columns one counts
LEVELS = ((4, 1.2, 2), (2, 1.0, 2), (1, 0.5, 1))
BIAS = 15  # pixels: side of the window whose mean difference is light, not motion
STIFFNESS = 0.02  # of the strength of the data: keeps the grid still where there is nothing to see
SWEEPS = 5  # of conjugate gradients in a step of Gauss-Newton
LEAST_SIDE = 32
MOST = np.float32(4.0)  # pixels in one step
LEAST_GREY = 0.001  # of the range of grey: by so much the spline may explain worse than the search
FAR, BETTER = 0.5, 0.9  # pixels off the search, and how little of its disagreement must then be left
WINDOW = 7  # pixels: side of the neighbourhood two flows are compared over
NOTHING = np.float32(0.0003)  # of the covariance of a vertex alone: it tells where there is nothing to see
ROUNDING = 0.3 / 255.0  # standard deviation of a grey of 8 bits: two flat frames are alike, and that says nothing
LEAST_SHARE = 0.1  # of a cell that is subdivided
NEAR, WIDE = 5, 31  # pixels: sides of the windows over which the searches are compared with the flow
ALIKE, APART = 0.5, 10.0  # of what the searches miss: counted where the frames agree, and more by how they differ
BANDS = 2  # of the normal equations, each summed by itself: the same sums however many threads there are


class Flow(NamedTuple):
    """Where the pixels of a frame went in the other.

    vectors : (H, W, 2) float32 x, y in pixels. covariance : (H, W, 3) float32 xx, xy, yy in px^2.
    """

    vectors: Field
    covariance: Field


def flow_between(
    first: Field,
    second: Field,
    *,
    spacing: int = 8,
    cancel: Callable[[], bool] | None = None,
    ranges: Ranges = serial_ranges,
) -> Flow:
    """Flow from `first` to `second`, both (H, W, C) float32 of one size.

    spacing : pixels between vertices of the finest grid.
    """
    if first.shape != second.shape:
        raise ValueError("flow needs two frames of one size")
    start, backs = search_flow(first, second, spacing, ranges)
    a, b = even_grey(first, second)
    left = _disagreement(a, b, start)
    flow = fitted(start, LEVELS[0][0] * spacing, ranges)
    covariance = np.zeros((*a.shape, 3), np.float32)
    torn = np.ones(a.shape, np.float32)  # where the grid of the level is needed
    for level, (times, sigma, every) in enumerate(LEVELS):
        step = times * spacing
        if level:
            torn = _torn(a, b, flow, start, left)
            flow = flow + fitted(_soft(torn, 5) * (start - flow), step, ranges)
        active = (_onto(torn, step) > LEAST_SHARE * step * step).astype(np.float32)
        if not active.any() or (cancel is not None and cancel()):
            break
        ga, gb = (np.asarray(cv2.GaussianBlur(image, (0, 0), sigma), np.float32) for image in (a, b))
        seen = _compared(ga, gb, flow, every)
        flow = flow + _pixels(_step(seen, step // every, active, ranges), step, a.shape, ranges)
        if not level:
            alone = _covariance(seen, step // every, ranges) / np.float32(every**2)
            covariance = _pixels(np.asarray(alone, np.float32), step, a.shape, ranges)
    flow = flow + _soft(_torn(a, b, flow, start, left), 3) * (start - flow)
    apart = ALIKE + APART * _disagreement(a, b, flow)
    _add_missed(covariance, flow, start, backs, apart)
    return Flow(flow, covariance)


def search_flow(
    first: Field, second: Field, spacing: int, ranges: Ranges = serial_ranges
) -> tuple[Field, tuple[Field, Field]]:
    """Dense inverse search between two frames (H, W, C): (H, W, 2) pixels there; and, with less care, back.

    The way back is smoothed over `spacing` pixels and over twice as many.
    """
    grey = [(255.0 * np.clip(image, 0.0, 1.0)).astype(np.uint8) for image in even_grey(first, second)]
    found: list[Field] = [np.zeros((*image.shape, 2), np.float32) for image in grey] * 2
    if min(grey[0].shape) < LEAST_SIDE:
        return found[0], (found[1], found[1])

    def call(begin: int, end: int) -> None:
        for n in range(begin, end):
            search = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
            search.setFinestScale(0)
            search.setPatchStride((4, 5)[n])
            search.setGradientDescentIterations((12, 10)[n])
            search.setVariationalRefinementIterations((3, 2)[n])
            found[n] = np.asarray(search.calc(grey[n], grey[1 - n], found[n]), np.float32)
            if n:  # here, beside the longer search
                found[2:] = [fitted(found[n], step) for step in (spacing, 2 * spacing)]

    ranges(2, call, 1)
    return found[0], (found[2], found[3])


def _warped(image: Field, flow: Field, how: int) -> Field:
    """The second frame brought back by a flow."""
    x, y = np.empty((2, *flow.shape[:2]), np.float32)
    aim(flow, x, y)
    return np.asarray(cv2.remap(image, x, y, how, borderMode=cv2.BORDER_REPLICATE), np.float32)


def _unlit(difference: Field) -> Field:
    """A difference, or a gradient, without what is constant around a pixel: another exposure, a shadow."""
    return difference - np.asarray(cv2.blur(difference, (BIAS, BIAS)), np.float32)


def _disagreement(first: Field, second: Field, flow: Field) -> Field:
    """How much the frames differ around every pixel when the second is brought back by the flow."""
    difference = _warped(second, flow, cv2.INTER_LINEAR) - first
    return np.asarray(cv2.blur(np.abs(_unlit(difference)), (WINDOW, WINDOW)))


def _torn(first: Field, second: Field, flow: Field, start: Field, left: Field) -> Field:
    """1 where a flow is not believed against the search, which left the disagreement `left`, else 0."""
    here = _disagreement(first, second, flow)
    away = cv2.magnitude(*cv2.split(flow - start))
    torn = (here > left + LEAST_GREY) | ((away > FAR) & (here > BETTER * left))
    return np.asarray(cv2.dilate(torn.astype(np.float32), np.ones((3, 3), np.uint8)))


def _soft(area: Field, side: int) -> Field:
    return np.asarray(cv2.blur(area, (side, side)), np.float32)[:, :, None]


def _add_missed(covariance: Field, flow: Field, start: Field, backs: tuple[Field, Field], apart: Field) -> None:
    """`covariance` (H, W, 3) with what the searches say against the flow, as far as the frames are `apart` there.

    backs : the search back, smoothed less and more. The smaller gap counts: noise makes the one large, an edge of the
    motion the other. Of the search there only a common lean over a wide window does; its noise is no error of the flow.
    """
    fine, coarse = (_warped(back, flow, cv2.INTER_LINEAR) for back in backs)
    gap = np.empty_like(covariance)
    smaller_gap(flow, fine, coarse, gap)
    lean = np.asarray(cv2.blur(flow - start, (WIDE, WIDE)), np.float32)
    mixed_covariance(np.asarray(cv2.blur(gap, (NEAR, NEAR)), np.float32), lean, apart, NOTHING, covariance)


def fitted(field: Field, step: int, ranges: Ranges = serial_ranges) -> Field:
    """The smooth spline near a field (H, W, 2): averaged onto the grid with its own weights, corrected thrice.

    A correction stays on the grid: a spline at all pixels and put back onto the grid is two products with bands.
    """
    shape = field.shape[:2]
    down, across = (np.empty(((side - 1) // step + 4, 7), np.float32) for side in shape)
    for side, bands in zip(shape, (down, across), strict=True):
        overlaps(side, step, bands)
    ones = np.ones((1, len(down), len(across)), np.float32)  # a spline that is 1 everywhere
    weight = np.maximum(_banded(ones, down, across), np.float32(1e-6))
    sums = _onto_all([np.asarray(part, np.float32) for part in cv2.split(field)], step, ranges)
    grids = np.asarray(sums / weight, np.float32)
    for _ in range(3):
        grids += (sums - _banded(grids, down, across)) / weight
    return _pixels(grids, step, shape, ranges)


def _banded(grids: Field, down: Field, across: Field) -> Field:
    """Grids (K, rows, columns) times the bands (vertices, 7) of their columns and of their rows."""
    rows, columns = grids.shape[1:]
    wide = np.pad(grids, ((0, 0), (3, 3), (3, 3)))
    tall, out = np.zeros((len(grids), rows + 6, columns), np.float32), np.zeros_like(grids)
    for k in range(7):
        tall += across[:, k] * wide[:, :, k : k + columns]
    for k in range(7):
        out += down[:, k, None] * tall[:, k : k + rows]
    return out


class _Compared(NamedTuple):
    """What two frames say about a flow: Gauss-Newton's tensors and right side, squared residuals, 1 inside.

    Fields (rows, columns) of the pixels that count. noise : standard deviation of the residuals.
    """

    xx: Field
    xy: Field
    yy: Field
    bx: Field
    by: Field
    square: Field
    inside: Field
    noise: float


def _compared(first: Field, second: Field, flow: Field, every: int) -> _Compared:
    """What the frames say about a flow, in one of `every` rows and columns: a wide spline needs no more."""
    warped = _warped(second, flow, cv2.INTER_CUBIC)
    both = cv2.add(warped, first)
    gx = _unlit(np.asarray(cv2.Scharr(both, cv2.CV_32F, 1, 0, scale=1.0 / 64.0)))
    gy = _unlit(np.asarray(cv2.Scharr(both, cv2.CV_32F, 0, 1, scale=1.0 / 64.0)))
    rest = _unlit(warped - first)
    noise = 1.4826 * float(np.median(np.abs(rest[::3, ::3]))) + 1e-6
    shape = tuple(-(-side // every) for side in rest.shape)
    xx, xy, yy, bx, by, square, inside = (np.empty(shape, np.float32) for _ in range(7))
    data_term(rest, flow, gx, gy, noise, every, xx, xy, yy, bx, by, square, inside)
    return _Compared(xx, xy, yy, bx, by, square, inside, noise)


def _step(seen: _Compared, step: int, active: Field, ranges: Ranges) -> Field:
    """One step of Gauss-Newton on the vertices `active`: (2, rows, columns) to be added to the flow's spline."""
    squares = _onto_all([seen.xx, seen.yy], step, ranges, 2)
    stiff = _stiffness(squares)
    free = active / (squares + stiff)
    right = _onto_all([seen.bx, seen.by], step, ranges)
    return np.clip(_solve(seen, right, free, stiff, step, ranges), -MOST, MOST)


def _covariance(seen: _Compared, step: int, ranges: Ranges) -> Field:
    """Of every vertex (3, rows, columns), as it alone would have it."""
    xx, xy, yy = _onto_all([seen.xx, seen.xy, seen.yy], step, ranges, 2)
    # how well the frames agree around a vertex; pixels outside say nothing: as bad as a whole grey
    weight, square, inside = _onto_all([np.ones_like(seen.inside), seen.square, seen.inside], step, ranges)
    variance = (square + (weight - inside)) / np.maximum(weight, 1e-6)
    variance = np.maximum(variance, np.float32(max(0.25 * seen.noise**2, ROUNDING**2)))
    stiff = _stiffness(np.stack((xx, yy)))
    xx, yy = xx + stiff, yy + stiff
    return np.asarray(np.stack((yy, -xy, xx)) * (variance / (xx * yy - xy * xy)), np.float32)


def _stiffness(squares: Field) -> np.float32:
    """Of the diagonal (2, rows, columns) of the normal equations."""
    return np.float32(STIFFNESS * 2.0 * float(np.mean(squares)) + 1e-12)


def _onto(field: Field, step: int, power: int = 1) -> Field:
    grid = np.empty(_grid_shape(field.shape[0], field.shape[1], step), np.float32)
    gather(field, step, power, grid)
    return grid


def _onto_all(fields: list[Field], step: int, ranges: Ranges, power: int = 1) -> Field:
    """Fields (H, W) onto the grid: (K, rows, columns)."""
    grids = np.empty((len(fields), *_grid_shape(fields[0].shape[0], fields[0].shape[1], step)), np.float32)

    def call(begin: int, end: int) -> None:
        for k in range(begin, end):
            gather(fields[k], step, power, grids[k])

    ranges(len(fields), call, 1)
    return grids


def _pixels(grids: Field, step: int, shape: tuple[int, ...], ranges: Ranges) -> Field:
    """Splines (K, rows, columns) at all pixels: (H, W, K)."""
    parts = np.empty((len(grids), *shape), np.float32)

    def call(begin: int, end: int) -> None:
        for k in range(begin, end):
            spread(np.ascontiguousarray(grids[k], np.float32), step, parts[k])

    ranges(len(grids), call, 1)
    return np.asarray(cv2.merge(list(parts)), np.float32)


def _solve(seen: _Compared, right: Field, free: Field, stiff: np.float32, step: int, ranges: Ranges) -> Field:
    """Conjugate gradients: (2, rows, columns) of coefficients.

    free : the inverse of the diagonal, which preconditions; 0 for vertices that are held still.
    """

    # a cell is reached by the vertices of its four rows and columns
    busy = np.ascontiguousarray(cv2.dilate((free[0] > 0).astype(np.uint8), FOUR, anchor=(0, 0))[:-3, :-3] > 0)

    parts = np.empty((BANDS, *right.shape), np.float32)
    edges = [len(busy) * band // BANDS for band in range(BANDS + 1)]

    def apply(v: Field) -> Field:
        def call(begin: int, end: int) -> None:
            for n in range(begin, end):
                normal_product(v, busy, seen.xx, seen.xy, seen.yy, step, edges[n], edges[n + 1], parts[n])

        ranges(BANDS, call, 1)
        out = parts.sum(axis=0)
        for c in range(2):
            out[c] += stiff * (v[c] - 0.25 * np.asarray(cv2.filter2D(v[c], -1, CROSS, borderType=cv2.BORDER_REPLICATE)))
        return out

    rest = right
    x = np.zeros_like(rest)
    z = free * rest
    p, now = z.copy(), float((rest * z).sum())
    for _ in range(SWEEPS):
        if now <= 1e-12:
            break
        image = apply(p)
        along = now / max(float((p * image).sum()), 1e-20)
        x += np.float32(along) * p
        rest = rest - np.float32(along) * image
        z = free * rest
        before, now = now, float((rest * z).sum())
        p = z + np.float32(now / before) * p
    return x


FOUR = np.ones((4, 4), np.uint8)
CROSS = np.array([[0, 1, 0], [1, 0, 1], [0, 1, 0]], np.float32)


def _grid_shape(height: int, width: int, step: int) -> tuple[int, int]:
    return (height - 1) // step + 4, (width - 1) // step + 4
