"""A lens from photographs of a chessboard: its inner corners, then all photographs adjusted together.

(Zhang, "A flexible new technique for camera calibration", 2000: poses of a known plane, here with every model of
`core/match/lens.py`.)
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.match.lens import model_named, start_lens, straightened
from core.match.solve.bundle import POSE, Free, Normal, adjust, normal_equations
from core.match.solve.state import ASPECT, CENTRE_X, CENTRE_Y, FOCAL, Array, Observations, State, residuals

LEAST = 3  # photographs
ROBUST = 2.5
FOCALS = (0.45, 0.7, 1.0, 1.6)  # of the width of a picture
WINDOW = 5  # half of the window in which a corner is made exact


class Calibrated(NamedTuple):
    """lens (L,) of `core/match/lens.py`. errors (K,) : RMS pixels of each photograph. rms : pixels, of all corners.

    focal_sigma, centre_sigma : standard deviations in pixels.
    """

    lens: Array
    errors: Array
    rms: float
    focal_sigma: float
    centre_sigma: float


def chessboard_corners(picture: NDArray[np.uint8], grid: tuple[int, int]) -> Array | None:
    """Inner corners (n, 2) of a board of `grid` of them across and down, row by row; None where it is not seen whole.

    picture : (H, W) grey.
    """
    found, corners = cv2.findChessboardCorners(picture, grid, flags=cv2.CALIB_CB_ADAPTIVE_THRESH)
    if not found:
        return None
    stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 40, 1e-4)
    exact = cv2.cornerSubPix(picture, corners, (WINDOW, WINDOW), (-1, -1), stop)
    return np.asarray(exact.reshape(-1, 2), np.float64)


def calibrate(
    corners: Sequence[Array], grid: tuple[int, int], size: tuple[int, int], model: str = "brown"
) -> Calibrated:
    """The lens that took photographs of `size` pixels in which the corners of a board were seen, (n, 2) each.

    Raises
    ------
    UserError
        There are fewer than three photographs, or they do not tell a lens.
    """
    if len(corners) < LEAST:
        raise UserError(
            f"The board was found in {len(corners)} photographs; a lens needs {LEAST} at least, better ten, tilted in "
            "different ways and out to the corners of the picture."
        )
    places = np.zeros((grid[0] * grid[1], 3))
    places[:, :2] = np.mgrid[: grid[0], : grid[1]].T.reshape(-1, 2)
    count = len(places)
    observations = Observations(
        np.repeat(np.arange(len(corners)), count).astype(np.int32),
        np.tile(np.arange(count), len(corners)).astype(np.int32), np.ascontiguousarray(np.concatenate(corners)),
        np.tile([1.0, 0.0, 1.0], (count * len(corners), 1)),
    )
    kind = model_named(model)
    shape = (ASPECT,) if model == "anamorphic4" else ()
    best: tuple[float, State] | None = None
    for share in FOCALS:
        state = _begun(observations, places, start_lens(share * max(size), *size, model), len(corners))
        if state is None:
            continue
        for columns in ((FOCAL,), (FOCAL, *kind.first)):
            free = Free(lens=tuple(sorted({*columns, *shape})), points=False)
            state = adjust(state, observations, free, scale=ROBUST * _spread(state, observations), iterations=60).state
        spread = _spread(state, observations)
        if best is None or spread < best[0]:
            best = spread, state
    if best is None:
        raise UserError("The corners are not those of one flat board; look at the number of corners across and down.")
    columns = tuple(sorted({FOCAL, CENTRE_X, CENTRE_Y, *kind.found, *shape}))
    state, free = best[1], Free(lens=columns, points=False)
    for scale in (ROBUST * best[0], 0.0):
        state = adjust(state, observations, free, scale=scale, iterations=100, tolerance=1e-9).state
    error = np.linalg.norm(residuals(state, observations), axis=1)
    each = np.sqrt((error.reshape(len(corners), count) ** 2).mean(axis=1))
    rms = float(np.sqrt((error**2).mean()))
    if not np.isfinite(rms) or rms > 0.01 * max(size):
        raise UserError("No lens explains these corners; look at the number of corners across and down.")
    freedom = max(1, 2 * len(error) - 6 * len(corners) - len(columns))
    covariance = _of_lens(normal_equations(state, observations, 0.0, free), columns) * float((error**2).sum()) / freedom
    sigma = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    at = {column: k for k, column in enumerate(columns)}
    return Calibrated(
        state.lens, each, rms, float(sigma[at[FOCAL]] * np.exp(state.lens[FOCAL])),
        float(np.hypot(sigma[at[CENTRE_X]], sigma[at[CENTRE_Y]])),
    )


def _begun(observations: Observations, places: Array, lens: Array, photographs: int) -> State | None:
    """Poses of the board as the lens would have seen it."""
    turns, shifts = np.tile(np.eye(3), (photographs, 1, 1)), np.zeros((photographs, 3))
    flat = straightened(lens, 0.0, observations.xy).reshape(photographs, -1, 2)
    for k, seen in enumerate(flat):
        if not np.isfinite(seen).all():
            return None
        good, turn, shift = cv2.solvePnP(places, seen, np.eye(3), None, flags=cv2.SOLVEPNP_IPPE)
        if not good or shift[2, 0] <= 0.0:
            return None
        turns[k], shifts[k] = cv2.Rodrigues(turn)[0], shift[:, 0]
    return State(turns, shifts, places.copy(), np.zeros(photographs), lens)


def _spread(state: State, observations: Observations) -> float:
    return max(float(np.median(np.linalg.norm(residuals(state, observations), axis=1))) / 1.1774, 1e-6)


def _of_lens(normal: Normal, columns: tuple[int, ...]) -> Array:
    """Covariance of the lens, poses taken out, in units of the variance."""
    lens, poses = list(columns), list(POSE)
    matrix = normal.lens[np.ix_(lens, lens)].copy()
    across = normal.frame_lens[:, poses][:, :, lens]
    matrix -= np.einsum("fil,fij,fjm->lm", across, np.linalg.pinv(normal.frames[:, poses][:, :, poses]), across)
    return np.asarray(np.linalg.pinv(matrix, hermitian=True))
