"""A camera that only turns: rotations by chaining, points as directions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from core.match.solve.bundle import POSE, TURN, Adjusted, Free, adjust
from core.match.solve.slides import correlation
from core.match.solve.state import FRAME_FOCAL, Array, Observations, State, bearings

ROUNDS = 8  # of reweighting
FEWEST = 3  # tracks two frames must share
MOST = 32  # frames on which it is tried whether the camera moves
BY_CHANCE = 12.0
DISTANCE = 1e-6  # damping: how far a point is cannot be told


def turn_between(first: Array, second: Array, noise: float) -> Array:
    """(3, 3) rotation that brings unit directions `first` (N, 3) to `second`, robust against outliers.

    (Kabsch, "A solution for the best rotation to relate two sets of vectors", 1976, reweighted with Cauchy's weights.)
    noise : radians.
    """
    weight = np.ones(len(first))
    turn = np.eye(3)
    for _ in range(ROUNDS):
        u, _, vt = np.linalg.svd((first * weight[:, None]).T @ second)
        turn = vt.T @ np.diag([1.0, 1.0, np.sign(np.linalg.det(vt.T @ u.T))]) @ u.T
        error = np.linalg.norm(first @ turn.T - second, axis=1)
        scale = max(2.0 * noise, 1.5 * float(np.median(error)))
        weight = 1.0 / (1.0 + (error / scale) ** 2)
    return turn


def solve_nodal(
    observations: Observations,
    frames: int,
    tracks: int,
    lens: Array,
    noise: float,
    *,
    scale: float,
    lens_columns: tuple[int, ...] = (),
    zoom: Array | None = None,
    progress: Callable[[str], None] = lambda words: None,
) -> Adjusted | None:
    """Rotations of all frames with every track at distance 1; None when the frames hang together by too few tracks.

    noise : pixels. scale : of the robust loss, in whitened units.
    lens_columns : what of the lens is free. zoom : smoothness of the frames' own focal lengths, when they are free.
    progress : as :func:`solve` has it.
    """
    unit = bearings(lens, 0.0, observations.xy)
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    table = np.full((frames, tracks, 3), np.nan)
    table[observations.frame, observations.track] = unit
    angle = noise * float(np.exp(-lens[0]))
    rotation = np.tile(np.eye(3), (frames, 1, 1))
    for k in range(1, frames):
        both = np.isfinite(table[k - 1, :, 0]) & np.isfinite(table[k, :, 0])
        if both.sum() < FEWEST:
            return None
        rotation[k] = turn_between(table[k - 1, both], table[k, both], angle) @ rotation[k - 1]
    world = np.einsum("nji,nj->ni", rotation[observations.frame], unit)
    points = np.zeros((tracks, 3))
    np.add.at(points, observations.track, world)
    length = np.linalg.norm(points, axis=1, keepdims=True)
    points = np.where(length > 1e-9, points / np.maximum(length, 1e-9), [0.0, 0.0, 1.0])
    state = State(rotation, np.zeros((frames, 3)), points, np.zeros(frames), lens.copy())
    frame = (*TURN, FRAME_FOCAL) if zoom is not None else TURN
    return adjust(
        state,
        observations,
        Free(frame=frame, lens=lens_columns, zoom=zoom),
        scale=scale,
        least_damping=DISTANCE,
        iterations=12,
        tolerance=1e-3,
        progress=progress,
    )


def parallax(state: State, observations: Observations, sigma: float) -> float:
    """Whether a camera that was solved as one that only turns moves after all.

    By how much the squares fall when it may, beyond what the added parameters take up by chance, in standard deviations
    of that; up to `BY_CHANCE` where it does not move (measured: noise has a shape that is best for it).

    observations : those that were used. sigma : of the whitened residuals.
    """
    frames = np.unique(observations.frame)
    kept = frames[np.unique(np.linspace(0, len(frames) - 1, min(MOST, len(frames))).astype(int))]
    number = np.full(len(state.rotation), -1, np.int32)
    number[kept] = np.arange(len(kept))
    part = observations.take(number[observations.frame] >= 0)
    part = part._replace(frame=number[part.frame])
    begin = State(
        np.ascontiguousarray(state.rotation[kept]), state.translation[kept], state.points, state.focal[kept], state.lens
    )
    turning = adjust(begin, part, Free(frame=TURN), iterations=10, tolerance=1e-6, least_damping=DISTANCE)
    moving = adjust(turning.state, part, Free(frame=POSE), iterations=60, tolerance=1e-5, least_damping=DISTANCE)
    added = 3 * len(kept) + len(np.unique(part.track))
    # what wanders from frame to frame counts as fewer observations; what a movement would leave is not taken for that
    wander = min(max(correlation(moving.state, part), 0.0), 0.95)
    fallen = (turning.cost - moving.cost) / max(sigma, 1e-12) ** 2 * (1.0 - wander) / (1.0 + wander)
    return float((fallen - added) / np.sqrt(2.0 * added))
