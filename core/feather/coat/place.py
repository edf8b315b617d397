"""Where feathers stand: every kind of placement, exact in number, with ids that stay.

The row of a place within its placement is its id (feathers set by hand have ids of their own): it is the same whatever
share of the feathers is kept, however many threads there are, and after the coat was read from a file.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.evaluator import Evaluator
from core.feather.coat.coat import IDS, FeatherCoat, Placement, Tract
from core.feather.coat.repulsion import spread
from core.feather.coat.rows import along_rows
from core.groom.binding import triangle_places
from core.groom.dress import skin_flow
from core.groom.groom import Map
from core.groom.maps import at_vertices, sample_map
from core.mesh.mesh import Mesh
from core.mesh.normals import face_areas
from core.mesh.scatter import Scatter, scatter
from core.mesh.skin import Skin, skin_at_rest
from core.random import rand

Density = Callable[[NDArray[np.int32], NDArray[np.float32]], NDArray[np.float32]]
Maps = tuple[Map, ...]


class Places(NamedTuple):
    """Places of N feathers at rest, by placement and rank.

    ids : (N,) int32, stable. triangle : (N,) int32 of the triangulation; barycentric : (N, 3) float32.
    """

    ids: NDArray[np.int32]
    triangle: NDArray[np.int32]
    barycentric: NDArray[np.float32]


def place_feathers(coat: FeatherCoat, mesh: Mesh, maps: Maps, evaluator: Evaluator) -> Places:
    """The places of every placement of a coat, one after another.

    maps : those of the keys' groom, which density and field maps are looked up in.

    Raises
    ------
    UserError
        There is no surface, a map or a tract leaves none, or a map does not exist.
    """
    ids, found = [], []
    for number, placement in enumerate(coat.placements):
        places = _placed(placement, coat, mesh, maps, evaluator)
        own = placement.hand_ids
        ids.append(number * IDS + (np.arange(len(places.triangle)) if own is None else own).astype(np.int64))
        found.append(places)
    if not found:
        return Places(np.zeros(0, np.int32), np.zeros(0, np.int32), np.zeros((0, 3), np.float32))
    return Places(
        np.concatenate(ids).astype(np.int32), np.concatenate([places.triangle for places in found]),
        np.concatenate([places.barycentric for places in found]),
    )


def _placed(placement: Placement, coat: FeatherCoat, mesh: Mesh, maps: Maps, evaluator: Evaluator) -> Scatter:
    skin = skin_at_rest(mesh, evaluator)
    if placement.kind == "hand":
        assert placement.hand is not None  # the record says so
        triangle, weights = triangle_places(mesh, skin.triangles, placement.hand)
        return Scatter(triangle, weights.astype(np.float32))
    if placement.count == 0:
        return Scatter(np.zeros(0, np.int32), np.zeros((0, 3), np.float32))
    if not skin.diagonal > 0.0 or not len(skin.triangles.vertices):
        raise UserError("The mesh has no surface for feathers to stand on.")
    density = _density(placement, coat, mesh, skin, maps)
    if placement.kind in ("rows", "grid", "uv", "field"):
        return _in_rows(placement, mesh, skin, maps, density, evaluator)
    if placement.kind == "random":
        return _at_random(skin, placement.count, placement.seed, density)
    even = _even(skin, placement.count, placement.seed, density, evaluator)
    if placement.kind == "even":
        return even
    return spread(skin.bvh, skin.points, even, _spacing(skin, even, density), evaluator.workers)


def _even(skin: Skin, count: int, seed: int, density: Density | None, evaluator: Evaluator) -> Scatter:
    return scatter(
        skin.points, skin.triangles.vertices, count, seed=seed, density=density, workers=evaluator.workers
    )


def _spacing(skin: Skin, places: Scatter, density: Density | None) -> NDArray[np.float32]:
    """The distance of neighbours wanted at each place, metres: hexagonal, wider where the density is less."""
    count = len(places.triangle)
    areas = face_areas(skin.points, skin.triangles.vertices)
    if density is None:
        area, here = float(areas.sum()), np.ones(count)
    else:
        faces = np.arange(len(areas), dtype=np.int32)
        area = float((areas * density(faces, np.full((len(faces), 3), 1.0 / 3.0, np.float32))).sum())
        here = np.maximum(density(places.triangle, places.barycentric).astype(np.float64), 1.0 / 64.0)
    return np.sqrt(2.0 / np.sqrt(3.0) * area / max(count, 1) / here).astype(np.float32)


def _density(
    placement: Placement, coat: FeatherCoat, mesh: Mesh, skin: Skin, maps: Maps
) -> Density | None:
    """How thickly feathers stand, 0 .. 1: the density map times the tract; None for everywhere the same."""
    item = None if placement.density_map is None else _map(maps, placement.density_map)
    tract = next((tract for tract in coat.tracts if tract.name == placement.tract), None)
    if item is None and tract is None:
        return None
    triangles, points = skin.triangles, skin.points

    def value(triangle: NDArray[np.int32], weights: NDArray[np.float32]) -> NDArray[np.float32]:
        found = np.ones(len(triangle), np.float32)
        if item is not None:
            found = np.clip(sample_map(item, mesh, triangles, triangle, weights), 0.0, 1.0)
        if tract is not None:
            at = np.einsum("nk,nkc->nc", weights, points[triangles.vertices[triangle]])
            found = found * (distance_to_tract(at, tract) <= 0.5 * tract.width)
        return np.asarray(found, np.float32)

    return value


def distance_to_tract(points: NDArray[np.float32], tract: Tract) -> NDArray[np.float64]:
    """Metres (N,) from points (N, 3) to the line of a tract, straight through space."""
    line = tract.line.astype(np.float64)
    best = np.linalg.norm(points - line[0], axis=1)
    for a, b in pairwise(line):
        step = b - a
        t = np.clip((points - a) @ step / max(float(step @ step), 1e-30), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(points - a - t[:, None] * step, axis=1))
    return best


def _map(maps: Maps, name: str) -> Map:
    item = next((one for one in maps if one.name == name), None)
    if item is None:
        raise UserError(f"There is no map named {name!r}; paint or load it, or choose another map.")
    return item


def _at_random(skin: Skin, count: int, seed: int, density: Density | None) -> Scatter:
    """Places drawn by area and density alone, with no regard for one another."""
    areas = face_areas(skin.points, skin.triangles.vertices)
    cumulative = np.cumsum(np.where(np.isfinite(areas), areas, 0.0))
    if not cumulative[-1] > 0.0:
        raise UserError("The mesh has no surface for feathers to stand on.")
    keys = np.arange(count)
    triangle, weights = np.zeros(count, np.int32), np.zeros((count, 3), np.float32)
    left = keys
    for attempt in range(400):
        draw = rand(left, seed + 7919 * attempt) * cumulative[-1]
        chosen = np.minimum(np.searchsorted(cumulative, draw, side="right"), len(areas) - 1).astype(np.int32)
        a = np.sqrt(rand(left, seed + 7919 * attempt + 1))
        b = rand(left, seed + 7919 * attempt + 2)
        bary = np.stack([1.0 - a, a * (1.0 - b), a * b], axis=1).astype(np.float32)
        triangle[left], weights[left] = chosen, bary
        if density is None:
            return Scatter(triangle, weights)
        left = left[rand(left, seed + 7919 * attempt + 3) >= density(chosen, bary)]
        if not len(left):
            return Scatter(triangle, weights)
    raise UserError("Hardly any skin is left for feathers; paint more of the density map, or widen the tract.")


def _in_rows(
    placement: Placement, mesh: Mesh, skin: Skin, maps: Maps, density: Density | None, evaluator: Evaluator
) -> Scatter:
    """Exactly the count of places along the lines of the field of the placement's kind."""
    values = _field(placement, mesh, skin, maps, evaluator)
    triangles = skin.triangles.vertices
    brick = placement.kind != "grid"
    ratio = 0.866 if brick else 1.0
    count, share = placement.count, 1.0
    kept = Scatter(np.zeros(0, np.int32), np.zeros((0, 3), np.float32))
    for _ in range(4):  # what a density takes away is only known afterwards
        laid = along_rows(skin.points, triangles, values, int(np.ceil(count / share)), brick, ratio)
        kept = laid
        if density is not None and len(laid.triangle):
            chance = rand(np.arange(len(laid.triangle)), placement.seed + 5)
            rows = np.flatnonzero(chance < density(laid.triangle, laid.barycentric))
            kept = Scatter(laid.triangle[rows], laid.barycentric[rows])
        if len(kept.triangle) >= count or not len(laid.triangle):
            break
        share = max(0.97 * len(kept.triangle) / len(laid.triangle), 1e-3)
    made = len(kept.triangle)
    if made > count:  # leave out as many as are too many, all over the skin
        rows = np.sort(np.argsort(rand(np.arange(made), placement.seed + 6), kind="stable")[:count])
        return Scatter(kept.triangle[rows], kept.barycentric[rows])
    if made < count:  # a field that is flat or of few lines: the rest stands evenly
        rest = _even(skin, count - made, placement.seed, density, evaluator)
        return Scatter(
            np.concatenate([kept.triangle, rest.triangle]), np.concatenate([kept.barycentric, rest.barycentric])
        )
    return kept


