"""Coats of feathers as the window shows them: laid by jobs on other threads, kept until they are laid again."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.document import Document, MeshObject, find_mesh, keys_of
from core.evaluator import Evaluator
from core.feather.coat.coat import FeatherCoat
from core.feather.coat.plumages import Plumages
from core.feather.pieces import FeatherMesh
from core.groom.groom import Groom
from core.mesh.mesh import Mesh
from core.mesh.roots import Roots
from core.mesh.skin import Posed, skin_at_rest, skin_posed

FINE, QUICK = (11, 5), (4, 3)  # rows and columns of a vane, at rest and while things move


class FeatherPicture(NamedTuple):
    """A coat as triangles in space, one mesh for each kind of feather: as seen at rest, and while things move.

    rows : of each mesh in `roots`, feather by feather. skin : the pose they were laid for.
    """

    fine: tuple[FeatherMesh, ...]
    quick: tuple[FeatherMesh, ...]
    rows: tuple[NDArray[np.intp], ...]
    roots: Roots
    skin: Posed


class Asked(NamedTuple):
    """What a coat was laid for; it is laid again when any of it is another object. `frame` where it moves by itself."""

    coat: FeatherCoat
    keys: Groom | None
    item: MeshObject
    points: NDArray[np.float32]
    frame: float | None

    def same(self, other: Asked) -> bool:
        """True when feathers laid for one are those of the other."""
        return (
            self.coat is other.coat and self.keys is other.keys and self.item.mesh is other.item.mesh
            and self.points is other.points and self.frame == other.frame
        )


class LiveFeathers:
    """The coats of a document. Mutable; only the functions it hands out run on other threads, one for a coat."""

    def __init__(self, evaluator: Evaluator, plumages: Plumages | None = None) -> None:
        self._evaluator = evaluator
        self._plumages = Plumages(evaluator) if plumages is None else plumages
        self._laid: dict[int, tuple[Asked, FeatherPicture]] = {}
        self._carried: dict[int, tuple[FeatherPicture, Posed, FeatherPicture]] = {}  # the last one, and what it is of

    def follow(self, document: Document) -> None:
        """Forget the coats that are gone."""
        alive = {coat.id for coat in document.feathers}
        self._plumages.follow(alive)
        self._laid = {k: laid for k, laid in self._laid.items() if k in alive}
        self._carried = {k: carried for k, carried in self._carried.items() if k in alive}

    def wanted(
        self, document: Document, posed: Callable[[MeshObject], Posed], meshes: Iterable[MeshObject], frame: float
    ) -> list[tuple[Asked, Callable[[], FeatherPicture]]]:
        """Coats that are not laid as they should be, each with the function that lays it."""
        found: list[tuple[Asked, Callable[[], FeatherPicture]]] = []
        for asked in self._asked(document, posed, meshes, frame):
            laid = self._laid.get(asked.coat.id)
            if laid is None or not laid[0].same(asked):
                found.append((asked, partial(self._lay, asked, document, frame)))
        return found

    def adopt(self, asked: Asked, picture: FeatherPicture) -> None:
        """Show a coat that was laid."""
        self._laid[asked.coat.id] = asked, picture

    def shown(
        self, document: Document, posed: Callable[[MeshObject], Posed], meshes: Iterable[MeshObject]
    ) -> dict[int, list[FeatherPicture]]:
        """Pictures by the id of their mesh, be what they were laid for older: on a skin they were not laid for those
        of moving pictures, carried by it."""
        found: dict[int, list[FeatherPicture]] = {}
        for item in meshes:
            for coat in document.feathers:
                laid = self._laid.get(coat.id)
                if coat.mesh_id == item.id and not coat.hidden and laid and _same_faces(laid[0].item.mesh, item.mesh):
                    found.setdefault(item.id, []).append(self._on(coat.id, laid[1], laid[0].item.mesh, posed(item)))
        return found

    def _on(self, coat_id: int, picture: FeatherPicture, mesh: Mesh, skin: Posed) -> FeatherPicture:
        """A picture on a skin: as it was laid, or carried."""
        if skin.points is picture.skin.points:
            return picture
        known = self._carried.get(coat_id)
        if known is not None and known[0] is picture and known[1].points is skin.points:
            return known[2]
        from core.feather.coat.carry import carried_meshes

        quick = carried_meshes(picture.quick, picture.rows, mesh, picture.roots, picture.skin, skin)
        made = picture._replace(fine=quick, quick=quick)
        self._carried[coat_id] = picture, skin, made
        return made

    def _asked(
        self, document: Document, posed: Callable[[MeshObject], Posed], meshes: Iterable[MeshObject], frame: float
    ) -> Iterable[Asked]:
        ids = {item.id for item in meshes}
        for coat in document.feathers:
            if coat.hidden or coat.mesh_id not in ids:
                continue
            from core.feather.coat.plumage import moving  # with the kernels of coats, which a window starts without

            item = find_mesh(document, coat.mesh_id)
            by_itself = frame if coat.proxies or moving(coat) else None
            yield Asked(coat, keys_of(document, coat), item, posed(item).points, by_itself)

    def _lay(self, asked: Asked, document: Document, frame: float) -> FeatherPicture:
        from core.feather.coat.picture import coat_meshes, rows_of_meshes

        coat, mesh = asked.coat, asked.item.mesh
        still = asked.points is mesh.points
        skin = skin_at_rest(mesh, self._evaluator) if still else skin_posed(mesh, asked.points, self._evaluator)
        laid = self._plumages.lay(coat, asked.keys, mesh, skin, frame, float(document.first_frame)).laid
        rows = tuple(rows for _, rows in rows_of_meshes(laid, coat))
        return FeatherPicture(
            coat_meshes(laid, coat, FINE), coat_meshes(laid, coat, QUICK), rows, laid.bed.roots,
            Posed(asked.points, skin.normals))


def _same_faces(one: Mesh, other: Mesh) -> bool:
    return one is other or (one.corners is other.corners and one.counts is other.counts)
