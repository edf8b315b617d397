"""The mesh at a pose: blend shapes, corrections of all layers, then the skin."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.core.types import Array as NumbaArray
from numba.core.types import boolean, float32, int32, int64, void
from numpy.typing import NDArray

from core.pose.blend_shapes import morphed, shape_weights
from core.pose.clip import numbers_at
from core.pose.corrective import plain_weights
from core.pose.embedding import embed
from core.pose.extraction import skin_affine, surface_rotations
from core.pose.pose import REST, Pose, local_of_pose, pose_of_local
from core.pose.pose_space import Correctives, Dof, PoseLayer
from core.pose.rig import Rig, resting_numbers
from core.pose.skinning import carried, local_at, moved_number, skin_matrices_of
from core.pose.solve import Solved, solve, weights_at
from core.transform import Array
from core.workers import serial_ranges

Ranges = Callable[..., None]
BLOCK = 2048  # rows added up at a time: the sum stays in a near cache, and deltas are read in long stretches


class Prepared(NamedTuple):
    """A layer ready to be evaluated.

    starts : (G + 1,) int64, its runs of rows that share one system. solved : (G,) of each run; None of plain ones.
    after : (G,) which runs are added after skinning. places : (n,) int32 where each row goes: the vertex, or the
        place among `late`, the vertices (k,) that are corrected after skinning.
    deltas : (M, 3 n) float32.
    """

    layer: PoseLayer
    starts: NDArray[np.int64]
    solved: tuple[Solved | None, ...]
    after: NDArray[np.bool_]
    places: NDArray[np.int32]
    late: NDArray[np.int32]
    deltas: NDArray[np.float32]


def prepare(correctives: Correctives | None, rig: Rig) -> tuple[Prepared, ...]:
    """Solve all layers that are enabled; remember the result by the identity of both.

    Raises
    ------
    Refusal
        Naming the poses that cannot be told apart.
    """
    layers = () if correctives is None else correctives.layers
    return tuple(prepare_layer(layer, rig) for layer in layers if layer.enabled and layer.space.samples)


def prepare_layer(layer: PoseLayer, rig: Rig) -> Prepared:
    """One layer, see :func:`prepare`."""
    n = len(layer.vertices)
    shares = skin_shares(layer.space.dofs, layer.space.weighted, rig, layer.vertices)
    keys = run_keys(layer.after, layer.moved, shares)
    new = np.concatenate([[n > 0], (keys[:, 1:] != keys[:, :-1]).any(axis=0)]) if n else np.zeros(0, np.bool_)
    firsts = np.flatnonzero(new)
    known: dict[bytes, Solved] = {}
    solved: list[Solved | None] = []
    for row in firsts:
        if layer.kind != "pose-space":
            solved.append(None)
            continue
        key = layer.moved[:, row].tobytes() + shares[row].tobytes()
        if key not in known:
            known[key] = solve(layer.space, layer.moved[:, row], shares[row] if shares.size else None)
        solved.append(known[key])
    late = layer.vertices[layer.after]
    places = layer.vertices.copy()
    places[layer.after] = np.arange(len(late), dtype=np.int32)
    return Prepared(
        layer, np.append(firsts, n).astype(np.int64), tuple(solved), layer.after[firsts], places, late,
        layer.deltas.reshape(len(layer.deltas), 3 * n))


def run_keys(after: NDArray[np.bool_], moved: NDArray[np.bool_], shares: Array) -> NDArray[np.uint8]:
    """Bytes (k, n) that are the same for rows that share a system and a place in the order of things."""
    steps = np.round(64.0 * shares.T).astype(np.uint8)
    return np.vstack([after[None].view(np.uint8), np.packbits(moved, axis=0), steps])


def skin_shares(dofs: tuple[Dof, ...], steps: int, rig: Rig, vertices: NDArray[np.int32]) -> Array:
    """How much each dof counts for vertices, (n, len(dofs)): its skin weight over the largest, in so many steps.

    Never less than one step, for poses that differ in a joint of no weight would fall together; numbers count fully.
    (n, 0) when `steps` is 0: nothing is weighted. Weighted pose space deformation, Kurihara and Miyata (2004).
    """
    if steps == 0:
        return np.zeros((len(vertices), 0))
    out = np.ones((len(vertices), len(dofs)))
    turning = [i for i, d in enumerate(dofs) if d.kind != "number" and d.control in rig.skeleton.names]
    for i in turning:
        joint = rig.skeleton.names.index(dofs[i].control)
        out[:, i] = (rig.skin.weights[vertices] * (rig.skin.joints[vertices] == joint)).sum(axis=1)
    if turning:
        most = out[:, turning].max(axis=1, keepdims=True)
        out[:, turning] = np.where(most > 0.0, out[:, turning] / np.where(most > 0.0, most, 1.0), 1.0)
        out[:, turning] = np.maximum(np.round(out[:, turning] * steps), 1.0) / steps
    return out


def run_weights(prepared: Prepared, pose: Pose) -> NDArray[np.float32]:
    """Weights (G, M) of the samples for every run of a layer; 0 for samples a run does not know."""
    layer = prepared.layer
    out = np.zeros((len(prepared.solved), len(layer.space.samples)), np.float32)
    if layer.kind != "pose-space":
        out[:] = plain_weights(layer, pose)
        return np.where(layer.moved[:, prepared.starts[:-1]].T, out, np.float32(0.0))
    place = embed(layer.space.dofs, [pose])
    done: dict[int, Array] = {}
    for g, solved in enumerate(prepared.solved):
        assert solved is not None
        if id(solved) not in done:
            done[id(solved)] = weights_at(solved, place)[0, solved.silent :]
        out[g, layer.moved[:, prepared.starts[g]]] = done[id(solved)]
    return out


def evaluate(
    mesh_points: NDArray[np.float32], rig: Rig, correctives: Correctives | None, pose: Pose,
    ranges: Ranges = serial_ranges, prepared: tuple[Prepared, ...] | None = None,
) -> NDArray[np.float32]:
    """Points (V, 3) float32, object space, of a mesh at a pose.

    Parameters
    ----------
    mesh_points : (V, 3) float32, at rest, object space.
    prepared : of :func:`prepare`, where many poses are evaluated.

    Raises
    ------
    Refusal
        When a pose space cannot be solved.
    """
    ready = prepare(correctives, rig) if prepared is None else prepared
    return deform(mesh_points, rig, ready, local_of_pose(rig.skeleton, pose), pose, ranges)


def pose_at(rig: Rig, frame: float) -> Pose:
    """The pose at `frame` of the clip that plays, rest without one."""
    numbers = {} if rig.clip is None else numbers_at(rig.clip, frame)
    return pose_of_local(rig.skeleton, local_at(rig, frame), numbers=numbers)


def evaluate_at(
    mesh_points: NDArray[np.float32], rig: Rig, prepared: tuple[Prepared, ...], frame: float,
    ranges: Ranges = serial_ranges,
) -> NDArray[np.float32]:
    """As :func:`evaluate`, at a frame of the clip that plays, whose joints may be scaled as well."""
    return deform(mesh_points, rig, prepared, local_at(rig, frame), pose_at(rig, frame), ranges)


def deform(
    mesh_points: NDArray[np.float32], rig: Rig, prepared: tuple[Prepared, ...], local: Array, pose: Pose,
    ranges: Ranges = serial_ranges,
) -> NDArray[np.float32]:
    """As :func:`evaluate`, with the joints at `local` (J, 4, 4), which may be scaled as no pose says."""
    mixed = [ready.layer for ready in prepared if ready.layer.kind == "interpolation"]
    return _mixed(mixed, mesh_points, rig, prepared, np.asarray(local, np.float64), pose, ranges)


def _mixed(
    layers: list[PoseLayer], mesh_points: NDArray[np.float32], rig: Rig, prepared: tuple[Prepared, ...], local: Array,
    pose: Pose, ranges: Ranges,
) -> NDArray[np.float32]:
    """Shape interpolation: the surfaces at rest and at the samples of the last of `layers`, mixed by its weights.

    Controls that the layer does not read stay as they are posed, so the shapes are carried along by the joints above.
    """
    if not layers:
        return _added(mesh_points, rig, prepared, local, pose, ranges)
    *others, layer = layers
    shares = plain_weights(layer, felt(pose, rig, mesh_points, local))
    stops = [REST, *(sample.pose for sample in layer.space.samples)]
    out = np.zeros(mesh_points.shape, np.float32)
    for share, stop in zip([1.0 - float(shares.sum()), *shares.tolist()], stops, strict=True):
        if abs(share) > 1e-9:
            there, joints = _with_controls(layer.space.controls, pose, stop, rig, local)
            out += np.float32(share) * _mixed(others, mesh_points, rig, prepared, joints, there, ranges)
    return out


def _with_controls(controls: tuple[str, ...], pose: Pose, stop: Pose, rig: Rig, local: Array) -> tuple[Pose, Array]:
    """The pose and the joints (J, 4, 4) with some controls as another pose has them."""
    there: Pose = pose.replace(**{
        field: {**{c: v for c, v in getattr(pose, field).items() if c not in controls},
                **{c: v for c, v in getattr(stop, field).items() if c in controls}}
        for field in ("rotations", "translations", "numbers")
    })
    joints, other = local.copy(), local_of_pose(rig.skeleton, there)
    mine = [j for j, name in enumerate(rig.skeleton.names) if name in controls]
    joints[mine] = other[mine]
    return there, joints


def _added(
    mesh_points: NDArray[np.float32], rig: Rig, prepared: tuple[Prepared, ...], local: Array, pose: Pose,
    ranges: Ranges,
) -> NDArray[np.float32]:
    matrices = skin_matrices_of(rig.skeleton, local)
    points, late = corrected(mesh_points, rig, prepared, felt(pose, rig, mesh_points, local), ranges)
    out = carried(points, rig, matrices, ranges)
    for vertices, moves in late:
        turn = surface_rotations(skin_affine(rig, matrices, vertices), matrices)
        out[vertices] += np.einsum("nij,nj->ni", turn, moves).astype(np.float32)
    return out


def corrected(
    mesh_points: NDArray[np.float32], rig: Rig, prepared: tuple[Prepared, ...], pose: Pose,
    ranges: Ranges = serial_ranges,
) -> tuple[NDArray[np.float32], list[tuple[NDArray[np.int32], NDArray[np.float32]]]]:
    """Points (V, 3) before skinning, with shapes and layers; and by layer what to add after it, vertices and moves."""
    points = np.ascontiguousarray(mesh_points, np.float32)
    shape = None if rig.shapes is None else shape_weights(rig.shapes, {**resting_numbers(rig), **pose.numbers})
    if rig.shapes is not None and shape is not None and shape.any():
        points = morphed(points, rig.shapes, shape, ranges)
    elif prepared:
        points = points.copy()
    late = []
    for ready in prepared:
        shares, after = run_weights(ready, pose), np.zeros((len(ready.late), 3), np.float32)
        if shares.any():
            ranges(len(ready.places), lambda a, b: add_deltas(
                ready.deltas, shares, ready.starts, ready.after, ready.places, points, after, a, b))  # noqa: B023
            if len(after):
                late.append((ready.late, after))
    return points, late


def felt(pose: Pose, rig: Rig, mesh_points: NDArray[np.float32], local: Array) -> Pose:
    """The pose with the numbers of controls that are pieces of geometry or joints, as these have moved."""
    moved = [c for c in rig.controls if c.kind != "number"]
    if not moved:
        return pose
    numbers: Mapping[str, float] = {c.name: moved_number(c, rig, mesh_points, local, pose.numbers) for c in moved}
    with_numbers: Pose = pose.replace(numbers={**pose.numbers, **numbers})
    return with_numbers


def whole_pose(pose: Pose, rig: Rig, mesh_points: NDArray[np.float32]) -> Pose:
    """The pose with the numbers that follow from its joints, so that a pose space can read them of it."""
    return felt(pose, rig, mesh_points, local_of_pose(rig.skeleton, pose))


@njit(
    void(NumbaArray(float32, 2, "C", readonly=True), float32[:, ::1], int64[::1],
         NumbaArray(boolean, 1, "C", readonly=True), NumbaArray(int32, 1, "C", readonly=True), float32[:, ::1],
         float32[:, ::1], int64, int64),
    cache=True, nogil=True,
)
def add_deltas(
    deltas: np.ndarray, weights: np.ndarray, starts: np.ndarray, after: np.ndarray, places: np.ndarray,
    points: np.ndarray, late: np.ndarray, first: int, last: int,
) -> None:
    """Add the weighted deltas (M, 3 n) of rows first .. last to `points`, or to `late` for runs `after` skinning."""
    total = np.empty(3 * BLOCK, np.float32)
    used = np.zeros(weights.shape[1] + 7, np.int64)
    share = np.zeros(weights.shape[1] + 7, np.float32)
    for g in range(len(starts) - 1):
        low, high = max(starts[g], first), min(starts[g + 1], last)
        if low >= high:
            continue
        count = 0
        for m in range(weights.shape[1]):
            if weights[g, m] != 0.0:
                used[count], share[count] = m, weights[g, m]
                count += 1
        while count % 8 != 0:  # eight samples at a time, the last filled up with nothing
            used[count], share[count] = used[0], 0.0
            count += 1
        for row in range(low, high, BLOCK):
            rows = min(BLOCK, high - row)
            base, size = 3 * row, 3 * rows
            for i in range(size):
                total[i] = 0.0
            for k in range(0, count, 8):
                w0, w1, w2, w3 = share[k], share[k + 1], share[k + 2], share[k + 3]
                w4, w5, w6, w7 = share[k + 4], share[k + 5], share[k + 6], share[k + 7]
                d0, d1 = deltas[used[k], base : base + size], deltas[used[k + 1], base : base + size]
                d2, d3 = deltas[used[k + 2], base : base + size], deltas[used[k + 3], base : base + size]
                d4, d5 = deltas[used[k + 4], base : base + size], deltas[used[k + 5], base : base + size]
                d6, d7 = deltas[used[k + 6], base : base + size], deltas[used[k + 7], base : base + size]
                for i in range(size):
                    total[i] += ((w0 * d0[i] + w1 * d1[i]) + (w2 * d2[i] + w3 * d3[i])) + (
                        (w4 * d4[i] + w5 * d5[i]) + (w6 * d6[i] + w7 * d7[i]))
            target = late if after[g] else points
            for r in range(rows):
                p = places[row + r]
                target[p, 0] += total[3 * r]
                target[p, 1] += total[3 * r + 1]
                target[p, 2] += total[3 * r + 2]
