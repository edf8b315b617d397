"""Skeletons, clips and skins as records."""

from __future__ import annotations

import numpy as np

from core.record import Record, column, number, text


class Skeleton(Record):
    """Joints in an order where parents come first.

    names : one per joint, unique.
    parents : (J,) int32, -1 for a root.
    rest : (J, 4, 4) float64, parent_from_joint at rest.
    bind : (J, 4, 4) float64, object_from_joint when the skin was bound, invertible.
    """

    names: tuple[str, ...]
    parents: np.ndarray
    rest: np.ndarray
    bind: np.ndarray

    def __post_init__(self) -> None:
        n = len(self.names)
        if len(set(self.names)) != n or not all(self.names):
            raise ValueError("Skeleton.names must be unique and not empty")
        column(self, "parents", np.int32, (n,))
        column(self, "rest", np.float64, (n, 4, 4))
        column(self, "bind", np.float64, (n, 4, 4))
        if n and not (np.all(self.parents >= -1) and np.all(self.parents < np.arange(n))):
            raise ValueError("Skeleton.parents must name an earlier joint, or -1")
        if n and np.abs(np.linalg.det(self.bind)).min() < 1e-30:
            raise ValueError("Skeleton.bind holds a matrix that cannot be inverted")


class Clip(Record, kw_only=True):
    """Motion sampled on every frame, in the space of each joint's parent.

    start : frame of the first sample.
    frames_per_second : above 0.
    translations : (F, J, 3) float32, metres.
    rotations : (F, J, 4) float32, quaternions x, y, z, w.
    scales : (F, J, 3) float32.
    number_names : of abstract controls that move too. numbers : (F, N) float32, their values, None without names.
    keys : ascending, the samples somebody keyed a pose at (``core.pose.keying``); empty for motion that was read.
    """

    name: str = "clip"
    start: float = 1001.0
    frames_per_second: float = 24.0
    translations: np.ndarray
    rotations: np.ndarray
    scales: np.ndarray
    number_names: tuple[str, ...] = ()
    numbers: np.ndarray | None = None
    keys: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        text(self, "name")
        number(self, "start", least=-1e9, most=1e9)
        number(self, "frames_per_second", least=1e-3, most=1e6)
        column(self, "translations", np.float32, (None, None, 3))
        frames, joints = self.translations.shape[:2]
        if frames == 0:
            raise ValueError("Clip needs at least one frame")
        column(self, "rotations", np.float32, (frames, joints, 4))
        column(self, "scales", np.float32, (frames, joints, 3))
        if len(set(self.number_names)) != len(self.number_names) or not all(self.number_names):
            raise ValueError("Clip.number_names must be unique and not empty")
        if (self.numbers is None) != (not self.number_names):
            raise ValueError("Clip.numbers must have a column for each of its names, or be None without any")
        if self.numbers is not None:
            column(self, "numbers", np.float32, (frames, len(self.number_names)))
        if any(not 0 <= key < frames for key in self.keys) or list(self.keys) != sorted(set(self.keys)):
            raise ValueError("Clip.keys must be samples of the clip, ascending")

    @property
    def end(self) -> float:
        """Frame of the last sample."""
        return self.start + len(self.translations) - 1


class SkinWeights(Record):
    """Which joints move each vertex.

    joints : (V, K) int32.
    weights : (V, K) float32, >= 0, each row summing to 1. Without columns (K = 0) no joint moves anything.
    """

    joints: np.ndarray
    weights: np.ndarray

    def __post_init__(self) -> None:
        column(self, "joints", np.int32, (None, None))
        column(self, "weights", np.float32, self.joints.shape)
        if self.weights.size and (
            self.weights.min() < 0.0 or np.abs(self.weights.sum(axis=1, dtype=np.float64) - 1.0).max() > 1e-3
        ):
            raise ValueError("SkinWeights.weights must be positive and sum to 1 on every vertex")
