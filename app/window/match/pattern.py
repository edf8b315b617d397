"""The pattern of the active track, large: on this frame, at its key, and what differs; the plate at the pointer."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from app.window.match.marks import Sheet
from app.window.match.screen import PlateScreen
from core.document import Document
from core.image.plate_view import plate_points, plate_size
from core.match.track import Track, TrackSettings
from core.overlay import Label, Marker, Overlay, Overlays, Polyline
from tools.ground import Pointer
from tools.match_edits import place_at, selected_tracks
from viewport.plate import Inset

SIDE, GAP = 132.0, 10.0  # pixels of Qt's
AROUND = 21  # pixels of the plate in the magnifier
LOOKS = 2.5  # times the difference


class Patches(NamedTuple):
    """Small pictures and what is marked about them."""

    insets: tuple[Inset, ...]
    marks: Overlays


def patches(document: Document, screen: PlateScreen, sheet: Sheet, pointer: Pointer | None) -> Patches:
    """What is shown large in the right lower corner of the view."""
    shown: list[tuple[str, NDArray[np.uint8]]] = []
    tracks = [t for t in selected_tracks(document) if t.plate_id == sheet.plate.id]
    picture = screen.pixels(sheet.plate, sheet.frame)
    if tracks and picture is not None:
        shown += _of_track(tracks[-1], picture, screen, sheet)
    if pointer is not None and picture is not None:
        place = plate_points(sheet.camera, sheet.plate.pixel_aspect, (pointer.x, pointer.y), *sheet.size)[0]
        wide, tall = plate_size(sheet.plate)
        if 0 <= place[0] < wide and 0 <= place[1] < tall:
            shown.append((f"{place[0]:.1f}, {place[1]:.1f}", around(picture, place, AROUND, wide)))
    side, gap = SIDE * sheet.ratio, GAP * sheet.ratio
    insets: list[Inset] = []
    marks: list[Overlay] = []
    bottom = sheet.size[1] - gap
    for number, (words, pixels) in enumerate(reversed(shown)):
        right = sheet.size[0] - gap - number * (side + gap)
        box = (right - side, bottom - side, right, bottom)
        insets.append(Inset(pixels, box))
        frame = np.array([[box[0], box[1]], [box[2], box[1]], [box[2], box[3]], [box[0], box[3]]]) - 0.5
        marks.append(Polyline(frame, "faint", 2.0, closed=True))
        marks.append(Label(box[0] + 2.0 * sheet.ratio, box[1] - 5.0 * sheet.ratio, words, "plain", True))
        marks.append(Marker(0.5 * (box[0] + box[2]), 0.5 * (box[1] + box[3]), 11.0 * sheet.ratio, "accent"))
    return Patches(tuple(insets), tuple(marks))


def around(picture: NDArray[np.uint8], place: NDArray[np.float64], side: int, wide: int) -> NDArray[np.uint8]:
    """A square (side, side, 3) of pixels of a plate about a place, between them too; `wide` is the plate's width, of
    which the picture may be a smaller one."""
    scale = picture.shape[1] / wide
    x, y = (scale * (place - 0.5 * (side - 1) + 0.5) - 0.5).tolist()
    cut = cv2.warpAffine(
        picture, np.array([[scale, 0.0, x], [0.0, scale, y]]), (side, side),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(cut, np.uint8)


def _of_track(
    track: Track, picture: NDArray[np.uint8], screen: PlateScreen, sheet: Sheet
) -> list[tuple[str, NDArray[np.uint8]]]:
    place = place_at(track, sheet.frame)
    if place is None:
        return []
    settings = track.settings or TrackSettings()
    side = settings.pattern + 8
    wide = plate_size(sheet.plate)[0]
    now = around(picture, place + np.asarray(track.offset), side, wide)
    shown = [(f"frame {sheet.frame}", now)]
    before = track.keys[track.keys[:, 0] <= sheet.frame]
    key = before[-1] if len(before) else track.keys[0] if len(track.keys) else None
    if key is None or int(key[0]) == sheet.frame:
        return shown
    screen.want(sheet.plate, int(key[0]))
    there = screen.pixels(sheet.plate, int(key[0]))
    if there is None:
        return shown
    then = around(there, key[1:] + np.asarray(track.offset), side, wide)
    apart = LOOKS * (now.astype(np.float32) - then.astype(np.float32))
    differs = np.clip(128.0 + apart - apart.mean(), 0.0, 255.0).astype(np.uint8)
    return [(f"key {int(key[0])}", then), *shown, ("difference", differs)]
