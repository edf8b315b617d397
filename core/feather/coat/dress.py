"""From a bare bird to a coat: keys laid along the body, and the feathers that follow them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.evaluator import Evaluator
from core.falloff import smoothstep
from core.feather.coat.bare import feathered_map
from core.feather.coat.coat import FeatherCoat, Placement
from core.feather.coat.wing_dress import dress_wings, find_wings
from core.feather.coat.wing_keys import clear_of, keys_beside
from core.feather.presets import load_bird
from core.groom.dress import skin_flow
from core.groom.flow import Flow
from core.groom.groom import Coat, Groom
from core.groom.guides import Guides
from core.mesh.mesh import Mesh
from core.mesh.normals import face_areas
from core.mesh.scatter import scatter
from core.mesh.skin import skin_at_rest
from core.mesh.surface import place_roots, root_positions
from core.pose.rig import Rig
from core.record import freeze

KEYS, POINTS = 120, 8
FACE, SMALL = (0.1, 0.3), 0.68  # shares of the way over the body from the nose; of the length at the nose
OVERLAP, WINGED_OVERLAP = 3.7, 5.5  # rows that a feather covers; more where a bird is to be seen from near
LIFT = 0.28  # radians, of a key off the skin


class Dressed(NamedTuple):
    """A first coat: the feathers, and the groom of their keys."""

    coat: FeatherCoat
    keys: Groom


def dress_feathers(
    mesh: Mesh, evaluator: Evaluator, count: int, preset: str = "goldfinch", placement: str = "rows",
    keys: int = KEYS, seed: int = 0, overlap: float | None = None, mesh_id: int = 1, name: str = "feathers",
    rig: Rig | None = None,
) -> Dressed:
    """A coat of exactly `count` feathers on a bare mesh, its keys laid along the flow of the body.

    overlap : how many rows a feather covers, which with the count says how long the keys are.
    rig : what moves the mesh. Where it has wings (``wing_dress``) they get their feathers, beyond the count, the keys
        around them lie as their rows do, and beak, eyes, feet and arms stay bare.

    Raises
    ------
    UserError
        The mesh has no surface to grow on.
    """
    load_bird(preset)  # one that does not exist is said before any work
    skin = skin_at_rest(mesh, evaluator)
    areas = face_areas(skin.points, skin.triangles.vertices)
    if not areas.sum() > 0.0:
        raise UserError("the mesh has no surface to grow feathers on")
    wings = dress_wings(mesh, rig) if rig is not None and find_wings(mesh, rig) else ()
    # the beak lies farthest from where the innermost quills point
    nose = int(np.argmin(skin.points @ np.array(wings[0].inner_direction))) if wings else None
    flow = skin_flow(skin, nose)
    if overlap is None:
        overlap = WINGED_OVERLAP if wings else OVERLAP
    face = _face(flow) if wings else np.zeros(len(skin.points))
    item = feathered_map(mesh, rig, wings) if rig is not None and wings else None
    feathered = np.ones(len(areas))
    if item is not None and item.values is not None:
        feathered = item.values[skin.triangles.vertices].mean(axis=1)
    area = float((areas * feathered).sum())
    where = scatter(
        skin.points, skin.triangles.vertices, keys, seed=seed + 1, workers=evaluator.workers,
        density=None if item is None else lambda triangle, weights: (feathered[triangle] > 0.0).astype(np.float32))
    roots = place_roots(mesh, skin.triangles, where.triangle, where.barycentric, skin.normals)
    corners = skin.triangles.vertices[where.triangle]
    along = np.einsum("nk,nkc->nc", where.barycentric, flow.directions[corners]).astype(np.float64)
    normals = roots.frames[:, 2].astype(np.float64)
    along -= normals * np.einsum("nc,nc->n", along, normals)[:, None]
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    length = min(overlap * np.sqrt(area / max(count, 1)), 0.3 * skin.diagonal)
    smaller = 1.0 - (1.0 - SMALL) * np.einsum("nk,nk->n", where.barycentric, face[corners])
    if wings:
        beside = keys_beside(wings, mesh, skin, evaluator)
        places, taken = root_positions(mesh, roots), root_positions(mesh, beside.roots)
        kept = np.flatnonzero(clear_of(places, taken, beside.lengths))
        roots = roots.take(kept).join(beside.roots)
        along = np.concatenate([along[kept], beside.along])
        smaller = np.concatenate([smaller[kept], beside.lengths / length])
        normals = roots.frames[:, 2].astype(np.float64)
    heading = np.cos(LIFT) * along + np.sin(LIFT) * normals
    steps = np.linspace(0.0, length, POINTS) * smaller[:, None]
    points = root_positions(mesh, roots)[:, None].astype(np.float64) + steps[..., None] * heading[:, None]
    shafts = points.astype(np.float32)
    shafts[:, 0] = root_positions(mesh, roots)
    many = len(roots.faces)
    guides = Guides(
        ids=np.arange(many, dtype=np.int32), roots=roots, points=freeze(shafts),
        hold=freeze(np.zeros((many, POINTS), np.float32)), selected=freeze(np.zeros(many, np.bool_)),
        frozen=freeze(np.zeros(many, np.bool_)), next_id=many,
    )
    groom = Groom(
        id=1, name=f"{name} keys", mesh_id=mesh_id, guides=guides, coat=Coat(count=0),
        maps=() if item is None else (item,))
    coat = FeatherCoat(
        id=1, name=name, mesh_id=mesh_id, keys_id=1, preset=preset, overlap=overlap, wings=wings,
        placements=(Placement(
            kind=placement, count=count, seed=seed, density_map=None if item is None else item.name),),
    )
    return Dressed(coat, groom)


def _face(flow: Flow) -> NDArray[np.float64]:
    """How far a vertex is of the face, (V,): 1 at the nose, 0 beyond a share of the way over the body."""
    there = np.isfinite(flow.distance)
    if flow.nose < 0 or not there.any():
        return np.zeros(len(flow.distance))
    way = np.where(there, flow.distance, np.inf) / max(float(flow.distance[there].max()), 1e-30)
    return 1.0 - smoothstep(*FACE, np.minimum(way, 1.0))
