"""Meshes at the frames of their clips, kept within a budget of bytes, so that playing over them again is quick."""

from __future__ import annotations

from collections import OrderedDict
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.document import Document, MeshObject
from core.evaluator import Evaluator
from core.mesh.mesh import Mesh
from core.mesh.normals import mesh_normals
from core.mesh.skin import Posed, skin_at_rest
from core.pose.pose_space import Correctives
from core.pose.rig import Rig
from core.posed import held, moves, points_at, shown_points


class _Kept(NamedTuple):
    mesh: Mesh
    rig: Rig | None
    correctives: Correctives | None
    posed: Posed
    bytes: int

    def is_of(self, item: MeshObject) -> bool:
        """True when nothing that makes the pose was edited."""
        return self.mesh is item.mesh and self.rig is item.rig and self.correctives is item.correctives


class PosedFrames:
    """Posed vertices by mesh and frame, the longest unused dropped first. An edited mesh or rig is posed anew.

    They are kept apart from what the evaluator remembers: playing must not push out what is slow to make.
    """

    def __init__(self, evaluator: Evaluator, budget: int = 256 << 20) -> None:
        self._evaluator, self._budget = evaluator, budget
        self._used = 0
        self._kept: OrderedDict[tuple[int, float], _Kept] = OrderedDict()
        self._held: dict[int, tuple[Mesh, Posed]] = {}  # the last pose each mesh was held in

    @property
    def bytes(self) -> int:
        """Bytes of the poses kept."""
        return self._used

    def posed(self, item: MeshObject, frame: float) -> Posed:
        """The mesh at a frame or in the pose it is held in, the same object as long as it is kept; else at rest."""
        if held(item):
            return self._held_still(item, shown_points(item, frame, self._evaluator))
        if not moves(item):
            rest = skin_at_rest(item.mesh, self._evaluator)
            return Posed(rest.points, rest.normals)
        key = item.id, float(frame)
        kept = self._kept.get(key)
        if kept is not None and kept.is_of(item):
            self._kept.move_to_end(key)
            return kept.posed
        self._drop_older_than(item)
        assert item.rig is not None
        points = points_at(item.mesh, item.rig, item.correctives, float(frame), self._evaluator)
        if points is item.mesh.points:
            posed = Posed(points, skin_at_rest(item.mesh, self._evaluator).normals)
            size = 0  # nothing of its own
        else:
            posed = Posed(points, mesh_normals(item.mesh, points))
            size = posed.points.nbytes + posed.normals.nbytes
        self._kept[key] = _Kept(item.mesh, item.rig, item.correctives, posed, size)
        self._used += size
        while self._used > self._budget and len(self._kept) > 1:
            self._remove(next(iter(self._kept)))
        return posed

    def cached(self, document: Document) -> list[int]:
        """The whole frames every mesh of the document that moves is kept at, ascending."""
        moving = [item for item in document.meshes if moves(item) and not item.hidden]
        if not moving:
            return []
        frames = [
            {
                frame for (mesh_id, frame), kept in self._kept.items()
                if mesh_id == item.id and kept.is_of(item)
            }
            for item in moving
        ]
        return sorted(int(frame) for frame in set.intersection(*frames) if frame.is_integer())

    def _held_still(self, item: MeshObject, points: NDArray[np.float32]) -> Posed:
        """The mesh in the pose it is held in; a hand moves some of it, so only normals there are made anew."""
        rest = skin_at_rest(item.mesh, self._evaluator)
        mesh, last = self._held.get(item.id, (item.mesh, Posed(rest.points, rest.normals)))
        if mesh is not item.mesh:
            last = Posed(rest.points, rest.normals)
        if last.points is not points:
            last = Posed(points, mesh_normals(item.mesh, points, last))
        self._held[item.id] = item.mesh, last
        return last

    def _drop_older_than(self, item: MeshObject) -> None:
        """Drop poses of this mesh as it was before it was edited."""
        for key, kept in list(self._kept.items()):
            if key[0] == item.id and not kept.is_of(item):
                self._remove(key)

    def _remove(self, key: tuple[int, float]) -> None:
        self._used -= self._kept.pop(key).bytes
