"""The whole solve: from tracks to a camera path, its kind, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from core.errors import UserError
from core.match.lens import model_named
from core.match.solve.bundle import POSE, TURN, Free, adjust
from core.match.solve.first import Cameras, Grower, best_pairs, keyframes, rays, triangulated
from core.match.solve.floor import noise_floor
from core.match.solve.nodal import solve_nodal
from core.match.solve.rolling import Motion, found_readout, motion, unrolled
from core.match.solve.slides import correlation, sliding
from core.match.solve.state import (
    FOCAL,
    FRAME_FOCAL,
    K1,
    Array,
    Flags,
    Observations,
    Rows,
    State,
    bearings,
    residuals,
    start_lens,
)
from core.match.solve.views import Camera, Views, as_one, check, guessed, one_shot, ties
from core.match.track import HAND, Track

LEAST_TRACKS, LEAST_PICKS = 8, 6  # of a shot; of photographs
NODAL_SURE, NODAL_MAYBE = 1.3, 3.0  # median residual over the noise: a turning camera explains it; it may
ACCEPT = 1.25  # of the noise: the keyframes are explained
ASTRAY = 1.1  # of the noise, of all frames: there may be a better path
WORSE = 1.15  # of the noise: something of the lens may be missing
GAIN = 0.93  # of the median residual: a richer lens is worth its parameters
MEDIAN = 1.1774  # median of the length of a normal vector in the plane
FOCALS = (0.7, 1.0, 1.6, 2.8)  # of the width of the picture, where nobody knows
AROUND = (1.0, 0.8, 1.25)  # of the focal length given, where it is to be found: a fast pan leads a search astray
OUTLIER = 4.5  # standard deviations
PICKED = 1.0 / 2000.0  # of the width of a photograph: noise of what was seen in photographs alone
WILD = 0.005  # of the width of the picture: noise no tracker makes
TOGETHER = 2e-3  # of the width of the picture: tracks so near to each other are one place
ON_LINE = 1e-3  # of the width of the picture: tracks so near to a line lie on it
ROOM, OUTSIDE = 0.1, 0.1  # of the size beyond the picture; share of the tracks that may be farther out
EXACT = 0.05  # pixels: tracks are not seen better than that, computed ones are not trusted further
FLOOR = 0.5  # pixels: noise where too few tracks are seen together to tell it
HYPOTHESES = 6
RAMPS = (0.35, -0.35)  # of the logarithm of the focal length from the first frame to the last
RAMPED = 0.9  # of the residuals: such a zoom or bend explains more
LEFT_OUT, WANDERS = 0.1, 0.1  # share of the tracks that do not fit, and correlation of what the others miss by
LEAST_DOUBTED = 6  # tracks of a frame in which some do not fit
ROUNDS_OUT = 5  # of leaving out what does not fit; two, and more while slow slides are found
ROUNDS, REFOCUSED = 3, 0.002  # of a camera whose distortion was taken out at a focal length that moved by this part
REBENT = 1e-3  # of a number of a lens that was taken for another


class Options(NamedTuple):
    """focal : pixels, or None. free_focal : find it too. zoom : it changes from frame to frame.
    distortion : find the bend of the lens too. nodal : the camera only turns. lens : a model of core/match/lens.py.
    readout : share of a frame in which a rolling shutter reads all rows, from above. free_readout : find it too.
    given : (L,) a lens that was measured; its bend stays, its focal length is a beginning where `focal` is None."""

    focal: float | None = None
    free_focal: bool = False
    zoom: bool = False
    distortion: bool = False
    nodal: bool = False
    lens: str = "brown"
    readout: float = 0.0
    free_readout: bool = False
    given: Array | None = None

    def lens_at(self, focal: float, size: tuple[int, int]) -> Array:
        """The lens a solve begins with at a focal length in pixels."""
        if self.given is None:
            return start_lens(focal, *size, self.lens)
        lens = self.given.copy()
        lens[FOCAL] = np.log(focal)
        return lens


AS_GIVEN = Options()


class Solution(NamedTuple):
    """A solved path.

    state : F frames and P points; frames (F,) their numbers; tracks (P,) rows of the tracks given.
    known : (F,) frames that have a camera. held : (P,) tracks that have a point. used : (N,) observations counted in.
    kind : "free" or "nodal". noise : standard deviation of an axis the tracks have by themselves, whitened.
    sigma : standard deviation of the whitened residuals of an axis. keys : rows of the keyframes.
    free : what was found; the rest was given. said : words for the artist.
    pixel : (F,) pixels of its own picture that one of the solve is in each frame; 1 but for photographs and witnesses.
    views : who took which frame. The observations are as the first camera would have them.
    noise_told : whether the tracks told `noise`; too few seen together do not.
    """

    state: State
    frames: Rows
    known: Flags
    held: Flags
    used: Flags
    observations: Observations
    kind: str
    noise: float
    sigma: float
    keys: tuple[int, ...]
    size: tuple[int, int]
    free: Free
    said: tuple[str, ...]
    pixel: Array
    views: Views
    noise_told: bool = True


def observations_of(tracks: Sequence[Track]) -> tuple[Observations, Rows]:
    """Observations of tracks and the numbers of their frames, (F,) rising.

    The covariance of each is that of the tracker; where none is known (keys of a hand, other programs) it is 1 px^2.
    """
    frames = np.unique(np.concatenate([t.frames for t in tracks])) if tracks else np.zeros(0, np.int32)
    rows, numbers, xy, covariance = [], [], [], []
    for k, track in enumerate(tracks):
        rows.append(np.searchsorted(frames, track.frames))
        numbers.append(np.full(len(track.frames), k))
        xy.append(track.points)
        covariance.append(track.own)
    if not rows:
        raise UserError("There are no tracks to solve from; track some points first.")
    order = np.argsort(np.concatenate(rows), kind="stable")
    c = np.concatenate(covariance)[order]
    hand = c[:, 0] <= 4.0 * HAND
    if hand.mean() > 0.5:
        c[:] = [1.0, 0.0, 1.0]
    else:
        c[hand] = np.median(c[~hand], axis=0)
    c[:, [0, 2]] = np.maximum(c[:, [0, 2]], 1e-4)
    limit = 0.95 * np.sqrt(c[:, 0] * c[:, 2])
    c[:, 1] = np.clip(c[:, 1], -limit, limit)
    # root U (upper) of the inverse covariance, U^T U = C^-1, in closed form
    rest = c[:, 0] - c[:, 1] ** 2 / c[:, 2]
    u00 = 1.0 / np.sqrt(rest)
    root = np.stack([u00, -c[:, 1] / c[:, 2] * u00, 1.0 / np.sqrt(c[:, 2])], axis=1)
    return Observations(
        np.concatenate(rows)[order].astype(np.int32), np.concatenate(numbers)[order].astype(np.int32),
        np.ascontiguousarray(np.concatenate(xy)[order], np.float64), np.ascontiguousarray(root),
    ), frames.astype(np.int32)


def solve(
    observations: Observations, frames: Rows, tracks: int, size: tuple[int, int], options: Options = AS_GIVEN,
    progress: Callable[[str], None] = lambda words: None, views: Views | None = None,
) -> Solution:
    """Cameras and points from observations of `tracks` tracks in frames (F,) of `size` pixels.

    views : who took which frame, where it is not one shot; its first camera is the one `size` and `options` tell of.

    Raises
    ------
    UserError
        There is no camera that explains the tracks, or it cannot be told; the message says why.
    """
    views = views or one_shot(len(frames), Camera(size))
    views = views._replace(cameras=(
        views.cameras[0]._replace(focal=options.focal, found=options.free_focal), *views.cameras[1:]))
    if options.given is not None or (len(views.cameras) > 1 and options.lens != "brown"):
        views = views._replace(bend=options.lens_at(options.focal or float(size[0]), size))
    check(views)
    _check(observations, frames, tracks, views)
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
                found.state, observations.take(used), Motion(*(part[used] for part in moving)), found.free, readout,
                found.sigma)
        found = _best(
            unrolled(observations, moving, readout), frames, tracks, size, options, progress, found.views, guesses)
    if options.free_readout:
        found = found._replace(said=(
            *found.said, f"The shutter reads the picture in {readout:.3f} +- {sigma:.3f} of a frame."))
    return found


def _at_another_focal(
    found: Solution, observations: Observations, frames: Rows, tracks: int, size: tuple[int, int], options: Options,
    progress: Callable[[str], None], views: Views,
) -> Solution:
    """The solve at a focal length far from the one given, where that leaves too much and another leaves far less."""
    if not _misses(found):
        return found
    progress("does another focal length fit?")
    free = options._replace(focal=None, free_focal=True)
    try:
        other = _best(
            observations, frames, tracks, size, free, progress, views, [share * max(size) for share in FOCALS])
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
        np.ascontiguousarray(found.state.rotation[frames]), found.state.translation[frames], found.state.points,
        np.zeros(len(frames)), camera.lens(focal))
    free = Free(lens=(FOCAL, K1) if looked else (K1,), points=False)
    lens = adjust(state, part, free, scale=2.5 * found.sigma).state.lens
    own = float(np.exp(lens[FOCAL])) if looked else camera.focal
    return camera._replace(k1=float(lens[K1]), focal=own, found=looked)


def _best(
    observations: Observations, frames: Rows, tracks: int, size: tuple[int, int], options: Options,
    progress: Callable[[str], None], views: Views, guesses: list[float],
) -> Solution:
    best: tuple[_Start, _Problem] | None = None
    for focal in guesses:
        problem = _Problem(observations, frames, tracks, size, options, views, focal, progress)
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
        other = _Problem(
            observations, frames, tracks, size, options._replace(distortion=True), views, problem.focal, progress)
        began = other.begin()
        if began.doubt < np.inf:
            bent = other.finish(began)
            said = f"The lens bends lines: k1 {bent.state.lens[K1]:+.4f} was found, which nobody asked for."
            found = bent._replace(said=(*bent.said, said)) if _better(bent, found) else found
    # a dolly zoom lies far from any path at one focal length: begin at zooms of an even pace
    likely: tuple[_Start, _Problem] | None = None
    for ramp in RAMPS:
        other = _Problem(
            observations, frames, tracks, size, options._replace(zoom=True), views, problem.focal, progress, ramp)
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


def _noise(observations: Observations, views: Views, size: tuple[int, int]) -> tuple[float, bool]:
    """Standard deviation of an axis in pixels, and whether the tracks told it: photographs and few tracks do not."""
    shot = np.flatnonzero(~views.alone)
    if len(shot) < 3 and views.alone.any():
        return PICKED * max(size), False
    number = np.full(len(views.alone), -1, np.int32)
    number[shot] = np.arange(len(shot))
    part = observations.take(number[observations.frame] >= 0)
    told = noise_floor(part._replace(frame=number[part.frame]), len(shot))
    pixels = FLOOR if told is None else max(told, EXACT)
    if pixels > WILD * size[0]:
        raise UserError(
            f"The tracks jump about by {pixels:.0f} px from frame to frame as no camera moves points: they are not "
            "tracks of one rigid scene."
        )
    return pixels, told is not None


def _check(observations: Observations, frames: Rows, tracks: int, views: Views) -> None:
    if len(frames) < 2:
        raise UserError("The tracks are on one frame only; a camera needs two frames at least, better twenty.")
    if not np.isfinite(observations.xy).all():
        raise UserError("The tracks hold places that are not numbers; track them again.")
    long = np.bincount(observations.track, minlength=tracks) >= 2
    least = LEAST_PICKS if views.alone.all() else LEAST_TRACKS
    if long.sum() < least:
        raise UserError(
            f"{int(long.sum())} tracks are seen on two frames or more; a camera needs {least} at least, better "
            "twenty, spread over the picture and over near and far."
        )
    if len(views.cameras) == 1:
        _check_places(observations, views.cameras[0].size)


def _check_places(observations: Observations, size: tuple[int, int]) -> None:
    """Raise UserError when tracks are not of a picture of `size`, or all at one place of it."""
    off = np.array(size) * ROOM
    outside = ((observations.xy < -off) | (observations.xy > np.array(size) + off)).any(axis=1)
    if outside.mean() > OUTSIDE:
        raise UserError(
            f"{max(1, round(100 * outside.mean()))} % of the tracks lie outside of a plate of {size[0]} x {size[1]} "
            "pixels; give the size of their own plate."
        )
    count = np.maximum(np.bincount(observations.frame), 1)
    away = observations.xy.copy()
    for axis in range(2):
        away[:, axis] -= (np.bincount(observations.frame, away[:, axis]) / count)[observations.frame]
    spread = np.sqrt(np.mean(away**2, axis=0))
    xx, xy, yy = (np.bincount(observations.frame, away[:, i] * away[:, j]) / count for i, j in ((0, 0), (0, 1), (1, 1)))
    across = np.sqrt(np.maximum(0.5 * (xx + yy) - np.hypot(0.5 * (xx - yy), xy), 0.0))  # of the line through each frame
    if np.hypot(*spread) < TOGETHER * size[0]:
        raise UserError(
            f"The tracks all lie within {4.0 * np.hypot(*spread):.1f} px of each other; a camera needs them spread "
            "over the picture."
        )
    if np.median(across[count > 2]) < ON_LINE * size[0]:
        raise UserError("The tracks all lie on one line of the picture; a camera needs them spread over it.")


class _Start(NamedTuple):
    """A beginning: doubt is the median residual over the noise, of keyframes."""

    doubt: float
    kind: str
    cameras: Cameras
    lens_columns: tuple[int, ...]
    zoom: bool
    said: tuple[str, ...]

    @property
    def richness(self) -> tuple[bool, int]:
        """See :func:`_richness`."""
        return _richness(self.lens_columns, self.zoom)


def _richness(columns: tuple[int, ...], zoom: bool) -> tuple[bool, int]:
    """Orders what may be free by how much that is: a bend is one number, a zoom as many as there are frames."""
    return zoom, len(columns)


class _Problem:
    def __init__(
        self, observations: Observations, frames: Rows, tracks: int, size: tuple[int, int], options: Options,
        views: Views, focal: float, progress: Callable[[str], None], ramp: float = 0.0,
    ) -> None:
        pace = np.exp(ramp * (frames - frames[0]) / max(1, int(frames[-1] - frames[0])))
        self.observations, self.pixel = as_one(observations, views, focal, pace)
        self.focal = focal
        self.frames, self.tracks, self.size, self.views = frames, tracks, size, views
        self.pixels, told = _noise(self.observations, views, size)
        self.noise = self.pixels * float(np.median(self.observations.root[:, 0]))
        self.noise_told = told
        self.least = self.noise if told else 0.2 * self.noise  # photographs may be seen better than usual
        self.options, self.lens, self.progress = options, options.lens_at(focal, size), progress
        self.keys = self._keys()
        self.part = self._of_keyframes()

    def _keys(self) -> list[int]:
        """Rows of all photographs and of keyframes of the shot."""
        alone = self.views.alone
        if not alone.any():
            return keyframes(self.observations, len(self.frames), self.tracks)
        shot = np.flatnonzero(~alone)
        number = np.full(len(alone), -1, np.int32)
        number[shot] = np.arange(len(shot))
        part = self.observations.take(number[self.observations.frame] >= 0)
        keys = keyframes(part._replace(frame=number[part.frame]), len(shot), self.tracks) if len(shot) else []
        return sorted([*(int(shot[k]) for k in keys), *(int(k) for k in np.flatnonzero(alone))])

    def _tied(self, rows: NDArray, *, zoom: bool) -> Array | None:
        return ties(self.views, rows, self.frames[rows], zoom=zoom)

    def _of_keyframes(self) -> Observations:
        number = np.full(len(self.frames), -1, np.int32)
        number[self.keys] = np.arange(len(self.keys))
        part = self.observations.take(number[self.observations.frame] >= 0)
        return part._replace(frame=number[part.frame])

    def _doubt(self, state: State, part: Observations) -> float:
        if not len(part.frame):
            return np.inf
        return float(np.median(np.linalg.norm(residuals(state, part), axis=1))) / MEDIAN / self.noise

    # -- keyframes ----------------------------------------------------------------------------------------

    def begin(self, *, turning: bool = True) -> _Start:
        """The best explanation of the keyframes that starts at the focal length; `turning` may be one of them."""
        lens = self.lens
        free = self.options.focal is None or self.options.free_focal
        nodal = self._nodal(lens, free) if turning and not self.views.alone.any() else None
        if nodal is not None and (nodal.doubt < NODAL_SURE or self.options.nodal):
            return nodal
        found = self._free(lens, free)
        if nodal is not None and nodal.doubt < NODAL_MAYBE and (found is None or found.doubt > ACCEPT):
            moves = "The camera hardly moves: it is solved as one that only turns. If it did move, this path is wrong."
            return nodal._replace(said=(*nodal.said, moves))
        if found is None:
            return _Start(np.inf, "none", Cameras(_nowhere(lens), np.zeros(0, bool), np.zeros(0, bool)), (), False, ())
        return found

    def _nodal(self, lens: Array, free: bool) -> _Start | None:
        self.progress("does the camera only turn?")
        best: _Start | None = None
        rows = np.asarray(self.keys)
        for columns, zoom in self._lenses(free):
            if best is not None and best.doubt < WORSE and _richness(columns, zoom) > best.richness:
                continue
            done = solve_nodal(
                self.part, len(self.keys), self.tracks, lens, self.pixels, scale=2.5 * self.noise,
                lens_columns=columns, zoom=self._tied(rows, zoom=zoom),
            )
            if done is None:
                continue
            doubt = self._doubt(done.state, self.part)
            if best is None or doubt < best.doubt * (GAIN if _richness(columns, zoom) > best.richness else 1.0):
                cameras = Cameras(done.state, np.ones(len(self.keys), bool), np.ones(self.tracks, bool))
                best = _Start(doubt, "nodal", cameras, columns, zoom, ())
        return best

    def _lenses(self, free: bool) -> list[tuple[tuple[int, ...], bool]]:
        """What of the lens may be free, and whether it zooms: what was asked for, then richer ones."""
        bent: tuple[int, ...] = model_named(self.options.lens).first if self.options.distortion else ()
        if len(self.views.cameras) > 1:  # focal lengths are columns of the frames then
            zoom, richer = self.options.zoom, (K1,)
            return [(bent, zoom)] if bent else [(bent, zoom), (richer, zoom)]
        asked = ((FOCAL,) if free else ()) + bent
        rigid = tuple(c for c in asked if c != FOCAL)
        if self.options.zoom:
            return [(rigid, True)]
        added: tuple[tuple[int, ...], ...] = ((), (FOCAL,), (K1,), (FOCAL, K1))
        models = [tuple(sorted({*more, *asked})) for more in added]
        zooms = [] if self.views.alone.all() else [(rigid, True)]  # photographs have no order a zoom could go by
        tries = [*((columns, False) for columns in models), *zooms]
        return [one for k, one in enumerate(tries) if one not in tries[:k]]

    def _changed(self, state: State, start: _Start) -> tuple[str, ...]:
        """Words where more was found than was asked for."""
        said = []
        focal = float(np.exp(state.lens[FOCAL]))
        asked = self.options.focal is None or self.options.free_focal
        if start.zoom and not self.options.zoom:
            said.append("The focal length changes over the shot: it was solved with a zoom, which nobody asked for.")
        elif FOCAL in start.lens_columns and not asked:
            said.append(f"The focal length given does not fit these tracks; {focal:.1f} px was found instead.")
        if K1 in start.lens_columns and not self.options.distortion and abs(state.lens[K1]) > REBENT:
            said.append(f"The lens bends lines: k1 {state.lens[K1]:+.4f} was found, which nobody asked for.")
        return tuple(said)

    def _free(self, lens: Array, free: bool) -> _Start | None:
        self.progress("looking for the first pair of frames")
        table = rays(self.part, lens, len(self.keys), self.tracks)
        noise = self.pixels / float(np.exp(lens[FOCAL]))
        grower = Grower(self.part, lens, table, noise, self.noise)
        pairs = best_pairs(table, noise)
        best: _Start | None = None
        for _, start in grower.hypotheses(pairs)[:HYPOTHESES]:
            self.progress("finding the keyframes")
            cameras = grower.grow(start)
            found = self._richer(grower, cameras, free)
            missing = 1.0 - float(found.cameras.known.mean())
            found = found._replace(doubt=found.doubt * (1.0 + missing))
            if best is None or found.doubt < best.doubt:
                best = found
            if best.doubt < ACCEPT:
                break
        return best

    def _key_doubt(self, cameras: Cameras) -> float:
        rows = cameras.known[self.part.frame] & cameras.held[self.part.track]
        return self._doubt(cameras.state, self.part.take(rows))

    def _richer(self, grower: Grower, cameras: Cameras, free: bool) -> _Start:
        """The lens with no more parameters than the tracks ask for."""
        best: _Start | None = None
        for columns, zoom in self._lenses(free):
            if best is not None and best.doubt < WORSE and _richness(columns, zoom) > best.richness:
                continue
            tied = self._tied(np.asarray(self.keys)[cameras.known], zoom=zoom)
            other = grower.adjusted(cameras, columns, tied) if columns or tied is not None else cameras
            doubt = self._key_doubt(other)
            if other is not cameras and doubt > ACCEPT:  # what did not fit at the beginning counts less now
                other = grower.adjusted(other, columns, tied)
                doubt = self._key_doubt(other)
            if best is None or doubt < best.doubt * (GAIN if _richness(columns, zoom) > best.richness else 1.0):
                best = _Start(doubt, "free", other, columns, zoom, ())
        assert best is not None
        return best

    # -- all frames ---------------------------------------------------------------------------------------

    def finish(self, start: _Start) -> Solution:
        """Cameras of all frames from those of the keyframes, without the tracks that do not fit."""
        if start.doubt == np.inf:
            raise UserError(
                "No camera explains these tracks: no two frames share enough of them at different places. Track more "
                "points that stay fixed in the scene, near and far, over more frames."
            )
        self.progress("finding the frames between")
        nodal = start.kind == "nodal"
        state, known, held = self._between(start, nodal)
        observations, count = self.observations, len(self.frames)
        zoom = self._tied(np.arange(count), zoom=start.zoom)
        columns = (TURN if nodal else POSE) + ((FRAME_FOCAL,) if zoom is not None else ())
        lens = start.lens_columns
        if self.options.distortion:
            lens = tuple(sorted({*lens, *model_named(self.options.lens).found}))
        free = Free(frame=columns, lens=lens, zoom=zoom)
        least = 1e-6 if nodal else 1e-12
        used = known[observations.frame] & held[observations.track]
        self.progress("adjusting all frames together")
        spread = max(self.least, self._spread(state, observations, used))
        state = adjust(
            state, observations.take(used), free, scale=2.5 * spread, tolerance=1e-4, least_damping=least, iterations=20
        ).state
        sliders = np.zeros(self.tracks, bool)
        for k in range(ROUNDS_OUT):
            spread = max(self.least, self._spread(state, observations, used))
            more = np.zeros(self.tracks, bool)
            if not self.views.alone.any():
                told = self._spread(state, observations, used)
                more = sliding(state, observations.take(used), self.tracks, told) & held
            if k >= 2 and not more.any():
                break
            sliders |= more
            error = np.linalg.norm(residuals(state, observations), axis=1) / spread
            dof = np.maximum(2.0 * np.bincount(observations.track[used], minlength=self.tracks) - 3.0, 1.0)
            chi = np.bincount(
                observations.track[used], weights=np.minimum(error[used], 50.0) ** 2, minlength=self.tracks) / dof
            held = held & (chi < 1.5 + 5.0 * np.sqrt(2.0 / dof)) & ~sliders
            used = known[observations.frame] & held[observations.track] & (error < OUTLIER)
            seen = np.bincount(observations.track[used], minlength=self.tracks)
            held = held & (seen >= 2)
            used &= held[observations.track]
            state = adjust(state, observations.take(used), free, tolerance=1e-6, least_damping=least).state
        of_frame = np.bincount(observations.frame[used], minlength=count)
        seen_there = np.bincount(observations.frame, minlength=count)
        # four tracks may fit a wrong camera when the fifth, which does not, was left out for it
        known = known & (of_frame >= np.where(of_frame < seen_there, LEAST_DOUBTED, 4))
        used &= known[observations.frame]
        final = residuals(state, observations.take(used))
        freedom = 2 * int(used.sum()) - len(columns) * int(known.sum()) - 3 * int(held.sum())
        exact = EXACT * self.noise / self.pixels  # of tracks that were computed: doubts are still those of a picture
        sigma = max(float(np.sqrt((final**2).sum() / max(1, freedom))), exact)
        return Solution(
            state, self.frames, known, held, used, observations, start.kind, self.noise, sigma, tuple(self.keys),
            self.size, free, (*self._changed(state, start), *start.said), self.pixel, self.views, self.noise_told,
        )

    def _spread(self, state: State, observations: Observations, used: Flags) -> float:
        return float(np.median(np.linalg.norm(residuals(state, observations.take(used)), axis=1))) / MEDIAN

    def _between(self, start: _Start, nodal: bool) -> tuple[State, Flags, Flags]:
        """Poses between keyframes by interpolation, then each moved to where it sees the points it should."""
        cameras = start.cameras
        count = len(self.frames)
        state, reach = self._interpolated(cameras)
        held = cameras.held
        scale = 2.5 * max(self.noise, min(start.doubt, 10.0) * self.noise)
        columns = TURN if nodal else POSE
        known = reach.copy()
        for _ in range(2):  # frames beyond the keyframes follow from their neighbours
            rows = self.observations.take(held[self.observations.track] & reach[self.observations.frame])
            state = adjust(state, rows, Free(frame=columns, points=False), scale=scale, tolerance=1e-3).state
            known[:] = np.bincount(rows.frame, minlength=count) >= 4
            if nodal:
                break
            flat = np.full((count, self.tracks, 2), np.nan)
            bent = bearings(state.lens, state.focal[self.observations.frame], self.observations.xy)[:, :2]
            flat[self.observations.frame, self.observations.track] = bent
            points, least = triangulated(state.rotation[known], state.translation[known], flat[known])
            noise = self.pixels / float(np.exp(state.lens[FOCAL]))
            new = ~held & (least > noise**2)
            state, held = state._replace(points=np.where(new[:, None], points, state.points)), held | new
        return state, known, held

    def _interpolated(self, cameras: Cameras) -> tuple[State, Flags]:
        """All frames, and which of them have a pose: photographs that were found, and the shot between and beyond its
        keyframes."""
        count, alone = len(self.frames), self.views.alone
        keys = np.asarray(self.keys)
        rotation, translation = np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3))
        zoom, reach = np.zeros(count), np.zeros(count, bool)
        found = keys[cameras.known]
        rotation[found], translation[found] = (part[cameras.known] for part in cameras.state[:2])
        zoom[found], reach[found] = cameras.state.focal[cameras.known], True
        at = found[~alone[found]]
        shot = np.flatnonzero(~alone)
        if len(at):
            inside = np.clip(shot, at[0], at[-1])
            turns, centres = rotation[at], -np.einsum("fji,fj->fi", rotation[at], translation[at])
            turn = Slerp(at.astype(float), Rotation.from_matrix(turns))(inside).as_matrix() if len(at) > 1 else turns
            centre = np.stack([np.interp(inside, at, centres[:, k]) for k in range(3)], axis=1)
            rotation[shot], translation[shot] = turn, -np.einsum("fij,fj->fi", np.broadcast_to(
                turn, (len(shot), 3, 3)), centre)
            zoom[shot] = np.interp(inside, at, zoom[at])
            reach[shot] = True
        return State(rotation, translation, cameras.state.points, zoom, cameras.state.lens), reach


def _nowhere(lens: Array) -> State:
    return State(np.zeros((0, 3, 3)), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), lens)

