"""Poses and their sculpts in JSON, as a person or a script writes them: ``filoplume pose``.

POSES.json::

    {"kernel": "gaussian", "poses": [{"name": "bent", "controls": {"elbow": {"rotate": [0, 0, 110]}, "smile": 1.0},
                                      "sculpt": "bent.obj", "falloff": {"elbow": 45}}]}

POSE.json: ``{"controls": {...}}`` in the same form, or ``{"clip": "walk", "frame": 1012.5}``. Rotations are degrees
about x, then y, then z of the joint at rest; translations (``"translate"``) metres in its parent. Falloffs are degrees
for joints that turn, metres for joints that only move, and units for numbers; or a list, one for each axis read.

POSES.json may say more: ``"reads"``, what is read of a joint: ``{"elbow": "swing"}`` (twist, swing-twist, translation,
or x, y, z for the turn about that axis alone); and ``"controls"``, abstract controls that the rig does not have yet:
``{"happiness": {"low": -1, "high": 1}, "lid": {"joint": "eyelid", "axis": [0, 1, 0], "travel": 0.01}, "pad":
{"vertices": [12, 13], "travel": 0.02}}``, whose vertices are those of the rig's file.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal, NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.formats.given_file import decoded_json
from core.formats.mesh_file import READ_SUFFIXES, read_mesh
from core.formats.sculpt_topology import check_topology
from core.formats.text_numbers import text_bytes
from core.mesh.mesh import Mesh
from core.pose.controls import rests, rotation_dof, translation_dof
from core.pose.layers import Sculpt
from core.pose.pose import Pose, moved_controls
from core.pose.pose_space import FALLOFFS, REST_NAME, Dof, Kernel
from core.pose.rig import Control, Rig, clip_named, control_names, playing
from core.pose.rotation import quaternion_from_euler
from core.pose.synthesis import pose_at
from core.record import freeze

LARGEST_JSON = 64 << 20  # bytes
FARTHEST = 1e6  # degrees, metres, units of a number: beyond it single precision loses the mesh
TORN = 1e-5  # of the size of a sculpt: what sides of a seam may be apart by rounding
Three = tuple[float, float, float]


class Movement(msgspec.Struct, forbid_unknown_fields=True):
    """What a joint does: degrees about x, y and z, and metres in its parent."""

    rotate: Three | None = None
    translate: Three | None = None


Controls = dict[str, float | Movement]
Read = Literal["swing", "twist", "swing-twist", "translation", "x", "y", "z"]
FURTHER = ("poses", "controls", "reads")  # what of the file is no field of a pose space


class _Sculpted(msgspec.Struct, forbid_unknown_fields=True):
    name: str
    controls: Controls
    sculpt: str | None = None
    falloff: dict[str, float | list[float]] = {}


class _Control(msgspec.Struct, forbid_unknown_fields=True):
    rest: float = 0.0
    low: float = 0.0
    high: float = 1.0
    joint: str | None = None
    vertices: list[int] | None = None
    axis: Three = (0.0, 1.0, 0.0)
    travel: float = 1.0


class _Poses(msgspec.Struct, forbid_unknown_fields=True):
    poses: list[_Sculpted]
    controls: dict[str, _Control] = {}
    reads: dict[str, Read] = {}
    kernel: Kernel = "gaussian"
    normalise: Literal["none", "above-one", "always"] = "none"
    affine: bool = False
    clamp: bool = False
    smoothing: float = 0.0
    table: int = 0
    weighted: int = 0


class _Moment(msgspec.Struct, forbid_unknown_fields=True):
    controls: Controls | None = None
    clip: str | None = None
    frame: float | None = None


class PoseFile(NamedTuple):
    """Sculpts at poses of a rig, and the fields of their pose spaces; notes are sentences to show.

    rig : with the abstract controls that the file adds. dofs : what it picks to be read.
    """

    rig: Rig
    sculpts: tuple[Sculpt, ...]
    dofs: tuple[Dof, ...]
    options: dict[str, Any]
    notes: tuple[str, ...]


class Moment(NamedTuple):
    """A pose; of a frame of a clip also the rig that plays it, for its joints may be scaled as no pose says."""

    pose: Pose
    rig: Rig
    frame: float | None


def read_poses(path: Path, rig: Rig, mesh: Mesh | None = None) -> PoseFile:
    """Read POSES.json and the sculpts it names, which lie beside it.

    Parameters
    ----------
    mesh : of the rig; a note says which sculpt joins other vertices to faces than it does. None does not look.

    Raises
    ------
    UserError
        Naming the file, the pose, and the control, file or number that is wrong.
    """
    said = decoded_json(path, _Poses, "a list of poses", LARGEST_JSON)
    names = [pose.name for pose in said.poses]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise UserError(f"{path.name} has the pose {twice[0]!r} more than once; give every pose a name of its own.")
    rig = _with_controls(said.controls, rig, path.name)
    dofs = _dofs(said.reads, rig, path.name)
    picked = {dof.control: dof for dof in dofs}
    sculpts: list[Sculpt] = []
    notes: list[str] = []
    at_rest = rests(rig)
    for item in said.poses:
        where = f"{path.name}, pose {item.name!r}"
        if item.name == REST_NAME or not 0 < len(item.name) <= 255 or not item.name.isprintable():
            raise UserError(f"{where}: a pose needs a name of its own, not {REST_NAME!r}, which is always there.")
        pose = _pose(item.name, item.controls, rig, where)
        falloffs = {}
        for control, reach in item.falloff.items():
            _check_control(control, rig, where)
            each = tuple(reach) if isinstance(reach, list) else (reach,)
            if not each or not all(1e-6 <= one <= 1e6 for one in each):
                raise UserError(f"{where}: the falloff of {control!r} must lie between 0 and a million, not {reach}.")
            if control not in moved_controls(pose, at_rest):
                notes.append(f"{where}: the falloff of {control!r} has no effect, for the pose leaves it at rest.")
                continue
            turning = control in pose.rotations
            kind = picked[control].kind if control in picked else "swing-twist" if turning else "translation"
            kind = "number" if control in pose.numbers else kind
            if len(each) not in (1, FALLOFFS[kind]):
                raise UserError(
                    f"{where}: the falloff of {control!r} must be one number, or {FALLOFFS[kind]} for {kind}.")
            falloffs[control] = tuple(math.radians(one) for one in each) if turning else each
        target = None if item.sculpt is None else read_sculpt(path.parent / item.sculpt, rig, where, notes.append)
        if item.sculpt is not None and mesh is not None:
            try:
                check_topology(path.parent / item.sculpt, mesh, rig)
            except UserError as error:  # its points are taken in their order all the same; somebody should look
                notes.append(f"{where}: {error}")
        sculpts.append(Sculpt(pose, target, falloffs))
    fields = [name for name in _Poses.__struct_fields__ if name not in FURTHER]
    if not 0.0 <= said.smoothing <= 1e3 or not 0 <= said.weighted <= 64 or said.table not in (0, *range(2, 65537)):
        raise UserError(f"{path.name}: smoothing goes from 0 to 1000, weighted from 0 to 64, table from 2 to 65536.")
    return PoseFile(rig, tuple(sculpts), dofs, {name: getattr(said, name) for name in fields}, tuple(notes))


def read_moment(path: Path, rig: Rig) -> Moment:
    """Read POSE.json.

    Raises
    ------
    UserError
        Naming the file and what is wrong.
    """
    said = decoded_json(path, _Moment, "a pose", LARGEST_JSON)
    if said.clip is not None:
        if said.controls is not None or said.frame is None:
            raise UserError(f'{path.name} must say either "controls", or "clip" and "frame".')
        clip = clip_named(rig, said.clip)
        return Moment(pose_at(playing(rig, clip.name), said.frame), playing(rig, clip.name), said.frame)
    if said.controls is None or said.frame is not None:
        raise UserError(f'{path.name} must say either "controls", or "clip" and "frame".')
    return Moment(_pose("pose", said.controls, rig, path.name), rig, None)


def read_sculpt(
    path: Path, rig: Rig, where: str, say: Callable[[str], object] | None = None
) -> NDArray[np.float64]:
    """The surface (V, 3) of a sculpt, metres, from a file with the vertices of the rig's file in its order.

    Vertices that a seam had split in that file are one in the mesh; their mean is taken.

    Parameters
    ----------
    say : called with a sentence where the sculpt has torn such a seam open.

    Raises
    ------
    UserError
        When the file is missing, of an unknown kind, damaged, or has another number of vertices.
    """
    try:
        if path.suffix.lower() == ".obj":
            points = _obj_points(path)
        elif path.suffix.lower() in READ_SUFFIXES:
            found = read_mesh(path)
            points = found.mesh.points.astype(np.float64)[found.vertex_of_file]
        else:
            raise UserError(f"{path.name} is no mesh file; export the sculpt as OBJ or USD.")
    except OSError as error:
        raise UserError(f"{where}: the sculpt {path.name} cannot be opened ({error.strerror or error}).") from None
    except UserError as error:
        raise UserError(f"{where}: {error}") from error
    except ValueError:
        raise UserError(f"{where}: the sculpt {path.name!r} is no name of a file.") from None
    vertices = len(rig.skin.joints)
    there = np.arange(vertices) if rig.file_vertices is None else rig.file_vertices
    if len(points) != len(there):
        raise UserError(
            f"{where}: the sculpt {path.name} has {len(points)} vertices and the rig {len(there)}; export the sculpt "
            "with all vertices, in the order of the rig's file."
        )
    if not np.isfinite(points).all():
        raise UserError(f"{where}: the sculpt {path.name} has vertices that are no finite numbers; export it again.")
    if np.abs(points).max(initial=0.0) > FARTHEST:
        raise UserError(f"{where}: the sculpt {path.name} lies beyond {FARTHEST:,.0f} metres; export it in metres.")
    count = np.bincount(there, minlength=vertices)
    total = np.stack([np.bincount(there, points[:, k], minlength=vertices) for k in range(3)], axis=1)
    if not count.all():
        raise UserError(f"{where}: the rig has vertices that its file does not have; read the rig again.")
    mean = np.asarray(total / count[:, None], np.float64)
    apart = np.linalg.norm(points - mean[there], axis=1)
    if say is not None and apart.max(initial=0.0) > TORN * np.linalg.norm(np.ptp(points, axis=0)):
        say(f"{where}: the sculpt {path.name} opens seams by up to {2000.0 * apart.max():.3g} mm; they stay closed, "
            "halfway between their sides.")
    return mean


def _with_controls(said: dict[str, _Control], rig: Rig, where: str) -> Rig:
    """The rig with these abstract controls; one that it has is replaced where it is a plain number."""
    shapes = () if rig.shapes is None else rig.shapes.names
    controls = {control.name: control for control in rig.controls}
    there = np.arange(len(rig.skin.joints)) if rig.file_vertices is None else rig.file_vertices
    for name, one in said.items():
        if name in rig.skeleton.names or (name in shapes and (one.joint or one.vertices)):
            raise UserError(f"{where}: {name!r} is a joint or a shape of the rig; give the control another name.")
        if one.joint is not None and one.vertices is not None:
            raise UserError(f"{where}: the control {name!r} follows a joint or vertices, not both.")
        piece = None
        if one.vertices is not None:
            if not all(0 <= v < len(there) for v in one.vertices):
                raise UserError(f"{where}: the control {name!r} names a vertex that the rig's file does not have.")
            piece = freeze(np.unique(there[np.array(one.vertices, np.int64)]).astype(np.int32))
        try:
            controls[name] = Control(
                name=name, kind="number" if one.joint is None and piece is None else "joint" if piece is None else
                "geometry", rest=one.rest, low=one.low, high=one.high, vertices=piece, joint=one.joint, axis=one.axis,
                travel=one.travel)
            rig = rig.replace(controls=tuple(controls.values()))
        except ValueError as error:
            raise UserError(f"{where}: {error}.") from None
    return rig


def _dofs(reads: dict[str, Read], rig: Rig, where: str) -> tuple[Dof, ...]:
    dofs = []
    for joint, read in reads.items():
        if joint not in rig.skeleton.names:
            raise UserError(f"{where}: \"reads\" names {joint!r}, which is no joint of the rig.")
        dofs.append(translation_dof(joint) if read == "translation" else rotation_dof(rig.skeleton, joint, read))
    return tuple(dofs)


def _obj_points(path: Path) -> NDArray[np.float64]:
    """The ``v`` lines of an OBJ file; nothing else of it matters, so a bare list of points will do."""
    data = text_bytes(path.read_bytes(), path.name)
    lines = re.findall(rb"^[ \t]*v[ \t]+([^\r\n#]+)", data, re.MULTILINE)
    try:
        return np.array([[float(word) for word in line.split()[:3]] for line in lines], np.float64).reshape(-1, 3)
    except ValueError:
        raise UserError(f"{path.name} has a vertex that is not three numbers; export it again.") from None


def _pose(name: str, controls: Controls, rig: Rig, where: str) -> Pose:
    joints = set(rig.skeleton.names)
    rotations: dict[str, Any] = {}
    translations: dict[str, Three] = {}
    numbers: dict[str, float] = {}
    for control, value in controls.items():
        _check_control(control, rig, where)
        if isinstance(value, Movement):
            if control not in joints:
                raise UserError(f"{where}: {control!r} is a number, not a joint; give it as {control!r}: 1.0.")
            _check_size((*(value.rotate or ()), *(value.translate or ())), control, where)
            if value.rotate is not None:
                rotations[control] = tuple(map(float, quaternion_from_euler(value.rotate)))
            if value.translate is not None:
                translations[control] = value.translate
        elif control in joints:
            raise UserError(f'{where}: {control!r} is a joint; give it as {control!r}: {{"rotate": [x, y, z]}}.')
        else:
            _check_size((value,), control, where)
            _check_dial(control, rig, where)
            numbers[control] = float(value)
    return Pose(name=name, rotations=rotations, translations=translations, numbers=numbers)


def _check_dial(name: str, rig: Rig, where: str) -> None:
    kind = next(control.kind for control in rig.controls if control.name == name)
    if kind != "number":
        what = "the joint" if kind == "joint" else "the piece of geometry"
        raise UserError(f"{where}: {name!r} is how far {what} it follows has moved; pose the joints instead.")


def _check_size(values: tuple[float, ...], control: str, where: str) -> None:
    if not all(abs(value) <= FARTHEST for value in values):
        raise UserError(f"{where}: {control!r} is set beyond {FARTHEST:,.0f}; give a number nearer to 0.")


def _check_control(name: str, rig: Rig, where: str) -> None:
    known = control_names(rig)
    if name not in known:
        raise UserError(f"{where}: there is no control {name!r}; choose one of {', '.join(known[:20])}.")
