"""The shot of the demo: a hand-held camera in a dark workshop before a figure that turns its head, with marks on it.

A small copy of what the talk of 2001 tells of A.I.: body and head are real and tracked, the neck between them is found.
Nothing here is drawn; `app/shot_demo.py` makes the plate and solves it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.camera import look_at
from core.demo.arm import skeleton_at, strongest
from core.demo.face import cube_sphere, face
from core.falloff import smoothstep
from core.mesh.mesh import Mesh
from core.pose.pose import Pose, local_of_pose
from core.pose.rig import Rig
from core.pose.rotation import quaternion_from_euler
from core.pose.skinning import deformed
from core.transform import Array, translation

FIRST, FRAMES = 1001, 24
SIZE, FOCAL = (960, 540), 1150.0  # pixels
JOINTS = ("body", "low", "middle", "high")
PLACES = ((0.0, -0.42, -0.03), (0.0, -0.225, -0.03), (0.0, -0.175, -0.027), (0.0, -0.125, -0.022))
NECK = tuple(f"{joint}.{turn}" for joint in JOINTS[1:] for turn in ("rx", "ry", "rz"))
NECK_WIDE, NECK_LOW, NECK_HIGH = 0.037, -0.27, -0.07  # metres
RINGS, SPOKES = 28, 40
MARK, ROOM_MARK = 0.0042, 0.014  # radius in metres
# directions from the middle of the head, and how far up the neck and round it, at which marks were stuck on
HEAD_MARKS = (
    (0.0, 0.62), (-0.42, 0.45), (0.42, 0.45), (-0.5, -0.08), (0.5, -0.08), (-0.38, -0.5), (0.38, -0.5), (0.0, -0.72),
)
BODY_MARKS = ((-0.7, 0.45), (-0.45, 0.6), (0.45, 0.6), (0.7, 0.45), (0.0, 0.35), (-0.3, 0.4), (0.3, 0.4))
NECK_MARKS = tuple((height, angle) for height in (0.2, 0.4, 0.6, 0.8) for angle in (-36.0, 0.0, 36.0))


class Part(NamedTuple):
    """What of the figure is tracked as one. vertices : rows of the figure's mesh, by the names of their tracks."""

    name: str
    vertices: dict[str, int]


class Figure(NamedTuple):
    """A bust of one mesh with parts body, neck and head; a rig of the body and three joints of the neck."""

    mesh: Mesh
    rig: Rig
    head: Part
    neck: Part
    body: Part


def figure() -> Figure:
    """Model the bust, always the same: metres, y up, looking along +z."""
    head = face().mesh
    points, quads, weights, parts = [head.points.astype(np.float64)], [head.corners.reshape(-1, 4)], [], []
    weights.append(np.tile([0.0, 0.0, 0.0, 1.0], (len(head.points), 1)))
    parts.append(np.zeros(len(head.counts), int))
    ball, faces = cube_sphere(28)
    body = ball * (0.205, 0.125, 0.105) + (0.0, -0.345, -0.035)
    body[:, 1] -= 0.35 * np.abs(body[:, 0]) ** 1.5
    tube, sheet = _tube()
    start = len(head.points)
    for more, corners, share, part in (
        (tube, sheet, _neck_weights(tube), 1), (body, faces, np.tile([1.0, 0.0, 0.0, 0.0], (len(body), 1)), 2),
    ):
        points.append(more)
        quads.append(corners + start)
        weights.append(share)
        parts.append(np.full(len(corners), part))
        start += len(more)
    whole = np.concatenate(points)
    corners = np.concatenate(quads)
    mesh = Mesh(
        points=whole.astype(np.float32), counts=np.full(len(corners), 4, np.int32),
        corners=corners.reshape(-1).astype(np.int32), parts=np.concatenate(parts).astype(np.int32),
        part_names=("head", "neck", "body"),
    )
    rig = Rig(skeleton=skeleton_at(PLACES, JOINTS, [-1, 0, 1, 2]), skin=strongest(np.concatenate(weights)))
    heads, necks = len(head.points), len(head.points) + len(tube)
    return Figure(
        mesh, rig, Part("head", _facing(whole, 0, heads, HEAD_MARKS, "head")),
        Part("neck", _round_the_neck(heads)), Part("body", _facing(whole, necks, len(whole), BODY_MARKS, "body")),
    )


def _tube() -> tuple[Array, NDArray[np.int64]]:
    """Points and quads of the neck, wider below."""
    height, angle = np.linspace(NECK_LOW, NECK_HIGH, RINGS), np.linspace(0.0, 2.0 * np.pi, SPOKES, endpoint=False)
    wide = NECK_WIDE * (1.0 + 0.5 * (1.0 - smoothstep(0.0, 0.5, np.linspace(0.0, 1.0, RINGS))))
    along = (height - NECK_LOW) / (NECK_HIGH - NECK_LOW)
    x, z = wide[:, None] * np.sin(angle), wide[:, None] * np.cos(angle) - 0.03 + 0.014 * along[:, None]
    points = np.stack([x, np.repeat(height[:, None], SPOKES, axis=1), z], axis=-1).reshape(-1, 3)
    row = SPOKES * np.arange(RINGS - 1)[:, None]
    a, b = np.arange(SPOKES), np.roll(np.arange(SPOKES), -1)
    return points, np.stack([row + a, row + b, row + SPOKES + b, row + SPOKES + a], axis=-1).reshape(-1, 4)


def _neck_weights(points: Array) -> Array:
    """(V, 4) of the joints: each bends the neck over half a bone below and above it."""
    at = np.array([place[1] for place in PLACES[1:]])
    share = [smoothstep(y - 0.028, y + 0.028, points[:, 1]) for y in at]
    return np.stack([1.0 - share[0], share[0] - share[1], share[1] - share[2], share[2]], axis=1)


