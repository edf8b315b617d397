"""Survey points and constraints against the scene the tracks were made from."""

import numpy as np
import pytest

from core.errors import UserError
from core.formats.known_file import read_known
from core.match.solve.certainty import Certainty
from core.match.solve.held import Known, hold
from core.match.solve.shot import FLIP
from core.match.solve.solution import Options
from core.match.solve.solve import solve
from tests.core.match.solve.shots import FOCAL, SIZE, shot

NAMES = [f"t{k}" for k in range(40)]


@pytest.fixture(scope="module")
def solved():
    made = shot("orbit", 40, 30, seed=3)
    return made, solve(made.observations, made.frames, 40, SIZE, Options(FOCAL))


def _survey(tmp_path, points, extra=""):
    path = tmp_path / "survey.csv"
    rows = [f"t{k},{x},{y},{z}" for k, (x, y, z) in points.items()]
    path.write_text("\n".join(["point,x,y,z", *rows, extra]))
    return read_known(path)


def test_survey_points_are_met_and_cameras_stand_where_they_stood(solved, tmp_path):
    made, found = solved
    up = made.truth.points @ FLIP
    held = np.flatnonzero(found.held)[[0, 7, 15, 22, 30]]
    done = hold(found, NAMES, _survey(tmp_path, {k: up[k] for k in held}))
    np.testing.assert_allclose(done.state.points[held], made.truth.points[held], atol=2e-3)
    np.testing.assert_allclose(done.state.centres(), made.truth.centres(), atol=0.02)
    assert done.sigma < 1.02 * found.sigma
    assert done.said == found.said


def test_a_survey_point_that_is_wrong_is_said(solved, tmp_path):
    made, found = solved
    up = made.truth.points @ FLIP
    held = np.flatnonzero(found.held)[[0, 7, 15, 22, 30]]
    wrong = {k: up[k] + [0.4 * (k == held[2]), 0, 0] for k in held}
    done = hold(found, NAMES, _survey(tmp_path, wrong))
    assert any("does not agree" in words and NAMES[held[2]] in words for words in done.said)


def test_a_distance_gives_the_scale(solved):
    made, found = solved
    i, j = np.flatnonzero(found.held)[[2, 20]]
    length = float(np.linalg.norm(made.truth.points[i] - made.truth.points[j]))
    done = hold(found, NAMES, [Known("distance", (NAMES[i], NAMES[j]), (length,))])
    assert np.linalg.norm(done.state.points[i] - done.state.points[j]) == pytest.approx(length, rel=1e-3)
    path, truth = (state.centres()[-1] - state.centres()[0] for state in (done.state, made.truth))
    assert np.linalg.norm(path) == pytest.approx(np.linalg.norm(truth), rel=0.02)


def test_the_doubt_of_the_cameras_is_that_of_the_survey(solved):
    """Surveys that miss by as much as they say move the cameras by as much as is said."""
    made, found = solved
    up = made.truth.points @ FLIP
    held, sigma = np.flatnonzero(found.held)[[0, 7, 15, 22, 30]], 0.02
    rng = np.random.default_rng(2)
    squares = []
    for _ in range(10):
        known = [Known("survey", (NAMES[k],), tuple(up[k] + rng.normal(0, sigma, 3)), sigma) for k in held]
        done = hold(found, NAMES, known)
        spread = Certainty(done).centres()[::10]
        away = (done.state.centres() - made.truth.centres())[::10]
        squares.append(np.einsum("fi,fij,fj->f", away, np.linalg.inv(spread), away) / 3)
    assert 0.6 < np.mean(squares) < 1.5


@pytest.mark.parametrize(("rows", "words"), [
    ({0: (0, 0, 0)}, "Three points"), ({99: (0, 0, 0)}, "no point 't99'"),
])
def test_a_survey_that_cannot_hold_is_refused(solved, tmp_path, rows, words):
    with pytest.raises(UserError, match=words):
        hold(solved[1], NAMES, _survey(tmp_path, rows))


@pytest.mark.parametrize("text", ["", "a,b\n", "t1,1,2\n", "h,x,y,z\nt1,1,2,nan\n", "t1,1,2,3\nt2,4\n"])
def test_a_table_that_is_none_is_refused(tmp_path, text):
    path = tmp_path / "a.csv"
    path.write_text(text)
    with pytest.raises(UserError):
        read_known(path)
