"""A thing that moves by itself, of known shape: its pose in every frame, beside the camera or together with it.

Seen from the thing, the camera moves: its frames are further frames of one bundle that share the lens, and the places
of its points are held where the mesh has them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from core.errors import UserError
from core.match.solve.bundle import POSE, Free, adjust, normal_equations
from core.match.solve.constraints import Constraint, Pull
from core.match.solve.first import pose_from_points
from core.match.solve.state import FOCAL, Array, Flags, Observations, State, bearings, residuals

FEWEST = 3  # points of a frame whose pose is near that of its neighbours
LEAST = 5  # points of a frame whose pose is not known at all
OUTLIER = 4.5  # standard deviations
ROBUST = 2.5


class Moving(NamedTuple):
    """rotation (F, 3, 3), translation (F, 3) : camera_from_object, of the solver's camera. known : (F,).

    points : (P, 3) in the object, where the mesh has them or where they were found near it. used : (N,) observations
    that fit. sigma : standard deviation of the whitened residuals of an axis. turn_sigma : (F,) radians, of the pose.
    lens : (columns of a lens). camera : the state of the camera that was solved with it, or None.
    """

    rotation: Array
    translation: Array
    known: Flags
    points: Array
    used: Flags
    sigma: float
    turn_sigma: Array
    lens: Array
    camera: State | None = None


def solve_moving(
    observations: Observations, places: Array, lens: Array, focal: Array, *, noise: float = 0.5, loose: float = 0.0
) -> Moving:
    """The pose of an object in every frame, of a camera whose lens is known.

    observations : of F frames; track is the row of a point. places : (P, 3) of the points in the object.
    focal : (F,) logarithm of each frame's zoom. noise : whitened, of the tracks.
    loose : standard deviation of the places in units of the object; 0 where the mesh is right.

    Raises
    ------
    UserError
        No frame sees enough points, or the points lie on a line.
    """
    spread = np.linalg.svd(places - places.mean(axis=0), compute_uv=False) if len(places) else np.zeros(3)
    if len(places) < LEAST or spread[1] < 1e-6 * max(spread[0], 1e-30):
        raise UserError(f"An object needs {LEAST} points of its mesh at least that are not on one line; pick more.")
    state, known = _begun(observations, places, lens, focal, noise)
    used = known[observations.frame]
    for robust in (True, True, False):
        state = _adjusted(state, observations.take(used), places, loose, ROBUST * noise if robust else 0.0)
        error = np.linalg.norm(residuals(state, observations), axis=1)
        sigma = float(np.median(error[used])) / 1.1774
        used = known[observations.frame] & (error < OUTLIER * max(noise, sigma))
        known = known & (np.bincount(observations.frame[used], minlength=len(known)) >= FEWEST)
        used &= known[observations.frame]
    if not known.any():
        raise UserError("The points of the mesh do not fit what was tracked in any frame; look which point is which.")
    return _told(state, observations, known, used, None)


def solve_with_camera(
    camera: State, seen: Observations, moving: Moving, observations: Observations, places: Array, *,
    find_focal: bool = False, loose: float = 0.0,
) -> Moving:
    """Camera and object adjusted together, from where each was solved by itself: they share the lens.

    camera : F frames, points of the scene. seen : observations of those. find_focal : the focal length is found from
    both, as a mesh of known shape knows it too.
    """
    frames, scene = len(camera.rotation), len(camera.points)
    known = np.flatnonzero(moving.known)
    number = np.full(frames, -1, np.int32)
    number[known] = frames + np.arange(len(known))
    own = observations.take(moving.used)
    own = own._replace(frame=number[own.frame], track=(own.track + scene).astype(np.int32))
    both = Observations(
        np.concatenate([seen.frame, own.frame]), np.concatenate([seen.track, own.track]),
        np.concatenate([seen.xy, own.xy]), np.concatenate([seen.root, own.root]),
    )
    state = State(
        np.concatenate([camera.rotation, moving.rotation[known]]),
        np.concatenate([camera.translation, moving.translation[known]]),
        np.concatenate([camera.points, moving.points]), np.concatenate([camera.focal, camera.focal[known]]),
        camera.lens,
    )
    size = float(np.ptp(places, axis=0).max())
    held = [Constraint("survey", (scene + k,), tuple(map(float, place)), loose) for k, place in enumerate(places)]
    pull = Pull(held, len(state.points), size)
    state = adjust(state, both, Free(lens=(FOCAL,) if find_focal else (), pull=pull), tolerance=1e-7).state
    rotation, translation = moving.rotation.copy(), moving.translation.copy()
    rotation[known], translation[known] = state.rotation[frames:], state.translation[frames:]
    alone = State(rotation, translation, state.points[scene:], camera.focal, state.lens)
    solved = State(
        np.ascontiguousarray(state.rotation[:frames]), state.translation[:frames], state.points[:scene], camera.focal,
        state.lens,
    )
    return _told(alone, observations, moving.known, moving.used, solved)


def in_world(moving: Moving, camera: State, scale: float = 1.0) -> tuple[Array, Array]:
    """Rotation (F, 3, 3) and place (F, 3), world_from_object; `scale` brings units of the object to those of the scene.
    """
    turn = np.einsum("fji,fjk->fik", camera.rotation, moving.rotation)
    place = np.einsum("fji,fj->fi", camera.rotation, scale * moving.translation - camera.translation)
    return turn, place


def _begun(
    observations: Observations, places: Array, lens: Array, focal: Array, noise: float
) -> tuple[State, Flags]:
    """Poses by three points where enough are seen; between those, that of the neighbour before or after."""
    count = len(focal)
    flat = bearings(lens, focal[observations.frame], observations.xy)[:, :2]
    pixel = noise / np.maximum(np.median(observations.root[:, 0]), 1e-9) / np.exp(lens[FOCAL])
    rotation, translation = np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3))
    known = np.zeros(count, bool)
    rows = [np.flatnonzero(observations.frame == f) for f in range(count)]
    for f, at in enumerate(rows):
        if len(at) >= LEAST:
            pose = pose_from_points(places[observations.track[at]], flat[at], float(pixel))
            if pose is not None:
                rotation[f], translation[f], known[f] = *pose, True
    for order in (range(1, count), range(count - 2, -1, -1)):
        for f in order:
            near = f - 1 if order.step > 0 else f + 1
            if not known[f] and known[near] and len(rows[f]) >= FEWEST:
                rotation[f], translation[f], known[f] = rotation[near], translation[near], True
    if not known.any():
        raise UserError(f"No frame sees {LEAST} points of the mesh; pick more of them, or track them longer.")
    return State(rotation, translation, places.copy(), focal.copy(), lens.copy()), known


def _adjusted(state: State, observations: Observations, places: Array, loose: float, scale: float) -> State:
    if not loose:
        free = Free(frame=POSE, points=False)
        return adjust(state, observations, free, scale=scale, iterations=40, tolerance=1e-8).state
    held = [Constraint("survey", (k,), tuple(map(float, place)), loose) for k, place in enumerate(places)]
    pull = Pull(held, len(places), float(np.ptp(places, axis=0).max()))
    return adjust(state, observations, Free(pull=pull), scale=scale, iterations=40, tolerance=1e-8).state


def _told(state: State, observations: Observations, known: Flags, used: Flags, camera: State | None) -> Moving:
    part = observations.take(used)
    error = residuals(state, part)
    freedom = max(1, 2 * len(part.frame) - 6 * int(known.sum()))
    sigma = float(np.sqrt((error**2).sum() / freedom))
    blocks = normal_equations(state, part, 0.0, Free(points=False)).frames[:, :6, :6]
    turn = np.full(len(known), np.nan)
    for f in np.flatnonzero(known):
        try:
            covariance = np.linalg.inv(blocks[f])
        except np.linalg.LinAlgError:
            continue
        turn[f] = sigma * np.sqrt(max(float(np.trace(covariance[:3, :3])), 0.0) / 3.0)
    return Moving(
        state.rotation, state.translation, known, state.points, used, sigma, turn, state.lens, camera
    )
