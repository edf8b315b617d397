"""Things that move by themselves before a plate that is solved: each by the points of its mesh that were tracked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.match.solve.moving import Moving, in_world, solve_moving, solve_with_camera
from core.match.solve.observed import observations_of
from core.match.solve.shot import FLIP, Thing
from core.match.solve.solution import Solution
from core.match.solve.state import CENTRE_X, CENTRE_Y, FOCAL, Array, Observations, residuals
from core.match.track import Track
from core.mesh.mesh import Mesh


class Given(NamedTuple):
    """A thing as it is told. names : of the tracks that are on it; places (P, 3) of those on its mesh.

    tracks : its own, where they do not stand among the plate's. loose : standard deviation of the places, 0 where the
    mesh is right. scale : units of the scene in one of the mesh.
    """

    name: str
    mesh: Mesh
    names: tuple[str, ...]
    places: Array
    tracks: tuple[Track, ...] = ()
    loose: float = 0.0
    scale: float = 1.0


class Found(NamedTuple):
    """A thing that was solved. rms_px : RMS of its tracks; turn_sigma : radians, of its pose, in the median."""

    thing: Thing
    moving: Moving
    rms_px: float
    turn_sigma: float


def without(tracks: Sequence[Track], things: Sequence[Given]) -> tuple[Track, ...]:
    """The tracks that are of the scene."""
    gone = {name for thing in things for name in thing.names}
    return tuple(track for track in tracks if track.name not in gone)


def find_thing(solution: Solution, given: Given, tracks: Sequence[Track]) -> tuple[Solution, Found]:
    """A thing before a solved camera, which knows its focal length better afterwards where that was looked for.

    tracks : of the plate.

    Raises
    ------
    UserError
        Tracks it names are missing, or no frame sees enough of it.
    """
    observations, frames = _seen(solution, given, tracks)
    state = solution.state
    noise = solution.noise
    try:
        moving = solve_moving(observations, given.places, state.lens, state.focal, noise=noise, loose=given.loose)
    except UserError as error:
        raise UserError(f"{given.name}: {error}") from None
    free = solution.free
    if FOCAL in free.lens and free.zoom is None and free.pull is None and solution.kind != "nodal":
        used = solution.observations.take(solution.used)
        moving = solve_with_camera(
            state, used, moving, observations, given.places, find_focal=True, loose=given.loose)
        assert moving.camera is not None
        solution = solution._replace(state=moving.camera)
    part = observations.take(moving.used)
    alone = solution.state._replace(
        rotation=moving.rotation, translation=moving.translation, points=moving.points)
    pixels = np.linalg.norm(residuals(alone, part), axis=1) / np.sqrt(part.root[:, 0] * part.root[:, 2])
    known = np.flatnonzero(moving.known)
    turn, place = in_world(moving, solution.state, given.scale)
    world = np.tile(np.eye(4), (len(known), 1, 1))
    world[:, :3, :3], world[:, :3, 3] = given.scale * FLIP @ turn[known], place[known] @ FLIP
    thing = Thing(given.name, given.mesh, frames[known], world)
    return solution, Found(
        thing, moving, float(np.sqrt((pixels**2).mean())), float(np.nanmedian(moving.turn_sigma[known])))


def _seen(solution: Solution, given: Given, tracks: Sequence[Track]) -> tuple[Observations, NDArray[np.int32]]:
    """What was seen of a thing in the frames that have a camera, with the solver's pixels; numbers of the frames."""
    own = {track.name: track for track in (given.tracks or tracks)}
    missing = [name for name in given.names if name not in own]
    if missing:
        raise UserError(f"{given.name}: there is no track {missing[0]!r}; name tracks as they are called.")
    observations, numbers = observations_of([own[name] for name in given.names])
    row = {int(number): k for k, number in enumerate(solution.frames) if solution.views.camera[k] == 0}
    frame = np.array([row.get(int(number), -1) for number in numbers], np.int32)[observations.frame]
    kept = (frame >= 0) & solution.known[frame]
    part = observations.take(kept)._replace(frame=np.ascontiguousarray(frame[kept]))
    order = np.argsort(part.frame, kind="stable")
    part = part.take(order)
    pixel, middle = solution.pixel[part.frame, None], solution.state.lens[[CENTRE_X, CENTRE_Y]]
    return part._replace(
        xy=np.ascontiguousarray(middle + (part.xy - middle) / pixel), root=np.ascontiguousarray(part.root * pixel),
    ), solution.frames
