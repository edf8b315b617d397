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
    """

    name: str = "clip"
    start: float = 1001.0
    frames_per_second: float = 24.0
    translations: np.ndarray
    rotations: np.ndarray
    scales: np.ndarray

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

    @property
    def end(self) -> float:
        """Frame of the last sample."""
        return self.start + len(self.translations) - 1


class SkinWeights(Record):
    """Which joints move each vertex.

    joints : (V, K) int32.
    weights : (V, K) float32, >= 0, each row summing to 1.
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


class Rig(Record):
    """A skeleton, the skin it moves and, where there is one, its motion."""

    skeleton: Skeleton
    skin: SkinWeights
    clip: Clip | None = None

    def __post_init__(self) -> None:
        joints = len(self.skeleton.names)
        if self.skin.joints.size and not (self.skin.joints.min() >= 0 and self.skin.joints.max() < joints):
            raise ValueError("SkinWeights.joints names a joint the skeleton does not have")
        if self.clip is not None and self.clip.translations.shape[1] != joints:
            raise ValueError("Clip has another number of joints than the skeleton")
