"""The skeleton of the mesh that is posed, drawn over the picture while the craft is posing."""

from __future__ import annotations

from app.window.desk import Desk
from core.camera import Camera
from core.overlay import Overlays
from core.pose.synthesis import pose_at
from viewport.skeleton import joint_places, skeleton_marks


def skeleton_of(desk: Desk, camera: Camera, size: tuple[int, int], ratio: float) -> Overlays:
    """Marks of the skeleton in the pose that is shown; nothing in another craft or where the mesh is hidden."""
    item = desk.posed
    if desk.session.tool.craft != "pose" or item is None or item.rig is None or item.hidden:
        return ()
    evaluator, frame = desk.session.evaluator, desk.workspace.frame
    pose = item.pose if item.pose is not None else evaluator.get(pose_at, item.rig, frame=frame)
    places = evaluator.get(joint_places, item.rig.skeleton, pose)
    return skeleton_marks(item.rig.skeleton, places, item.joint_selection, camera, size, ratio)
