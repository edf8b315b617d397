"""A zoom of a long lens looks nearly like walking ahead: it is followed to its end, not to where steps get small."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.match.solve.bundle import POSE, Free, adjust, smooth_zoom
from core.match.solve.report import report
from core.match.solve.solution import Options
from core.match.solve.solve import solve
from core.match.solve.state import FRAME_FOCAL, Observations, State, start_lens
from tests.core.match.solve.shots import NOISE, SIZE, path_error, turn_error

FRAMES, TRACKS = 60, 60


def _long(seed: int, focal: float) -> tuple[State, Observations]:
    """A camera that passes points 6 to 14 away which fill its narrow view, and zooms by 60 %."""
    rng = np.random.default_rng(seed)
    half = 0.5 * np.array(SIZE) / focal
    depth = rng.uniform(6, 14, TRACKS)
    flat = rng.uniform(-0.95, 0.95, (TRACKS, 2)) * half * [1.15, 1.1]
    points = np.concatenate([flat * depth[:, None], depth[:, None]], axis=1)
    t = np.linspace(0, 1, FRAMES)
    narrow = float(half[0] / 0.6)
    centres = np.stack([1.5 * narrow * (2 * t - 1), 0.3 * np.sin(6 * t + rng.uniform(0, 6)), 0.5 * t], 1)
    angles = np.stack([(-0.15 + 0.3 * t) * narrow, 0.05 * np.sin(4 * t + rng.uniform(0, 6))], 1)
    turn = Rotation.from_euler("yx", angles).as_matrix()
    shift = -np.einsum("fij,fj->fi", turn, centres)
    zoom = np.log(1 + 0.6 * t)
    seen = np.einsum("fij,pj->fpi", turn, points) + shift[:, None]
    xy = (focal * np.exp(zoom))[:, None, None] * seen[..., :2] / seen[..., 2:] + 0.5 * (np.array(SIZE) - 1.0)
    inside = (xy > -0.5).all(-1) & (xy < np.array(SIZE) - 0.5).all(-1)
    frame, track = np.nonzero(inside)
    xy = xy + rng.normal(0, NOISE, xy.shape)
    rows = Observations(
        frame.astype(np.int32),
        track.astype(np.int32),
        np.ascontiguousarray(xy[frame, track]),
        np.tile([1.0, 0.0, 1.0], (len(frame), 1)),
    )
    return State(turn, shift, points, zoom, start_lens(focal, *SIZE)), rows


@pytest.mark.parametrize(("seed", "wide"), [(611, 2.2), (612, 3.0), (613, 3.0)])
def test_a_zoom_of_a_long_lens_is_as_good_as_from_the_truth(seed, wide):
    focal = wide * SIZE[0]
    truth, rows = _long(seed, focal)
    numbers = np.arange(1001, 1001 + FRAMES, dtype=np.int32)
    found = solve(rows, numbers, TRACKS, SIZE, Options(focal, zoom=True))
    told = report(found, [str(k) for k in range(TRACKS)])
    seen = np.bincount(rows.track, minlength=TRACKS)
    assert found.known.all()
    assert found.held[seen >= 2].all()
    twice = rows.take(seen[rows.track] >= 2)
    free = Free(frame=(*POSE, FRAME_FOCAL), zoom=smooth_zoom(numbers))
    best = adjust(truth, twice, free, iterations=300, tolerance=1e-10).state  # not where it starts: where it is least
    assert turn_error(found.state, truth, found.known) < 1.1 * turn_error(best, truth, found.known)
    assert path_error(found.state, truth, found.known) < 1.1 * path_error(best, truth, found.known)
    off = np.abs(told.focal_px - focal * np.exp(truth.focal)).max()
    assert off < 4.0 * told.focal_sigma_px
