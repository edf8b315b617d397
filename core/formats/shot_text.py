"""Cameras as the text of other programs: Nuke (.nk, .chan), Maya (.ma), Blender (.py). y up, cameras look along -z.

Sources: Nuke's Camera and its chan files (rotations in the order ZXY, degrees; vertical field of view), Maya ASCII
(apertures in inches, rotations in the order xyz, centimetres), Blender's bpy (sensor in millimetres, shifts in widths).
"""

from __future__ import annotations

import json
import re

import numpy as np
from scipy.spatial.transform import Rotation

from core.errors import UserError
from core.formats.shot_film import FILM, film_of, shot_of_film
from core.formats.tracks_nuke import nuke_curve
from core.match.solve.shot import Shot, shot_from_up
from core.match.solve.state import Array

INCH = 25.4
MOST = 1_000_000
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


def nuke_text(shot: Shot) -> str:
    """A Camera node with curves; the picture it takes is the straight one.

    The window is moved in halves of the aperture across, both ways, as the projection of Nuke's camera has it.
    """
    moves, turns = _moves(shot, "YXZ")
    film = film_of(shot)
    window = film[0, 3:5] / (0.5 * FILM)

    def curve(values: Array) -> str:
        return "{curve " + " ".join(f"x{f} {v:.12g}" for f, v in zip(shot.frames, values, strict=True)) + "}"

    focal = curve(film[:, 0]) if shot.zooms else f"{film[0, 0]:.12g}"
    return (
        "Camera2 {\n rot_order ZXY\n"
        f" translate {{{' '.join(curve(column) for column in moves.T)}}}\n"
        f" rotate {{{' '.join(curve(column) for column in turns.T)}}}\n"
        f" focal {{{focal}}}\n haperture {FILM:.12g}\n vaperture {film[0, 2]:.12g}\n"
        f" win_translate {{{window[0]:.12g} {window[1]:.12g}}}\n"
        " name FiloplumeCamera\n}\n"
    )


def chan_text(shot: Shot) -> str:
    """Lines of frame, place, rotation in degrees, vertical field of view in degrees.

    Raises
    ------
    UserError
        The centre of the lens is not that of the picture, of which such a file knows nothing.
    """
    off = max(map(abs, shot.off_centre))
    if off > 0.01:
        raise UserError(
            f"The centre of the lens lies {off:.1f} px off that of the picture, which .chan cannot say; write .nk "
            "instead.")
    moves, turns = _moves(shot, "YXZ")
    film = film_of(shot)
    view = np.degrees(2.0 * np.arctan2(0.5 * film[:, 2], film[:, 0]))
    rows = np.column_stack([moves, turns, view])
    lines = (f"{f}\t" + "\t".join(f"{v:.12g}" for v in row) for f, row in zip(shot.frames, rows, strict=True))
    return "\n".join(lines) + "\n"


