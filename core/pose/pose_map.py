"""Pose space seen as a plane: two axes of controls, or all poses at once by their distances.

A chart by two axes sets two parts of controls and leaves the rest of a pose where it is. Joints are laid out by how far
their axis leans to both sides (azimuthal equidistant: straight from rest, true angles) and by their twist.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.pose.embedding import READ, WIDTHS, embed, scales
from core.pose.pose import REST, Pose, Quaternion
from core.pose.pose_space import Dof, PoseSpace
from core.pose.refusal import Refusal
from core.pose.rotation import rotated_axis, swung_and_twisted, twist_angle
from core.pose.solve import solve, weights_at
from core.transform import Array, quaternion_about, quaternion_product, slerp

Part = Literal["number", "twist", "lean", "lean across", "x", "y", "z"]
PARTS: dict[str, tuple[Part, ...]] = {
    "swing": ("lean", "lean across"), "twist": ("twist",), "swing-twist": ("lean", "lean across", "twist"),
    "translation": ("x", "y", "z"), "number": ("number",),
}
REACH = 4.0  # falloffs within which the rim of one is looked for
HALVINGS = 30


class Axis(NamedTuple):
    """One part of a control as a number: radians, metres or units."""

    dof: Dof
    part: Part

    @property
    def name(self) -> str:
        """For people."""
        return self.dof.control if self.part == "number" else f"{self.dof.control} {self.part}"


def axes_of(space: PoseSpace, controls: Sequence[str] = ()) -> tuple[Axis, ...]:
    """All axes of a space, those along which its poses differ most first; of equal ones in the order of `controls`."""
    place = {name: k for k, name in enumerate(controls)}
    dofs = sorted(space.dofs, key=lambda dof: place.get(dof.control, len(place)))
    found = [Axis(dof, part) for dof in dofs for part in PARTS[dof.kind]]
    poses = [REST, *(s.pose for s in space.samples)]
    spread = [np.ptp([coordinate(axis, pose) for pose in poses]) / axis.dof.falloff[0] for axis in found]
    return tuple(found[i] for i in np.argsort(np.negative(spread), kind="stable"))


def coordinate(axis: Axis, pose: Pose) -> float:
    """Where a pose lies on an axis."""
    dof, name = axis.dof, axis.dof.control
    if axis.part == "number":
        return float(pose.numbers.get(name, dof.rest))
    if dof.kind == "translation":
        return float(pose.translations.get(name, (0.0, 0.0, 0.0))["xyz".index(axis.part)])
    turn = pose.rotations.get(name, (0.0, 0.0, 0.0, 1.0))
    if axis.part == "twist":
        return float(twist_angle(turn, dof.axis))
    return float(_lean(turn, dof)[0 if axis.part == "lean" else 1])


def with_coordinate(axis: Axis, pose: Pose, value: float) -> Pose:
    """The pose moved to a place on an axis; its other parts stay."""
    dof, name = axis.dof, axis.dof.control
    changed: Pose
    if axis.part == "number":
        changed = pose.replace(numbers={**pose.numbers, name: float(value)})
    elif dof.kind == "translation":
        place = list(pose.translations.get(name, (0.0, 0.0, 0.0)))
        place["xyz".index(axis.part)] = float(value)
        changed = pose.replace(translations={**pose.translations, name: (place[0], place[1], place[2])})
    else:
        turn = pose.rotations.get(name, (0.0, 0.0, 0.0, 1.0))
        lean, twist = _lean(turn, dof), float(twist_angle(turn, dof.axis))
        if axis.part == "twist":
            twist = float(value)
        else:
            lean[0 if axis.part == "lean" else 1] = value
        x, y, z, w = map(float, _turns(lean[None], np.array([twist]), dof)[0])
        changed = pose.replace(rotations={**pose.rotations, name: (x, y, z, w)})
    return changed


def at(axes: tuple[Axis, Axis], pose: Pose, place: Sequence[float]) -> Pose:
    """The pose at a place of the plane of two axes; what neither of them is about stays."""
    return with_coordinate(axes[1], with_coordinate(axes[0], pose, place[0]), place[1])


def places(axes: tuple[Axis, Axis], poses: Sequence[Pose]) -> Array:
    """Where poses (N) lie in the plane, (N, 2)."""
    return np.array([[coordinate(axis, pose) for axis in axes] for pose in poses], np.float64).reshape(-1, 2)


def embed_plane(dofs: Sequence[Dof], axes: tuple[Axis, Axis], pose: Pose, plane: Array) -> Array:
    """As ``embed`` of :func:`at` for places (N, 2) of the plane at once: coordinates (N, D) before falloffs."""
    out = np.repeat(embed(dofs, [pose]), len(plane), axis=0)
    column = 0
    for dof in dofs:
        mine = [(axis, plane[:, i]) for i, axis in enumerate(axes)
                if axis.dof.control == dof.control and (axis.part in "xyz") == (dof.kind == "translation")]
        width = WIDTHS[dof.kind]
        block = out[:, column : column + width]
        for axis, values in mine:
            if dof.kind == "translation":
                block[:, "xyz".index(axis.part)] = values
            elif dof.kind == "number":
                block[:, 0] = values
        if mine and dof.kind not in ("translation", "number"):
            about = mine[0][0].dof
            turn = pose.rotations.get(dof.control, (0.0, 0.0, 0.0, 1.0))
            lean = np.repeat(_lean(turn, about)[None], len(plane), axis=0)
            twist = np.full(len(plane), float(twist_angle(turn, about.axis)))
            for axis, values in mine:
                if axis.part == "twist":
                    twist = values
                else:
                    lean[:, 0 if axis.part == "lean" else 1] = values
            turns = _turns(lean, twist, about)
            frame = np.array([[dof.axis, dof.side, np.cross(dof.axis, dof.side)]])
            block[:] = swung_and_twisted(turns[:, None], frame)[:, 0, READ[dof.kind]]
        column += width
    return np.asarray(out, np.float64)


def falloff_ring(space: PoseSpace, sample: int | None, axes: tuple[Axis, Axis], points: int = 120) -> Array:
    """The rim (points, 2) in the plane of two axes where a pose is just one falloff away from a sample of the space.

    With a number on each axis an ellipse whose half axes are the falloffs. A direction in which the pose is felt
    everywhere ends at four falloffs.

    Parameters
    ----------
    sample : its place among the samples; None for rest.
    """
    pose = REST if sample is None else space.samples[sample].pose
    own = space.rest_falloffs if sample is None else space.samples[sample].falloffs
    size, middle = scales(space.dofs, own), places(axes, [pose])[0]
    here = embed(space.dofs, [pose])[0]
    angles = np.linspace(0.0, 2.0 * np.pi, points, endpoint=False)
    reach = [own.get(axis.dof.control, axis.dof.falloff)[0] for axis in axes]
    rays = np.stack([np.cos(angles) * reach[0], np.sin(angles) * reach[1]], axis=1)
    low, high = np.zeros(points), np.full(points, REACH)
    for _ in range(HALVINGS):
        half = 0.5 * (low + high)
        there = embed_plane(space.dofs, axes, pose, middle + half[:, None] * rays)
        inside = np.linalg.norm((there - here) * size, axis=1) < 1.0
        low, high = np.where(inside, half, low), np.where(inside, high, half)
    rim: Array = middle + (0.5 * (low + high))[:, None] * rays
    return rim


def weight_grid(space: PoseSpace, axes: tuple[Axis, Axis], pose: Pose, xs: Array, ys: Array) -> NDArray[np.float32]:
    """Weights (len(ys), len(xs), M) float32 of the samples over the plane through a pose.

    Raises
    ------
    Refusal
        Naming poses that cannot be told apart.
    """
    solved = solve(space)
    plane = np.stack(np.meshgrid(xs, ys), axis=2).reshape(-1, 2)
    found = weights_at(solved, embed_plane(space.dofs, axes, pose, plane))[:, solved.silent :]
    return np.ascontiguousarray(found.reshape(len(ys), len(xs), -1), np.float32)


def scaling(distances: Array, dimensions: int = 2) -> Array:
    """Points (N, dimensions) whose distances are near those given (N, N): classical multidimensional scaling.

    Exact where such points exist (Torgerson 1952). The first point's signs are fixed, so that a map does not flip.
    """
    count = len(distances)
    centring = np.eye(count) - 1.0 / max(count, 1)
    values, vectors = np.linalg.eigh(-0.5 * centring @ (distances**2) @ centring)
    order = np.argsort(values)[::-1][:dimensions]
    found = np.zeros((count, dimensions))
    found[:, : len(order)] = vectors[:, order] * np.sqrt(np.maximum(values[order], 0.0))
    signs = np.sign(found[np.argmax(np.abs(found), axis=0), np.arange(dimensions)])
    return np.asarray(found * np.where(signs == 0.0, 1.0, signs), np.float64)


def spread_out(space: PoseSpace) -> Array:
    """Rest and all samples (1 + M, 2) in a plane by their distances in falloffs, rest in the origin."""
    spots = embed(space.dofs, [REST, *(s.pose for s in space.samples)]) * scales(space.dofs)
    found = scaling(np.linalg.norm(spots[:, None] - spots[None], axis=2))
    return np.asarray(found - found[0], np.float64)


def placed_among(space: PoseSpace, spread: Array, pose: Pose) -> Array:
    """Where a pose lies (2,) on the map of :func:`spread_out`, by its distances to rest and samples (Gower 1968)."""
    size = scales(space.dofs)
    spots = embed(space.dofs, [REST, *(s.pose for s in space.samples)]) * size
    middle = spread.mean(axis=0)
    flat = spread - middle
    squared = np.sum((spots - embed(space.dofs, [pose])[0] * size) ** 2, axis=1)
    among = np.sum((spots[:, None] - spots[None]) ** 2, axis=2)
    found = -0.5 * np.linalg.pinv(flat) @ (squared - among.mean(axis=1))
    return np.asarray(found + middle, np.float64)


def mixed_pose(poses: Sequence[Pose], shares: Array, name: str = "pose") -> Pose:
    """One pose of several, by shares (N,) that sum to 1; rotations one after the other along the shortest way."""
    turned = sorted({j for pose in poses for j in pose.rotations})
    slid = sorted({j for pose in poses for j in pose.translations})
    dialled = sorted({n for pose in poses for n in pose.numbers})
    rotations: dict[str, Quaternion] = {}
    for joint in turned:
        turn, total = np.array([0.0, 0.0, 0.0, 1.0]), 0.0
        for pose, share in zip(poses, shares, strict=True):
            total += float(share)
            if total > 0.0:
                other = np.array(pose.rotations.get(joint, (0.0, 0.0, 0.0, 1.0)))
                turn = slerp(turn, other, np.float64(share / total))
        x, y, z, w = map(float, turn)
        rotations[joint] = (x, y, z, w)
    moved = {j: _mean([pose.translations.get(j, (0.0, 0.0, 0.0)) for pose in poses], shares) for j in slid}
    numbers = {
        n: float(np.dot([pose.numbers.get(n, 0.0) for pose in poses], shares)) for n in dialled
    }
    return Pose(name=name, rotations=rotations, translations=moved, numbers=numbers)


def shares_near(spread: Array, place: Sequence[float]) -> Array:
    """Shares (N,) of the points of a map at a place, by inverse squares of the distance; one alone at that point."""
    squared = np.sum((spread - np.asarray(place, np.float64)) ** 2, axis=1)
    if squared.min() < 1e-12:
        return np.asarray(np.arange(len(spread)) == squared.argmin(), np.float64)
    return np.asarray((1.0 / squared) / np.sum(1.0 / squared), np.float64)


def solvable(space: PoseSpace) -> Refusal | None:
    """Why a space cannot be solved, or None."""
    try:
        solve(space)
    except Refusal as refusal:
        return refusal
    return None


def _lean(turn: Quaternion, dof: Dof) -> Array:
    """How far the axis leans towards the side and across, (2,), radians."""
    side, across = np.array(dof.side), np.cross(dof.axis, dof.side)
    to = rotated_axis(turn, dof.axis)
    u, v, along = float(to @ side), float(to @ across), float(to @ np.array(dof.axis))
    length = float(np.hypot(u, v))
    if length < 1e-12:
        return np.array([0.0 if along > 0.0 else np.pi, 0.0])
    angle = float(np.arctan2(length, along))
    return np.array([u, v]) * (angle / length)


def _turns(lean: Array, twist: Array, dof: Dof) -> Array:
    """Quaternions (N, 4) of leans (N, 2) after twists (N,)."""
    side, across = np.array(dof.side), np.cross(dof.axis, dof.side)
    angle = np.hypot(lean[:, 0], lean[:, 1])
    # the axis is carried towards u side + v across by a turn about what is square to both
    hinge = np.where(angle[:, None] > 1e-12, lean[:, :1] * across - lean[:, 1:] * side, across)
    swing = quaternion_about(hinge, angle)
    return quaternion_product(swing, quaternion_about(np.array(dof.axis)[None], twist))


def _mean(values: Sequence[Sequence[float]], shares: Array) -> tuple[float, float, float]:
    x, y, z = map(float, np.asarray(shares) @ np.array(values))
    return x, y, z
