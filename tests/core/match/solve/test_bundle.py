import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from core.match.solve.bundle import POSE, Free, adjust, normal_equations, smooth_zoom
from core.match.solve.floor import noise_floor
from core.match.solve.state import FOCAL, FRAME_FOCAL, K1, State, bearings, projected, residuals
from tests.core.match.solve.shots import NOISE, shot

ALL = Free(frame=(*POSE, FRAME_FOCAL), lens=(0, 1, 2, 3, 4, 5))


def _disturbed(truth: State, size: float, seed: int = 3) -> State:
    rng = np.random.default_rng(seed)
    turn = Rotation.from_rotvec(rng.normal(0, 0.1 * size, (len(truth.rotation), 3))).as_matrix() @ truth.rotation
    return truth._replace(
        rotation=turn, translation=truth.translation + rng.normal(0, size, truth.translation.shape),
        points=truth.points + rng.normal(0, size, truth.points.shape),
    )


def _moved(state: State, step: np.ndarray) -> State:
    frames, points = len(state.rotation), len(state.points)
    of_frames = step[: 7 * frames].reshape(frames, 7)
    of_points = step[7 * frames : 7 * frames + 3 * points].reshape(points, 3)
    return State(
        Rotation.from_rotvec(of_frames[:, :3]).as_matrix() @ state.rotation, state.translation + of_frames[:, 3:6],
        state.points + of_points, state.focal + of_frames[:, 6], state.lens + step[-6:],
    )


def test_the_blocks_are_those_of_finite_differences():
    made = shot("zoom", tracks=6, frames=3, k1=-0.03)
    state = _disturbed(made.truth, 0.05)
    state.lens[2], state.lens[3] = 0.01, 0.02
    normal = normal_equations(state, made.observations, 0.0, ALL)
    size = 7 * 3 + 3 * 6 + 6
    columns = []
    for k in range(size):
        step = np.zeros(size)
        step[k] = 1e-6
        ahead, behind = (residuals(_moved(state, sign * step), made.observations) for sign in (1, -1))
        columns.append((ahead - behind).ravel() / 2e-6)
    jacobian = np.stack(columns, 1)
    error = residuals(state, made.observations).ravel()
    whole, right = jacobian.T @ jacobian, -jacobian.T @ error
    scale = np.abs(whole).max()
    for f in range(3):
        rows = slice(7 * f, 7 * f + 7)
        np.testing.assert_allclose(normal.frames[f], whole[rows, rows], atol=1e-6 * scale)
        np.testing.assert_allclose(normal.frame_lens[f], whole[rows, -6:], atol=1e-6 * scale)
        np.testing.assert_allclose(normal.frames_right[f], right[rows], atol=1e-6 * np.abs(right).max())
    for p in range(6):
        rows = slice(21 + 3 * p, 24 + 3 * p)
        np.testing.assert_allclose(normal.points[p], whole[rows, rows], atol=1e-6 * scale)
        np.testing.assert_allclose(normal.point_lens[p], whole[rows, -6:], atol=1e-6 * scale)
    for n, (f, p) in enumerate(zip(made.observations.frame, made.observations.track, strict=True)):
        block = whole[7 * f : 7 * f + 7, 21 + 3 * p : 24 + 3 * p]
        np.testing.assert_allclose(normal.crossed[n], block, atol=1e-6 * scale)
    np.testing.assert_allclose(normal.lens, whole[-6:, -6:], atol=1e-6 * scale)
    assert normal.cost == pytest.approx(float(error @ error))


@pytest.mark.parametrize(("tracks", "frames"), [(10, 6), (30, 4)])  # frames are eliminated, and points
@pytest.mark.parametrize("free", [Free(), Free(lens=(FOCAL, K1)), Free(points=False, lens=(FOCAL,)), Free(frame=())])
def test_it_ends_where_scipy_does(tracks, frames, free):
    made = shot("orbit", tracks, frames)
    begin = _disturbed(made.truth, 0.02)
    ours = adjust(begin, made.observations, free, iterations=60, tolerance=1e-14)
    size = 7 * frames + 3 * tracks + 6
    columns = [7 * f + c for f in range(frames) for c in free.frame]
    columns += list(range(7 * frames, 7 * frames + 3 * tracks)) if free.points else []
    columns += [size - 6 + c for c in free.lens]

    def error(x):
        step = np.zeros(size)
        step[columns] = x
        return residuals(_moved(begin, step), made.observations).ravel()

    theirs = least_squares(error, np.zeros(len(columns)), xtol=1e-15, ftol=1e-15, gtol=1e-15, x_scale="jac")
    assert ours.cost == pytest.approx(2.0 * theirs.cost, rel=1e-6)


@pytest.mark.parametrize("tracks", [12, 90])
def test_a_zoom_is_found_where_its_slope_may_wander(tracks):
    made = shot("zoom", tracks, frames=16)
    begin = _disturbed(made.truth, 0.02)._replace(focal=np.full(16, 0.2))
    free = Free(frame=(*POSE, FRAME_FOCAL), zoom=smooth_zoom(made.frames, 0.02))
    found = adjust(begin, made.observations, free, iterations=100, tolerance=1e-12).state
    assert np.abs(found.focal - made.truth.focal).max() < 0.02


def test_a_robust_loss_ignores_what_slides():
    made = shot("orbit", 40, 20, outliers=0.25)
    good = made.observations.take(~made.bad[made.observations.track])
    begin = _disturbed(made.truth, 0.01)
    robust = adjust(begin, made.observations, scale=2.5 * NOISE).state
    plain = adjust(begin, made.observations).state

    def spread(state):
        return np.sqrt((residuals(state, good) ** 2).mean())

    assert spread(robust) < 1.1 * NOISE
    assert spread(plain) > 1.3 * NOISE


def test_pixels_become_directions_and_back():
    made = shot("orbit", 20, 3, k1=-0.08)
    rows = made.observations
    directions = bearings(made.truth.lens, made.truth.focal[rows.frame], rows.xy)
    turn, shift = made.truth.rotation[rows.frame], made.truth.translation[rows.frame]
    seen = np.einsum("nji,nj->ni", turn, 5.0 * directions - shift)
    xy, depth = projected(made.truth, rows.frame, seen)
    np.testing.assert_allclose(xy, rows.xy, atol=1e-6)
    np.testing.assert_allclose(depth, 5.0)


@pytest.mark.parametrize("motion", ["orbit", "nodal", "planar"])
@pytest.mark.parametrize("outliers", [0.0, 0.2])
def test_the_noise_is_told_without_a_camera(motion, outliers):
    made = shot(motion, 80, 60, outliers)
    assert 0.85 * NOISE < noise_floor(made.observations, 60) < 1.5 * NOISE
