"""What a solved camera sees: a picture of a pinhole with room around, and a grid that bends it as the lens does."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from core.camera import Camera
from core.match.solved import SolvedCamera, row_of_frame
from core.match.solved_scene import UP
from core.record import freeze

Array = NDArray[np.float64]
CELLS = 96  # of the grid along the longer side of the plate
WIDEST = 4.0  # tangent of the angle from the axis beyond which a flat picture is not worth drawing
MOST = 8192  # pixels on a side of the picture


class Through(NamedTuple):
    """A camera in the artist's world, y up, that sees all the lens sees of a frame.

    camera : a pinhole. size : width and height in pixels of its picture.
    nodes : (R, C, 2) places of a grid over the plate, pixels, from edge to edge of it.
    places : (R, C, 2) where they lie in the picture, 0 .. 1 from its left upper corner, NaN where it shows nothing.
    """

    camera: Camera
    size: tuple[int, int]
    nodes: Array
    places: Array


def through_lens(solved: SolvedCamera, frame: int, density: float = 1.0) -> Through | None:
    """The camera of a frame (as the files count) and the grid of its lens; None where no camera is solved.

    density : pixels of the picture for one of the plate, at its middle.
    """
    from core.match.lens import straightened  # of the solver, which is large
    from core.match.solve.state import FOCAL

    row = row_of_frame(solved, frame)
    if row is None:
        return None
    wide, tall = solved.size
    longer = max(wide, tall)
    columns, rows = (max(2, round(CELLS * side / longer)) + 1 for side in (wide, tall))
    nodes = np.stack(np.meshgrid(
        np.linspace(-0.5, wide - 0.5, columns), np.linspace(-0.5, tall - 0.5, rows)), axis=-1)
    flat = straightened(
        solved.lens, float(np.log(solved.focal[row]) - solved.lens[FOCAL]), nodes.reshape(-1, 2)).reshape(nodes.shape)
    flat = np.where((np.abs(flat) <= WIDEST).all(axis=-1, keepdims=True), flat, np.nan)
    if not np.isfinite(flat).any():
        return None
    reach = np.nanmax(np.abs(flat.reshape(-1, 2)), axis=0)
    scale = min(density * float(solved.focal[row]), 0.5 * MOST / float(reach.max()))
    size = np.maximum(np.ceil(2.0 * reach * scale), 2.0)
    reach = 0.5 * size / scale
    turn = solved.rotation[row] * UP  # of the artist's world, into the camera: x right, y down, z ahead
    pose = np.eye(4)
    pose[:3, :3] = (np.diag([1.0, -1.0, -1.0]) @ turn).T
    pose[:3, 3] = -turn.T @ solved.translation[row]
    camera = Camera(world_from_camera=freeze(pose), field_of_view=2.0 * float(np.arctan(reach[1])))
    return Through(camera, (int(size[0]), int(size[1])), nodes, 0.5 + 0.5 * flat / reach)


def over_plate(
    plate: NDArray[np.uint8], picture: NDArray[np.uint8], through: Through, opacity: float = 1.0
) -> NDArray[np.uint8]:
    """A frame (H, W, 3) uint8 sRGB with what the camera sees over it, mixed as light is.

    picture : (h, w, 4) uint8, sRGB times alpha, as the camera of `through` drew it; of any size.
    """
    at = places_of_pixels(through, plate.shape[1], plate.shape[0]) * picture.shape[1::-1] - 0.5
    at = np.where(np.isfinite(at), at, -10.0).astype(np.float32)
    seen = np.asarray(cv2.remap(picture.astype(np.float32) / 255.0, at[..., 0], at[..., 1], cv2.INTER_LINEAR))
    alpha = seen[..., 3:]
    with np.errstate(invalid="ignore", divide="ignore"):
        colour = np.where(alpha > 0.0, np.minimum(seen[..., :3] / alpha, 1.0), 0.0)
    share = opacity * alpha
    mixed = _linear(plate.astype(np.float32) / 255.0) * (1.0 - share) + _linear(colour) * share
    out = np.where(share > 0.0, np.round(255.0 * _shown(mixed)), plate)
    return np.asarray(out, np.uint8)


def places_of_pixels(through: Through, wide: int, tall: int) -> Array:
    """(tall, wide, 2) where the pixels of a plate lie in the picture, 0 .. 1, NaN where it shows nothing."""
    nothing = ~np.isfinite(through.places).all(axis=-1, keepdims=True)
    known = np.concatenate([np.where(nothing, 0.0, through.places), nothing], axis=-1)
    down, across = _between(tall, known.shape[0]), _between(wide, known.shape[1])
    found = np.einsum("yr,rck,xc->yxk", down, known, across, optimize=True)
    return np.where(found[..., 2:] > 0.0, np.nan, found[..., :2])


def _between(pixels: int, nodes: int) -> Array:
    """(pixels, nodes) weights of the two nodes a pixel lies between, nodes from edge to edge."""
    at = (np.arange(pixels) + 0.5) / pixels * (nodes - 1)
    return np.maximum(0.0, 1.0 - np.abs(at[:, None] - np.arange(nodes)))


def _linear(shown: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.where(shown <= 0.04045, shown / 12.92, ((np.maximum(shown, 0.04045) + 0.055) / 1.055) ** 2.4)


def _shown(linear: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.where(linear <= 0.0031308, linear * 12.92, 1.055 * np.maximum(linear, 0.0031308) ** (1.0 / 2.4) - 0.055)
