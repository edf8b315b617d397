"""A skeleton over the picture: bones as kites that point to the child, joints as rings, the selected in a colour."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from core.camera import Camera, clip_from_world
from core.overlay import Circle, Overlay, Overlays, Polyline, Tone
from core.pose.pose import Pose, local_of_pose
from core.pose.skeleton import Skeleton
from core.pose.skinning import object_matrices

JOINT, CHOSEN = 3.5, 5.5  # radii, pixels of the window
WIDE, SHOULDER = 5.0, 0.14  # of a bone: half its width in pixels, and the part of its length where it is widest
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
            tone: Tone = "selected" if chosen[parent] else "faint"
            marks.append(Polyline(_kite(pixels[parent], pixels[joint], ratio), tone, 1.5, closed=True))
    for joint in np.flatnonzero(drawn):
        x, y = map(float, pixels[joint])
        if chosen[joint]:
            marks.append(Circle(x, y, CHOSEN * ratio, "selected", 2.0))
        else:
            marks.append(Circle(x, y, JOINT * ratio, "plain", 1.0))
    return tuple(marks)


def _kite(start: NDArray[np.float64], end: NDArray[np.float64], ratio: float) -> NDArray[np.float64]:
    """The outline (4, 2) of a bone in pixels: widest near its start, so that it shows which way it goes."""
    along = end - start
    length = float(np.linalg.norm(along))
    wide = min(WIDE * ratio, 0.2 * length)
    side = np.array([-along[1], along[0]]) * (wide / max(length, 1e-9))
    foot = start + SHOULDER * along
    return np.array([start, foot + side, end, foot - side])
