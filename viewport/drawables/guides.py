"""Guides as lines on the graphics card."""

from __future__ import annotations

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
        self.shade = program(ctx, ("fullscreen.vert",), ("strand_points.glsl", "line_shade.frag"))

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        self.shade.release()


def guide_colors(lines: GuideLines) -> NDArray[np.float32]:
    """(G, 4) float32 linear RGB of each guide by its state, and 1."""
    out = np.ones((len(lines.states), 4), np.float32)
    palette = np.asarray(lines.colors, np.float32)
    out[:, :3] = palette[np.minimum(lines.states, len(palette) - 1)]
    return out


class GuideDrawable:
    """Textures of one set of guides, kept as long as its arrays are the same ones."""

    def __init__(self, ctx: moderngl.Context, programs: GuidePrograms, lines: GuideLines) -> None:
        self.lines = lines
        self.programs = programs
        self.textures = StrandTextures(ctx, lines.points)
        self.tints = self.textures.per_strand_texture(guide_colors(lines))
        self.shade = ctx.vertex_array(programs.shade, [])

    def holds(self, lines: GuideLines) -> bool:
        """True when the textures hold just these arrays and colours."""
        mine = self.lines
        return mine.points is lines.points and mine.states is lines.states and mine.colors == lines.colors

    def update(self, lines: GuideLines) -> bool:
        """Upload what differs into the same textures; False when the size is another."""
        if lines.points.shape != self.lines.points.shape:
            return False
        if lines.points is not self.lines.points:
            self.upload_rows(lines, 0, len(lines.points))
        self.textures.write(self.tints, guide_colors(lines))
        self.lines = lines
        return True

    def upload_rows(self, lines: GuideLines, start: int, stop: int) -> None:
        """Upload the points of the guides from `start` to before `stop` again."""
        self.textures.write(self.textures.points, lines.points.reshape(-1, 3 * self.textures.per_strand), start, stop)

    def work_out(self, uniforms: dict[str, Any], samples: int) -> None:
        """Colour every point and lay its line out on the screen."""
        if self.textures.count == 0:
            return
        self.textures.target.use()
        self.textures.bind(self.programs.shade)
        self.tints.use(1)
        set_uniforms(self.programs.shade, {
            **uniforms, "strand_tints": 1, "line_pixels": self.lines.pixels * samples,
        })
        self.shade.render(moderngl.TRIANGLES, vertices=3)

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        for thing in (self.shade, self.tints, self.textures):
            thing.release()
