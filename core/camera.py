"""The camera: world to pixels and back, without GL.

View space is that of OpenGL and USD: x right, y up, looking along -z. Clip space is OpenGL's (-w .. w on each axis).
Pixels: the centre of the top left pixel is (0, 0), x right, y down, so the picture spans -0.5 .. width - 0.5.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from core.record import Record, column
from core.transform import any_perpendicular, normalized, transform_points

Array = NDArray[np.float64]


class Camera(Record):
    """A perspective or orthographic camera.

    world_from_camera : (4, 4) float64, rigid; camera space is view space (x right, y up, looks along -z), metres.
    field_of_view : vertical angle in radians, of the perspective camera.
    orthographic : True for parallel rays.
    height : metres seen from bottom to top, of the orthographic camera.
    near, far : metres along the view axis.
    """

    world_from_camera: np.ndarray
    field_of_view: float = 0.6
    orthographic: bool = False
    height: float = 1.0
    near: float = 0.01
    far: float = 1000.0

    def __post_init__(self) -> None:
        column(self, "world_from_camera", np.float64, (4, 4))
        if not 1e-6 < self.field_of_view < 3.1415:
            raise ValueError("Camera.field_of_view must lie between 0 and pi radians")
        if not (0.0 < self.height < 1e12 and 0.0 < self.near < self.far < 1e12):
            raise ValueError("Camera needs 0 < near < far and a height above 0")
        r = self.world_from_camera[:3, :3]
        if np.abs(r @ r.T - np.eye(3)).max() > 1e-6 or np.linalg.det(r) < 0.0:
            raise ValueError("Camera.world_from_camera must be a rotation and a translation, without scale")

    @property
    def position(self) -> Array:
        """Where the camera stands, (3,) in world."""
        return np.array(self.world_from_camera[:3, 3])

    @property
    def forward(self) -> Array:
        """Unit direction of view, (3,) in world."""
        return np.array(-self.world_from_camera[:3, 2])


class Pixels(NamedTuple):
    """Projected points: `xy` (..., 2) pixels, `depth` (...) metres along the view axis (negative behind)."""

    xy: Array
    depth: Array


class Ray(NamedTuple):
    """`origin` and unit `direction`, each (..., 3) in world."""

    origin: Array
    direction: Array


def focal_length_to_field_of_view(focal_length: float, sensor_height: float) -> float:
    """Vertical field of view in radians of a focal length and sensor height in one same unit."""
    return float(2.0 * np.arctan2(0.5 * sensor_height, focal_length))


def look_at(eye: ArrayLike, target: ArrayLike, up: ArrayLike = (0.0, 1.0, 0.0)) -> Array:
    """(4, 4) world_from_camera of a camera at `eye` that looks at `target`; any roll when `up` is along the view."""
    e = np.asarray(eye, np.float64)
    back = normalized(e - np.asarray(target, np.float64))
    if not back.any():
        back = np.array([0.0, 0.0, 1.0])
    side = np.cross(normalized(up), back)
    right = normalized(side) if np.linalg.norm(side) > 1e-9 else any_perpendicular(back)
    m = np.eye(4)
    m[:3, 0], m[:3, 1], m[:3, 2], m[:3, 3] = right, np.cross(back, right), back, e
    return m


def view_from_world(camera: Camera) -> Array:
    """(4, 4) float64, the inverse of the camera's pose."""
    r, t = camera.world_from_camera[:3, :3], camera.world_from_camera[:3, 3]
    m = np.eye(4)
    m[:3, :3], m[:3, 3] = r.T, -r.T @ t
    return m


def clip_from_view(camera: Camera, width: int, height: int) -> Array:
    """(4, 4) float64 projection into OpenGL clip space for a picture of `width` x `height` square pixels."""
    aspect, n, f = width / height, camera.near, camera.far
    m = np.zeros((4, 4))
    if camera.orthographic:
        m[0, 0], m[1, 1] = 2.0 / (camera.height * aspect), 2.0 / camera.height
        m[2, 2], m[2, 3], m[3, 3] = -2.0 / (f - n), -(f + n) / (f - n), 1.0
    else:
        s = 1.0 / np.tan(0.5 * camera.field_of_view)
        m[0, 0], m[1, 1] = s / aspect, s
        m[2, 2], m[2, 3], m[3, 2] = -(f + n) / (f - n), -2.0 * f * n / (f - n), -1.0
    return m


def clip_from_world(camera: Camera, width: int, height: int) -> Array:
    """(4, 4) float64; the matrix a shader needs."""
    return clip_from_view(camera, width, height) @ view_from_world(camera)


