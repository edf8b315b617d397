"""Cameras of OpenUSD stages. The reader runs in a bounded child process."""

from __future__ import annotations

from typing import Any

import numpy as np

from core.formats.usd_stage import open_stage

MOST = 10_000


def read_in_child(path: str, frame: float) -> dict[str, Any]:
    """All cameras of the stage at a time code, in its units and axes.

    `names` paths, `world` (N, 4, 4) world_from_camera for column vectors, `lens` (N, 6): orthographic (0 or 1), half
    width and half height (tangents, or units of the stage), near, far, shift of the picture.
    """
    from pxr import Gf, Usd, UsdGeom

    stage = open_stage(path)
    names: list[str] = []
    world, lens = [], []
    for prim in stage.Traverse(Usd.TraverseInstanceProxies()):
        if not prim.IsA(UsdGeom.Camera) or len(names) == MOST:
            continue
        camera = UsdGeom.Camera(prim).GetCamera(Usd.TimeCode(frame))  # its transform is that to the world
        parallel = camera.projection == Gf.Camera.Orthographic
        scale = 0.5 * Gf.Camera.APERTURE_UNIT if parallel else 0.5 / max(camera.focalLength, 1e-9)
        shift = (abs(camera.horizontalApertureOffset) + abs(camera.verticalApertureOffset)) * scale
        near, far = camera.clippingRange.min, camera.clippingRange.max
        names.append(str(prim.GetPath()))
        world.append(np.array(camera.transform).T)
        lens.append((
            float(parallel), camera.horizontalAperture * scale, camera.verticalAperture * scale, near, far, shift))
    said = stage.HasAuthoredMetadata
    return {
        "names": names, "world": np.array(world, np.float64).reshape(-1, 4, 4),
        "lens": np.array(lens, np.float64).reshape(-1, 6),
        "metres_per_unit": float(UsdGeom.GetStageMetersPerUnit(stage)) if said("metersPerUnit") else None,
        "up": str(UsdGeom.GetStageUpAxis(stage)).lower() if said("upAxis") else None,
    }