def maya_text(shot: Shot) -> str:
    """A camera with curves, and a locator for every point; one unit of the solve is one of Maya's."""
    moves, turns = _moves(shot, "ZYX")
    turns = turns[:, ::-1]  # x, y, z; the first is done first
    film = film_of(shot)
    channels = [(f"t{axis}", "animCurveTL", moves[:, k]) for k, axis in enumerate("xyz")]
    channels += [(f"r{axis}", "animCurveTA", turns[:, k]) for k, axis in enumerate("xyz")]
    lines = [
        "//Maya ASCII 2018 scene", 'requires maya "2018";', "currentUnit -l centimeter -a degree -t film;",
        'createNode transform -n "filoplume_camera";', '\tsetAttr ".ro" 0;',
        'createNode camera -n "filoplume_cameraShape" -p "filoplume_camera";', '\tsetAttr -k off ".v";',
        f'\tsetAttr ".cap" -type "double2" {FILM / INCH:.12g} {film[0, 2] / INCH:.12g} ;',
        f'\tsetAttr ".hfo" {film[0, 3] / INCH:.12g};', f'\tsetAttr ".vfo" {film[0, 4] / INCH:.12g};',
        '\tsetAttr ".ff" 1;',  # fit the width
        f'\tsetAttr ".fl" {film[0, 0]:.12g};',
    ]
    if shot.zooms:
        channels.append(("fl", "animCurveTU", film[:, 0]))
    links = []
    for name, kind, values in channels:
        keys = " ".join(f"{f} {v:.12g}" for f, v in zip(shot.frames, values, strict=True))
        lines += [f'createNode {kind} -n "filoplume_camera_{name}";', '\tsetAttr ".tan" 2;',
                  f'\tsetAttr -s {len(values)} ".ktv[0:{len(values) - 1}]"  {keys};']
        node = "filoplume_cameraShape" if name == "fl" else "filoplume_camera"
        links.append(f'connectAttr "filoplume_camera_{name}.o" "{node}.{name}";')
    lines.append('createNode transform -n "filoplume_points";')
    for k, place in enumerate(shot.up()[1]):
        name = f"p{k}_{re.sub(r'[^A-Za-z0-9_]', '_', shot.names[k])}"
        lines += [f'createNode transform -n "{name}" -p "filoplume_points";',
                  f'\tsetAttr ".t" -type "double3" {place[0]:.9g} {place[1]:.9g} {place[2]:.9g} ;',
                  f'createNode locator -n "{name}Shape" -p "{name}";']
    return "\n".join([*lines, *links]) + "\n"


def blender_text(shot: Shot) -> str:
    """A script for Blender's text editor: a camera with keys, the points as a mesh without faces."""
    matrices, places = shot.up()
    turn = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])  # Blender is z up
    poses = turn @ matrices
    width, height = shot.size
    film = film_of(shot)
    shift = (float(film[0, 3] / FILM), float(film[0, 4] / FILM))
    data = json.dumps({
        "frames": shot.frames.tolist(), "poses": poses.reshape(-1, 16).round(12).tolist(),
        "focal": film[:, 0].tolist(), "points": (places @ turn[:3, :3].T).round(9).tolist(),
        "names": list(shot.names),
    })
    return f'''"""A solved camera of Filoplume: open in Blender's text editor and run it."""
import json

import bpy
from mathutils import Matrix

DATA = json.loads({data!r})
scene = bpy.context.scene
scene.render.resolution_x, scene.render.resolution_y = {width}, {height}
scene.render.resolution_percentage = 100
stretch = {shot.stretch!r}
scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = max(stretch, 1.0), max(1.0 / stretch, 1.0)
scene.frame_start, scene.frame_end = DATA["frames"][0], DATA["frames"][-1]
camera = bpy.data.cameras.new("FiloplumeCamera")
camera.sensor_fit, camera.sensor_width = "HORIZONTAL", {FILM!r}
camera.shift_x, camera.shift_y = {shift[0]!r}, {shift[1]!r}
object = bpy.data.objects.new("FiloplumeCamera", camera)
object.rotation_mode = "QUATERNION"
scene.collection.objects.link(object)
before = None
for frame, pose, focal in zip(DATA["frames"], DATA["poses"], DATA["focal"]):
    place, turn, _ = Matrix([pose[k:k + 4] for k in range(0, 16, 4)]).decompose()
    if before is not None:
        turn.make_compatible(before)
    before = turn
    object.location, object.rotation_quaternion, camera.lens = place, turn, focal
    object.keyframe_insert("location", frame=frame)
    object.keyframe_insert("rotation_quaternion", frame=frame)
    camera.keyframe_insert("lens", frame=frame)
mesh = bpy.data.meshes.new("FiloplumePoints")
mesh.from_pydata(DATA["points"], [], [])
scene.collection.objects.link(bpy.data.objects.new("FiloplumePoints", mesh))
scene.camera = object
'''


