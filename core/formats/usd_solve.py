"""A solved camera as OpenUSD: one camera with a sample per frame, and the points of the scene.

Y is up; the picture is 36 millimetres wide, the focal length stands in the same unit (tenths of the stage's unit,
as USD has them, whatever that is: a solve has no size until somebody measures something). USD knows no bend of a lens:
its numbers stand in the custom data of ``/Solve``, and the picture of the camera is the straight one.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from core.errors import UserError
from core.formats.sandbox import run_bounded
from core.formats.shot_film import film_of, shot_of_film
from core.formats.usd_camera_path import KEY
from core.formats.usd_stage import define_mesh
from core.match.lens import model_of
from core.match.solve.shot import Shot, Thing

SUFFIXES = (".usda", ".usdc", ".usd")
POINT = 0.01  # width of a point over its distance
SECONDS, MEMORY = 60.0, 4 << 30


def write(path: Path, shot: Shot, said: dict[str, Any], fps: float = 24.0) -> None:
    """Write camera ``/Solve/camera``, points ``/Solve/points`` and the meshes of what moves by itself below ``/Solve``;
    frames are numbered as the plate's files are.

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
    film = film_of(shot)
    camera.CreateHorizontalApertureAttr(film[0, 1])
    camera.CreateVerticalApertureAttr(film[0, 2])
    camera.CreateHorizontalApertureOffsetAttr(film[0, 3])
    camera.CreateVerticalApertureOffsetAttr(film[0, 4])
    pose = camera.MakeMatrixXform()
    focal = camera.CreateFocalLengthAttr()
    if not shot.zooms:
        focal.Set(film[0, 0])
    matrices, places = shot.up()
    for row, frame in enumerate(shot.frames):
        pose.Set(Gf.Matrix4d(matrices[row].T), float(frame))  # USD's vectors are rows
        if shot.zooms:
            focal.Set(film[row, 0], float(frame))
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
    for thing in shot.things:
        _write_thing(stage, thing)
    root.GetPrim().SetCustomDataByKey(KEY, {
        "width": width, "height": height, "lens": model_of(shot.lens).name,
        "lens_numbers": Vt.DoubleArray.FromNumpy(np.ascontiguousarray(shot.lens)), **said,
    })
    if not layer.Export(str(path)):
        raise UserError(f"{path.name} could not be written; look whether the folder is there and has room.")


def _write_thing(stage: Any, thing: Thing) -> None:
    """A mesh under a pose with a sample per frame."""
    from pxr import Gf, Tf, UsdGeom

    place = stage.GetDefaultPrim().GetPath()
    name = Tf.MakeValidIdentifier(thing.name)
    while stage.GetPrimAtPath(place.AppendChild(name)):
        name += "_"
    xform = UsdGeom.Xform.Define(stage, place.AppendChild(name))
    pose = xform.MakeMatrixXform()
    for matrix, frame in zip(thing.world, thing.frames, strict=True):
        pose.Set(Gf.Matrix4d(matrix.T), float(frame))
    define_mesh(stage, xform.GetPath().AppendChild("mesh"), thing.name, thing.mesh)


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
    world, film, frames = found["world"], found["film"], found["frames"]
    if not len(world) or not (np.isfinite(world).all() and np.isfinite(film).all()):
        raise UserError(f"{path.name} holds no camera that can be used.")
    width, height = (int(v) for v in found["size"])
    points = np.asarray(found["points"], np.float64).reshape(-1, 3)
    return shot_of_film(
        (width, height), frames, world, film, points, tuple(found["names"]), found["up"],
        np.asarray(found["lens"], np.float64))
