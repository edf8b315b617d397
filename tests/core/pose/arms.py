"""An arm of made-up shape for tests: a tube of four joints, skinned softly, and sculpts that any arm could get."""

from __future__ import annotations

import numpy as np

from core.pose.pose import Pose, local_of_pose
from core.pose.rig import Control, Rig
from core.pose.rotation import quaternion_from_euler
from core.pose.skeleton import Skeleton, SkinWeights
from core.pose.skinning import deformed, object_matrices

JOINTS = ("root", "upper", "fore", "hand")


def arm(vertices: int = 600, skinning: str = "linear", seed: int = 0) -> tuple[Rig, np.ndarray]:
    """The rig and its points (V, 3): a tube on x, joints at 0, 0.1, 0.4, 0.7 in frames turned this way and that."""
    rng = np.random.default_rng(seed)
    places = np.array([[0, 0, 0], [0.1, 0, 0], [0.4, 0, 0], [0.7, 0, 0]])
    world = np.tile(np.eye(4), (4, 1, 1))
    for j in range(4):
        world[j, :3, :3] = local_matrix((0, 10 * j, 25 * j))[:3, :3]
        world[j, :3, 3] = places[j]
    rest = world.copy()
    for j in range(1, 4):
        rest[j] = np.linalg.inv(world[j - 1]) @ world[j]
    skeleton = Skeleton(names=JOINTS, parents=np.array([-1, 0, 1, 2], np.int32), rest=rest, bind=world)
    assert np.allclose(object_matrices(skeleton, rest), world)
    x, around = rng.uniform(0, 1, vertices), rng.uniform(0, 2 * np.pi, vertices)
    points = np.stack([x, 0.08 * np.cos(around), 0.08 * np.sin(around)], axis=1).astype(np.float32)
    near = np.exp(-((x[:, None] - np.array([0.05, 0.25, 0.55, 0.85])) / 0.15) ** 2)
    weights = near / near.sum(axis=1, keepdims=True)
    joints = np.tile(np.arange(4, dtype=np.int32), (vertices, 1))
    controls = (Control(name="flex", low=0.0, high=1.0), Control(name="mood", rest=0.25, low=-1.0, high=1.0))
    skin = SkinWeights(joints=joints, weights=weights.astype(np.float32))
    return Rig(skeleton=skeleton, skin=skin, skinning=skinning, controls=controls), points


def local_matrix(degrees) -> np.ndarray:
    from core.transform import compose

    return compose(rotations=quaternion_from_euler(degrees))


def turned(name: str, numbers: dict[str, float] | None = None, **degrees) -> Pose:
    """A pose of joints turned by XYZ degrees: ``turned("bent", fore=(0, 0, 90))``."""
    rotations = {j: tuple(map(float, quaternion_from_euler(d))) for j, d in degrees.items()}
    return Pose(name=name, rotations=rotations, numbers=numbers or {})


def skinned_at(rig: Rig, points: np.ndarray, pose: Pose) -> np.ndarray:
    """The surface (V, 3) without any correction."""
    return deformed(points, rig, local_of_pose(rig.skeleton, pose), pose.numbers)


def bumped(rig: Rig, points: np.ndarray, pose: Pose, seed: int, centre: float = 0.4, width: float = 0.2) -> np.ndarray:
    """A sculpt (V, 3) float32: the skinned surface with a smooth bump around a place along the arm."""
    push = np.random.default_rng(seed).normal(size=3) * 0.03
    share = np.clip(1 - ((points[:, 0] - centre) / width) ** 2, 0, 1)[:, None]
    return (skinned_at(rig, points, pose) + share**2 * push).astype(np.float32)
