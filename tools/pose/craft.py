"""The craft of posing: strokes change the surface at the pose shown, the mask, the skin weights, or the pose."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from core.camera import clip_from_world
from core.document import Document, MeshObject, with_mesh
from core.errors import UserError
from core.groom.region import View
from core.mesh.mesh import Mesh
from core.pose.controls import rests, without_noise
from core.pose.edit_layers import refresh
from core.pose.pose import Pose, moved_controls
from core.pose.rig import Rig
from core.pose.sculpt.ring import Ring, ring_at
from core.pose.sculpt.surface import SculptSurface, sculpt_surface
from core.pose.sculpt.symmetry import Opposites, mirrored_ring, opposites_by_axis, opposites_by_topology
from core.pose.skeleton import SkinWeights
from core.pose.synthesis import pose_at
from core.posed import held_points, skin_at
from core.record import freeze
from core.workspace import Respect
from tools.craft import Work
from tools.ground import Hit, Sight
from tools.pose_edits import add_sculpt, same_pose, sculpt_name
from tools.skin_ground import SkinGround
from tools.tool import Tool

Points = NDArray[np.float32]
Way = Literal["topology", "axis"]


class Posing(NamedTuple):
    """What manipulators change: the pose that is held, None while it is that of the clip, and the selected joints."""

    pose: Pose | None
    selection: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class PoseGround(SkinGround):
    """What a stroke of posing works on.

    rig : that poses the mesh. pose : the one shown, held or of the clip. respect : as in the workspace.
    opposites : (V,) int32 the vertex on the other side of each; None on the side of the hand.
    """

    rig: Rig
    pose: Pose
    respect: Respect
    opposites: Opposites | None = None

    @property
    def surface(self) -> SculptSurface:
        """What brushes know of the mesh, made once."""
        return self.evaluator.get(sculpt_surface, self.item.mesh)

    def corners(self, hit: Hit) -> NDArray[np.int32]:
        """The three vertices (3,) around a hit, on this side."""
        vertices: NDArray[np.int32] = self.skin.triangles.vertices[hit.triangle]
        return vertices if self.opposites is None else self.opposites[vertices]

    def opposite(self, hit: Hit) -> NDArray[np.float64]:
        """The point (3,) on the other side of the body, however it is posed."""
        there = _opposites(self.item.mesh, "axis")[self.skin.triangles.vertices[hit.triangle]] \
            if self.opposites is None else self.corners(hit)
        if (there < 0).any():
            return hit.point * [-1.0, 1.0, 1.0]
        point: NDArray[np.float64] = hit.barycentric.astype(np.float64) @ self.skin.points[there]
        return point

    def ring(self, hit: Hit, points: Points, radius: float, shape: Any, masked: bool = True) -> Ring:
        """The ring of a brush of `radius` metres around a hit, on this side, as the surface was at press.

        Its centre is where that place is on `points` now.
        """
        mask = self.item.mask if masked else None
        at_press = hit.barycentric.astype(np.float64) @ self.skin.points[self.skin.triangles.vertices[hit.triangle]]
        ring = ring_at(self.surface, self.skin.points, at_press, radius, shape, None if self.mirrored else mask)
        if self.opposites is not None:
            ring = mirrored_ring(ring, self.opposites)
            if mask is not None:
                ring = ring._replace(weights=ring.weights * (1.0 - mask[ring.sites].astype(np.float64)))
        corners = self.corners(hit)
        if (corners < 0).any():
            return ring
        return ring._replace(centre=hit.barycentric.astype(np.float64) @ points[corners].astype(np.float64))


class PoseCraft:
    """Strokes that change a mesh with a rig."""

    name = "pose"
    label = "Pose"
    first = "grab"
    edits = ("surface", "mask", "weights", "posing")

    def __init__(self) -> None:
        self._known: tuple[tuple[Any, ...], tuple[PoseGround, ...]] | None = None

    def grounds(self, session: Work, sight: Sight, tool: Tool[Any]) -> tuple[PoseGround, ...]:
        """The mesh on one or both sides; UserError when it is locked, hidden, or at rest and would be sculpted."""
        workspace, item, evaluator = session.workspace, session.mesh, session.evaluator
        if item.rig is None:
            raise UserError(f"{item.name} has no rig; import one with a skeleton or blend shapes to pose it.")
        if item.locked or item.hidden:
            word, done = ("locked", "unlock") if item.locked else ("hidden", "show")
            raise UserError(f"{item.name} is {word}; {done} it in the scene panel to work on it.")
        way: Way = getattr(tool.params, "mirror", "topology")
        key = item, workspace.frame, workspace.respect, sight, session.history.current.unit, way
        if self._known is None or not all(a is b or a == b for a, b in zip(self._known[0], key, strict=True)):
            self._known = key, _sides(session, item, item.rig, sight, way)
        grounds = self._known[1]
        if tool.edits == "surface" and not moved_controls(grounds[0].pose, rests(item.rig)):
            raise UserError("A corrective needs a pose away from rest: turn a joint or move a control, then sculpt.")
        assert evaluator is grounds[0].evaluator
        return grounds

    def matter(self, tool: Tool[Any], ground: PoseGround) -> Any:
        """What the tool changes: vertices as shown, mask, weights, or the pose and its joints."""
        item = ground.item
        mask = np.zeros(len(item.mesh.points), np.float32) if item.mask is None else item.mask
        return {
            "surface": ground.skin.points, "mask": mask, "weights": ground.rig.skin,
            "posing": Posing(item.pose, item.joint_selection),
        }[tool.edits]

    def shown(self, document: Document, tool: Tool[Any], ground: PoseGround, matter: Any) -> Document:
        """The document with what the tool changed; a sculpt is shown as it is and joins its layer at release."""
        item = ground.item
        if tool.edits == "surface":
            return with_mesh(document, item.replace(surface=freeze(matter)))
        if tool.edits == "posing":
            return with_mesh(document, item.replace(pose=matter.pose, joint_selection=matter.selection))
        if tool.edits == "mask":
            return with_mesh(document, item.replace(mask=matter))
        return with_mesh(document, item.replace(rig=ground.rig.replace(skin=cast(SkinWeights, matter))))

    def document(self, document: Document, tool: Tool[Any], ground: PoseGround, matter: Any) -> Document:
        """The document with what the tool changed, sculpts in the layers of their poses."""
        before = self.matter(tool, ground)
        if matter is before or (tool.edits == "posing" and _poses_nothing(ground, matter)):
            return document
        item = ground.item
        if tool.edits == "surface":
            pose = ground.pose.replace(name=sculpt_name(item.correctives, ground.pose))
            return add_sculpt(document, item.id, pose, matter if item.pose is not None else _at(ground, matter))
        if tool.edits == "mask" and item.mask is None and not matter.any():
            return document
        changed = self.shown(document, tool, ground, matter)
        if tool.edits == "weights" and item.correctives is not None:  # every sculpt is what it was
            rig = ground.rig.replace(skin=matter)
            made = refresh(item.mesh.points, rig, item.correctives)
            changed = with_mesh(changed, item.replace(rig=rig, correctives=made.correctives))
        return changed

    def place(self, session: Work, ground: PoseGround) -> dict[str, Any]:
        """The mesh, the frame and the symmetry."""
        return {"mesh": ground.item.id, "frame": ground.frame, "respect": ground.respect}

    def ready(self, tool: Tool[Any], ground: PoseGround) -> bool:
        """Nothing here is slow to make."""
        return True

    def wait(self, ground: PoseGround) -> None:
        """Nothing to wait for."""

    def preparation(self, session: Work) -> Callable[[], object] | None:
        """What brushes know of the mesh, so that the first dab does not wait for it."""
        try:
            mesh, evaluator = session.mesh.mesh, session.evaluator
        except UserError:
            return None
        return None if evaluator.knows(sculpt_surface, mesh) else lambda: evaluator.get(sculpt_surface, mesh)


def _sides(session: Work, item: MeshObject, rig: Rig, sight: Sight, way: Way) -> tuple[PoseGround, ...]:
    workspace, evaluator = session.workspace, session.evaluator
    frame, respect = workspace.frame, workspace.respect
    pose = item.pose if item.pose is not None else evaluator.get(_pose_of_clip, rig, frame=frame)
    opposites = evaluator.get(_opposites, item.mesh, way=way) if respect.symmetry else None
    return tuple(
        PoseGround(
            sight, View(clip_from_world(sight.camera, sight.width, sight.height), sight.width, sight.height),
            session.history.current.unit, other is not None, item=item, frame=frame,
            skin=skin_at(item, frame, evaluator), rest=skin_at(item, None, evaluator), evaluator=evaluator, rig=rig,
            pose=pose, respect=respect, opposites=other,
        )
        for other in ((None,) if opposites is None else (None, opposites))
    )


def _pose_of_clip(rig: Rig, frame: float) -> Pose:
    return without_noise(rig, pose_at(rig, frame))


def _poses_nothing(ground: PoseGround, matter: Posing) -> bool:
    """True when a stroke neither selected anything nor left the joints elsewhere than they were."""
    item = ground.item
    return matter.selection == item.joint_selection and (
        matter.pose is item.pose or (matter.pose is not None and same_pose(matter.pose, ground.pose)))


def _at(ground: PoseGround, sculpted: Points) -> Points:
    """What was sculpted on a frame of the clip at the pose of that frame: without its rounding and scaled joints."""
    item, evaluator = ground.item, ground.evaluator
    posed = held_points(item.mesh, ground.rig, item.correctives, ground.pose, evaluator=evaluator)
    at_pose: Points = posed + (sculpted - ground.skin.points)
    return at_pose


def _opposites(mesh: Mesh, way: Way) -> Opposites:
    return freeze(opposites_by_axis(mesh.points) if way == "axis" else opposites_by_topology(mesh))
