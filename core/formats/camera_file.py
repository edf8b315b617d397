"""Cameras of USD stages, Alembic archives and glTF scenes, as they stand at a frame.

USD and Alembic are read in a bounded child process. Sources: UsdGeomCamera and GfCamera (apertures are measured in the
unit of the focal length; those of an orthographic camera in tenths of the stage's unit), Alembic's AbcGeom
CameraSample (apertures in centimetres, focal length in millimetres), glTF 2.0 sections 3.10 and 3.11.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.camera import Camera
from core.errors import UserError
from core.formats import alembic_cameras, usd_cameras
from core.formats.file_space import axis_of, metres_of
from core.formats.gltf import checked_row, open_gltf, placed_nodes
from core.formats.gltf_rig import PATHS, GltfFile, sampled
from core.formats.sandbox import run_bounded
from core.record import freeze

Array = NDArray[np.float64]

USD_SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
ALEMBIC_SUFFIXES = (".abc",)
GLTF_SUFFIXES = (".glb", ".gltf")
READ_SUFFIXES = USD_SUFFIXES + ALEMBIC_SUFFIXES + GLTF_SUFFIXES
SECONDS, MEMORY = 60.0, 4 << 30  # limits of a native reader
NEAR, FAR = 0.01, 1000.0  # metres, where a file says nothing sensible
Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])  # Y up from Z up


class FileCamera(NamedTuple):
    """A camera of a file.

    name : its path in the file. camera : in metres, Y up. aspect : width over height of its own picture.
    off_centre : the file shifts its picture aside, which `camera` does not.
    """

    name: str
    camera: Camera
    aspect: float
    off_centre: bool = False


def read_cameras(
    path: str | Path, frame: float = 1.0, fps: float = 24.0, unit: str | None = None, up: str | None = None,
    sandboxed: bool = True, cancel: Callable[[], bool] | None = None,
) -> tuple[FileCamera, ...]:
    """All cameras of a file in its own order, at a frame.

    A scale of a camera's place in the scene moves it and does nothing else. All animations of a glTF scene
    move its nodes; where two move the same, the first does.

    Parameters
    ----------
    frame, fps : time codes of USD are frames; seconds of Alembic and glTF are frames over `fps`.
    unit, up : unit (m, cm, mm, in, ft) and up axis (y, z) of a file that does not say; metres and y otherwise.
    sandboxed : run native readers in a child process. False only for files this program has just written.
    cancel : asked now and then while a native reader works.

    Raises
    ------
    UserError
        An unknown kind of file, one that is missing or damaged, or holds no camera that can be used.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in READ_SUFFIXES:
        raise UserError(f"{path.name} is no file to read cameras from; use {', '.join(READ_SUFFIXES)}.")
    if not path.is_file():
        raise UserError(f"{path.name} is not there; give the name of a file.")
    if suffix in GLTF_SUFFIXES:
        raw = _gltf_cameras(path, float(frame) / float(fps))
    else:
        reader = usd_cameras if suffix in USD_SUFFIXES else alembic_cameras
        asked: dict[str, Any] = {"path": str(path.resolve()), "frame": float(frame)}
        if reader is alembic_cameras:
            asked["fps"] = float(fps)
        raw = run_bounded(
            f"{reader.__name__}:read_in_child", asked, what=path.name, seconds=SECONDS, memory=MEMORY, cancel=cancel,
        ) if sandboxed else reader.read_in_child(**asked)
    metres = raw["metres_per_unit"]
    if metres is None or not 1e-9 < metres < 1e9:
        metres = metres_of(unit or "m")
    axis = raw["up"] if raw["up"] in ("y", "z") else axis_of(up or "y")
    found = []
    for row, name in enumerate(raw["names"]):
        made = _camera(name, raw["world"][row], raw["lens"][row], metres, axis)
        if made is not None:
            found.append(made)
    if not found:
        raise UserError(f"{path.name} holds no camera that can be used; export the shot's camera with it.")
    return tuple(found)


