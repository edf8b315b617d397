"""A skin that comes near: feathers draw in before it, by as much as it came, and no more."""

import numpy as np

from core.evaluator import Evaluator
from core.feather.coat.nearing import AT_EASE, SOFT, clearances, drawn_from_skin
from core.mesh.mesh import Mesh
from core.mesh.skin import skin_at_rest

# one vane, a metre long, straight up from the root at 5 cm above the ground
VANE = np.zeros((1, 9, 3, 3), np.float32)
VANE[0, :, :, 1] = np.linspace(0.0, 1.0, 9)[:, None]
VANE[0, :, :, 0] = np.array([-0.1, 0.0, 0.1])


def ground(slope: float = 0.0):
    """A floor below the vane, whose far end rises by `slope` a metre from half the vane's length on."""
    points = np.array(
        [[x, y, -0.2 + slope * max(y - 0.5, 0.0)] for y in (-2.0, 0.5, 4.0) for x in (-3.0, 3.0)], np.float32)
    corners = np.array([0, 1, 3, 2, 2, 3, 5, 4], np.int32)
    return Mesh(
        points=points, counts=np.array([4, 4], np.int32), corners=corners, uvs=None,
        parts=np.zeros(2, np.int32), part_names=("ground",))


def clear(slope: float = 0.0):
    evaluator = Evaluator()
    found = clearances(VANE, np.ones(1), skin_at_rest(ground(slope), evaluator), evaluator.workers)
    evaluator.close()
    return found


def test_a_clearance_is_the_distance_to_the_skin_and_below_zero_inside():
    np.testing.assert_allclose(clear(), 0.2, atol=1e-6)
    rising = clear(0.8)
    assert rising[0, -1].max() < 0.0 < rising[0, 0].min()


def test_a_feather_stays_as_long_as_it_was_while_nothing_comes_near():
    rest = clear()
    assert drawn_from_skin(VANE, rest, rest)[0] == 1.0
    assert abs(drawn_from_skin(VANE, rest, rest * AT_EASE)[0] - 1.0) < 1e-6


def test_a_feather_ends_before_the_skin_that_comes_and_draws_in_without_a_jump():
    rest = clear()
    slopes = np.linspace(0.0, 1.6, 321)
    factors = np.array([drawn_from_skin(VANE, rest, clear(slope))[0] for slope in slopes])
    assert factors[0] == 1.0
    assert (np.diff(factors) <= 1e-6).all()
    assert np.abs(np.diff(factors)).max() < 0.02
    # where the rise passes through the vane by the softness, nothing is left of it beyond
    steepest = 0.5 + (0.2 + SOFT) / slopes[-1]
    assert factors[-1] <= steepest + 1.0 / 16.0


def test_what_lay_in_the_skin_at_rest_says_nothing():
    rest, now = clear(), clear(1.6)
    assert drawn_from_skin(VANE, -rest, now)[0] == 1.0
