"""The demo of matchmove: the plate of `core/demo/shot.py` is drawn, tracked and solved.

The talk's order: camera from the room, head and body from marks on their meshes, the neck from both and its own tracks.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from app.report import Report
from app.shot_plate import draw_plate, seen_marks, write_picture
from core.demo.shot import FIRST, FOCAL, FRAMES, NECK, SIZE, Figure, Moment, Part, figure, moments, room_marks
from core.document import Document
from core.formats.atomic import atomic_write
from core.formats.frame_decoder import FrameDecoder
from core.formats.plate_file import PlateFrames, read_plate
from core.formats.project import write_project
from core.formats.shot_file import write_shot
from core.formats.track_file import write_tracks
from core.formats.tracks_json import Tracks
from core.image.mix import mixed
from core.image.plate import ChannelMix
from core.match.fit_rig import Fit, fit
from core.match.rig_places import posed, rig_parameter, rig_places
from core.match.solve.coordinates import onto
from core.match.solve.held import Known, hold
from core.match.solve.observed import observations_of
from core.match.solve.report import report
from core.match.solve.shot import FLIP, Shot, shot_of
from core.match.solve.solution import Options, Solution
from core.match.solve.solve import solve
from core.match.solve.things import Found, Given, find_thing
from core.match.solved import SolveSettings
from core.match.track import Track, TrackSettings, keyed_track
from core.match.tracker import Tracking
from core.pose.pose import REST, local_of_pose
from core.pose.skinning import deformed, object_matrices
from core.workers import Workers
from core.workspace import Workspace
from tools.solve_edits import put_solve, solved_camera

KEY = FIRST + FRAMES // 2
STEADY = 0.04  # radians a joint turns from one frame to the next, one standard deviation
DOWN = np.diag([1.0, -1.0, -1.0, 1.0])
SHOWN = FIRST + 18
COLOURS = {"head": (120, 230, 120), "neck": (70, 170, 255), "body": (255, 190, 90)}


class ShotSolved(NamedTuple):
    """The camera, body and head, the neck's angles; and how far each is from what the plate was made of.

    camera_mm, camera_degrees, head_degrees, neck_degrees : RMS over frames; the head as body and neck carry it.
    """

    shot: Shot
    body: Found
    head: Found
    neck: Fit
    camera_mm: float
    camera_degrees: float
    head_degrees: float
    neck_degrees: float
    warnings: tuple[str, ...]


def make_shot(folder: Path, telling: Report) -> tuple[ShotSolved, list[str]]:
    """Draw, track and solve; what was written into `folder`."""
    model, truth = figure(), moments()
    plate = folder / "match-plate"
    plate.mkdir(parents=True, exist_ok=True)
    for old in plate.glob("plate.*.png"):  # of a demo that was longer
        old.unlink()
    with telling.stage("plate", "drawing the plate"):
        pictures = draw_plate(plate, model, truth)
    with telling.stage("track", "tracking"):
        film, tracks = _tracked(plate, model, truth)
    with telling.stage("solve", "solving camera, body and head"):
        scene = tuple(track for track in tracks if track.name.startswith("room"))
        solution, warnings = _camera(scene)
        found = {}
        for part in (model.body, model.head):
            solution, found[part.name] = find_thing(solution, _given(model, part, tracks), tracks)
    with telling.stage("neck", "finding the neck"):
        shot = shot_of(solution, [track.name for track in scene])
        neck = _neck(model, solution, found["body"], tracks)
    done = _against(truth, model, shot, found["body"], found["head"], neck, warnings)
    written = _written(folder, done, film, tracks, model, pictures)
    return done, [str(plate), *written]


# -- tracks ------------------------------------------------------------------------------------------------


def _tracked(folder: Path, model: Figure, truth: list[Moment]) -> tuple[Any, tuple[Track, ...]]:
    """Every mark that is seen well on one frame keyed there, and followed both ways."""
    keyed = tuple(
        keyed_track(k, name, np.array([[KEY, *xy]]))
        for k, (name, xy) in enumerate(seen_marks(model, truth[KEY - FIRST]).items(), 1)
    )
    workers, decoder = Workers(), FrameDecoder()
    try:
        film = read_plate(folder, decoder)
        source = PlateFrames(film, decoder)
        mix = ChannelMix(log=True)

        def read(frame: int) -> Any:
            pixels = source.get(frame)
            return None if pixels is None else mixed(pixels, mix)

        tracking = Tracking(read, film.frames, keyed, TrackSettings(pattern=17, search=24), ranges=workers.ranges)
        for _ in tracking.steps():
            pass
        source.close()
        return film, tuple(track for track in tracking.tracks() if len(track.frames) > 4)
    finally:
        decoder.close()
        workers.close()


# -- the solve ---------------------------------------------------------------------------------------------


def _camera(scene: tuple[Track, ...]) -> tuple[Solution, tuple[str, ...]]:
    """The camera from the room, in metres by what was measured between two of its marks."""
    names, places = [track.name for track in scene], room_marks()
    observations, frames = observations_of(scene)
    found = solve(observations, frames, len(scene), SIZE, Options(FOCAL))
    held = [names[row] for row in np.flatnonzero(found.held)]
    one, two = held[0], max(held[1:], key=lambda name: float(np.linalg.norm(places[name] - places[held[0]])))
    known = [Known("distance", (one, two), (float(np.linalg.norm(places[one] - places[two])),), 0.002)]
    found = hold(found, names, known)
    return found, report(found, names).warnings


def _given(model: Figure, part: Part, tracks: tuple[Track, ...]) -> Given:
    """A part of the figure by those of its marks that were tracked."""
    there = {track.name for track in tracks}
    names = tuple(name for name in part.vertices if name in there)
    rows = [part.vertices[name] for name in names]
    return Given(part.name, model.mesh, names, model.mesh.points[rows].astype(np.float64))


def _neck(model: Figure, solution: Solution, body: Found, tracks: tuple[Track, ...]) -> Fit:
    """Angles of the neck's joints in every frame, on the body, under the marks of neck and head."""
    vertices = model.neck.vertices | model.head.vertices
    seen = [track for track in tracks if track.name in vertices]
    observations, frames = observations_of(seen)
    row = {int(number): k for k, number in enumerate(solution.frames)}
    observations = observations._replace(frame=np.array([row[int(f)] for f in frames], np.int32)[observations.frame])
    world = np.tile(np.eye(4), (len(solution.frames), 1, 1))
    for frame, matrix in zip(body.thing.frames, body.thing.world, strict=True):
        world[row[int(frame)]] = DOWN @ matrix  # the world of the solver is y down
    rows = np.array([vertices[track.name] for track in seen], np.int32)
    places = rig_places(model.rig, model.mesh.points, rows, NECK, [REST] * len(solution.frames), world)
    whitened = observations._replace(root=observations.root / solution.sigma)
    parameters = [rig_parameter(model.rig, name, steady=STEADY) for name in NECK]
    return fit(parameters, places, solution.state, whitened, scale=3.0, iterations=25)


