"""A solved camera over the plate: where it puts the points, coloured by how far they are off; test cubes, the world."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.window.match.marks import Sheet
from core.match.solved import SolvedCamera, cube_edges, pixels_of, world_axes
from core.overlay import Overlay, Overlays, Polyline, Tone

CROSS = 5.0  # half of a cross, pixels of the screen
FAR_OFF = 2.5  # of the median error


def solve_marks(solved: SolvedCamera, sheet: Sheet) -> Overlays:
    """Crosses where points are told to be on the frame of a sheet, cubes on them, the axes of a world that is said."""
    xy = pixels_of(solved, sheet.frame, solved.points)
    if xy is None:
        return ()
    out: list[Overlay] = []
    typical = float(np.median(solved.errors)) if len(solved.errors) else 0.0
    half = CROSS * sheet.ratio
    for place, error in zip(xy, solved.errors, strict=True):
        if np.isfinite(place).all():
            x, y = sheet.at(place[None])[0]
            tone: Tone = "good" if error <= 1.5 * typical else "accent" if error <= FAR_OFF * typical else "trouble"
            out += [Polyline(np.array([[x - half, y], [x + half, y]]), tone, 1.0),
                    Polyline(np.array([[x, y - half], [x, y + half]]), tone, 1.0)]
    if solved.line_up.said:
        axes: tuple[Tone, ...] = ("x", "y", "z")
        for tone, axis in zip(axes, world_axes(solved), strict=True):
            out += _line(solved, sheet, axis, tone)
    for track_id in solved.cubes:
        if track_id not in solved.track_ids:
            continue
        for edge in cube_edges(solved, track_id):
            out += _line(solved, sheet, edge, "selected")
    return tuple(out)


def _line(solved: SolvedCamera, sheet: Sheet, points: NDArray[np.float64], tone: Tone) -> list[Overlay]:
    """A line through points of the world, where all of them are before the camera."""
    line = pixels_of(solved, sheet.frame, points)
    if line is None or not np.isfinite(line).all():
        return []
    return [Polyline(sheet.at(line), tone, 2.0)]
