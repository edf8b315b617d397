"""Cem Yuksel's .hair files: a 128-byte header and plain arrays (cemyuksel.com/research/hairmodels).

Little endian: "HAIR" (some programs write it in lower case), strands u32, points u32, arrays u32 (bits:
1 segments, 2 points, 4 thickness, 8 transparency, 16 colours), default segments u32, default thickness f32,
default transparency f32, default colour f32[3], 88 bytes of text; then the arrays that are there, in that
order: u16 per strand, f32[3], f32, f32 and f32[3] per point. A strand has one point more than segments, root first.

The format has no unit, axis, ids, UVs or guides. We write metres and Y up (or what is asked) and say so in the
text, where our reader finds it again; other files are metres and Y up unless told (Cem Yuksel's own models
are Z up). Thickness is read and written as a diameter.
"""

from __future__ import annotations

import re
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.formats.file_space import from_metres_y_up, scaled
from core.formats.raw_curves import RawCurves, clean, pack
from core.groom.strands import GroomStrands, Strands
from core.mesh.mesh import Mesh

SUFFIXES = (".hair",)
HEADER = struct.Struct("<4sIIIIff3f88s")
SEGMENTS, POINTS, THICKNESS, TRANSPARENCY, COLORS = 1, 2, 4, 8, 16
MOST_SEGMENTS = 65535
SAID = re.compile(rb"metres_per_unit=([0-9.eE+-]+) up=([yz])")


def write(path: Path, groom: GroomStrands, mesh: Mesh | None, up: str, metres_per_unit: float, maker: str) -> None:
    """Write the children of `groom` (its guides where it has no children) to `path`; `mesh` is not used.

    Raises
    ------
    UserError
        When there is nothing to write, or a strand has more segments than the format can count.
    """
    strands = groom.children if groom.children is not None else groom.guides
    if strands is None:
        raise UserError("This groom has neither hairs nor guides to write.")
    segments = strands.counts - 1
    if len(segments) and segments.max() > MOST_SEGMENTS:
        raise UserError(f"A .hair file cannot hold a strand of {segments.max() + 1} points; write .usdc instead.")
    same = len(segments) > 0 and bool((segments == segments[0]).all())
    widths = None if strands.widths is None else scaled(strands.widths, metres_per_unit, divide=True)
    arrays = POINTS | (0 if same else SEGMENTS) | (THICKNESS if widths is not None else 0)
    arrays |= COLORS if strands.colors is not None else 0
    text = f"{maker} metres_per_unit={metres_per_unit!r} up={up}".encode("ascii", "replace")[-88:]
    with path.open("wb") as file:
        file.write(HEADER.pack(
            b"HAIR", len(strands), len(strands.points), arrays, int(segments[0]) if same else 0,
            float(widths.mean()) if widths is not None and len(widths) else 0.0, 0.0, *_mean_color(strands), text,
        ))  # fmt: skip
        if not same:
            file.write(segments.astype("<u2").tobytes())
        file.write(from_metres_y_up(strands.points, metres_per_unit, up).astype("<f4", copy=False).data)
        if widths is not None:
            file.write(widths.astype("<f4", copy=False).data)
        if strands.colors is not None:
            file.write(strands.colors.astype("<f4", copy=False).data)


def _mean_color(strands: Strands) -> tuple[float, ...]:
    if strands.colors is None or not len(strands.colors):
        return (0.5, 0.5, 0.5)
    return tuple(float(c) for c in strands.colors.mean(axis=0))


def read(path: str) -> dict[str, Any]:
    """Read a .hair file in its own space (see ``raw_curves.pack``).

    Nothing is allocated before the counts of the header have been held against the size of the file.

    Raises
    ------
    UserError
        When it is no .hair file, or holds less than its header says.
    """
    name = Path(path).name
    with open(path, "rb") as file:
        size = file.seek(0, 2)
        file.seek(0)
        head = file.read(HEADER.size)
        if len(head) < HEADER.size or head[:4].upper() != b"HAIR":
            raise UserError(f"{name} is not a .hair file.")
        _, strands, points, arrays, segments, thickness, _, *color, text = HEADER.unpack(head)
        if not arrays & POINTS:
            raise UserError(f"{name} holds no points.")
        per_point = 12 + 4 * bool(arrays & THICKNESS) + 4 * bool(arrays & TRANSPARENCY) + 12 * bool(arrays & COLORS)
        expected = HEADER.size + (2 * strands if arrays & SEGMENTS else 0) + per_point * points
        if size < expected:
            raise UserError(f"{name} is cut short: its header promises {expected} bytes and it has {size}.")
        if not arrays & SEGMENTS and strands * (segments + 1) != points:
            raise UserError(f"{name} is damaged: {strands} strands of {segments} segments are not {points} points.")

        def column(dtype: str, rows: int, width: int) -> NDArray[Any]:
            return np.fromfile(file, dtype, rows * width).reshape((rows, width) if width > 1 else (rows,))

        if arrays & SEGMENTS:
            counts = column("<u2", strands, 1).astype(np.int64) + 1
        else:
            counts = np.full(strands, segments + 1, np.int64)
        if int(counts.sum()) != points:
            raise UserError(f"{name} is damaged: its strands have {int(counts.sum())} points and it holds {points}.")
        raw = RawCurves(counts=counts, points=column("<f4", points, 3))
        if arrays & THICKNESS:
            raw.widths = column("<f4", points, 1)
        elif np.isfinite(thickness) and thickness > 0:
            raw.widths = np.full(points, thickness, np.float32)
        if arrays & TRANSPARENCY:
            file.seek(4 * points, 1)
        if arrays & COLORS:
            raw.colors = column("<f4", points, 3)
        elif not SAID.search(text) and np.isfinite(color).all():  # in our own files that colour says nothing
            raw.colors = np.tile(np.array(color, np.float32), (points, 1))
    said = SAID.search(text)
    unit = float(said[1]) if said else 0.0
    return pack(
        [clean(raw, name)], name=Path(path).stem,
        metres_per_unit=unit if np.isfinite(unit) and unit > 0 else None, up=said[2].decode() if said else None,
    )  # fmt: skip
