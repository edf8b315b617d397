"""A rolling shutter by formula: every row is seen from where the camera was when it was read."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.match.solve.solution import Options
from core.match.solve.solve import solve
from core.match.solve.state import Observations, State, start_lens
from tests.core.match.solve.shots import FOCAL, NOISE, SIZE, path_error, turn_error

FRAMES, READOUT = 40, 0.15


def _camera(time):
    """Rotations and centres at times (in frames)."""
    t = time / (FRAMES - 1)
    turn = Rotation.from_euler("yx", np.stack([-0.15 + 0.3 * t, 0.05 * np.sin(9 * t)], -1)).as_matrix()
    return turn, np.stack([-1.5 + 3 * t, 0.3 * np.sin(6 * t), 0.5 * t], -1)


@pytest.fixture(scope="module")
def rolled():
    rng = np.random.default_rng(8)
    points = rng.uniform([-4, -2.5, 6], [4, 2.5, 14], (40, 3))
    frame, track = (part.ravel() for part in np.meshgrid(np.arange(FRAMES), np.arange(40), indexing="ij"))
    xy = np.full((len(frame), 2), (SIZE[1] - 1) / 2)
    for _ in range(8):  # the row and the time it is read at depend on each other
        turn, centre = _camera(frame + READOUT * ((xy[:, 1] + 0.5) / SIZE[1] - 0.5))
        seen = np.einsum("nij,nj->ni", turn, points[track] - centre)
        xy = FOCAL * seen[:, :2] / seen[:, 2:] + (np.array(SIZE) - 1) / 2
    inside = ((xy > 0) & (xy < np.array(SIZE) - 1)).all(1)
    xy = xy + rng.normal(0, NOISE, xy.shape)
    rows = Observations(
        frame[inside].astype(np.int32), track[inside].astype(np.int32), np.ascontiguousarray(xy[inside]),
        np.tile([1.0, 0.0, 1.0], (int(inside.sum()), 1)))
    turn, centre = _camera(np.arange(FRAMES))
    truth = State(turn, -np.einsum("fij,fj->fi", turn, centre), points, np.zeros(FRAMES), start_lens(FOCAL, *SIZE))
    return truth, rows


def _solved(rolled, **options):
    truth, rows = rolled
    found = solve(rows, np.arange(1001, 1001 + FRAMES, dtype=np.int32), 40, SIZE, Options(FOCAL, **options))
    return found, path_error(found.state, truth, found.known), turn_error(found.state, truth, found.known)


@pytest.mark.parametrize("options", [{"readout": READOUT}, {"free_readout": True}])
def test_a_rolling_shutter_is_given_or_found(rolled, options):
    found, path, turn = _solved(rolled, **options)
    assert found.held.all()
    assert found.sigma < 1.05 * NOISE
    assert path < 0.006
    assert turn < 0.03
    if options.get("free_readout"):
        (words,) = found.said
        told, doubt = (float(words.split()[k]) for k in (6, 8))
        assert told == pytest.approx(READOUT, abs=max(0.02, 3 * doubt))
        assert doubt < 0.05


def test_without_it_the_camera_is_worse(rolled):
    still, found = _solved(rolled), _solved(rolled, readout=READOUT)
    assert still[2] > 1.1 * found[2]
    assert still[0].sigma > 1.02 * found[0].sigma
