"""Runs: patterns that are followed from their keys through a plate, all of a frame at once.

A run is one key of one track followed in one direction. Every frame it is foretold (constant motion), fitted against
its key's template, and judged; what fails is tried again with robust weights, then looked for around the place its
neighbours foretell; when most fail at once, where sparse matches of the two frames say. A pattern out of sight is
foretold on for some frames and taken back only on a strict likeness.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from core.match.blur import blurred, motion_lines
from core.match.fit_kernel import FOUND, fit_patterns
from core.match.guide import carried_by, guide_between
from core.match.outline import filled
from core.match.template import Templates, cut_templates
from core.match.track import MODELS, TrackSettings

Image = NDArray[np.float32]
Reals = NDArray[np.float64]
Rows = NDArray[np.int64]
Mask = NDArray[np.bool_]
Ranges = Callable[[int, Callable[[int, int], object], int], None]
Shape = tuple[Reals, bool] | None  # outline (P, 2) around the middle of a pattern, and whether it is a curve
COLUMN = {name: k for k, name in enumerate(FOUND)}
NO_HOLD = np.zeros((0, 0), np.bool_)
ROBUST_ABOVE = 1.8  # times the variance a run is used to
LOOSE, STRICT = 6.0, 2.5  # the same, still believed: where it was foretold, and anywhere else
ALIKE = 0.95  # score of a new pattern that is believed whatever its residuals are
RETURN = 0.25  # pixels a pattern found after a jump may miss the place it came from
SPOILT = 4.0  # times the noise of the key: more than that is not usual
LED = 3.0  # pixels off the place its neighbours tell, for every frame out of sight
SURPRISE = 2.0  # pixels off the place foretold
UNSURE = 1.0  # pixels, standard deviation
FAINT = 0.2  # of what a pattern seems to tell of its place, that which is not from noise: with less it is not followed
LEAST = 1e-3  # the same, where it divides
NEIGHBOURS = 5
PEAKS = 3  # of the correlation that are tried
NEARER = 0.1  # correlation that the edge of the search is worth less than its middle
WHITE, CLUMPED = 0.07, 6.0  # lag correlation of good residuals; how much variance of the place more of it adds
SLOWLY = 0.1  # from frame to frame, what is not to hang on single ones
FADE = 0.8  # of the motion from frame to frame while out of sight
EARNED = 30.0  # twice the logarithm of the likelihood that two more numbers must bring
GRAIN = 4


class Seen(NamedTuple):
    """What one frame gave. Rows are runs. covariance and own as in ``Track``."""

    rows: Rows
    points: Reals
    covariance: Reals
    own: Reals
    score: Reals


class Runs:
    """The state of all runs of one sweep. Arrays have a row for each run."""

    def __init__(self, settings: TrackSettings, channels: int, ranges: Ranges) -> None:
        self.settings, self.ranges, self.channels = settings, ranges, channels
        side = 2 * (settings.pattern // 2 + 10) + 1
        self.templates = Templates(
            np.zeros((0, side, side, channels), np.float32),
            np.zeros((0, side, side), np.bool_),
            np.zeros((0, 2)),
            np.zeros((0, 2)),
            *(np.zeros(0) for _ in range(4)),
        )
        self.coefficients = self.templates.coefficients  # blurred like the frame at hand
        self.warp, self.motion = np.zeros((0, 8)), np.zeros((0, 8))
        self.light = np.zeros((0, channels, 2))
        self.shared = np.zeros((0, 3))  # covariance of the template's own place, in its pixels
        self.key_motion = np.zeros((0, 2))  # template pixels in a frame, at the key
        self.known = np.zeros(0)  # of what the pattern seems to tell of its place, that which is not from noise
        self.usual, self.likeness, self.lag = np.zeros(0), np.zeros(0), np.zeros(0)  # of the frames before
        self.age, self.missed = np.zeros(0, np.int64), np.zeros(0, np.int64)
        self.size, self.stop = np.zeros(0, np.int64), np.zeros(0, np.int64)
        self.alive, self.guided, self.led = np.zeros(0, np.bool_), np.zeros(0, np.bool_), np.zeros(0, np.bool_)
        self._hold = NO_HOLD
        self._before: Image | None = None  # the frame before, where the runs were

    @property
    def half(self) -> float:
        return self.settings.pattern / 2.0

    def begin(
        self,
        image: Image,
        points: Reals,
        stop: Rows,
        hold: Mask | None = None,
        offsets: Reals | None = None,
        shapes: Sequence[Shape] = (),
    ) -> Rows:
        """Begin runs at `points` (N, 2) of a frame, to be followed to the frames `stop`; returns their rows.

        offsets : (N, 2) to the middles of the patterns. shapes : an outline around the middle, or None, for each.
        """
        made = cut_templates(image, points, self.settings.pattern, hold, offsets)
        for n, shape in enumerate(shapes):
            if shape is not None:
                outline, smooth = shape
                made.keep[n] &= filled(outline + made.centre[n] + made.middle[n], smooth, *made.keep.shape[1:])
        self._hold = NO_HOLD if hold is None else np.ascontiguousarray(hold)
        first, count = len(self.alive), len(points)
        rows = np.arange(first, first + count)
        self.templates = self.templates.with_more(made)
        self.coefficients = self.templates.coefficients
        warp = np.zeros((count, 8))
        warp[:, :2] = points
        warp[:, [2, 5]] = 1.0
        light = np.zeros((count, self.channels, 2))
        light[:, :, 0] = 1.0
        size = MODELS["affine" if self.settings.model == "auto" else self.settings.model]
        fresh: dict[str, NDArray[Any]] = {
            "warp": warp, "motion": np.zeros((count, 8)), "light": light, "shared": np.zeros((count, 3)),
            "key_motion": np.zeros((count, 2)), "usual": made.noise, "likeness": np.ones(count),
            "lag": np.full(count, WHITE), "known": np.ones(count),
            "age": np.zeros(count, np.int64), "missed": np.zeros(count, np.int64),
            "size": np.full(count, size, np.int64), "stop": stop, "alive": np.ones(count, np.bool_),
            "guided": np.zeros(count, np.bool_), "led": np.zeros(count, np.bool_),
        }  # fmt: skip
        for name, value in fresh.items():
            setattr(self, name, np.concatenate((getattr(self, name), value)))
        warp, light = self.warp.copy(), self.light.copy()
        found = self._fit(image, rows, warp, light, np.zeros(len(self.alive)), at_key=True)
        self.shared[rows] = found[rows, :3] * made.noise[:, None]
        self.alive[rows] = found[rows, COLUMN["pixels"]] > 0
        self._before = image
        return rows

    def step(self, image: Image, hold: Mask | None = None) -> Seen:
        """Follow every living run into the next frame of the sweep; `hold` (H, W) is True where they must not look."""
        self._hold = NO_HOLD if hold is None else np.ascontiguousarray(hold)
        rows = np.flatnonzero(self.alive)
        told = self._foretell(rows)
        warp, light = told.copy(), self.light.copy()
        self._blur(rows, told)
        self.led[:] = False
        fresh = rows[self.age[rows] == 0]
        self._look(image, fresh, warp)
        found = self._fit(image, rows, warp, light, np.zeros(len(self.alive)))
        good = self._judge(rows, found, warp, told)
        doubt = ~good | (found[rows, COLUMN["variance"]] > ROBUST_ABOVE * self.usual[rows])
        if doubt.any():
            sure, doubtful = rows[~doubt], rows[doubt]
            self._lead(doubtful[self.missed[doubtful] > 0], sure, told, warp)
            self._again(image, doubtful, told, told, warp, light, found)
            lost = ~self._judge(doubtful, found, warp, told)
            # a fit that is believed and still poor may sit beside the true place
            poor = found[doubtful, COLUMN["variance"]] > ROBUST_ABOVE * self.usual[doubtful]
            unsure = doubtful[lost | poor | (self.age[doubtful] == 0)]
            for place in self._places(image, unsure, sure, told, warp):
                self._again(image, unsure, place, told, warp, light, found)
            good = self._judge(rows, found, warp, told)
            here = (self.missed[rows] == 0) & _inside(told[rows], image)
            if 2 * (here & ~good).sum() >= here.sum() > 0:
                self._far(image, rows[here], told, warp, light, found)
                good = self._judge(rows, found, warp, told)
        self._before = image
        self._richer(image, rows[good], warp, light, found)
        return self._settle(rows, good, told, warp, light, found)

    def miss(self) -> None:
        """A frame that could not be read: every living run is foretold through it."""
        rows = np.flatnonzero(self.alive)
        nothing = np.zeros((len(self.alive), len(FOUND)))
        self._settle(rows, np.zeros(len(rows), np.bool_), self._foretell(rows), self.warp, self.light, nothing)

    def _foretell(self, rows: Rows) -> Reals:
        told = self.warp.copy()
        told[rows, :2] += self.motion[rows, :2]
        told[rows, 2:6] += 0.5 * self.motion[rows, 2:6]
        return told

    def _fit(
        self,
        image: Image,
        rows: Rows,
        warp: Reals,
        light: Reals,
        scale: Reals,
        at_key: bool = False,
    ) -> Reals:
        cut = self.templates
        noise = np.stack((cut.noise, np.zeros_like(cut.grain) if at_key else cut.grain, cut.rough), axis=1)
        found = np.zeros((len(self.alive), len(FOUND)))
        rows = np.ascontiguousarray(rows)

        def call(start: int, stop: int) -> None:
            fit_patterns(
                image,
                self._hold,
                self.coefficients,
                self.templates.keep,
                self.templates.centre,
                self.templates.middle,
                warp,
                light,
                scale,
                noise,
                self.half,
                self.size,
                rows,
                start,
                stop,
                found,
            )

        self.ranges(len(rows), call, GRAIN)
        return found

    def _judge(
        self,
        rows: Rows,
        found: Reals,
        warp: Reals,
        told: Reals,
    ) -> Mask:
        """Which of the rows are believed."""
        f = found[rows]
        variance, score, usual = f[:, COLUMN["variance"]], f[:, COLUMN["score"]], self.usual[rows]
        own = variance * (f[:, 0] + f[:, 2])
        known = f[:, COLUMN["known"]]
        shared = carried(warp[rows], self.shared[rows])[:, [0, 2]].sum(axis=1) / np.maximum(known, LEAST)
        spread = np.sqrt(np.maximum(own + shared, 0.0))
        area = warp[rows, 2] * warp[rows, 5] - warp[rows, 3] * warp[rows, 4]
        before = told[rows, 2] * told[rows, 5] - told[rows, 3] * told[rows, 4]
        ratio = area / np.where(before == 0.0, 1.0, before)
        off = np.linalg.norm(warp[rows, :2] - told[rows, :2], axis=1)
        missed = self.missed[rows]
        fresh, guided = (self.age[rows] == 0) & (missed == 0), self.guided[rows]
        calm = (off < SURPRISE) & (missed == 0) & ~guided
        like = score > np.where(fresh, 0.8, self.likeness[rows] - 0.1)
        near = variance < LOOSE * usual
        alike = np.where(guided, ALIKE - 0.2, ALIKE)  # the matches are witnesses too
        # what came to be usual while something passed before it is no measure for taking it back
        clean = np.minimum(usual, SPOILT * self.templates.noise[rows])
        anywhere = (variance < np.where(fresh, LOOSE, STRICT) * clean) | ((fresh | guided) & (score > alike))
        good = (f[:, COLUMN["iterations"]] > 0) & (f[:, COLUMN["step"]] < 0.1) & (f[:, COLUMN["share"]] > 0.4)
        good &= (score >= self.settings.least_score) & (spread < UNSURE) & (f[:, COLUMN["gain"]] > 0.05)
        good &= off < np.where(self.led[rows], LED * (1.0 + missed), 1.5 * self.settings.search + 1.0)
        room = 1.4 * (1.0 + 0.1 * missed)
        good &= (ratio > 1.0 / room) & (ratio < room)
        good &= (known > 0.0) & (np.where(fresh, known, self.known[rows]) > FAINT)
        return good & np.where(calm, near, anywhere & like)

    def _again(
        self,
        image: Image,
        rows: Rows,
        place: Reals,
        told: Reals,
        warp: Reals,
        light: Reals,
        found: Reals,
        *,
        robust: bool = True,
    ) -> None:
        """Fit rows again from `place` (N, 8); keep what is believed and fits better."""
        tried, lit = place.copy(), self.light.copy()
        again = self._fit(image, rows, tried, lit, (STRICT if robust else 0.0) * self.usual)
        before = self._judge(rows, found, warp, told)
        lower = again[rows, COLUMN["variance"]] < found[rows, COLUMN["variance"]]
        better = rows[self._judge(rows, again, tried, told) & (lower | ~before)]
        warp[better], light[better], found[better] = tried[better], lit[better], again[better]

    def _far(self, image: Image, rows: Rows, told: Reals, warp: Reals, light: Reals, found: Reals) -> None:
        """The camera jumped: fit rows where sparse matches with the frame before say they went.

        `told` becomes that. What was found elsewhere only looked alike and is forgotten; so is all that is new and
        that the matches say nothing of.
        """
        guide = guide_between(self._before, image) if self._before is not None else None
        if guide is None:
            return
        places, linear = carried_by(guide, self.warp[rows, :2])
        known = np.isfinite(places[:, 0])
        found[rows[~known & (self.age[rows] == 0)]] = 0.0
        rows, places, linear = rows[known], places[known], linear[known]
        off = np.linalg.norm(warp[rows, :2] - places, axis=1) > self.settings.search
        off |= found[rows, COLUMN["done"]] == 0
        rows, places, linear = rows[off], places[off], linear[off]
        found[rows] = 0.0
        told[rows, :2] = places
        told[rows, 2:6] = (self.warp[rows, 2:6].reshape(-1, 2, 2) @ np.linalg.inv(linear)).reshape(-1, 4)
        self.guided[rows] = True
        for rank in range(PEAKS):
            place = told.copy()
            self._look(image, rows, place, rank)
            # another view has other light, and residuals beside which the noise of the key is nothing
            self._again(image, rows, place, told, warp, light, found, robust=False)
        found[rows[~self._returns(image, rows, warp)]] = 0.0

    def _returns(self, image: Image, rows: Rows, warp: Reals) -> Mask:
        """Which rows come back: the pattern cut anew where it was found lies where it was in the frame before."""
        if self._before is None or not len(rows):
            return np.zeros(len(rows), np.bool_)
        old, now = self.warp[rows], warp[rows]
        middle = self.templates.middle[rows][:, :, None]
        start = old[:, :2] + np.linalg.solve(old[:, 2:6].reshape(-1, 2, 2), middle)[:, :, 0]
        inside = now[:, :2] + np.linalg.solve(now[:, 2:6].reshape(-1, 2, 2), middle)[:, :, 0]
        inside = np.clip(inside, 0.0, np.array(image.shape[1::-1]) - 1.0)
        cut = cut_templates(image, inside, self.settings.pattern)
        back = np.zeros((len(rows), 8))
        back[:, :2] = start
        between = np.linalg.inv(now[:, 2:6].reshape(-1, 2, 2)) @ old[:, 2:6].reshape(-1, 2, 2)
        back[:, 2:6] = between.reshape(-1, 4)
        light = np.zeros((len(rows), self.channels, 2))
        light[:, :, 0] = 1.0
        sizes = np.full(len(rows), MODELS["affine"], np.int64)
        found = np.zeros((len(rows), len(FOUND)))
        every = np.arange(len(rows))
        fit_patterns(
            self._before, NO_HOLD, cut.coefficients, cut.keep, cut.centre, cut.middle, back, light, np.zeros(len(rows)),
            np.stack((cut.noise, cut.grain, cut.rough), axis=1),
            self.half, sizes, every, 0, len(rows), found,
        )  # fmt: skip
        off = np.linalg.norm(back[:, :2] - start, axis=1)
        return np.asarray((off < RETURN) & (found[:, COLUMN["step"]] < 0.1) & (found[:, COLUMN["iterations"]] > 0))

    def _lead(self, rows: Rows, sure: Rows, told: Reals, warp: Reals) -> None:
        """Foretell rows that are out of sight by what their neighbours did, where there are enough of them."""
        if len(sure) < NEIGHBOURS:
            return
        error = warp[sure, :2] - told[sure, :2]
        for n in rows:
            distance = np.linalg.norm(told[sure, :2] - told[n, :2], axis=1)
            told[n, :2] += np.median(error[np.argsort(distance)[:NEIGHBOURS]], axis=0)
            self.led[n] = True

    def _places(self, image: Image, rows: Rows, sure: Rows, told: Reals, warp: Reals) -> list[Reals]:
        """Where else rows may be: the likeliest peaks around the places that what their neighbours did foretells."""
        start = told.copy()
        if len(sure):
            error = warp[sure, :2] - told[sure, :2]
            for n in rows:
                distance = np.linalg.norm(told[sure, :2] - told[n, :2], axis=1)
                start[n, :2] += np.median(error[np.argsort(distance)[:NEIGHBOURS]], axis=0)
        places = [start]
        for rank in range(PEAKS):
            place = start.copy()
            self._look(image, rows, place, rank)
            places.append(place)
        return places

    def _look(self, image: Image, rows: Rows, warp: Reals, rank: int = 0) -> None:
        """Move warps to the peak number `rank` of the normalised correlation of the warped template nearby."""
        side, search = self.settings.pattern, self.settings.search
        middle = side // 2
        height, width = image.shape[:2]
        for n in rows:
            if not (np.abs(warp[n, :2]) < 1e6).all():
                continue
            shift = np.linalg.solve(warp[n, 2:6].reshape(2, 2), self.templates.middle[n])
            where = warp[n, :2] + shift
            x, y = np.floor(where + 0.5).astype(int)
            x0, x1 = max(x - search - middle, 0), min(x + search + middle + 1, width)
            y0, y1 = max(y - search - middle, 0), min(y + search + middle + 1, height)
            if x1 - x0 < side or y1 - y0 < side:
                continue
            inside = self.templates.centre[n] + self.templates.middle[n]
            patch = _sample(self.coefficients[n], inside, warp[n], middle)
            likeness = cv2.matchTemplate(image[y0:y1, x0:x1], patch, cv2.TM_CCOEFF_NORMED)
            ys, xs = np.mgrid[0 : likeness.shape[0], 0 : likeness.shape[1]]
            away = (xs + x0 + middle - where[0]) ** 2 + (ys + y0 + middle - where[1]) ** 2
            likeness = np.nan_to_num(likeness, nan=-1.0) - NEARER * away.astype(np.float32) / search**2
            peaks = np.flatnonzero(likeness == cv2.dilate(likeness, np.ones((3, 3), np.uint8)))
            best = peaks[np.argsort(-likeness.ravel()[peaks])[:PEAKS]]
            py, px = divmod(int(best[min(rank, len(best) - 1)]), likeness.shape[1])
            warp[n, :2] = np.array([px + x0 + middle, py + y0 + middle]) - shift

    def _richer(
        self,
        image: Image,
        rows: Rows,
        warp: Reals,
        light: Reals,
        found: Reals,
    ) -> None:
        """Let a run lean in perspective when the residual pays for two more numbers."""
        if self.settings.model != "auto":
            return
        poor = found[rows, COLUMN["variance"]] > 1.3 * self.templates.noise[rows]
        due = rows[(self.age[rows] % 10 == 9) & (self.size[rows] == 6) & poor]
        if not len(due):
            return
        tried, lit = warp.copy(), light.copy()
        self.size[due] = 8
        again = self._fit(image, due, tried, lit, np.zeros(len(self.alive)))
        fall = np.log(np.maximum(found[due, 3], 1e-30) / np.maximum(again[due, 3], 1e-30))
        # neighbouring residuals that are alike count for less than their number
        witnesses = found[due, COLUMN["pixels"]] * self.channels / clumped(self.lag[due])
        earned = (again[due, COLUMN["done"]] > 0) & (fall * witnesses > EARNED)
        self.size[due[~earned]] = 6

    def _blur(self, rows: Rows, told: Reals) -> None:
        if not self.settings.blur:
            return
        now = motion_lines(told[rows], self.motion[rows, :2] * self.settings.shutter)
        young = self.age[rows] == 1
        self.key_motion[rows[young]] = now[young]
        self.coefficients = blurred(self.templates, rows, now, self.key_motion[rows])

    def _settle(
        self,
        rows: Rows,
        good: Mask,
        told: Reals,
        warp: Reals,
        light: Reals,
        found: Reals,
    ) -> Seen:
        kept, lost = rows[good], rows[~good]
        known = found[rows, COLUMN["known"]]
        self.known[rows] += SLOWLY * (known - self.known[rows])
        moved = warp[kept] - self.warp[kept]
        gap = (self.missed[kept] + 1.0)[:, None]
        self.motion[kept] = moved / gap
        self.warp[kept], self.light[kept] = warp[kept], light[kept]
        variance = found[kept, COLUMN["variance"]]
        young = self.age[kept] < 3
        share = np.where(young, 0.5, 0.1)
        self.usual[kept] += share * (np.minimum(variance, 3.0 * self.usual[kept]) - self.usual[kept])
        score = found[kept, COLUMN["score"]]
        self.likeness[kept] += np.where(self.age[kept] == 0, 1.0, 0.2) * (score - self.likeness[kept])
        self.motion[kept[self.guided[kept]]] = 0.0  # a jump is not what follows
        self.guided[:] = False
        self.age[kept] += 1
        self.missed[kept] = 0
        self.warp[lost, :2] = told[lost, :2]
        self.motion[lost] *= FADE
        self.motion[lost, 2:] = 0.0
        self.missed[lost] += 1
        self.alive[lost[(self.missed[lost] > self.settings.patience) | (self.age[lost] == 0)]] = False
        # residuals of a model that does not quite hold are correlated, and say less than their number
        self.lag[kept] += np.where(young, 0.5, 0.2) * (found[kept, COLUMN["lag"]] - self.lag[kept])
        # the noise that is left in a template is in what the track shares, not in the frame
        grain = np.minimum(self.templates.grain[kept] * found[kept, COLUMN["gain"]] ** 2, variance)
        left = self.templates.left[kept] * grain
        own = found[kept, :3] * (np.maximum(variance - left, 0.5 * variance) * clumped(self.lag[kept]))[:, None]
        self.known[kept[self.age[kept] == 1]] = known[good][self.age[kept] == 1]
        shared = carried(self.warp[kept], self.shared[kept]) / np.maximum(known[good], LEAST)[:, None]
        return Seen(kept, self.warp[kept, :2].copy(), own + shared, own, score)


def _inside(warp: Reals, image: Image) -> Mask:
    return np.asarray(((warp[:, :2] >= 0) & (warp[:, :2] <= [image.shape[1] - 1, image.shape[0] - 1])).all(axis=1))


def clumped(lag: Reals) -> Reals:
    """How many residuals with this lag correlation say as much as one that is independent."""
    return np.asarray(1.0 + CLUMPED * np.maximum(lag - WHITE, 0.0))


def carried(warp: Reals, shared: Reals) -> Reals:
    """Covariances (N, 3) in template pixels, carried into the frame by the inverse of the warps (N, 8)."""
    inverse = np.linalg.inv(warp[:, 2:6].reshape(-1, 2, 2))
    full = shared[:, [0, 1, 1, 2]].reshape(-1, 2, 2)
    return (inverse @ full @ inverse.transpose(0, 2, 1)).reshape(-1, 4)[:, [0, 1, 3]]


def _sample(coefficients: Image, centre: Reals, warp: Reals, middle: int) -> Image:
    """The template as it would lie around a whole pixel of the frame: (2 middle + 1, 2 middle + 1, C)."""
    steps = np.arange(-middle, middle + 1, dtype=np.float64)
    x, y = np.meshgrid(steps, steps)
    u = (warp[2] * x + warp[3] * y + centre[0]).astype(np.float32)
    v = (warp[4] * x + warp[5] * y + centre[1]).astype(np.float32)
    pixels = cv2.sepFilter2D(coefficients, -1, THIRD, THIRD)  # splines at whole numbers
    out = cv2.remap(pixels, u, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(out, np.float32).reshape(*out.shape[:2], -1)


THIRD = np.array([1.0, 4.0, 1.0]) / 6.0
