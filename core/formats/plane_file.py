"""Planes of a plate as JSON: drawn ones in, followed ones out; frames and pixels as those of tracks.

In: ``{"planes": [{"name": ..., "frame": 1001, "outline": [[x, y], ...], "smooth": false}]}``. Out, besides:
``corners``, four points on the frame it was drawn on, and ``frames``: ``[[frame, [[x, y], four of them], error,
score], ...]``, where the corners are seen, how far off the worst is foretold to be in pixels, and how like the plane is
to how it was drawn.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from core.errors import UserError
from core.formats.given_file import decoded_json
from core.match.track import PlaneTrack, carried_points, drawn_plane

MOST_POINTS = 10_000


class _Plane(msgspec.Struct):
    frame: int
    outline: list[tuple[float, float]]
    name: str = ""
    smooth: bool = False


class _File(msgspec.Struct):
    planes: list[_Plane]


def read_planes(path: Path) -> tuple[PlaneTrack, ...]:
    """Read planes to be followed.

    Raises
    ------
    UserError
        The file is not of this form; the message says what is wrong.
    """
    file = decoded_json(path, _File, "a file of planes")
    made = []
    for number, one in enumerate(file.planes, 1):
        name = "".join(c for c in one.name if c.isprintable())[:255] or f"plane{number}"
        if not 3 <= len(one.outline) <= MOST_POINTS:
            raise UserError(f"{path.name}: plane {name!r} needs an outline of 3 to {MOST_POINTS} points.")
        try:
            made.append(drawn_plane(number, name, one.frame, np.array(one.outline, np.float64), smooth=one.smooth))
        except (ValueError, OverflowError) as error:
            raise UserError(f"{path.name}: plane {name!r} cannot be used: {error}.") from None
    return tuple(made)


def write_planes(path: Path, planes: tuple[PlaneTrack, ...], size: tuple[int, int]) -> None:
    """Write planes with where their corners went. size : of the plate, pixels."""
    path.write_bytes(msgspec.json.encode({"size": list(size), "planes": [_written(plane) for plane in planes]}))


def _written(plane: PlaneTrack) -> dict[str, Any]:
    rows = []
    for at, frame in enumerate(plane.frames.tolist()):
        there = carried_points(plane, frame, plane.corners)
        assert there is not None  # it is one of its frames
        rows.append([frame, there.tolist(), float(plane.error[at]), float(plane.score[at])])
    return {"name": plane.name, "frame": plane.key_frame, "outline": plane.outline.tolist(), "smooth": plane.smooth,
            "corners": plane.corners.tolist(), "frames": rows}
