"""A solved camera as OpenUSD: one camera with a sample per frame, and the points of the scene.

Y is up; the picture is `FILM` millimetres wide, the focal length stands in the same unit (tenths of the stage's unit,
as USD has them, whatever that is: a solve has no size until somebody measures something). USD knows no bend of a lens:
its numbers stand in the custom data of ``/Solve``, and the picture of the camera is the straight one.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from core.errors import UserError
from core.formats.sandbox import run_bounded
from core.formats.usd_camera_path import KEY
from core.match.lens import MODELS, model_of, start_lens
from core.match.solve.shot import Shot, shot_from_up
from core.match.solve.state import CENTRE_X, CENTRE_Y

SUFFIXES = (".usda", ".usdc", ".usd")
FILM = 36.0
POINT = 0.01  # width of a point over its distance
SECONDS, MEMORY = 60.0, 4 << 30
WIDTH = 1920  # of the plate, where a file does not say


def write(path: Path, shot: Shot, said: dict[str, Any], fps: float = 24.0) -> None:
    """Write camera ``/Solve/camera`` and points ``/Solve/points``; frames are numbered as the plate's files are.

    said : more for the custom data of ``/Solve``, such as how good the solve is.

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
    stage.SetStartTimeCode(float(shot.frames[0]))
    stage.SetEndTimeCode(float(shot.frames[-1]))
    root = UsdGeom.Xform.Define(stage, "/Solve")
    stage.SetDefaultPrim(root.GetPrim())
    camera = UsdGeom.Camera.Define(stage, "/Solve/camera")
    width, height = shot.size
    camera.CreateHorizontalApertureAttr(FILM)
    camera.CreateVerticalApertureAttr(FILM * height / width / shot.stretch)
    lens = shot.lens
    camera.CreateHorizontalApertureOffsetAttr(-(lens[CENTRE_X] - 0.5 * (width - 1)) * FILM / width)
    camera.CreateVerticalApertureOffsetAttr((lens[CENTRE_Y] - 0.5 * (height - 1)) * FILM / width / shot.stretch)
    pose = camera.MakeMatrixXform()
    focal = camera.CreateFocalLengthAttr()
    if not shot.zooms:
        focal.Set(float(shot.focal[0]) * FILM / width)
    matrices, places = shot.up()
    for row, frame in enumerate(shot.frames):
        pose.Set(Gf.Matrix4d(matrices[row].T), float(frame))  # USD's vectors are rows
        if shot.zooms:
            focal.Set(float(shot.focal[row]) * FILM / width, float(frame))
    middle = matrices[:, :3, 3].mean(axis=0)
    distance = float(np.median(np.linalg.norm(places - middle, axis=1))) if len(places) else 1.0
    camera.CreateClippingRangeAttr(Gf.Vec2f(max(1e-6, 0.01 * distance), 100.0 * distance))
    points = UsdGeom.Points.Define(stage, "/Solve/points")
    points.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(places, np.float32)))
    points.CreateIdsAttr(Vt.Int64Array.FromNumpy(np.arange(len(places))))
    points.CreateWidthsAttr([POINT * distance])
    points.SetWidthsInterpolation(UsdGeom.Tokens.constant)
    names = points.GetPrim().CreateAttribute("primvars:trackNames", Sdf.ValueTypeNames.StringArray)
    names.Set(list(shot.names))
    root.GetPrim().SetCustomDataByKey(KEY, {
        "width": width, "height": height, "lens": model_of(lens).name,
        "lens_numbers": Vt.DoubleArray.FromNumpy(np.ascontiguousarray(lens)), **said,
    })
    if not layer.Export(str(path)):
        raise UserError(f"{path.name} could not be written; look whether the folder is there and has room.")


def read_shot(path: Path) -> Shot:
    """The first camera of a stage over its frames, with the points that stand in it.

    The plate is as large as the file says (a solve of this program does), else 1920 pixels wide.

    Raises
    ------
    UserError
        The file holds no camera, or cannot be read.
    """
    found = run_bounded(
        "core.formats.usd_camera_path:read_in_child", {"path": str(path)}, what=path.name, seconds=SECONDS,
        memory=MEMORY)
    matrix, film, frames = found["world"], found["film"], found["frames"]
    if not len(matrix) or not (np.isfinite(matrix).all() and np.isfinite(film).all()):
        raise UserError(f"{path.name} holds no camera that can be used.")
    if found["up"] == "z":
        matrix = Z_UP @ matrix
    width, height = (int(v) for v in found["size"])
    if not width:
        width, height = WIDTH, max(1, round(WIDTH * float(film[0, 2] / film[0, 1])))
    pixel = film[:, 1] / width
    focal = film[:, 0] / pixel
    points = np.asarray(found["points"], np.float64).reshape(-1, 3)
    if found["up"] == "z":
        points = points @ Z_UP[:3, :3].T
    lens = np.asarray(found["lens"], np.float64)
    if len(lens) not in {model.columns for model in MODELS} or not np.isfinite(lens).all():
        lens = start_lens(float(focal[0]), width, height)
        stretch = height * pixel[0] / film[0, 2]
        lens[3] = np.log(stretch)
        lens[CENTRE_X] -= film[0, 3] / pixel[0]
        lens[CENTRE_Y] += film[0, 4] / pixel[0] * stretch
    lens[0] = np.log(focal[0])
    return shot_from_up((width, height), frames.astype(np.int32), matrix, focal, points, tuple(found["names"]), lens)


Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
