"""A skeleton over the picture: bones as lines, joints as rings, those that are selected in their own colour."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from core.camera import Camera, clip_from_world
from core.overlay import Circle, Overlay, Overlays, Polyline
from core.pose.pose import Pose, local_of_pose
from core.pose.skeleton import Skeleton
from core.pose.skinning import object_matrices

JOINT, CHOSEN = 3.0, 5.0  # radii, pixels of the window
MOST = 400  # joints: of larger skeletons only the bones of selected joints are drawn


def joint_places(skeleton: Skeleton, pose: Pose) -> NDArray[np.float64]:
    """Where the joints (J, 3) are in object space."""
    return np.asarray(object_matrices(skeleton, local_of_pose(skeleton, pose))[:, :3, 3], np.float64)


def skeleton_marks(
    skeleton: Skeleton, places: NDArray[np.float64], selected: Collection[str], camera: Camera, size: tuple[int, int],
    ratio: float = 1.0,
) -> Overlays:
    """Marks of joints at `places` (J, 3), seen by a camera in a picture of `size` pixels.

    What is behind the eye is left out.

    ratio : device pixels for a logical one.
    """
    if not len(places):
        return ()
    clip = np.c_[places, np.ones(len(places))] @ clip_from_world(camera, *size).T
    seen = clip[:, 3] > 1e-9
    across = clip[:, :2] / np.where(seen, clip[:, 3], 1.0)[:, None]
    pixels = (across * [0.5, -0.5] + 0.5) * size - 0.5
    chosen = np.array([name in selected for name in skeleton.names])
    drawn = seen if len(places) <= MOST else seen & chosen
    marks: list[Overlay] = []
    for joint, parent in enumerate(skeleton.parents):
        if parent >= 0 and drawn[joint] and seen[parent]:
            marks.append(Polyline(pixels[[parent, joint]], "selected" if chosen[parent] else "faint", 1.5))
    for joint in np.flatnonzero(drawn):
        x, y = map(float, pixels[joint])
        if chosen[joint]:
            marks.append(Circle(x, y, CHOSEN * ratio, "selected", 2.0))
        else:
            marks.append(Circle(x, y, JOINT * ratio, "plain", 1.0))
    return tuple(marks)
