"""A frame of a plate on the screen, as large as its view says, with small pictures, marks and words over it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from core.overlay import Overlay
from viewport.backdrop import picture_texture
from viewport.through_lens import Bent, ThroughLens
from viewport.view import HudLine, View3D

SHARP_FROM = 3.0  # pixels of the screen for one of the plate: from here on they are shown as squares
GROUND = (0.075, 0.08, 0.085)  # around the picture

Box = tuple[float, float, float, float]
"""Left, top, right, bottom in pixels of the screen, y down, the corners of pixels at whole numbers."""


class Inset(NamedTuple):
    """A small picture (H, W, 3) uint8 sRGB in a box."""

    pixels: NDArray[np.uint8]
    box: Box


class PlatePicture:
    """Draws with the programs of a view. Make, use and release it with the context current."""

    def __init__(self, view: View3D) -> None:
        self.view = view
        self._pixels: NDArray[np.uint8] | None = None
        self._texture: moderngl.Texture | None = None
        self._through: ThroughLens | None = None
        self._insets: list[tuple[NDArray[np.uint8], moderngl.Texture]] = []

    def present(
        self, framebuffer: moderngl.Framebuffer, size: tuple[int, int], pixels: NDArray[np.uint8] | None, box: Box,
        overlays: Sequence[Overlay] = (), hud: Sequence[HudLine] = (), ratio: float = 1.0,
        insets: Sequence[Inset] = (), bent: Bent | None = None,
    ) -> None:
        """Draw a frame (H, W, 3) uint8 sRGB, top row first, into its box, and the rest over it; None for no frame.

        bent : what a solved camera sees, drawn over the frame and below all marks.
        """
        ctx = self.view.ctx
        ctx.disable(moderngl.BLEND | moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        framebuffer.use()
        framebuffer.viewport = (0, 0, *size)
        framebuffer.clear(*GROUND, 1.0)
        framebuffer.use()
        framebuffer.viewport = (0, 0, *size)
        if pixels is not None:
            texture = self._frame(pixels)
            tall, wide = pixels.shape[:2]
            sharp = min((box[2] - box[0]) / wide, (box[3] - box[1]) / tall) >= SHARP_FROM
            texture.filter = (moderngl.LINEAR, moderngl.NEAREST if sharp else moderngl.LINEAR)
            self.view.images.draw(texture, box, size)
            if bent is not None:
                if self._through is None:
                    self._through = ThroughLens(ctx)
                self._through.draw(bent, texture, box, size)
        self.view.draw_over(size, overlays, hud, ratio, axes=False)
        for inset, texture in zip(insets, self._inset_textures(insets), strict=True):
            self.view.images.draw(texture, inset.box, size)

    def _frame(self, pixels: NDArray[np.uint8]) -> moderngl.Texture:
        if self._texture is not None and self._pixels is pixels:
            return self._texture
        same = self._pixels is not None and self._pixels.shape == pixels.shape
        if self._texture is not None and same:
            self._texture.write(np.ascontiguousarray(pixels).tobytes(), alignment=1)
        else:
            if self._texture is not None:
                self._texture.release()
            self._texture = picture_texture(self.view.ctx, pixels)
        self._pixels = pixels
        return self._texture

    def _inset_textures(self, insets: Sequence[Inset]) -> list[moderngl.Texture]:
        known = self._insets
        self._insets = []
        for inset in insets:
            found = next((pair for pair in known if pair[0] is inset.pixels), None)
            if found is None:
                texture = picture_texture(self.view.ctx, inset.pixels)
                texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
                found = inset.pixels, texture
            self._insets.append(found)
        kept = {id(texture) for _, texture in self._insets}
        for _, texture in known:
            if id(texture) not in kept:
                texture.release()
        return [texture for _, texture in self._insets]

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        things: list[Any] = [texture for _, texture in self._insets]
        things += [thing for thing in (self._texture, self._through) if thing is not None]
        for thing in things:
            thing.release()
        self._texture, self._pixels, self._insets, self._through = None, None, [], None
