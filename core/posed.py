"""The animal at a frame of its clip: skins and collision fields, remembered by the evaluator."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.document import MeshObject
from core.evaluator import Evaluator
from core.mesh.distance_field import DistanceField, build_distance_field
from core.mesh.mesh import Mesh
from core.mesh.skin import FIELD_CELLS, Skin, distance_field, distance_field_known, skin_at_rest, skin_posed
from core.pose.pose import Pose
from core.pose.pose_space import Correctives
from core.pose.rig import Rig
from core.pose.skinning import posed_points
from core.pose.synthesis import evaluate, evaluate_at, prepare
from core.record import freeze


def moves(item: MeshObject) -> bool:
    """True when the mesh has a clip that can pose it."""
    return item.rig is not None and item.rig.clip is not None


def held(item: MeshObject) -> bool:
    """True when the artist holds the mesh in a pose, so that no frame changes what is shown."""
    return item.surface is not None or (item.rig is not None and item.pose is not None)


def skin_at(item: MeshObject, frame: float | None, evaluator: Evaluator) -> Skin:
    """The skin of a mesh as it is shown at a frame: in the pose that is held, else as the clip has it.

    At rest without a frame, or when nothing poses it.
    """
    points = shown_points(item, frame, evaluator)
    if points is item.mesh.points:
        return skin_at_rest(item.mesh, evaluator)
    return evaluator.get(_skin, item.mesh, points, evaluator=evaluator)


def shown_points(item: MeshObject, frame: float | None, evaluator: Evaluator) -> NDArray[np.float32]:
    """The vertices (V, 3) float32 of :func:`skin_at`; the very ones at rest where nothing moves them."""
    if frame is None or not (held(item) or moves(item)):
        return item.mesh.points
    if item.surface is not None:
        return item.surface
    if held(item):
        return evaluator.get(held_points, item.mesh, item.rig, item.correctives, item.pose, evaluator=evaluator)
    return evaluator.get(points_at, item.mesh, item.rig, item.correctives, frame=float(frame), evaluator=evaluator)


def field_at(item: MeshObject, frame: float | None, evaluator: Evaluator) -> DistanceField:
    """The field to collide with at that frame."""
    skin = skin_at(item, frame, evaluator)
    if skin.points is item.mesh.points:
        return distance_field(item.mesh, evaluator)
    return evaluator.get(_field, item.mesh, skin.points, evaluator=evaluator)


def field_known(item: MeshObject, frame: float | None, evaluator: Evaluator) -> bool:
    """True when :func:`field_at` would answer at once; making one takes a few tenths of a second."""
    skin = skin_at(item, frame, evaluator)
    if skin.points is item.mesh.points:
        return distance_field_known(item.mesh, evaluator)
    return evaluator.knows(_field, item.mesh, skin.points, evaluator=evaluator)


def points_at(
    mesh: Mesh, rig: Rig, correctives: Correctives | None, frame: float, evaluator: Evaluator
) -> NDArray[np.float32]:
    """The vertices (V, 3) float32 at a frame, frozen; the very ones at rest where the pose moves nothing."""
    if correctives is None:
        points = posed_points(mesh.points, rig, frame, evaluator.workers.ranges)
    else:
        prepared = evaluator.get(prepare, correctives, rig)
        points = evaluate_at(mesh.points, rig, prepared, frame, evaluator.workers.ranges)
    return _at_rest_or_frozen(mesh, points, evaluator)


def held_points(
    mesh: Mesh, rig: Rig, correctives: Correctives | None, pose: Pose, evaluator: Evaluator
) -> NDArray[np.float32]:
    """As :func:`points_at`, in a pose."""
    prepared = () if correctives is None else evaluator.get(prepare, correctives, rig)
    points = evaluate(mesh.points, rig, correctives, pose, evaluator.workers.ranges, prepared)
    return _at_rest_or_frozen(mesh, points, evaluator)


def _at_rest_or_frozen(mesh: Mesh, points: NDArray[np.float32], evaluator: Evaluator) -> NDArray[np.float32]:
    # a pose that moves nothing but by rounding is the rest itself, so that all that is known of it serves
    rounding = 1e-6 * skin_at_rest(mesh, evaluator).diagonal
    return mesh.points if float(np.abs(points - mesh.points).max(initial=0.0)) <= rounding else freeze(points)


def _skin(mesh: Mesh, points: NDArray[np.float32], evaluator: Evaluator) -> Skin:
    return skin_posed(mesh, points, evaluator)


def _field(mesh: Mesh, points: NDArray[np.float32], evaluator: Evaluator) -> DistanceField:
    vertices = skin_at_rest(mesh, evaluator).triangles.vertices
    longest = float(np.ptp(points[mesh.corners].astype(np.float64), axis=0).max())
    return build_distance_field(points, vertices, longest / FIELD_CELLS, workers=evaluator.workers)
