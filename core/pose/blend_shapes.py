"""Blend shapes: named numbers that move vertices, with shapes in between; and the kernel that adds them."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numba import njit
from numba.core.types import Array, boolean, float32, float64, int32, int64
from numpy.typing import ArrayLike, NDArray

from core.record import Record, column, freeze
from core.workers import serial_ranges

LEAST_APART = 1e-6  # of two weights at which a shape has targets


class BlendShapes(Record):
    """Shapes over one mesh, each a row of sparse targets; the last word in glTF is morph target.

    A shape moves along straight lines through its targets: nothing at weight 0, target after target at the weights
    `at`, and straight on beyond the first and the last (as in UsdSkel).

    names : of the shapes, unique; each is also the name of the control that drives it.
    shape : (T,) int32, the shape each target belongs to, ascending; every shape has at least one target.
    at : (T,) float64, weight at which the target is reached, ascending within a shape, never 0.
    starts : (T + 1,) int64, first row of each target in `vertices` and `offsets`.
    vertices : (N,) int32, ascending within a target, each once.
    offsets : (N, 3) float32, metres, object space before skinning: from the mesh at rest to the target.
    """

    names: tuple[str, ...]
    shape: np.ndarray
    at: np.ndarray
    starts: np.ndarray
    vertices: np.ndarray
    offsets: np.ndarray

    def __post_init__(self) -> None:
        if len(set(self.names)) != len(self.names) or not all(self.names):
            raise ValueError("BlendShapes.names must be unique and not empty")
        column(self, "shape", np.int32, (None,))
        column(self, "at", np.float64, self.shape.shape)
        column(self, "starts", np.int64, (len(self.shape) + 1,))
        column(self, "vertices", np.int32, (None,))
        column(self, "offsets", np.float32, (len(self.vertices), 3))
        if not np.array_equal(np.unique(self.shape), np.arange(len(self.names))) or (np.diff(self.shape) < 0).any():
            raise ValueError("BlendShapes.shape must name every shape, in ascending order")
        within = np.diff(self.shape) == 0
        if (np.abs(self.at) < LEAST_APART).any() or (np.diff(self.at)[within] < LEAST_APART).any():
            raise ValueError("BlendShapes.at must ascend within a shape and never be 0")
        if self.starts[0] != 0 or (np.diff(self.starts) < 0).any() or self.starts[-1] != len(self.vertices):
            raise ValueError("BlendShapes.starts must ascend from 0 to the number of offsets")
        first = np.zeros(len(self.vertices) + 1, np.bool_)
        first[self.starts] = True
        if (self.vertices < 0).any() or (np.diff(self.vertices)[~first[1:-1]] <= 0).any():
            raise ValueError("BlendShapes.vertices must ascend within a target")


def targets_from_dense(
    names: tuple[str, ...], shape: ArrayLike, at: ArrayLike, offsets: list[NDArray[np.float32]]
) -> BlendShapes:
    """Shapes from dense offsets, one (V, 3) for each target; rows that do not move are left out."""
    rows = [np.flatnonzero((np.asarray(o) != 0.0).any(axis=1)) for o in offsets]
    starts = np.cumsum([0, *map(len, rows)])
    return BlendShapes(
        names=names, shape=freeze(np.array(shape, np.int32)), at=freeze(np.array(at, np.float64)),
        starts=freeze(starts.astype(np.int64)),
        vertices=freeze(np.concatenate([np.zeros(0, np.int64), *rows]).astype(np.int32)),
        offsets=freeze(np.concatenate([np.zeros((0, 3)), *(o[r] for o, r in zip(offsets, rows))]).astype(np.float32)),
    )


def dense_offsets(shapes: BlendShapes, target: int, vertices: int) -> NDArray[np.float32]:
    """Offsets (V, 3) float32 of one target."""
    out = np.zeros((vertices, 3), np.float32)
    rows = slice(int(shapes.starts[target]), int(shapes.starts[target + 1]))
    out[shapes.vertices[rows]] = shapes.offsets[rows]
    return out


def shape_weights(shapes: BlendShapes, numbers: Mapping[str, float]) -> NDArray[np.float64]:
    """Weights (S,) of all shapes from numbers by name; a shape that is not named rests at 0."""
    return np.array([float(numbers.get(name, 0.0)) for name in shapes.names], np.float64)


def target_weights(shapes: BlendShapes, weights: ArrayLike) -> NDArray[np.float64]:
    """How much of every target (T,) float64 the weights (S,) of the shapes ask for."""
    out = np.zeros(len(shapes.shape))
    wanted = np.asarray(weights, np.float64)
    for row, weight in enumerate(wanted.tolist()):
        if weight == 0.0:
            continue
        mine = np.flatnonzero(shapes.shape == row)
        stops = np.append(shapes.at[mine], 0.0)
        targets = np.append(mine, -1)  # the mesh at rest is the target at 0
        order = np.argsort(stops)
        stops, targets = stops[order], targets[order]
        high = min(max(int(np.searchsorted(stops, weight)), 1), len(stops) - 1)
        part = (weight - stops[high - 1]) / (stops[high] - stops[high - 1])
        for target, share in ((targets[high - 1], 1.0 - part), (targets[high], part)):
            if target >= 0:
                out[target] = share
    return out


def morphed(
    points: NDArray[np.float32], shapes: BlendShapes, weights: ArrayLike,
    ranges: Callable[..., None] = serial_ranges,
) -> NDArray[np.float32]:
    """Points (V, 3) float32 moved by the shapes at weights (S,), before skinning."""
    share = target_weights(shapes, weights)
    used = np.flatnonzero(share != 0.0)
    out = np.array(points, np.float32, order="C")
    ranges(len(out), lambda a, b: add_targets(
        shapes.starts, shapes.vertices, shapes.offsets, used, share, out, a, b))
    return out


@njit(
    boolean(Array(int64, 1, "C", readonly=True), Array(int32, 1, "C", readonly=True),
            Array(float32, 2, "C", readonly=True), int64[::1], float64[::1], float32[:, ::1], int64, int64),
    cache=True, nogil=True,
)
def add_targets(
    starts: np.ndarray, vertices: np.ndarray, offsets: np.ndarray, used: np.ndarray, share: np.ndarray,
    out: np.ndarray, first: int, last: int,
) -> bool:
    """Add ``share[t] * offsets`` of the targets `used` to rows first .. last of `out`; True when any row moved."""
    moved = False
    for u in range(len(used)):
        t = used[u]
        w = float32(share[t])
        low, high = starts[t], starts[t + 1]
        end = high
        while low < high:  # the first row of this range: vertices ascend within a target
            middle = (low + high) // 2
            if vertices[middle] < first:
                low = middle + 1
            else:
                high = middle
        while low < end and vertices[low] < last:
            v = vertices[low]
            out[v, 0] += w * offsets[low, 0]
            out[v, 1] += w * offsets[low, 1]
            out[v, 2] += w * offsets[low, 2]
            low += 1
            moved = True
    return moved