def _camera(name: str, world: Array, lens: Array, metres: float, up: str) -> FileCamera | None:
    """One camera from its matrix (4, 4) and `lens`: orthographic?, half width, half height (tangents of the angles, or
    units), near, far, shift; None when these are no camera.
    """
    parallel, half_width, half_height, near, far, shift = (float(x) for x in lens)
    if not (np.isfinite(world).all() and np.isfinite(lens).all() and half_width > 0 and half_height > 0):
        return None
    world = (Z_UP if up == "z" else np.eye(4)) @ world
    u, sizes, v = np.linalg.svd(world[:3, :3])
    if sizes[-1] < 1e-12 * sizes[0] or sizes[0] == 0.0:
        return None
    pose = np.eye(4)
    pose[:3, :3] = u @ v
    if np.linalg.det(pose[:3, :3]) < 0.0:  # mirrored: it still looks along its own -z with its own up
        pose[:3, 0] *= -1.0
    pose[:3, 3] = world[:3, 3] * metres
    near, far = near * metres, far * metres
    if not 1e-6 < near < far < 1e7:
        near, far = NEAR, FAR
    seen = {"field_of_view": 2.0 * float(np.arctan(half_height))}
    if parallel:
        seen = {"height": 2.0 * half_height * metres}
    try:
        camera = Camera(world_from_camera=freeze(pose), orthographic=bool(parallel), near=near, far=far, **seen)
    except ValueError:
        return None
    return FileCamera(name, camera, half_width / half_height, abs(shift) > 1e-6)


def _gltf_cameras(path: Path, seconds: float) -> dict[str, Any]:
    gltf, buffers = open_gltf(path)
    names: list[str] = []
    world, lens = [], []
    try:
        _pose_nodes(GltfFile(path, gltf, buffers), seconds)
        placed = placed_nodes(path, gltf)
        for row, matrix in placed:
            node = gltf.nodes[row]
            if node.camera is None or not 0 <= node.camera < len(gltf.cameras):
                continue
            known = gltf.cameras[node.camera]
            if known.type == "perspective" and known.perspective is not None:
                own = known.perspective
                tall = np.tan(0.5 * own.yfov)
                row_of = (0.0, tall * (own.aspect_ratio or 16 / 9), tall, own.znear, own.zfar or 1e6 * own.znear, 0.0)
            elif known.type == "orthographic" and known.orthographic is not None:
                parallel = known.orthographic
                row_of = (1.0, abs(parallel.xmag), abs(parallel.ymag), parallel.znear, parallel.zfar, 0.0)
            else:
                continue
            names.append(node.name or known.name or f"camera {len(names) + 1}")
            world.append(matrix)
            lens.append(row_of)
    except (IndexError, ValueError, OverflowError) as error:
        raise UserError(f"{path.name} contradicts itself ({error}); export it again.") from None
    return {
        "names": names, "world": np.array(world, np.float64).reshape(-1, 4, 4),
        "lens": np.array(lens, np.float64).reshape(-1, 6), "metres_per_unit": 1.0, "up": "y",
    }


def _pose_nodes(file: GltfFile, seconds: float) -> None:
    """Move the nodes of a scene to where its animations have them at a time."""
    moved: set[tuple[int, str]] = set()
    for animation in file.gltf.animations:
        for channel in animation.channels:
            row, path = channel.target.node, channel.target.path
            if row is None or path not in PATHS or (row, path) in moved:
                continue
            node, sampler = file.gltf.nodes[checked_row(row)], animation.samplers[checked_row(channel.sampler)]
            keys = file.numbers(sampler.input, 1)[:, 0]
            if node.matrix is not None or not len(keys) or not np.isfinite(keys).all() or (np.diff(keys) < 0).any():
                continue
            values = sampled(file, sampler, keys, np.array([seconds]), PATHS[path], path == "rotation", 0.0)
            setattr(node, path, tuple(values[0].tolist()))
            moved.add((row, path))
