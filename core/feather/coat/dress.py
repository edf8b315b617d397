"""From a bare bird to a coat: keys laid along the body, and the feathers that follow them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from core.errors import UserError
from core.evaluator import Evaluator
from core.feather.coat.coat import FeatherCoat, Placement
from core.feather.presets import load_bird
from core.groom.dress import skin_flow
from core.groom.groom import Coat, Groom
from core.groom.guides import Guides
from core.mesh.mesh import Mesh
from core.mesh.normals import face_areas
from core.mesh.scatter import scatter
from core.mesh.skin import skin_at_rest
from core.mesh.surface import place_roots, root_positions
from core.record import freeze

KEYS, POINTS = 120, 8
LIFT = 0.28  # radians, of a key off the skin


class Dressed(NamedTuple):
    """A first coat: the feathers, and the groom of their keys."""

    coat: FeatherCoat
    keys: Groom


def dress_feathers(
    mesh: Mesh, evaluator: Evaluator, count: int, preset: str = "goldfinch", placement: str = "rows",
    keys: int = KEYS, seed: int = 0, overlap: float = 3.7, mesh_id: int = 1, name: str = "feathers",
) -> Dressed:
    """A coat of exactly `count` feathers on a bare mesh, its keys laid along the flow of the body.

    overlap : how many rows a feather covers, which with the count says how long the keys are.

    Raises
    ------
    UserError
        The mesh has no surface to grow on.
    """
    load_bird(preset)  # one that does not exist is said before any work
    skin = skin_at_rest(mesh, evaluator)
    area = float(face_areas(skin.points, skin.triangles.vertices).sum())
    if not area > 0.0:
        raise UserError("the mesh has no surface to grow feathers on")
    flow = skin_flow(skin)
    where = scatter(skin.points, skin.triangles.vertices, keys, seed=seed + 1, workers=evaluator.workers)
    roots = place_roots(mesh, skin.triangles, where.triangle, where.barycentric, skin.normals)
    corners = skin.triangles.vertices[where.triangle]
    along = np.einsum("nk,nkc->nc", where.barycentric, flow.directions[corners]).astype(np.float64)
    normals = roots.frames[:, 2].astype(np.float64)
    along -= normals * np.einsum("nc,nc->n", along, normals)[:, None]
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    length = overlap * np.sqrt(area / max(count, 1))
    heading = np.cos(LIFT) * along + np.sin(LIFT) * normals
    steps = np.linspace(0.0, min(length, 0.3 * skin.diagonal), POINTS)
    points = root_positions(mesh, roots)[:, None].astype(np.float64) + steps[None, :, None] * heading[:, None]
    shafts = points.astype(np.float32)
    shafts[:, 0] = root_positions(mesh, roots)
    ids = np.arange(keys, dtype=np.int32)
    guides = Guides(
        ids=ids, roots=roots, points=freeze(shafts), hold=freeze(np.zeros((keys, POINTS), np.float32)),
        selected=freeze(np.zeros(keys, np.bool_)), frozen=freeze(np.zeros(keys, np.bool_)), next_id=keys,
    )
    groom = Groom(id=1, name=f"{name} keys", mesh_id=mesh_id, guides=guides, coat=Coat(count=0))
    coat = FeatherCoat(
        id=1, name=name, mesh_id=mesh_id, keys_id=1, preset=preset, overlap=overlap,
        placements=(Placement(kind=placement, count=count, seed=seed),),
    )
    return Dressed(coat, groom)
