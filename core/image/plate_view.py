"""Looking straight at a plate: a camera with parallel rays says which of its pixels a pixel of the view shows.

The plate lies in the plane z = 0 of a world of its own: pixel (u, v) of the plate, centres at whole numbers, is the
point (u * pixel aspect, -v, 0). So strokes keep in one camera how the artist looked, as they do in three dimensions.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from core.camera import Camera
from core.image.plate import Plate
from core.record import freeze

Array = NDArray[np.float64]
AWAY, NEAR, FAR = 1.0, 0.01, 10.0
BORDER = 1.04  # of the plate's size is seen when all of it is


def plate_size(plate: Plate) -> tuple[int, int]:
    """Width and height in pixels of what is left of a plate after its crop."""
    left, top, right, bottom = plate.crop
    return plate.width - left - right, plate.height - top - bottom


def plate_camera(x: float, y: float, height: float) -> Camera:
    """The camera over the point (x, y) of the plate's world that sees `height` of it from bottom to top."""
    pose = np.eye(4)
    pose[:3, 3] = x, y, AWAY
    return Camera(world_from_camera=freeze(pose), orthographic=True, height=height, near=NEAR, far=FAR)


def whole_plate(plate: Plate, width: int, height: int) -> Camera:
    """The camera that sees all of a plate in a view of `width` x `height` pixels."""
    wide, tall = plate_size(plate)
    wide_in_world = wide * plate.pixel_aspect
    seen = BORDER * max(tall, wide_in_world * height / width)
    return plate_camera(0.5 * (wide - 1) * plate.pixel_aspect, -0.5 * (tall - 1), seen)


def pixels_per_pixel(camera: Camera, height: int) -> float:
    """How many pixels of a view `height` tall a pixel of the plate is tall."""
    return height / camera.height


def plate_points(camera: Camera, aspect: float, pixels: ArrayLike, width: int, height: int) -> Array:
    """Places (N, 2) on the plate under pixels (N, 2) of a view of `width` x `height`."""
    p, scale = np.asarray(pixels, np.float64).reshape(-1, 2), camera.height / height
    x = camera.position[0] + (p[:, 0] - 0.5 * (width - 1)) * scale
    y = -camera.position[1] + (p[:, 1] - 0.5 * (height - 1)) * scale
    return np.stack((x / aspect, y), axis=1)


def view_points(camera: Camera, aspect: float, points: ArrayLike, width: int, height: int) -> Array:
    """Pixels (N, 2) of the view that show places (N, 2) of the plate."""
    p, scale = np.asarray(points, np.float64).reshape(-1, 2), height / camera.height
    x = (p[:, 0] * aspect - camera.position[0]) * scale + 0.5 * (width - 1)
    y = (p[:, 1] + camera.position[1]) * scale + 0.5 * (height - 1)
    return np.stack((x, y), axis=1)
