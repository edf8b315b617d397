"""What the manipulators share: joints on the screen, which of them a pointer means, and a pose made of a drag."""

from __future__ import annotations

from typing import Annotated, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.field import field
from core.overlay import Circle, Label, Overlays, Tone
from core.pose.constraints import constrained
from core.pose.mirror_pose import mirror_of_rig, with_other_side
from core.pose.pose import Pose, local_of_pose
from core.pose.rotation import polar_rotation
from core.pose.skinning import object_matrices
from core.record import Record
from core.transform import Array
from tools.ground import Hit, Pointer
from tools.pose.craft import PoseGround, Posing

JOINT = 14.0  # pixels within which a pointer means a joint
HANDLE = 9.0  # the same of a ring or an arrow
AXES: tuple[Tone, ...] = ("x", "y", "z")
NAMES = "XYZ"
THICK, THIN, BEHIND = 4.0, 2.5, 1.0  # lines of a handle that is meant, of the others, of their far side; pixels


class ManipulatorParams(Record):
    """What all manipulators can be set to."""

    axes: Annotated[Literal["local", "world"], field(
        "Axes", "Handles lie along the axes of the joint itself, or along those of the object.",
        choices=("local", "world"))] = "local"
    size: Annotated[float, field(
        "Handle size", "How far the handles reach from the joint, in pixels of the view.", "px", (40, 200),
        (20, 1000))] = 100.0
    add: Annotated[bool, field(
        "Add to selection", "A click adds the joint to those that are selected, or takes it out again.")] = False


class Joints(NamedTuple):
    """The joints of a pose in object space and on the screen.

    world : (J, 4, 4). pixels : (J, 2). seen : (J,) bool, in front of the eye.
    """

    world: Array
    pixels: Array
    seen: NDArray[np.bool_]


def joints_of(ground: PoseGround, pose: Pose) -> Joints:
    """Where the joints of the ground's rig are at a pose."""
    world = object_matrices(ground.rig.skeleton, local_of_pose(ground.rig.skeleton, pose))
    pixels, w = ground.view.pixels(world[:, :3, 3])
    return Joints(world, pixels, w > 0.0)


def joint_under(ground: PoseGround, joints: Joints, pointer: Pointer) -> str | None:
    """The joint a pointer means: the nearest dot, else the one that moves the skin there most."""
    names = ground.rig.skeleton.names
    away = np.linalg.norm(joints.pixels - [pointer.x, pointer.y], axis=1)
    away[~joints.seen] = np.inf
    if len(away) and away.min() <= JOINT:
        return names[int(np.argmin(away))]
    hit = ground.hit(pointer)
    return None if hit is None else strongest(ground, hit)


def strongest(ground: PoseGround, hit: Hit) -> str | None:
    """The joint of most weight where the skin was hit."""
    skin, corners = ground.rig.skin, ground.corners(hit)
    total = np.zeros(len(ground.rig.skeleton.names))
    for corner, share in zip(corners, hit.barycentric, strict=True):
        np.add.at(total, skin.joints[corner], float(share) * skin.weights[corner])
    return ground.rig.skeleton.names[int(np.argmax(total))] if total.any() else None


def selected_with(selection: tuple[str, ...], joint: str | None, add: bool) -> tuple[str, ...]:
    """The selection after a click: that joint, or with `add` it among the others, or taken out of them."""
    if joint is None:
        return selection
    others = tuple(name for name in selection if name != joint)
    if not add:
        return (joint,)
    return others if joint in selection else (*others, joint)


def selected(ground: PoseGround) -> tuple[str, ...]:
    """Names of the selected joints that the rig has, the active one last."""
    return tuple(n for n in ground.item.joint_selection if n in ground.rig.skeleton.names)


def with_handles(ground: PoseGround, joints: Joints) -> int | None:
    """The joint that handles are at: the one selected last, where it is in front of the eye."""
    selection = selected(ground)
    joint = ground.rig.skeleton.names.index(selection[-1]) if selection else None
    return joint if joint is not None and joints.seen[joint] else None


def frame_of(joints: Joints, joint: int, axes: str) -> Array:
    """Unit axes (3, 3) as columns, object space, along which the handles of a joint lie."""
    return np.eye(3) if axes == "world" else polar_rotation(joints.world[joint, :3, :3])


def metres_per_pixel(ground: PoseGround, place: Array) -> float:
    """How much of the object one pixel is at a place (3,)."""
    return 1.0 / max(ground.pixels_per_metre(place), 1e-12)


def towards_eye(ground: PoseGround, place: Array) -> Array:
    """Unit direction (3,) from a place to the eye, object space."""
    pixels, _ = ground.view.pixels(place)
    _, direction = ground.ray(Pointer(float(pixels[0]), float(pixels[1])))
    return -direction


class PosingStroke:
    """A press that picks a joint, or a drag on a handle that poses the selected ones."""

    def __init__(self, ground: PoseGround, selection: tuple[str, ...]) -> None:
        self.ground, self.selection = ground, selection
        self.poses = False

    @property
    def step(self) -> str | None:
        """A press that was no drag only selects."""
        return None if self.poses else "Select joints"

    def posed(self, pointer: Pointer) -> Pose | None:
        """The pose of the drag as far as `pointer`; None where nothing is dragged."""
        return None

    def touched(self) -> tuple[str, ...]:
        """Joints that the drag changes."""
        return self.selection

    def extend(self, matter: Posing, pointers: tuple[Pointer, ...]) -> Posing:
        """The matter after these samples, constraints done; on the mirrored side, as the image of the first."""
        rig = self.ground.rig
        if self.ground.mirrored:
            if matter.pose is None:
                return matter
            before, now = self.ground.pose, matter.pose
            changed = [n for n in self.touched() if now.rotations.get(n) != before.rotations.get(n)
                       or now.translations.get(n) != before.translations.get(n)]
            return matter._replace(pose=with_other_side(mirror_of_rig(rig), now, changed))
        pose = self.posed(pointers[-1])
        self.poses = self.poses or pose is not None
        if pose is not None:
            pose = constrained(rig.skeleton, rig.constraints, pose)
        return Posing(matter.pose if pose is None else pose, self.selection)

    def finish(self, matter: Posing) -> Posing:
        """As it is."""
        return matter

    def overlays(self) -> Overlays:
        """Nothing of its own: the handles are drawn where they are hovered."""
        return ()


def pick(ground: PoseGround, joints: Joints, params: ManipulatorParams, pointer: Pointer) -> PosingStroke:
    """The stroke of a click on a joint or the skin; UserError where there is neither and nothing is selected."""
    joint, selection = joint_under(ground, joints, pointer), selected(ground)
    if joint is None and not selection:
        raise UserError("No joint is selected; click a joint, or the skin it moves.")
    return PosingStroke(ground, selected_with(selection, joint, params.add))


def meant(ground: PoseGround, joints: Joints, joint: str | None) -> Overlays:
    """A ring about the joint that a click would pick, and its name; nothing where that is none."""
    if joint is None:
        return ()
    row = ground.rig.skeleton.names.index(joint)
    if not joints.seen[row]:
        return ()
    x, y = map(float, joints.pixels[row])
    return Circle(x, y, 8.0, "accent", 2.0), Label(x + 14.0, y - 10.0, joint, plate=True)
