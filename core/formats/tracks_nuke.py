"""2D tracks of Nuke: the knobs of Tracker3 nodes, and the table of Tracker4, the tracker since Nuke 7.

Pixels begin at the lower left corner of the picture, y up. Written are Tracker3 nodes, which every Nuke opens.
"""

from __future__ import annotations

import re

from core.errors import UserError
from core.formats.tracks_json import Tracks
from core.formats.tracks_text import Rows, Size, corner_up, free_name, ours_from_corner_up, tracks_of
from core.match.track import Track

NODE = re.compile(r"^[ \t]*Tracker([34])[ \t]*\{", re.MULTILINE)
KNOB = re.compile(r"\btrack\d+ \{\{curve ([^{}]*)\} \{curve ([^{}]*)\}\}")
LABEL = re.compile(r'^[ \t]*label "([^"\n]*)"', re.MULTILINE)
# a row of the table: enabled or not, name, x, y, and more that is about patterns
ROW = re.compile(r'\{\s*(?:\{[^{}]*\}|[01])\s+("[^"\n]*"|[^\s{}"]+)\s+\{curve ([^{}]*)\}\s+\{curve ([^{}]*)\}')


def read_nuke(text: str, size: Size, name: str) -> Tracks:
    """The tracks of all trackers of a script. Those of Tracker3 are named by its label where it names all of them."""
    rows: Rows = {}
    _, *nodes = NODE.split(text)  # kind and words of each in turn
    for kind, words in zip(nodes[::2], nodes[1::2], strict=True):
        if kind == "4":
            found = [(title.strip('"'), x, y) for title, x, y in ROW.findall(words)]
        else:
            curves, label = KNOB.findall(words), LABEL.search(words)
            titles = label[1].split(", ") if label else []
            if len(titles) != len(curves):
                titles = [f"track{k + 1}" for k in range(len(curves))]
            found = [(title, x, y) for title, (x, y) in zip(titles, curves, strict=True)]
        for title, *parts in found:
            x, y = (nuke_curve(part, name) for part in parts)
            rows[free_name(title, rows)] = [(frame, x[frame], y[frame]) for frame in sorted(x.keys() & y.keys())]
    return tracks_of(rows, size, name, ours_from_corner_up)


def write_nuke(tracks: tuple[Track, ...], size: Size) -> str:
    """Nuke: Tracker3 nodes of four tracks each."""
    nodes = []
    for first in range(0, len(tracks), 4):
        knobs = []
        for number, track in enumerate(tracks[first : first + 4], 1):
            points = corner_up(track.points, size)
            curves = [
                "{curve " + " ".join(f"x{f} {v:.6f}" for f, v in zip(track.frames, points[:, c], strict=True)) + "}"
                for c in range(2)
            ]
            knobs += [f" enable{number} true", f" track{number} {{{curves[0]} {curves[1]}}}"]
        names = ", ".join(re.sub(r"[^\w .-]", "_", track.name) for track in tracks[first : first + 4])
        nodes.append("Tracker3 {\n" + "\n".join(knobs) + f'\n name Tracker{first // 4 + 1}\n label "{names}"\n}}\n')
    return "".join(nodes)


def nuke_curve(words: str, name: str) -> dict[float, float]:
    """A curve of Nuke: x and a number set the frame, every value counts it on by one."""
    values: dict[float, float] = {}
    frame = 1.0
    for word in words.split():
        jump = word.startswith("x")
        try:
            number = float(word[1:] if jump else word)
        except ValueError:
            if word[:1].isalpha():  # interpolation, slopes: nothing that moves a key
                continue
            raise UserError(f"{name}: {word[:40]!r} stands in a curve.") from None
        if jump:
            frame = number
        else:
            values[frame] = number
            frame += 1.0
    return values
