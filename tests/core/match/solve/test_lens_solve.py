import numpy as np
import pytest

from core.match.lens import bent, start_lens
from core.match.solve.bundle import Free, normal_equations
from core.match.solve.report import report
from core.match.solve.solution import Options
from core.match.solve.solve import solve
from core.match.solve.state import projected, residuals
from tests.core.match.solve.shots import FOCAL, NOISE, SIZE, path_error, shot

NUMBERS = {
    "brown5": {1: -0.06, 2: 0.02, 6: 0.003, 7: -0.002, 8: 0.004},
    "fisheye": {1: -0.03, 2: 0.01},
    "radial4": {1: 0.06, 2: 0.01, 7: 0.004, 8: -0.003},
    "anamorphic4": {1: 0.03, 2: 0.05, 7: -0.02, 8: 0.02, 9: 0.004},
}


def _bent(name: str, tracks: int = 100, frames: int = 40, noise: float = NOISE):
    """The shot seen through a lens: its truth and what was seen."""
    made = shot("orbit", tracks, frames, seed=2)
    lens = start_lens(FOCAL, *SIZE, name)
    for column, value in NUMBERS[name].items():
        lens[column] = value
    truth = made.truth._replace(lens=lens)
    rows = made.observations
    xy = projected(truth, rows.frame, truth.points[rows.track])[0]
    inside = ((xy > 0) & (xy < np.array(SIZE))).all(axis=1)
    xy = xy + np.random.default_rng(3).normal(0, noise, xy.shape)
    return made._replace(truth=truth, observations=rows._replace(xy=xy).take(inside))


@pytest.mark.parametrize("name", list(NUMBERS))
def test_the_blocks_of_a_lens_are_those_of_finite_differences(name):
    made = _bent(name, 6, 3)
    state, rows = made.truth, made.observations
    normal = normal_equations(state, rows, 0.0, Free())
    columns = list(NUMBERS[name])
    differences = []
    for column in columns:
        step = np.eye(len(state.lens))[column] * 1e-6
        ahead, behind = (residuals(state._replace(lens=state.lens + sign * step), rows) for sign in (1, -1))
        differences.append((ahead - behind).ravel() / 2e-6)
    jacobian = np.stack(differences, axis=1)
    np.testing.assert_allclose(normal.lens[np.ix_(columns, columns)], jacobian.T @ jacobian, rtol=1e-5)


@pytest.mark.parametrize("name", list(NUMBERS))
def test_a_lens_of_every_model_is_found(name):
    made = _bent(name)
    found = solve(made.observations, made.frames, 100, SIZE, Options(FOCAL, distortion=True, lens=name))
    told = report(found, [f"t{k}" for k in range(100)])
    assert found.known.all()
    assert found.held.mean() > 0.97
    assert told.rms_px < 1.1 * NOISE * np.sqrt(2)
    assert not told.warnings
    assert path_error(found.state, made.truth, found.known) < 0.01
    middle = np.random.default_rng(0).uniform(-0.5, 0.5, (200, 2)) * [1.0, 0.55]
    ours, theirs = (bent(lens, 0.0, middle) for lens in (found.state.lens, made.truth.lens))
    assert np.median(np.linalg.norm(ours - theirs, axis=1)) < 1.5
