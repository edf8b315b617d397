"""A head of known shape before a camera that moves too."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.errors import UserError
from core.match.solve.bundle import RIGID, adjust
from core.match.solve.moving import in_world, solve_moving, solve_with_camera
from core.match.solve.state import FOCAL, Observations, State, projected, start_lens
from tests.core.match.solve.shots import NOISE, SIZE, shot

FRAMES = 20
# nose, eyes, ears, chin, brow, cheek, of a head about 20 cm wide; metres
HEAD = np.array([
    [0, 0, -0.11], [-0.035, 0.04, -0.08], [0.035, 0.04, -0.08], [-0.085, 0.02, 0.02], [0.085, 0.02, 0.02],
    [0, -0.09, -0.08], [0, 0.09, -0.07], [0.06, -0.03, -0.06],
])


def _head(count: int, seed: int = 0, noise: float = NOISE, focal: float = 1600.0, lost: float = 0.0):
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 1, FRAMES)
    turn = Rotation.from_euler("yxz", np.stack([np.sin(5 * t) * 0.5, 0.2 * np.cos(4 * t), 0.1 * t], 1)).as_matrix()
    shift = np.stack([0.05 * np.sin(3 * t), 0.03 * t, 0.6 + 0.05 * t], 1)  # it fills the picture
    lens = start_lens(focal, *SIZE)
    state = State(turn, shift, HEAD[:count], np.zeros(FRAMES), lens)
    frame, track = (a.ravel() for a in np.meshgrid(np.arange(FRAMES), np.arange(count), indexing="ij"))
    kept = rng.random(len(frame)) >= lost
    frame, track = frame[kept].astype(np.int32), track[kept].astype(np.int32)
    xy = projected(state, frame, HEAD[track])[0] + rng.normal(0, noise, (len(frame), 2))
    return state, Observations(frame, track, xy, np.tile([1.0, 0.0, 1.0], (len(frame), 1)))


def _angles(a, b):
    return np.degrees(Rotation.from_matrix(np.einsum("fji,fjk->fik", a, b)).magnitude())


@pytest.mark.parametrize("count", [6, 8])
def test_the_turn_of_a_head_is_within_a_tenth_of_a_degree(count):
    truth, rows = _head(count)
    found = solve_moving(rows, HEAD[:count], truth.lens, np.zeros(FRAMES), noise=NOISE)
    assert found.known.all()
    assert np.sqrt((_angles(found.rotation, truth.rotation) ** 2).mean()) < 0.1
    assert found.sigma == pytest.approx(NOISE, rel=0.2)
    told = np.degrees(found.turn_sigma) * np.sqrt(3)
    assert 0.5 < np.sqrt((_angles(found.rotation, truth.rotation) ** 2).mean() / (told**2).mean()) < 1.6


def test_a_track_that_slides_off_and_frames_that_see_little_do_no_harm():
    truth, rows = _head(8, seed=1, lost=0.25)
    bad = rows.track == 7
    rows.xy[bad] += np.linspace(0, 40, int(bad.sum()))[:, None]
    few = (rows.frame == 9) & (rows.track > 3)
    rows = rows.take(~few)
    found = solve_moving(rows, HEAD, truth.lens, np.zeros(FRAMES), noise=NOISE)
    assert found.known.sum() >= FRAMES - 1
    assert not found.used[(rows.track == 7) & (rows.frame > 5)].any()
    assert np.median(_angles(found.rotation, truth.rotation)[found.known]) < 0.15


def test_a_mesh_that_is_a_little_wrong_gives_way():
    truth, rows = _head(8, seed=2)
    wrong = HEAD + np.random.default_rng(5).normal(0, 0.002, HEAD.shape)
    stiff = solve_moving(rows, wrong, truth.lens, np.zeros(FRAMES), noise=NOISE)
    loose = solve_moving(rows, wrong, truth.lens, np.zeros(FRAMES), noise=NOISE, loose=0.002)
    assert loose.sigma < 1.3 * NOISE < stiff.sigma


def test_camera_and_head_share_the_lens_that_neither_knows_alone():
    made = shot("orbit", 40, FRAMES, seed=3)
    truth, rows = _head(8, seed=3)
    wrong = made.truth._replace(lens=made.truth.lens.copy())
    wrong.lens[FOCAL] += 0.04
    camera = adjust(wrong, made.observations, RIGID).state
    alone = solve_moving(rows, HEAD, camera.lens, np.zeros(FRAMES), noise=NOISE)
    both = solve_with_camera(camera, made.observations, alone, rows, HEAD, find_focal=True)
    assert np.exp(both.lens[FOCAL]) == pytest.approx(1600.0, rel=0.005)
    assert both.camera is not None
    turn, place = in_world(both, both.camera)
    true_turn = np.einsum("fji,fjk->fik", made.truth.rotation, truth.rotation)
    common = turn[0] @ true_turn[0].T
    assert np.median(_angles(np.einsum("ij,fjk->fik", common, true_turn), turn)) < 0.15
    assert np.isfinite(place).all()
    np.testing.assert_allclose(both.points, HEAD, atol=1e-4)


def test_what_is_in_the_world_is_seen_where_the_object_is():
    made = shot("orbit", 10, FRAMES)
    truth, rows = _head(8, noise=0.0)
    found = solve_moving(rows, HEAD, truth.lens, np.zeros(FRAMES), noise=NOISE)
    turn, place = in_world(found, made.truth)
    there = np.einsum("fij,pj->fpi", turn, HEAD) + place[:, None]
    xy, _ = projected(made.truth, rows.frame, there[rows.frame, rows.track])
    np.testing.assert_allclose(xy, rows.xy, atol=1e-3)


@pytest.mark.parametrize(
    ("count", "words"), [(4, "points of its mesh"), (5, "No frame sees")]
)
def test_too_few_points_are_refused(count, words):
    truth, rows = _head(6)
    if count == 5:
        rows = rows.take(rows.track < 3)
    with pytest.raises(UserError, match=words):
        solve_moving(rows, HEAD[: max(count, 4) if count == 4 else 6], truth.lens, np.zeros(FRAMES))
    with pytest.raises(UserError, match="not on one line"):
        solve_moving(rows, np.outer(np.arange(6.0), [1, 2, 3]), truth.lens, np.zeros(FRAMES))
