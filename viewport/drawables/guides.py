"""Guides as lines on the graphics card."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from viewport.scene import GuideLines
from viewport.shaders import program, set_uniforms
from viewport.strand_textures import StrandTextures


class GuidePrograms:
    """The program all guides are drawn with."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self.shade = program(ctx, ("fullscreen.vert",), ("strand_points.glsl", "display.glsl", "line_shade.frag"))

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        self.shade.release()


def guide_colors(lines: GuideLines) -> NDArray[np.float32]:
    """(G, 4) float32 linear RGB and opacity of each guide by its state."""
    out = np.ones((len(lines.states), 4), np.float32)
    palette = np.asarray(lines.colors, np.float32)
    out[:, :3] = palette[np.minimum(lines.states, len(palette) - 1)]
    out[lines.states == 0, 3] = lines.opacity
    return out


def _dressed(lines: GuideLines) -> tuple[Any, ...]:
    """What the tints of guides are made from, beside their states."""
    return lines.colors, lines.opacity


class GuideDrawable:
    """Textures of one set of guides, kept as long as its arrays are the same ones."""

    def __init__(self, ctx: moderngl.Context, programs: GuidePrograms, lines: GuideLines, room: int = 0) -> None:
        self.lines = lines
        self.programs = programs
        self.textures = StrandTextures(ctx, lines.points, room)
        self.tints = self.textures.per_strand_texture()
        self.tints_stale = True
        self.shade = ctx.vertex_array(programs.shade, [])

    def holds(self, lines: GuideLines) -> bool:
        """True when the textures hold just these arrays and colours."""
        mine = self.lines
        return mine.points is lines.points and mine.states is lines.states and _dressed(mine) == _dressed(lines)

    def update(self, lines: GuideLines) -> bool:
        """Take over other guides, whose arrays that differ are uploaded next; False when the size is another."""
        if lines.points is not self.lines.points and not self.textures.resize(lines.points):
            return False
        self.tints_stale |= lines.states is not self.lines.states or _dressed(lines) != _dressed(self.lines)
        self.lines = lines
        return True

    def upload(self) -> Iterator[None]:
        """Upload what is not yet on the card, in steps."""
        if self.tints_stale:
            self.textures.write(self.tints, guide_colors(self.lines))
            self.tints_stale = False
        yield from self.textures.upload(self.lines.points)

    def work_out(self, uniforms: dict[str, Any]) -> Iterator[None]:
        """Colour every point and lay its line out on the screen, in steps."""
        self.textures.bind(self.programs.shade)
        set_uniforms(self.programs.shade, {**uniforms, "strand_tints": 1, "line_pixels": self.lines.pixels})
        for _ in self.textures.shading():
            self.textures.points.use(0)
            self.tints.use(1)
            self.shade.render(moderngl.TRIANGLES, vertices=3)
            yield

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        for thing in (self.shade, self.tints, self.textures):
            thing.release()
