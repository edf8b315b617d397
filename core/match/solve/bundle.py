"""Bundle adjustment: Levenberg-Marquardt with the Schur complement.

The blocks of the larger side, points or frames, are eliminated; what is kept is one dense system. (Triggs et al.,
"Bundle Adjustment: A Modern Synthesis", 2000, sections 6 and 7.)
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.spatial.transform import Rotation

from core.match.solve.bundle_kernels import accumulate
from core.match.solve.constraints import Pull
from core.match.solve.state import (
    FRAME_COLUMNS,
    FRAME_FOCAL,
    Array,
    Observations,
    Rows,
    State,
)

LEAST_DAMPING = 1e-12
MOST_DAMPING = 1e8
POSE = (0, 1, 2, 3, 4, 5)
TURN = (0, 1, 2)


class Free(NamedTuple):
    """What may change: columns of every frame, columns of the lens, the points.

    zoom : (F, F) float64 quadratic cost on the frames' focal lengths (smoothness), or None.
    pull : what is known of the points, or None.
    """

    frame: tuple[int, ...] = POSE
    lens: tuple[int, ...] = ()
    points: bool = True
    zoom: Array | None = None
    pull: Pull | None = None


RIGID = Free()


class Normal(NamedTuple):
    """Blocks of the normal equations, of all columns; see :func:`accumulate`. pulled : (3P, 3P) of constraints."""

    cost: float
    frames: Array
    frames_right: Array
    crossed: Array
    points: Array
    points_right: Array
    lens: Array
    lens_right: Array
    frame_lens: Array
    point_lens: Array
    pulled: Array | None = None


class Adjusted(NamedTuple):
    """state : where it ended. cost : robust, of the whitened residuals. iterations : steps tried."""

    state: State
    cost: float
    iterations: int


def normal_equations(state: State, observations: Observations, scale: float, free: Free) -> Normal:
    """The blocks at a state; `scale` is that of the Cauchy loss in standard deviations, 0 for squares."""
    frames, points, count = len(state.rotation), len(state.points), len(observations.frame)
    lens = len(state.lens)
    blocks = (
        np.zeros((frames, FRAME_COLUMNS, FRAME_COLUMNS)),
        np.zeros((frames, FRAME_COLUMNS)),
        np.zeros((count, FRAME_COLUMNS, 3)),
        np.zeros((points, 3, 3)),
        np.zeros((points, 3)),
        np.zeros((lens, lens)),
        np.zeros(lens),
        np.zeros((frames, FRAME_COLUMNS, lens)),
        np.zeros((points, 3, lens)),
    )
    right_of_frames, of_points, right_of_points = blocks[1], blocks[3], blocks[4]
    cost = accumulate(
        observations.frame,
        observations.track,
        observations.xy,
        observations.root,
        state.rotation,
        state.translation,
        state.points,
        state.focal,
        state.lens,
        scale,
        blocks[0],
        right_of_frames,
        blocks[2],
        right_of_points,
        of_points,
        blocks[5],
        blocks[6],
        blocks[7],
        blocks[8],
    )
    if free.zoom is not None:
        pull = free.zoom @ state.focal
        cost += float(state.focal @ pull)
        right_of_frames[:, FRAME_FOCAL] -= pull
    pulled = None
    if free.pull is not None and free.points:
        more, right, pulled = free.pull.normal(state.points)
        cost += more
        right_of_points += right
    return Normal(cost, *blocks, pulled)


def adjust(
    state: State,
    observations: Observations,
    free: Free = RIGID,
    *,
    scale: float = 0.0,
    iterations: int = 30,
    tolerance: float = 1e-7,
    damping: float = 1e-4,
    least_damping: float = LEAST_DAMPING,
    settled: float = MOST_DAMPING,
    progress: Callable[[str], None] = lambda words: None,
) -> Adjusted:
    """Move what is free to where the (robust) squares of the whitened residuals are least.

    scale : of the Cauchy loss in standard deviations; 0 means plain squares.
    tolerance : ends when a step lowers the cost by less than this part.
    least_damping : above 0 where something cannot be told, as the distance of points seen by a camera that only turns.
    settled : it ends at no greater damping than this, which would hold what is told weakly where it began: a zoom of a
        long lens against the way ahead.
    progress : called without words around every step; what it raises ends the adjustment.
    """
    progress("")
    normal = normal_equations(state, observations, scale, free)
    tried = 0
    while tried < iterations and damping < MOST_DAMPING:
        tried += 1
        progress("")
        moved = _moved(state, _step(normal, observations, free, damping), free)
        progress("")
        if moved is not None:
            after = normal_equations(moved, observations, scale, free)
            if after.cost < normal.cost:
                gained = normal.cost - after.cost
                state, normal = moved, after
                damping = max(damping * 0.1, least_damping)
                if gained < tolerance * max(normal.cost, 1e-30):
                    if damping <= max(settled, least_damping):
                        break
                    damping = max(damping * 0.01, settled, least_damping)
                continue
        damping *= 10.0
    return Adjusted(state, normal.cost, tried)


class Step(NamedTuple):
    """frames (F, 7), points (P, 3), lens (L,)."""

    frames: Array
    points: Array
    lens: Array


class Reduced(NamedTuple):
    """The dense system that is left, and how to get the rest back.

    matrix : (n, n), right : (n,), over the free columns of the lens, then the poses and zooms of frames, or the points
    and the zooms. roots : (m, d, d) inverses of the Cholesky factors of the eliminated blocks.
    across : (m d, n) those times the coupling. right_out : (m, d) those times the eliminated right sides.
    frames_out : whether the poses were eliminated, not the points.
    """

    matrix: Array
    right: Array
    roots: Array
    across: Array
    right_out: Array
    frames_out: bool


class _Sides(NamedTuple):
    """The kept system, and the blocks to be eliminated with their coupling (m, d, n) to it."""

    matrix: Array
    right: Array
    blocks: Array
    rights: Array
    coupling: Array


def _poses_kept(normal: Normal, observations: Observations, free: Free) -> _Sides:
    columns, lens = list(free.frame), list(free.lens)
    width, count, points = len(columns), len(normal.frames), len(normal.points)
    size = len(lens) + width * count
    matrix, right = _with_lens(normal, lens, size)
    at = len(lens) + np.arange(width * count).reshape(count, width)
    matrix[at[:, :, None], at[:, None, :]] = normal.frames[:, columns][:, :, columns]
    right[at] = normal.frames_right[:, columns]
    _cross(matrix, at, normal.frame_lens[:, columns][:, :, lens])
    if free.zoom is not None:
        zooms = at[:, columns.index(FRAME_FOCAL)]
        matrix[np.ix_(zooms, zooms)] += free.zoom
    coupling = np.zeros((points, 3, size))
    coupling[:, :, : len(lens)] = normal.point_lens[:, :, lens]
    coupling[observations.track[:, None, None], np.arange(3)[:, None], at[observations.frame][:, None, :]] = (
        normal.crossed[:, columns].transpose(0, 2, 1)
    )
    return _Sides(matrix, right, normal.points, normal.points_right, coupling)


def _points_kept(normal: Normal, observations: Observations, free: Free) -> _Sides:
    lens, poses = list(free.lens), [column for column in free.frame if column != FRAME_FOCAL]
    count, width, points = len(normal.frames), len(poses), len(normal.points) if free.points else 0
    zoomed = FRAME_FOCAL in free.frame
    size = len(lens) + 3 * points + (count if zoomed else 0)
    matrix, right = _with_lens(normal, lens, size)
    coupling = np.zeros((count, width, size))
    coupling[:, :, : len(lens)] = normal.frame_lens[:, poses][:, :, lens]
    at = len(lens) + np.arange(3 * points).reshape(points, 3)
    if points:
        matrix[at[:, :, None], at[:, None, :]] = normal.points
        if normal.pulled is not None:
            matrix[at[0, 0] : at[-1, -1] + 1, at[0, 0] : at[-1, -1] + 1] += normal.pulled
        right[at] = normal.points_right
        _cross(matrix, at, normal.point_lens[:, :, lens])
        coupling[observations.frame[:, None, None], np.arange(width)[:, None], at[observations.track][:, None, :]] = (
            normal.crossed[:, poses]
        )
    if zoomed:
        zooms = len(lens) + 3 * points + np.arange(count)
        matrix[zooms, zooms] = normal.frames[:, FRAME_FOCAL, FRAME_FOCAL]
        right[zooms] = normal.frames_right[:, FRAME_FOCAL]
        _cross(matrix, zooms[:, None], normal.frame_lens[:, [FRAME_FOCAL]][:, :, lens])
        coupling[np.arange(count), :, zooms] = normal.frames[:, FRAME_FOCAL][:, poses]
        if points:
            own = zooms[observations.frame]
            matrix[own[:, None], at[observations.track]] = normal.crossed[:, FRAME_FOCAL]
            matrix[at[observations.track], own[:, None]] = normal.crossed[:, FRAME_FOCAL]
        if free.zoom is not None:
            matrix[np.ix_(zooms, zooms)] += free.zoom
    return _Sides(matrix, right, normal.frames[:, poses][:, :, poses], normal.frames_right[:, poses], coupling)


def _with_lens(normal: Normal, lens: list[int], size: int) -> tuple[Array, Array]:
    matrix, right = np.zeros((size, size)), np.zeros(size)
    matrix[: len(lens), : len(lens)] = normal.lens[np.ix_(lens, lens)]
    right[: len(lens)] = normal.lens_right[lens]
    return matrix, right


def _cross(matrix: Array, at: NDArray, blocks: Array) -> None:
    """Write blocks (m, d, lenses) that couple rows `at` (m, d) with the lens, on both sides of the diagonal."""
    lenses = blocks.shape[2]
    matrix[at.ravel(), :lenses] = blocks.reshape(at.size, lenses)
    matrix[:lenses, at.ravel()] = blocks.reshape(at.size, lenses).T


def reduced(
    normal: Normal, observations: Observations, free: Free, damping: float, frames_out: bool | None = None
) -> Reduced | None:
    """Eliminate one side, the larger one when it is not said which; None when a block is singular."""
    poses = len([column for column in free.frame if column != FRAME_FOCAL])
    if frames_out is None:
        frames_out = not free.points or free.pull is not None or poses * len(normal.frames) > 3 * len(normal.points)
    sides = (_points_kept if frames_out else _poses_kept)(normal, observations, free)
    matrix, size, d = sides.matrix, len(sides.right), sides.blocks.shape[1]
    matrix[np.diag_indices(size)] += damping * (matrix.diagonal() + 1e-12)
    diagonal = np.einsum("mii->mi", sides.blocks)
    blocks = sides.blocks + (damping * diagonal + 1e-12)[:, :, None] * np.eye(d)
    try:
        roots = np.linalg.inv(np.linalg.cholesky(blocks))
    except np.linalg.LinAlgError:
        return None
    across = np.matmul(roots, sides.coupling).reshape(len(blocks) * d, size)
    right_out = np.einsum("mij,mj->mi", roots, sides.rights)
    return Reduced(
        matrix - across.T @ across, sides.right - across.T @ right_out.ravel(), roots, across, right_out, frames_out
    )


def _step(normal: Normal, observations: Observations, free: Free, damping: float) -> Step | None:
    system = reduced(normal, observations, free, damping)
    if system is None:
        return None
    kept = np.zeros(0)
    if len(system.right):
        try:
            kept = cho_solve(cho_factor(system.matrix, lower=True, check_finite=False), system.right)
        except LinAlgError:
            return None
    rest = system.right_out - (system.across @ kept).reshape(system.right_out.shape)
    eliminated = np.einsum("mji,mj->mi", system.roots, rest)
    step = Step(*(np.zeros_like(right) for right in (normal.frames_right, normal.points_right, normal.lens_right)))
    step.lens[list(free.lens)] = kept[: len(free.lens)]
    tail = kept[len(free.lens) :]
    if not system.frames_out:
        step.points[:] = eliminated
        step.frames[:, list(free.frame)] = tail.reshape(len(step.frames), len(free.frame))
        return step
    step.frames[:, [column for column in free.frame if column != FRAME_FOCAL]] = eliminated
    if free.points:
        step.points[:] = tail[: step.points.size].reshape(-1, 3)
    if FRAME_FOCAL in free.frame:
        step.frames[:, FRAME_FOCAL] = tail[step.points.size if free.points else 0 :]
    return step


def _moved(state: State, step: Step | None, free: Free) -> State | None:
    if step is None or not all(np.isfinite(part).all() for part in step):
        return None
    turns = step.frames[:, :3]
    if np.abs(turns).max(initial=0.0) > 3.0 or np.abs(step.lens[:4]).max() > 3.0:
        return None
    rotation = state.rotation
    if turns.any():
        rotation = Rotation.from_rotvec(turns).as_matrix() @ rotation
    return State(
        np.ascontiguousarray(rotation),
        state.translation + step.frames[:, 3:6],
        state.points + step.points,
        state.focal + step.frames[:, FRAME_FOCAL],
        state.lens + step.lens,
    )


def smooth_zoom(frames: Rows, deviation: float = 1e-3) -> Array:
    """(F, F) quadratic cost of a focal length whose slope wanders by `deviation` (of its logarithm) a frame.

    frames : (F,) their numbers, rising; with gaps between keyframes the slope may wander more.
    """
    count = len(frames)
    bend = np.zeros((max(0, count - 2), count))
    for k in range(count - 2):
        a, b = float(frames[k + 1] - frames[k]), float(frames[k + 2] - frames[k + 1])
        row = np.array([1.0 / a, -1.0 / a - 1.0 / b, 1.0 / b])
        bend[k, k : k + 3] = row / (deviation * np.sqrt(0.5 * (a + b)))
    hold = np.zeros((count, count))
    hold[0, 0] = 1e-6  # the level belongs to the data
    return bend.T @ bend + hold
