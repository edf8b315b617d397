"""Whether the file of a sculpt joins the same vertices to the same faces as the rig, and where it first does not."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from core.errors import UserError
from core.formats.mesh_file import MeshFile, read_mesh
from core.mesh.mesh import Mesh
from core.pose.rig import Rig

_FACE = re.compile(rb"^[ \t]*f[ \t]", re.MULTILINE)
ADVICE = "export it with the vertices and faces of the rig's file, in their order and not triangulated"


def check_topology(path: Path, mesh: Mesh, rig: Rig) -> None:
    """Refuse a sculpt that is no reshaping of the rig's mesh. The order of its faces and their turn do not matter.

    An OBJ without faces, a bare list of points, is taken at its word. Faces that the sculpt has made so small that the
    reader leaves them out are not missed.

    Parameters
    ----------
    path : a file that `core.formats.pose_json.read_sculpt` takes: as many vertices as the rig's file, all finite.

    Raises
    ------
    UserError
        With the numbers of faces, the first face that differs, and what to do.
    """
    if path.suffix.lower() == ".obj" and _FACE.search(path.read_bytes()) is None:
        return
    found = read_mesh(path)
    ours, theirs = _places(found, mesh, rig)
    rows = _rows((mesh, ours), (found.mesh, theirs))
    same = np.unique(rows, axis=0, return_inverse=True)[1].ravel()
    mine, its = same[: len(mesh.counts)], same[len(mesh.counts) :]
    counts = f"{path.name} has {found.faces:,} faces and the rig {len(mesh.counts):,}"
    strange = np.flatnonzero(~np.isin(its, mine))
    if len(strange):
        first = int(strange[0])
        number = int(np.flatnonzero(found.face_of_file == first)[0])
        start = 1 if path.suffix.lower() == ".obj" else 0
        corners = found.mesh.corners[slice(*_ends(found.mesh, first))]
        vertices = sorted(int(np.flatnonzero(found.vertex_of_file == v)[0]) + start for v in corners)
        raise UserError(
            f"{counts}; its face {number + start} joins the vertices {str(vertices)[1:-1]} (counted from {start}), "
            f"which no face of the rig does: {ADVICE}.")
    missing = int((~np.isin(mine, its)).sum())
    if missing > found.faces - len(found.mesh.counts):
        raise UserError(f"{counts}; {missing:,} faces of the rig are not in it: {ADVICE}.")


def _places(found: MeshFile, mesh: Mesh, rig: Rig) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """A number for each vertex of the rig's mesh and of the sculpt's, equal where one vertex of the file went to both.

    Each of the two may have welded vertices that the other kept apart.
    """
    there = np.arange(found.vertices) if rig.file_vertices is None else rig.file_vertices
    went, count = found.vertex_of_file, len(mesh.points)
    kept = went >= 0
    size = count + len(found.mesh.points)
    graph = coo_matrix((np.ones(int(kept.sum()), np.int8), (there[kept], count + went[kept])), shape=(size, size))
    number = connected_components(graph, directed=False)[1].astype(np.int64)
    return number[:count], number[count:]


def _rows(*meshes: tuple[Mesh, NDArray[np.int64]]) -> NDArray[np.int64]:
    """The corners of all faces of the meshes, ascending, one row each; -1 in front where a face has fewer."""
    wide = max(int(mesh.counts.max(initial=3)) for mesh, _ in meshes)
    tables = []
    for mesh, number in meshes:
        table = np.full((len(mesh.counts), wide), -1, np.int64)
        table[np.arange(wide)[None, :] < mesh.counts[:, None]] = number[mesh.corners]
        tables.append(np.sort(table, axis=1))
    return np.concatenate(tables)


def _ends(mesh: Mesh, face: int) -> tuple[int, int]:
    first = int(mesh.counts[:face].sum(dtype=np.int64))
    return first, first + int(mesh.counts[face])
