"""Words and images over a picture. Who draws the letters is given: a window has a font, a test has OpenCV's."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Sequence
from typing import Any

import cv2
import moderngl
import numpy as np
from numpy.typing import NDArray

from viewport.backdrop import picture_texture
from viewport.overlay_drawing import Byte3, Words
from viewport.shaders import program, set_uniforms

TextImage = Callable[[str, float, Byte3], NDArray[np.uint8]]
"""(words, height of the font in pixels, sRGB) -> (H, W, 4) uint8, red green blue and opacity (colours not multiplied
by it), as tall as a line of text."""

KEPT_WORDS = 256
LINE = 1.32  # height of a line in the HUD, of the height of the font
SHADE = (0.0, 0.0, 0.0, 0.55)


def plain_text(words: str, pixels: float, color: Byte3) -> NDArray[np.uint8]:
    """Letters of strokes (OpenCV's Hershey font), for pictures without a window."""
    face, scale = cv2.FONT_HERSHEY_SIMPLEX, pixels / 30.0
    (width, height), below = cv2.getTextSize(words, face, scale, 1)
    image = np.zeros((height + below + 2, max(width, 1) + 2, 4), np.uint8)
    opacity = np.zeros(image.shape[:2], np.uint8)
    cv2.putText(opacity, words, (1, height + 1), face, scale, 255, 1, cv2.LINE_AA)
    image[..., :3] = color
    image[..., 3] = opacity
    return image


class ScreenImages:
    """Images in boxes of the picture; those of words are kept for as long as they are in use."""

    def __init__(self, ctx: moderngl.Context, text: TextImage = plain_text) -> None:
        self.ctx = ctx
        self.text = text
        self.program = program(ctx, ("image.vert",), ("image.frag",))
        self.vertices = ctx.vertex_array(self.program, [])
        self.words: OrderedDict[tuple[str, float, Byte3], moderngl.Texture] = OrderedDict()

    def draw_words(self, lines: Sequence[Words], pixels: float, size: tuple[int, int]) -> None:
        """Draw words with a dark edge below them, in a font `pixels` tall."""
        for x, y, words, color, centred in lines:
            if not words:
                continue
            texture = self._texture(words, pixels, color)
            width, height = texture.size
            left = round(x - 0.5 * width + 0.5) if centred else round(x)
            top = round(y - 0.5 * height + 0.5) if centred else round(y) - height + 1
            self.draw(texture, (left + 1, top + 1, left + 1 + width, top + 1 + height), size, SHADE)
            self.draw(texture, (left, top, left + width, top + height), size)

    def _texture(self, words: str, pixels: float, color: Byte3) -> moderngl.Texture:
        key = words, pixels, color
        if key in self.words:
            self.words.move_to_end(key)
            return self.words[key]
        while len(self.words) >= KEPT_WORDS:
            self.words.popitem(last=False)[1].release()
        self.words[key] = picture_texture(self.ctx, self.text(words, pixels, color))
        return self.words[key]

    def draw(
        self, texture: moderngl.Texture, box: tuple[float, float, float, float], size: tuple[int, int],
        tint: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0),
    ) -> None:
        """Draw a texture, first row on top, into a box: left, top, right, bottom in pixels with y down."""
        self.ctx.enable(moderngl.BLEND)
        self.ctx.blend_func = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
        texture.use(0)
        set_uniforms(self.program, {
            "picture_size": (float(size[0]), float(size[1])), "box": tuple(map(float, box)), "image": 0, "tint": tint,
        })
        self.vertices.render(moderngl.TRIANGLE_STRIP, vertices=4)
        self.ctx.disable(moderngl.BLEND)

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        things: list[Any] = [*self.words.values(), self.vertices, self.program]
        for thing in things:
            thing.release()
        self.words.clear()