def read_nuke(text: str, size: tuple[int, int], name: str) -> Shot:
    """The first Camera node whose place and turn have curves or numbers.

    Raises
    ------
    UserError
        There is none, or it is of a kind that is not read.
    """
    found = re.search(r"^Camera\d? \{\n(.*?)^\}", text, re.M | re.S)
    if found is None:
        raise UserError(f"{name} holds no Camera node.")
    knobs = dict(re.findall(r"^ (\w+) (.*)$", found[1], re.M))
    if knobs.get("rot_order", "ZXY") != "ZXY" or knobs.get("useMatrix", "false") == "true":
        raise UserError(f"{name}: the camera turns in another order than ZXY; bake it and export it again.")

    def curves(knob: str, count: int, default: float) -> list[dict[float, float]]:
        words = knobs.get(knob, "")
        made = [nuke_curve(part, name) for part in re.findall(r"\{curve ([^{}]*)\}", words)]
        if not made:
            numbers = [float(v) for v in NUMBER.findall(words)] or [default] * count
            made = [{0.0: v} for v in numbers]
        if len(made) != count or not all(0 < len(keys) < MOST for keys in made):
            raise UserError(f"{name}: {knob} of the camera does not hold {count} numbers or curves.")
        return made

    moves, turns = curves("translate", 3, 0.0), curves("rotate", 3, 0.0)
    focal = curves("focal", 1, 50.0)[0]
    frames = np.array(sorted({f for part in (*moves, *turns) for f in part if len(part) > 1}) or [1])
    across = next(iter(curves("haperture", 1, 24.576)[0].values()))
    if not 0.0 < across < MOST:
        raise UserError(f"{name}: the camera has no aperture.")
    window = [next(iter(keys.values())) for keys in curves("win_translate", 2, 0.0)]

    def at(keys: dict[float, float]) -> Array:
        return np.asarray(np.interp(frames, sorted(keys), [keys[f] for f in sorted(keys)]))

    matrix = _matrices(np.column_stack([at(k) for k in moves]), np.column_stack([at(k) for k in turns]))
    tall = across * size[1] / size[0]  # Nuke's pictures are as wide as the aperture; the format says how high
    film = np.column_stack([at(focal), *(np.full(len(frames), v) for v in (
        across, tall, 0.5 * across * window[0], 0.5 * across * window[1]))])
    return shot_of_film(size, frames.astype(np.int32), matrix, film, np.zeros((0, 3)), (), "y")


def read_chan(text: str, size: tuple[int, int], name: str) -> Shot:
    """Lines of eight numbers; pixels are taken as square."""
    try:
        rows = np.array([[float(v) for v in line.split()[:8]] for line in text.splitlines()[:MOST] if line.strip()])
    except ValueError:
        rows = np.zeros((0, 0))
    if rows.ndim != 2 or rows.shape[1:] != (8,) or not np.isfinite(rows).all() or not (rows[:, 7] > 0).all():
        raise UserError(f"{name} is no chan file of a camera: every line should hold eight numbers.")
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    focal = 0.5 * size[1] / np.tan(np.radians(np.minimum(rows[:, 7], 179.9)) * 0.5)
    return shot_from_up(
        size, rows[:, 0].astype(np.int32), _matrices(rows[:, 1:4], rows[:, 4:7]), focal, np.zeros((0, 3)))


def _matrices(moves: Array, turns: Array) -> Array:
    """(F, 4, 4) of places and rotations (F, 3) x, y, z in degrees, done in the order ZXY."""
    matrix = np.tile(np.eye(4), (len(moves), 1, 1))
    matrix[:, :3, :3] = Rotation.from_euler("YXZ", turns[:, [1, 0, 2]], degrees=True).as_matrix()
    matrix[:, :3, 3] = moves
    return matrix


def _moves(shot: Shot, order: str) -> tuple[Array, Array]:
    """Places (F, 3), and rotations (F, 3) in degrees without jumps: x, y, z of YXZ, else as `order` names them."""
    matrices, _ = shot.up()
    turns = Rotation.from_matrix(matrices[:, :3, :3]).as_euler(order)
    turns = np.degrees(np.unwrap(turns, axis=0))
    return matrices[:, :3, 3], turns[:, [1, 0, 2]] if order == "YXZ" else turns

