"""The document: everything the artist makes, one frozen value."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np

from core.errors import UserError
from core.feather.coat.coat import FeatherCoat
from core.field import field
from core.groom.groom import Groom
from core.image.plate import Plate
from core.match.outline import Mask
from core.match.photomodel.records import Photomodel
from core.match.solved import SolvedCamera
from core.match.track import PlaneTrack, Track
from core.mesh.mesh import Mesh
from core.pose.pose import Pose
from core.pose.pose_space import Correctives
from core.pose.rig import Rig
from core.record import Record, column, number, text
from core.units import METRES_PER_UNIT

RATES = (0.001, 100_000.0)  # frames per second
FRAMES = (-(2**31), 2**31 - 1)


class MeshObject(Record):
    """A mesh in the document.

    id : stable, unique in the document.
    source : path of the file it was read from, to read it again when it was updated; "" for none.
    source_unit, source_up : metres per unit and up axis it was read with when a hand gave them; 0 and "" otherwise.
    rig : what moves it, or None for a mesh at rest.
    correctives : what was sculpted at poses of the rig, or None.
    pose : the pose held in the view, None for the clip at the frame. library : poses kept for later, by name.
    joint_selection : names of the joints that are selected, the active one last.
    locked_joints : names of joints whose skin weights no brush changes.
    mask : (V,) float32, how much sculpting spares each vertex, 0 free .. 1 protected; None for nothing.
    surface : (V, 3) float32, what is shown while a stroke shapes the held pose; None otherwise, in files always.
    """

    id: int
    name: str
    mesh: Mesh
    source: str = ""
    source_unit: float = 0.0
    source_up: str = ""
    rig: Rig | None = None
    correctives: Correctives | None = None
    pose: Pose | None = None
    library: tuple[Pose, ...] = ()
    joint_selection: tuple[str, ...] = ()
    locked_joints: tuple[str, ...] = ()
    mask: np.ndarray | None = None
    surface: np.ndarray | None = None
    hidden: Annotated[bool, field(
        "Hidden", "Leaves the mesh and its hair out of the view; they stay in the document and its files.",
    )] = False
    locked: Annotated[bool, field(
        "Locked", "Keeps every tool off the mesh and its grooms until it is unlocked again.",
    )] = False

    def __post_init__(self) -> None:
        text(self, "name")
        if self.source:
            text(self, "source", longest=4096)
        number(self, "source_unit", least=0.0, most=1e9)
        if self.source_up not in ("", "y", "z"):
            raise ValueError("MeshObject.source_up must be y, z or nothing")
        number(self, "id", least=0, most=2**31 - 1)
        if self.rig is not None and len(self.rig.skin.joints) != len(self.mesh.points):
            raise ValueError(f"MeshObject.rig moves {len(self.rig.skin.joints)} vertices of {len(self.mesh.points)}")
        if self.correctives is not None and self.correctives.vertex_count > len(self.mesh.points):
            raise ValueError("MeshObject.correctives correct a vertex that the mesh does not have")
        vertices = len(self.mesh.points)
        if self.mask is not None:
            column(self, "mask", np.float32, (vertices,))
        if self.surface is not None:
            column(self, "surface", np.float32, (vertices, 3))
        if len({pose.name for pose in self.library}) != len(self.library):
            raise ValueError("MeshObject.library holds two poses of the same name")


class Document(Record):
    """Everything undo brings back.

    meshes, grooms, feathers, plates, tracks, planes, masks : each with ids unique among their kind; the last three
        are of a plate. The keys of feathers are the guides of a groom.
    track_selection : ids of the selected tracks, the active one last; ids of deleted ones mean nothing.
    photomodels : models from photographs, each with an id of its own. solves : cameras of plates, one of each at most.
    """

    unit: Annotated[str, field(
        "Unit", "The unit panels show and read lengths in; the document itself keeps metres.",
        choices=tuple(METRES_PER_UNIT),
    )] = "m"
    fps: Annotated[float, field(
        "Frames per second", "How many frames play in one second; set it to that of the plate or the shot.",
        soft=(12.0, 60.0), hard=RATES, step=1.0,
    )] = 24.0
    first_frame: Annotated[int, field(
        "First frame", "Where the timeline begins; shots may start at any frame, often at 1001.",
        "frames", soft=(0, 2000), hard=FRAMES, step=1,
    )] = 1001
    last_frame: Annotated[int, field(
        "Last frame", "Where the timeline ends, this frame included; never before the first frame.",
        "frames", soft=(0, 2000), hard=FRAMES, step=1,
    )] = 1100
    meshes: tuple[MeshObject, ...] = ()
    grooms: tuple[Groom, ...] = ()
    feathers: tuple[FeatherCoat, ...] = ()
    plates: tuple[Plate, ...] = ()
    tracks: tuple[Track, ...] = ()
    planes: tuple[PlaneTrack, ...] = ()
    masks: tuple[Mask, ...] = ()
    track_selection: tuple[int, ...] = ()
    photomodels: tuple[Photomodel, ...] = ()
    solves: tuple[SolvedCamera, ...] = ()

    def __post_init__(self) -> None:
        if self.unit not in METRES_PER_UNIT:
            raise ValueError(f"Document.unit must be one of {', '.join(METRES_PER_UNIT)}, not {self.unit!r}")
        number(self, "fps", least=RATES[0], most=RATES[1])
        number(self, "first_frame", "last_frame", least=FRAMES[0], most=FRAMES[1])
        if self.first_frame > self.last_frame:
            raise ValueError("Document.first_frame comes after last_frame")
        mesh_ids = {m.id for m in self.meshes}
        if len(mesh_ids) != len(self.meshes) or len({g.id for g in self.grooms}) != len(self.grooms):
            raise ValueError("Document holds two things of the same id")
        plate_ids = {plate.id for plate in self.plates}
        if len(plate_ids) != len(self.plates):
            raise ValueError("Document holds two plates of the same id")
        for kind in ("tracks", "planes", "masks"):
            items = getattr(self, kind)
            if len({item.id for item in items}) != len(items):
                raise ValueError(f"Document.{kind} holds two of the same id")
            for item in items:
                if item.plate_id not in plate_ids:
                    raise ValueError(f"Document.{kind}: the plate {item.plate_id} of {item.name!r} does not exist")
        if len({solve.plate_id for solve in self.solves}) != len(self.solves):
            raise ValueError("Document.solves holds two cameras of the same plate")
        if not {solve.plate_id for solve in self.solves} <= plate_ids:
            raise ValueError("Document.solves holds a camera of a plate that does not exist")
        if len({model.id for model in self.photomodels}) != len(self.photomodels):
            raise ValueError("Document.photomodels holds two of the same id")
        for model in self.photomodels:
            for photo in model.photos:
                if photo.plate_id and photo.plate_id not in plate_ids:
                    raise ValueError(f"Document.photomodels: there is no plate {photo.plate_id} of {photo.name!r}")
        for groom in self.grooms:
            if groom.mesh_id not in mesh_ids:
                raise ValueError(f"Document.grooms: the mesh {groom.mesh_id} of groom {groom.name!r} does not exist")
        if len({coat.id for coat in self.feathers}) != len(self.feathers):
            raise ValueError("Document.feathers holds two coats of the same id")
        mesh_of = {groom.id: groom.mesh_id for groom in self.grooms}
        for coat in self.feathers:
            if coat.mesh_id not in mesh_ids:
                raise ValueError(f"Document.feathers: the mesh {coat.mesh_id} of {coat.name!r} does not exist")
            if coat.keys_id is not None and mesh_of.get(coat.keys_id) != coat.mesh_id:
                raise ValueError(f"Document.feathers: the keys of {coat.name!r} are no groom of its mesh")


def find_mesh(document: Document, mesh_id: int) -> MeshObject:
    """The mesh of that id; UserError when there is none."""
    for item in document.meshes:
        if item.id == mesh_id:
            return item
    raise UserError(f"There is no mesh {mesh_id} in this document; choose one of {[m.id for m in document.meshes]}.")


def find_groom(document: Document, groom_id: int) -> Groom:
    """The groom of that id; UserError when there is none."""
    for item in document.grooms:
        if item.id == groom_id:
            return item
    raise UserError(f"There is no groom {groom_id} in this document; choose one of {[g.id for g in document.grooms]}.")


def find_feathers(document: Document, coat_id: int) -> FeatherCoat:
    """The coat of feathers of that id; UserError when there is none."""
    for item in document.feathers:
        if item.id == coat_id:
            return item
    known = [coat.id for coat in document.feathers]
    raise UserError(f"There are no feathers {coat_id} in this document; choose one of {known}.")


def keys_of(document: Document, coat: FeatherCoat) -> Groom | None:
    """The groom whose guides are the keys of a coat of feathers, or None."""
    return None if coat.keys_id is None else find_groom(document, coat.keys_id)


def mesh_to_edit(document: Document, groom: Groom) -> MeshObject:
    """The mesh of a groom that tools may work on; UserError when a lock or an eye keeps them off."""
    item = find_mesh(document, groom.mesh_id)
    if item.locked:
        raise UserError(f"{item.name} is locked; unlock it in the scene panel to edit its hair.")
    if groom.locked:
        raise UserError(f"{groom.name} is locked; unlock it in the scene panel to edit its hair.")
    if groom.hidden:
        raise UserError(f"{groom.name} is hidden; show it in the scene panel to edit its hair.")
    return item


def visible_grooms(document: Document) -> tuple[Groom, ...]:
    """The grooms that are not hidden: those in views, pictures and exports. (Their meshes may be hidden.)"""
    return tuple(groom for groom in document.grooms if not groom.hidden)


def with_mesh(document: Document, item: MeshObject) -> Document:
    """The document with `item` in place of the mesh of the same id, or added at the end."""
    return document.replace(meshes=_put(document.meshes, item))


def with_groom(document: Document, groom: Groom) -> Document:
    """The document with `groom` in place of the groom of the same id, or added at the end."""
    return document.replace(grooms=_put(document.grooms, groom))


def feathers_of(document: Document, groom: Groom | None) -> FeatherCoat | None:
    """The coat of feathers whose keys a groom holds, or None."""
    return None if groom is None else next((c for c in document.feathers if c.keys_id == groom.id), None)


def with_feathers(document: Document, coat: FeatherCoat) -> Document:
    """The document with `coat` in place of the feathers of the same id, or added at the end."""
    return document.replace(feathers=_put(document.feathers, coat))


def without_groom(document: Document, groom_id: int) -> Document:
    """The document without that groom; feathers whose keys it held have none any more."""
    return document.replace(
        grooms=tuple(g for g in document.grooms if g.id != groom_id),
        feathers=tuple(c.replace(keys_id=None) if c.keys_id == groom_id else c for c in document.feathers),
    )


def without_mesh(document: Document, mesh_id: int) -> Document:
    """The document without that mesh and without the grooms and feathers that grow on it."""
    return document.replace(
        meshes=tuple(m for m in document.meshes if m.id != mesh_id),
        grooms=tuple(g for g in document.grooms if g.mesh_id != mesh_id),
        feathers=tuple(c for c in document.feathers if c.mesh_id != mesh_id),
    )


def _put(items: tuple[Any, ...], item: Any) -> tuple[Any, ...]:
    if any(have.id == item.id for have in items):
        return tuple(item if have.id == item.id else have for have in items)
    return (*items, item)


def free_id(items: tuple[Any, ...]) -> int:
    """An id none of `items` has (one above the highest; 1 for the first)."""
    return max((item.id for item in items), default=0) + 1


def problems(document: Document) -> list[str]:
    """What the records cannot see by themselves: references from one to another, one sentence each.

    Kernels trust these (they run without bounds checks), so a file is only opened when the list is empty.
    """
    found: list[str] = []
    rooted = [(f"Groom {groom.name!r}", groom.mesh_id, groom.guides.roots) for groom in document.grooms]
    rooted += [
        (f"The coat {coat.name!r}", coat.mesh_id, placement.hand)
        for coat in document.feathers for placement in coat.placements if placement.hand is not None
    ]
    for owner, mesh_id, roots in rooted:
        mesh = find_mesh(document, mesh_id).mesh
        if len(roots.faces):
            if roots.faces.min() < 0 or roots.faces.max() >= len(mesh.counts):
                found.append(f"{owner} has a root on a face that its mesh does not have.")
            elif roots.corners.min() < 0 or np.any(roots.corners >= mesh.counts[roots.faces][:, None]):
                found.append(f"{owner} has a root on a corner that its face does not have.")
    for coat in document.feathers:
        vertices = len(find_mesh(document, coat.mesh_id).mesh.points)
        if any(anchor.vertices.max() >= vertices for wing in coat.wings for anchor in wing.anchors):
            found.append(f"A wing of the coat {coat.name!r} stands on a vertex that its mesh does not have.")
    for groom in document.grooms:
        mesh = find_mesh(document, groom.mesh_id).mesh
        for item in groom.maps:
            if item.values is not None and len(item.values) != len(mesh.points):
                found.append(
                    f"Map {item.name!r} of groom {groom.name!r} has {len(item.values)} values "
                    f"for {len(mesh.points)} vertices."
                )
    return found
