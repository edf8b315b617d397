"""IK: drag a hand or a foot, and the bones above it follow."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from core.errors import UserError
from core.field import field
from core.overlay import Marker, Overlays, Polyline
from core.pose.ik import chain_to, solved_ik
from core.pose.pose import Pose
from core.transform import Array
from tools.ground import Pointer
from tools.pose.craft import PoseGround, Posing
from tools.pose.posing import (
    Joints,
    ManipulatorParams,
    PosingStroke,
    joint_under,
    joints_of,
    meant,
    selected,
    selected_with,
    towards_eye,
)
from tools.tool import Stroke, Tool, Turn


class IkParams(ManipulatorParams):
    """Settings of IK."""

    bones: Annotated[int, field(
        "Bones", "How many bones above the dragged joint follow; two are solved exactly, as arms and legs need.", "",
        (1, 8), (1, 64), 1)] = 2
    keep: Annotated[bool, field(
        "Keep rotation", "The dragged joint keeps its rotation in space, as a foot flat on the ground does.")] = True
    turn: Annotated[bool, field(
        "Turn the bend", "The drag turns the bend of the chain, its elbow or knee, and leaves the end in place.",
    )] = False


class Ik(Tool[IkParams]):
    """Poses a chain by its end."""

    name = "ik"
    label = "IK"
    icon = "ik"
    order = 102
    tooltip = "Drag a joint and the bones above it follow, the elbow in its plane; click picks a joint."
    hint = "Drag a joint: reach   Ctrl: turn the elbow or knee   Shift: add to the selection"
    step = "Reach with joints"
    craft = "pose"
    edits = "posing"
    with_shift = Turn("ik", {"add": True})
    with_ctrl = Turn("ik", {"turn": True})
    Params = IkParams

    def begin(self, ground: PoseGround, pointer: Pointer) -> Stroke[Posing]:
        """A reach with the joint under the pointer; UserError when there is none, or nothing above it."""
        joints, selection = joints_of(ground, ground.pose), selected(ground)
        joint = selection[-1] if self.params.turn and selection else joint_under(ground, joints, pointer)
        if joint is None:
            raise UserError("There is no joint under the pointer; press on the joint that should reach somewhere.")
        if self.params.add:
            return PosingStroke(ground, selected_with(selection, joint, add=True))
        chain = chain_to(ground.rig.skeleton, joint, self.params.bones)
        return IkStroke(ground, selected_with(selection, joint, add=False), joints, chain, self.params, pointer)

    def hover(self, ground: PoseGround, pointer: Pointer) -> Overlays:
        """The chain that a press would pose, and the joint that leads it."""
        joints = joints_of(ground, ground.pose)
        joint = joint_under(ground, joints, pointer)
        drawn = meant(ground, joints, joint)
        if joint is None:
            return drawn
        try:
            chain = chain_to(ground.rig.skeleton, joint, self.params.bones)
        except UserError:
            return drawn
        return drawn + chain_overlay(ground, joints, chain)


class IkStroke(PosingStroke):
    """A drag of the end across the line of sight, or of its bend."""

    def __init__(
        self, ground: PoseGround, selection: tuple[str, ...], joints: Joints, chain: tuple[str, ...],
        params: IkParams, pointer: Pointer,
    ) -> None:
        super().__init__(ground, selection)
        self.chain, self.params, self.start = chain, params, pointer
        rows = [ground.rig.skeleton.names.index(name) for name in chain]
        self.end, self.bend = joints.world[rows[-1], :3, 3], joints.world[rows[len(rows) // 2], :3, 3]
        self.held = self.bend if params.turn else self.end
        self.eye = towards_eye(ground, self.held)
        self.begun, self.goal, self.pose = self._place(pointer), self.end, ground.pose

    def _place(self, pointer: Pointer) -> Array:
        origin, direction = self.ground.ray(pointer)
        return np.asarray(origin + direction * (float((self.held - origin) @ self.eye) / float(direction @ self.eye)))

    def touched(self) -> tuple[str, ...]:
        """The joints of the chain."""
        return self.chain

    def posed(self, pointer: Pointer) -> Pose | None:
        """The chain from the pose at press, its end moved as the pointer; None before the pointer has moved."""
        if (pointer.x, pointer.y) == (self.start.x, self.start.y):
            return None
        moved = self._place(pointer) - self.begun
        skeleton, before = self.ground.rig.skeleton, self.ground.pose
        self.goal = self.end if self.params.turn else self.end + moved
        pole = self.bend + moved if self.params.turn else None
        self.pose = solved_ik(skeleton, before, self.chain, self.goal, pole, self.params.keep)
        return self.pose

    def overlays(self) -> Overlays:
        """The chain as it is now, and where its end should be."""
        joints = joints_of(self.ground, self.pose)
        place, _ = self.ground.view.pixels(self.goal)
        goal = Marker(float(place[0]), float(place[1]))
        return (*chain_overlay(self.ground, joints, self.chain), goal)


def chain_overlay(ground: PoseGround, joints: Joints, chain: tuple[str, ...]) -> Overlays:
    """A line along the bones of a chain."""
    rows = [ground.rig.skeleton.names.index(name) for name in chain]
    return (Polyline(joints.pixels[rows], "accent", 3.0),) if joints.seen[rows].all() else ()
