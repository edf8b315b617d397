"""Shots of a camera that is known: clouds of points, paths, tracks with noise."""

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from core.match.solve.state import Observations, State, start_lens

SIZE = (1920, 1080)
FOCAL = 1600.0
NOISE = 0.3


class Shot(NamedTuple):
    """truth : the state the tracks were made from. bad : (P,) tracks that slide away."""

    truth: State
    observations: Observations
    bad: np.ndarray
    frames: np.ndarray


def shot(
    motion: str, tracks: int = 40, frames: int = 40, outliers: float = 0.0, seed: int = 0, k1: float = 0.0
) -> Shot:
    """Points 6 to 14 away, a camera that passes them, pans, walks ahead, sees a plane, or zooms by 60 %."""
    rng = np.random.default_rng(seed)
    points = rng.uniform([-4, -2.5, 6], [4, 2.5, 14], (tracks, 3))
    if motion == "planar":
        points[:, 2] = 9 + 0.3 * points[:, 0]
    t = np.linspace(0, 1, frames)
    centres = np.stack([-1.5 + 3 * t, 0.3 * np.sin(6 * t), 0.5 * t], 1)
    if motion == "nodal":
        centres[:] = 0
    if motion == "forward":
        centres = np.stack([0.05 * np.sin(9 * t), 0.05 * np.cos(7 * t), 4 * t], 1)
    turn = Rotation.from_euler("yx", np.stack([-0.15 + 0.3 * t, 0.05 * np.sin(4 * t)], 1)).as_matrix()
    zoom = np.log(1 + 0.6 * t) if motion == "zoom" else 0 * t
    lens = start_lens(FOCAL, *SIZE)
    lens[1] = k1
    shift = -np.einsum("fij,fj->fi", turn, centres)
    seen = np.einsum("fij,pj->fpi", turn, points) + shift[:, None]
    flat = seen[..., :2] / seen[..., 2:]
    flat = flat * (1 + k1 * (flat**2).sum(-1, keepdims=True))
    xy = (FOCAL * np.exp(zoom))[:, None, None] * flat + lens[4:6]
    inside = (seen[..., 2] > 0.1) & (xy > -0.5).all(-1) & (xy < np.array(SIZE) - 0.5).all(-1)
    xy = xy + rng.normal(0, NOISE, xy.shape)
    bad = rng.random(tracks) < outliers
    xy[:, bad] += np.cumsum(rng.normal(0, 1.5, (frames, int(bad.sum()), 2)), 0)
    frame, track = np.nonzero(inside)
    observations = Observations(
        frame.astype(np.int32), track.astype(np.int32), np.ascontiguousarray(xy[frame, track]),
        np.tile([1.0, 0.0, 1.0], (len(frame), 1)),
    )
    numbers = np.arange(1001, 1001 + frames, dtype=np.int32)
    return Shot(State(turn, shift, points, zoom, lens), observations, bad, numbers)


def path_error(state: State, truth: State, known: np.ndarray) -> float:
    """RMS distance of the centres after the best similarity (Umeyama, 1991)."""
    a, b = state.centres()[known], truth.centres()[known]
    a, b = a - a.mean(0), b - b.mean(0)
    u, s, vt = np.linalg.svd(b.T @ a)
    turn = np.diag([1, 1, np.sign(np.linalg.det(u @ vt))])
    scale = np.trace(np.diag(s) @ turn) / (a**2).sum()
    return float(np.sqrt(((scale * a @ (u @ turn @ vt).T - b) ** 2).sum(1).mean()))


def turn_error(state: State, truth: State, known: np.ndarray) -> float:
    """RMS angle in degrees after the best common turn of the world."""
    a, b = state.rotation[known], truth.rotation[known]
    u, _, vt = np.linalg.svd(np.einsum("fji,fjk->ik", b, a))
    common = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
    rest = np.einsum("fij,jk,flk->fil", b, common, a)
    return float(np.degrees(np.sqrt((Rotation.from_matrix(rest).magnitude() ** 2).mean())))
