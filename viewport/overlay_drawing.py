"""Overlays of tools (core.overlay) over a picture, without jagged edges, and the axes in its corner."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from core.camera import Camera
from core.overlay import Circle, Fill, Label, Marker, Overlay, Polyline
from viewport.shaders import program, set_uniforms

Byte3 = tuple[int, int, int]
TONES: Mapping[str, Byte3] = {
    "plain": (0xE4, 0xE6, 0xE9), "faint": (0x8B, 0x90, 0x98), "accent": (0xE0, 0xA4, 0x58), "good": (0x86, 0xB0, 0x81),
    "trouble": (0xDB, 0x62, 0x59), "selected": (0xFF, 0xDC, 0x8C), "x": (0xF0, 0x5A, 0x50), "y": (0x7C, 0xC8, 0x6E),
    "z": (0x5A, 0xA0, 0xF5),
}  # fmt: skip
HALO = (0.04, 0.04, 0.045, 0.42)  # under every line, so that it is seen on light fur and on dark ground
HALO_WIDTH = 1.0  # pixels on each side
MARKER_WIDTH = 1.5
DASH = (6.0, 5.0)
PLATE, PLATE_HALF, LETTER = (0.04, 0.04, 0.045, 0.72), 9.5, 7.0  # behind words; half its height, width of a letter
AXIS_COLORS: tuple[Byte3, Byte3, Byte3] = ((0xDB, 0x62, 0x59), (0x86, 0xB0, 0x81), (0x62, 0x95, 0xD6))
AXIS_LENGTH, AXIS_MARGIN = 26.0, 44.0  # pixels
MARK = 12  # floats: ends (4), shape (4), colour (4); see mark.vert
FILLED, DARK = -1.0, (0.02, 0.02, 0.022)  # in place of a radius: a box; and its colour
MARKS_AT_ONCE = 1 << 14


class Words(NamedTuple):
    """Words with their left lower corner at (x, y), or about it when `centred`."""

    x: float
    y: float
    words: str
    color: Byte3
    centred: bool = False


def marks(overlays: Sequence[Overlay], tones: Mapping[str, Byte3] = TONES, scale: float = 1.0) -> NDArray[np.float32]:
    """(K, MARK) float32: every line and circle with its halo before it, plates of words; widths times `scale`."""
    rows: list[list[float]] = []
    for overlay in overlays:
        if isinstance(overlay, Fill):
            rows.append([*overlay[:4], FILLED, 0.0, -1.0, 0.0, *DARK, overlay.opacity])
            continue
        if isinstance(overlay, Label):
            if overlay.plate:
                rows.append(_plate(overlay, scale))
            continue
        half = 0.5 * scale * (MARKER_WIDTH if isinstance(overlay, Marker) else overlay.width)
        color = [c / 255.0 for c in tones.get(overlay.tone, tones["plain"])] + [1.0]
        shapes = _shapes(overlay)
        rows += [[*s[:5], half + HALO_WIDTH * scale, s[5], 0.0, *HALO] for s in shapes]
        rows += [[*s[:5], half, s[5], 0.0, *color] for s in shapes]
    return np.asarray(rows, np.float32).reshape(-1, MARK)


def _plate(label: Label, scale: float) -> list[float]:
    """A thick dark line behind words, about as long as they are."""
    y, end = label.y - 6.5 * scale, label.x + LETTER * scale * len(label.words)
    return [label.x, y, max(end, label.x), y, 0.0, PLATE_HALF * scale, -1.0, 0.0, *PLATE]


def _shapes(overlay: Circle | Polyline | Marker) -> list[list[float]]:
    """Lists of ax, ay, bx, by, radius, way along a dashed line before a (-1 when it is not dashed)."""
    if isinstance(overlay, Circle):
        x, y = float(overlay.x), float(overlay.y)
        return [[x, y, x, y, max(float(overlay.radius), 0.0), -1.0]]
    if isinstance(overlay, Marker):
        x, y, r = float(overlay.x), float(overlay.y), 0.5 * (overlay.size - MARKER_WIDTH)  # its ends are round
        return [[x - r, y, x + r, y, 0.0, -1.0], [x, y - r, x, y + r, 0.0, -1.0]]
    points = np.asarray(overlay.points, np.float64).reshape(-1, 2)
    if overlay.closed and len(points) > 2:
        points = np.concatenate([points, points[:1]])
    if len(points) == 1:
        points = np.repeat(points, 2, axis=0)
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    before = np.cumsum(lengths) - lengths if overlay.dashed else np.full(len(lengths), -1.0)
    shapes = np.column_stack([points[:-1], points[1:], np.zeros(len(lengths)), before])
    found: list[list[float]] = shapes[np.isfinite(shapes).all(axis=1)].tolist()
    return found


def axes_marks(
    camera: Camera, size: tuple[int, int], scale: float = 1.0
) -> tuple[NDArray[np.float32], list[Words]]:
    """The world's axes as seen by the camera, in the lower left corner, the nearest last; and their names."""
    in_view = camera.world_from_camera[:3, :3].T  # its columns are the world's axes
    middle = np.array([AXIS_MARGIN * scale, size[1] - 1.0 - AXIS_MARGIN * scale])
    rows: list[list[float]] = []
    names: list[Words] = []
    for axis in np.argsort(in_view[2]):
        tip = middle + np.array([in_view[0, axis], -in_view[1, axis]]) * AXIS_LENGTH * scale
        dim = 0.62 if in_view[2, axis] < -0.05 else 1.0
        byte = tuple(round(c * dim) for c in AXIS_COLORS[axis])
        color = [c / 255.0 for c in byte] + [1.0]
        rows.append([*middle, *tip, 0.0, 2.0 * scale, -1.0, 0.0, *HALO])
        rows.append([*middle, *tip, 0.0, 1.0 * scale, -1.0, 0.0, *color])
        at = middle + (tip - middle) * (1.0 + 10.0 * scale / max(float(np.linalg.norm(tip - middle)), 10.0 * scale))
        names.append(Words(float(at[0]), float(at[1]), "XYZ"[axis], (byte[0], byte[1], byte[2]), centred=True))
    return np.asarray(rows, np.float32), names


