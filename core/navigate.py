"""Moving the camera by hand: each move is a function from a camera to a camera.

Pixels are those of the picture (x right, y down). A pivot is the point (3,) in world that a move is about, usually
where the ray under the cursor meets the skin: it keeps its pixel when the view turns, and follows the cursor when the
view slides.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from core.camera import Camera, frame_points, look_at, pixel_scale
from core.gate import AROUND
from core.record import freeze
from core.transform import any_perpendicular, normalized, rotation

Array = NDArray[np.float64]

UP = (0.0, 1.0, 0.0)
STEEPEST = 0.5 * math.pi - 1e-4  # radians between view and ground that a turntable reaches
NEAREST = 1e-6  # metres a camera keeps from what it moves towards
FARTHEST = 1e7
# directions of view, seen from an animal that faces +z
SIDES = {
    "front": (0.0, 0.0, -1.0), "back": (0.0, 0.0, 1.0), "left": (-1.0, 0.0, 0.0), "right": (1.0, 0.0, 0.0),
    "top": (0.0, -1.0, 0.0), "bottom": (0.0, 1.0, 0.0), "three-quarter": (-0.85, -0.35, -1.0),
}


def orbit(camera: Camera, pivot: ArrayLike, yaw: float, pitch: float, up: ArrayLike = UP) -> Camera:
    """Turn the view about a pivot like an object on a turntable: what is up stays up.

    Parameters
    ----------
    yaw : radians the camera goes to its right around the pivot. pitch : radians it goes up, at most to the pole.
    """
    axis = np.asarray(normalized(up))
    rise = math.asin(float(np.clip(camera.forward @ axis, -1.0, 1.0)))  # of the direction of view
    wanted = float(np.clip(rise - pitch, min(-STEEPEST, rise), max(STEEPEST, rise)))
    sideways = np.cross(camera.forward, axis)
    # near the poles forward says nothing about sideways, the picture's own right does
    across = normalized(sideways) if np.linalg.norm(sideways) > 1e-3 else camera.world_from_camera[:3, 0]
    return _turned(camera, pivot, (rotation(axis, yaw) @ rotation(across, wanted - rise))[:3, :3])


def tumble(camera: Camera, pivot: ArrayLike, yaw: float, pitch: float) -> Camera:
    """Turn the view about a pivot like a ball under the hand: up is wherever the turning leads."""
    pose = camera.world_from_camera
    return _turned(camera, pivot, (rotation(pose[:3, 1], yaw) @ rotation(pose[:3, 0], -pitch))[:3, :3])


def pan(camera: Camera, pivot: ArrayLike, across: float, down: float, height: int) -> Camera:
    """Slide the view so that the pivot moves `across` and `down` pixels in a picture `height` pixels tall."""
    metres = _metres_per_pixel(camera, pivot, height)
    pose = camera.world_from_camera
    return _moved(camera, camera.position + metres * (down * pose[:3, 1] - across * pose[:3, 0]))


def dolly(camera: Camera, pivot: ArrayLike, factor: float) -> Camera:
    """Bring the pivot to `factor` times its distance, its pixel kept; an orthographic camera sees so much less."""
    point, eye = np.asarray(pivot, np.float64), camera.position
    if not camera.orthographic:
        depth = max(depth_of(camera, point), NEAREST)
        factor = float(np.clip(factor, NEAREST / depth, FARTHEST / depth))
        return _moved(camera, point + factor * (eye - point))
    factor = float(np.clip(factor, NEAREST / camera.height, FARTHEST / camera.height))
    aside = point - eye
    aside = aside - (aside @ camera.forward) * camera.forward
    return _moved(camera, eye + (1.0 - factor) * aside).replace(height=camera.height * factor)


def zoom(camera: Camera, factor: float) -> Camera:
    """Make the picture's middle `1 / factor` times as large by the lens; an orthographic camera sees less."""
    if camera.orthographic:
        return camera.replace(height=float(np.clip(camera.height * factor, NEAREST, FARTHEST)))
    half = math.atan(factor * math.tan(0.5 * camera.field_of_view))
    return camera.replace(field_of_view=float(np.clip(2.0 * half, 0.01, 2.6)))


def with_projection(camera: Camera, pivot: ArrayLike, orthographic: bool) -> Camera:
    """The camera with parallel rays or with a lens; the pivot keeps its pixel and what is beside it its size."""
    if camera.orthographic == orthographic:
        return camera
    size = 2.0 * math.tan(0.5 * camera.field_of_view)  # of what is seen at a distance of one
    depth = depth_of(camera, pivot)
    if orthographic:
        height = float(np.clip(max(depth, NEAREST) * size, NEAREST, FARTHEST))
        return camera.replace(orthographic=True, height=height)
    moved = _moved(camera, camera.position + (depth - camera.height / size) * camera.forward)
    return moved.replace(orthographic=False)


