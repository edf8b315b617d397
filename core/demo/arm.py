"""The arm of the demo: modelled in code, with a skeleton of five joints and weights as a rigger would paint them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from core.demo.atlas import atlas
from core.demo.cage import Face
from core.mesh.mesh import Mesh
from core.mesh.subdivision import subdivide
from core.pose.rig import Rig
from core.pose.skeleton import Skeleton, SkinWeights
from core.transform import normalized, translation

Array = NDArray[np.float64]
Weights = dict[str, float]

PARTS = ("shoulder", "upper arm", "forearm", "hand")
# name, parent, place in object space, metres; the arm reaches to +x, its biceps is up, its palm faces +z
JOINTS = [
    ("chest", -1, (-0.16, 0.0, 0.0)),
    ("shoulder", 0, (0.0, 0.0, 0.0)),
    ("elbow", 1, (0.290, -0.006, 0.0)),
    ("wrist", 2, (0.545, 0.0, 0.0)),
    ("fingers", 3, (0.640, 0.0, 0.004)),
]
# x, y and z of the middle, half height above and below, half depth to the front and the back, part, weights
RINGS: list[tuple[float, float, float, float, float, float, float, str, Weights]] = [
    (-0.160, -0.085, -0.004, 0.150, 0.170, 0.098, 0.090, "shoulder", {"chest": 1.0}),
    (-0.148, -0.083, -0.004, 0.158, 0.178, 0.106, 0.097, "shoulder", {"chest": 1.0}),
    (-0.110, -0.070, -0.004, 0.148, 0.165, 0.103, 0.094, "shoulder", {"chest": 1.0}),
    (-0.072, -0.048, -0.004, 0.128, 0.136, 0.094, 0.086, "shoulder", {"chest": 0.95, "shoulder": 0.05}),
    (-0.038, -0.024, -0.003, 0.105, 0.102, 0.083, 0.077, "shoulder", {"chest": 0.72, "shoulder": 0.28}),
    (-0.006, -0.008, -0.002, 0.086, 0.080, 0.074, 0.070, "shoulder", {"chest": 0.42, "shoulder": 0.58}),
    (0.030, -0.002, -0.001, 0.076, 0.067, 0.068, 0.065, "shoulder", {"chest": 0.16, "shoulder": 0.84}),
    (0.070, 0.000, 0.000, 0.066, 0.060, 0.060, 0.059, "upper arm", {"chest": 0.03, "shoulder": 0.97}),
    (0.115, 0.001, 0.000, 0.057, 0.056, 0.052, 0.053, "upper arm", {"shoulder": 1.0}),
    (0.160, 0.002, 0.001, 0.056, 0.053, 0.050, 0.050, "upper arm", {"shoulder": 1.0}),
    (0.200, 0.001, 0.001, 0.053, 0.048, 0.048, 0.047, "upper arm", {"shoulder": 0.97, "elbow": 0.03}),
    (0.235, -0.001, 0.001, 0.046, 0.044, 0.046, 0.045, "upper arm", {"shoulder": 0.86, "elbow": 0.14}),
    (0.263, -0.003, 0.000, 0.041, 0.043, 0.045, 0.045, "upper arm", {"shoulder": 0.68, "elbow": 0.32}),
    (0.288, -0.004, 0.000, 0.040, 0.044, 0.046, 0.046, "upper arm", {"shoulder": 0.49, "elbow": 0.51}),
    (0.313, -0.003, 0.001, 0.042, 0.042, 0.047, 0.046, "forearm", {"shoulder": 0.31, "elbow": 0.67, "wrist": 0.02}),
    (0.340, -0.001, 0.002, 0.045, 0.041, 0.048, 0.045, "forearm", {"shoulder": 0.13, "elbow": 0.80, "wrist": 0.07}),
    (0.372, 0.000, 0.002, 0.045, 0.040, 0.046, 0.043, "forearm", {"shoulder": 0.02, "elbow": 0.80, "wrist": 0.18}),
    (0.408, 0.000, 0.002, 0.041, 0.037, 0.042, 0.039, "forearm", {"elbow": 0.67, "wrist": 0.33}),
    (0.445, 0.000, 0.001, 0.036, 0.033, 0.036, 0.034, "forearm", {"elbow": 0.50, "wrist": 0.50}),
    (0.480, 0.000, 0.000, 0.031, 0.029, 0.029, 0.028, "forearm", {"elbow": 0.33, "wrist": 0.67}),
    (0.513, 0.000, 0.000, 0.028, 0.026, 0.023, 0.023, "forearm", {"elbow": 0.15, "wrist": 0.85}),
    (0.540, 0.000, 0.000, 0.028, 0.026, 0.021, 0.021, "hand", {"elbow": 0.03, "wrist": 0.97}),
    (0.566, 0.001, 0.001, 0.034, 0.032, 0.021, 0.020, "hand", {"wrist": 1.0}),
    (0.594, 0.000, 0.002, 0.040, 0.039, 0.020, 0.018, "hand", {"wrist": 1.0}),
    (0.626, -0.001, 0.003, 0.042, 0.041, 0.017, 0.015, "hand", {"wrist": 0.7, "fingers": 0.3}),
    (0.648, -0.001, 0.004, 0.041, 0.040, 0.014, 0.012, "hand", {"wrist": 0.35, "fingers": 0.65}),
]
HAND = 21  # the row of RINGS from which on they are flat
THUMB = 22  # the row the thumb grows from
# corners of the last ring, length in metres, how far it fans out upward
FINGERS = [
    ((11, 0, 1, 9, 10), 0.076, 0.10), ((1, 2, 8, 9), 0.086, 0.02), ((2, 3, 7, 8), 0.080, -0.05),
    ((3, 4, 5, 6, 7), 0.062, -0.14),
]
ANGLES = np.radians(60.0 - 30.0 * np.arange(12))  # of the points of a ring: five to the front, one below, five behind
FLAT = np.array([0.84, 0.44, 0.0, -0.44, -0.84, -1.0, -0.84, -0.44, 0.0, 0.44, 0.84, 1.0])  # heights in a flat ring


class Arm(NamedTuple):
    """Mesh at rest and rig."""

    mesh: Mesh
    rig: Rig


class _Cage:
    """Points, weights and faces in the making."""

    def __init__(self) -> None:
        self.points: list[Array] = []
        self.weights: list[Weights] = []
        self.faces: list[Face] = []

    def add(self, points: ArrayLike, weights: Weights) -> list[int]:
        rows = np.asarray(points, np.float64)
        first = len(self.points)
        self.points += list(rows)
        self.weights += [weights] * len(rows)
        return list(range(first, first + len(rows)))

    def tube(
        self, loops: list[list[int]], parts: list[str], island: str, skip: tuple[tuple[int, int], ...] = ()
    ) -> None:
        """Quads between loops that run counter-clockwise seen from the far end, cut open where they begin."""
        around = np.array([[self.points[i] for i in [*loop, loop[0]]] for loop in loops])
        u = np.cumsum(np.linalg.norm(np.diff(around, axis=1), axis=2), axis=1)
        u = np.concatenate([np.zeros((len(u), 1)), u], axis=1) - 0.5 * u[:, -1:]
        v = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(around, axis=0), axis=2).mean(axis=1)))
        for row in range(len(loops) - 1):
            a, b = loops[row], loops[row + 1]
            for k in range(len(a)):
                n = (k + 1) % len(a)
                uvs = np.array([(u[row, k], v[row]), (u[row, k + 1], v[row]),
                                (u[row + 1, k + 1], v[row + 1]), (u[row + 1, k], v[row + 1])])
                if (row, k) not in skip:
                    self.faces.append(Face((a[k], a[n], b[n], b[k]), parts[row], island, uvs * (-1.0, 1.0)))

    def cap(self, loop: list[int], part: str, island: str) -> None:
        """Close a loop, seen counter-clockwise, with quads about its middle."""
        corners = np.array([self.points[i] for i in loop])
        share = {j: float(np.mean([self.weights[i].get(j, 0.0) for i in loop])) for j, _, _ in JOINTS}
        bulge = normalized(np.cross(corners[1] - corners[0], corners[-1] - corners[0])) * 0.15
        size = float(np.linalg.norm(corners - corners.mean(axis=0), axis=1).mean())
        middle = self.add([corners.mean(axis=0) + bulge * size], share)[0]
        frame = np.linalg.svd(corners - corners.mean(axis=0))[2][:2]
        if np.linalg.det(np.stack([*frame, bulge])) < 0.0:
            frame[1] *= -1.0
        flat = {i: frame @ (self.points[i] - corners.mean(axis=0)) for i in [middle, *loop]}
        count = len(loop)
        fan = [loop[k : k + 3] if k + 2 < count else [*loop[k:], *loop[: k + 3 - count]] for k in range(0, count, 2)]
        for run in fan[: count // 2]:
            quad = (middle, *run)
            self.faces.append(Face(quad, part, island, np.array([flat[i] for i in quad])))  # type: ignore[arg-type]
        if count % 2:
            last = (middle, loop[-1], loop[0])
            self.faces.append(Face(last, part, island, np.array([flat[i] for i in last])))  # type: ignore[arg-type]


def arm(levels: int = 2) -> Arm:
    """Model the arm, always the same: about 6,000 quads, closed, metres, y up, reaching to +x."""
    cage = _Cage()
    loops = [cage.add(_ring(row), RINGS[row][-1]) for row in range(len(RINGS))]
    hole = ((THUMB, 10), (THUMB, 11))
    cage.tube(loops, [ring[-2] for ring in RINGS], "arm", hole)
    cage.cap(loops[0][::-1], "shoulder", "cut")
    for number, (corners, length, fan) in enumerate(FINGERS):
        _finger(cage, [loops[-1][k] for k in corners], length, fan, f"finger {number}")
    _thumb(cage, loops[THUMB], loops[THUMB + 1])
    names = tuple(name for name, _, _ in JOINTS)
    counts = np.array([len(face.vertices) for face in cage.faces], np.int32)
    coarse = Mesh(
        points=np.array(cage.points, np.float32), counts=counts,
        corners=np.concatenate([face.vertices for face in cage.faces]).astype(np.int32),
        uvs=_uvs(cage.faces), parts=np.array([PARTS.index(face.part) for face in cage.faces], np.int32),
        part_names=PARTS,
    )
    mesh, stencils = subdivide(coarse, levels)
    return Arm(mesh, Rig(
        skeleton=skeleton_at([place for _, _, place in JOINTS], names, [parent for _, parent, _ in JOINTS]),
        skin=strongest(stencils @ np.array([[w.get(name, 0.0) for name in names] for w in cage.weights])),
    ))


def skeleton_at(places: ArrayLike, names: tuple[str, ...], parents: list[int]) -> Skeleton:
    """Joints at places (J, 3) in object space, all aligned with its axes."""
    at = np.asarray(places, np.float64)
    offsets = at - np.where(np.array(parents)[:, None] >= 0, at[parents], 0.0)
    return Skeleton(
        names=names, parents=np.array(parents, np.int32), rest=np.stack([translation(o) for o in offsets]),
        bind=np.stack([translation(p) for p in at]),
    )


def strongest(weights: Array, influences: int = 4) -> SkinWeights:
    """Skin weights of the strongest joints of each vertex, from all (V, J)."""
    joints = np.argsort(-weights, axis=1, kind="stable")[:, :influences]
    kept = np.take_along_axis(weights, joints, axis=1)
    return SkinWeights(
        joints=joints.astype(np.int32), weights=(kept / kept.sum(axis=1, keepdims=True)).astype(np.float32)
    )


def _uvs(faces: list[Face]) -> NDArray[np.float32]:
    """UVs of all corners; a triangle is laid out as a quad whose last corner is there twice."""
    four = [f if len(f.vertices) == 4 else f._replace(uvs=np.concatenate([f.uvs, f.uvs[-1:]])) for f in faces]
    laid = atlas(four)
    return np.concatenate([uv[: len(f.vertices)] for uv, f in zip(laid, faces, strict=True)]).astype(np.float32)


def _ring(row: int) -> Array:
    x, y, z, above, below, front, back = RINGS[row][:7]
    up, ahead = np.sin(ANGLES), np.cos(ANGLES)
    flat = min(max((row - HAND + 1) / 3.0, 0.0), 1.0)
    up = (1.0 - flat) * up + flat * FLAT
    ahead = (1.0 - flat) * ahead + flat * np.sign(np.round(ahead, 9))
    return np.stack([
        np.full(12, x), y + up * np.where(up > 0.0, above, below), z + ahead * np.where(ahead > 0.0, front, back),
    ], axis=1)


def _finger(cage: _Cage, base: list[int], length: float, fan: float, island: str) -> None:
    rim = np.array([cage.points[i] for i in base])
    middle = rim.mean(axis=0)
    loops, place, direction = [base], middle.copy(), normalized(np.array([1.0, fan, 0.0]))
    for step, size, curl in ((0.10, 1.02, 0.0), (0.32, 1.02, 6.0), (0.30, 0.95, 18.0), (0.22, 0.84, 18.0),
                             (0.06, 0.46, 6.0)):
        c, s = np.cos(np.radians(curl)), np.sin(np.radians(curl))
        direction = np.array([c * direction[0] - s * direction[2], direction[1], s * direction[0] + c * direction[2]])
        place = place + step * length * direction
        turned = np.radians(90.0) - np.arctan2(direction[0], direction[2])
        spread = (rim - middle) * size
        spread = np.stack([
            spread[:, 0] - np.sin(turned) * spread[:, 2], spread[:, 1], np.cos(turned) * spread[:, 2]
        ], axis=1)
        loops.append(cage.add(place + spread, {"fingers": 1.0}))
    cage.tube(loops, ["hand"] * 5, island)
    cage.cap(loops[-1], "hand", island + " tip")


def _thumb(cage: _Cage, near: list[int], far: list[int]) -> None:
    base = [near[10], near[11], near[0], far[0], far[11], far[10]]
    middle = np.mean([cage.points[i] for i in base], axis=0)
    loops = [base]
    place, direction = middle, normalized(np.array([0.50, 0.80, 0.30]))
    ends = np.array([(-1.0, -0.8), (-1.05, 0.0), (-1.0, 0.8), (1.0, 0.8), (1.05, 0.0), (1.0, -0.8)])
    for step, width, turn in ((0.012, 0.0175, 0.0), (0.022, 0.0148, 0.25), (0.020, 0.0140, 0.30), (0.017, 0.0125, 0.3),
                              (0.006, 0.0070, 0.0)):
        direction = normalized(direction + np.array([turn, 0.0, 0.0]))
        place = place + step * direction
        side = normalized(np.cross(direction, np.array([0.0, 0.0, 1.0])))
        ahead = np.cross(side, direction)
        section = place + width * (ends[:, :1] * side + ends[:, 1:] * ahead)
        loops.append(cage.add(section, {"wrist": 1.0}))
    cage.tube(loops, ["hand"] * 5, "thumb")
    cage.cap(loops[-1], "hand", "thumb tip")
