"""What a rig does to its surface as one number for each vertex: the views of posing."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from core.mesh.mesh import Mesh
from core.mesh.normals import mesh_normals
from core.pose.extraction import MOST_CONDITION, condition_numbers, skin_affine
from core.pose.pose import Pose, local_of_pose
from core.pose.pose_space import Correctives
from core.pose.rig import Rig
from core.pose.skinning import skin_matrices_of
from core.pose.synthesis import Prepared, corrected, evaluate, felt, prepare

Points = NDArray[np.float32]
View = Literal["shape", "delta", "strain", "condition", "error", "mask", "weight"]
VIEWS: tuple[View, ...] = get_args(View)
LABELS: dict[View, str] = {
    "shape": "Shape: above the skin", "delta": "Delta before the skin", "strain": "Strain of edges",
    "condition": "Condition of the skin", "error": "Error at the sculpts", "mask": "Mask", "weight": "Weight",
}
STRAINED = 0.5  # full colour, as a part of the length at rest
LEAST = 1e-6  # of the size of the mesh: a range is never smaller, so that rounding has no colour
CONDITIONS = 2.0 * math.log10(MOST_CONDITION)  # decades shown, the limit in the middle


class Heat(NamedTuple):
    """A field on a mesh and how to show it.

    values : (V,) float32. low, high : what the ends of the ramp mean; a signed field has its 0 in the middle.
    ticks : words at the low end, the middle and the high end, with the unit.
    """

    title: str
    values: Points
    low: float
    high: float
    ticks: tuple[str, str, str]

    @property
    def signed(self) -> bool:
        """True when the middle of the ramp means nothing."""
        return self.low < 0.0


def shares_of(values: Points, low: float, high: float) -> Points:
    """Places (V,) float32, 0 .. 1, on a ramp from `low` to `high`."""
    shares: Points = ((values - low) / (high - low)).clip(0.0, 1.0).astype(np.float32)
    return shares


def shape_heat(mesh: Mesh, plain: Points, shown: Points) -> Heat:
    """How far the surface lies above what the skin alone makes, along its normal; negative is below.

    Parameters
    ----------
    plain, shown : (V, 3) float32, posed by the skin alone and as it is shown, object space, metres.
    """
    above = np.einsum("vj,vj->v", shown - plain, mesh_normals(mesh, plain)).astype(np.float32)
    reach = _nice(float(np.abs(above).max(initial=0.0)), mesh)
    return Heat(LABELS["shape"], above, -reach, reach, (_metres(-reach), "0", _metres(reach)))


def delta_heat(mesh: Mesh, rig: Rig, prepared: tuple[Prepared, ...], pose: Pose) -> Heat:
    """How long the corrections are that are added at a pose, metres, before the skin, or after it where they are."""
    there = felt(pose, rig, mesh.points, local_of_pose(rig.skeleton, pose))
    plain, _ = corrected(mesh.points, rig, (), there)
    points, late = corrected(mesh.points, rig, prepared, there)
    lengths = np.linalg.norm(points - plain, axis=1).astype(np.float32)
    for vertices, moves in late:
        lengths[vertices] += np.linalg.norm(moves, axis=1)
    reach = _nice(float(lengths.max(initial=0.0)), mesh)
    return Heat(LABELS["delta"], lengths, 0.0, reach, ("0", _metres(0.5 * reach), _metres(reach)))


def strain_heat(mesh: Mesh, edges: NDArray[np.integer], shown: Points) -> Heat:
    """How much longer the edges (E, 2) at each vertex are than at rest, in parts of that; negative is shorter."""

    def lengths(points: Points) -> NDArray[np.float64]:
        along = points[edges[:, 0]] - points[edges[:, 1]]
        return np.sqrt(np.einsum("ej,ej->e", along, along)).astype(np.float64)

    rest = lengths(mesh.points)
    ends, longer = edges.ravel(), np.repeat(lengths(shown) / np.maximum(rest, 1e-12) - 1.0, 2)
    count = np.maximum(np.bincount(ends, minlength=len(shown)), 1)
    values = (np.bincount(ends, longer, len(shown)) / count).astype(np.float32)
    side = f"{100 * STRAINED:.0f} %"
    return Heat(LABELS["strain"], values, -STRAINED, STRAINED, (f"−{side}", "0", f"+{side}"))


def condition_heat(rig: Rig, count: int, pose: Pose) -> Heat:
    """The condition of the skin at a pose, as its logarithm: where it is too large a sculpt is added after the skin."""
    matrices = skin_matrices_of(rig.skeleton, local_of_pose(rig.skeleton, pose))
    conditions = condition_numbers(skin_affine(rig, matrices, np.arange(count, dtype=np.int32)).turn)
    values = np.log10(np.minimum(conditions, 1e12)).astype(np.float32)
    ticks = ("1", f"{MOST_CONDITION:g}: limit", f"{MOST_CONDITION**2:g}")
    return Heat(LABELS["condition"], values, 0.0, CONDITIONS, ticks)


def error_heat(mesh: Mesh, rig: Rig, sculpts: Correctives, correctives: Correctives | None) -> Heat:
    """How far the surface is from the sculpts at the sculpted pose where it misses most, metres.

    Parameters
    ----------
    correctives : what makes the surface of the sculpts: they themselves, or as another method takes them.
    """
    values, ready = np.zeros(len(mesh.points), np.float32), prepare(correctives, rig)
    for layer in sculpts.layers:
        for k, sample in enumerate(layer.space.samples):
            posed = evaluate(mesh.points, rig, correctives, sample.pose, prepared=ready)[layer.vertices]
            missed = np.linalg.norm(posed - layer.targets[k], axis=1)
            values[layer.vertices] = np.maximum(values[layer.vertices], missed)
    reach = _nice(float(values.max(initial=0.0)), mesh)
    return Heat(LABELS["error"], values, 0.0, reach, ("0", _metres(0.5 * reach), _metres(reach)))


def mask_heat(mask: Points) -> Heat:
    """The mask: 1 is kept from every brush."""
    return Heat(LABELS["mask"], mask, 0.0, 1.0, ("free", "half", "kept"))


def weight_heat(rig: Rig, joint: str) -> Heat:
    """The skin weight of a joint."""
    mine = rig.skin.joints == rig.skeleton.names.index(joint)
    values = (rig.skin.weights * mine).sum(axis=1).astype(np.float32)
    return Heat(f"{LABELS['weight']} of {joint}", values, 0.0, 1.0, ("0", "0.5", "1"))


def _nice(most: float, mesh: Mesh) -> float:
    """The first of 1, 2, 5, 10 ... that is not below `most`, so that a range stays while a pose changes a little."""
    size = float(np.linalg.norm(np.ptp(mesh.points, axis=0))) if len(mesh.points) else 1.0
    most = max(most, LEAST * max(size, 1e-9))
    power = 10.0 ** math.floor(math.log10(most))
    return next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= most * (1.0 - 1e-9))


def _metres(value: float) -> str:
    """A length in a unit that gives it few digits."""
    sign, size = "−" if value < 0.0 else "", abs(value)
    for unit, scale in (("m", 1.0), ("cm", 1e-2), ("mm", 1e-3)):
        if size >= 0.999 * scale:
            return f"{sign}{size / scale:.3g} {unit}"
    return f"{sign}{size / 1e-6:.3g} µm"
