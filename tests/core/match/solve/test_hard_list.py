"""What a solver goes silently wrong on. Each of these is right, says why it is not, or is refused; a lens that bends, a
focal length a little wrong and two motions are in test_solve."""

from typing import NamedTuple

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.errors import UserError
from core.match.solve.floor import noise_floor
from core.match.solve.nodal import BY_CHANCE, parallax
from core.match.solve.report import report
from core.match.solve.slides import correlation, drift_gains
from core.match.solve.solution import Options
from core.match.solve.solve import solve
from core.match.solve.state import Observations, State, projected, start_lens
from tests.core.match.solve.shots import FOCAL, NOISE, SIZE, Shot, path_error, shot, turn_error

FRAMES = 40


class Scene(NamedTuple):
    """A camera that passes points 6 to 14 away."""

    points: np.ndarray
    t: np.ndarray
    centres: np.ndarray
    turn: np.ndarray


def _scene(tracks: int = 60, seed: int = 1) -> Scene:
    rng = np.random.default_rng(seed)
    points = rng.uniform([-4, -2.5, 6], [4, 2.5, 14], (tracks, 3))
    t = np.linspace(0, 1, FRAMES)
    centres = np.stack([-1.5 + 3 * t, 0.3 * np.sin(6 * t), 0.5 * t], 1)
    turn = Rotation.from_euler("yx", np.stack([-0.15 + 0.3 * t, 0.05 * np.sin(4 * t)], 1)).as_matrix()
    return Scene(points, t, centres, turn)


def _shot(scene: Scene, zoom=0.0, drift=0.0, rho=0.0, seed: int = 1) -> Shot:
    """Tracks of a scene; `drift` (F, P, 2) is added to them, `rho` is how their noise goes on from frame to frame."""
    rng = np.random.default_rng(seed)
    lens, count = start_lens(FOCAL, *SIZE), len(scene.points)
    zoom = zoom + np.zeros(FRAMES)
    shift = -np.einsum("fij,fj->fi", scene.turn, scene.centres)
    seen = np.einsum("fij,pj->fpi", scene.turn, scene.points) + shift[:, None]
    xy = (FOCAL * np.exp(zoom))[:, None, None] * seen[..., :2] / seen[..., 2:] + lens[4:6]
    inside = (seen[..., 2] > 0.1) & (xy > -0.5).all(-1) & (xy < np.array(SIZE) - 0.5).all(-1)
    noise = rng.normal(0, NOISE, xy.shape)
    for f in range(1, FRAMES):
        noise[f] = rho * noise[f - 1] + np.sqrt(1 - rho**2) * noise[f]
    frame, track = np.nonzero(inside)
    rows = Observations(
        frame.astype(np.int32), track.astype(np.int32), np.ascontiguousarray((xy + noise + drift)[frame, track]),
        np.tile([1.0, 0.0, 1.0], (len(frame), 1)),
    )
    truth = State(scene.turn, shift, scene.points, zoom, lens)
    return Shot(truth, rows, np.zeros(count, bool), np.arange(1001, 1001 + FRAMES, dtype=np.int32))


def _solved(made: Shot):
    found = solve(made.observations, made.frames, len(made.bad), SIZE, Options(FOCAL))
    return found, report(found, [str(k) for k in range(len(made.bad))])


def test_a_dolly_zoom_declared_fixed_is_solved_with_a_zoom_and_that_is_said():
    scene = _scene()
    depth = -3.0 * scene.t
    centres = np.stack([0.6 * scene.t, 0 * scene.t, depth], 1)
    made = _shot(scene._replace(centres=centres, turn=np.tile(np.eye(3), (FRAMES, 1, 1))), np.log(1 - depth / 10))
    found, told = _solved(made)
    assert turn_error(found.state, made.truth, found.known) < 0.06
    assert path_error(found.state, made.truth, found.known) < 0.02
    # how the focal length changes; one factor on all frames is a freedom that such tracks leave: adjusting from the
    # truth itself walks along it
    course = told.focal_px / (FOCAL * np.exp(made.truth.focal))
    np.testing.assert_allclose(course / course[0], 1.0, rtol=0.01)
    np.testing.assert_allclose(course, 1.0, rtol=0.05)
    assert any("focal length changes" in words for words in told.warnings)
    assert 0.05 * FOCAL < told.focal_sigma_px < 0.5 * FOCAL
    assert any("by one factor on all frames" in words for words in told.warnings)