def pixel_scale(camera: Camera, height: int) -> float:
    """Pixels per unit of (x / depth) of a perspective camera, per metre of an orthographic one."""
    if camera.orthographic:
        return height / camera.height
    return float(0.5 * height / np.tan(0.5 * camera.field_of_view))


def project(camera: Camera, points_in_world: ArrayLike, width: int, height: int) -> Pixels:
    """Pixels and depths of points (..., 3) in world, float64.

    A point in the plane of a perspective camera's eye has no pixel: its depth is clamped away from 0, so the pixel is
    far outside, finite; test `depth` > 0 before use.
    """
    in_view = transform_points(view_from_world(camera), points_in_world)
    depth = -in_view[..., 2]
    scale: Array | float = pixel_scale(camera, height)
    if not camera.orthographic:
        scale = scale / np.where(np.abs(depth) < 1e-9, 1e-9, depth)
    x = 0.5 * width - 0.5 + in_view[..., 0] * scale
    y = 0.5 * height - 0.5 - in_view[..., 1] * scale
    return Pixels(np.stack([x, y], axis=-1), depth)


def ray_through(camera: Camera, pixels: ArrayLike, width: int, height: int) -> Ray:
    """World rays through pixels (..., 2), from the eye (perspective) or from the eye's plane (orthographic)."""
    p = np.asarray(pixels, np.float64)
    scale = pixel_scale(camera, height)
    x = (p[..., 0] - (0.5 * width - 0.5)) / scale
    y = (0.5 * height - 0.5 - p[..., 1]) / scale
    zero = np.zeros_like(x)
    r, eye = camera.world_from_camera[:3, :3], camera.world_from_camera[:3, 3]
    if camera.orthographic:
        origins = np.stack([x, y, zero], axis=-1) @ r.T + eye
        return Ray(origins, np.broadcast_to(camera.forward, origins.shape).copy())
    directions = normalized(np.stack([x, y, zero - 1.0], axis=-1)) @ r.T
    return Ray(np.broadcast_to(eye, directions.shape).copy(), directions)


def point_at_depth(camera: Camera, pixels: ArrayLike, depth: ArrayLike, width: int, height: int) -> Array:
    """World points (..., 3) at pixels (..., 2) and depths (...) along the view axis: the inverse of `project`."""
    ray = ray_through(camera, pixels, width, height)
    along = np.asarray(depth, np.float64) / (ray.direction @ camera.forward)
    return ray.origin + ray.direction * along[..., None]


def frame_points(
    points_in_world: ArrayLike,
    direction: ArrayLike = (-0.8, -0.35, -1.0),
    aspect: float = 1.0,
    *,
    field_of_view: float = 0.5,
    margin: float = 1.06,
    orthographic: bool = False,
    up: ArrayLike = (0.0, 1.0, 0.0),
) -> Camera:
    """The nearest camera looking along `direction` that sees all points (N, 3), centred in the picture.

    Parameters
    ----------
    direction : from the camera to the points; by default a three-quarter view from the front (the subject faces +z).
    aspect : width over height of the picture.
    field_of_view : vertical, radians.
    margin : 1 lets the points touch the border; 1.06 leaves 6 percent.
    """
    points = np.asarray(points_in_world, np.float64).reshape(-1, 3)
    if len(points) == 0 or not np.isfinite(points).all():
        points = np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]])
    pose = look_at(np.zeros(3), direction, up)
    q = points @ pose[:3, :3]  # in the axes of the camera
    low, high = q.min(axis=0), q.max(axis=0)
    size = max(float(np.linalg.norm(high - low)), 1e-6)
    tall = margin * max(float(high[1] - low[1]), float(high[0] - low[0]) / aspect, 1e-3 * size)
    centre = 0.5 * (low + high)
    if orthographic:
        eye = np.array([centre[0], centre[1], high[2] + size])
    else:
        # Along each axis the four sides of the view are planes through the eye: the tightest pair fixes it.
        ty = np.tan(0.5 * field_of_view) / margin
        tx = ty * aspect
        right, left = np.max(q[:, 0] + tx * q[:, 2]), np.min(q[:, 0] - tx * q[:, 2])
        top, bottom = np.max(q[:, 1] + ty * q[:, 2]), np.min(q[:, 1] - ty * q[:, 2])
        back = max((right - left) / (2.0 * tx), (top - bottom) / (2.0 * ty), float(high[2]) + 1e-3 * size)
        eye = np.array([0.5 * (right + left), 0.5 * (top + bottom), back])
    pose[:3, 3] = pose[:3, :3] @ eye
    reach = float(eye[2] - low[2])
    nearest = max(float(eye[2] - high[2]), 1e-3 * size)
    return Camera(
        world_from_camera=pose, field_of_view=field_of_view, orthographic=orthographic, height=tall,
        near=0.2 * nearest, far=reach + 4.0 * size,
    )
