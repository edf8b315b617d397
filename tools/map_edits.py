"""Edits of the maps of a groom that a hand paints."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.document import Document, MeshObject, find_groom, find_mesh, with_groom
from core.errors import UserError
from core.groom.groom import Groom, Map
from core.groom.maps import at_vertices
from core.record import freeze
from tools.document_edits import set_map

DENSITY = "density"  # name of the map that a first stroke makes
ROLES = ("density_map", "length_map")  # fields of the coat that name a map


def painted_name(groom: Groom, name: str | None = None) -> str:
    """The map that is painted when `name` is asked for: with None the one of the density."""
    return name or groom.coat.density_map or DENSITY


def map_to_paint(groom: Groom, item: MeshObject, name: str | None = None) -> NDArray[np.float32]:
    """The values (V,) float32 of a map to paint on; 1 everywhere when the one of the density is still to be made.

    Raises
    ------
    UserError
        There is no such map, or it is an image.
    """
    wanted = painted_name(groom, name)
    found = groom.map(wanted)
    if found is None:
        if name is not None:
            raise UserError(f"There is no map named {name!r} to paint; choose another in the maps panel.")
        return freeze(np.ones(len(item.mesh.points), np.float32))
    if found.values is None:
        raise UserError(f"The map {wanted} is an image; press Paint in the maps panel for a copy that can be painted.")
    values: NDArray[np.float32] = found.values
    return values


def paint_map(
    document: Document, groom_id: int, values: NDArray[np.float32], name: str | None = None
) -> Document:
    """The document with a painted map of a groom, values (V,) float32; a first density map is given to the coat.

    What changed nothing gives the document itself. Errors as of :func:`map_to_paint` and ``set_map``.
    """
    groom = find_groom(document, groom_id)
    before = map_to_paint(groom, find_mesh(document, groom.mesh_id), name)
    if values is before or np.array_equal(values, before):
        return document
    wanted = painted_name(groom, name)
    done = set_map(document, groom_id, Map(name=wanted, values=freeze(values)))
    if name is None and groom.coat.density_map is None:
        groom = find_groom(done, groom_id)
        done = with_groom(done, groom.replace(coat=groom.coat.replace(density_map=wanted)))
    return done


def paintable_copy(document: Document, groom_id: int, name: str, copy: str) -> Document:
    """The document with a map per vertex, named `copy`, made of an image map; it takes over what that one drives.

    Raises
    ------
    UserError
        There is no such map, or the mesh has no UVs to read it by.
    """
    groom = find_groom(document, groom_id)
    found = groom.map(name)
    if found is None:
        raise UserError(f"The groom {groom.name} has no map named {name!r}.")
    mesh = find_mesh(document, groom.mesh_id).mesh
    done = set_map(document, groom_id, Map(name=copy, values=freeze(np.array(at_vertices(found, mesh)))))
    groom = find_groom(done, groom_id)
    roles = {role: copy for role in ROLES if getattr(groom.coat, role) == name}
    return with_groom(done, groom.replace(coat=groom.coat.replace(**roles))) if roles else done
