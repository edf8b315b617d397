"""The structure solver: from picks to photographs that have a place, and to points, lines and circles.

A model that was solved before is only adjusted from where it is: that is what a drag of a pick does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from core.errors import UserError
from core.match.photomodel.begin import placed, with_rays
from core.match.photomodel.records import NOTHING, Photomodel
from core.match.photomodel.rows import Table, constraints_of, table_of
from core.match.photomodel.vanish import lined_up
from core.match.solve.bundle import POSE, Free, adjust
from core.match.solve.constraints import HARD, Constraint, Pull, circle_of
from core.match.solve.coordinates import Frame, Similarity, onto, to_frame
from core.match.solve.solution import Options
from core.match.solve.solve import solve
from core.match.solve.state import FOCAL, FRAME_FOCAL, Array, Flags, State, residuals, start_lens
from core.match.solve.views import as_one, guessed, ties

LOOSE = (1e-2, 1e-3)  # of the size of the scene: how hard constraints are brought in where nothing is solved yet
ROBUST = 3.0  # standard deviations of a pick
FEWEST = 4  # picks of a photograph that hold it
ALWAYS = ("survey", "on_plane", "axis")  # constraints that say where the world is


class Outcome(NamedTuple):
    """model : with the places that were found. pixels : (N,) by how much each pick misses, in pixels of its photograph.

    picks : (N, 3) int32 the row of the photograph, the kind (0 point, 1 line, 2 circle) and the row of what was picked.
    known : (F,) photographs that have a place. misses : of each constraint, in its own unit. warnings, advice : words.
    """

    model: Photomodel
    pixels: Array
    picks: Array
    known: Flags
    misses: Array
    constraints: tuple[Constraint, ...]
    warnings: tuple[str, ...]
    advice: tuple[str, ...]

    @property
    def rms(self) -> float:
        """Root mean square of the misses in pixels."""
        return float(np.sqrt(np.mean(self.pixels**2))) if len(self.pixels) else 0.0


def solved(model: Photomodel, *, again: bool = False) -> Outcome:
    """Solve a model; one that was solved before is adjusted from where it is, unless it is to be solved again.

    Raises
    ------
    UserError
        There are too few picks, or no cameras explain them; the message says what to do.
    """
    table = table_of(model)
    focal = guessed(table.views.cameras[0]) if model.photos else 1.0
    warm = not again and is_solved(model)
    if warm:
        table, pixel, state, known, held = _from_records(model, table, focal)
        hardness: tuple[float, ...] = (HARD,)
    else:
        table, pixel, state, known, held = _from_picks(model, table)
        circles = tuple(circle.replace(centre=None, normal=None, radius=None) for circle in model.circles)
        model = model.replace(circles=circles)  # of another world than the one that begins here
        hardness = (*LOOSE, HARD)
    state, held = placed(state, table, model, known, held)
    constraints = constraints_of(model, table, held)
    state, constraints, said = _in_frame(model, state, known, held, constraints, warm=warm)
    for k, hard in enumerate(hardness):
        state = _adjusted(state, table, known, held, constraints, hard, robust=not warm and k < len(hardness) - 1)
    if model.frame != type(model.frame)() and not any(one.kind in ALWAYS for one in constraints):
        state = _framed(model, state, known).state(state)
    return _outcome(model, state, table, pixel, known, held, constraints, said)


def is_solved(model: Photomodel) -> bool:
    """True when a model only needs to be adjusted: two photographs have a place, every point that they see twice has
    one, and no other photograph holds enough of these points to get one too."""
    there = {photo.id for photo in model.photos if photo.rotation is not None}
    lacking = [photo.id for photo in model.photos if photo.rotation is None]
    seen = np.concatenate([point.picks.photo for point in model.points if point.place is not None] or [NOTHING.photo])
    return len(there) > 1 and all((seen == id_).sum() < FEWEST for id_ in lacking) and all(
        point.place is not None for point in model.points if len(there & set(point.picks.photo.tolist())) > 1)


def live(model: Photomodel) -> Photomodel:
    """The model under a hand: solved again where only little has changed, left as it is where that cannot be.

    Points that were just picked a second time get their first place from their rays; a single photograph with edges
    along axes its camera from those.
    """
    ready = with_rays(model)
    try:
        return solved(ready).model if is_solved(ready) else lined_up(model)
    except UserError:
        return model


Begun = tuple[Table, Array, State, Flags, Flags]


def _from_records(model: Photomodel, table: Table, focal: float) -> Begun:
    observations, pixel = as_one(table.observations, table.views, focal)
    points = np.zeros((table.tracks, 3))
    held = np.zeros(table.tracks, bool)
    for row, point in enumerate(model.points):
        if point.place is not None:
            points[row], held[row] = point.place, True
    lens = start_lens(focal, *table.views.cameras[0].size)
    known = np.array([photo.rotation is not None for photo in model.photos])
    state = State(
        np.array([np.eye(3) if photo.rotation is None else photo.rotation for photo in model.photos]),
        np.array([photo.translation or (0.0, 0.0, 0.0) for photo in model.photos]),
        points, np.zeros(len(model.photos)), lens,
    )
    return table._replace(observations=observations), pixel, state, known, held


def _from_picks(model: Photomodel, table: Table) -> Begun:
    if len(model.photos) < 2:
        raise UserError("A model needs two photographs at least; add another one of the same thing.")
    main = table.views.cameras[0]
    of_points = table.observations.track < table.points
    found = solve(
        table.observations.take(of_points), np.arange(len(model.photos), dtype=np.int32), max(1, table.points),
        main.size, Options(main.focal, free_focal=main.found), views=table.views,
    )
    own = np.exp(found.state.lens[FOCAL] + found.state.focal) * found.pixel
    of_main = found.known & (table.views.camera == 0)
    focal = float(np.median(own[of_main])) if main.found and of_main.any() else guessed(main)
    views = table.views._replace(cameras=(main._replace(focal=focal), *table.views.cameras[1:]))
    observations, pixel = as_one(table.observations, views, focal)
    state = found.state._replace(
        lens=start_lens(focal, *main.size), focal=np.where(found.known, np.log(own / pixel / focal), 0.0)
    )
    points = np.zeros((table.tracks, 3))
    points[: table.points] = state.points[: table.points]
    held = np.zeros(table.tracks, bool)
    held[: table.points] = found.held[: table.points]
    # a point that was left out as an outlier is one a person picked: it is shown where it is, with its miss
    lost = ~held[: table.points] & np.isfinite(points[: table.points]).all(axis=1)
    seen = np.bincount(table.observations.track[of_points], minlength=table.points)
    held[: table.points] |= lost & (seen >= 2) & np.any(points[: table.points] != 0.0, axis=1)
    table = table._replace(observations=observations, views=views)
    return table, pixel, state._replace(points=points), found.known, held


def _adjusted(
    state: State, table: Table, known: Flags, held: Flags, constraints: list[Constraint], hard: float, *, robust: bool
) -> State:
    """All photographs and points that have a place, moved to where picks and constraints want them."""
    observations = table.observations
    frames, tracks = np.flatnonzero(known), np.flatnonzero(held)
    frame, track = np.full(len(known), -1, np.int32), np.full(len(held), -1, np.int32)
    frame[frames], track[tracks] = np.arange(len(frames)), np.arange(len(tracks))
    part = observations.take(known[observations.frame] & held[observations.track])
    part = part._replace(frame=frame[part.frame], track=track[part.track])
    small = State(
        np.ascontiguousarray(state.rotation[frames]), state.translation[frames], state.points[tracks],
        state.focal[frames], state.lens,
    )
    size = float(np.ptp(small.points, axis=0).max(initial=0.0)) or 1.0
    rows = [one._replace(points=tuple(int(track[row]) for row in one.points)) for one in constraints]
    pull = Pull(rows, len(tracks), size, hard) if rows else None
    tied = ties(table.views, frames, frames.astype(np.int32), zoom=False)
    main = table.views.cameras[0]
    free = Free(
        frame=(*POSE, FRAME_FOCAL) if tied is not None else POSE,
        lens=(FOCAL,) if tied is None and main.found else (), zoom=tied, pull=pull,
    )
    done = adjust(small, part, free, scale=ROBUST if robust else 0.0, iterations=60, tolerance=1e-6).state
    rotation, translation, focal = state.rotation.copy(), state.translation.copy(), state.focal.copy()
    points = state.points.copy()
    rotation[frames], translation[frames], focal[frames] = done.rotation, done.translation, done.focal
    points[tracks] = done.points
    return State(rotation, translation, points, focal, done.lens)


def _in_frame(
    model: Photomodel, state: State, known: Flags, held: Flags, constraints: list[Constraint], *, warm: bool
) -> tuple[State, list[Constraint], list[str]]:
    """The state where the world is, before constraints that speak of the world are asked to hold."""
    said: list[str] = []
    survey = [one for one in constraints if one.kind == "survey"]
    if len(survey) >= 3:
        if not warm:
            rows = [one.points[0] for one in survey]
            state = onto(state.points[rows], np.array([one.value for one in survey])).state(state)
        return state, constraints, said
    if survey:
        said.append(f"{len(survey)} measured points do not say where the world is; three are needed.")
        constraints = [one for one in constraints if one.kind != "survey"]
    if warm:
        return state, constraints, said
    distances = [one for one in constraints if one.kind == "distance"]
    state = _framed(model, state, known).state(state)
    state = _headed(constraints, state)
    if distances and model.frame.distance is None:
        i, j = distances[0].points
        state = to_frame(Frame(distance=(i, j, distances[0].value[0])), state.points).state(state)
    elif model.frame.distance is None:
        size = float(np.linalg.norm(np.ptp(state.points[held], axis=0)))
        state = Similarity(1.0 / max(size, 1e-12), np.eye(3), np.zeros(3)).state(state)
    return state, constraints, said


def _framed(model: Photomodel, state: State, known: Flags) -> Similarity:
    """Into the frame the artist asked for; without one the photographs say what is up."""
    rows = {point.id: row for row, point in enumerate(model.points)}
    frame = model.frame
    up = -state.rotation[known, 1].mean(axis=0)
    if frame.plane is None and frame.axis is None:
        length = float(np.linalg.norm(up))
        level = _upright(up / length) if length > 1e-6 else np.eye(3)
        middle = state.points[rows[frame.origin]] if frame.origin is not None else np.zeros(3)
        scale = 1.0
        if frame.distance is not None:
            ends = state.points[[rows[id_] for id_ in frame.distance]]
            scale = frame.length / max(float(np.linalg.norm(ends[1] - ends[0])), 1e-12)
        return Similarity(scale, level, -scale * level @ middle)
    return to_frame(Frame(
        origin=None if frame.origin is None else rows[frame.origin],
        axis=None if frame.axis is None else (rows[frame.axis[0]], rows[frame.axis[1]]),
        plane=None if frame.plane is None else tuple(rows[id_] for id_ in frame.plane),
        distance=None if frame.distance is None else (rows[frame.distance[0]], rows[frame.distance[1]], frame.length),
    ), state.points, up)


def _headed(constraints: list[Constraint], state: State) -> State:
    """The state turned about y so that the first edge known to lie along a level axis leads along it, not against."""
    for one in constraints:
        if one.kind == "axis" and np.hypot(one.value[0], one.value[2]) > abs(one.value[1]):
            way = state.points[one.points[1]] - state.points[one.points[0]]
            angle = np.arctan2(way[2], way[0]) - np.arctan2(one.value[2], one.value[0])
            cos, sin = np.cos(angle), np.sin(angle)
            turn = np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])
            return Similarity(1.0, turn, np.zeros(3)).state(state)
    return state


def _upright(up: Array) -> Array:
    """The least rotation that brings a unit direction onto +y."""
    return to_frame(Frame(plane=(0, 1, 2)), np.vstack([np.zeros(3), np.linalg.svd(up[None])[2][1:]]), up).turn


def _outcome(
    model: Photomodel, state: State, table: Table, pixel: Array, known: Flags, held: Flags,
    constraints: list[Constraint], said: list[str],
) -> Outcome:
    observations = table.observations
    used = known[observations.frame] & held[observations.track]
    part = observations.take(used)
    error = residuals(state, part)
    miss = np.linalg.norm(error, axis=1) / part.root[:, 0] * pixel[part.frame]
    focal = np.exp(state.lens[FOCAL] + state.focal) * pixel
    photos = tuple(
        photo.replace(
            rotation=state.rotation[row], translation=tuple(map(float, state.translation[row])),
            focal_px=float(focal[row]),
            find_focal=photo.find_focal or photo.focal_px is None,
        ) if known[row] else photo
        for row, photo in enumerate(model.photos)
    )
    points = tuple(
        point.replace(place=tuple(map(float, state.points[row])) if held[row] else None)
        for row, point in enumerate(model.points)
    )
    circles = []
    rows = {point.id: row for row, point in enumerate(model.points)}
    for circle, along in zip(model.circles, table.along_circles, strict=True):
        on = [row for row in (*along, *(rows[id_] for id_ in circle.points)) if held[row]]
        if len(on) >= 4:
            centre, axes, radius = circle_of(state.points[on])
            circle = circle.replace(
                centre=tuple(map(float, centre)), normal=tuple(map(float, axes[2])), radius=float(radius))
        circles.append(circle)
    picks = np.concatenate([observations.frame[used, None], table.pick[used]], axis=1)
    misses = Pull(constraints, table.tracks, 1.0).misses(state.points) if constraints else np.zeros(0)
    outcome = Outcome(
        model.replace(photos=photos, points=points, circles=tuple(circles)), miss, picks, known, misses,
        tuple(constraints), (), (),
    )
    return outcome._replace(warnings=(*said, *_warnings(outcome)), advice=_advice(outcome))


def _warnings(outcome: Outcome) -> list[str]:
    model = outcome.model
    said = [f"{photo.name} has no place: it shares too few points with the others, pick more of them in it."
            for photo, known in zip(model.photos, outcome.known, strict=True) if not known]
    counts = np.bincount(outcome.picks[:, 0], minlength=len(model.photos))
    said += [f"{photo.name} is held by {count} picks only; six would make it sure."
             for photo, count, known in zip(model.photos, counts, outcome.known, strict=True) if known and count < 6]
    for one, miss in zip(outcome.constraints, outcome.misses, strict=True):
        limit = 3.0 * one.sigma
        if one.sigma and miss > limit:
            names = ", ".join(model.points[row].name for row in one.points if row < len(model.points))
            said.append(f"The constraint {one.kind} of {names} is missed by {miss:.3g}, more than its tolerance.")
    return said


def _advice(outcome: Outcome) -> tuple[str, ...]:
    """The picks that miss most, the worst first."""
    if not len(outcome.pixels):
        return ()
    model = outcome.model
    typical = float(np.median(outcome.pixels))
    said = []
    for n in np.argsort(-outcome.pixels)[:3]:
        if outcome.pixels[n] > max(3.0 * typical, 1.0):
            photo, kind, row = outcome.picks[n]
            name = (model.points, model.lines, model.circles)[kind][row].name
            said.append(
                f"Look at {name} in {model.photos[photo].name}: it misses by {outcome.pixels[n]:.1f} px, the others by "
                f"{typical:.1f}.")
    loose = [point.name for point in model.points if point.place is None]
    if loose:
        said.append(f"Pick {', '.join(loose[:5])} in another photograph: seen once, a point has no depth.")
    return tuple(said)
