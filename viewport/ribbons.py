"""Blended ribbons, far to near: the part of drawing that hair and guides share."""

from __future__ import annotations

from collections.abc import Generator, Iterator

import moderngl
import numpy as np
from numpy.typing import NDArray

from viewport.shaders import program, set_uniforms
from viewport.strand_textures import StrandTextures, points_by_axis

SEGMENTS_AT_ONCE = 1 << 14  # blended between two steps
STRANDS_AT_ONCE = 1 << 14  # whose depths are worked out between two steps
SHORTEST_PIECE = 3.5  # samples; pieces of hair shorter than that in the middle are joined


def drawn_points(points: np.ndarray, samples_per_metre: float) -> NDArray[np.intp]:
    """Which points of every strand are drawn: all, or every second, third ... and the last where pieces are tiny.

    points : (N, 3, P) or (N, P, 3) float32. samples_per_metre : in the middle of the scene.
    """
    some = points[:: max(1, len(points) // 2000)]
    count = points.shape[2] if points.shape[1] == 3 else points.shape[1]
    if len(some) == 0:
        return np.arange(count)
    pieces = np.sqrt(sum(np.diff(v, axis=1).astype(np.float64) ** 2 for v in points_by_axis(some)))
    piece = float(np.median(pieces)) * samples_per_metre
    step = int(np.clip(np.rint(SHORTEST_PIECE / max(piece, 1e-9)), 1, max(1, (count - 1) // 4)))
    return np.unique(np.append(np.arange(0, count, step), count - 1))


def far_to_near(
    points: np.ndarray, view_row: NDArray[np.float64], drawn: NDArray[np.intp] | None = None,
    rows: NDArray[np.integer] | None = None,
) -> Generator[None, None, NDArray[np.uint32]]:
    """Order of all pieces by decreasing depth of their middle, (M * (D - 1),) uint32, strand-major numbers, in steps.

    points : (N, 3, P) or (N, P, 3) float32. view_row : (4,) float64, depth = view_row . (x, y, z, 1).
    drawn : the D points that are drawn (all by default); a piece lies between two of them.
    rows : the M strands that are drawn (all by default).

    Depth is cut into 65,536 steps, so that numpy sorts by radix, in one pass over the data; equal steps keep their
    order, which makes pictures repeat to the bit.
    """
    x, y, z = points_by_axis(points)
    count = x.shape[1] if drawn is None else len(drawn)
    strands = len(points) if rows is None else len(rows)
    if strands == 0:
        return np.zeros(0, np.uint32)
    a, b, c = (np.float32(v) for v in view_row[:3])
    middle = np.empty((strands, count - 1), np.float32)
    for start in range(0, strands, STRANDS_AT_ONCE):
        which = slice(start, start + STRANDS_AT_ONCE) if rows is None else rows[start : start + STRANDS_AT_ONCE]
        depth = a * x[which] + b * y[which] + c * z[which]
        if drawn is not None and count != x.shape[1]:
            depth = depth[:, drawn]
        middle[start : start + STRANDS_AT_ONCE] = depth[:, 1:] + depth[:, :-1]
        yield
    flat = middle.reshape(-1)
    low, high = float(flat.min()), float(flat.max())
    scale = np.float32(65535.0 / max(high - low, 1e-30))
    steps = ((np.float32(high) - flat) * scale).astype(np.uint16)
    yield
    order = np.argsort(steps, kind="stable").astype(np.uint32)
    yield
    if rows is not None:
        pieces = np.uint32(count - 1)
        strand, piece = np.divmod(order, pieces)
        order = rows.astype(np.uint32)[strand] * pieces + piece
    return order


def ribbon_corners(
    order: NDArray[np.uint32], drawn: NDArray[np.intp], per_strand: int
) -> Iterator[NDArray[np.uint32]]:
    """Vertex numbers (k, 6) of the two triangles of every piece, at most SEGMENTS_AT_ONCE pieces at a time."""
    pieces = np.uint32(len(drawn) - 1)
    start_left, end_left = 2 * drawn[:-1], 2 * drawn[1:]
    corners = np.stack(
        [start_left, start_left + 1, end_left, end_left, start_left + 1, end_left + 1], axis=1
    ).astype(np.uint32)
    for start in range(0, len(order), SEGMENTS_AT_ONCE):
        strand, piece = np.divmod(order[start : start + SEGMENTS_AT_ONCE], pieces)
        numbers = corners[piece]
        numbers += (strand * np.uint32(2 * per_strand))[:, None]
        yield numbers


class Ribbons:
    """The program and the index buffer that draw any strands whose sides and colours have been worked out."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self.ctx = ctx
        self.program = program(ctx, ("strand_points.glsl", "ribbon.vert"), ("ribbon.frag",))
        self.cards = program(ctx, ("strand_points.glsl", "ribbon.vert"), ("ribbon_cards.frag",))
        self.indices = ctx.buffer(reserve=SEGMENTS_AT_ONCE * 24, dynamic=True)
        self.vertices, self.card_vertices = (
            ctx.vertex_array(prog, [], index_buffer=self.indices, index_element_size=4)
            for prog in (self.program, self.cards)
        )

    def draw(
        self, strands: StrandTextures, order: NDArray[np.uint32], drawn: NDArray[np.intp],
        clip_from_world: NDArray[np.float64], target: moderngl.Framebuffer, samples: int = 1,
        across: float = 1.0,
    ) -> Iterator[float]:
        """Blend the pieces into the target in the given order, testing depth but not writing it; part done, in steps.

        samples : of the target for a pixel, on a side. across : how many hairs a ribbon stands for; with more than
        one it is drawn as so many strands side by side.
        """
        done = 0
        for numbers in ribbon_corners(order, drawn, strands.per_strand):
            self.indices.orphan()
            self.indices.write(numbers.data)
            target.use()
            target.depth_mask = False
            self.ctx.enable(moderngl.BLEND | moderngl.DEPTH_TEST)
            self.ctx.blend_func = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
            vertices = self.card_vertices if across > 1.0 else self.vertices
            strands.bind(vertices.program)
            strands.sides.use(1)
            strands.colors.use(2)
            set_uniforms(vertices.program, {
                "strand_sides": 1, "strand_colors": 2, "clip_from_world": clip_from_world,
                "picture_size": tuple(map(float, target.viewport[2:])), "samples_per_pixel": float(samples),
                "strands_across": across, "margin": 0.0,
            })
            vertices.render(moderngl.TRIANGLES, vertices=numbers.size)
            target.depth_mask = True
            self.ctx.disable(moderngl.BLEND | moderngl.DEPTH_TEST)
            done += len(numbers)
            yield done / len(order)

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        for thing in (self.vertices, self.card_vertices, self.indices, self.program, self.cards):
            thing.release()
