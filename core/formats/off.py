"""OFF: polygons as text, with the prefixes ST, C, N, 4 of Geomview. Colours and normals are left."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.formats.text_numbers import numbers, text_bytes
from core.mesh.mesh import Mesh
from core.mesh.polygons import Polygons


def read_off(path: Path) -> Polygons:
    """The polygons of an OFF file; texture coordinates of ST files become UVs.

    Raises
    ------
    UserError
        When it is no text OFF file, has no faces, or says more than it holds.
    """
    data = text_bytes(path.read_bytes(), path.name)
    if b"#" in data:
        data = re.sub(rb"#[^\r\n]*", b"", data)
    head = re.match(rb"\s*(ST)?(C)?(N)?(4)?(n)?OFF\s*(BINARY)?", data)
    if head is None or head[6] or head[5]:
        raise UserError(f"{path.name} is not an OFF file of text in three dimensions; export it as OBJ instead.")
    values, lines = numbers(data[head.end() :])
    if len(values) < 3 or not (np.abs(values[:2]) < 2**31).all():
        raise UserError(f"{path.name} has no counts of vertices and faces; export it again.")
    vertices, faces = int(values[0]), int(values[1])
    if vertices < 0 or faces < 0 or vertices * 3 + faces > len(values):
        raise UserError(f"{path.name} is cut short: it says {vertices} vertices and {faces} faces; copy it again.")
    if not faces or not vertices:
        raise UserError(f"{path.name} has no faces; export a polygon mesh.")
    values, lines = values[3:], lines[3:]
    width = 3 + (head[4] is not None) + 3 * (head[3] is not None) + 2 * (head[1] is not None)
    starts = np.flatnonzero(np.append(True, lines[1:] != lines[:-1]))
    by_line = len(starts) >= vertices + faces
    if not by_line:  # line ends are free in OFF, then colours cannot be told from faces
        starts = np.arange(vertices) * width
        starts = np.append(starts, _chain(values, vertices * width, faces, path.name))
    rows = starts[: vertices + faces]
    ends = np.append(rows[1:], starts[vertices + faces] if len(starts) > vertices + faces else len(values))
    if (ends[:vertices] - rows[:vertices]).min() < width:
        raise UserError(f"{path.name} has a vertex with too few numbers; export it again.")
    points = values[rows[:vertices, None] + np.arange(3)]
    if head[4]:  # homogeneous
        with np.errstate(divide="ignore", invalid="ignore"):
            points = points / values[rows[:vertices] + 3, None]
    rows, room = rows[vertices:], (ends - rows)[vertices:]
    said = values[rows]
    fits = (said >= 0) & (said < room)
    if not fits.all():
        raise UserError(f"{path.name} has a face with fewer corners than it says; export it again.")
    counts = said.astype(np.int64)
    firsts = np.cumsum(counts) - counts
    corners = values[np.repeat(rows + 1 - firsts, counts) + np.arange(int(counts.sum()))]
    whole = np.where(np.abs(corners) < 2**31, corners, -1.0).astype(np.int64)
    uvs = None
    if head[1]:
        by_vertex = values[starts[:vertices, None] + np.arange(width - 2, width)].astype(np.float32)
        uvs = by_vertex[np.clip(whole, 0, vertices - 1)]
    return Polygons(points, counts, whole, uvs, np.zeros(faces, np.int32), ("mesh",))


def write_off(path: Path, mesh: Mesh) -> None:
    """Write the polygons; parts are lost. UVs are kept (as STOFF) where each vertex has only one."""
    points = mesh.points.tolist()
    head = "OFF"
    if mesh.uvs is not None:
        by_vertex = np.zeros((len(points), 2), np.float32)
        by_vertex[mesh.corners] = mesh.uvs
        if np.array_equal(by_vertex[mesh.corners], mesh.uvs):
            head = "STOFF"
            points = [[*p, *uv] for p, uv in zip(points, by_vertex.tolist(), strict=True)]
    lines = [f"{head}\n# metres, Y up\n{len(points)} {len(mesh.counts)} 0\n"]
    lines += [" ".join(f"{x:.9g}" for x in row) + "\n" for row in points]
    corners = mesh.corners.astype(str).tolist()
    start = 0
    for count in mesh.counts.tolist():
        lines.append(f"{count} {' '.join(corners[start : start + count])}\n")
        start += count
    path.write_text("".join(lines), encoding="utf-8", newline="\n")


def _chain(values: NDArray[np.float64], start: int, faces: int, name: str) -> list[int]:
    """Where each face begins when faces follow one another without line ends."""
    starts = []
    for _ in range(faces):
        starts.append(start)
        if start >= len(values) or not 0 <= values[start] < len(values):
            raise UserError(f"{name} is cut short: it says {faces} faces; copy it again.")
        start += 1 + int(values[start])
    return starts
