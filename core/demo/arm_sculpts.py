"""Three sculpts on the demo arm, made with the brushes: what linear skinning breaks at elbow, forearm and shoulder."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.demo.arm import Arm
from core.pose.layers import Sculpt
from core.pose.pose import Pose, local_of_pose
from core.pose.rotation import quaternion_from_euler
from core.pose.sculpt.brushes import draw, inflate, relax, smooth
from core.pose.sculpt.ring import ring_at
from core.pose.sculpt.surface import SculptSurface, sculpt_surface
from core.pose.skinning import deformed

# brush, where at rest in metres, radius, strength: a height in metres for draw and inflate, a share for the others
Dab = tuple[str, tuple[float, float, float], float, float]
STROKES: dict[str, tuple[str, tuple[float, float, float], tuple[Dab, ...]]] = {
    "elbow bent": ("elbow", (0.0, 0.0, 115.0), (
        ("smooth", (0.290, 0.038, 0.0), 0.075, 1.0),
        ("smooth", (0.290, 0.038, 0.0), 0.075, 1.0),
        ("smooth", (0.290, 0.000, 0.046), 0.060, 0.8),
        ("smooth", (0.290, 0.000, -0.046), 0.060, 0.8),
        ("draw", (0.170, 0.058, 0.004), 0.105, 0.017),
        ("inflate", (0.350, 0.030, 0.030), 0.070, 0.004),
        ("inflate", (0.350, 0.030, -0.026), 0.070, 0.004),
        ("draw", (0.288, -0.048, 0.0), 0.046, 0.012),
        ("smooth", (0.240, -0.044, 0.0), 0.050, 0.6),
        ("relax", (0.290, -0.010, 0.0), 0.140, 1.0),
    )),
    "forearm twisted": ("wrist", (150.0, 0.0, 0.0), (
        ("inflate", (0.400, 0.030, 0.020), 0.080, 0.002),
        ("relax", (0.445, 0.0, 0.033), 0.120, 1.0),
    )),
    "shoulder raised": ("shoulder", (0.0, 0.0, 72.0), (
        ("smooth", (-0.040, 0.085, 0.0), 0.110, 1.0),
        ("smooth", (-0.040, 0.085, 0.0), 0.110, 1.0),
        ("smooth", (-0.010, 0.060, 0.060), 0.090, 0.9),
        ("smooth", (-0.010, 0.060, -0.060), 0.090, 0.9),
        ("draw", (0.035, 0.066, 0.020), 0.085, 0.018),
        ("draw", (-0.020, -0.080, 0.0), 0.100, -0.010),
        ("smooth", (-0.010, -0.090, 0.0), 0.130, 0.7),
        ("relax", (0.0, 0.0, 0.070), 0.160, 0.8),
    )),
}


def arm_sculpts(model: Arm, share: float = 1.0) -> tuple[Sculpt, ...]:
    """The sculpts: dual quaternion skinning, which keeps the volume, worked over with brushes.

    Parameters
    ----------
    share : of the angle and of every dab, 0 .. 1: sculpts on the way to the whole ones, to compare methods by.
    """
    surface = sculpt_surface(model.mesh)
    kept = model.rig.replace(skinning="dual-quaternion")
    out = []
    for name, (joint, degrees, dabs) in STROKES.items():
        x, y, z, w = map(float, quaternion_from_euler(share * np.array(degrees)))
        named = name if share == 1.0 else f"{name} to {share:.0%}"
        pose = Pose(name=named, rotations={joint: (x, y, z, w)})
        points = deformed(model.mesh.points, kept, local_of_pose(model.rig.skeleton, pose))
        for dab in dabs:
            points = _dabbed(surface, model.mesh.points, points, (*dab[:3], share * dab[3]))
        out.append(Sculpt(pose, points))
    return tuple(out)


def _dabbed(
    surface: SculptSurface, rest: NDArray[np.float32], points: NDArray[np.float32], dab: Dab
) -> NDArray[np.float32]:
    brush, place, radius, strength = dab
    nearest = int(np.argmin(np.linalg.norm(rest - np.array(place), axis=1)))
    ring = ring_at(surface, points, points[nearest], radius)
    if brush == "draw":
        return draw(surface, points, ring, strength)
    if brush == "inflate":
        return inflate(surface, points, ring, strength)
    if brush == "smooth":
        return smooth(surface, points, ring, strength, 6)
    return relax(surface, points, ring, strength, 8)
