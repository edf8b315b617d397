"""Two motions among the tracks: of a camera and of a thing, made apart and known."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.errors import UserError
from core.match.solve.motions import of_their_own, told_of_motions, without_parallax
from core.match.solve.nodal import BY_CHANCE, parallax
from core.match.solve.report import report
from core.match.solve.solution import Options
from core.match.solve.solve import solve
from core.match.solve.state import Observations
from tests.core.match.solve.shots import FOCAL, NOISE, SIZE, shot

FRAMES = 60


def _with_a_walker(share: float, seed: int, walks: float, tripod: bool = False, rho: float = 0.0, tracks: int = 60):
    """Observations, and which tracks lie on a thing that goes its own way. A camera that passes, or only turns."""
    rng = np.random.default_rng(seed)
    points = rng.uniform([-4, -2.5, 6], [4, 2.5, 14], (tracks, 3))
    t = np.linspace(0, 1, FRAMES)
    centres = np.stack([-1.5 + 3 * t, 0.3 * np.sin(6 * t), 0.5 * t], 1) * (0.0 if tripod else 1.0)
    turn = Rotation.from_euler("yx", np.stack([-0.15 + 0.3 * t, 0.05 * np.sin(4 * t)], 1)).as_matrix()
    on_it = rng.random(tracks) < share
    walk = walks * np.stack([1.2 * t, -0.5 * t, 0.6 * np.sin(3 * t)], 1)
    there = points + walk[:, None] * on_it[:, None]
    seen = np.einsum("fij,fpj->fpi", turn, there - centres[:, None])
    xy = FOCAL * seen[..., :2] / seen[..., 2:] + 0.5 * (np.array(SIZE) - 1.0)
    inside = (seen[..., 2] > 0.1) & (xy > -0.5).all(-1) & (xy < np.array(SIZE) - 0.5).all(-1)
    noise = rng.normal(0, NOISE, xy.shape)
    for f in range(1, FRAMES):
        noise[f] = rho * noise[f - 1] + np.sqrt(1 - rho**2) * noise[f]
    frame, track = np.nonzero(inside)
    rows = Observations(
        frame.astype(np.int32),
        track.astype(np.int32),
        np.ascontiguousarray((xy + noise)[frame, track]),
        np.tile([1.0, 0.0, 1.0], (len(frame), 1)),
    )
    return rows, on_it


def _solved(rows, tracks=60):
    found = solve(rows, np.arange(1001, 1001 + FRAMES, dtype=np.int32), tracks, SIZE, Options(FOCAL))
    return found, report(found, [str(k) for k in range(tracks)])


@pytest.mark.parametrize("seed", [8101, 8103])
def test_a_thing_that_walks_before_a_tripod_is_not_taken_for_a_path_without_a_word(seed):
    rows, on_it = _with_a_walker(0.3, seed, 1.0, tripod=True)
    found, told = _solved(rows)
    if told.kind == "nodal":  # right: the thing was left out
        assert not (found.held & on_it).any()
        return
    assert any("as good as infinitely far" in words for words in told.warnings)
    far = without_parallax(found)
    assert not (far & on_it).any()
    assert far.sum() >= 0.9 * (~on_it).sum()


@pytest.mark.parametrize("seed", [8101, 8102, 8103])
def test_a_thing_with_more_tracks_than_the_set_is_said_to_be_a_second_motion(seed):
    rows, on_it = _with_a_walker(0.66, seed, 1.0)
    try:
        found, told = _solved(rows)
    except UserError as refused:
        assert "two motions" in str(refused)  # noqa: PT017
        return
    own = of_their_own(found)
    assert own.sum() >= 0.9 * (~found.held).sum()
    assert (own & found.held).sum() == 0
    assert len(set(on_it[own])) == 1  # one of the two motions, whole
    assert any("two motions" in words for words in told.warnings)


@pytest.mark.parametrize("motion", ["orbit", "planar", "forward"])
def test_tracks_that_jump_about_are_no_motion_and_a_plain_shot_has_no_doubt(motion):
    for outliers in (0.0, 0.3):
        made = shot(motion, 50, 40, outliers, seed=71)
        found = solve(made.observations, made.frames, 50, SIZE, Options(FOCAL))
        assert told_of_motions(found) == []


@pytest.mark.parametrize("seed", [8101, 8102])
def test_noise_that_goes_on_is_no_movement_of_a_tripod(seed):
    rows, _ = _with_a_walker(0.0, seed, 0.0, tripod=True, rho=0.9)
    found, told = _solved(rows)
    assert told.kind == "nodal"
    assert parallax(found.state, found.observations.take(found.used), found.sigma) < BY_CHANCE
    assert not any("moves a little" in words for words in told.warnings)
