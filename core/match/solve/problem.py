"""One attempt at a solve: at one first focal length, with one kind of lens and zoom."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from core.errors import UserError
from core.match.lens import model_named
from core.match.solve.bundle import MOST_DAMPING, POSE, TURN, Free, adjust
from core.match.solve.first import Cameras, Grower, best_pairs, keyframes, rays, triangulated
from core.match.solve.floor import noise_floor
from core.match.solve.nodal import solve_nodal
from core.match.solve.slides import sliding
from core.match.solve.solution import Options, Solution
from core.match.solve.state import FOCAL, FRAME_FOCAL, K1, Array, Flags, Observations, Rows, State, bearings, residuals
from core.match.solve.views import Views, as_one, ties

NODAL_SURE, NODAL_MAYBE = 1.3, 3.0  # median residual over the noise: a turning camera explains it; it may
ACCEPT = 1.25  # of the noise: the keyframes are explained
WORSE = 1.15  # of the noise: something of the lens may be missing
GAIN = 0.93  # of the median residual: a richer lens is worth its parameters
MEDIAN = 1.1774  # median of the length of a normal vector in the plane
OUTLIER = 4.5  # standard deviations
PICKED = 1.0 / 2000.0  # of the width of a photograph: noise of what was seen in photographs alone
WILD = 0.005  # of the width of the picture: noise no tracker makes
EXACT = 0.05  # pixels: tracks are not seen better than that, computed ones are not trusted further
FLOOR = 0.5  # pixels: noise where too few tracks are seen together to tell it
HYPOTHESES = 6
LEAST_DOUBTED = 6  # tracks of a frame in which some do not fit
ROUNDS_OUT = 5  # of leaving out what does not fit; two, and more while slow slides are found
SETTLED = 1e-8  # damping that holds nothing back
BEGUN, DECLARED = 1.0, 100.0  # of the square of the logarithm by which a zoom starts at another focal length
# than the given one: steps do not walk along what the tracks cannot tell; the doubts of it are told without that
ZOOM_STEPS = 300  # at most: a zoom of a long lens looks nearly like walking ahead, along a bent valley
REBENT = 1e-3  # of a number of a lens that was taken for another


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


class Start(NamedTuple):
    """A beginning: doubt is the median residual over the noise, of keyframes."""

    doubt: float
    kind: str
    cameras: Cameras
    lens_columns: tuple[int, ...]
    zoom: bool
    said: tuple[str, ...]

    @property
    def richness(self) -> tuple[bool, int]:
        """See :func:`richness_of`."""
        return richness_of(self.lens_columns, self.zoom)


def richness_of(columns: tuple[int, ...], zoom: bool) -> tuple[bool, int]:
    """Orders what may be free by how much that is: a bend is one number, a zoom as many as there are frames."""
    return zoom, len(columns)


class Problem:
    """Tracks and a first lens. :meth:`begin` finds keyframes and their cameras, :meth:`finish` the rest.

    ramp : of the logarithm of the focal length from the first frame to the last, where a zoom is tried.
    asked : whether the zoom of the options is what was asked for, so that the focal length given is only a beginning.
    """

    def __init__(
        self,
        observations: Observations,
        frames: Rows,
        tracks: int,
        size: tuple[int, int],
        options: Options,
        views: Views,
        focal: float,
        progress: Callable[[str], None],
        ramp: float = 0.0,
        *,
        asked: bool = True,
    ) -> None:
        pace = np.exp(ramp * (frames - frames[0]) / max(1, int(frames[-1] - frames[0])))
        self.observations, self.pixel = as_one(observations, views, focal, pace)
        self.focal = focal
        self.frames, self.tracks, self.size, self.views = frames, tracks, size, views
        declared = options.focal is not None and not options.free_focal and not (options.zoom and asked)
        self.level = DECLARED if declared else BEGUN
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

    def begin(self, *, turning: bool = True) -> Start:
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
            return Start(np.inf, "none", Cameras(_nowhere(lens), np.zeros(0, bool), np.zeros(0, bool)), (), False, ())
        return found

    def _nodal(self, lens: Array, free: bool) -> Start | None:
        self.progress("does the camera only turn?")
        best: Start | None = None
        rows = np.asarray(self.keys)
        for columns, zoom in self._lenses(free):
            if best is not None and best.doubt < WORSE and richness_of(columns, zoom) > best.richness:
                continue
            done = solve_nodal(
                self.part,
                len(self.keys),
                self.tracks,
                lens,
                self.pixels,
                scale=2.5 * self.noise,
                lens_columns=columns,
                zoom=self._tied(rows, zoom=zoom),
                progress=self.progress,
            )
            if done is None:
                continue
            doubt = self._doubt(done.state, self.part)
            if best is None or doubt < best.doubt * (GAIN if richness_of(columns, zoom) > best.richness else 1.0):
                cameras = Cameras(done.state, np.ones(len(self.keys), bool), np.ones(self.tracks, bool))
                best = Start(doubt, "nodal", cameras, columns, zoom, ())
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

    def _changed(self, state: State, start: Start) -> tuple[str, ...]:
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

    def _free(self, lens: Array, free: bool) -> Start | None:
        self.progress("looking for the first pair of frames")
        table = rays(self.part, lens, len(self.keys), self.tracks)
        noise = self.pixels / float(np.exp(lens[FOCAL]))
        grower = Grower(self.part, lens, table, noise, self.noise, self.progress)
        pairs = best_pairs(table, noise, self.progress)
        best: Start | None = None
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

    def _richer(self, grower: Grower, cameras: Cameras, free: bool) -> Start:
        """The lens with no more parameters than the tracks ask for."""
        best: Start | None = None
        for columns, zoom in self._lenses(free):
            if best is not None and best.doubt < WORSE and richness_of(columns, zoom) > best.richness:
                continue
            tied = self._tied(np.asarray(self.keys)[cameras.known], zoom=zoom)
            other = grower.adjusted(cameras, columns, tied) if columns or tied is not None else cameras
            doubt = self._key_doubt(other)
            if other is not cameras and doubt > ACCEPT:  # what did not fit at the beginning counts less now
                other = grower.adjusted(other, columns, tied)
                doubt = self._key_doubt(other)
            if best is None or doubt < best.doubt * (GAIN if richness_of(columns, zoom) > best.richness else 1.0):
                best = Start(doubt, "free", other, columns, zoom, ())
        assert best is not None
        return best

    # -- all frames ---------------------------------------------------------------------------------------

    def finish(self, start: Start) -> Solution:
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
        held_zoom = zoom
        if start.zoom and zoom is not None and not self.views.alone.any():
            held_zoom = zoom + self.level * (np.arange(count) == 0) * np.eye(count)
        columns = (TURN if nodal else POSE) + ((FRAME_FOCAL,) if zoom is not None else ())
        lens = start.lens_columns
        if self.options.distortion:
            lens = tuple(sorted({*lens, *model_named(self.options.lens).found}))
        free = Free(frame=columns, lens=lens, zoom=held_zoom)
        least = 1e-6 if nodal else 1e-12
        used = known[observations.frame] & held[observations.track]
        self.progress("adjusting all frames together")
        spread = max(self.least, self._spread(state, observations, used))
        state = adjust(
            state,
            observations.take(used),
            free,
            scale=2.5 * spread,
            tolerance=1e-6 if start.zoom else 1e-4,
            least_damping=least,
            iterations=ZOOM_STEPS if start.zoom else 20,
            settled=SETTLED if start.zoom else MOST_DAMPING,
            progress=self.progress,
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
            chi = (
                np.bincount(observations.track[used], weights=np.minimum(error[used], 50.0) ** 2, minlength=self.tracks)
                / dof
            )
            held = held & (chi < 1.5 + 5.0 * np.sqrt(2.0 / dof)) & ~sliders
            used = known[observations.frame] & held[observations.track] & (error < OUTLIER)
            seen = np.bincount(observations.track[used], minlength=self.tracks)
            held = held & (seen >= 2)
            used &= held[observations.track]
            state = adjust(
                state,
                observations.take(used),
                free,
                tolerance=1e-8 if start.zoom else 1e-6,
                least_damping=least,
                iterations=ZOOM_STEPS if start.zoom else 30,
                settled=SETTLED if start.zoom else MOST_DAMPING,
                progress=self.progress,
            ).state
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
            state,
            self.frames,
            known,
            held,
            used,
            observations,
            start.kind,
            self.noise,
            sigma,
            tuple(self.keys),
            self.size,
            free._replace(zoom=zoom),
            (*self._changed(state, start), *start.said),
            self.pixel,
            self.views,
            self.noise_told,
        )

    def _spread(self, state: State, observations: Observations, used: Flags) -> float:
        return float(np.median(np.linalg.norm(residuals(state, observations.take(used)), axis=1))) / MEDIAN

    def _between(self, start: Start, nodal: bool) -> tuple[State, Flags, Flags]:
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
            state = adjust(
                state, rows, Free(frame=columns, points=False), scale=scale, tolerance=1e-3, progress=self.progress,
            ).state
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
            rotation[shot], translation[shot] = (
                turn,
                -np.einsum("fij,fj->fi", np.broadcast_to(turn, (len(shot), 3, 3)), centre),
            )
            zoom[shot] = np.interp(inside, at, zoom[at])
            reach[shot] = True
        return State(rotation, translation, cameras.state.points, zoom, cameras.state.lens), reach


def _nowhere(lens: Array) -> State:
    return State(np.zeros((0, 3, 3)), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), lens)
