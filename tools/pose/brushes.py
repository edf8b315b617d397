"""The sculpt brushes: they shape the surface at the pose shown, and the sculpt joins the layer of that pose."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from core.field import field
from core.mesh.mesh import Mesh
from core.overlay import Overlays
from core.pose.carry import carried_surface
from core.pose.pose import Pose
from core.pose.pose_space import Correctives
from core.pose.rig import Rig
from core.pose.rotation import polar_rotation
from core.pose.sculpt import brushes
from core.pose.sculpt.ring import Ring
from core.pose.sculpt.symmetry import reflected
from core.posed import held_points
from core.record import freeze
from tools.brush import RingStroke
from tools.ground import Hit, Pointer
from tools.pose.craft import Points, PoseGround
from tools.pose_edits import pose_named
from tools.ring import BrushParams, ring_radius, ring_strength
from tools.tool import Stroke, Tool, Turn

RISE = 0.15  # of the radius, what one radius of way raises at full strength


class SculptParams(BrushParams):
    """What every sculpt brush has."""

    mirror: Annotated[Literal["topology", "axis"], field(
        "Other side", "How the other side is found with symmetry: by how polygons are joined, or by place at rest.",
        choices=("topology", "axis"))] = "topology"


class SignParams(SculptParams):
    """Of brushes that go both ways."""

    how: Annotated[Literal["out", "in"], field(
        "Way", "Out raises, gathers or presses; in does the opposite of it.", choices=("out", "in"))] = "out"


class SculptStroke(RingStroke[SculptParams, PoseGround, Points]):
    """Dabs along the way, each a change of the surface within its ring."""

    def __init__(
        self, params: SculptParams, ground: PoseGround, dab: Callable[[Points, Ring, float], Points],
        masked: bool = True,
    ) -> None:
        super().__init__(params, ground)
        self.dab, self.masked = dab, masked

    def brush(self, points: Points) -> Points:
        """The surface after the dabs along the way."""
        dabs = self.dabs()
        for dab in dabs:
            hit = self.ground.hit(dab)
            if hit is not None:
                ring = self.ring(hit, points)
                if len(ring.sites):
                    points = self.dab(points, ring, self.dose / len(dabs))
        return points

    def ring(self, hit: Hit, points: Points) -> Ring:
        """The ring around a hit."""
        metres = self.radius / self.ground.pixels_per_metre(hit.point)
        at = points if points.ndim == 2 else self.ground.skin.points
        return self.ground.ring(hit, at, metres, self.params.falloff, self.masked)


class Sculpt(Tool[Any]):
    """What the sculpt brushes share."""

    craft: ClassVar[str] = "pose"
    edits: ClassVar[str] = "surface"
    with_shift: ClassVar[Turn | None] = Turn("sculpt_smooth")
    Params = SculptParams

    def begin(self, ground: PoseGround, pointer: Pointer) -> Stroke[Points]:
        """A stroke of dabs."""
        return SculptStroke(self.params, ground, lambda points, ring, dose: self.dab(ground, points, ring, dose))

    def dab(self, ground: PoseGround, points: Points, ring: Ring, dose: float) -> Points:
        """The surface after one dab; `dose` is strength times way in radii."""
        raise NotImplementedError

    @property
    def sign(self) -> float:
        """Which way it goes."""
        return -1.0 if getattr(self.params, "how", "out") == "in" else 1.0


class Grab(Sculpt):
    """Takes the surface along."""

    name = "grab"
    label = "Grab"
    icon = "grab"
    order = 110
    tooltip = "Takes the surface under the ring along with the hand, at the pose that is shown."
    hint = "Drag: move the surface   Shift: smooth"
    step = "Grab"

    def begin(self, ground: PoseGround, pointer: Pointer) -> Stroke[Points]:
        """A stroke that moves what lay in the ring at press."""
        return GrabStroke(self.params, ground, pointer)


class GrabStroke:
    """Moves the ring of the press along with the hand."""

    def __init__(self, params: SculptParams, ground: PoseGround, pointer: Pointer) -> None:
        self.ground = ground
        self.at = np.zeros(3)
        self.ring: Ring | None = None
        hit = ground.hit(pointer)
        if hit is not None:
            metres = ring_radius(params, ground, pointer) / ground.pixels_per_metre(hit.point)
            ring = ground.ring(hit, ground.skin.points, metres, params.falloff)
            self.ring = ring._replace(weights=ring.weights * ring_strength(params, pointer._replace(pressure=1.0)))
            self.at, self.away = hit.point, ground.ray(pointer)[1]
            self.facing = _carrying(ground, hit)

    def extend(self, points: Points, pointers: tuple[Pointer, ...]) -> Points:
        """The surface moved by what the hand moved in the plane of the picture, at the depth of the press."""
        if self.ring is None or not len(self.ring.sites):
            return points
        origin, direction = self.ground.ray(pointers[-1])
        depth = float((self.at - origin) @ self.away) / max(float(direction @ self.away), 1e-9)
        now = origin + depth * direction
        step, self.at = now - self.at, now
        if not step.any():
            return points
        return brushes.grab(self.ground.surface, points, self.ring, self.facing @ step)

    def finish(self, points: Points) -> Points:
        """Nothing more is done at release."""
        return points

    def overlays(self) -> Overlays:
        """Nothing but the ring."""
        return ()


def _carrying(ground: PoseGround, hit: Hit) -> NDArray[np.float64]:
    """The matrix (3, 3) that carries a movement of the hand to this side of the body, through the rest pose."""
    if ground.opposites is None:
        return np.eye(3)
    here, there = ground.skin.triangles.vertices[hit.triangle], ground.corners(hit)
    if (there < 0).any():
        return reflected(np.eye(3))
    ours, theirs = (_turn(ground, vertices) for vertices in (here, there))
    carried: NDArray[np.float64] = theirs @ reflected(np.eye(3)) @ ours.T
    return carried


def _turn(ground: PoseGround, vertices: NDArray[np.int32]) -> NDArray[np.float64]:
    """The rotation (3, 3) nearest to what the pose makes of a triangle (3,)."""
    frames = []
    for points in (ground.rest.points, ground.skin.points):
        a, b, c = points[vertices].astype(np.float64)
        normal = np.cross(b - a, c - a)
        frames.append(np.stack([b - a, c - a, normal / max(float(np.linalg.norm(normal)), 1e-300) ** 0.5], axis=1))
    turned: NDArray[np.float64] = polar_rotation((frames[1] @ np.linalg.pinv(frames[0]))[None])[0]
    return turned


class Draw(Sculpt):
    """Raises the surface in one direction."""

    name = "draw"
    label = "Draw"
    icon = "draw"
    order = 111
    tooltip = "Raises the surface under the ring in the direction it faces, for muscles and folds; Ctrl digs."
    hint = "Drag: raise   Ctrl: dig   Shift: smooth"
    step = "Draw"
    with_ctrl = Turn("draw", {"how": "in"})
    with_eraser = Turn("draw", {"how": "in"})
    Params = SignParams

    def dab(self, ground: PoseGround, points: Points, ring: Ring, dose: float) -> Points:
        """A little higher."""
        return brushes.draw(ground.surface, points, ring, self.sign * RISE * dose * ring.radius)


class Inflate(Sculpt):
    """Blows the surface up along its normals."""

    name = "inflate"
    label = "Inflate"
    icon = "inflate"
    order = 112
    tooltip = "Moves the surface out along its own normals, which gives lost volume back; Ctrl deflates."
    hint = "Drag: inflate   Ctrl: deflate   Shift: smooth"
    step = "Inflate"
    with_ctrl = Turn("inflate", {"how": "in"})
    with_eraser = Turn("inflate", {"how": "in"})
    Params = SignParams

    def dab(self, ground: PoseGround, points: Points, ring: Ring, dose: float) -> Points:
        """A little wider."""
        return brushes.inflate(ground.surface, points, ring, self.sign * RISE * dose * ring.radius)


class SculptSmooth(Sculpt):
    """Evens bumps out."""

    name = "sculpt_smooth"
    label = "Smooth surface"
    icon = "sculpt-smooth"
    order = 120
    tooltip = "Evens out bumps and pinches of the surface under the ring, at the pose that is shown."
    hint = "Drag: smooth   Ctrl: relax"
    step = "Smooth surface"
    with_shift = None
    with_ctrl = Turn("relax")

    def dab(self, ground: PoseGround, points: Points, ring: Ring, dose: float) -> Points:
        """A little smoother."""
        return brushes.smooth(ground.surface, points, ring, min(2.0 * dose, 1.0))


class Relax(Sculpt):
    """Evens the polygons out."""

    name = "relax"
    label = "Relax"
    icon = "relax"
    order = 121
    tooltip = "Lets stretched and squeezed polygons slide back to their lengths at rest; the form stays."
    hint = "Drag: relax   Shift: smooth"
    step = "Relax"

    def dab(self, ground: PoseGround, points: Points, ring: Ring, dose: float) -> Points:
        """A little calmer."""
        return brushes.relax(ground.surface, points, ring, min(4.0 * dose, 1.0))


class Pinch(Sculpt):
    """Gathers the surface to a crease."""

    name = "pinch"
    label = "Pinch"
    icon = "pinch"
    order = 122
    tooltip = "Draws the surface together along itself, for creases such as that of an elbow; Ctrl spreads."
    hint = "Drag: pinch   Ctrl: spread   Shift: smooth"
    step = "Pinch"
    with_ctrl = Turn("pinch", {"how": "in"})
    with_eraser = Turn("pinch", {"how": "in"})
    Params = SignParams

    def dab(self, ground: PoseGround, points: Points, ring: Ring, dose: float) -> Points:
        """A little closer."""
        return brushes.pinch(ground.surface, points, ring, self.sign * min(0.4 * dose, 1.0))


class Flatten(Sculpt):
    """Presses the surface flat."""

    name = "flatten"
    label = "Flatten"
    icon = "flatten"
    order = 123
    tooltip = "Presses the surface under the ring onto its mean plane; Ctrl makes it more pronounced."
    hint = "Drag: flatten   Ctrl: enhance   Shift: smooth"
    step = "Flatten"
    with_ctrl = Turn("flatten", {"how": "in"})
    with_eraser = Turn("flatten", {"how": "in"})
    Params = SignParams

    def dab(self, ground: PoseGround, points: Points, ring: Ring, dose: float) -> Points:
        """A little flatter."""
        return brushes.flatten(ground.surface, points, ring, self.sign * min(dose, 1.0))


class RestoreParams(SculptParams):
    """Settings of Restore."""

    towards: Annotated[str, field(
        "Towards", "Name of the sculpted or stored pose whose shape is taken; empty goes back to the skin.")] = ""


class Restore(Sculpt):
    """Takes sculpting back."""

    name = "restore"
    label = "Restore"
    icon = "restore"
    order = 124
    tooltip = "Brings the surface under the ring back to what the skin alone gives, or to another pose's shape."
    hint = "Drag: take the sculpt back   Shift: smooth"
    step = "Restore"
    Params = RestoreParams

    def begin(self, ground: PoseGround, pointer: Pointer) -> Stroke[Points]:
        """A stroke of dabs; UserError when the pose it goes towards is not there."""
        self.goal(ground)
        return super().begin(ground, pointer)

    def goal(self, ground: PoseGround) -> Points:
        """The surface (V, 3) that it goes towards, remembered."""
        item, evaluator = ground.item, ground.evaluator
        if not self.params.towards:
            bare: Points = evaluator.get(held_points, item.mesh, ground.rig, None, ground.pose, evaluator=evaluator)
            return bare
        other = pose_named(item, self.params.towards)
        carried: Points = evaluator.get(_carried, item.mesh, ground.rig, item.correctives, other, ground.pose)
        return carried

    def dab(self, ground: PoseGround, points: Points, ring: Ring, dose: float) -> Points:
        """A little nearer to it."""
        return brushes.restore(ground.surface, points, ring, self.goal(ground), min(2.0 * dose, 1.0))


def _carried(mesh: Mesh, rig: Rig, correctives: Correctives | None, source: Pose, at: Pose) -> Points:
    return freeze(carried_surface(mesh.points, rig, correctives, source, at))
