"""Blender poses the demo's arm with our script of drivers: how far its surface is from ours.

Needs FILOPLUME_PEERS (see blender_reads). The rig goes there as USD and as glTF, in which Blender lays its bones
otherwise, without its corrections; the script makes them.
"""

from __future__ import annotations

import json
import subprocess
import tempfile
from pathlib import Path
from typing import Literal

import numpy as np

from core.demo.arm import arm
from core.demo.arm_sculpts import arm_sculpts
from core.document import MeshObject
from core.formats.pose_export import write
from core.pose.blend_shapes import targets_from_dense
from core.pose.layers import Sculpt, build
from core.pose.pose import REST, Pose, local_of_pose
from core.pose.pose_space import Kernel
from core.pose.rig import Control
from core.pose.rotation import quaternion_from_euler
from core.pose.skeleton import Skeleton
from core.pose.skinning import deformed, skin_matrices_of
from core.pose.synthesis import evaluate
from core.record import freeze
from core.transform import matrix_from_quaternion
from tests.bench.bench import Row
from tests.bench.blender_reads import peers_python

TITLE = "Blender's surface with our drivers, against ours"
KERNELS: tuple[Kernel, ...] = ("gaussian", "thin-plate", "multiquadric", "wendland", "shepard")
Skinning = Literal["linear", "dual-quaternion"]
ROUNDING = 2e-6  # of the size of the arm: Blender skins in single precision


def run() -> list[Row]:
    """The largest difference of any vertex at sculpted poses and between them, of the size; none without Blender."""
    python = peers_python()
    if python is None:
        return []
    rows = [_row(python, kernel, suffix) for suffix in (".usdc", ".glb") for kernel in KERNELS]
    return [*rows, _row(python, "gaussian", ".usdc", "dual-quaternion")]


def _row(python: str, kernel: Kernel, suffix: str, skinning: Skinning = "linear") -> Row:
    item = _arm(kernel, skinning)
    assert item.rig is not None
    poses = _poses(item)
    skeleton = item.rig.skeleton
    said = {
        "joints": skeleton.names,
        "poses": [{"matrices": skin_matrices_of(skeleton, local_of_pose(skeleton, pose)).tolist(),
                   "numbers": {"flex": 0.0, "swell": 0.0, **pose.numbers}} for pose in poses],
    }
    with tempfile.TemporaryDirectory(prefix="filoplume-bench-") as name:
        folder = Path(name)
        write(folder / f"arm{suffix}", item.replace(correctives=None), 24.0)
        write(folder / "arm.py", item, 24.0)
        (folder / "poses.json").write_text(json.dumps(said))
        script = Path(__file__).parent / "peers" / "blender_drivers.py"
        files = [folder / file for file in (f"arm{suffix}", "arm.py", "poses.json", "seen.npz")]
        done = subprocess.run([python, script, *files], capture_output=True, text=True, check=False, timeout=300)
        if not files[-1].exists():
            raise RuntimeError(f"Blender could not run the script: {done.stdout[-300:]} {done.stderr[-800:]}")
        with np.load(files[-1], allow_pickle=False) as file:
            seen = file["points"]
    size, worst = float(np.linalg.norm(np.ptp(item.mesh.points, axis=0))), 0.0
    for pose, theirs in zip(poses, seen, strict=True):
        ours = evaluate(item.mesh.points, item.rig, item.correctives, pose)
        turned = np.stack([theirs[:, 0], theirs[:, 2], -theirs[:, 1]], axis=1)  # Blender's Z is up
        worst = max(worst, float(np.abs(turned - ours).max()) / size)
    what = f"rig as {suffix}, {skinning}, {kernel}, {len(poses)} poses, largest difference of a vertex, of the size"
    return Row(what, worst, "", ROUNDING)


def _arm(kernel: Kernel, skinning: Skinning) -> MeshObject:
    """The demo's arm with its sculpts, and one more over a joint and a dial; none of them is made after skinning."""
    model = arm(1)
    model = model._replace(rig=model.rig.replace(
        skeleton=_in_frames_of_their_own(model.rig.skeleton), skinning=skinning))
    mesh, points = model.mesh.replace(uvs=None), model.mesh.points  # glTF would split vertices at seams of UVs
    swell = np.where(np.linalg.norm(points - (0.15, 0.03, 0.0), axis=1)[:, None] < 0.08, 0.004, 0.0)
    shapes = targets_from_dense(("swell",), [0], [1.0], [swell.astype(np.float32) * np.ones(3, np.float32)])
    rig = model.rig.replace(clip=None, clips=(), shapes=shapes, controls=(Control(name="swell"), Control(name="flex")))
    both = Pose(name="strained", rotations={"elbow": _turn(0, 0, 80)}, numbers={"flex": 1.0})
    push = np.random.default_rng(0).normal(0.0, 0.003, points.shape) * (points[:, :1] > 0.1)
    sculpts = [s for s in arm_sculpts(model, 0.75) if s.target is not None]
    sculpts.append(Sculpt(both, deformed(points, rig, local_of_pose(rig.skeleton, both)) + push))
    made = build(points, rig, sculpts, kernel=kernel).correctives
    return MeshObject(id=1, name="arm", mesh=mesh, rig=rig, correctives=made)


def _in_frames_of_their_own(skeleton: Skeleton) -> Skeleton:
    """The same joints, each turned at rest and when bound, as hand-made rigs are."""
    turns = matrix_from_quaternion([_turn(20.0 * j, -15.0 * j, 35.0 * j) for j in range(len(skeleton.names))])
    frames = np.tile(np.eye(4), (len(turns), 1, 1))
    frames[:, :3, :3] = turns
    above = np.where((skeleton.parents >= 0)[:, None, None], frames[skeleton.parents], np.eye(4))
    turned: Skeleton = skeleton.replace(
        rest=freeze(above.swapaxes(1, 2) @ skeleton.rest @ frames), bind=freeze(skeleton.bind @ frames))
    return turned


def _poses(item: MeshObject) -> list[Pose]:
    assert item.correctives is not None
    assert item.rig is not None
    rng = np.random.default_rng(1)
    poses = [REST, *(s.pose for layer in item.correctives.layers for s in layer.space.samples)]
    for _ in range(6):
        turns = {joint: _turn(*rng.uniform(-70.0, 70.0, 3)) for joint in item.rig.skeleton.names[1:]}
        moves = {"wrist": (float(rng.normal(0.0, 0.01)), 0.0, 0.01)}
        numbers = {"flex": float(rng.uniform()), "swell": float(rng.uniform())}
        poses.append(Pose(rotations=turns, translations=moves, numbers=numbers))
    return poses


def _turn(*degrees: float) -> tuple[float, float, float, float]:
    x, y, z, w = map(float, quaternion_from_euler(degrees))
    return x, y, z, w