def test_tracks_that_slide_slowly_and_straight_are_left_out():
    size, scene = 4.0, _scene(80)
    rng = np.random.default_rng(7)
    bad = rng.random(80) < 0.2
    way = rng.normal(size=(80, 2))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    made = _shot(scene, drift=size * scene.t[:, None, None] * way * bad[:, None])
    clean = _shot(scene)
    found, _ = _solved(made)
    best, _ = _solved(clean)
    assert (~found.held & bad).sum() >= 0.75 * bad.sum()
    assert found.held[~bad].all()
    assert best.held.all()
    # what is left slides along its own epipolar lines
    assert turn_error(found.state, made.truth, found.known) < 1.5 * turn_error(best.state, made.truth, best.known)


def test_the_slope_of_a_track_that_slides_is_told_from_noise():
    made = shot("orbit", 30, FRAMES)
    rows = made.observations
    still = drift_gains(made.truth, rows, 30, NOISE)
    assert still.max() < 20
    rows.xy[rows.track == 4] += 3.0 * (rows.frame[rows.track == 4] / FRAMES)[:, None] * [0.3, 1.0]
    gains = drift_gains(made.truth, rows, 30, NOISE)
    assert gains.argmax() == 4
    assert gains[4] > 100


def test_a_camera_on_a_tripod_that_moves_a_little_is_said_to_move():
    scene = _scene(60)
    found, told = _solved(_shot(scene._replace(centres=0.012 * scene.centres)))
    assert told.kind == "nodal"
    assert [words for words in told.warnings if "moves a little" in words] == list(told.warnings)
    assert told.warnings
    still, quiet = _solved(_shot(scene._replace(centres=0.0 * scene.centres)))
    assert not quiet.warnings
    gains = [parallax(one.state, one.observations.take(one.used), one.sigma) for one in (found, still)]
    assert gains[1] < BY_CHANCE < gains[0]


def test_a_path_that_is_short_says_how_well_it_is_known():
    scene = _scene()
    found, told = _solved(_shot(scene._replace(centres=scene.centres / 30)))
    assert told.kind == "free"
    assert any("path is known" in words for words in told.warnings)
    assert 0.01 < told.path_sigma < 0.2
    assert found.known.all()


@pytest.mark.parametrize("rho", [0.5, 0.9])
def test_noise_that_goes_on_from_frame_to_frame_makes_no_false_alarm(rho):
    made = _shot(_scene(80), rho=rho)
    found, told = _solved(made)
    assert correlation(found.state, found.observations.take(found.used)) > 0.3
    assert not told.warnings
    assert path_error(found.state, made.truth, found.known) < 0.004


def test_outliers_on_a_tripod_are_left_out():
    made = shot("nodal", 40, FRAMES, outliers=0.3, seed=2)
    found, told = _solved(made)
    assert told.kind == "nodal"
    assert not (found.held & made.bad).any()
    assert turn_error(found.state, made.truth, found.known) < 0.015
    assert not told.warnings


def test_eight_tracks_are_right_and_say_how_sure_or_are_refused():
    scene = _scene(400)
    whole = _shot(scene)
    through = np.flatnonzero(np.bincount(whole.observations.track, minlength=400) == FRAMES)[:8]
    made = _shot(scene._replace(points=scene.points[through]))
    try:
        found, told = _solved(made)
    except UserError:
        return
    size = np.sqrt(((scene.centres - scene.centres.mean(0)) ** 2).sum(1).mean())
    error = path_error(found.state, made.truth, found.known) / size
    assert error < 3 * told.path_sigma
    assert told.path_sigma < 0.03 or told.warnings