def _field(
    placement: Placement, mesh: Mesh, skin: Skin, maps: Maps, evaluator: Evaluator
) -> NDArray[np.float64]:
    """What rows follow, (V,) float64, scaled so that it changes by about a metre over a metre."""
    if placement.kind == "field":
        assert placement.field_map is not None  # the record says so
        values = at_vertices(_map(maps, placement.field_map), mesh).astype(np.float64)
    elif placement.kind == "uv":
        if mesh.uvs is None:
            raise UserError("Rows along UV need UVs and this mesh has none; unwrap it, or choose rows.")
        count = np.bincount(mesh.corners, minlength=len(mesh.points))
        values = np.bincount(mesh.corners, mesh.uvs[:, 1], len(mesh.points)) / np.maximum(count, 1)
    else:
        distance = evaluator.get(_flow_of, mesh, evaluator=evaluator).distance.astype(np.float64)
        values = np.where(np.isfinite(distance), distance, skin.points[:, 1])
        return values
    return values / max(_slope(skin, values), 1e-30)


def _flow_of(mesh: Mesh, evaluator: Evaluator):  # type: ignore[no-untyped-def]
    return skin_flow(skin_at_rest(mesh, evaluator))


def _slope(skin: Skin, values: NDArray[np.float64]) -> float:
    """The mean change of a field over a metre of skin."""
    corners = skin.points[skin.triangles.vertices].astype(np.float64)
    at = values[skin.triangles.vertices]
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(u, v)
    twice = np.linalg.norm(normal, axis=1)
    du, dv = (at[:, 1] - at[:, 0])[:, None], (at[:, 2] - at[:, 0])[:, None]
    gradient = np.cross(normal, u) * dv - np.cross(normal, v) * du
    steep = np.linalg.norm(gradient, axis=1) / np.maximum(twice * twice, 1e-300)
    return float((steep * twice).sum() / max(float(twice.sum()), 1e-300))
