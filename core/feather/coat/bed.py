"""The bed of a coat: everything about the places of feathers that no brush and no frame changes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.evaluator import Evaluator
from core.feather.coat.coat import FeatherCoat, Stroke
from core.feather.coat.ground import Ground, ground_of, smoothed
from core.feather.coat.place import Places, distance_to_tract
from core.groom.binding import triangle_places
from core.groom.dress import skin_flow
from core.groom.flow import smooth_over_surface
from core.groom.guides import Guides
from core.mesh.bvh import closest_points
from core.mesh.intrinsic import Binding, bind
from core.mesh.mesh import Mesh
from core.mesh.roots import Roots
from core.mesh.skin import Skin, skin_at_rest
from core.mesh.surface import place_roots, root_positions
from core.random import rand
from core.record import freeze

NORMAL_PASSES = 2  # over neighbours: facets of a coarse mesh become a ground that feathers can lie on
STROKE_PASSES = 160


class Bed(NamedTuple):
    """N places with what is known of them at rest.

    roots : bound to the mesh. positions, normals : (N, 3) float64, of the ground feathers lie on (facets smoothed).
    tract : (N,) float64, 1 + the number of the tract a feather stands in, 0 outside all. age : (N,) in 0 .. 1, by id.
    """

    places: Places
    roots: Roots
    positions: NDArray[np.float32]
    normals: NDArray[np.float64]
    ground: Ground
    tract: NDArray[np.float64]
    age: NDArray[np.float64]


def make_bed(coat: FeatherCoat, mesh: Mesh, places: Places, evaluator: Evaluator) -> Bed:
    """The bed of places on a mesh at rest."""
    skin = skin_at_rest(mesh, evaluator)
    roots = place_roots(mesh, skin.triangles, places.triangle, places.barycentric, skin.normals)
    positions = root_positions(mesh, roots)
    corners = skin.points[skin.triangles.vertices[places.triangle]].astype(np.float64)
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(flat, axis=1, keepdims=True)
    smooth = roots.frames[:, 2].astype(np.float64)
    facing = np.where(size > 0.0, flat / np.where(size > 0.0, size, 1.0), smooth)
    facing[np.einsum("nc,nc->n", facing, smooth) < 0.0] *= -1.0  # windings differ in a soup
    ground = ground_of(positions, facing.astype(np.float32))
    normals = smoothed(facing, ground.near, NORMAL_PASSES, evaluator.workers.ranges)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.where(length > 1e-9, normals / np.maximum(length, 1e-9), facing)
    tract = np.zeros(len(places.ids))
    for number, item in enumerate(coat.tracts):
        inside = distance_to_tract(positions, item) <= 0.5 * item.width
        tract[inside & (tract == 0.0)] = number + 1.0
    seed = coat.placements[0].seed if coat.placements else 0
    return Bed(places, roots, positions, normals, ground, tract, rand(places.ids, seed + 211))


def bind_to_keys(mesh: Mesh, keys: Guides, places: Places, evaluator: Evaluator) -> Binding:
    """The feathers bound to keys over the surface; combing the keys does not come here."""
    skin = skin_at_rest(mesh, evaluator)
    sites = triangle_places(mesh, skin.triangles, keys.roots)
    found = bind(
        skin.points, skin.triangles.vertices, *sites, places.triangle, places.barycentric, 0, evaluator.workers
    )
    return found._replace(sites=freeze(found.sites), weights=freeze(found.weights))


def field_directions(
    kind: str, strokes: tuple[Stroke, ...], mesh: Mesh, evaluator: Evaluator
) -> NDArray[np.float32]:
    """Directions (V, 3) per vertex that feathers lie in without keys: of the flow, strokes or curvature."""
    skin = skin_at_rest(mesh, evaluator)
    flow = skin_flow(skin).directions
    if kind == "strokes" and strokes:
        return _stroked(skin, flow, strokes, evaluator)
    if kind == "curvature":
        return _least_curved(skin, flow)
    return flow


def _stroked(
    skin: Skin, flow: NDArray[np.float32], strokes: tuple[Stroke, ...], evaluator: Evaluator
) -> NDArray[np.float32]:
    """Strokes laid on the skin and spread over it like heat; the flow fills in what no stroke reaches."""
    pull, weight = np.zeros((len(skin.points), 3)), np.zeros((len(skin.points), 1))
    for stroke in strokes:
        middle = 0.5 * (stroke.points[1:] + stroke.points[:-1])
        step = np.diff(stroke.points.astype(np.float64), axis=0)
        step /= np.maximum(np.linalg.norm(step, axis=1, keepdims=True), 1e-30)
        triangle, weights, _ = closest_points(skin.bvh, middle, workers=evaluator.workers)
        corners = skin.triangles.vertices[np.maximum(triangle, 0)]
        for k in range(3):
            np.add.at(pull, corners[:, k], weights[:, k, None] * step)
            np.add.at(weight, corners[:, k], weights[:, k, None].astype(np.float64))
    own = weight[:, 0] > 0.0
    pull[own] /= weight[own]
    normals = skin.normals.astype(np.float64)
    field = np.where(own[:, None], pull, 0.05 * flow)
    for _ in range(STROKE_PASSES // 8):
        field = smooth_over_surface(field, skin.triangles.vertices, 8)
        field[own] = pull[own]
        field -= normals * np.einsum("vc,vc->v", field, normals)[:, None]
    length = np.linalg.norm(field, axis=1, keepdims=True)
    return np.where(length > 1e-6, field / np.maximum(length, 1e-6), flow).astype(np.float32)


def _least_curved(skin: Skin, flow: NDArray[np.float32]) -> NDArray[np.float32]:
    """The direction in which the skin bends least, pointing with the flow; where it bends alike all round, the flow."""
    triangles = skin.triangles.vertices
    points, normals = skin.points.astype(np.float64), skin.normals.astype(np.float64)
    shape = np.zeros((len(points), 3, 3))
    for a, b in ((0, 1), (1, 2), (2, 0)):
        i, j = triangles[:, a], triangles[:, b]
        step = points[j] - points[i]
        length2 = np.maximum(np.einsum("ec,ec->e", step, step), 1e-30)
        bent = np.einsum("ec,ec->e", normals[j] - normals[i], step) / length2
        tensor = (bent / length2)[:, None, None] * step[:, :, None] * step[:, None, :]
        np.add.at(shape, i, tensor)
        np.add.at(shape, j, tensor)
    shape = smooth_over_surface(shape.reshape(-1, 9), triangles, 6).reshape(-1, 3, 3)
    across = np.cross(normals, flow)
    tt = np.einsum("vc,vcd,vd->v", flow, shape, flow)
    bb = np.einsum("vc,vcd,vd->v", across, shape, across)
    tb = np.einsum("vc,vcd,vd->v", flow, shape, across)
    # the axis of least curvature, doubled angle: of [[tt, tb], [tb, bb]]; a half turn keeps it with the flow
    angle = 0.5 * np.arctan2(-2.0 * tb, bb - tt)
    angle = np.where(np.hypot(bb - tt, 2.0 * tb) > 1e-6 * (np.abs(tt) + np.abs(bb) + 1e-30), angle, 0.0)
    turned = np.cos(angle)[:, None] * flow + np.sin(angle)[:, None] * across
    turned = smooth_over_surface(turned, triangles, 8)
    turned -= normals * np.einsum("vc,vc->v", turned, normals)[:, None]
    length = np.linalg.norm(turned, axis=1, keepdims=True)
    return np.where(length > 1e-6, turned / np.maximum(length, 1e-6), flow).astype(np.float32)