def _facing(points: Array, first: int, last: int, marks: tuple[tuple[float, float], ...], name: str) -> dict[str, int]:
    """The vertices of a part that are foremost where the marks say, in halves of its width and height."""
    own = points[first:last]
    middle, half = 0.5 * (own.min(axis=0) + own.max(axis=0)), 0.5 * np.ptp(own, axis=0)
    found = {}
    for number, (x, y) in enumerate(marks, 1):
        away = np.hypot(*((own[:, :2] - middle[:2]) / half[:2] - (x, y)).T)
        found[f"{name}{number}"] = first + int(np.argmin(away - 0.3 * (own[:, 2] - middle[2]) / half[2]))
    return found


def _round_the_neck(first: int) -> dict[str, int]:
    found = {}
    for number, (height, angle) in enumerate(NECK_MARKS, 1):
        ring, spoke = round(height * (RINGS - 1)), round(angle / 360.0 * SPOKES) % SPOKES
        found[f"neck{number}"] = first + ring * SPOKES + spoke
    return found


class Moment(NamedTuple):
    """What is true in a frame: camera (4, 4) world_from_camera, y up, body (4, 4) world_from_body, neck (9,) radians of
    `NECK`."""

    camera: Array
    body: Array
    neck: Array

    def pose(self) -> Pose:
        """Of the figure's joints."""
        turns = quaternion_from_euler(np.degrees(self.neck.reshape(3, 3))).tolist()
        return Pose(rotations={
            joint: (x, y, z, w) for joint, (x, y, z, w) in zip(JOINTS[1:], turns, strict=True)})


def moments() -> list[Moment]:
    """Every frame of the shot: the camera drifts as hands hold it, the body sways, the head looks about."""
    made = []
    for now in np.linspace(0.0, 1.0, FRAMES):
        shake = 0.012 * np.array([np.sin(19.0 * now), np.sin(23.0 * now + 1.0), 0.6 * np.sin(15.0 * now)])
        eye = np.array([-0.3 + 0.58 * now, 0.03 - 0.07 * now, 1.12 - 0.12 * np.sin(np.pi * now)]) + shake
        aim = np.array([0.02 * np.sin(7.0 * now), -0.13 + 0.015 * np.sin(9.0 * now), 0.0])
        body = translation((0.03 * np.sin(3.0 * now), 0.008 * np.sin(5.0 * now), 0.0))
        yaw, lean = 0.12 * np.sin(2.5 * now), 0.05 * np.sin(4.0 * now + 0.5)
        body[:3, :3] = _turned(yaw, lean)
        look, nod, tilt = 0.42 * np.sin(4.4 * now - 0.4), 0.2 * np.sin(6.0 * now), 0.16 * np.sin(5.0 * now + 1.2)
        share = np.array([[0.2, 0.2, 0.35], [0.3, 0.35, 0.4], [0.5, 0.45, 0.25]])
        roll = 0.02 * np.sin(11.0 * now)
        camera = look_at(eye, aim, (np.sin(roll), np.cos(roll), 0.0))
        made.append(Moment(camera, body, (share * [nod, look, tilt]).ravel()))
    return made


def _turned(yaw: float, lean: float) -> Array:
    c, s, d, e = np.cos(yaw), np.sin(yaw), np.cos(lean), np.sin(lean)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]) @ np.array([[d, -e, 0.0], [e, d, 0.0], [0, 0, 1.0]])


def figure_points(model: Figure, moment: Moment) -> NDArray[np.float32]:
    """(V, 3) of the figure in the world."""
    moved = deformed(model.mesh.points, model.rig, local_of_pose(model.rig.skeleton, moment.pose()))
    return np.ascontiguousarray(moved @ moment.body[:3, :3].T + moment.body[:3, 3], np.float32)


# corners of what stands in the room, metres: three posts, a shelf with two crates, benches on both sides
BOXES = (
    ((-0.56, -1.0, -0.80), (-0.46, 1.0, -0.68)), ((0.38, -1.0, -0.58), (0.48, 1.0, -0.47)),
    ((-0.62, 0.02, -1.5), (1.30, 0.06, -1.15)), ((0.28, 0.06, -1.42), (0.52, 0.24, -1.2)),
    ((-0.52, 0.06, -1.4), (-0.3, 0.20, -1.2)), ((-0.37, -0.70, -0.20), (-0.31, -0.04, -0.14)),
    ((-1.3, -0.7, -1.5), (-0.75, -0.3, -1.2)), ((0.62, -0.8, -1.4), (1.1, -0.35, -1.0)),
)


def room_marks() -> dict[str, Array]:
    """Places of the marks in the room by the names of their tracks: on posts, crates, benches and the wall."""
    places = [
        (-0.50, 0.10, -0.68), (-0.52, -0.12, -0.68), (-0.51, -0.34, -0.68), (0.42, 0.08, -0.47), (0.44, -0.14, -0.47),
        (0.43, -0.31, -0.47), (0.34, 0.14, -1.2), (0.47, 0.11, -1.2), (-0.41, 0.13, -1.2), (0.80, 0.04, -1.15),
        (-0.34, -0.10, -0.14), (-0.34, -0.25, -0.14), (-0.85, -0.38, -1.2), (0.75, -0.43, -1.0), (-0.83, -0.1, -1.5),
        (-0.42, -0.25, -1.5), (0.42, -0.30, -1.5), (0.33, -0.1, -1.5),
    ]
    return {f"room{number}": np.array(place) for number, place in enumerate(places, 1)}


def ball() -> tuple[Array, NDArray[np.int64]]:
    """Unit points and quads of a mark."""
    return cube_sphere(5)
