"""Sculpt brushes on rigs of the shared data: the layers give what the hand saw, held or on a frame of a clip."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from core.camera import Camera, clip_from_world, look_at
from core.document import Document, MeshObject
from core.evaluator import Evaluator
from core.formats.rig_file import read_rig
from core.groom.region import View
from core.leaves import same_bits
from core.pose.pose import Pose
from core.pose.rotation import quaternion_from_euler
from core.pose.synthesis import pose_at
from core.posed import skin_at
from core.workspace import Workspace
from tests.tools.scenes import line
from tools.ground import Sight
from tools.hand import StrokeRecord
from tools.pose_edits import add_rig, hold_pose
from tools.registry import Registry
from tools.session import Session

ANIMATION = Path(os.environ.get("FILOPLUME_DATA", "../shared/data")) / "animation"
SCULPTS = [kind.name for kind in Registry(()).of("pose") if kind.edits == "surface"]
RIGS = (
    "fox_gltf/animated/Fox.glb", "bird_morph_parrot/Parrot.glb",
    "usdskel_bake/usdSkel/testenv/testUsdSkelBakeSkinning/lbs.usda",
)  # fmt: skip
EVALUATOR = Evaluator()

pytestmark = pytest.mark.skipif(not ANIMATION.is_dir(), reason="the shared data are not there")


def opened(name: str) -> Session:
    """The rig in the pose craft."""
    found = read_rig(ANIMATION / name)
    assert found.mesh is not None
    made = add_rig(Document(), MeshObject(id=1, name="rig", mesh=found.mesh, rig=found.rig))
    return Session(made, Workspace(mesh=1, craft="pose", frame=made.first_frame + 0.0), evaluator=EVALUATOR)


def item(s: Session) -> MeshObject:
    return s.document.meshes[0]


def points_of(s: Session) -> np.ndarray:
    return skin_at(item(s), s.workspace.frame, EVALUATOR).points


def size_of(s: Session) -> float:
    return float(np.linalg.norm(np.ptp(item(s).mesh.points, axis=0)))


def some_pose(s: Session) -> Pose:
    """The joint that moves most, bent; or where none moves anything, the first dial at its end."""
    rig = item(s).rig
    assert rig is not None
    moves = np.bincount(rig.skin.joints.ravel(), rig.skin.weights.ravel(), len(rig.skeleton.names))
    if moves.any():
        x, y, z, w = map(float, quaternion_from_euler((20, -30, 40)))
        return Pose(name="bent", rotations={rig.skeleton.names[int(np.argmax(moves))]: (x, y, z, w)})
    return Pose(name="dialled", numbers={rig.controls[0].name: rig.controls[0].high})


def aimed(s: Session, away: float = 0.02) -> tuple[Sight, tuple[float, float]]:
    """A look at the rig as it is posed, and the pixel of the surface nearest to the eye, a little to its inside."""
    points = points_of(s).astype(np.float64)
    middle, size = points.mean(axis=0), size_of(s)
    eye = middle + 1.5 * size * np.array([0.4, 0.2, 0.9])
    camera = Camera(world_from_camera=look_at(eye, middle), field_of_view=0.8, near=0.01 * size, far=10.0 * size)
    pixels, _ = View(clip_from_world(camera, 400, 400), 400, 400).pixels(points)
    x, y = pixels[np.argmin(np.linalg.norm(points - eye, axis=1))]
    inside = (1.0 - away) * np.array([x, y]) + away * pixels.mean(axis=0)
    return Sight(camera, 400, 400), (float(inside[0]), float(inside[1]))


def stroke(s: Session, tool: str) -> np.ndarray:
    """A short stroke; the surface as the hand last saw it."""
    seen: list[np.ndarray] = []
    s.choose(tool, size=60.0, strength=0.7)
    s.changed = lambda old, new: seen.append(points_of(s))
    look, (x, y) = aimed(s)
    s.hand.stroke(look, line((x, y), (x + 12.0, y + 9.0), 5))
    s.changed = None
    return seen[-2]  # the last is what the layers give


@pytest.mark.parametrize("name", RIGS)
def test_layers_give_what_the_hand_saw_with_every_brush(name):
    s = opened(name)
    s.edit("Pose", hold_pose, 1, some_pose(s))
    rest, size, changed = item(s).mesh.points, size_of(s), 0
    for tool in ("draw", *SCULPTS):
        before = points_of(s)
        saw = stroke(s, tool)
        changed += np.abs(saw - before).max() > 1e-5 * size
        assert np.linalg.norm(points_of(s) - saw, axis=1).max() <= 1e-6 * size, tool
    assert changed >= 6, "most brushes changed the surface there"
    held = points_of(s)
    s.edit("Pose", hold_pose, 1, Pose())
    assert np.abs(points_of(s) - rest).max() <= 1e-6 * size
    s.undo()
    assert np.array_equal(points_of(s), held)


def test_on_a_frame_of_a_clip_only_joints_that_are_posed_are_read_and_a_replay_has_the_same_bits():
    """Clips are in single precision: resting joints are away from rest by rounding, which must not count."""
    s = opened(RIGS[0])
    s.set_workspace(frame=s.document.first_frame + 7.0)
    rig = item(s).rig
    assert rig is not None
    noisy = pose_at(rig, s.workspace.frame)
    turned = {j: 2.0 * float(np.linalg.norm(q[:3])) for j, q in noisy.rotations.items()}
    slid = {j: float(np.linalg.norm(t)) for j, t in noisy.translations.items()}
    noise = {j for j in {*turned, *slid} if max(turned.get(j, 0.0), slid.get(j, 0.0)) <= 1e-6}
    assert noise, "otherwise this shows nothing"
    made: list[StrokeRecord] = []
    s.hand.recorded = made.append
    start = s.document
    saw = stroke(s, "draw")
    assert np.linalg.norm(points_of(s) - saw, axis=1).max() <= 1e-6 * size_of(s)
    (layer,) = item(s).correctives.layers
    assert not noise & set(layer.space.controls)
    assert set(layer.space.controls) == {*turned, *slid} - noise
    reached = np.linalg.norm(saw - skin_at(start.meshes[0], s.workspace.frame, EVALUATOR).points, axis=1) > 0
    assert len(layer.vertices) <= 1.1 * reached.sum() + 4
    done = s.document
    s.undo()
    assert s.document is start
    s.hand.replay(made[0])
    assert same_bits(s.document, done)
