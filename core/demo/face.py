"""The face of the demo: a head modelled in code, and four expressions at the corners of two axes of emotion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.demo.arm import skeleton_at, strongest
from core.falloff import smoothstep
from core.mesh.mesh import Mesh
from core.pose.layers import Sculpt
from core.pose.pose import Pose
from core.pose.rig import Control, Rig

Array = NDArray[np.float64]

SIDE = 72  # quads along an edge of the cube the head is blown up from
SIZE = np.array([0.078, 0.108, 0.092])  # half axes of the skull, metres
EYE = np.array([0.0315, 0.018])  # x, y of the left eye
EYE_WIDE, EYE_HIGH, EYEBALL = 0.0165, 0.0070, 0.0150
MOUTH = np.array([0.0, -0.047])
MOUTH_WIDE, LIP = 0.027, 0.0065


class Expression(NamedTuple):
    """How far parts of the face move, metres, on both sides alike; upward and outward counts above 0."""

    brow_inner: float = 0.0
    brow_outer: float = 0.0
    brow_together: float = 0.0
    lid_upper: float = 0.0
    lid_lower: float = 0.0
    cheek: float = 0.0
    corner_up: float = 0.0
    corner_out: float = 0.0
    lips_apart: float = 0.0
    chin: float = 0.0


# name: (valence, arousal), expression
EXPRESSIONS: dict[str, tuple[tuple[float, float], Expression]] = {
    "joy": ((1.0, 1.0), Expression(0.003, 0.004, 0.0, 0.001, 0.0022, 0.006, 0.0125, 0.008, 0.0085, -0.005)),
    "anger": ((-1.0, 1.0), Expression(-0.0085, 0.006, 0.005, -0.0022, 0.0015, 0.002, -0.0055, -0.002, 0.005, -0.002)),
    "sadness": ((-1.0, -1.0), Expression(0.0085, -0.005, 0.002, -0.0040, 0.0, -0.002, -0.0105, 0.001, 0.0, 0.003)),
    "calm": ((1.0, -1.0), Expression(0.002, -0.001, -0.001, -0.0068, 0.0018, 0.0025, 0.0065, 0.004, 0.0, 0.001)),
}


class Face(NamedTuple):
    """Mesh at rest, a rig of one joint and two dials, and the sculpts."""

    mesh: Mesh
    rig: Rig
    sculpts: tuple[Sculpt, ...]


def face() -> Face:
    """Model the face, always the same: about 31,000 quads, metres, y up, looking along +z; its eyes are balls."""
    ball, quads = cube_sphere(SIDE)
    skin = _features(_skull(ball))
    eyeball, eye_quads = cube_sphere(16)
    eyes = [eyeball * EYEBALL + (side * EYE[0], EYE[1], _eye_depth()) for side in (1.0, -1.0)]
    points = np.concatenate([skin, *eyes])
    counts = [len(skin), len(eyeball), len(eyeball)]
    corners = np.concatenate([quads, eye_quads + counts[0], eye_quads + counts[0] + counts[1]])
    mesh = Mesh(
        points=points.astype(np.float32), counts=np.full(len(corners), 4, np.int32),
        corners=corners.reshape(-1).astype(np.int32),
        parts=np.repeat(np.arange(3), [len(quads), len(eye_quads), len(eye_quads)]).astype(np.int32),
        part_names=("head", "left eye", "right eye"),
    )
    rig = Rig(
        skeleton=skeleton_at([(0.0, -0.06, -0.02)], ("head",), [-1]), skin=strongest(np.ones((len(points), 1))),
        controls=(Control(name="valence", low=-1.0), Control(name="arousal", low=-1.0)),
    )
    sculpts = []
    for name, ((valence, arousal), expression) in EXPRESSIONS.items():
        moved = points.copy()
        moved[: len(skin)] += _moves(skin, expression)
        sculpts.append(Sculpt(Pose(name=name, numbers={"valence": valence, "arousal": arousal}), moved))
    return Face(mesh, rig, tuple(sculpts))


def cube_sphere(side: int) -> tuple[Array, NDArray[np.int64]]:
    """Unit points and quads, counter-clockwise from outside, of a cube blown up."""
    t = np.tan(np.linspace(-0.25 * np.pi, 0.25 * np.pi, side + 1))
    a, b = np.meshgrid(t, t, indexing="ij")
    one = np.ones_like(a)
    sheets = [(a, b, one), (b, a, -one), (b, one, a), (a, -one, b), (one, a, b), (-one, b, a)]
    points = np.concatenate([np.stack(sheet, axis=-1).reshape(-1, 3) for sheet in sheets])
    row = np.arange(side)[:, None] * (side + 1) + np.arange(side)
    quad = np.stack([row, row + side + 1, row + side + 2, row + 1], axis=-1).reshape(-1, 4)
    quads = np.concatenate([quad + k * (side + 1) ** 2 for k in range(6)])
    _, first, where = np.unique(np.round(points, 9), axis=0, return_index=True, return_inverse=True)
    points, quads = points[first], where.ravel()[quads]
    return points / np.linalg.norm(points, axis=1, keepdims=True), quads


def _skull(ball: Array) -> Array:
    angle = np.arccos(np.clip(ball[:, 2], -1.0, 1.0))
    closer = angle - 0.42 * np.sin(angle)  # the face gets more points than the back of the head
    across = np.hypot(ball[:, 0], ball[:, 1])
    direction = ball[:, :2] / np.where(across > 0.0, across, 1.0)[:, None]
    x, y = (direction * np.sin(closer)[:, None]).T
    points = np.stack([x, y, np.cos(closer)], axis=1) * SIZE
    low = 1.0 - smoothstep(-0.105, 0.01, points[:, 1])
    points[:, 0] *= 1.0 - 0.24 * low
    points[:, 2] += 0.012 * low * smoothstep(0.0, 0.06, points[:, 2])
    return points


def _blob(x: Array, y: Array, at: tuple[float, float], wide: float, high: float) -> Array:
    out: Array = np.exp(-0.5 * (((x - at[0]) / wide) ** 2 + ((y - at[1]) / high) ** 2))
    return out


def _eye_depth() -> float:
    """Where the middle of the eyeballs lies, so that they look out between the lids."""
    return float(SIZE[2] * np.sqrt(1.0 - (EYE[0] / SIZE[0]) ** 2 - (EYE[1] / SIZE[1]) ** 2) - 0.0250)


def _mouth_line(x: Array) -> Array:
    return MOUTH[1] + 0.0022 * np.cos(np.pi * x / MOUTH_WIDE) - 0.001 * np.abs(x) / MOUTH_WIDE


def _features(points: Array) -> Array:
    """The skull with nose, sockets, brows, lids, lips and chin, pushed out or in along z."""
    x, y, z = points.T
    side = np.abs(x)
    front = smoothstep(0.0, 0.035, z)
    push = 0.0052 * _blob(side, y, (0.030, 0.043), 0.020, 0.0075)  # brow ridge
    push -= 0.0120 * _blob(side, y, (EYE[0], EYE[1] + 0.001), 0.017, 0.0125)  # socket
    bridge = np.clip((0.036 - y) / 0.060, 0.0, 1.0)
    along = smoothstep(-0.030, -0.017, y) * (1.0 - smoothstep(0.030, 0.045, y))
    push += (0.006 + 0.019 * bridge**1.4) * along * np.exp(-0.5 * (side / (0.0062 + 0.0042 * bridge)) ** 2)
    push += 0.0078 * _blob(side, y, (0.0105, -0.0185), 0.0052, 0.0052)  # wings of the nose
    push -= 0.0045 * _blob(side, y, (0.0065, -0.0262), 0.0034, 0.0022)
    push += 0.0050 * _blob(side, y, (0.040, -0.010), 0.017, 0.014)  # cheekbone
    push += 0.0060 * _blob(side, y, (0.0, -0.083), 0.016, 0.011)  # chin
    push -= 0.0035 * _blob(side, y, (0.0, -0.0655), 0.016, 0.0055)
    push += 0.0055 * _blob(side, y, (0.0, -0.046), 0.026, 0.017)  # what the teeth lift
    off = y - _mouth_line(x)
    within = np.clip(1.0 - (side / MOUTH_WIDE) ** 2, 0.0, 1.0)
    full = np.sqrt(within)
    upper = _bell(off, 0.0046 * full + 1e-4, 0.0034) * (1.0 - 0.25 * np.exp(-0.5 * (side / 0.003) ** 2))
    lower = _bell(off, -0.0054 * full - 1e-4, 0.0042)
    push += full * (0.0036 * upper + 0.0046 * lower)
    push -= 0.0052 * within**0.35 * np.exp(-0.5 * (off / 0.0013) ** 2)  # between the lips
    push -= 0.0022 * _blob(side, y, (MOUTH_WIDE, MOUTH[1]), 0.0035, 0.0035)
    ex, ey = (side - EYE[0]) / EYE_WIDE, (y - EYE[1]) / EYE_HIGH
    almond = np.hypot(ex, ey / np.clip(1.0 - 0.45 * ex**2, 0.3, 1.0))
    push += 0.0042 * np.exp(-0.5 * ((almond - 1.22) / 0.20) ** 2)  # lids
    push -= 0.0120 * (1.0 - smoothstep(0.72, 1.06, almond))  # between them
    out = points.copy()
    out[:, 2] += push * front
    return out


def _bell(off: Array, at: Array, width: float) -> Array:
    out: Array = np.exp(-0.5 * ((off - at) / width) ** 2)
    return out


def _moves(points: Array, e: Expression) -> Array:
    """How far (V, 3) an expression moves the head at rest."""
    x, y, z = points.T
    side, out = np.abs(x), np.zeros_like(points)
    front = smoothstep(0.0, 0.035, z)
    brow_in = _blob(side, y, (0.014, 0.040), 0.011, 0.012)
    brow_out = _blob(side, y, (0.046, 0.041), 0.013, 0.012)
    up = e.brow_inner * brow_in + e.brow_outer * brow_out
    inward = e.brow_together * brow_in
    frown = 0.45 * max(e.brow_together, 0.0) * _blob(side, y, (0.006, 0.038), 0.004, 0.008)
    ex, ey = (side - EYE[0]) / EYE_WIDE, (y - EYE[1]) / EYE_HIGH
    lids = np.exp(-0.5 * (ex / 0.75) ** 2)
    near = np.exp(-0.5 * (np.maximum(np.abs(ey) - 1.0, 0.0) / 0.75) ** 2)
    up += np.where(ey > 0.0, e.lid_upper, e.lid_lower) * lids * near * smoothstep(0.25, 0.9, np.abs(ey))
    closing = np.where(ey > 0.0, -e.lid_upper, e.lid_lower) * lids * near * smoothstep(0.25, 0.9, np.abs(ey))
    forth = 0.35 * np.maximum(closing, 0.0) - frown
    cheek = _blob(side, y, (0.036, -0.016), 0.015, 0.013)
    up += 0.8 * e.cheek * cheek
    forth += 0.9 * e.cheek * cheek
    corner = _blob(side, y, (MOUTH_WIDE, MOUTH[1]), 0.013, 0.015)
    up += e.corner_up * corner
    outward = e.corner_out * corner
    forth -= 0.45 * max(e.corner_out, 0.0) * corner
    fold = _blob(side, y, (0.030, -0.030), 0.005, 0.010)  # from the nose to the corner of the mouth
    forth -= 0.16 * max(e.corner_up, 0.0) * fold
    off = y - _mouth_line(x)
    open_ = np.sqrt(np.clip(1.0 - (side / (0.92 * MOUTH_WIDE)) ** 2, 0.0, 1.0))
    apart = np.exp(-0.5 * (np.maximum(np.abs(off) - 0.006, 0.0) / 0.010) ** 2) * open_
    split = np.tanh(off / 0.0011)
    up += e.lips_apart * apart * np.where(split > 0.0, 0.40, 0.75) * split
    forth -= 1.1 * e.lips_apart * open_ * np.exp(-0.5 * (off / 0.0011) ** 2)
    up += e.chin * _blob(side, y, (0.0, -0.085), 0.026, 0.016)
    out[:, 0] = np.tanh(x / 0.007) * (outward - inward) * front
    out[:, 1], out[:, 2] = up * front, forth * front
    return out
