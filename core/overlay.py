"""What a tool wants drawn over the picture: plain values in pixels, which the viewport draws.

Pixels are those of the framebuffer: the centre of the top left one is (0, 0), x right, y down.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

# what a mark means, x, y and z that it is of an axis; the viewport chooses the colour of the theme
Tone = Literal["plain", "faint", "accent", "good", "trouble", "selected", "x", "y", "z"]


class Circle(NamedTuple):
    """A circle about (x, y) of `radius` pixels."""

    x: float
    y: float
    radius: float
    tone: Tone = "plain"
    width: float = 1.5


class Polyline(NamedTuple):
    """Points (K, 2) joined by a line; `dashed` for what is only a proposal."""

    points: NDArray[np.float64]
    tone: Tone = "plain"
    width: float = 1.5
    closed: bool = False
    dashed: bool = False


class Marker(NamedTuple):
    """A cross at (x, y), `size` pixels from end to end."""

    x: float
    y: float
    size: float = 9.0
    tone: Tone = "accent"


class Label(NamedTuple):
    """Words at (x, y), their left lower corner, in the size of the window's text; `plate` darkens what is behind."""

    x: float
    y: float
    words: str
    tone: Tone = "plain"
    plate: bool = False


class Fill(NamedTuple):
    """Darkness over a rectangle, from (left, top) to (right, bottom), in pixels."""

    left: float
    top: float
    right: float
    bottom: float
    opacity: float = 0.5


Overlay = Circle | Polyline | Marker | Label | Fill
Overlays = tuple[Overlay, ...]
