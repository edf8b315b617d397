"""What a solve says of itself: how good it is, what it could not have known, and what to mend next."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from core.errors import UserError
from core.match.solve.certainty import Certainty, Fix, Test
from core.match.solve.motions import told_of_motions
from core.match.solve.nodal import BY_CHANCE, parallax
from core.match.solve.solution import Solution
from core.match.solve.state import FOCAL, FRAME_FOCAL, K1, LENS_NAMES, Array, Rows, residuals

GAIN = 14.0  # of the squares over the variance: a fixed parameter is wrong; one in a thousand solves by chance
NOISE, TOO_NOISY = 1.3, 3.0  # residuals over the noise of the tracks: said; refused
FOCAL_SIGMA = 0.03
PATH, NO_PATH = 0.03, 0.3  # uncertainty of the path over its size
OUT, TOO_MANY_OUT = 0.4, 0.49  # share of the tracks that do not fit
JOINED = 0.75  # share of the frames that have a camera; fewer are parts that do not hang together
APART, MOVES = 1.5, 2.0  # of the typical error; of the doubt of the path: worth a look
TRANSLATION = "translation"


class Report(NamedTuple):
    """rms_px, median_px, mean_px, p95_px, most_px : lengths of reprojection errors in pixels.

    by_frame (F,), by_track (P,) : RMS in pixels, NaN where nothing was used.
    focal_px : (F,). focal_sigma_px : of the focal length, RMS over the frames where it changes, 0 where it
        was given.
    path_sigma : uncertainty of the path over its size; 0 of a camera that only turns.
    point_sigma : (P, 3, 3) covariance of points in world, NaN where there is none; centre_sigma : (F, 3, 3) of where
        cameras stand. Both as seen from the points as a whole: what moves, turns or scales all of them is no error.
    kind : "free", "planar" or "nodal". tests : of what was held fixed. warnings, advice : for the artist.
    fixes : what leaving out the worst tracks and frames would do, the most helpful first.
    """

    rms_px: float
    median_px: float
    mean_px: float
    p95_px: float
    most_px: float
    by_frame: Array
    by_track: Array
    focal_px: Array
    focal_sigma_px: float
    path_sigma: float
    point_sigma: Array
    centre_sigma: Array
    kind: str
    tests: tuple[Test, ...]
    warnings: tuple[str, ...]
    advice: tuple[str, ...]
    fixes: tuple[Fix, ...]


def report(
    solution: Solution, names: list[str], said: Sequence[str] | None = None,
    progress: Callable[[str], None] = lambda words: None,
) -> Report:
    """Judge a solve; `names` of its tracks, `said` what its frames are called, their numbers otherwise.

    progress : called without words many times; what it raises ends the judging.

    Raises
    ------
    UserError
        The solve cannot be trusted; the message says why.
    """
    state, part = solution.state, solution.observations.take(solution.used)
    said = said or [f"frame {number}" for number in solution.frames]
    whitened = residuals(state, part)
    length = np.linalg.norm(whitened, axis=1) / np.sqrt(part.root[:, 0] * part.root[:, 2])  # pixels again
    length = length * solution.pixel[part.frame]
    by_frame = _rms(part.frame, length, len(solution.frames))
    by_track = _rms(part.track, length, len(solution.held))
    focal = np.exp(state.lens[FOCAL] + state.focal) * solution.pixel
    seen = np.bincount(solution.observations.track, minlength=len(solution.held)) >= 2
    out = 1.0 - float(solution.held[seen].mean()) if seen.any() else 1.0
    noisy = solution.sigma / solution.noise
    if noisy > TOO_NOISY:
        raise UserError(
            f"No camera explains these tracks: they miss it by {noisy:.1f} times their own noise. Look for a second "
            "motion among them, for rolling shutter, or for strong lens distortion."
        )
    if out > TOO_MANY_OUT and not solution.views.alone.any() and solution.known.mean() < JOINED:
        raise UserError(_falls_apart(solution))
    if out > TOO_MANY_OUT:
        raise UserError(
            f"{round(100 * out)} % of the tracks do not fit the camera of the others: there may be two motions. Take "
            "out the tracks of what moves by itself."
        )
    progress("")
    certain = Certainty(solution)
    progress("")
    kind = solution.kind
    if kind == "free" and certain.flat():
        kind = "planar"
    progress("")
    path = certain.path()
    progress("")
    if path > NO_PATH:
        raise UserError(
            "The path cannot be told from these tracks: the camera moves too little against the distance of the "
            "points. Solve it as one that only turns (--nodal), or add tracks that are near."
        )
    tests = certain.tests()
    progress("")
    if kind == "nodal":
        gain = parallax(state, part, solution.sigma)
        tests = (*tests, Test(TRANSLATION, gain if gain > BY_CHANCE else 0.0, 0.0))
    sigma_f = certain.focal_sigma()
    moves = told_of_motions(solution) if path <= PATH else []  # a short path has its own words
    warnings = [*solution.said, *_warnings(solution, noisy, out, path, sigma_f, tests), *moves]
    typical = float(np.median(focal[solution.known & (solution.views.camera == 0)]))
    rms = float(np.sqrt((length**2).mean()))
    fixes = certain.fixes(rms, by_frame, by_track, path, progress)
    fixes = tuple(fix for fix in fixes if fix.rms_px < rms or fix.share > MOVES)
    return Report(
        rms,
        float(np.median(length)),
        float(length.mean()),
        float(np.quantile(length, 0.95)),
        float(length.max()),
        by_frame,
        by_track,
        focal,
        sigma_f * typical,
        path,
        certain.points,
        certain.centres(),
        kind,
        tests,
        tuple(warnings),
        _advice(solution, names, said, rms, by_frame, by_track, fixes),
        fixes,
    )


def _falls_apart(solution: Solution) -> str:
    """Why the frames of a shot could not be joined: where the fewest tracks go on from one to the next."""
    seen = np.zeros((len(solution.frames), len(solution.held)), bool)
    seen[solution.observations.frame, solution.observations.track] = True
    common = (seen[1:] & seen[:-1]).sum(axis=1)
    at = int(np.argmin(common))
    return (
        f"Only {int(solution.known.sum())} of {len(solution.frames)} frames could be joined: from frame "
        f"{solution.frames[at]} to {solution.frames[at + 1]} only {common[at]} tracks go on. Track more points through "
        "the whole shot, eight at least from each frame to the next."
    )


def _rms(rows: Rows, length: Array, count: int) -> Array:
    seen = np.bincount(rows, minlength=count)
    total = np.bincount(rows, weights=length**2, minlength=count)
    return np.asarray(np.where(seen > 0, np.sqrt(total / np.maximum(seen, 1)), np.nan))


def _warnings(
    solution: Solution, noisy: float, out: float, path: float, sigma_f: float, tests: tuple[Test, ...]
) -> list[str]:
    said = []
    focal = float(np.exp(solution.state.lens[FOCAL]))
    if noisy > NOISE:
        said.append(f"The tracks miss the camera by {noisy:.2f} times their own noise: something is not in the model.")
    if not solution.noise_told and not solution.views.alone.all():
        said.append(
            "Fewer than ten tracks are seen together: that they fit says little, a wrong one among them may bend the "
            "path unseen. Add tracks."
        )
    if out > OUT:
        said.append(f"{round(100 * out)} % of the tracks do not fit and were left out; do they move by themselves?")
    if path > PATH:
        said.append(f"The path is known to {100 * path:.1f} % of its size only; tracks that are nearer would help.")
    if sigma_f > FOCAL_SIGMA:
        said.append(
            f"The focal lengths are known to {100 * sigma_f:.1f} % only, by one factor on all frames: tracks that are "
            "nearer and farther would tell it."
            if FRAME_FOCAL in solution.free.frame
            else f"The focal length is known to {100 * sigma_f:.1f} % only; give it if you know it."
        )
    if any(test.name == TRANSLATION and test.gain for test in tests):
        bends = next((test for test in tests if test.name == LENS_NAMES[K1] and test.gain > GAIN), None)
        said.append(
            "The camera moves a little, as the parallax of the tracks shows: solved as one that only turns, its "
            "rotations are off by that. Add tracks that are near, so that the path can be told."
            + (f" A lens that bends looks alike, k1 about {bends.better:+.4f}; solve with a lens." if bends else "")
        )
        tests = ()  # what the lens seems to do is what that movement does
    strong = [test for test in tests if test.gain > GAIN]
    for test in sorted(strong, key=lambda one: -one.gain)[:2]:
        value = {
            "focal length": f"{test.better:.1f} px would fit better than {focal:.1f}; check it, or let it be found",
            "zoom": "the focal length seems to change over the shot; solve it with a zoom",
            "distortion k1": f"the lens seems to bend lines, k1 about {test.better:+.4f}; solve with a lens",
            "pixel aspect": f"pixels seem {test.better:.4f} times as high as wide; check the pixel aspect",
        }.get(test.name, f"about {test.better:.1f} px would fit better; check whether the plate was cropped")
        said.append(f"{test.name[0].upper()}{test.name[1:]}: {value}.")
    missing = ~solution.known
    if (missing & ~solution.views.alone).any():
        said.append(
            f"{int((missing & ~solution.views.alone).sum())} frames have no camera: too few tracks are seen there."
        )
    if (missing & solution.views.alone).any():
        said.append(
            f"{int((missing & solution.views.alone).sum())} pictures of other cameras have no place: too little of the "
            "plate is seen there."
        )
    return said


def _advice(
    solution: Solution,
    names: list[str],
    said_of: Sequence[str],
    rms: float,
    by_frame: Array,
    by_track: Array,
    fixes: tuple[Fix, ...],
) -> tuple[str, ...]:
    """What to mend next, worst first."""
    said = []
    seen = np.bincount(solution.observations.track, minlength=len(names))
    lost = [names[k] for k in np.flatnonzero(~solution.held & (seen >= 2))]
    if lost:
        more = " ..." if len(lost) > 8 else ""
        said.append(f"Look at the tracks that do not fit: {', '.join(lost[:8])}{more}.")
    for fix in helpful(fixes, by_frame, by_track):
        name = f"track {names[fix.row]}" if fix.kind == "track" else said_of[fix.row]
        own = (by_track if fix.kind == "track" else by_frame)[fix.row]
        moves = f" and the path moves by {fix.share:.1f} times its doubt" if fix.share > 1.0 else ""
        said.append(
            f"Mend or leave out {name}, which misses by {own:.2f} px: the rest goes from {rms:.3f} to "
            f"{fix.rms_px:.3f} px{moves}."
        )
    counts = np.bincount(solution.observations.frame[solution.used], minlength=len(solution.frames))
    thin = np.flatnonzero((counts < 8) & ~solution.views.alone)
    if len(thin):
        said.append(f"Add tracks from {said_of[thin[0]]} to {said_of[thin[-1]]}: some have fewer than 8.")
    return tuple(said)


def helpful(fixes: tuple[Fix, ...], by_frame: Array, by_track: Array) -> list[Fix]:
    """At most five of the fixes that are worth a look: what misses by half more than its like, or moves the path."""
    typical = {"track": float(np.nanmedian(by_track)), "frame": float(np.nanmedian(by_frame))}
    error = {"track": by_track, "frame": by_frame}
    return [fix for fix in fixes if error[fix.kind][fix.row] > APART * typical[fix.kind] or fix.share > MOVES][:5]
