"""AMD TressFX hair assets (.tfx, version 4): read only.

Little endian header of 160 bytes: version f32, strands u32, points per strand u32, then byte offsets of the
arrays (0 where absent): points f32[4], strand UVs f32[2], point UVs, strand thickness f32, point colours f32[4].
The fourth number of a point is its inverse mass and not used. The format has no unit or axis. Source: the
struct TressFXTFXFileHeader of the open TressFX 4 library, as documented there.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.formats.raw_curves import RawCurves, clean, pack

SUFFIXES = (".tfx",)
HEADER = struct.Struct("<f7I")


def read(path: str) -> dict[str, Any]:
    """Read a .tfx file in its own space (see ``raw_curves.pack``).

    Raises
    ------
    UserError
        When it is another version, or an array does not lie inside the file.
    """
    name = Path(path).name
    with open(path, "rb") as file:
        size = file.seek(0, 2)
        file.seek(0)
        head = file.read(HEADER.size)
        if len(head) < HEADER.size:
            raise UserError(f"{name} is not a TressFX file.")
        version, strands, per_strand, points_at, uvs_at, _, _, _ = HEADER.unpack(head)
        if version != 4.0:
            raise UserError(f"{name} is not a TressFX 4 file; only version 4 is read.")

        def column(offset: int, rows: int, width: int) -> NDArray[np.float32]:
            if offset < HEADER.size or offset + 4 * width * rows > size:
                raise UserError(f"{name} is damaged: an array does not lie inside the file.")
            file.seek(offset)
            return np.fromfile(file, "<f4", rows * width).reshape(rows, width)

        if per_strand < 2:
            raise UserError(f"{name} is damaged: its strands have {per_strand} points.")
        raw = RawCurves(
            points=np.ascontiguousarray(column(points_at, strands * per_strand, 4)[:, :3]),
            counts=np.full(strands, per_strand, np.int64),
            root_uvs=column(uvs_at, strands, 2) if uvs_at else None,
        )
    return pack([clean(raw, name)], name=Path(path).stem, metres_per_unit=None, up=None)
