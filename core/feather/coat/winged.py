"""A coat at one frame, and how feathers of wings join those of the skin: as rows after them, fixed where they lie."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.evaluator import Evaluator
from core.feather.coat.bed import Bed
from core.feather.coat.coat import FeatherCoat
from core.feather.coat.crossing import vane_boxes
from core.feather.coat.layering import Feathers, Layered, layer_around
from core.feather.coat.posing import LENGTH, pose_vanes
from core.feather.coat.wing_pose import WingFeathers, lay_wings
from core.feather.coat.worn import parts_of, worn_preset, worn_values
from core.feather.vane import SHAPE_COLUMNS, vane_grids
from core.mesh.bvh import closest_points
from core.mesh.mesh import Mesh
from core.mesh.skin import Skin, skin_at_rest
from core.mesh.surface import place_roots
from core.random import rand

ROWS, COLUMNS = 8, 5  # of a vane as it is layered


class Laid(NamedTuple):
    """A coat at one frame, the rows those of the bed.

    ids : (N,) int32. shown : (N,) bool, what density keeps. layered : poses, vanes, boxes.
    feathers : vanes at length 1, roots, frames. skin : the skin in the same pose.
    """

    ids: NDArray[np.int32]
    shown: NDArray[np.bool_]
    layered: Layered
    feathers: Feathers
    bed: Bed
    skin: Skin
    fields: dict[str, Any]


def winged(coat: FeatherCoat, mesh: Mesh, laid: Laid, frame: float, evaluator: Evaluator) -> Laid:
    """A laid coat with the feathers of its wings on the same skin; what they pass through makes way for them."""
    wings = lay_wings(coat.wings, mesh.points, laid.skin.points, frame)
    if not len(wings.ids):
        return laid
    own = wing_vanes(coat, wings, evaluator)
    vanes = pose_vanes(own, wings.poses, wings.roots, wings.frames, ranges=evaluator.workers.ranges)
    before, rest = len(laid.ids), laid.feathers
    feathers = Feathers(
        np.concatenate([rest.own, own]), np.concatenate([rest.roots, wings.roots]),
        np.concatenate([rest.frames, wings.frames]),
        np.concatenate([rest.rank, np.full(len(own), np.inf)]),
    )
    layered = Layered(
        np.concatenate([laid.layered.poses, wings.poses]), np.concatenate([laid.layered.vanes, vanes]),
        np.concatenate([laid.layered.boxes, vane_boxes(vanes, evaluator.workers.ranges)]),
        laid.layered.first, laid.layered.second,
    )
    if coat.layered and before:
        pinned = np.arange(before, before + len(own), dtype=np.int32)
        layered = layer_around(
            feathers, layered, pinned, laid.skin.bvh, evaluator.workers, laid.skin.points is mesh.points)
    bed = _bed(coat, mesh, laid.bed, wings, evaluator)
    shown = np.concatenate([laid.shown, np.ones(len(own), np.bool_)])
    return Laid(bed.places.ids, shown, layered, feathers, bed, laid.skin, _fields(laid.fields, bed, wings))


def wing_vanes(coat: FeatherCoat, wings: WingFeathers, evaluator: Evaluator) -> NDArray[np.float32]:
    """Vanes (N, R, C, 3) of feathers of wings in their own frames, at length 1."""
    shape = len(SHAPE_COLUMNS)
    table = np.empty((len(wings.ids), shape), np.float32)
    for part in np.unique(wings.parts):
        table[wings.parts == part] = worn_values(coat, worn_preset(coat, str(part)))[:shape]
    table[:, SHAPE_COLUMNS["shaftLength"]] = 1.0
    for name in ("vaneWidthLeft", "vaneWidthRight"):
        table[:, SHAPE_COLUMNS[name]] *= wings.widths.astype(np.float32)
    own = vane_grids(table, ROWS, COLUMNS, evaluator.workers.ranges)
    own[wings.flipped, ..., 0] *= -1.0
    own[..., 2] = 0.0  # feathers a tenth of a millimetre apart cross by what each curves by itself; rows bend as one
    return own


def _bed(coat: FeatherCoat, mesh: Mesh, bed: Bed, wings: WingFeathers, evaluator: Evaluator) -> Bed:
    """The bed with feathers of wings on the skin nearest to their roots at rest, on which a picture carries them."""
    skin = skin_at_rest(mesh, evaluator)
    at_rest = lay_wings(coat.wings, mesh.points, mesh.points, 0.0).roots
    triangle, weights, _ = closest_points(skin.bvh, at_rest, workers=evaluator.workers)
    triangle, weights = np.maximum(triangle, 0).astype(np.int32), weights.astype(np.float32)
    roots = place_roots(mesh, skin.triangles, triangle, weights, skin.normals)
    parts = parts_of(coat)
    tract = np.array([parts.index(str(part)) for part in wings.parts], np.float64)
    places = bed.places._replace(
        ids=np.concatenate([bed.places.ids, wings.ids]), triangle=np.concatenate([bed.places.triangle, triangle]),
        barycentric=np.concatenate([bed.places.barycentric, weights]))
    ground = bed.ground._replace(
        near=np.concatenate([bed.ground.near, np.full((len(triangle), bed.ground.near.shape[1]), -1, np.int32)]),
        spacing=np.concatenate([bed.ground.spacing, np.full(len(triangle), _typical(bed.ground.spacing), np.float32)]))
    return Bed(
        places, bed.roots.join(roots), np.concatenate([bed.positions, at_rest]),
        np.concatenate([bed.normals, wings.frames[:, 2].astype(np.float64)]), ground,
        np.concatenate([bed.tract, tract]), np.concatenate([bed.age, rand(wings.ids, 211)]))


def _typical(spacing: NDArray[np.float32]) -> float:
    return float(np.median(spacing)) if len(spacing) else 1e-3


def _fields(fields: dict[str, Any], bed: Bed, wings: WingFeathers) -> dict[str, Any]:
    """Columns for all feathers: what is not known of those of wings is what others mostly have."""
    known = {
        "id": bed.places.ids, "tract": bed.tract, "age": bed.age, "spacing": bed.ground.spacing.astype(np.float64),
        "u": bed.roots.uvs[:, 0], "v": bed.roots.uvs[:, 1],
    }
    made = {}
    for name, values in fields.items():
        columns = np.asarray(values)
        more = len(bed.places.ids) - len(columns) if columns.ndim else 0
        made[name] = known.get(name, values)
        if name not in known and columns.ndim and more == len(wings.ids):
            fill = np.median(columns, axis=0) if len(columns) else 0.0
            made[name] = np.concatenate([columns, np.broadcast_to(fill, (more, *columns.shape[1:]))])
    made["length"] = np.concatenate([np.asarray(fields["length"]), wings.poses[:, LENGTH]])
    return made
