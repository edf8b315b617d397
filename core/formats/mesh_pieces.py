"""The pieces a file shows, joined into one; and the way from a child process back."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from core.mesh.polygons import Polygons


def join(pieces: Sequence[Polygons]) -> Polygons:
    """All pieces as one; parts of the same name are one part."""
    names: dict[str, int] = {}
    base = 0
    corners, parts = [], []
    for piece in pieces:
        outside = (piece.corners < 0) | (piece.corners >= len(piece.points))
        corners.append(np.where(outside, -1, piece.corners + base))
        rows = np.array([names.setdefault(name, len(names)) for name in piece.part_names], np.int32)
        parts.append(rows[piece.parts])
        base += len(piece.points)
    uvs = None
    if any(piece.uvs is not None for piece in pieces):
        uvs = np.concatenate([
            np.full((len(p.corners), 2), np.nan, np.float32) if p.uvs is None else p.uvs for p in pieces
        ])  # fmt: skip
    return Polygons(
        np.concatenate([p.points for p in pieces]), np.concatenate([p.counts for p in pieces]),
        np.concatenate(corners), uvs, np.concatenate(parts), tuple(names),
    )  # fmt: skip


def unique_names(pieces: Sequence[Polygons]) -> list[Polygons]:
    """The same pieces, their parts renamed so that no two pieces share a name: eye, eye_2, ..."""
    seen: dict[str, int] = {}
    renamed = []
    for piece in pieces:
        names = []
        for name in piece.part_names:
            seen[name] = seen.get(name, 0) + 1
            names.append(name if seen[name] == 1 else f"{name}_{seen[name]}")
        renamed.append(piece._replace(part_names=tuple(names)))
    return renamed


def pack(pieces: Sequence[Polygons], metres_per_unit: float | None, up: str | None) -> dict[str, Any]:
    """The joined pieces as what a child process may answer; see :func:`unpack`."""
    whole = join(pieces)
    answer = {
        "points": whole.points, "counts": whole.counts, "corners": whole.corners, "parts": whole.parts,
        "part_names": list(whole.part_names), "metres_per_unit": metres_per_unit, "up": up,
    }  # fmt: skip
    if whole.uvs is not None:
        answer["uvs"] = whole.uvs
    return answer


def unpack(answer: dict[str, Any]) -> Polygons:
    """The polygons of an answer of :func:`pack`."""
    return Polygons(
        answer["points"], answer["counts"], answer["corners"], answer.get("uvs"), answer["parts"],
        tuple(answer["part_names"]),
    )  # fmt: skip
