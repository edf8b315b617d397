"""Rigs with poses, to be written out and read back."""

import numpy as np

from core.demo.arm import arm
from core.document import MeshObject
from core.pose.blend_shapes import targets_from_dense
from core.pose.clip import clip_of_matrices
from core.pose.layers import Sculpt, build
from core.pose.pose import Pose, local_of_pose
from core.pose.rig import Control
from core.pose.rotation import quaternion_from_euler
from core.pose.skinning import deformed
from core.transform import slerp


def turned(*degrees):
    return tuple(map(float, quaternion_from_euler(degrees)))


def between(a, b, f):
    """A pose on the way from a to b."""
    still = (0.0, 0.0, 0.0, 1.0)
    return Pose(
        rotations={j: tuple(map(float, slerp(a.rotations.get(j, still), b.rotations.get(j, still), f)))
                   for j in {**a.rotations, **b.rotations}},
        numbers={n: (1 - f) * a.numbers.get(n, 0.0) + f * b.numbers.get(n, 0.0) for n in {**a.numbers, **b.numbers}},
    )


BENT = Pose(name="bent", rotations={"elbow": turned(0, 0, 110)})
HALF = Pose(name="half", rotations={"elbow": turned(10, 5, 50)})
TWISTED = Pose(name="twisted", rotations={"wrist": turned(160, 0, 0)})
UPSIDE = Pose(name="upside", rotations={"wrist": turned(180, 0, 0)})
FLEXED = Pose(name="flexed", numbers={"strain": 0.8})
BOTH = Pose(name="both", rotations={"elbow": turned(0, 0, 100)}, numbers={"strain": 0.8})
POSES = (BENT, HALF, TWISTED, UPSIDE, FLEXED, BOTH)
ELSEWHERE = (
    Pose(), BENT, HALF, TWISTED, UPSIDE, BOTH, between(BENT, TWISTED, 0.4), between(BOTH, UPSIDE, 0.7),
    Pose(rotations={"elbow": turned(40, 60, 20), "shoulder": turned(0, 0, 30)}, translations={"elbow": (0.01, 0, 0.02)},
         numbers={"strain": 0.35, "swell": 0.75}),
    Pose(numbers={"swell": 1.6, "strain": -0.4}),
)


def posed_arm(poses=POSES, levels=1, seed=4, rig=None, **options):
    """An arm (or another rig of its mesh) with a blend shape with an inbetween, a dial, a clip, and random sculpts."""
    made = arm(levels)
    rng = np.random.default_rng(seed)
    count = len(made.mesh.points)
    swell = np.zeros((2, count, 3), np.float32)
    near = np.linalg.norm(made.mesh.points - (0.15, 0.03, 0.0), axis=1) < 0.08
    swell[:, near] = rng.normal(0.0, 0.004, (2, int(near.sum()), 3))
    shapes = targets_from_dense(("swell",), [0, 0], [0.5, 1.0], list(swell))
    controls = (Control(name="swell"), Control(name="strain", low=-1.0, high=1.0))
    rig = (rig or made.rig).replace(shapes=shapes, controls=controls)
    frames = [between(Pose(), BENT, f) for f in np.linspace(0.0, 1.0, 5)]
    frames += [between(BENT, BOTH, f) for f in np.linspace(0.2, 1.0, 5)]
    rig = rig.replace(clip=clip_of_matrices(
        "curl", 1001.0, 24.0, [local_of_pose(rig.skeleton, p) for p in frames], ("strain", "swell"),
        [(p.numbers.get("strain", 0.0), 0.12 * f) for f, p in enumerate(frames)]))
    sculpts = []
    for pose in poses:
        surface = deformed(made.mesh.points, rig, local_of_pose(rig.skeleton, pose)).astype(np.float64)
        if pose.rotations.get("wrist"):
            middle = (0.445, 0.0, 0.0)
        else:
            middle = (0.29, 0.0, 0.0) if pose.rotations else (0.16, 0.02, 0.0)
        reach = np.linalg.norm(made.mesh.points - middle, axis=1)
        weight = np.clip(1.0 - reach / 0.1, 0.0, 1.0)[:, None]
        sculpts.append(Sculpt(pose, surface + weight * rng.normal(0.0, 0.006, (count, 3))))
    correctives = build(made.mesh.points, rig, sculpts, **options).correctives
    return MeshObject(id=1, name="arm", mesh=made.mesh, rig=rig, correctives=correctives)