def frame(camera: Camera, points_in_world: ArrayLike, aspect: float) -> Camera:
    """The camera looking the way it does, so near that points (N, 3) just fit a picture of that aspect."""
    return frame_points(
        points_in_world, camera.forward, aspect, field_of_view=camera.field_of_view,
        orthographic=camera.orthographic, up=camera.world_from_camera[:3, 1],
    )


def whole_in(camera: Camera, aspect: float, window_aspect: float) -> Camera:
    """A camera whose own picture has `aspect`, opened so far that a window of another shape shows all of that picture.

    A narrower window keeps the picture's width, a wider one its height; what is beside it is seen, too, and a little
    more all around.
    """
    more = max(aspect / window_aspect, 1.0) * AROUND
    if camera.orthographic:
        return camera.replace(height=float(np.clip(camera.height * more, NEAREST, FARTHEST)))
    half = math.atan(more * math.tan(0.5 * camera.field_of_view))
    return camera.replace(field_of_view=min(2.0 * half, 3.1))


def turned_to(camera: Camera, pivot: ArrayLike, direction: ArrayLike, up: ArrayLike = UP) -> Camera:
    """The camera looking along `direction`, with the pivot in the middle, as far away as it was."""
    ahead, axis = np.asarray(normalized(direction)), np.asarray(normalized(up))
    if abs(float(ahead @ axis)) > 1.0 - 1e-9:
        # straight down or up: the picture's top is where the view went before, as from above one's own work
        before = camera.forward - (camera.forward @ axis) * axis
        level = camera.world_from_camera[:3, 1] if np.linalg.norm(before) < 1e-6 else before
        axis = level if np.linalg.norm(level - (level @ ahead) * ahead) > 1e-6 else any_perpendicular(ahead)
    far = max(float(np.linalg.norm(np.asarray(pivot) - camera.position)), NEAREST)
    eye = np.asarray(pivot, np.float64) - far * ahead
    return camera.replace(world_from_camera=freeze(look_at(eye, pivot, axis)))


def with_clipping(camera: Camera, points_in_world: ArrayLike) -> Camera:
    """The camera with near and far about points (N, 3), so that none is cut off and depth is told apart well.

    An orthographic camera among the points steps back out of them, which changes nothing in its picture.
    """
    points = np.asarray(points_in_world, np.float64).reshape(-1, 3)
    if not len(points) or not np.isfinite(points).all():
        return camera
    depths = (points - camera.position) @ camera.forward
    size = max(float(np.linalg.norm(np.ptp(points, axis=0))), 1e-6)
    low, high = float(depths.min()), float(depths.max())
    if camera.orthographic and low < 0.1 * size:
        back = size - low
        camera = _moved(camera, camera.position - back * camera.forward)
        low, high = low + back, high + back
    far = max(high, 0.0) + 4.0 * size
    near = max(0.2 * low, 1e-4 * size, 1e-5 * far)
    return camera.replace(near=min(near, 0.5 * FARTHEST), far=min(far, FARTHEST))


def depth_of(camera: Camera, point: ArrayLike) -> float:
    """Metres along the view from the camera to a point (3,), negative behind it."""
    return float((np.asarray(point, np.float64) - camera.position) @ camera.forward)


def _metres_per_pixel(camera: Camera, pivot: ArrayLike, height: int) -> float:
    scale = pixel_scale(camera, height)
    return 1.0 / scale if camera.orthographic else max(depth_of(camera, pivot), NEAREST) / scale


def _moved(camera: Camera, eye: Array) -> Camera:
    pose = np.array(camera.world_from_camera)
    pose[:3, 3] = np.clip(eye, -FARTHEST, FARTHEST)
    moved: Camera = camera.replace(world_from_camera=freeze(pose))
    return moved


def _turned(camera: Camera, pivot: ArrayLike, turn: Array) -> Camera:
    point = np.asarray(pivot, np.float64)
    pose = np.array(camera.world_from_camera)
    # a thousand turns must not leave a skewed frame: make it square again each time
    u, _, v = np.linalg.svd(turn @ pose[:3, :3])
    pose[:3, :3] = u @ v
    pose[:3, 3] = point + turn @ (pose[:3, 3] - point)
    turned: Camera = camera.replace(world_from_camera=freeze(pose))
    return turned
