"""2D tracks in the plain text of other programs.

What they count: 3DEqualizer's and PFTrack's pixels begin at the lower left corner of the picture with y up, so the
middle of our pixel (x, y) is (x + 0.5, height - 0.5 - y); Boujou's begin at the top left corner, y down; SynthEyes
gives parts of the picture from -1 to 1, y down; mmSolver's 0 to 1, y up. A name that comes twice gets a number.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.formats.tracks_json import FARTHEST, MOST_TRACKS, Tracks
from core.match.track import Track, keyed_track

Rows = dict[str, list[tuple[float, float, float]]]  # name -> frame, x, y
Size = tuple[int, int]


def corner_up(points: NDArray[np.float64], size: Size) -> NDArray[np.float64]:
    """Our pixels (N, 2) to those from the lower left corner, y up; the same way back."""
    return np.stack((points[:, 0] + 0.5, size[1] - 0.5 - points[:, 1]), axis=1)


def ours_from_corner_up(x: float, y: float, size: Size) -> tuple[float, float]:
    return x - 0.5, size[1] - 0.5 - y


def _ours_from_corner_down(x: float, y: float, size: Size) -> tuple[float, float]:
    return x - 0.5, y - 0.5


def ours_from_unit_up(x: float, y: float, size: Size) -> tuple[float, float]:
    return x * size[0] - 0.5, (1.0 - y) * size[1] - 0.5


def _ours_from_signed_down(x: float, y: float, size: Size) -> tuple[float, float]:
    return (x + 1.0) / 2.0 * size[0] - 0.5, (y + 1.0) / 2.0 * size[1] - 0.5


def tracks_of(rows: Rows, size: Size, name: str, place: Callable[[float, float, Size], tuple[float, float]]) -> Tracks:
    """Tracks whose every point is a key, from rows in the pixels of a program."""
    if not rows or len(rows) > MOST_TRACKS:
        raise UserError(f"{name} holds {'no' if not rows else 'too many'} tracks.")
    made = []
    for number, (word, points) in enumerate(rows.items(), 1):
        keys = np.array([(frame, *place(x, y, size)) for frame, x, y in points], np.float64).reshape(-1, 3)
        if not len(keys):
            continue
        if not np.isfinite(keys).all() or np.abs(keys).max() > FARTHEST or (keys[:, 0] != np.floor(keys[:, 0])).any():
            raise UserError(f"{name}: track {word[:60]} has a point that is no place in a picture.")
        title = "".join(c for c in word if c.isprintable()).strip()[:255] or f"track{number}"
        made.append(keyed_track(number, title, keys))
    return Tracks(tuple(made), size)


def read_3de(text: str, size: Size, name: str) -> Tracks:
    """3DEqualizer4: count; for every point its name, colour, count of frames, then ``frame x y`` (pixels)."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    rows: Rows = {}
    at = 1
    for _ in range(_whole(lines, 0, name, MOST_TRACKS)):
        word = _line(lines, at, name)
        count = _whole(lines, at + 2, name, len(lines))
        rows[free_name(word, rows)] = [_numbers(_line(lines, at + 3 + k, name), name) for k in range(count)]
        at += 3 + count
    return tracks_of(rows, size, name, ours_from_corner_up)


def write_3de(tracks: tuple[Track, ...], size: Size) -> str:
    out = [str(len(tracks))]
    for track in tracks:
        out += [track.name.replace(" ", "_"), "0", str(len(track.frames))]
        points = corner_up(track.points, size)
        out += [f"{frame} {x:.6f} {y:.6f}" for frame, (x, y) in zip(track.frames, points, strict=True)]
    return "\n".join(out) + "\n"


def read_boujou(text: str, size: Size, name: str) -> Tracks:
    """Boujou: lines of ``name view frame x y`` or ``name frame x y``; # begins a comment."""
    rows: Rows = {}
    for line in text.splitlines():
        words = line.split("#", 1)[0].split()
        if len(words) not in (4, 5):
            if words:
                raise UserError(f"{name}: {line[:60]!r} is not a name, a frame, x and y.")
            continue
        rows.setdefault(words[0], []).append(_numbers(" ".join(words[-3:]), name))
    return tracks_of(rows, size, name, _ours_from_corner_down)


def write_boujou(tracks: tuple[Track, ...], size: Size) -> str:
    out = ["# boujou export: text", "# track_id view x y"]
    for track in tracks:
        for frame, (x, y) in zip(track.frames, track.points, strict=True):
            out.append(f"{track.name.replace(' ', '_')} {frame} {x + 0.5:.6f} {y + 0.5:.6f}")
    return "\n".join(out) + "\n"


