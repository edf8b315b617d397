"""Edits of the document itself: meshes, grooms, maps and coats. Pure functions for ``Session.edit`` and for scripts.

``session.edit("Rename", rename_mesh, 1, "cow")`` is one named step; what is slow (reading a file, dressing a mesh) is
split off, so that a job can do it beside the window.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.document import (
    Document,
    MeshObject,
    find_feathers,
    find_groom,
    find_mesh,
    free_id,
    with_groom,
    with_mesh,
    without_groom,
    without_mesh,
)
from core.errors import UserError
from core.evaluator import Evaluator
from core.formats.mesh_file import MeshFile, read_mesh
from core.formats.picture import read_picture
from core.groom.dress import Stage, dress, no_stages
from core.groom.groom import COAT_VALUES, LONGEST, Coat, Groom, Map
from core.groom.guides import Guides
from core.groom.maps import sample_vertex_map
from core.groom.rows import no_guides
from core.groom.style import load_style
from core.mesh.bvh import build_bvh, closest_points
from core.mesh.mesh import Mesh
from core.mesh.rebind import RebindMethod, rebind_roots
from core.mesh.surface import root_positions
from core.mesh.triangulate import triangulate
from core.record import freeze
from core.value import names_used

GUIDES, HAIRS = 2500, 100_000  # of a first coat
FIRST_REACH = 0.05  # of a groom planted by hand, in sizes of the animal


# meshes


def import_mesh(document: Document, path: str | os.PathLike[str], unit: str | None = None, up: str | None = None
                ) -> Document:
    """The document with the mesh of a file at its end, named after it (see :func:`core.formats.mesh_file.read_mesh`).

    In a window read the file in a job and give :func:`add_mesh_file` what it found.
    """
    found = read_mesh(Path(path), unit=unit, up=up)
    return add_mesh_file(document, found, os.path.abspath(path))


def add_mesh(document: Document, mesh: Mesh, name: str) -> Document:
    """The document with another mesh at its end, under a name of its own."""
    named = _free_name(name, [item.name for item in document.meshes])
    return with_mesh(document, MeshObject(id=free_id(document.meshes), name=named, mesh=mesh))


def add_mesh_file(document: Document, found: MeshFile, source: str) -> Document:
    """The document with the mesh of a file at its end, which is remembered as its source."""
    added = add_mesh(document, found.mesh, found.name)
    return set_mesh_source(added, added.meshes[-1].id, source, *space_given(found))


def space_given(found: MeshFile) -> tuple[float, str]:
    """Metres per unit and up axis that were given when the file was read; 0 and "" where nobody gave them."""
    return (
        found.metres_per_unit if found.unit_source == "given" else 0.0, found.up if found.up_source == "given" else "")


def remove_mesh(document: Document, mesh_id: int) -> Document:
    """The document without a mesh and the grooms that grow on it."""
    find_mesh(document, mesh_id)
    return without_mesh(document, mesh_id)


def rename_mesh(document: Document, mesh_id: int, name: str) -> Document:
    """The document with another name for a mesh."""
    return with_mesh(document, _named(find_mesh(document, mesh_id), name))


def set_mesh_hidden(document: Document, mesh_id: int, hidden: bool) -> Document:
    """The document with a mesh and its grooms hidden or shown."""
    item = find_mesh(document, mesh_id)
    return document if item.hidden == hidden else with_mesh(document, item.replace(hidden=hidden))


def set_mesh_locked(document: Document, mesh_id: int, locked: bool) -> Document:
    """The document with a mesh and its grooms locked against every tool, or free."""
    item = find_mesh(document, mesh_id)
    return document if item.locked == locked else with_mesh(document, item.replace(locked=locked))


def move_mesh(document: Document, mesh_id: int, place: int) -> Document:
    """The document with a mesh at another place of the list, counted from 0."""
    item = find_mesh(document, mesh_id)
    return document.replace(meshes=_moved(document.meshes, item, place))


class Replaced(NamedTuple):
    """A document with an updated mesh.

    doubtful : by groom, the ids (N,) of guides whose place was only guessed: look at these.
    """

    document: Document
    doubtful: dict[int, NDArray[np.int32]]

    def with_selection(self) -> Document:
        """The document with just the doubtful guides selected, in every groom that has some."""
        document = self.document
        for groom_id, ids in self.doubtful.items():
            if len(ids):
                groom = find_groom(document, groom_id)
                guides = groom.guides.replace(selected=freeze(np.isin(groom.guides.ids, ids)))
                document = with_groom(document, groom.replace(guides=guides))
        return document


def replaced_mesh(document: Document, mesh_id: int, mesh: Mesh) -> Replaced:
    """A document with another mesh in place of one, its grooms carried over: roots, strands and painted maps.

    A rig is kept when it fits the vertices, and is gone otherwise.

    Raises
    ------
    UserError
        Hair cannot be bound to it (it has no faces).
    """
    item = find_mesh(document, mesh_id)
    old = item.mesh
    rig = item.rig if len(mesh.points) == len(old.points) else None
    grooms, doubtful = [], {}
    for groom in document.grooms:
        if groom.mesh_id != mesh_id:
            grooms.append(groom)
            continue
        guides, method = _rebound(groom.guides, old, mesh)
        doubtful[groom.id] = groom.guides.ids[method == RebindMethod.CLOSEST_ANY]
        maps = tuple(_carried(one, old, mesh) for one in groom.maps)
        grooms.append(groom.replace(guides=guides, maps=maps))
    mask = item.mask if len(mesh.points) == len(old.points) else None
    meshes = tuple(item.replace(mesh=mesh, rig=rig, mask=mask) if m is item else m for m in document.meshes)
    return Replaced(document.replace(meshes=meshes, grooms=tuple(grooms)), doubtful)


def replace_mesh(document: Document, mesh_id: int, mesh: Mesh) -> Document:
    """The document of :func:`replaced_mesh`."""
    return replaced_mesh(document, mesh_id, mesh).document


def reload_mesh(
    document: Document, mesh_id: int, path: str | os.PathLike[str] | None = None, unit: str | None = None,
    up: str | None = None,
) -> Document:
    """The document with an updated file read in place of a mesh, the hair kept. In a window read the file in a job.

    path : of the file, which the mesh remembers from now on; None for the one it was read from.
    unit, up : of a file that does not say them; None for those the mesh was read with.
    """
    item = find_mesh(document, mesh_id)
    source = item.source if path is None else os.path.abspath(path)
    if not source:
        raise UserError("It is not known which file this mesh was read from; name the file.")
    found = read_mesh_again(item, Path(source), unit, up)
    return set_mesh_source(replace_mesh(document, mesh_id, found.mesh), mesh_id, source, *space_given(found))


def with_mesh_as_read(document: Document, mesh_id: int, found: MeshFile) -> Document:
    """The document with the file of a mesh as it was read in another unit or with another axis up.

    Hair comes along; a groom that has its first reach yet gets that of the new size.
    """
    before, now = first_reach(find_mesh(document, mesh_id).mesh), first_reach(found.mesh)
    document = replace_mesh(document, mesh_id, found.mesh)
    item = find_mesh(document, mesh_id)
    for groom in document.grooms:
        if groom.mesh_id == mesh_id and groom.coat.reach == before:
            document = with_groom(document, groom.replace(coat=groom.coat.replace(reach=now)))
    return set_mesh_source(document, mesh_id, item.source, *space_given(found))


def read_mesh_again(
    item: MeshObject, path: Path, unit: str | None = None, up: str | None = None,
    cancel: Callable[[], bool] | None = None,
) -> MeshFile:
    """Read a file to be put in place of a mesh, in the unit and with the up axis that were given for it."""
    return read_mesh(path, unit=unit or item.source_unit or None, up=up or item.source_up or None, cancel=cancel)


def set_mesh_source(
    document: Document, mesh_id: int, source: str, source_unit: float = 0.0, source_up: str = ""
) -> Document:
    """The document with another file remembered as the one a mesh is read from, and the space it was said to be in."""
    item = find_mesh(document, mesh_id)
    if (item.source, item.source_unit, item.source_up) == (source, source_unit, source_up):
        return document
    return with_mesh(document, item.replace(source=source, source_unit=source_unit, source_up=source_up))


# grooms


def dressed(
    document: Document, mesh_id: int, style: str, evaluator: Evaluator, guides: int = GUIDES, hairs: int = HAIRS,
    stage: Stage = no_stages,
) -> Groom:
    """A first groom for a mesh in one of the styles (``core.groom.style.style_names()``); slow: made for a job."""
    item = find_mesh(document, mesh_id)
    groom: Groom = dress(
        item.mesh, load_style(style), evaluator, guides, hairs, mesh_id=mesh_id, name=style, stage=stage)
    return groom


def add_groom(document: Document, groom: Groom) -> Document:
    """The document with a groom at its end, under an id and a name of its own."""
    find_mesh(document, groom.mesh_id)
    named = _free_name(groom.name, [one.name for one in document.grooms])
    return with_groom(document, groom.replace(id=free_id(document.grooms), name=named))


def add_styled_groom(
    document: Document, mesh_id: int, style: str, guides: int = GUIDES, hairs: int = HAIRS,
    evaluator: Evaluator | None = None,
) -> Document:
    """The document with a first groom on a mesh, in one call for scripts."""
    own = Evaluator() if evaluator is None else evaluator
    try:
        return add_groom(document, dressed(document, mesh_id, style, own, guides, hairs))
    finally:
        if evaluator is None:
            own.close()


def add_empty_groom(document: Document, mesh_id: int, name: str = "groom", points: int = 16) -> Document:
    """The document with a groom without guides on a mesh, to be planted by hand; its guides will have `points`.

    Its hair grows around the guides only, up to a twentieth of the size of the animal.
    """
    coat = Coat(reach=first_reach(find_mesh(document, mesh_id).mesh))
    return add_groom(document, Groom(id=0, name=_name(name), mesh_id=mesh_id, guides=no_guides(points), coat=coat))


def first_reach(mesh: Mesh) -> float:
    """How far the hair of a groom planted by hand grows around its guides at first, metres."""
    size = float(np.linalg.norm(np.ptp(mesh.points, axis=0))) if len(mesh.points) else 0.0
    return min(float(f"{FIRST_REACH * size:.2g}"), LONGEST)


def remove_feathers_with_keys(document: Document, coat_id: int) -> Document:
    """The document without a coat of feathers and the groom of its keys."""
    coat = find_feathers(document, coat_id)
    without = document.replace(feathers=tuple(c for c in document.feathers if c.id != coat_id))
    return without if coat.keys_id is None else without_groom(without, coat.keys_id)


def remove_groom(document: Document, groom_id: int) -> Document:
    """The document without a groom."""
    find_groom(document, groom_id)
    return without_groom(document, groom_id)


def rename_groom(document: Document, groom_id: int, name: str) -> Document:
    """The document with another name for a groom."""
    return with_groom(document, _named(find_groom(document, groom_id), name))


def move_groom(document: Document, groom_id: int, place: int) -> Document:
    """The document with a groom at another place of the list, counted from 0."""
    item = find_groom(document, groom_id)
    return document.replace(grooms=_moved(document.grooms, item, place))


def set_groom_hidden(document: Document, groom_id: int, hidden: bool) -> Document:
    """The document with a groom hidden (from views, pictures and exports) or shown."""
    item = find_groom(document, groom_id)
    return document if item.hidden == hidden else with_groom(document, item.replace(hidden=hidden))


def set_groom_locked(document: Document, groom_id: int, locked: bool) -> Document:
    """The document with a groom locked against every tool and action, or free."""
    item = find_groom(document, groom_id)
    return document if item.locked == locked else with_groom(document, item.replace(locked=locked))


def set_coat(document: Document, groom_id: int, **changes: Any) -> Document:
    """The document with fields of a groom's coat changed.

    Raises
    ------
    UserError
        A value is out of its range, or names a map the groom does not have (the sentence names the field).
    """
    groom = find_groom(document, groom_id)
    return with_groom(document, _checked(lambda: groom.replace(coat=groom.coat.replace(**changes))))


def set_document(document: Document, **changes: Any) -> Document:
    """The document with another unit, rate or range of frames; UserError when one is out of its range."""
    known = ("unit", "fps", "first_frame", "last_frame")
    if not set(changes) <= set(known):
        raise UserError(f"Only {', '.join(known)} of a document are set by name.")
    changed: Document = _checked(lambda: document.replace(**changes))
    return changed


# maps


def add_map_from_image(document: Document, groom_id: int, path: str | os.PathLike[str], name: str | None = None
                       ) -> Document:
    """The document with a map of a groom read from a picture; one of the same name is replaced.

    In a window read the picture in a job and give :func:`set_map` what :func:`map_from_image` makes.
    """
    return set_map(document, groom_id, map_from_image(path, name))


def map_from_image(path: str | os.PathLike[str], name: str | None = None) -> Map:
    """A map from a picture, named after the file; colours are averaged, alpha is left out."""
    pixels = read_picture(Path(path))
    grey = pixels if pixels.ndim == 2 else pixels[..., :3].mean(axis=2, dtype=np.float32)
    made: Map = _checked(lambda: Map(name=_name(name or Path(path).stem), image=freeze(grey)))
    return made


def add_flat_map(document: Document, groom_id: int, name: str, value: float = 1.0) -> Document:
    """The document with a new map of a groom, one number per vertex, all the same: what painting begins with."""
    groom = find_groom(document, groom_id)
    count = len(find_mesh(document, groom.mesh_id).mesh.points)
    named = _free_name(_name(name), [one.name for one in groom.maps])
    return set_map(document, groom_id, Map(name=named, values=freeze(np.full(count, value, np.float32))))


def set_map(document: Document, groom_id: int, item: Map) -> Document:
    """The document with a map of a groom put in place of the one of the same name, or added at the end.

    Raises
    ------
    UserError
        It has not one value for each vertex of the mesh.
    """
    groom = find_groom(document, groom_id)
    vertices = len(find_mesh(document, groom.mesh_id).mesh.points)
    if item.values is not None and len(item.values) != vertices:
        raise UserError(f"The map {item.name} has {len(item.values)} values for {vertices} vertices; read it anew.")
    have = [one.name for one in groom.maps]
    maps = tuple(item if one.name == item.name else one for one in groom.maps)
    return with_groom(document, groom.replace(maps=maps if item.name in have else (*maps, item)))


def remove_map(document: Document, groom_id: int, name: str) -> Document:
    """The document without a map of a groom; where the coat took its density or length from it, it does no more.

    Raises
    ------
    UserError
        There is no such map, or another value of the coat still reads it.
    """
    groom = find_groom(document, groom_id)
    if groom.map(name) is None:
        raise UserError(f"The groom {groom.name} has no map named {name!r}.")
    coat = groom.coat
    readers = [field for field in COAT_VALUES if name in names_used(getattr(coat, field))]
    if readers:
        words = ", ".join(field.replace("_", " ") for field in readers)
        raise UserError(f"The map {name} is still read by {words} of the coat; change that first.")
    unused = {field: None for field in ("density_map", "length_map") if getattr(coat, field) == name}
    kept = tuple(one for one in groom.maps if one.name != name)
    return with_groom(document, groom.replace(coat=coat.replace(**unused), maps=kept))


# what these share


def _name(name: str) -> str:
    named = "".join(c for c in name.strip() if c.isprintable())[:255]
    if not named:
        raise UserError("A name needs at least one letter.")
    return named


def _named(item: Any, name: str) -> Any:
    named = _name(name)
    return item if item.name == named else item.replace(name=named)


def _free_name(name: str, taken: list[str]) -> str:
    """The name, with a number after it where it is taken."""
    base, number, named = _name(name), 2, _name(name)
    while named in taken:
        named, number = f"{base[:240]} {number}", number + 1
    return named


def _moved(items: tuple[Any, ...], item: Any, place: int) -> tuple[Any, ...]:
    others = [one for one in items if one is not item]
    others.insert(min(max(place, 0), len(others)), item)
    return items if all(a is b for a, b in zip(items, others, strict=True)) else tuple(others)


def _checked(make: Callable[[], Any]) -> Any:
    """What `make` gives; what a record refuses is said to the person."""
    try:
        return make()
    except (ValueError, TypeError) as error:
        raise UserError(f"This cannot be set: {error}.") from error


def _rebound(guides: Guides, old: Mesh, new: Mesh) -> tuple[Guides, NDArray[np.uint8]]:
    """Guides on another mesh, each turned with the skin at its root; how each root was found (`RebindMethod`)."""
    if len(guides) == 0:
        return guides, np.zeros(0, np.uint8)
    roots, method, _ = rebind_roots(guides.roots, old, new)
    places = root_positions(new, roots)
    local = np.einsum(
        "nab,npb->npa", guides.roots.frames.astype(np.float64),
        guides.points.astype(np.float64) - guides.points[:, :1],
    )
    points = np.einsum("nab,npa->npb", roots.frames.astype(np.float64), local) + places[:, None].astype(np.float64)
    moved = points.astype(np.float32)
    moved[:, 0] = places
    return guides.replace(roots=roots, points=freeze(moved)), method


def _carried(item: Map, old: Mesh, new: Mesh) -> Map:
    """A painted map on another mesh: the same values for the same topology, else those of the closest old skin."""
    if item.values is None or (np.array_equal(old.counts, new.counts) and np.array_equal(old.corners, new.corners)):
        return item
    triangles = triangulate(old)
    triangle, weights, _ = closest_points(build_bvh(old.points, triangles.vertices), new.points)
    values = sample_vertex_map(item.values, triangles, np.maximum(triangle, 0), weights)
    carried: Map = item.replace(values=freeze(values))
    return carried