def _against(
    truth: list[Moment], model: Figure, shot: Shot, body: Found, head: Found, neck: Fit, warnings: tuple[str, ...]
) -> ShotSolved:
    """How far all is from what the plate was made of, after the similarity and the turn of the world that fit best."""
    centres = np.array([moment.camera[:3, 3] for moment in truth])
    matrices, _ = shot.up()
    apart = onto(matrices[:, :3, 3], centres).points(matrices[:, :3, 3]) - centres
    # the path is nearly straight, so where up is is told by the turns
    u, _, vt = np.linalg.svd(np.einsum("fij,fkj->ik", np.array([m.camera[:3, :3] for m in truth]), matrices[:, :3, :3]))
    common = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    turns = np.einsum("ij,fjk->fik", common, matrices[:, :3, :3])
    poses = dict(zip(body.thing.frames.tolist(), body.thing.world, strict=True))
    heads, true_heads = [], []
    for row, (frame, moment) in enumerate(zip(shot.frames.tolist(), truth, strict=True)):
        for found, body_at, pose in (
            (heads, poses[frame], posed(REST, NECK, neck.values[row])), (true_heads, moment.body, moment.pose()),
        ):
            local = local_of_pose(model.rig.skeleton, pose)
            found.append((body_at @ object_matrices(model.rig.skeleton, local)[-1])[:3, :3])
    asked = np.array([moment.neck for moment in truth])
    return ShotSolved(
        shot._replace(things=(body.thing, head.thing)), body, head, neck,
        1000.0 * float(np.sqrt((apart**2).sum(axis=1).mean())), _apart(turns, [m.camera[:3, :3] for m in truth]),
        _apart(common @ np.array(heads), true_heads),
        float(np.degrees(np.sqrt(((neck.values - asked) ** 2).mean()))), warnings,
    )


def _apart(turns: NDArray[np.float64], truth: list[NDArray[np.float64]]) -> float:
    """RMS angle in degrees."""
    cosine = 0.5 * (np.einsum("fij,fij->f", turns, np.array(truth)) - 1.0)
    return float(np.degrees(np.sqrt((np.arccos(np.clip(cosine, -1.0, 1.0)) ** 2).mean())))


# -- what is written ---------------------------------------------------------------------------------------


