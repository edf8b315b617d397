"""Photographs and witness cameras, alone and together with a shot."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.errors import UserError
from core.match.solve.report import report
from core.match.solve.solution import Options
from core.match.solve.solve import solve
from core.match.solve.state import Observations, State, projected, start_lens
from core.match.solve.views import Camera, Views, as_one
from tests.core.match.solve.shots import FOCAL, SIZE, path_error, shot, turn_error

PHONE = Camera((3000, 4000), 2900.0)


def _stills(count: int, points: np.ndarray, camera: Camera, seed: int = 0, noise: float = 0.5):
    """Photographs around the points, in no order: state and observations in frames 0 .. count."""
    rng = np.random.default_rng(seed)
    middle = points.mean(0)
    angle = rng.permutation(np.linspace(-0.7, 0.7, count))
    centres = middle + 11 * np.stack([np.sin(angle), rng.uniform(-0.2, 0.2, count), -np.cos(angle)], 1)
    ahead = (middle - centres) / np.linalg.norm(middle - centres, axis=1, keepdims=True)
    right = np.cross([0.0, 1, 0], ahead)
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    turn = np.stack([right, np.cross(ahead, right), ahead], 1)
    turn = Rotation.from_rotvec(rng.normal(0, 0.1, (count, 3))).as_matrix() @ turn
    lens = start_lens(camera.focal or 1.0, *camera.size)
    lens[1:3] = camera.k1, camera.k2
    state = State(turn, -np.einsum("fij,fj->fi", turn, centres), points, np.zeros(count), lens)
    frame, track = (a.ravel() for a in np.meshgrid(np.arange(count), np.arange(len(points)), indexing="ij"))
    xy, depth = projected(state, frame, points[track])
    seen = (depth > 0.1) & (xy > 0).all(1) & (xy < np.array(camera.size) - 1).all(1)
    xy = xy + rng.normal(0, noise, xy.shape)
    return state, Observations(
        frame[seen].astype(np.int32), track[seen].astype(np.int32), np.ascontiguousarray(xy[seen]),
        np.tile([1.0, 0.0, 1.0], (int(seen.sum()), 1)),
    )


def _together(made, count: int, camera: Camera, seed: int = 0):
    state, more = _stills(count, made.truth.points, camera, seed)
    first = len(made.frames)
    both = Observations(*(
        np.concatenate(pair) for pair in zip(made.observations, more._replace(frame=more.frame + first), strict=True)
    ))
    views = Views(
        np.arange(first + count) >= first, (np.arange(first + count) >= first).astype(np.int32),
        (Camera(SIZE), camera),
    )
    truth = made.truth._replace(
        rotation=np.concatenate([made.truth.rotation, state.rotation]),
        translation=np.concatenate([made.truth.translation, state.translation]), focal=np.zeros(first + count),
    )
    return truth, both, views, np.arange(1, first + count + 1, dtype=np.int32)


def test_photographs_in_no_order_are_solved():
    points = np.random.default_rng(1).uniform([-4, -3, 6], [4, 3, 14], (60, 3))
    truth, rows = _stills(9, points, PHONE)
    views = Views(np.ones(9, bool), np.zeros(9, np.int32), (PHONE,))
    frames = np.arange(9, dtype=np.int32)
    found = solve(rows, frames, 60, PHONE.size, Options(PHONE.focal), views=views)
    told = report(found, [str(k) for k in range(60)])
    assert found.known.all()
    assert path_error(found.state, truth, found.known) < 0.005
    assert turn_error(found.state, truth, found.known) < 0.05
    assert not told.warnings
    assert told.rms_px == pytest.approx(0.5 * np.sqrt(2), rel=0.2)


def test_matches_that_are_wrong_are_left_out_of_photographs():
    points = np.random.default_rng(1).uniform([-4, -3, 6], [4, 3, 14], (80, 3))
    truth, rows = _stills(8, points, PHONE, seed=1)
    wrong = np.random.default_rng(2).random(len(rows.frame)) < 0.06
    rows.xy[wrong] = np.random.default_rng(3).uniform(0, 3000, (int(wrong.sum()), 2))
    views = Views(np.ones(8, bool), np.zeros(8, np.int32), (PHONE,))
    found = solve(rows, np.arange(8, dtype=np.int32), 80, PHONE.size, Options(PHONE.focal), views=views)
    assert found.known.all()
    assert not found.used[wrong].any()
    assert path_error(found.state, truth, found.known) < 0.006


@pytest.mark.parametrize("told", [True, False])
def test_witnesses_of_another_lens_are_solved_with_the_shot(told):
    made = shot("orbit", 40, 20, seed=1)
    truth, rows, views, frames = _together(made, 4, PHONE._replace(k1=-0.06))
    if not told:
        views = views._replace(cameras=(views.cameras[0], views.cameras[1]._replace(focal=3300.0, found=True)))
    found = solve(rows, frames, 40, SIZE, Options(FOCAL), views=views)
    words = report(found, [str(k) for k in range(40)])
    assert found.known.all()
    shot_only = made.truth._replace(rotation=truth.rotation[:20], translation=truth.translation[:20])
    alone = solve(made.observations, made.frames, 40, SIZE, Options(FOCAL))
    first = State(*(part[:20] for part in found.state[:2]), *found.state[2:])
    assert path_error(first, shot_only, alone.known) < path_error(alone.state, made.truth, alone.known)
    assert path_error(found.state, truth, found.known) < 0.01
    np.testing.assert_allclose(words.focal_px[:20], FOCAL)
    np.testing.assert_allclose(words.focal_px[20:], 2900.0, rtol=1e-6 if told else 0.01)
    assert np.ptp(words.focal_px[20:]) < 0.1


def test_a_shot_that_only_turns_gets_its_depth_from_photographs():
    made = shot("nodal", 40, 20, seed=1)
    truth, rows, views, frames = _together(made, 3, PHONE)
    found = solve(rows, frames, 40, SIZE, Options(FOCAL), views=views)
    told = report(found, [str(k) for k in range(40)])
    assert found.known.all()
    assert told.kind == "free"
    assert path_error(found.state, truth, found.known) < 0.03


def test_pictures_of_another_camera_are_brought_to_the_first():
    points = np.random.default_rng(1).uniform([-2, -2, 8], [2, 2, 12], (20, 3))
    camera = Camera((3000, 4000), 2900.0, k1=-0.06, k2=0.01)
    state, rows = _stills(2, points, camera, noise=0.0)
    views = Views(np.ones(2, bool), np.ones(2, np.int32), (Camera(SIZE), camera))
    ours, pixel = as_one(rows, views, FOCAL)
    theirs, _ = projected(state._replace(lens=start_lens(FOCAL, *SIZE)), rows.frame, points[rows.track])
    np.testing.assert_allclose(ours.xy, theirs, atol=1e-6)
    np.testing.assert_allclose(pixel, 2900.0 / FOCAL)
    np.testing.assert_allclose(ours.root[:, 0], 2900.0 / FOCAL)


def test_a_focal_length_that_is_none_is_refused():
    made = shot("orbit", 12, 4)
    views = Views(np.zeros(4, bool), np.zeros(4, np.int32), (Camera(SIZE), Camera(SIZE, -5.0)))
    with pytest.raises(UserError, match="focal length"):
        solve(made.observations, made.frames, 12, SIZE, Options(FOCAL), views=views)


