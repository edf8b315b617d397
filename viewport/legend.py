"""What the colours of a map mean: a ramp with words at its ends, in a corner of the picture."""

from __future__ import annotations

from typing import NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from viewport.backdrop import picture_texture
from viewport.drawables.mesh import map_colors, signed_colors
from viewport.hud import ScreenImages
from viewport.overlay_drawing import TONES, Words

WIDTH, HEIGHT, MARGIN, LINE = 220.0, 10.0, 16.0, 15.0  # pixels


class Legend(NamedTuple):
    """A title, the words at the low end, the middle and the high end, and whether the ramp is that of signed values."""

    title: str
    ticks: tuple[str, str, str]
    signed: bool = False


class LegendDrawing:
    """The ramps on the card. Make, use and release it with the context current."""

    def __init__(self, ctx: moderngl.Context, images: ScreenImages) -> None:
        self.images = images
        self.ramps = tuple(picture_texture(ctx, ramp_image(colors())) for colors in (map_colors, signed_colors))

    def draw(self, legend: Legend, size: tuple[int, int], text: float, ratio: float = 1.0) -> None:
        """Draw into the lower right corner of a picture of that size, words `text` pixels tall."""
        wide, margin = min(WIDTH * ratio, 0.6 * size[0]), MARGIN * ratio
        left, top = size[0] - margin - wide, size[1] - margin - (HEIGHT + LINE) * ratio
        self.images.draw(self.ramps[legend.signed], (left, top, left + wide, top + HEIGHT * ratio), size)
        below, plain = top + (HEIGHT + 0.6 * LINE) * ratio, TONES["plain"]
        words = [Words(left + part * wide, below, tick, plain, centred=True)
                 for part, tick in zip((0.0, 0.5, 1.0), legend.ticks, strict=True)]
        words[0] = words[0]._replace(x=left + 3.2 * ratio * len(legend.ticks[0]))
        words[2] = words[2]._replace(x=left + wide - 3.2 * ratio * len(legend.ticks[2]))
        self.images.draw_words([Words(left, top - 4.0 * ratio, legend.title, plain), *words], text, size)

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        for ramp in self.ramps:
            ramp.release()


def ramp_image(colors: NDArray[np.float32]) -> NDArray[np.uint8]:
    """(1, 256, 3) uint8 sRGB of linear colours (256, 4)."""
    linear = colors[None, :, :3].astype(np.float64)
    shown = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)
    return np.round(255.0 * np.clip(shown, 0.0, 1.0)).astype(np.uint8)