def labels(overlays: Sequence[Overlay], tones: Mapping[str, Byte3] = TONES) -> list[Words]:
    """The words among the overlays."""
    return [
        Words(o.x, o.y, o.words, tones.get(o.tone, tones["plain"])) for o in overlays if isinstance(o, Label)
    ]


class MarkDrawing:
    """The program and the buffer that draw marks."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self.ctx = ctx
        self.program = program(ctx, ("mark.vert",), ("mark.frag",))
        self.buffer = ctx.buffer(reserve=MARKS_AT_ONCE * MARK * 4, dynamic=True)
        self.vertices = ctx.vertex_array(
            self.program, [(self.buffer, "4f 4f 4f/i", "in_ends", "in_shape", "in_color")]
        )

    def draw(self, rows: NDArray[np.float32], size: tuple[int, int], scale: float = 1.0) -> None:
        """Blend marks (K, MARK) into the bound framebuffer, whose viewport has this size."""
        self.ctx.enable(moderngl.BLEND)
        self.ctx.blend_func = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
        set_uniforms(self.program, {
            "picture_size": (float(size[0]), float(size[1])), "dash": (DASH[0] * scale, DASH[1] * scale),
        })
        for start in range(0, len(rows), MARKS_AT_ONCE):
            part = rows[start : start + MARKS_AT_ONCE]
            self.buffer.orphan()
            self.buffer.write(np.ascontiguousarray(part).tobytes())
            self.vertices.render(moderngl.TRIANGLE_STRIP, vertices=4, instances=len(part))
        self.ctx.disable(moderngl.BLEND)

    def release(self) -> None:
        """Give back the memory; the context must be current."""
        for thing in (self.vertices, self.buffer, self.program):
            thing.release()
