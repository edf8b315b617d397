"""A solved camera over the plate: where it puts the points, coloured by how far they are off, and test cubes."""

from __future__ import annotations

import numpy as np

from app.window.match.marks import Sheet
from core.match.solved import SolvedCamera, cube_edges, pixels_of
from core.overlay import Overlay, Overlays, Polyline, Tone

CROSS = 5.0  # half of a cross, pixels of the screen
FAR_OFF = 2.5  # of the median error


def solve_marks(solved: SolvedCamera, sheet: Sheet) -> Overlays:
    """Crosses where the points are told to be on the frame of a sheet, and the cubes that stand on them."""
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
    for track_id in solved.cubes:
        if track_id not in solved.track_ids:
            continue
        edges = cube_edges(solved, track_id)
        for edge in edges:
            line = pixels_of(solved, sheet.frame, edge)
            if line is not None and np.isfinite(line).all():
                out.append(Polyline(sheet.at(line), "selected", 2.0))
    return tuple(out)
