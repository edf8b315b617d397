"""The report of a tracking run: one page that needs nothing beside it, with a picture, curves and patterns."""

from __future__ import annotations

from html import escape
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from app.page import STYLE, Read, bytes_of, picture_data
from core.image.plate import Plate
from core.match.track import Track, TrackSettings, badness_of, errors_of

MOST_TRACKS = 200
WIDE, HIGH = 260, 48


def write_report(
    path: Path, plate: Plate, tracks: tuple[Track, ...], settings: TrackSettings, read: Read, warnings: list[str]
) -> None:
    """Write the page; tracks come worst first, as in the window (:func:`badness_of`)."""
    order = sorted(tracks, key=_worst, reverse=True)
    shown = order[:MOST_TRACKS]
    frames = sorted({int(f) for track in shown for f in (track.keys[0, 0], track.frames[-1])} & set(plate.frames))
    patterns = _patterns(shown, frames, read, settings.pattern)
    middle = plate.frames[len(plate.frames) // 2]
    rows = "".join(_row(track, plate.frames, patterns) for track in shown)
    lost = sum(1 for track in tracks if track.frames[-1] < plate.last)
    more = (
        f"<p class=sub>{len(order) - len(shown)} better tracks are not listed.</p>" if len(order) > len(shown) else ""
    )
    page = f"""<!doctype html><html lang=en><meta charset=utf-8><meta name=viewport content="width=device-width">
<title>{escape(plate.name)}: tracks</title><style>{STYLE}</style>
<h1>{escape(plate.name)}</h1>
<p class=sub>{len(tracks)} tracks, {sum(len(t.frames) for t in tracks):,} points, {lost} end before the plate does;
frames {plate.first} to {plate.last}, {plate.width} x {plate.height} pixels;
pattern {settings.pattern}, model {escape(settings.model)}</p>
{"".join(f"<p class=note>{escape(words)}</p>" for words in warnings[:50])}
{_overview(tracks, middle, read)}
<p class=sub>Frame {middle} with the tails of 10 frames. Green is sure, red is not:
a standard deviation of 0.5 px and more.</p>
<table><tr><th>track<th>frames<th>worst<th>pattern at key and end<th>motion x, y<th>standard deviation, px<th>score</tr>
{rows}</table>{more}</html>"""
    path.write_text(page, encoding="utf-8")


def _worst(track: Track) -> float:
    return float(badness_of(track).max(initial=0.0))


def _row(track: Track, span: range, patterns: dict[tuple[int, int], str]) -> str:
    deviation = errors_of(track)
    k = int(np.argmax(badness_of(track)))
    moved = track.points - track.points[0]
    ends = (int(track.keys[0, 0]), int(track.frames[-1]))
    pictures = "".join(
        f'<img class=p alt="frame {f}" src="{patterns[track.id, f]}">' for f in ends if (track.id, f) in patterns
    )
    return (
        f"<tr><td>{escape(track.name)}<td class=n>{track.frames[0]}&ndash;{track.frames[-1]}"
        f"<td class=n>{deviation[k]:.3f} px, score {track.score[k]:.2f}"
        f"<br>frame {track.frames[k]}<td><div class=pics>{pictures}</div>"
        f"<td>{_curves(track, span, (moved[:, 0], moved[:, 1]), ('#d04a3a', '#3a8a4a'))}"
        f"<td>{_curves(track, span, (deviation,), ('#3a6fd0',), 0.0)}"
        f"<td>{_curves(track, span, (track.score,), ('#8a5ad0',), 0.0, 1.0)}"
    )


def _curves(
    track: Track,
    span: range,
    curves: tuple[NDArray[np.float64], ...],
    colours: tuple[str, ...],
    low: float | None = None,
    high: float | None = None,
) -> str:
    """Curves over the frames of the plate as SVG; a gap where the track has none. The range stands at the left."""
    low = min(float(c.min()) for c in curves) if low is None else low
    high = max(float(c.max()) for c in curves) if high is None else high
    scale = (HIGH - 6) / max(high - low, 1e-9)
    parts = []
    for values, colour in zip(curves, colours, strict=True):
        words, before = [], None
        for frame, value in zip(track.frames, values, strict=True):
            x = (int(frame) - span[0]) / max(len(span) - 1, 1) * WIDE
            words.append(f"{'L' if before == frame - 1 else 'M'}{x:.1f} {HIGH - 3 - (value - low) * scale:.1f}")
            before = frame
        parts.append(f'<path d="{"".join(words)}" fill=none stroke="{colour}" stroke-width=1.3 stroke-linecap=round />')
    ends = ((9, high), (HIGH - 1, low))
    text = "".join(f"<text x=2 y={y} font-size=9 fill=#888>{value:.3g}</text>" for y, value in ends)
    return f'<svg width={WIDE} height={HIGH} viewBox="0 0 {WIDE} {HIGH}" role=img>{"".join(parts)}{text}</svg>'


def _overview(tracks: tuple[Track, ...], frame: int, read: Read) -> str:
    pixels = read(frame)
    if pixels is None:
        return ""
    image = np.ascontiguousarray(bytes_of(pixels))
    size = max(1, round(image.shape[1] / 640))
    for track in tracks:
        near = np.flatnonzero((track.frames <= frame) & (track.frames > frame - 10))
        if not len(near):
            continue
        bad = min(1.0, float(errors_of(track)[near[-1]]) / 0.5)
        colour = (round(60 + 40 * (1 - bad)), round(60 + 160 * (1 - bad)), round(70 + 170 * bad))
        tail = np.round(track.points[near] * 16).astype(np.int32).reshape(-1, 1, 2)
        cv2.polylines(image, [tail], False, colour, size, cv2.LINE_AA, 4)
        if track.frames[near[-1]] == frame:
            cv2.circle(image, tuple(int(v) for v in tail[-1, 0]), 4 * size * 16, colour, size, cv2.LINE_AA, 4)
    return f'<img class=f alt="frame {frame} with its tracks" src="{picture_data(image, ".jpg")}">'


def _patterns(tracks: list[Track], frames: list[int], read: Read, pattern: int) -> dict[tuple[int, int], str]:
    """Pictures of the patterns by track and frame, around the point itself."""
    found = {}
    for frame in frames:
        wanted = [
            (t, t.points[np.searchsorted(t.frames, frame)])
            for t in tracks
            if frame in (int(t.keys[0, 0]), int(t.frames[-1]))
        ]
        pixels = read(frame) if wanted else None
        if pixels is None:
            continue
        image = bytes_of(pixels)
        for track, (x, y) in wanted:
            found[track.id, frame] = picture_data(
                cv2.getRectSubPix(image, (pattern, pattern), (float(x), float(y))), ".png"
            )
    return found
