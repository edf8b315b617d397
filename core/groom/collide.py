"""Hair stays outside the skin: chains are lifted over a signed distance field, points and segments alike."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from core.groom.chain import first_free, read_chain, rebuild_chain, write_chain
from core.groom.guides import Guides
from core.groom.region import editable
from core.mesh.distance_field import DistanceField, sample_field, sample_gradient
from core.record import freeze
from core.workers import serial_ranges

Ranges = Callable[[int, Callable[[int, int], object]], None]

F32_2D = types.Array(types.float32, 2, "C", readonly=True)
F32_3D = types.Array(types.float32, 3, "C", readonly=True)
F64_1D = types.Array(types.float64, 1, "C", readonly=True)
NO_FIELD = DistanceField(freeze(np.zeros(3)), 1.0, 0.0, freeze(np.zeros((0, 0, 0), np.float32)))
REPEATS = 4
ESCAPES = 5
MARGIN = 0.25  # of a cell: by so much a grid may read a convex edge too far out
LEAST_GRADIENT = 0.3  # a distance grows by 1 per metre; less is the flat rest beyond the band, or a ridge


@njit(cache=True, nogil=True, error_model="numpy")
def collide_chain(x, q, lengths, first, values, origin, cell, clearance, move):  # type: ignore[no-untyped-def]
    """Lift segments `first` .. end of one chain off the skin, root to tip, lengths kept; returns the lowest distance.

    Each segment is sampled at its end and between, at most a cell of the grid apart, unless both ends are so far out
    that nothing between can touch. The sample that asks for most raises the direction of the segment along its normal;
    what lies beyond is carried. Distances are read relative to that of the root, which lies on the skin where the
    grid has an error there; the correction fades over two cells, over which a margin for its other errors grows.
    Clearance grows over the first segment.
    With `move` False nothing is changed, only measured.
    """
    count = lengths.shape[0]
    at_root = sample_field(values, origin, cell, x[0, 0], x[0, 1], x[0, 2])
    at_root = min(max(at_root, -2.0 * cell), 2.0 * cell)
    fade = 0.5 / cell
    margin = MARGIN * cell
    arc = 0.0
    for j in range(first):
        arc += lengths[j]
    before = sample_field(values, origin, cell, x[first, 0], x[first, 1], x[first, 2])
    before -= at_root * max(0.0, 1.0 - arc * fade)
    ramp = max(lengths[0], 1e-12)
    lowest = np.inf
    for j in range(first, count):
        length = lengths[j]
        if length <= 0.0:
            x[j + 1, 0], x[j + 1, 1], x[j + 1, 2] = x[j, 0], x[j, 1], x[j, 2]
            continue
        pieces = min(8, max(2, int(length / cell) + 1))
        at_end = 0.0
        here = np.inf
        ex = ey = ez = 0.0
        for repeat in range(REPEATS + ESCAPES + 1):
            here = np.inf
            worst, worst_t = 0.0, 1.0
            for piece in range(pieces, 0, -1):
                t = piece / pieces
                s = arc + t * length
                d = sample_field(
                    values, origin, cell,
                    x[j, 0] + t * length * q[j, 0], x[j, 1] + t * length * q[j, 1], x[j, 2] + t * length * q[j, 2],
                ) - at_root * max(0.0, 1.0 - s * fade)
                need = clearance * min(1.0, s / ramp) + margin * min(1.0, s * fade)
                here = min(here, d)
                if (need - d) / t > worst:
                    worst, worst_t = (need - d) / t, t
                if piece == pieces:
                    at_end = d
                    if before + d > length + 2.0 * (clearance + margin):
                        break
            if worst <= 1e-6 * length or repeat == REPEATS + ESCAPES or not move:
                break
            if repeat >= REPEATS:
                # Sharp or thin skin, whose normals fight each other: away from what is nearest to the joint before.
                if here >= 0.0:
                    break
                if repeat == REPEATS:
                    _, ex, ey, ez = sample_gradient(values, origin, cell, x[j, 0], x[j, 1], x[j, 2])
                    size = math.sqrt(ex * ex + ey * ey + ez * ez)
                    if size < LEAST_GRADIENT:
                        break
                    ex, ey, ez = ex / size, ey / size, ez / size
                push = 0.5 * 2.0 ** (repeat - REPEATS)
                q[j, 0], q[j, 1], q[j, 2] = q[j, 0] + push * ex, q[j, 1] + push * ey, q[j, 2] + push * ez
                size = math.sqrt(q[j, 0] * q[j, 0] + q[j, 1] * q[j, 1] + q[j, 2] * q[j, 2])
                if size < 1e-6:
                    q[j, 0], q[j, 1], q[j, 2] = ex, ey, ez
                else:
                    q[j, 0], q[j, 1], q[j, 2] = q[j, 0] / size, q[j, 1] / size, q[j, 2] / size
                continue
            step = worst_t * length
            _, nx, ny, nz = sample_gradient(
                values, origin, cell,
                x[j, 0] + step * q[j, 0], x[j, 1] + step * q[j, 1], x[j, 2] + step * q[j, 2],
            )
            size = math.sqrt(nx * nx + ny * ny + nz * nz)
            if size < LEAST_GRADIENT:
                continue
            nx, ny, nz = nx / size, ny / size, nz / size
            rise = q[j, 0] * nx + q[j, 1] * ny + q[j, 2] * nz
            tx, ty, tz = q[j, 0] - rise * nx, q[j, 1] - rise * ny, q[j, 2] - rise * nz
            along = tx * tx + ty * ty + tz * tz
            wanted = min(1.0, rise + 1.02 * worst / length)
            if along < 1e-12:  # straight into the skin: any way along it will do
                if abs(nx) < 0.6:
                    tx, ty, tz = 0.0, nz, -ny
                else:
                    tx, ty, tz = -nz, 0.0, nx
                along = tx * tx + ty * ty + tz * tz
            keep = math.sqrt(max(0.0, 1.0 - wanted * wanted) / along)
            q[j, 0], q[j, 1], q[j, 2] = keep * tx + wanted * nx, keep * ty + wanted * ny, keep * tz + wanted * nz
        lowest = min(lowest, here)
        before = at_end
        arc += length
        if move:
            for k in range(3):
                x[j + 1, k] = x[j, k] + length * q[j, k]
    return lowest


@njit(
    types.void(
        types.int64, types.int64, types.float32[:, :, ::1], F32_2D, types.Array(types.bool_, 1, "C", readonly=True),
        F32_3D, F64_1D, types.float64, types.float64,
    ),
    cache=True, nogil=True, error_model="numpy",
)
def _push_out_rows(start, stop, points, hold, edit, values, origin, cell, clearance):  # type: ignore[no-untyped-def]
    count = points.shape[1]
    x, q, lengths = np.empty((count, 3)), np.empty((count - 1, 3)), np.empty(count - 1)
    freedom = np.empty(count - 1)
    for row in range(start, stop):
        if not edit[row]:
            continue
        first = first_free(hold, row, freedom)
        if first == count - 1:
            continue
        quantum = read_chain(points, row, x, q, lengths)
        total = lengths.sum()
        gap = clearance * total
        low = collide_chain(x, q, lengths, first, values, origin, cell, gap, False)
        if low >= 0.5 * gap * (lengths[0] / total if first == 0 and total > 0.0 else 1.0):
            continue
        collide_chain(x, q, lengths, first, values, origin, cell, gap, True)
        rebuild_chain(x, q, lengths, first)
        write_chain(points, row, x, lengths, first, quantum)


@njit(
    types.void(
        types.int64, types.int64, F32_3D, F32_3D, F64_1D, types.float64,
        types.float64[::1],
    ),
    cache=True, nogil=True, error_model="numpy",
)
def _lowest_rows(start, stop, points, values, origin, cell, out):  # type: ignore[no-untyped-def]
    count = points.shape[1]
    x, q, lengths = np.empty((count, 3)), np.empty((count - 1, 3)), np.empty(count - 1)
    for row in range(start, stop):
        read_chain(points, row, x, q, lengths)
        out[row] = collide_chain(x, q, lengths, 0, values, origin, cell, 0.0, False)


def push_out(
    guides: Guides, field: DistanceField, clearance: float = 0.005, mask: NDArray[np.bool_] | None = None,
    ranges: Ranges = serial_ranges,
) -> Guides:
    """Guides lifted off the skin: no point and no segment below it, lengths kept.

    Parameters
    ----------
    field : signed distance to the skin, object space.
    clearance : distance kept from the skin, as a fraction of the strand's length.
    mask : (G,) bool, strands to treat; all editable ones when None.
    """
    edit = editable(guides) if mask is None else editable(guides) & mask
    points = guides.points.copy()
    ranges(len(guides), lambda a, b: _push_out_rows(
        a, b, points, guides.hold, edit, field.values, field.origin, field.cell, float(clearance)))
    return guides.replace(points=freeze(points))


def lowest_distances(
    points: NDArray[np.float32], field: DistanceField, ranges: Ranges = serial_ranges
) -> NDArray[np.float64]:
    """(G,) metres: the lowest signed distance met along each strand (points and segments), negative inside the skin.

    Distances count from that of the root, which lies on the skin (see :func:`collide_chain`).
    """
    out = np.full(len(points), np.inf)
    ranges(len(points), lambda a, b: _lowest_rows(a, b, points, field.values, field.origin, field.cell, out))
    return out

