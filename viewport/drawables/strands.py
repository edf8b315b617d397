"""A coat of hair on the graphics card."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from core.random import rand
from viewport.scene import Coat, mean_width
from viewport.shaders import program, set_uniforms
from viewport.strand_textures import StrandTextures

SHADOW_HAIRS = 150_000  # more than these are drawn into the light's maps as every second, third ... one, each heavier
SHADOW_PIECES = 6  # a hair casts its shadow as this many straight pieces at least
STRANDS_AT_ONCE = 1 << 14  # uploaded between two steps
LINE_PIECES_AT_ONCE = 1 << 16  # drawn from the light between two steps
SOME = 2048  # strands that may be worked out alone; more are worked out all together
QUAD = np.array([0, 1, 2, 2, 1, 3], np.uint32)  # its corners as two triangles
ABSORPTION = 0.4  # per width of hair over width of texel; below 1 as hair scatters light onwards


class StrandPrograms:
    """The programs every coat is drawn with."""

    def __init__(self, ctx: moderngl.Context) -> None:
        points = "strand_points.glsl"
        self.shade = program(
            ctx, (points, "strand_rows.vert"), (points, "display.glsl", "lighting.glsl", "strand_shade.frag"))
        self.depth = program(ctx, (points, "strand_light.vert"), ("depth_only.frag",))
        self.opacity = program(ctx, (points, "strand_light.vert"), ("strand_opacity.frag",))

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        for thing in (self.shade, self.depth, self.opacity):
            thing.release()


def strand_tints(coat: Coat) -> NDArray[np.float32]:
    """(N, 4) float32: linear factors on the colour of each hair and a factor on its width, keyed on the ids."""
    look = coat.look
    ids = np.asarray(coat.ids)
    value = np.exp2(look.value_variation * 2.0 * (rand(ids, 11) + rand(ids, 12) - 1.0))
    warmth = look.hue_variation * (2.0 * rand(ids, 13) - 1.0)
    out = np.empty((len(ids), 4), np.float32)
    out[:, 0] = value * (1.0 + 0.16 * warmth)
    out[:, 1] = value
    out[:, 2] = value * (1.0 - 0.38 * warmth)
    out[:, 3] = 0.75 + 0.5 * rand(ids, 14)
    if coat.tints is not None:
        out[:, :3] *= coat.tints
    if coat.widths is not None:
        out[:, 3] *= coat.widths
    return out


class CoatDrawable:
    """Textures of one coat, kept as long as its arrays are the same ones."""

    def __init__(self, ctx: moderngl.Context, programs: StrandPrograms, coat: Coat, room: int = 0) -> None:
        self.coat = coat
        self.programs = programs
        self.textures = StrandTextures(ctx, coat.points, room)
        self.tints = self.textures.per_strand_texture()
        self.normals = self.textures.per_strand_texture()
        self.tints_stale = self.normals_stale = True
        self.shade = ctx.vertex_array(programs.shade, [])
        self.corners = ctx.buffer(reserve=24 * SOME, dynamic=True)
        self.shade_some = ctx.vertex_array(programs.shade, [], index_buffer=self.corners, index_element_size=4)
        self.depth = ctx.vertex_array(programs.depth, [])
        self.opacity = ctx.vertex_array(programs.opacity, [])

    def holds(self, coat: Coat) -> bool:
        """True when the textures hold just these arrays and this variation."""
        mine = self.coat
        return mine.points is coat.points and mine.normals is coat.normals and not self._tints_differ(coat)

    def _tints_differ(self, coat: Coat) -> bool:
        mine = self.coat
        return (
            mine.ids is not coat.ids or mine.tints is not coat.tints or mine.widths is not coat.widths
            or mine.look.value_variation != coat.look.value_variation
            or mine.look.hue_variation != coat.look.hue_variation
        )

    def update(self, coat: Coat) -> bool:
        """Take over another coat, whose arrays that differ are uploaded next; False when the size is another."""
        mine = self.coat
        if coat.points is not mine.points and not self.textures.resize(coat.points):
            return False
        self.normals_stale |= coat.normals is not mine.normals
        self.tints_stale |= self._tints_differ(coat)
        self.coat = coat
        return True

    def upload(self) -> Iterator[None]:
        """Upload what is not yet on the card, in steps."""
        coat, at_once = self.coat, self.textures.per_row * max(1, STRANDS_AT_ONCE // self.textures.per_row)
        for start in range(0, len(coat.points), at_once):
            part = slice(start, start + at_once)
            if self.normals_stale:
                self.textures.write(self.normals, _four(coat.normals[part]), start)
            if self.tints_stale:
                self.textures.write(self.tints, strand_tints(_part(coat, part)), start)
            if self.normals_stale or self.tints_stale:
                yield
        self.normals_stale = self.tints_stale = False
        yield from self.textures.upload(coat.points)

    def draw_depth(self, light_from_world: NDArray[np.float64]) -> Iterator[None]:
        """Draw the hairs as lines, depth alone, seen from the light, in steps."""
        yield from self._draw_lines(self.programs.depth, self.depth, {"light_from_world": light_from_world})

    def draw_opacity(self, texel: float, uniforms: dict[str, Any], share: float = 1.0) -> Iterator[None]:
        """Add the hairs to the layers of the light's opacity map, in steps.

        texel : width of one of its texels, metres. share : the part of the coat's cover that these hairs stand for
        more than once: 1 for all hairs at their true widths.
        """
        opacity = mean_width(self.coat.look) / texel * self._shadow_step() * share
        yield from self._draw_lines(self.programs.opacity, self.opacity, {**uniforms, "opacity": opacity})

    def _shadow_step(self) -> int:
        return -(-self.textures.count // SHADOW_HAIRS) or 1

    def _draw_lines(
        self, prog: moderngl.Program, vertices: moderngl.VertexArray, uniforms: dict[str, Any]
    ) -> Iterator[None]:
        step = self._shadow_step()
        pieces = self.textures.per_strand - 1
        skip = max(1, pieces // SHADOW_PIECES)
        drawn, at_once = -(-self.textures.count // step), max(1, LINE_PIECES_AT_ONCE * skip // pieces)
        for first in range(0, drawn, at_once):
            self.textures.bind(prog)
            set_uniforms(prog, {**uniforms, "strand_step": step, "point_step": skip, "first_strand": first})
            vertices.render(
                moderngl.LINE_STRIP, vertices=-(-pieces // skip) + 1, instances=min(at_once, drawn - first)
            )
            yield

    def work_out(self, uniforms: dict[str, Any], rows: NDArray[np.integer] | None = None) -> Iterator[None]:
        """Shade every point and lay its ribbon out on the screen (into the textures that the ribbons read), in steps.

        rows : the strands to work out, where nothing else has changed since the last time; None for all of them.
        Other things may be drawn between the steps, as long as they leave units 4, 5 and 6 alone.
        """
        prog, look = self.programs.shade, self.coat.look
        self.textures.bind(prog)
        self.tints.use(1)
        self.normals.use(2)
        set_uniforms(prog, {
            **uniforms, "strand_tints": 1, "strand_normals": 2, "widths": (look.root_width, look.tip_width),
            "root_color": look.root, "tip_color": look.tip, "blend": look.blend, "gloss": look.gloss,
            "roughness": look.roughness, "absorption": ABSORPTION * look.depth,
            "some_alone": rows is not None and len(rows) <= SOME, "texels": self.textures.sides.size,
        })
        if rows is not None and len(rows) <= SOME:
            self.corners.write((4 * rows.astype(np.uint32)[:, None] + QUAD).data)
            self.textures.target.viewport = (0, 0, *self.textures.sides.size)
            self.textures.target.use()
            self.textures.points.use(0)
            self.shade_some.render(moderngl.TRIANGLES, vertices=6 * len(rows))
            return
        for _ in self.textures.shading():
            self.textures.points.use(0)
            self.tints.use(1)
            self.normals.use(2)
            self.shade.render(moderngl.TRIANGLES, vertices=3)
            yield

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        for thing in (
            self.shade_some, self.corners, self.shade, self.depth, self.opacity, self.tints, self.normals,
            self.textures,
        ):
            thing.release()


def _part(coat: Coat, part: slice) -> Coat:
    return coat._replace(
        points=coat.points[part], ids=np.asarray(coat.ids)[part], normals=coat.normals[part],
        tints=None if coat.tints is None else coat.tints[part],
        widths=None if coat.widths is None else coat.widths[part], order=None,
    )


def _four(vectors: np.ndarray) -> NDArray[np.float32]:
    out = np.zeros((len(vectors), 4), np.float32)
    out[:, :3] = vectors
    return out
