"""What each way of interpolating is worth: every sculpt left out in turn and predicted from the others."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from core.pose.corrective import plain_weights
from core.pose.layers import Sculpt, extract_layer, space_dofs
from core.pose.pose import REST, Pose, local_of_pose
from core.pose.pose_space import Correctives, Dof, PoseLayer, PoseSample, PoseSpace
from core.pose.rig import Rig
from core.pose.rotation import euler_from_quaternion
from core.pose.skinning import deformed
from core.pose.solve import Settings, solve_centres, weights_at
from core.pose.synthesis import evaluate
from core.record import freeze
from core.transform import Array

Method = Literal["SSD", "SI", "Euler PSD", "PSD", "WPSD"]
METHODS: tuple[Method, ...] = get_args(Method)
WEIGHTED_STEPS = 8


class Row(NamedTuple):
    """Error of one method at one pose it did not know: root mean square over the vertices any sculpt moves, and the
    largest, both in parts of the mesh's diagonal."""

    method: Method
    pose: str
    rms: float
    worst: float


def leave_one_out(
    points: NDArray[np.float32], rig: Rig, sculpts: Sequence[Sculpt], dofs: Sequence[Dof] | None = None
) -> tuple[Row, ...]:
    """A row for every method and every sculpt, which is predicted from all the others in one Gaussian space."""
    sculpts = [s for s in sculpts if s.target is not None]
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    touched = np.zeros(len(points), np.bool_)
    for sculpt in sculpts:
        plain = deformed(points, rig, local_of_pose(rig.skeleton, sculpt.pose), sculpt.pose.numbers)
        touched |= np.linalg.norm(plain - np.asarray(sculpt.target), axis=1) > 1e-6 * size
    rows = []
    for k, held in enumerate(sculpts):
        others = [s for i, s in enumerate(sculpts) if i != k]
        for method in METHODS:
            found = predicted(points, rig, others, held.pose, method, dofs)
            error = np.linalg.norm(found - np.asarray(held.target), axis=1)[touched] / size
            rows.append(Row(method, held.pose.name, float(np.sqrt(np.mean(error**2))), float(error.max(initial=0.0))))
    return tuple(rows)


def predicted(
    points: NDArray[np.float32], rig: Rig, sculpts: Sequence[Sculpt], pose: Pose, method: Method,
    dofs: Sequence[Dof] | None = None,
) -> NDArray[np.float32]:
    """The surface (V, 3) at `pose` by one method, from some sculpts.

    SSD : the skin alone. SI : the sculpted surfaces themselves mixed by sliders, without a skeleton; the sliders go in
    straight lines from each sculpt to the next. Euler PSD : distance between Euler angles. PSD : as the
    rest of the program does. WPSD : distances weighted by skin, Kurihara and Miyata (2004).
    """
    if method == "SSD" or not sculpts:
        return evaluate(points, rig, None, pose)
    names = sorted({d for s in (*sculpts, Sculpt(pose, None)) for d in _controls(s.pose)})
    read = space_dofs(rig, [*(s.pose for s in sculpts), pose], names, dofs)
    space = PoseSpace(
        dofs=read, samples=tuple(PoseSample(pose=s.pose, falloffs=dict(s.falloffs)) for s in sculpts),
        weighted=WEIGHTED_STEPS if method == "WPSD" else 0)
    targets = np.array([np.asarray(s.target, np.float64) for s in sculpts])
    vertices = np.arange(len(points), dtype=np.int32)
    layer, _ = extract_layer(points, rig, [], "all", space, vertices, targets)
    if method == "SI":
        shares = plain_weights(layer.replace(kind="interpolation"), pose)
        return (points + np.einsum("m,mvd->vd", shares, targets - points)).astype(np.float32)
    if method == "Euler PSD":
        layer = _fixed(layer, _euler_weights(read, sculpts, pose), pose)
    return evaluate(points, rig, Correctives(layers=(layer,)), pose)


def _controls(pose: Pose) -> set[str]:
    return {*pose.rotations, *pose.translations, *pose.numbers}


def _euler_weights(dofs: Sequence[Dof], sculpts: Sequence[Sculpt], pose: Pose) -> Array:
    poses = [REST, *(s.pose for s in sculpts), pose]
    columns = []
    for dof in dofs:
        if dof.kind == "number":
            part = np.array([[p.numbers.get(dof.control, dof.rest)] for p in poses])
        elif dof.kind == "translation":
            part = np.array([p.translations.get(dof.control, (0.0, 0.0, 0.0)) for p in poses])
        else:
            part = euler_from_quaternion([p.rotations.get(dof.control, (0.0, 0.0, 0.0, 1.0)) for p in poses])
        columns.append(part / dof.falloff[0])
    places = np.hstack(columns)
    ones = np.ones(places.shape[1])
    solved = solve_centres(
        places[:-1], np.tile(ones, (len(places) - 1, 1)), ones, Settings(), tuple(p.name for p in poses[:-1]))
    return weights_at(solved, places[-1:])[0, 1:]


def _fixed(layer: PoseLayer, shares: Array, pose: Pose) -> PoseLayer:
    """A layer of one sample, at `pose`, with the corrections mixed once and for all."""
    mixed = np.einsum("m,mnd->nd", shares, layer.deltas.astype(np.float64)).astype(np.float32)[None]
    fixed: PoseLayer = layer.replace(
        space=layer.space.replace(samples=(PoseSample(pose=pose),), anchors=()), moved=freeze(layer.moved[:1] | True),
        deltas=freeze(mixed), targets=freeze(layer.targets[:1].copy()))
    return fixed