def read_pftrack(text: str, size: Size, name: str) -> Tracks:
    """PFTrack's .2dt: for every track its name in quotes, the clip, the count, then ``frame x y similarity``."""
    lines = [s for line in text.splitlines() if (s := line.strip()) and not s.startswith("#")]
    rows: Rows = {}
    at = 0
    while at < len(lines):
        word = lines[at].strip('"')
        # the number of the clip stands between name and count since version 5
        skip = 1 if len(lines[at + 1 : at + 3]) == 2 and len(lines[at + 2].split()) == 1 else 0
        count = _whole(lines, at + 1 + skip, name, len(lines))
        points = [_line(lines, at + 2 + skip + k, name) for k in range(count)]
        rows[free_name(word, rows)] = [_numbers(" ".join(line.split()[:3]), name) for line in points]
        at += 2 + skip + count
    return tracks_of(rows, size, name, ours_from_corner_up)


def write_pftrack(tracks: tuple[Track, ...], size: Size) -> str:
    out = ['# "Name"', "# clipNumber", "# frameCount", "# frame, xpos, ypos, similarity"]
    for track in tracks:
        out += ["", f'"{track.name}"', "1", str(len(track.frames))]
        points = corner_up(track.points, size)
        rows = zip(track.frames, points, track.score, strict=True)
        out += [f"{frame} {x:.6f} {y:.6f} {score:.4f}" for frame, (x, y), score in rows]
    return "\n".join(out) + "\n"


def read_syntheyes(text: str, size: Size, name: str) -> Tracks:
    """SynthEyes' tracker 2-D paths: lines of ``name frame u v`` and perhaps more, u and v from -1 to 1."""
    rows: Rows = {}
    for line in text.splitlines():
        words = line.split()
        if words and not words[0].startswith("#"):
            rows.setdefault(words[0], []).append(_numbers(" ".join(words[1:4]), name))
    return tracks_of(rows, size, name, _ours_from_signed_down)


def write_syntheyes(tracks: tuple[Track, ...], size: Size) -> str:
    out = []
    for track in tracks:
        word = track.name.replace(" ", "_")
        for frame, (x, y) in zip(track.frames, track.points, strict=True):
            out.append(f"{word} {frame} {2 * (x + 0.5) / size[0] - 1:.9f} {2 * (y + 0.5) / size[1] - 1:.9f} 7")
    return "\n".join(out) + "\n"


def read_uv(text: str, size: Size, name: str) -> Tracks:
    """mmSolver's .uv, version 2 and later: JSON of points with ``per_frame`` positions from 0 to 1, y up."""
    try:
        found = json.loads(text)
        rows: Rows = {}
        for point in found["points"]:
            per_frame = [(float(p["frame"]), float(p["pos"][0]), float(p["pos"][1])) for p in point["per_frame"]]
            rows[free_name(str(point["name"]), rows)] = per_frame
    except (ValueError, KeyError, TypeError, IndexError, RecursionError) as error:
        raise UserError(f"{name} is no .uv file of mmSolver ({type(error).__name__}).") from None
    return tracks_of(rows, size, name, ours_from_unit_up)


def write_uv(tracks: tuple[Track, ...], size: Size) -> str:
    points: list[dict[str, Any]] = []
    for track in tracks:
        deviation = np.sqrt((track.covariance[:, 0] + track.covariance[:, 2]) / 2.0)
        rows = zip(track.frames, corner_up(track.points, size) / size, deviation, strict=True)
        # the more certain the heavier, a tenth of a pixel as 1
        per_frame = [
            {"frame": int(f), "pos": [float(x), float(y)], "weight": float(min(1.0, 0.1 / max(s, 1e-9)))}
            for f, (x, y), s in rows
        ]
        points.append({"name": track.name, "id": track.id, "set_name": "", "per_frame": per_frame, "3d": None})
    return json.dumps({"version": 4, "num_points": len(points), "is_undistorted": False, "points": points})


def _line(lines: list[str], at: int, name: str) -> str:
    if at >= len(lines):
        raise UserError(f"{name} ends in the middle of a track.")
    return lines[at]


def _whole(lines: list[str], at: int, name: str, most: int) -> int:
    word = _line(lines, at, name)
    if not (word.isascii() and word.isdigit() and len(word) < 10 and int(word) <= most):
        raise UserError(f"{name}: {word[:40]!r} stands where a count belongs.")
    return int(word)


def _numbers(line: str, name: str) -> tuple[float, float, float]:
    try:
        frame, x, y = (float(word) for word in line.split())
    except ValueError:
        raise UserError(f"{name}: {line[:60]!r} is not a frame, x and y.") from None
    if not all(math.isfinite(v) for v in (frame, x, y)):
        raise UserError(f"{name}: {line[:60]!r} holds a number that is not finite.")
    return frame, x, y


def free_name(word: str, rows: Rows) -> str:
    name, number = word or "track", 2
    while name in rows:
        name, number = f"{word}_{number}", number + 1
    return name
