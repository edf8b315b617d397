"""A movie to judge a solve by: the plate with points, ground, test cubes and the scene as the camera sees them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from app.movie import write_movie
from app.window.jobs import Cancelled
from app.window.match.marks import Sheet
from app.window.match.scene_over import Drawn
from app.window.match.solve_marks import solve_marks
from core.formats.frame_decoder import FrameDecoder
from core.formats.plate_file import PlateFrames
from core.image.plate import Plate
from core.image.plate_view import plate_camera, plate_size
from core.match.solved import SolvedCamera, row_of_frame
from core.match.through import over_plate
from core.overlay import Overlays, Polyline
from core.workspace import PlateLook
from viewport.overlay_drawing import TONES
from viewport.plate_color import PLAIN, PlateColors

SHIFT = 4  # bits of a pixel's fraction that OpenCV draws with
DARK, LETTERS = (12, 12, 14), (228, 230, 233)


def write_check_movie(
    path: Path, plate: Plate, solved: SolvedCamera, fps: float, root: Path | None,
    progress: Callable[[float], None], scene: Callable[[int], Drawn | None] | None = None, opacity: float = 1.0,
    look: PlateLook = PLAIN,
) -> int:
    """Write the solved frames of a plate with what the solve puts over them; returns how many.

    Parameters
    ----------
    look : how the plate is shown.
    scene, opacity : draws what stands in the document as the camera of a frame sees it, and how much of it is shown.
    root : folder the plate's path is told from, or None. progress : share of the frames that is done; when it raises
        Cancelled, what was drawn by then becomes a shorter movie.
    """
    frames = [int(frame) for frame in solved.frames]
    decoder, colors = FrameDecoder(), PlateColors()
    source = PlateFrames(plate, decoder, root=root, ahead=1)

    def picture(frame: float) -> NDArray[np.uint8]:
        pixels = source.get(int(frame))
        wide, tall = plate_size(plate)
        shown = np.zeros((tall, wide, 3), np.uint8)
        if pixels is not None:
            shown = colors.display(pixels, plate.color_space, look)
        drawn = None if scene is None else scene(int(frame))
        if drawn is not None:
            shown = over_plate(shown, drawn.pixels, drawn.through, opacity)
        return marked(shown, plate, solved, int(frame))

    try:
        return write_movie(path, frames, fps, picture, lambda done: progress(done / len(frames)), Cancelled)
    finally:
        source.close()
        decoder.close()


def marked(picture: NDArray[np.uint8], plate: Plate, solved: SolvedCamera, frame: int) -> NDArray[np.uint8]:
    """A frame (H, W, 3) uint8 sRGB of a plate with the marks of its solve, and in words how far it is off."""
    tall, wide = picture.shape[:2]
    ratio = max(1.0, tall / 1080.0)
    # one pixel of the plate is one of the picture, whatever the shape of the pixels
    over = plate_camera(0.5 * (wide - 1), -0.5 * (tall - 1), float(tall))
    sheet = Sheet(plate.replace(pixel_aspect=1.0), frame, over, (wide, tall), ratio)
    out = np.ascontiguousarray(picture).copy()
    draw_lines(out, solve_marks(solved, sheet), ratio)
    row = row_of_frame(solved, frame)
    off = "" if row is None else f"   {solved.by_frame[row]:.2f} px RMS"
    place, size = (round(14 * ratio), round(26 * ratio)), 0.55 * ratio
    for colour, width in ((DARK, 4), (LETTERS, 1)):
        cv2.putText(out, f"{frame}{off}", place, cv2.FONT_HERSHEY_SIMPLEX, size, colour, round(width * ratio),
                    cv2.LINE_AA)
    return out


def draw_lines(picture: NDArray[np.uint8], overlays: Overlays, ratio: float) -> None:
    """Draw the lines among marks into a picture (H, W, 3) uint8, each with a dark edge."""
    for one in overlays:
        if not isinstance(one, Polyline):
            continue
        bound = 8.0 * max(picture.shape)
        places = np.clip(one.points, -bound, bound)
        line = np.rint(places * (1 << SHIFT)).astype(np.int32)
        width = max(1, round(one.width * ratio))
        for colour, thick in ((DARK, width + 2), (TONES[one.tone], width)):
            cv2.polylines(picture, [line], one.closed, colour, thick, cv2.LINE_AA, SHIFT)
