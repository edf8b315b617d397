"""Tracks, planes and masks drawn over the plate: tails, boxes, names, in colours that say how sure each one is."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.camera import Camera
from core.document import Document
from core.image.plate import Plate
from core.image.plate_view import pixels_per_pixel, view_points
from core.match.outline import curve_through, outline_at
from core.match.track import PlaneTrack, Track, TrackSettings, carried_points, errors_of
from core.overlay import Circle, Label, Marker, Overlay, Overlays, Polyline, Tone
from tools.match_edits import place_at

TAIL = 24  # frames on each side
MANY, SHORT_TAIL = 100, 8  # with so many tracks tails are shorter
GOOD, POOR = 0.15, 0.5  # pixels of standard deviation
UNLIKE = 0.7  # of the score
SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
DOT = 3.0

Array = NDArray[np.float64]


class Sheet:
    """What lies over a plate at a frame, in pixels of a view."""

    def __init__(self, plate: Plate, frame: int, camera: Camera, size: tuple[int, int], ratio: float) -> None:
        self.plate, self.frame, self.camera, self.size, self.ratio = plate, frame, camera, size, ratio

    def at(self, points: Array) -> Array:
        """Pixels (N, 2) of the view."""
        return view_points(self.camera, self.plate.pixel_aspect, points, *self.size)

    @property
    def scale(self) -> float:
        """Pixels of the view for one of the plate."""
        return pixels_per_pixel(self.camera, self.size[1])


def marks_of(document: Document, sheet: Sheet) -> Overlays:
    """Everything that is marked on the plate of a sheet."""
    plate = sheet.plate
    out: list[Overlay] = []
    for mask in document.masks:
        if mask.plate_id == plate.id and not mask.hidden:
            points = outline_at(mask, sheet.frame)
            outline = curve_through(points) if mask.smooth else points
            out.append(Polyline(sheet.at(outline), "trouble", 1.5, closed=True))
    for plane in document.planes:
        if plane.plate_id == plate.id and not plane.hidden:
            out += plane_marks(plane, sheet)
    tracks = [t for t in document.tracks if t.plate_id == plate.id and not t.hidden]
    tail = SHORT_TAIL if len(tracks) > MANY else TAIL
    chosen = set(document.track_selection)
    for track in sorted(tracks, key=lambda t: t.id in chosen):
        out += track_marks(track, sheet, track.id in chosen, tail)
    return tuple(out)


def track_marks(track: Track, sheet: Sheet, selected: bool, tail: int) -> list[Overlay]:
    """The tail of a track, its place, and of a selected one its boxes and its name."""
    near = (track.frames >= sheet.frame - tail) & (track.frames <= sheet.frame + tail)
    out: list[Overlay] = []
    place = place_at(track, sheet.frame)
    tone: Tone = "selected" if selected else tone_of(track, sheet.frame)
    if near.sum() > 1:
        frames, points = track.frames[near], sheet.at(track.points[near])
        for rows in np.split(np.arange(len(frames)), np.flatnonzero(np.diff(frames) > 1) + 1):
            past = rows[frames[rows] <= sheet.frame]
            to_come = rows[frames[rows] >= sheet.frame]
            if len(past) > 1:
                out.append(Polyline(points[past], tone, 1.5 if selected else 1.0))
            if len(to_come) > 1:
                out.append(Polyline(points[to_come], "faint", 1.0))
    if place is None:
        return out
    x, y = (float(v) for v in sheet.at(place)[0])
    keyed = bool((track.keys[:, 0] == sheet.frame).any())
    out.append(Marker(x, y, (13.0 if selected else 9.0) * sheet.ratio, tone))
    if keyed:
        out.append(Circle(x, y, DOT * sheet.ratio, tone))
    if selected:
        settings = track.settings or TrackSettings()
        middle = place + np.asarray(track.offset)
        outline = 0.5 * settings.pattern * SQUARE if track.shape is None else \
            curve_through(track.shape) if track.shape_smooth else track.shape
        search = (0.5 * settings.pattern + settings.search) * SQUARE
        out.append(Polyline(sheet.at(middle + outline), tone, 1.5, closed=True))
        out.append(Polyline(sheet.at(middle + search), "faint", 1.0, closed=True, dashed=True))
        words = f"{track.name}{'  key' if keyed else ''}{'  locked' if track.locked else ''}"
        corner = sheet.at(middle + 0.5 * settings.pattern * np.array([1.0, -1.0]))[0]
        out.append(Label(float(corner[0]) + 4.0 * sheet.ratio, float(corner[1]) - 2.0 * sheet.ratio, words, tone, True))
    return out


def plane_marks(plane: PlaneTrack, sheet: Sheet) -> list[Overlay]:
    """The corners of a plane with its diagonals, and its outline."""
    corners = carried_points(plane, sheet.frame, plane.corners)
    if corners is None:
        return []
    at = sheet.at(corners)
    across = [Polyline(at[[a, a + 2]], "faint", 1.0) for a in (0, 1)]
    return [Polyline(at, "accent", 1.5, closed=True), *across]


def tone_of(track: Track, frame: int) -> Tone:
    """Good, middling or poor: how sure the track is of its place on the frame, or of its worst where it is not seen."""
    if not len(track.frames):
        return "faint"
    at = int(np.searchsorted(track.frames, frame))
    rows = slice(at, at + 1) if at < len(track.frames) and track.frames[at] == frame else slice(None)
    error, score = float(errors_of(track)[rows].max()), float(track.score[rows].min())
    if error > POOR or score < UNLIKE:
        return "trouble"
    return "good" if error <= GOOD else "accent"
