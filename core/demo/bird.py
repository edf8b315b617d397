"""The bird of the demo: a finch thirteen centimetres long, wings held open, looking along +z."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.demo.atlas import atlas
from core.demo.bird_rig import BODY_AXES, bird_rig
from core.demo.cage import Cage
from core.demo.shape import Shape, opposites
from core.mesh.mesh import Mesh
from core.mesh.subdivision import subdivide
from core.pose.rig import Rig
from core.transform import normalized

Array = NDArray[np.float64]

PARTS = ("body", "head", "wings", "legs", "beak", "eyes", "feet")

# y, z, pitch in degrees, half width, half height above and below, joint weights; from the tail to the beak
BODY = [
    (0.0345, -0.0535, 26, 0.0042, 0.0030, 0.0036, {"tail": 1.0}),
    (0.0378, -0.0465, 28, 0.0068, 0.0050, 0.0062, {"tail": 0.8, "hips": 0.2}),
    (0.0420, -0.0385, 31, 0.0108, 0.0085, 0.0102, {"tail": 0.25, "hips": 0.75}),
    (0.0465, -0.0290, 34, 0.0152, 0.0120, 0.0142, {"hips": 1.0}),
    (0.0515, -0.0185, 36, 0.0180, 0.0148, 0.0176, {"hips": 0.9, "chest": 0.1}),
    (0.0570, -0.0080, 38, 0.0190, 0.0162, 0.0194, {"hips": 0.4, "chest": 0.6}),
    (0.0625, 0.0020, 40, 0.0187, 0.0163, 0.0196, {"chest": 1.0}),
    (0.0680, 0.0105, 43, 0.0172, 0.0148, 0.0184, {"chest": 1.0}),
    (0.0735, 0.0172, 48, 0.0150, 0.0130, 0.0157, {"chest": 0.7, "neck": 0.3}),
    (0.0785, 0.0222, 52, 0.0127, 0.0114, 0.0126, {"chest": 0.2, "neck": 0.8}),
]
HEAD = [
    (0.0832, 0.0262, 48, 0.0117, 0.0106, 0.0110, {"neck": 0.6, "head": 0.4}),
    (0.0876, 0.0302, 35, 0.0121, 0.0110, 0.0111, {"neck": 0.1, "head": 0.9}),
    (0.0908, 0.0350, 20, 0.0119, 0.0107, 0.0108, {"head": 1.0}),
    (0.0922, 0.0397, 8, 0.0103, 0.0092, 0.0095, {"head": 1.0}),
    (0.0923, 0.0437, 0, 0.0078, 0.0070, 0.0074, {"head": 1.0}),
    (0.0918, 0.0468, -4, 0.0055, 0.0052, 0.0054, {"head": 1.0}),
]
BEAK = [
    (0.0916, 0.0478, -6, 0.0047, 0.0047, 0.0049, {"head": 1.0}),
    (0.0911, 0.0508, -8, 0.0036, 0.0036, 0.0039, {"head": 1.0}),
    (0.0904, 0.0540, -10, 0.0018, 0.0017, 0.0020, {"head": 1.0}),
]
BEAK_TIP = (0.0, 0.0899, 0.0568)

# x, y, z of the middle, half width, half length, part
LEG = [
    (0.0085, 0.0350, -0.0125, 0.0044, 0.0062, "body"),
    (0.0088, 0.0270, -0.0105, 0.0027, 0.0036, "legs"),
    (0.0088, 0.0195, -0.0088, 0.0013, 0.0015, "legs"),
    (0.0088, 0.0080, -0.0065, 0.0010, 0.0011, "feet"),
    (0.0088, 0.0034, -0.0040, 0.0015, 0.0030, "feet"),
    (0.0088, 0.0012, 0.0000, 0.0030, 0.0090, "feet"),
    (0.0088, 0.0000, 0.0000, 0.0030, 0.0090, "feet"),
]

SHOULDER = np.array([0.0170, 0.0684, 0.0036])
# along out, forward, up from the shoulder in millimetres; the leading edge's direction; half chord; half thickness
WING = [
    (3.0, -1.8, 0.3, (0.4, 1.0), 4.0, 2.5, {"humerus": 0.6, "chest": 0.4}),
    (7.5, -5.0, 0.6, (0.5, 1.0), 3.2, 2.0, {"humerus": 1.0}),
    (13.2, -9.1, 1.0, (0.0, 1.0), 2.6, 1.6, {"humerus": 0.5, "forearm": 0.5}),
    (18.5, -5.6, 1.0, (-0.45, 1.0), 2.5, 1.5, {"forearm": 1.0}),
    (24.0, -1.9, 1.0, (-0.45, 1.0), 2.3, 1.4, {"forearm": 1.0}),
    (29.4, 1.7, 1.0, (0.0, 1.0), 2.0, 1.2, {"forearm": 0.5, "hand": 0.5}),
    (34.5, 0.0, 0.9, (0.35, 1.0), 1.6, 0.9, {"hand": 1.0}),
    (40.0, -2.0, 0.9, (0.35, 1.0), 1.2, 0.7, {"hand": 1.0}),
    (45.2, -4.2, 0.8, (0.35, 1.0), 0.7, 0.4, {"hand": 1.0}),
]


class Bird(NamedTuple):
    """A mesh at rest, and the rig that folds its wings and turns its head."""

    mesh: Mesh
    rig: Rig


def demo_bird() -> Bird:
    """The bird: quads, closed, symmetric across x = 0, y up, metres, looking along +z; always the same.

    At rest its wings are open. Its rig has eleven joints and a clip of 48 frames at 24 per second from frame 1001, in
    which it sits, looks about, opens its wings and folds them again.
    """
    shape = bird_shape()
    return Bird(shape.mesh, bird_rig(shape, *_wing_joints()))


def bird_shape(levels: int = 2) -> Shape:
    """Model the bird; see :class:`core.demo.shape.Shape`. The joints of the wings are those of both sides."""
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


def _wing_joints() -> tuple[Array, Array, Array, Array]:
    """Shoulder, elbow, wrist and the end of the hand of the +x side, metres."""
    ends = np.array([WING[k][:3] for k in (2, 5, 8)]) * 1e-3
    elbow, wrist, end = SHOULDER + ends @ BODY_AXES
    return SHOULDER, elbow, wrist, end


def _cage() -> Cage:
    cage = Cage()
    body = [cage.ring(*row) for row in BODY]
    head = [cage.ring(*row) for row in HEAD]
    beak = [cage.ring(*row) for row in BEAK]
    cage.cap(body[0][:1] + body[0][:0:-1], (0.0, 0.0338, -0.0555), {"tail": 1.0}, "body", "rump")
    hips, shoulders, eyes = 4, 6, 2  # the rows legs, wings and eyes grow from
    cage.loft([*body, head[0]], "body", "body", frozenset({(hips, 4), (shoulders, 2)}))
    uvs = cage.loft(head, "head", "head", frozenset({(eyes, 2)}))
    cage.loft([head[-1], *beak], "beak", "beak")
    cage.cap(beak[-1], BEAK_TIP, {"head": 1.0}, "beak", "beak tip")
    a, b = body[hips], body[hips + 1]
    loops = [_box(*row[:5]) for row in LEG]
    last = cage.limb([a[4], b[4], b[5], a[5]], loops, [{"hips": 1.0}] * len(loops), [row[5] for row in LEG], "leg")
    flat = np.array([cage.points[i][[0, 2]] for i in last])
    cage.both((last[0], last[1], last[2], last[3]), "feet", "sole", flat * (-1.0, 1.0))
    a, b = body[shoulders], body[shoulders + 1]
    sections = [_section(*row[:6]) for row in WING]
    last = cage.limb(
        [a[2], b[2], b[3], a[3]], sections, [row[6] for row in WING], ["wings"] * len(WING), "wing")
    flat = np.array([cage.points[i][[1, 2]] for i in last])
    cage.both((last[0], last[1], last[2], last[3]), "wings", "wing tip", flat)
    a, b = head[eyes], head[eyes + 1]
    cage.inset(
        [a[2], b[2], b[3], a[3]], [(0.18, 0.0001), (0.28, -0.0002), (0.38, 0.0002), (0.66, 0.0009)], {"head": 1.0},
        ["head", "head", "eyes", "eyes", "eyes"], "head", uvs[eyes, 2], uvs[eyes, 9][[3, 2, 1, 0]],
    )
    return cage


def _box(x: float, y: float, z: float, width: float, length: float) -> Array:
    """A section of a leg: outer back, outer front, inner front, inner back."""
    return np.array([
        (x + width, y, z - length), (x + width, y, z + length), (x - width, y, z + length), (x - width, y, z - length),
    ])


def _section(out: float, forward: float, up: float, lead: tuple[float, float], chord: float, thick: float) -> Array:
    """A section of a wing: upper back, upper front, lower front, lower back."""
    middle = SHOULDER + np.array([out, forward, up]) * 1e-3 @ BODY_AXES
    front = normalized(np.array([lead[0], lead[1], 0.0])) @ BODY_AXES * chord * 1e-3
    top = BODY_AXES[2] * thick * 1e-3
    return np.array([middle - front + top, middle + front + top, middle + front - top, middle - front - top])
