"""Weights: how much the active joint moves each vertex, painted on the mesh in any pose."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.field import field
from core.mesh.edges import edge_vertices
from core.mesh.mesh import Mesh
from core.pose.mirror_pose import mirror_of_rig
from core.pose.sculpt.ring import Ring
from core.pose.skeleton import SkinWeights
from core.pose.weights import painted, smoothed
from core.record import freeze
from tools.brush import RingStroke
from tools.ground import Pointer
from tools.pose.brushes import SculptParams
from tools.pose.craft import PoseGround
from tools.tool import Stroke, Tool, Turn


class WeightParams(SculptParams):
    """Settings of Weights."""

    how: Annotated[Literal["add", "subtract", "replace", "smooth"], field(
        "Way", "What the brush does to the weight of the active joint under its ring.",
        choices=("add", "subtract", "replace", "smooth"))] = "add"
    value: Annotated[float, field(
        "Weight", "What replace paints, and the most that one dab of add or subtract changes.", "", (0, 1),
        (0, 1))] = 1.0


class Weights(Tool[WeightParams]):
    """Paints skin weights."""

    name = "weights"
    label = "Weights"
    icon = "weights"
    order = 140
    tooltip = "Paints how much the active joint moves the surface; the other joints make room, locked ones stay."
    hint = "Drag: add   Ctrl: subtract   Shift: smooth"
    step = "Paint weights"
    craft = "pose"
    edits = "weights"
    with_ctrl = Turn("weights", {"how": "subtract"})
    with_shift = Turn("weights", {"how": "smooth"})
    with_eraser = Turn("weights", {"how": "subtract"})
    Params = WeightParams

    def begin(self, ground: PoseGround, pointer: Pointer) -> Stroke[SkinWeights]:
        """A stroke on the weights of the active joint; UserError when none is selected or it is locked."""
        selected = ground.item.joint_selection
        names = ground.rig.skeleton.names
        if not selected or selected[-1] not in names:
            raise UserError("No joint is selected; select the joint whose weights you want to paint.")
        joint = names.index(selected[-1])
        if ground.opposites is not None:
            joint = int(mirror_of_rig(ground.rig).partners[joint])
        if names[joint] in ground.item.locked_joints:
            raise UserError(f"The weights of {names[joint]} are locked; unlock the joint to paint them.")
        return WeightStroke(self.params, ground, joint)


class WeightStroke(RingStroke[WeightParams, PoseGround, SkinWeights]):
    """One dab at each place where the hand was seen."""

    def __init__(self, params: WeightParams, ground: PoseGround, joint: int) -> None:
        super().__init__(params, ground)
        self.joint = joint
        names = ground.rig.skeleton.names
        self.locked = [j for j, name in enumerate(names) if name in ground.item.locked_joints]

    def brush(self, skin: SkinWeights) -> SkinWeights:
        """The skin after a dab."""
        assert self.last is not None
        hit = self.ground.hit(self.last)
        if hit is None:
            return skin
        metres = self.radius / self.ground.pixels_per_metre(hit.point)
        ring = self.ground.ring(hit, self.ground.skin.points, metres, self.params.falloff, False)
        return self.dab(skin, ring)

    def dab(self, skin: SkinWeights, ring: Ring) -> SkinWeights:
        """The skin with the ring painted, vertices of a seam alike."""
        surface, how, value = self.ground.surface, self.params.how, self.params.value
        amounts = np.zeros(len(surface.site))
        amounts[ring.sites] = ring.weights * min(2.0 * self.dose, 1.0)
        amounts = amounts[surface.site]
        if how == "smooth":
            edges = self.ground.evaluator.get(_edges, self.ground.item.mesh)
            return smoothed(skin, edges, amounts, self.locked, self.joint)
        if how == "replace":
            return painted(skin, self.joint, amounts, value, "replace", self.locked)
        return painted(skin, self.joint, amounts, -value if how == "subtract" else value, "add", self.locked)


def _edges(mesh: Mesh) -> NDArray[np.integer]:
    return freeze(edge_vertices(mesh))
