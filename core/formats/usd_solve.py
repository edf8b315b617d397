"""A solved camera as OpenUSD: one camera with a sample per frame, and the points of the scene.

Y is up; the picture is `FILM` millimetres wide, the focal length stands in the same unit (tenths of the stage's unit,
as USD has them, whatever that is: a solve has no size until somebody measures something).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from core.errors import UserError
from core.match.solve.report import Report
from core.match.solve.solve import Solution
from core.match.solve.state import ASPECT, CENTRE_X, CENTRE_Y

FILM = 36.0
FLIP = np.diag([1.0, -1.0, -1.0])  # y down, z ahead <-> y up, z back
POINT = 0.01  # width of a point over its distance


def write(path: Path, solution: Solution, report: Report, names: list[str], fps: float = 24.0) -> None:
    """Write camera ``/Solve/camera`` and points ``/Solve/points``; frames are numbered as the plate's files are.

    Raises
    ------
    UserError
        The file could not be written.
    """
    from pxr import Gf, Sdf, Usd, UsdGeom, Vt

    layer = Sdf.Layer.CreateAnonymous(path.suffix.lower())
    stage = Usd.Stage.Open(layer)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(fps)
    stage.SetFramesPerSecond(fps)
    known = np.flatnonzero(solution.known)
    frames = solution.frames[known]
    stage.SetStartTimeCode(float(frames[0]))
    stage.SetEndTimeCode(float(frames[-1]))
    root = UsdGeom.Xform.Define(stage, "/Solve")
    stage.SetDefaultPrim(root.GetPrim())
    camera = UsdGeom.Camera.Define(stage, "/Solve/camera")
    width, height = solution.size
    state = solution.state
    stretch = float(np.exp(state.lens[ASPECT]))
    camera.CreateHorizontalApertureAttr(FILM)
    camera.CreateVerticalApertureAttr(FILM * height / width / stretch)
    camera.CreateHorizontalApertureOffsetAttr(-(state.lens[CENTRE_X] - 0.5 * (width - 1)) * FILM / width)
    camera.CreateVerticalApertureOffsetAttr((state.lens[CENTRE_Y] - 0.5 * (height - 1)) * FILM / width / stretch)
    pose = camera.MakeMatrixXform()
    focal = camera.CreateFocalLengthAttr()
    zooms = solution.free.zoom is not None
    if not zooms:
        focal.Set(float(report.focal_px[known[0]]) * FILM / width)
    centres = state.centres() @ FLIP
    for row, frame in zip(known, frames, strict=True):
        matrix = np.eye(4)
        matrix[:3, :3] = (FLIP @ state.rotation[row].T @ FLIP).T  # USD's vectors are rows
        matrix[3, :3] = centres[row]
        pose.Set(Gf.Matrix4d(matrix), float(frame))
        if zooms:
            focal.Set(float(report.focal_px[row]) * FILM / width, float(frame))
    held = np.flatnonzero(solution.held)
    places = state.points[held] @ FLIP
    distance = float(np.median(np.linalg.norm(places - centres[known].mean(axis=0), axis=1)))
    near = max(1e-6, 0.01 * distance)
    camera.CreateClippingRangeAttr(Gf.Vec2f(near, 100.0 * distance))
    points = UsdGeom.Points.Define(stage, "/Solve/points")
    points.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(places, np.float32)))
    points.CreateIdsAttr(Vt.Int64Array.FromNumpy(held.astype(np.int64)))
    points.CreateWidthsAttr([POINT * distance])
    points.SetWidthsInterpolation(UsdGeom.Tokens.constant)
    said = points.GetPrim().CreateAttribute("primvars:trackNames", Sdf.ValueTypeNames.StringArray)
    said.Set([names[k] for k in held])
    root.GetPrim().SetCustomDataByKey("filoplume:solve", {
        "kind": report.kind, "rms_px": report.rms_px, "k1": float(state.lens[1]), "k2": float(state.lens[2]),
        "width": width, "height": height,
    })
    if not layer.Export(str(path)):
        raise UserError(f"{path.name} could not be written; look whether the folder is there and has room.")
