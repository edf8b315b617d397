import numpy as np
import pytest
from scipy.optimize import approx_fprime, least_squares
from scipy.spatial.transform import Rotation

from core.errors import UserError
from core.match.solve.bundle import Free, adjust
from core.match.solve.constraints import KINDS, Constraint, Pull, circle_of, mirror_of
from core.match.solve.state import residuals
from tests.core.match.solve.shots import shot

RNG = np.random.default_rng(4)
CIRCLE = np.array([[2 * np.cos(a), 2 * np.sin(a), 0.3 * np.cos(a) + 5] for a in (0.1, 1.0, 2.5, 4.0, 5.0)])
MIRROR = np.array([0.6, 0.0, 0.8])


def _pairs():
    a = RNG.normal(size=(3, 3))
    return np.stack([a, a - 2 * ((a @ MIRROR) - 0.4)[:, None] * MIRROR], 1).reshape(6, 3)


# places that keep the constraint, and its value
KEPT = {
    "survey": ([[1.0, 2, 3]], (1.0, 2, 3)),
    "distance": ([[0.0, 0, 0], [3, 0, 4]], (5.0,)),
    "equal": ([[0.0, 0, 0], [3, 0, 4], [1, 1, 1], [1, 6, 1]], ()),
    "on_plane": ([[1.0, 0, 2], [5, 3, 2]], (0.0, 0, 2, 4)),
    "plane": ([[0.0, 0, 1], [1, 0, 2], [0, 1, 3], [2, 3, 9], [1, 1, 4]], ()),
    "line": ([[0.0, 0, 1], [1, 2, 2], [2, 4, 3], [-3, -6, -2]], ()),
    "circle": (CIRCLE @ np.diag([1, 1, 0]), (2.0,)),
    "parallel": ([[0.0, 0, 0], [1, 2, 3], [5, 5, 5], [3, 1, -1]], ()),
    "right": ([[0.0, 0, 0], [1, 2, 0], [1, 1, 1], [-1, 2, 8]], ()),
    "axis": ([[1.0, 1, 1], [3, 3, 1]], (1.0, 1, 0)),
    "symmetric": (_pairs(), ()),
}


@pytest.mark.parametrize("kind", KINDS)
def test_what_keeps_a_constraint_has_no_residual_and_what_does_not_is_pulled_back(kind):
    places, value = KEPT[kind]
    x = np.array(places, float)
    pull = Pull([Constraint(kind, tuple(range(len(x))), value, 0.1)], len(x), 1.0)
    assert pull.cost(x) < 1e-18
    moved = x + 0.05 * RNG.normal(size=x.shape)
    assert pull.cost(moved) > 1e-4
    for _ in range(12):
        _, right, matrix = pull.normal(moved)
        moved = moved + np.linalg.lstsq(matrix, right.ravel(), rcond=1e-10)[0].reshape(-1, 3)
    assert pull.cost(moved) < 1e-12


@pytest.mark.parametrize("kind", KINDS)
def test_the_slope_is_that_of_finite_differences(kind):
    places, value = KEPT[kind]
    x = np.array(places, float) + 0.05 * RNG.normal(size=np.shape(places))
    for values in {value, ()} if kind in ("circle", "symmetric") else {value}:
        pull = Pull([Constraint(kind, tuple(range(len(x))), values, 0.5)], len(x), 1.0)
        slope = approx_fprime(x.ravel(), lambda y, pull=pull, x=x: pull.cost(y.reshape(x.shape)), 1e-6)
        right = pull.normal(x)[1]
        np.testing.assert_allclose(-2 * right.ravel(), slope, atol=2e-2 * max(1.0, np.abs(slope).max()))


def test_the_shape_nobody_measured_is_the_nearest():
    x = CIRCLE * [1, 1, 0] + 0.1 * RNG.normal(size=CIRCLE.shape) * [1, 1, 0]
    theirs = least_squares(lambda q: np.hypot(x[:, 0] - q[0], x[:, 1] - q[1]) - q[2], [0, 0, 2], xtol=1e-14).x
    centre, _, radius = circle_of(x)
    np.testing.assert_allclose([*centre[:2], radius], theirs, atol=1e-6)
    normal, distance = mirror_of(_pairs())
    np.testing.assert_allclose(np.array([*normal, distance]) * np.sign(normal[0]), [*MIRROR, 0.4], atol=1e-9)


def test_a_bundle_with_constraints_ends_where_scipy_does():
    made = shot("orbit", 12, 4)
    length = float(np.linalg.norm(made.truth.points[0] - made.truth.points[1]))
    constraints = [
        Constraint("distance", (0, 1), (1.01 * length,), 0.01),
        Constraint("plane", (2, 3, 4, 5), (), 0.1),
        *(Constraint("survey", (k,), tuple(made.truth.points[k] + 0.01), 0.02) for k in (6, 7, 8)),
    ]
    pull = Pull(constraints, 12, 10.0)
    ours = adjust(made.truth, made.observations, Free(pull=pull), iterations=60, tolerance=1e-14)
    def state(x):
        turn = Rotation.from_rotvec(x[:12].reshape(4, 3)).as_matrix() @ made.truth.rotation
        return made.truth._replace(
            rotation=turn, translation=made.truth.translation + x[12:24].reshape(4, 3),
            points=made.truth.points + x[24:].reshape(12, 3),
        )

    def error(x):
        now = state(x)
        rows = [pull._whitened(one, now.points).residual for one in pull.constraints]
        return np.concatenate([residuals(now, made.observations).ravel(), *rows])

    theirs = least_squares(error, np.zeros(60), xtol=1e-15, ftol=1e-15, gtol=1e-15, x_scale="jac")
    assert ours.cost == pytest.approx(2 * theirs.cost, rel=1e-6)


def test_what_is_hard_is_held_and_the_scene_gets_its_size_from_it():
    made = shot("planar", 20, 6)
    small = made.truth._replace(points=0.5 * made.truth.points, translation=0.5 * made.truth.translation)
    length = float(np.linalg.norm(made.truth.points[0] - made.truth.points[1]))
    pull = Pull([Constraint("distance", (0, 1), (length,)), Constraint("plane", (4, 5, 6, 7))], 20, 10.0)
    assert pull.misses(adjust(small, made.observations).state.points).min() > 1e-3
    found = adjust(small, made.observations, Free(pull=pull), iterations=100, tolerance=1e-12).state
    assert pull.misses(found.points).max() < 1e-4
    other = np.linalg.norm(made.truth.points[2] - made.truth.points[3])
    assert np.linalg.norm(found.points[2] - found.points[3]) == pytest.approx(other, rel=0.02)


@pytest.mark.parametrize(
    "wrong",
    [
        Constraint("round", (0,)), Constraint("plane", (0, 1, 2)), Constraint("distance", (0, 1)),
        Constraint("survey", (9,), (0.0, 0, 0)), Constraint("symmetric", (0, 1, 2, 3, 4)),
        Constraint("distance", (0, 1), (float("nan"),)), Constraint("axis", (0, 1), (0.0, 0, 0)),
        Constraint("line", (0, 1, 1)), Constraint("plane", (0, 1, 2, 3), (), -1.0),
    ],
)
def test_a_constraint_that_cannot_be_is_refused(wrong):
    with pytest.raises(UserError, match="constraint"):
        Pull([wrong], 5, 1.0)
