"""Surfaces of one pose for another: corrections felt there carried here, and the image on the other side."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.pose.extraction import skin_affine, surface_rotations
from core.pose.mirror_pose import Mirror, mirrored_pose
from core.pose.pose import Pose, local_of_pose
from core.pose.pose_space import Correctives
from core.pose.rig import Rig
from core.pose.sculpt.symmetry import Opposites, mirrored_offsets, symmetrised_offsets
from core.pose.skinning import carried, skin_matrices_of
from core.pose.synthesis import corrected, evaluate, felt, prepare


def carried_surface(
    points: NDArray[np.float32], rig: Rig, correctives: Correctives | None, source: Pose, at: Pose
) -> NDArray[np.float32]:
    """The surface (V, 3) float32 at the pose `at` with the corrections that are felt at the pose `source`.

    Blend shapes stay as `at` has them: only what was sculpted is carried, before skinning, so that it turns with the
    joints.
    """
    there, here = (local_of_pose(rig.skeleton, pose) for pose in (source, at))
    ready = prepare(correctives, rig)
    felt_there = felt(source, rig, points, there)
    sculpted, late = corrected(points, rig, ready, felt_there)
    plain, _ = corrected(points, rig, (), felt_there)
    bare, _ = corrected(points, rig, (), felt(at, rig, points, here))
    matrices = skin_matrices_of(rig.skeleton, here)
    out = carried((bare + (sculpted - plain)).astype(np.float32), rig, matrices)
    for vertices, moves in late:
        turn = surface_rotations(skin_affine(rig, matrices, vertices), matrices)
        out[vertices] += np.einsum("nij,nj->ni", turn, moves).astype(np.float32)
    return out


def mirrored_surface(
    points: NDArray[np.float32], rig: Rig, correctives: Correctives | None, pose: Pose, mirror: Mirror,
    opposites: Opposites, source: int = 1,
) -> tuple[Pose, NDArray[np.float32]]:
    """The pose of the other side, and the surface (V, 3) float32 there with the sculpting of `pose` reflected.

    Where the pose is its own image the sculpt becomes symmetric instead.

    Parameters
    ----------
    opposites : (V,) int32 of `core.pose.sculpt.symmetry`; what has no opposite stays as the skin alone has it, or as
        it is in a pose that is its own image.
    source : of such a pose, the sign of the side that is copied.
    """
    other = mirrored_pose(pose, mirror)
    offsets = evaluate(points, rig, correctives, pose) - evaluate(points, rig, None, pose)
    bare = evaluate(points, rig, None, other)
    here, there = (local_of_pose(rig.skeleton, p) for p in (pose, other))
    if np.abs(here - there).max(initial=0.0) < 1e-6 and pose.numbers == other.numbers:
        return pose, bare + symmetrised_offsets(offsets, opposites, points, mirror.across, source)
    return other, bare + mirrored_offsets(offsets, opposites, mirror.across)