def test_tracks_that_live_for_a_third_of_the_shot_are_joined_through_all_of_it():
    made = shot("orbit", 120, 60, seed=4)
    born = np.random.default_rng(4).integers(-20, 58, 120)
    rows = made.observations
    rows = rows.take((rows.frame >= born[rows.track]) & (rows.frame < born[rows.track] + 20))
    assert np.bincount(rows.frame).min() > 8
    found = solve(rows, made.frames, 120, SIZE, Options(FOCAL))
    told = report(found, [str(k) for k in range(120)])
    assert found.known.all()
    assert not told.warnings
    assert path_error(found.state, made.truth, found.known) < 3 * told.path_sigma
    assert told.path_sigma < 0.02


def test_a_camera_that_stands_first_and_then_goes_is_solved():
    scene = _scene(40, seed=3)
    go = np.clip(2.0 * scene.t - 1.0, 0.0, 1.0)
    made = _shot(scene._replace(centres=np.stack([2.0 * go, 0.0 * go, 0.3 * go], 1)))
    found, told = _solved(made)
    assert told.kind == "free"
    assert found.known.all()
    assert not told.warnings
    assert path_error(found.state, made.truth, found.known) < 0.01


@pytest.mark.parametrize(("rho", "wide"), [(0.0, 8.0), (0.5, 8.0), (0.0, 1.0)])
def test_the_noise_of_tracks_is_told_through_a_fast_pan(rho, wide):
    scene = _scene(400, seed=5)
    scene = scene._replace(points=scene.points * [3.0, 1.0, 1.0], centres=0.1 * scene.centres)
    turn = Rotation.from_euler("yx", np.stack([0.15 * wide * (scene.t - 0.5), 0.05 * np.sin(4 * scene.t)], 1))
    made = _shot(scene._replace(turn=turn.as_matrix()), rho=rho)
    assert 0.85 * NOISE < noise_floor(made.observations, FRAMES) < 1.35 * NOISE


def test_tracks_without_any_noise_are_solved_and_doubted():
    made = shot("nodal", 30, 10)
    truth = made.truth._replace(rotation=np.tile(made.truth.rotation[:1], (10, 1, 1)))
    rows = made.observations
    frame, track = (a.ravel() for a in np.meshgrid(np.arange(10), np.unique(rows.track), indexing="ij"))
    exact, _ = projected(truth, frame, truth.points[track])
    root = np.tile([1.0, 0.0, 1.0], (len(frame), 1))
    rows = Observations(frame.astype(np.int32), track.astype(np.int32), exact, root)
    found = solve(rows, made.frames, 30, SIZE, Options())
    told = report(found, [str(k) for k in range(30)])
    assert any("focal length is known to" in words for words in told.warnings)


def test_what_is_no_shot_is_refused_with_its_own_reason():
    made = shot("orbit", 60, 30)
    rows = made.observations
    blocks = rows.take(rows.track // 10 == rows.frame // 5)
    with pytest.raises(UserError, match="from frame 1005 to 1006 only 0 tracks go on"):
        report(solve(blocks, made.frames, 60, SIZE, Options(FOCAL)), [str(k) for k in range(60)])
    line = rows._replace(xy=np.stack([30.0 * rows.track + rows.frame, np.full(len(rows.track), 500.0)], 1))
    with pytest.raises(UserError, match="on one line"):
        solve(line, made.frames, 60, SIZE, Options(FOCAL))
    with pytest.raises(UserError, match="lie outside of a plate of 720 x 576"):
        solve(rows, made.frames, 60, (720, 576), Options(FOCAL))
