"""The camera of a USD stage over its frames, with the points that stand in it, as read in the child process.

It loads nothing of the solver, so that the child starts in a fraction of a second.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from core.errors import UserError
from core.formats.usd_stage import open_stage

MOST_FRAMES, MOST_POINTS = 100_000, 5_000_000
KEY = "filoplume:solve"  # of what a solve of this program says beside its camera


def read_in_child(path: str) -> dict[str, Any]:
    """`frames` (F,), `world` (F, 4, 4) for column vectors, `film` (F, 5): focal length, apertures, offsets."""
    from pxr import Usd, UsdGeom

    name = Path(path).name
    stage = open_stage(path)
    cameras = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Camera)]
    if not cameras:
        raise UserError(f"{name} holds no camera.")
    camera = UsdGeom.Camera(cameras[0])
    first, last = stage.GetStartTimeCode(), stage.GetEndTimeCode()
    if last - first >= MOST_FRAMES:
        raise UserError(f"{name} has more than {MOST_FRAMES} frames.")
    frames = np.arange(int(np.ceil(first)), int(np.floor(last)) + 1)
    samples = UsdGeom.Xformable(cameras[0]).GetTimeSamples()
    if samples and all(float(time).is_integer() for time in samples):
        frames = np.array(samples).astype(int)
    world, film = [], []
    for frame in frames:
        now = camera.GetCamera(Usd.TimeCode(float(frame)))
        world.append(np.array(now.transform).T)
        film.append((now.focalLength, now.horizontalAperture, now.verticalAperture, now.horizontalApertureOffset,
                     now.verticalApertureOffset))
    points, names = np.zeros((0, 3), np.float32), []
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.Points):
            points = np.array(UsdGeom.Points(prim).GetPointsAttr().Get() or points, np.float32).reshape(-1, 3)
            said = prim.GetAttribute("primvars:trackNames").Get() if prim.HasAttribute("primvars:trackNames") else None
            names = [str(one) for one in said] if said is not None and len(said) == len(points) else []
            break
    data = stage.GetDefaultPrim().GetCustomDataByKey(KEY) if stage.GetDefaultPrim() else None
    data = data if isinstance(data, dict) else {}
    lens = np.array(data.get("lens_numbers", ()), np.float64).reshape(-1)
    size = np.array([data.get("width", 0), data.get("height", 0)], np.int64)
    if len(points) > MOST_POINTS:
        raise UserError(f"{name} has more than {MOST_POINTS:,} points.")
    return {
        "frames": np.asarray(frames, np.int64), "world": np.array(world, np.float64).reshape(-1, 4, 4),
        "film": np.array(film, np.float64).reshape(-1, 5), "points": points, "names": names, "lens": lens,
        "size": size, "up": str(UsdGeom.GetStageUpAxis(stage)).lower(),
    }
