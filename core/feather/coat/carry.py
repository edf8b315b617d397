"""Feathers carried by the skin as they lie: every one turns and moves with its root, and none makes way.

For pictures of what moves; :class:`core.feather.coat.plumage.Plumage` lays them for a pose.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.feather.pieces import FeatherMesh
from core.mesh.mesh import Mesh
from core.mesh.roots import Roots
from core.mesh.skin import Posed
from core.mesh.surface import root_frames, root_positions


def carried_meshes(
    meshes: tuple[FeatherMesh, ...], rows: tuple[NDArray[np.intp], ...], mesh: Mesh, roots: Roots, laid: Posed,
    now: Posed,
) -> tuple[FeatherMesh, ...]:
    """Feathers that were laid on a pose of a mesh as they are in another pose of it.

    rows : for each of `meshes` the rows in `roots` of its feathers, in the order of their vertices, of which all
        feathers of a mesh have equally many.
    """
    before, after = (root_frames(mesh, roots, *pose).astype(np.float64) for pose in (laid, now))
    turn = np.asarray(np.einsum("nij,nik->njk", before, after), np.float32)  # laid -> now, for rows
    start, end = (root_positions(mesh, roots, pose.points) for pose in (laid, now))
    found = []
    for feathers, which in zip(meshes, rows, strict=True):
        points, normals, fibres = (
            column.reshape(len(which), -1, 3) for column in (feathers.points, feathers.normals, feathers.fibres)
        )
        moved = (points - start[which, None]) @ turn[which] + end[which, None]
        turned = (column @ turn[which] for column in (normals, fibres))
        flat = [np.ascontiguousarray(column.reshape(-1, 3), np.float32) for column in (moved, *turned)]
        found.append(feathers._replace(points=flat[0], normals=flat[1], fibres=flat[2]))
    return tuple(found)
