"""Move: arrows along the axes of the active joint; a drag moves the selected joints in their parents."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from core.field import field
from core.overlay import Circle, Label, Overlay, Overlays, Polyline, Tone
from core.pose.pose import SAME, Pose, Vector
from core.transform import Array
from core.units import METRES_PER_UNIT
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

FREE = 3  # the handle in the middle: across the line of sight
HEAD = 16.0  # pixels of the head of an arrow
LEAST = 0.05  # of an arrow that is seen end on: how long it must look to be dragged along


class MoveParams(ManipulatorParams):
    """Settings of Move."""

    snap: Annotated[float, field(
        "Snap", "Moves go in whole steps of so many metres; 0 lets them go freely.", "m", (0, 0.1), (0, 1e4))] = 0.0


class Move(Tool[MoveParams]):
    """Moves joints."""

    name = "move"
    label = "Move"
    icon = "move"
    order = 101
    tooltip = "Moves the selected joints along arrows, or freely by the ring in the middle; bones get longer."
    hint = "Drag an arrow: move   Click: pick a joint   Shift: add to the selection   Ctrl: steps of a centimetre"
    step = "Move joints"
    craft = "pose"
    edits = "posing"
    with_shift = Turn("move", {"add": True})
    with_ctrl = Turn("move", {"snap": 0.01})
    Params = MoveParams

    def begin(self, ground: PoseGround, pointer: Pointer) -> Stroke[Posing]:
        """A move where an arrow is pressed, else the pick of a joint; UserError where there is neither."""
        joints, selection = joints_of(ground, ground.pose), selected(ground)
        arrow = arrow_under(ground, joints, self.params, pointer)
        if arrow is not None:
            return MoveStroke(ground, selection, joints, arrow, self.params, pointer)
        return pick(ground, joints, self.params, pointer)

    def hover(self, ground: PoseGround, pointer: Pointer) -> Overlays:
        """The arrows of the active joint, that under the pointer brighter, else the joint that a click would pick."""
        joints = joints_of(ground, ground.pose)
        under = arrow_under(ground, joints, self.params, pointer)
        picked = joint_under(ground, joints, pointer) if under is None else None
        return arrows(ground, joints, self.params, under) + meant(ground, joints, picked)


class MoveStroke(PosingStroke):
    """A drag along an arrow, or across the line of sight."""

    def __init__(
        self, ground: PoseGround, selection: tuple[str, ...], joints: Joints, arrow: int, params: MoveParams,
        pointer: Pointer,
    ) -> None:
        super().__init__(ground, selection)
        self.joints, self.arrow, self.params = joints, arrow, params
        self.active = ground.rig.skeleton.names.index(selection[-1])
        self.centre = joints.world[self.active, :3, 3]
        self.eye = towards_eye(ground, self.centre)
        self.axis = None if arrow == FREE else frame_of(joints, self.active, params.axes)[:, arrow]
        self.start, self.moved = self._place(pointer), np.zeros(3)

    def _place(self, pointer: Pointer) -> Array:
        """Where (3,) the pointer is on the arrow, or on the plane across the line of sight."""
        origin, direction = self.ground.ray(pointer)
        if self.axis is None:
            return np.asarray(
                origin + direction * (float((self.centre - origin) @ self.eye) / float(direction @ self.eye)))
        # the place of the axis nearest to the line of sight through the pointer
        across = direction - self.axis * float(direction @ self.axis)
        size = float(across @ across)
        if size < LEAST**2:
            return np.asarray(self.centre)
        ahead = self.axis - direction * float(direction @ self.axis)
        return np.asarray(self.centre + self.axis * (float((origin - self.centre) @ ahead) / size))

    def posed(self, pointer: Pointer) -> Pose | None:
        """All selected joints moved by as much as the pointer, in object space."""
        self.moved = self._place(pointer) - self.start
        if self.params.snap > 0.0:
            steps = self.moved if self.axis is None else np.array([self.moved @ self.axis])
            steps = self.params.snap * np.round(steps / self.params.snap)
            self.moved = steps if self.axis is None else self.axis * steps[0]
        skeleton, before = self.ground.rig.skeleton, self.ground.pose
        translations: dict[str, Vector] = dict(before.translations)
        for name in self.selection:
            joint = skeleton.names.index(name)
            parent = int(skeleton.parents[joint])
            above = np.eye(3) if parent < 0 else self.joints.world[parent, :3, :3]
            have = np.array(before.translations.get(name, (0.0, 0.0, 0.0)))
            x, y, z = map(float, have + np.linalg.solve(above, self.moved))
            translations[name] = (x, y, z)
            if max(abs(x), abs(y), abs(z)) <= SAME:
                del translations[name]
        moved: Pose = before.replace(translations=translations)
        return moved

    def overlays(self) -> Overlays:
        """The line along the axis, the way from where the joint was to where it is, and how far in words."""
        reach = 1e3 * metres_per_pixel(self.ground, self.centre)
        axis = np.zeros(3) if self.axis is None else self.axis
        places = self.centre + np.array([-reach * axis, reach * axis, np.zeros(3), self.moved])
        pixels, w = self.ground.view.pixels(places)
        unit = self.ground.unit
        far = float(np.linalg.norm(self.moved) if self.axis is None else self.moved @ self.axis)
        free = self.axis is None
        words = "" if free else f"{NAMES[self.arrow]} "
        words += f"{far / METRES_PER_UNIT[unit]:{'' if free else '+'}.3f} {unit}"
        line: list[Overlay] = []
        if not free and (w > 0.0).all():
            line = [Polyline(pixels[:2], AXES[self.arrow], BEHIND)]
        x, y = map(float, pixels[3])
        return (
            *line, Circle(float(pixels[2, 0]), float(pixels[2, 1]), 4.0, "plain"),
            Polyline(pixels[2:], "selected", THICK), Label(x + 16.0, y - 12.0, words, "selected", True))


def arrow_ends(ground: PoseGround, joints: Joints, joint: int, params: ManipulatorParams) -> Array:
    """Ends (3, 2) of the arrows in pixels."""
    centre = joints.world[joint, :3, 3]
    reach = params.size * metres_per_pixel(ground, centre)
    ends: Array = ground.view.pixels(centre + reach * frame_of(joints, joint, params.axes).T)[0]
    return ends


def arrow_under(
    ground: PoseGround, joints: Joints, params: ManipulatorParams, pointer: Pointer
) -> int | None:
    """The arrow of the active joint that a pointer is on: 0, 1, 2, or 3 for the ring in the middle."""
    joint = with_handles(ground, joints)
    if joint is None:
        return None
    place, middle = np.array([pointer.x, pointer.y]), joints.pixels[joint]
    if np.linalg.norm(place - middle) <= HANDLE:
        return FREE
    along = arrow_ends(ground, joints, joint, params) - middle
    t = np.clip(along @ (place - middle) / np.maximum((along**2).sum(axis=1), 1e-12), 0.0, 1.0)
    away = np.linalg.norm(middle + t[:, None] * along - place, axis=1)
    away[np.linalg.norm(along, axis=1) < LEAST * params.size] = np.inf
    best = int(np.argmin(away))
    return best if away[best] <= HANDLE else None


def arrows(
    ground: PoseGround, joints: Joints, params: ManipulatorParams, under: int | None
) -> Overlays:
    """The arrows of the active joint, the one that is meant thicker."""
    joint = with_handles(ground, joints)
    if joint is None:
        return ()
    middle = joints.pixels[joint]
    drawn: list[Overlay] = []
    for k, end in enumerate(arrow_ends(ground, joints, joint, params)):
        along = end - middle
        length = float(np.linalg.norm(along))
        tone: Tone = "selected" if k == under else AXES[k]
        if length > 1e-6:
            ahead = along / length
            side, tip = np.array([-ahead[1], ahead[0]]), min(HEAD, 0.5 * length)
            foot = end - tip * ahead
            width = THICK if k == under else THIN
            head = np.array([end, foot + 0.4 * tip * side, foot - 0.4 * tip * side])
            drawn += [Polyline(np.array([middle, foot]), tone, width), Polyline(head, tone, width, closed=True),
                      Polyline(np.array([foot, end]), tone, 0.5 * tip)]
        x, y = map(float, end + 12.0 * along / max(length, 12.0))
        drawn.append(Label(x - 4.0, y + 4.0, NAMES[k], tone))
    free = under == FREE
    drawn.append(Circle(
        float(middle[0]), float(middle[1]), HANDLE, "selected" if free else "plain", THICK if free else THIN))
    return tuple(drawn)