def _written(
    folder: Path, done: ShotSolved, film: Any, tracks: tuple[Track, ...], model: Figure, pictures: list[Any]
) -> list[str]:
    """The camera with what moves, the tracks, the project, and the picture with everything over it."""
    camera, keys, project, image = (folder / name for name in ("match.usda", "match.json", "match.filo", "match.jpg"))
    write_shot(camera, done.shot, {})
    with atomic_write(keys) as beside:
        write_tracks(beside, Tracks(tracks, SIZE, (FIRST, FIRST + FRAMES - 1)), ".json")
    film = film.replace(path="match-plate/plate.####.png")
    owned = tuple(track.replace(plate_id=film.id) for track in tracks)
    room = tuple(track for track in owned if track.name.startswith("room"))
    document = Document(first_frame=FIRST, last_frame=FIRST + FRAMES - 1, fps=24.0, plates=(film,), tracks=owned)
    document = put_solve(document, solved_camera(film, room, SolveSettings(focal=FOCAL)))
    write_project(project, document, Workspace(craft="match"))
    write_picture(image, overlay(done, tracks, model, pictures[SHOWN - FIRST]), 90)
    return [str(path) for path in (camera, keys, project, image)]


def overlay(
    done: ShotSolved, tracks: tuple[Track, ...], model: Figure, picture: NDArray[np.uint8]
) -> NDArray[np.uint8]:
    """The plate, and beside it the plate brighter with the solved figure, the room's points and the tracks over it."""
    bright = np.clip(picture.astype(np.float64) * 2.6 + 8.0, 0, 255).astype(np.uint8)
    drawn = cv2.resize(bright, None, fx=2.0, fy=2.0, interpolation=cv2.INTER_CUBIC)
    row = int(np.searchsorted(done.shot.frames, SHOWN))
    pose = posed(REST, NECK, done.neck.values[row])
    points = deformed(model.mesh.points, model.rig, local_of_pose(model.rig.skeleton, pose)).astype(np.float64)
    world = done.body.thing.world[int(np.searchsorted(done.body.thing.frames, SHOWN))]
    points = (points @ world[:3, :3].T + world[:3, 3]) @ FLIP
    drawn = _laid_over(drawn, model, points, done.shot.pixels(row, points), done.shot.centres()[row])
    for track in tracks:
        at = np.searchsorted(track.frames, SHOWN)
        if at < len(track.frames) and track.frames[at] == SHOWN:
            _cross(drawn, 2 * track.points[at] + 0.5, (255, 255, 255))
    held = done.shot.pixels(row, done.shot.points)
    for place in np.round((2 * held + 0.5) * 8).astype(int).tolist():
        cv2.circle(drawn, tuple(place), 14 * 8, (255, 110, 110), 2, cv2.LINE_AA, 3)
    small = cv2.resize(drawn, SIZE, interpolation=cv2.INTER_AREA)
    return np.concatenate([picture, small], axis=1)


def _laid_over(
    picture: NDArray[np.uint8], model: Figure, points: NDArray[np.float64], xy: NDArray[np.float64],
    eye: NDArray[np.float64],
) -> NDArray[np.uint8]:
    """The figure's faces that look at the camera, a colour for each part, lit from the eye."""
    corners = model.mesh.corners.reshape(-1, 4)
    a, b, c = (points[corners[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    facing = ((eye - a) * normal).sum(axis=1) / np.maximum(
        np.linalg.norm(normal, axis=1) * np.linalg.norm(eye - a, axis=1), 1e-12)
    shade = picture.copy()
    order = np.argsort(-np.linalg.norm(a - eye, axis=1))
    for face in order[facing[order] > 0.0]:
        name = model.mesh.part_names[model.mesh.parts[face]]
        outline = [np.round((2 * xy[corners[face]] + 0.5) * 8).astype(np.int32)]
        lit = 0.25 + 0.75 * facing[face]
        cv2.fillPoly(shade, outline, tuple(lit * value for value in COLOURS[name]), cv2.LINE_AA, 3)
        if name != "head":
            cv2.polylines(shade, outline, True, COLOURS[name], 1, cv2.LINE_AA, 3)
    return np.asarray(cv2.addWeighted(shade, 0.5, picture, 0.5, 0.0))


def _cross(picture: NDArray[np.uint8], place: NDArray[np.float64], colour: tuple[int, int, int]) -> None:
    for way in ((1, 0), (0, 1)):
        ends = [tuple(np.round((place + side * 7 * np.array(way)) * 8).astype(int)) for side in (-1, 1)]
        cv2.line(picture, ends[0], ends[1], colour, 2, cv2.LINE_AA, 3)
