"""A solved camera over the plate: where it puts the points, coloured by how far they are off; test cubes, the world."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.window.match.marks import Sheet
from core.match.solved import SolvedCamera, cube_edges, pixels_of, world_axes
from core.match.solved_scene import grades, ground_lines
from core.overlay import Overlay, Overlays, Polyline, Tone

CROSS = 5.0  # half of a cross, pixels of the screen


def solve_marks(solved: SolvedCamera, sheet: Sheet) -> Overlays:
    """Crosses where points are told to be on the frame of a sheet, cubes on them, the axes of a world that is said."""
    xy = pixels_of(solved, sheet.frame, solved.points)
    if xy is None:
        return ()
    out: list[Overlay] = []
    half = CROSS * sheet.ratio
    tones: tuple[Tone, ...] = ("good", "accent", "trouble")
    for place, grade in zip(xy, grades(solved.errors).tolist(), strict=True):
        if np.isfinite(place).all():
            x, y = sheet.at(place[None])[0]
            tone = tones[grade]
            out += [Polyline(np.array([[x - half, y], [x + half, y]]), tone, 1.0),
                    Polyline(np.array([[x, y - half], [x, y + half]]), tone, 1.0)]
    if solved.line_up.said:
        for line in ground_lines(solved):
            out += _line(solved, sheet, line, "faint", 1.0)
        axes: tuple[Tone, ...] = ("x", "y", "z")
        for tone, axis in zip(axes, world_axes(solved), strict=True):
            out += _line(solved, sheet, axis, tone)
    for track_id in solved.cubes:
        if track_id not in solved.track_ids:
            continue
        for edge in cube_edges(solved, track_id):
            out += _line(solved, sheet, edge, "selected")
    return tuple(out)


def _line(
    solved: SolvedCamera, sheet: Sheet, points: NDArray[np.float64], tone: Tone, width: float = 2.0
) -> list[Overlay]:
    """A line through points of the world, bent by the lens, where all of them are before the camera."""
    line = pixels_of(solved, sheet.frame, points)
    if line is None or not np.isfinite(line).all():
        return []
    return [Polyline(sheet.at(line), tone, width)]
