"""The animal of the demo: a small kit with large ears and a brush, looking along +z, half a metre long."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from core.demo.atlas import atlas
from core.demo.cage import Cage
from core.mesh.mesh import Mesh
from core.mesh.subdivision import subdivide
from core.transform import normalized

Array = NDArray[np.float64]

PARTS = ("body", "head", "ears", "legs", "tail", "nose", "eyes", "pads")

# y, z, pitch in degrees, half width, half height above and below, joint weights; from the tip of the tail to the nose
TAIL = [
    (0.375, -0.350, -104, 0.012, 0.012, 0.012, {"tail3": 1.0}),
    (0.348, -0.356, -96, 0.020, 0.020, 0.020, {"tail3": 1.0}),
    (0.311, -0.355, -80, 0.025, 0.025, 0.025, {"tail3": 0.75, "tail2": 0.25}),
    (0.276, -0.343, -62, 0.026, 0.026, 0.026, {"tail3": 0.3, "tail2": 0.7}),
    (0.247, -0.318, -44, 0.025, 0.025, 0.025, {"tail2": 1.0}),
    (0.225, -0.283, -26, 0.022, 0.022, 0.022, {"tail2": 0.6, "tail1": 0.4}),
    (0.211, -0.240, -13, 0.020, 0.020, 0.020, {"tail2": 0.15, "tail1": 0.85}),
    (0.204, -0.196, -9, 0.019, 0.019, 0.020, {"tail1": 0.7, "hips": 0.3}),
]
BODY = [
    (0.193, -0.160, -12, 0.033, 0.026, 0.040, {"tail1": 0.25, "hips": 0.75}),
    (0.181, -0.133, -8, 0.053, 0.044, 0.058, {"hips": 1.0}),
    (0.176, -0.101, -3, 0.064, 0.055, 0.064, {"hips": 1.0}),
    (0.176, -0.048, 0, 0.064, 0.056, 0.056, {"hips": 0.8, "spine": 0.2}),
    (0.177, 0.000, 0, 0.058, 0.052, 0.054, {"hips": 0.25, "spine": 0.75}),
    (0.177, 0.038, 3, 0.057, 0.051, 0.060, {"spine": 0.6, "chest": 0.4}),
    (0.179, 0.072, 8, 0.058, 0.054, 0.070, {"chest": 1.0}),
    (0.187, 0.112, 24, 0.054, 0.052, 0.066, {"chest": 0.9, "neck": 0.1}),
    (0.210, 0.134, 44, 0.044, 0.044, 0.054, {"chest": 0.35, "neck": 0.65}),
]
HEAD = [
    (0.239, 0.148, 46, 0.040, 0.040, 0.043, {"neck": 0.75, "head": 0.25}),
    (0.268, 0.160, 30, 0.050, 0.044, 0.045, {"neck": 0.2, "head": 0.8}),
    (0.286, 0.183, 12, 0.064, 0.053, 0.051, {"head": 1.0}),
    (0.289, 0.212, 2, 0.071, 0.056, 0.054, {"head": 1.0}),
    (0.285, 0.238, -6, 0.066, 0.050, 0.050, {"head": 1.0}),
    (0.275, 0.268, -10, 0.047, 0.036, 0.039, {"head": 1.0}),
    (0.266, 0.287, -6, 0.031, 0.023, 0.028, {"head": 1.0}),
    (0.263, 0.304, -4, 0.022, 0.017, 0.020, {"head": 1.0}),
    (0.263, 0.315, 0, 0.014, 0.012, 0.012, {"head": 1.0}),
]
NOSE = (0.264, 0.322, 0, 0.009, 0.009, 0.008, {"head": 1.0})

# x, y, z of the middle, half width, half length, how much lower the front lies than the back
FRONT_LEG = [
    (0.035, 0.094, 0.092, 0.021, 0.025, 0.000),
    (0.034, 0.068, 0.089, 0.0165, 0.0185, 0.000),
    (0.033, 0.042, 0.088, 0.0145, 0.0155, 0.000),
    (0.033, 0.027, 0.091, 0.017, 0.019, 0.002),
    (0.033, 0.015, 0.099, 0.0235, 0.030, 0.006),
    (0.033, 0.001, 0.101, 0.0225, 0.030, 0.000),
]
HIND_LEG = [
    (0.041, 0.098, -0.070, 0.025, 0.034, 0.006),
    (0.039, 0.073, -0.080, 0.019, 0.023, 0.006),
    (0.037, 0.049, -0.096, 0.0140, 0.0155, 0.000),
    (0.036, 0.029, -0.097, 0.0155, 0.018, 0.000),
    (0.036, 0.015, -0.087, 0.0235, 0.033, 0.006),
    (0.036, 0.001, -0.085, 0.0225, 0.033, 0.000),
]


class Shape(NamedTuple):
    """The modelled animal.

    mesh : quads, closed, symmetric across x = 0 to the bit, with UVs and PARTS; metres, y up.
    joints : names.
    weights : (V, J) float64, how much each joint moves each vertex, rows summing to 1, symmetric.
    pairs : (V,) int64, the opposite of each vertex (itself on x = 0).
    """

    mesh: Mesh
    joints: tuple[str, ...]
    weights: Array
    pairs: NDArray[np.int64]


def shape(levels: int = 2) -> Shape:
    """Model the animal: a cage of 512 quads, refined `levels` times (2 gives 8,192). Always the same to the bit."""
    cage = _cage()
    faces = cage.faces
    coarse = Mesh(
        points=np.array(cage.points, np.float32),
        counts=np.full(len(faces), 4, np.int32),
        corners=np.array([face.vertices for face in faces], np.int32).reshape(-1),
        uvs=atlas(faces).reshape(-1, 2).astype(np.float32),
        parts=np.array([PARTS.index(face.part) for face in faces], np.int32),
        part_names=PARTS,
    )
    joints = tuple(sorted({name for weights in cage.weights for name in weights}))
    mesh, stencils = subdivide(coarse, levels)
    points = mesh.points.copy()
    pairs = opposites(points)
    left = points[:, 0] > 0.0
    points[pairs[left]] = points[left] * np.array([-1.0, 1.0, 1.0], np.float32)
    points[pairs == np.arange(len(pairs)), 0] = 0.0
    weights = stencils @ np.array([[w.get(name, 0.0) for name in joints] for w in cage.weights])
    return Shape(mesh.replace(points=points), joints, 0.5 * (weights + weights[pairs]), pairs)


def opposites(points: NDArray[np.float32]) -> NDArray[np.int64]:
    """For each point (V, 3) of a shape symmetric across x = 0 but for rounding, its opposite (itself on x = 0)."""
    pairs = cKDTree(points).query(points * np.array([-1.0, 1.0, 1.0], np.float32))[1]
    assert np.array_equal(pairs[pairs], np.arange(len(points)))
    return np.asarray(pairs, np.int64)


def _cage() -> Cage:
    cage = Cage()
    tail = [cage.ring(*row) for row in TAIL]
    body = [cage.ring(*row) for row in BODY]
    head = [cage.ring(*row) for row in HEAD]
    nose = cage.ring(*NOSE)
    cage.cap(tail[0][:1] + tail[0][:0:-1], (0.0, 0.387, -0.346), {"tail3": 1.0}, "tail", "tail tip")
    cage.loft([*tail, body[0]], "tail", "tail")
    hips, shoulders = 2, 6  # the rows the legs grow from
    cage.loft([*body, head[0]], "body", "body", frozenset({(hips, 4), (shoulders, 4)}))
    ears, eyes = 2, 4
    uvs = cage.loft(head, "head", "head", frozenset({(ears, 1), (ears, 2), (eyes, 2)}))
    cage.loft([head[-1], nose], "nose", "nose")
    cage.cap(nose, (0.0, 0.264, 0.325), {"head": 1.0}, "nose", "nose tip")
    for name, rows, row, joint in (("front leg", FRONT_LEG, shoulders, "chest"), ("hind leg", HIND_LEG, hips, "hips")):
        a, b = body[row], body[row + 1]
        loops = [_box(*section) for section in rows]
        last = cage.limb([a[4], b[4], b[5], a[5]], loops, [{joint: 1.0}] * len(loops), ["legs"] * len(loops), name)
        flat = np.array([cage.points[i][[0, 2]] for i in last])
        cage.both((last[0], last[1], last[2], last[3]), "pads", f"{name} pad", flat * (-1.0, 1.0))
    _ear(cage, head[ears], head[ears + 1])
    a, b = head[eyes], head[eyes + 1]
    cage.inset(
        [a[2], b[2], b[3], a[3]], [(0.10, 0.001), (0.20, -0.001), (0.29, 0.001), (0.64, 0.005)], {"head": 1.0},
        ["head", "head", "eyes", "eyes", "eyes"], "head", uvs[eyes, 2], uvs[eyes, 9][[3, 2, 1, 0]],
    )
    return cage


def _box(x: float, y: float, z: float, width: float, length: float, drop: float) -> Array:
    """A section of a leg: outer back, outer front, inner front, inner back."""
    return np.array([
        (x + width, y + drop, z - length), (x + width, y - drop, z + length),
        (x - width, y - drop, z + length), (x - width, y + drop, z - length),
    ])


def _ear(cage: Cage, rear: list[int], front: list[int]) -> None:
    """A cupped ear from the two quads between points 1, 2 and 3 of two rings."""
    base = [rear[1], front[1], front[2], front[3], rear[3], rear[2]]
    foot = np.mean([cage.points[i] for i in base], axis=0)
    axis = normalized(np.array([0.42, 1.0, -0.08]))
    facing = np.array([0.30, 0.0, 1.0])
    facing = normalized(facing - axis * (facing @ axis))
    side = np.cross(axis, facing)
    sections = []
    for height, width, thick, cup in (
        (0.018, 0.031, 0.014, 0.004), (0.042, 0.034, 0.010, 0.010), (0.068, 0.027, 0.008, 0.009),
        (0.092, 0.015, 0.006, 0.005), (0.106, 0.005, 0.004, 0.001),
    ):
        middle = foot + axis * height
        rim_front, rim_rear = facing * 0.5 * thick, -facing * 0.5 * thick
        sections.append(middle + np.array([
            rim_rear - side * width, rim_front - side * width, -facing * cup,
            rim_front + side * width, rim_rear + side * width, -facing * (cup + thick),
        ]))
    last = cage.limb(base, sections, [{"head": 1.0}] * len(sections), ["ears"] * len(sections), "ear")
    flat = np.array([[(cage.points[i] - foot) @ side, -(cage.points[i] - foot) @ facing] for i in last])
    for quad in ([0, 1, 2, 5], [5, 2, 3, 4]):
        v = [last[i] for i in quad]
        cage.both((v[0], v[1], v[2], v[3]), "ears", "ear tip", flat[quad])
