"""Rotate: rings about the axes of the active joint; a drag turns all selected joints by the angle seen."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np

from core.field import field
from core.overlay import Circle, Label, Overlay, Overlays, Polyline, Tone
from core.pose.ik import turned_joint
from core.pose.pose import Pose, local_of_pose, pose_of_local
from core.transform import Array, matrix_from_quaternion, normalized, quaternion_about
from tools.ground import Pointer
from tools.pose.craft import PoseGround, Posing
from tools.pose.posing import (
    AXES,
    BEHIND,
    HANDLE,
    NAMES,
    THICK,
    THIN,
    Joints,
    ManipulatorParams,
    PosingStroke,
    frame_of,
    joint_under,
    joints_of,
    meant,
    metres_per_pixel,
    pick,
    selected,
    towards_eye,
    with_handles,
)
from tools.tool import Stroke, Tool, Turn

STEPS = 64  # of a ring that is drawn
EDGE_ON = 0.17  # cosine between a ring's axis and the line of sight below which the ring is pulled along, not round
VIEW = 3  # the handle that turns about the line of sight
VIEW_SIZE = 1.25  # of the other rings


class RotateParams(ManipulatorParams):
    """Settings of Rotate."""

    snap: Annotated[float, field(
        "Snap", "Turns go in whole steps of this angle; 0 lets them go freely.", "rad", (0, math.pi / 4),
        (0, math.pi))] = 0.0


class Rotate(Tool[RotateParams]):
    """Turns joints."""

    name = "rotate"
    label = "Rotate"
    icon = "rotate"
    order = 100
    tooltip = "Turns the selected joints about rings along their axes; click a joint or the skin to pick one."
    hint = "Drag a ring: turn   Click: pick a joint   Shift: add to the selection   Ctrl: steps of 15 degrees"
    step = "Rotate joints"
    craft = "pose"
    edits = "posing"
    with_shift = Turn("rotate", {"add": True})
    with_ctrl = Turn("rotate", {"snap": math.pi / 12})
    Params = RotateParams

    def begin(self, ground: PoseGround, pointer: Pointer) -> Stroke[Posing]:
        """A turn where a ring is pressed, else the pick of a joint; UserError where there is neither."""
        joints, selection = joints_of(ground, ground.pose), selected(ground)
        ring = ring_under(ground, joints, self.params, pointer)
        if ring is not None:
            return RotateStroke(ground, selection, joints, ring, self.params, pointer)
        return pick(ground, joints, self.params, pointer)

    def hover(self, ground: PoseGround, pointer: Pointer) -> Overlays:
        """The rings of the active joint, the one under the pointer brighter, else the joint that a click would pick."""
        joints = joints_of(ground, ground.pose)
        under = ring_under(ground, joints, self.params, pointer)
        picked = joint_under(ground, joints, pointer) if under is None else None
        return rings(ground, joints, self.params, under) + meant(ground, joints, picked)


class RotateStroke(PosingStroke):
    """A drag round a ring: from the pose at press by the whole angle, so that nothing adds up by rounding."""

    def __init__(
        self, ground: PoseGround, selection: tuple[str, ...], joints: Joints, ring: int, params: RotateParams,
        pointer: Pointer,
    ) -> None:
        super().__init__(ground, selection)
        self.joints, self.ring, self.params = joints, ring, params
        self.active = ground.rig.skeleton.names.index(selection[-1])
        self.centre = joints.world[self.active, :3, 3]
        self.eye = towards_eye(ground, self.centre)
        self.axis = self.eye if ring == VIEW else frame_of(joints, self.active, params.axes)[:, ring]
        self.edge_on = abs(float(self.axis @ self.eye)) < EDGE_ON
        self.start, self.angle = pointer, 0.0
        self.across = normalized(np.cross(self.axis, np.eye(3)[int(np.argmin(np.abs(self.axis)))]))
        self.last = 0.0
        self.first = self._angle_of(self.eye) if self.edge_on else self._around(pointer)
        self.last, self.whole = self.first, 0.0

    def _around(self, pointer: Pointer) -> float:
        """The angle, radians, of the pointer on the plane of the ring, about its axis."""
        origin, direction = self.ground.ray(pointer)
        slope = float(direction @ self.axis)
        if abs(slope) < 1e-9:
            return self.last
        return self._angle_of(origin + direction * (float((self.centre - origin) @ self.axis) / slope) - self.centre)

    def _angle_of(self, place: Array) -> float:
        """The angle, radians, of a place (3,) from the joint, about the axis."""
        return math.atan2(float(place @ np.cross(self.axis, self.across)), float(place @ self.across))

    def _along(self, pointer: Pointer) -> float:
        """The same of a ring seen from its edge: how far the pointer pulled along it, over its radius."""
        tangent = np.cross(self.axis, self.eye)
        pixels, _ = self.ground.view.pixels(
            np.array([self.centre, self.centre + tangent * metres_per_pixel(self.ground, self.centre)]))
        way = normalized(pixels[1] - pixels[0])
        pulled = np.array([pointer.x - self.start.x, pointer.y - self.start.y])
        return float(pulled @ way) / self.params.size

    def posed(self, pointer: Pointer) -> Pose | None:
        """All selected joints turned by the angle from the press, each about its own axis where axes are local."""
        if self.edge_on:
            self.whole = self._along(pointer)
        else:
            now = self._around(pointer)
            self.whole += (now - self.last + math.pi) % (2.0 * math.pi) - math.pi
            self.last = now
        step = self.params.snap
        self.angle = self.whole if step == 0.0 else step * round(self.whole / step)
        skeleton, before = self.ground.rig.skeleton, self.ground.pose
        local = local_of_pose(skeleton, before)
        for name in self.selection:
            joint = skeleton.names.index(name)
            own = self.ring != VIEW and self.params.axes == "local"
            axis = frame_of(self.joints, joint, "local")[:, self.ring] if own else self.axis
            local[joint] = turned_joint(
                skeleton, local_of_pose(skeleton, before), joint,
                matrix_from_quaternion(quaternion_about(axis, self.angle)))[joint]
        return pose_of_local(skeleton, local, before.name, dict(before.numbers))

    def overlays(self) -> Overlays:
        """The ring that is held, the sector it was turned by, and the angle in words."""
        size = self.params.size * (VIEW_SIZE if self.ring == VIEW else 1.0)
        radius = size * metres_per_pixel(self.ground, self.centre)
        low, high = sorted((self.angle, 0.0))
        # more than a whole turn is drawn as one
        turn = np.append(np.linspace(0.0, 2.0 * np.pi, STEPS), self.first + np.linspace(
            max(low, high - 2.0 * np.pi), high, STEPS))[:, None]
        places = self.centre + radius * (np.cos(turn) * self.across + np.sin(turn) * np.cross(self.axis, self.across))
        pixels = self.ground.view.pixels(places)[0]
        middle = self.joints.pixels[self.active]
        began, now = (pixels[STEPS], pixels[-1]) if self.angle >= 0.0 else (pixels[-1], pixels[STEPS])
        tone: Tone = "plain" if self.ring == VIEW else AXES[self.ring]
        out = (now - middle) / max(float(np.linalg.norm(now - middle)), 1e-9)
        x, y = map(float, now + 16.0 * out + [8.0, 4.0])
        name = "" if self.ring == VIEW else f"{NAMES[self.ring]} "
        return (
            Polyline(pixels[:STEPS], tone, BEHIND), Polyline(np.array([middle, began]), "plain", BEHIND, dashed=True),
            Polyline(np.vstack([middle, now]), "selected", THIN), Polyline(pixels[STEPS:], "selected", THICK),
            Label(x, y, f"{name}{math.degrees(self.angle):+.1f}\N{DEGREE SIGN}", "selected", True))


def ring_points(ground: PoseGround, joints: Joints, joint: int, params: ManipulatorParams) -> list[Array]:
    """The three rings (64, 2) of a joint in pixels."""
    centre = joints.world[joint, :3, 3]
    radius = params.size * metres_per_pixel(ground, centre)
    turn = np.linspace(0.0, 2.0 * np.pi, STEPS, endpoint=False)
    frame = frame_of(joints, joint, params.axes)
    found = []
    for k in range(3):
        u, v = frame[:, (k + 1) % 3], frame[:, (k + 2) % 3]
        places = centre + radius * (np.cos(turn)[:, None] * u + np.sin(turn)[:, None] * v)
        found.append(ground.view.pixels(places)[0])
    return found


def ring_under(
    ground: PoseGround, joints: Joints, params: ManipulatorParams, pointer: Pointer
) -> int | None:
    """The ring of the active joint that a pointer is on: 0, 1, 2, or 3 for the one about the line of sight."""
    joint = with_handles(ground, joints)
    if joint is None:
        return None
    place = np.array([pointer.x, pointer.y])
    away = [_distance(place, points) for points in ring_points(ground, joints, joint, params)]
    away.append(abs(float(np.linalg.norm(place - joints.pixels[joint])) - VIEW_SIZE * params.size))
    best = int(np.argmin(away))
    return best if away[best] <= HANDLE else None


def _distance(place: Array, points: Array) -> float:
    """Pixels from a place (2,) to a closed line (N, 2)."""
    along = np.roll(points, -1, axis=0) - points
    t = np.clip(((place - points) * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-12), 0.0, 1.0)
    return float(np.linalg.norm(points + t[:, None] * along - place, axis=1).min())


def rings(
    ground: PoseGround, joints: Joints, params: ManipulatorParams, under: int | None
) -> Overlays:
    """The rings of the active joint, thin on their far side, the one that is meant thick; their names beside them."""
    joint = with_handles(ground, joints)
    if joint is None:
        return ()
    x, y = map(float, joints.pixels[joint])
    frame, eye = frame_of(joints, joint, params.axes), towards_eye(ground, joints.world[joint, :3, 3])
    turn = np.linspace(0.0, 2.0 * np.pi, STEPS, endpoint=False)
    far: list[Overlay] = []
    near: list[Overlay] = []
    for k, points in enumerate(ring_points(ground, joints, joint, params)):
        tone: Tone = "selected" if k == under else AXES[k]
        side = np.cos(turn) * (frame[:, (k + 1) % 3] @ eye) + np.sin(turn) * (frame[:, (k + 2) % 3] @ eye)
        first = (int(np.argmax(side)) + STEPS // 2) % STEPS  # in the middle of the far half
        half, open_end = STEPS // 4, np.roll(np.arange(STEPS), -first)
        far.append(Polyline(points[np.append(open_end[-half:], open_end[: half + 1])], tone, BEHIND))
        near.append(Polyline(points[open_end[half:-half + 1]], tone, THICK if k == under else THIN))
        tips = points[open_end[half:-half]] - [x, y]
        tip = tips[int(np.argmax(np.linalg.norm(tips, axis=1)))]
        at = [x, y] + tip + 12.0 * tip / max(float(np.linalg.norm(tip)), 1.0)
        near.append(Label(float(at[0]) - 4.0, float(at[1]) + 4.0, NAMES[k], tone))
    whole = Circle(x, y, VIEW_SIZE * params.size, "selected" if under == VIEW else "plain",
                   THICK if under == VIEW else BEHIND)
    return (whole, *far, *near)
