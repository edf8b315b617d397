"""Along a way through pose space: what a point of the surface does, where it has a kink, and weights over a clip."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.pose.pose import Pose, local_of_pose
from core.pose.pose_map import mixed_pose
from core.pose.pose_space import Correctives
from core.pose.rig import Rig
from core.pose.synthesis import deform, felt, pose_at, prepare, run_weights
from core.transform import Array

STEPS = 64
KINK = 0.3  # second differences at one step over those at two: 1/4 of smooth motion, 1/3 to 1/2 at a kink, 1 at a jump
LEAST = 0.2  # of the largest second difference: smaller ones are no kink anybody sees

Say = Callable[[float], object]


class Motion(NamedTuple):
    """What points do on a way.

    shares : (S,) of the way, 0 .. 1. points : (S, n, 3) metres, object space. kinks : (n,) lists of steps.
    """

    shares: Array
    points: Array
    kinks: tuple[tuple[int, ...], ...]

    @property
    def travel(self) -> Array:
        """(S, n) metres each has gone."""
        steps = np.linalg.norm(np.diff(self.points, axis=0), axis=2)
        return np.asarray(np.concatenate([np.zeros((1, steps.shape[1])), np.cumsum(steps, axis=0)]), np.float64)

    @property
    def speed(self) -> Array:
        """(S - 1, n) metres for the whole way, between the steps."""
        steps = np.linalg.norm(np.diff(self.points, axis=0), axis=2)
        return np.asarray(steps * (len(self.shares) - 1), np.float64)


def walk(
    points: NDArray[np.float32], rig: Rig, correctives: Correctives | None, start: Pose, end: Pose,
    vertices: NDArray[np.int32], steps: int = STEPS, say: Say = lambda part: None,
) -> Motion:
    """The motion of vertices (n,) from one pose to another, straight in every control, in even steps."""
    shares = np.linspace(0.0, 1.0, steps + 1)
    ready = prepare(correctives, rig)
    out = np.empty((steps + 1, len(vertices), 3))
    for k, share in enumerate(shares):
        pose = mixed_pose((start, end), np.array([1.0 - share, share]))
        out[k] = deform(points, rig, ready, local_of_pose(rig.skeleton, pose), pose)[vertices]
        say((k + 1) / (steps + 1))
    return Motion(shares, out, tuple(kinks(out[:, i]) for i in range(len(vertices))))


def kinks(path: Array) -> tuple[int, ...]:
    """The steps of a path (S, 3) at which it breaks or jumps.

    Halving the step quarters the second difference of smooth motion, but only halves it at a kink, and leaves it at a
    jump.
    """
    if len(path) < 9:
        return ()
    path = path - path.mean(axis=0)
    near = np.linalg.norm(path[2:-2] * 2.0 - path[1:-3] - path[3:-1], axis=1)
    far = np.linalg.norm(path[2:-2] * 2.0 - path[:-4] - path[4:], axis=1)
    size = float(np.linalg.norm(np.ptp(path, axis=0)))
    seen = (near > max(LEAST * near.max(initial=0.0), 1e-4 * size)) & (near > KINK * far)
    found: list[int] = []
    for step in np.flatnonzero(seen):  # of neighbours the one that stands out
        if found and step + 2 - found[-1] <= 2:
            found[-1] = int(step) + 2 if near[step] > near[found[-1] - 2] else found[-1]
        else:
            found.append(int(step) + 2)
    return tuple(found)


def most_moved(correctives: Correctives | None, name: str) -> int | None:
    """The vertex that a sculpt corrects most, or None when it corrects nothing."""
    for layer in () if correctives is None else correctives.layers:
        for k, sample in enumerate(layer.space.samples):
            if sample.name == name and len(layer.vertices):
                lengths = np.linalg.norm(layer.deltas[k], axis=1)
                return int(layer.vertices[lengths.argmax()]) if lengths.max() > 0.0 else None
    return None


def clip_weights(
    points: NDArray[np.float32], rig: Rig, correctives: Correctives, frames: Array, say: Say = lambda part: None,
) -> tuple[tuple[str, ...], NDArray[np.float32]]:
    """Names (M) of all sculpts and their weights (F, M) float32 at frames (F,) of the clip that plays.

    Where the vertices of a layer know different poses it is the weight of largest size that counts.
    """
    ready = prepare(correctives, rig)
    names = tuple(s.name for one in ready for s in one.layer.space.samples)
    out = np.zeros((len(frames), len(names)), np.float32)
    for f, frame in enumerate(frames):
        pose = pose_at(rig, float(frame))
        pose = felt(pose, rig, points, local_of_pose(rig.skeleton, pose))
        rows = []
        for one in ready:
            runs = run_weights(one, pose)
            if not len(runs):
                runs = np.zeros((1, len(one.layer.space.samples)), np.float32)
            rows.append(runs[np.abs(runs).argmax(axis=0), np.arange(runs.shape[1])])
        out[f] = np.concatenate(rows) if rows else 0.0
        say((f + 1) / len(frames))
    return names, out
