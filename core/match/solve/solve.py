"""The whole solve: from tracks to a camera path, its kind, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from core.errors import UserError
from core.match.solve.bundle import Free, adjust
from core.match.solve.observed import check_observations
from core.match.solve.problem import ACCEPT, REBENT, Problem, Start
from core.match.solve.rolling import Motion, found_readout, motion, unrolled
from core.match.solve.slides import correlation
from core.match.solve.solution import AS_GIVEN, Options, Solution
from core.match.solve.state import FOCAL, K1, Observations, Rows, State
from core.match.solve.views import Camera, Views, check, guessed, one_shot

ASTRAY = 1.1  # of the noise, of all frames: there may be a better path
FOCALS = (0.7, 1.0, 1.6, 2.8)  # of the width of the picture, where nobody knows
AROUND = (1.0, 0.8, 1.25)  # of the focal length given, where it is to be found: a fast pan leads a search astray
RAMPS = (0.35, -0.35)  # of the logarithm of the focal length from the first frame to the last
RAMPED = 0.9  # of the residuals: such a zoom or bend explains more
LEFT_OUT, WANDERS = 0.1, 0.1  # share of the tracks that do not fit, and correlation of what the others miss by
ROUNDS, REFOCUSED = 3, 0.002  # of a camera whose distortion was taken out at a focal length that moved by this part


def solve(
    observations: Observations,
    frames: Rows,
    tracks: int,
    size: tuple[int, int],
    options: Options = AS_GIVEN,
    progress: Callable[[str], None] = lambda words: None,
    views: Views | None = None,
) -> Solution:
    """Cameras and points from observations of `tracks` tracks in frames (F,) of `size` pixels.

    views : who took which frame, where it is not one shot; its first camera is the one `size` and `options` tell of.
    progress : told what is begun, and called without words many times between; what it raises ends the solve.

    Raises
    ------
    UserError
        There is no camera that explains the tracks, or it cannot be told; the message says why.
    """
    views = views or one_shot(len(frames), Camera(size))
    views = views._replace(
        cameras=(views.cameras[0]._replace(focal=options.focal, found=options.free_focal), *views.cameras[1:])
    )
    if options.given is not None or (len(views.cameras) > 1 and options.lens != "brown"):
        views = views._replace(bend=options.lens_at(options.focal or float(size[0]), size))
    check(views)
    check_observations(observations, frames, tracks, views)
    if options.focal is not None and options.free_focal and not options.nodal:
        guesses = [share * options.focal for share in AROUND]
    elif options.focal is not None or options.nodal:
        guesses = [options.focal or float(size[0])]
    else:
        guesses = [share * max(size) for share in FOCALS]
    found = _best(observations, frames, tracks, size, options, progress, views, guesses)
    if options.focal is not None and not (options.free_focal or options.nodal) and views.alone.sum() == 0:
        found = _at_another_focal(found, observations, frames, tracks, size, options, progress, views)
    for _ in range(ROUNDS):  # what bends the pictures of a camera is told over its focal length
        better = _refocused(found, observations)
        if better is None:
            break
        found = _best(observations, frames, tracks, size, options, progress, better, guesses)
    readout, sigma = options.readout, 0.0
    for _ in range(ROUNDS if readout or options.free_readout else 0):
        moving = motion(found.state, observations, frames, size[1], found.known)
        if options.free_readout:
            used = np.flatnonzero(found.used)
            readout, sigma = found_readout(
                found.state,
                observations.take(used),
                Motion(*(part[used] for part in moving)),
                found.free,
                readout,
                found.sigma,
            )
        found = _best(
            unrolled(observations, moving, readout), frames, tracks, size, options, progress, found.views, guesses
        )
    if options.free_readout:
        found = found._replace(
            said=(*found.said, f"The shutter reads the picture in {readout:.3f} +- {sigma:.3f} of a frame.")
        )
    return found


def _at_another_focal(
    found: Solution,
    observations: Observations,
    frames: Rows,
    tracks: int,
    size: tuple[int, int],
    options: Options,
    progress: Callable[[str], None],
    views: Views,
) -> Solution:
    """The solve at a focal length far from the one given, where that leaves too much and another leaves far less."""
    if not _misses(found):
        return found
    progress("does another focal length fit?")
    free = options._replace(focal=None, free_focal=True)
    try:
        other = _best(
            observations, frames, tracks, size, free, progress, views, [share * max(size) for share in FOCALS]
        )
    except UserError:
        return found
    if _misses(other) or _left_out(other) > 0.5 * _left_out(found):
        return found
    focal = float(np.exp(other.state.lens[FOCAL]))
    said = f"The focal length given does not fit these tracks; {focal:.1f} px was found instead."
    return other._replace(said=(said, *other.said))


def _misses(found: Solution) -> bool:
    """Whether many tracks do not fit, and those that do miss by something that goes on from frame to frame."""
    part = found.observations.take(found.used)
    return _left_out(found) > LEFT_OUT and correlation(found.state, part) > WANDERS


def _refocused(found: Solution, observations: Observations) -> Views | None:
    """Views with what was found of each camera, where its pictures would be brought to those of the first otherwise:
    the focal length their distortion was taken out at, that distortion, and how the first camera bends.

    observations : as they were given.
    """
    cameras = list(found.views.cameras)
    focal = np.exp(found.state.focal + found.state.lens[FOCAL]) * found.pixel
    moved, lens = False, found.state.lens
    for row, camera in enumerate(cameras):
        of_it = found.known & (found.views.camera == row)
        if not row or not of_it.any():
            continue
        looked = camera.found or camera.focal is None
        if camera.bends:
            own = _own_lens(found, observations, row, camera, float(np.median(focal[of_it])), looked)
            moved = moved or abs(own.k1 - camera.k1) > REBENT
            cameras[row] = own
        elif looked and (camera.k1 or camera.k2):
            cameras[row] = camera._replace(focal=float(np.median(focal[of_it])), found=True)
        moved = moved or abs(guessed(cameras[row]) / guessed(camera) - 1.0) > REFOCUSED
    before = found.views.bend
    bend = lens if len(cameras) > 1 and len(found.free.lens) > (FOCAL in found.free.lens) else before
    if bend is not None and (before is None or np.abs(bend - before)[1:].max() > REBENT):
        moved = True
    return found.views._replace(cameras=tuple(cameras), bend=bend) if moved else None


def _own_lens(
    found: Solution, observations: Observations, row: int, camera: Camera, focal: float, looked: bool
) -> Camera:
    """Another camera with the bend, and the focal length where that is looked for, that its own pictures ask for while
    the points stay where they are."""
    frames = np.flatnonzero(found.known & (found.views.camera == row))
    number = np.full(len(found.known), -1, np.int32)
    number[frames] = np.arange(len(frames))
    part = observations.take(found.used & (number[observations.frame] >= 0))
    part = part._replace(frame=number[part.frame])
    state = State(
        np.ascontiguousarray(found.state.rotation[frames]),
        found.state.translation[frames],
        found.state.points,
        np.zeros(len(frames)),
        camera.lens(focal),
    )
    free = Free(lens=(FOCAL, K1) if looked else (K1,), points=False)
    lens = adjust(state, part, free, scale=2.5 * found.sigma).state.lens
    own = float(np.exp(lens[FOCAL])) if looked else camera.focal
    return camera._replace(k1=float(lens[K1]), focal=own, found=looked)


def _best(
    observations: Observations,
    frames: Rows,
    tracks: int,
    size: tuple[int, int],
    options: Options,
    progress: Callable[[str], None],
    views: Views,
    guesses: list[float],
) -> Solution:
    best: tuple[Start, Problem] | None = None
    for focal in guesses:
        problem = Problem(observations, frames, tracks, size, options, views, focal, progress)
        start = problem.begin()
        if best is None or start.doubt < best[0].doubt:
            best = start, problem
    assert best is not None
    start, problem = best
    found = problem.finish(start)
    if start.kind == "nodal" and not options.nodal and not views.alone.any() and _left_out(found) > LEFT_OUT:
        moving = problem.begin(turning=False)
        other_way = problem.finish(moving) if moving.doubt < np.inf else found
        if _left_out(other_way) < 0.5 * _left_out(found):
            found, start = other_way, moving
    # a zoom nobody asked for begins on the path of one focal length, which may have led it astray
    unasked = start.zoom and not options.zoom and found.sigma > ASTRAY * found.noise
    doubtful = start.doubt > ACCEPT or unasked or _misses(found)
    if start.kind == "nodal" or not doubtful or views.alone.any() or len(views.cameras) > 1:
        return found
    if not (options.distortion or options.zoom):
        other = Problem(
            observations, frames, tracks, size, options._replace(distortion=True), views, problem.focal, progress
        )
        began = other.begin()
        if began.doubt < np.inf:
            bent = other.finish(began)
            said = f"The lens bends lines: k1 {bent.state.lens[K1]:+.4f} was found, which nobody asked for."
            found = bent._replace(said=(*bent.said, said)) if _better(bent, found) else found
    # a dolly zoom lies far from any path at one focal length: begin at zooms of an even pace
    likely: tuple[Start, Problem] | None = None
    for ramp in RAMPS:
        other = Problem(
            observations,
            frames,
            tracks,
            size,
            options._replace(zoom=True),
            views,
            problem.focal,
            progress,
            ramp,
            asked=options.zoom,
        )
        began = other.begin()
        if began.doubt < np.inf and (likely is None or began.doubt < likely[0].doubt):
            likely = began, other
    if likely is None:
        return found
    said = "The focal length changes over the shot: it was solved with a zoom, which nobody asked for."
    zoomed = likely[1].finish(likely[0]._replace(said=() if options.zoom else (said,)))
    if unasked and _left_out(zoomed) <= _left_out(found) and zoomed.sigma < found.sigma:
        return zoomed
    return zoomed if _better(zoomed, found) else found


def _better(richer: Solution, found: Solution) -> bool:
    """Whether a lens with more parameters leaves out far fewer tracks, or misses the same ones by less."""
    fewer = _left_out(richer) < 0.5 * _left_out(found) and richer.sigma < 1.05 * found.sigma
    return fewer or (_left_out(richer) < _left_out(found) + 0.02 and richer.sigma < RAMPED * found.sigma)


def _left_out(found: Solution) -> float:
    """Share of the tracks that do not fit."""
    seen = np.bincount(found.observations.track, minlength=len(found.held)) >= 2
    return 1.0 - float(found.held[seen].mean()) if seen.any() else 1.0
