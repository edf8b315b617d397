"""Tracks as JSON, the form of ``filoplume track``: points of a frame, x and y, with their covariance and score.

``{"size": [w, h], "frames": [first, last], "tracks": [{"name": ..., "points": [[frame, x, y], ...]}]}``; a point that
was tracked has seven numbers: frame, x, y, sxx, sxy, syy (px^2), score. Frames are numbered as the files are, pixel
centres lie at whole numbers, the origin is top left, y points down. ``own`` is written beside ``points``: the part of
the covariance that belongs to the frame alone, xx, xy, yy in the order of the points.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from core.errors import UserError
from core.formats.given_file import decoded_json
from core.match.track import HAND, Track, keyed_track
from core.record import freeze

LARGEST_FILE = 1 << 30
MOST_TRACKS = 1_000_000
FARTHEST = 1e7  # pixels


class Tracks(msgspec.Struct):
    """Tracks of a file, and the plate they belong to where the file says: size in pixels, first and last frame."""

    tracks: tuple[Track, ...]
    size: tuple[int, int] | None = None
    frames: tuple[int, int] | None = None


class _Track(msgspec.Struct):
    name: str
    points: list[list[float]]
    own: list[list[float]] | None = None
    keys: list[int] | None = None


class _File(msgspec.Struct):
    tracks: list[_Track]
    size: tuple[int, int] | None = None
    frames: tuple[int, int] | None = None


def read_tracks_json(path: Path) -> Tracks:
    """Read tracks. Points of three numbers are keys; of seven numbers tracked, unless ``keys`` names their frames.

    Raises
    ------
    UserError
        The file is not of this form; the message says where.
    """
    file = decoded_json(path, _File, "a file of tracks", LARGEST_FILE)
    if len(file.tracks) > MOST_TRACKS:
        raise UserError(f"{path.name} holds more than {MOST_TRACKS:,} tracks.")
    if file.size is not None and min(file.size) < 1:
        raise UserError(f"{path.name}: size must be two whole numbers of 1 or more.")
    return Tracks(tuple(_track(k + 1, one, path.name) for k, one in enumerate(file.tracks)), file.size, file.frames)


def _track(number: int, one: _Track, file: str) -> Track:
    name = "".join(c for c in one.name if c.isprintable())[:255] or f"track{number}"
    rows: dict[int, list[float]] = {}
    own: dict[int, list[float]] = {}
    for k, point in enumerate(one.points):
        where = f"{file}: track {name!r}, point {k + 1}"
        if len(point) not in (3, 7):
            raise UserError(f"{where} must be [frame, x, y] or [frame, x, y, sxx, sxy, syy, score].")
        if not all(math.isfinite(v) for v in point) or point[0] != int(point[0]) or abs(point[0]) >= 2**31:
            raise UserError(f"{where} must have a whole frame and finite numbers.")
        if max(abs(point[1]), abs(point[2])) > FARTHEST:
            raise UserError(f"{where} lies {FARTHEST:g} pixels away or more.")
        rows[int(point[0])] = point
        if one.own is not None and k < len(one.own) and len(one.own[k]) == 3:
            own[int(point[0])] = one.own[k]
    if not rows:
        raise UserError(f"{file}: track {name!r} has no points; give it one key at least.")
    named = set(one.keys or ())
    frames = sorted(rows)
    keys = [frame for frame in frames if len(rows[frame]) == 3 or frame in named]
    if not keys:
        keys = frames  # another program's tracks: every point is as good as another
    table = np.array([[*rows[f][1:3], *(rows[f][3:] or (HAND, 0.0, HAND, 1.0))] for f in frames])
    mine = np.array([own.get(f, list(table[k, 2:5])) for k, f in enumerate(frames)], np.float64)
    if not np.isfinite(mine).all():
        raise UserError(f"{file}: track {name!r} has numbers in own that are not finite.")
    track = keyed_track(number, name, np.array([[f, *rows[f][1:3]] for f in keys], np.float64))
    return track.replace(
        frames=freeze(np.array(frames, np.int32)),
        points=freeze(table[:, :2].copy()),
        covariance=freeze(table[:, 2:5].copy()),
        own=freeze(mine),
        score=freeze(np.clip(table[:, 5], 0.0, 1.0)),
    )


def write_tracks_json(path: Path, tracks: Tracks) -> None:
    """Write tracks; keys carry the covariance of a hand's own key."""
    path.write_bytes(msgspec.json.encode(tracks_object(tracks)))


def tracks_object(tracks: Tracks) -> dict[str, Any]:
    """The tracks as plain lists and numbers, in the form of the file."""
    first = min((int(t.frames[0]) for t in tracks.tracks if len(t.frames)), default=1)
    last = max((int(t.frames[-1]) for t in tracks.tracks if len(t.frames)), default=1)
    return {
        "size": list(tracks.size or (0, 0)),
        "frames": list(tracks.frames or (first, last)),
        "tracks": [
            {
                "name": track.name,
                "keys": [int(frame) for frame in track.keys[:, 0]],
                "points": [
                    [
                        int(frame),
                        *(round(float(v), 5) for v in point),
                        *(float(f"{v:.6g}") for v in covariance),
                        round(float(score), 4),
                    ]
                    for frame, point, covariance, score in zip(
                        track.frames, track.points, track.covariance, track.score, strict=True
                    )
                ],
                "own": [[float(f"{v:.6g}") for v in own] for own in track.own],
            }
            for track in tracks.tracks
        ],
    }
