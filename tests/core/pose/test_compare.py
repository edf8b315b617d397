"""One rig by several methods: each is what its name says, and the switch loses nothing."""

import numpy as np
import pytest

from core.pose.compare import METHODS, compared
from core.pose.layers import Sculpt, build
from core.pose.synthesis import evaluate
from tests.core.pose.arms import arm, bumped, skinned_at, turned

BENT, FOLDED, RAISED = turned("bent", fore=(0, 0, 50)), turned("folded", fore=(0, 0, 100)), turned(
    "raised", upper=(0, 70, 0))


def sculpted():
    rig, points = arm()
    sculpts = [Sculpt(p, bumped(rig, points, p, seed)) for seed, p in enumerate((BENT, FOLDED, RAISED))]
    return rig, points, sculpts, build(points, rig, sculpts).correctives


def test_skin_only_is_the_skin():
    rig, points, _, made = sculpted()
    assert compared(points, rig, made, "skin") is None
    assert np.array_equal(evaluate(points, rig, None, BENT), skinned_at(rig, points, BENT))


@pytest.mark.parametrize("method", ["interpolation", "pose-space", "weighted"])
def test_these_meet_every_sculpt(method):
    rig, points, sculpts, made = sculpted()
    other = compared(points, rig, made, method)
    for sculpt in sculpts:
        assert np.abs(evaluate(points, rig, other, sculpt.pose) - sculpt.target).max() <= 2e-6


def test_shape_interpolation_goes_in_straight_lines_and_shrinks():
    """Between two shapes the surface is their mean, whatever the joints would do: so an arm loses its length."""
    rig, points, sculpts, made = sculpted()
    other = compared(points, rig, made, "interpolation")
    halfway = evaluate(points, rig, other, turned("between", fore=(0, 0, 25)))
    ways = np.stack([(s.target - points).ravel() for s in sculpts[:2]], axis=1).astype(np.float64)
    part, _, _, _ = np.linalg.lstsq(ways, (halfway - points).ravel().astype(np.float64), rcond=None)
    assert np.abs(points + (ways @ part).reshape(points.shape) - halfway).max() < 1e-6
    assert 0.4 < part[0] < 0.6
    assert abs(part[1]) < 0.1
    tip = np.argmax(points[:, 0])
    elbow = np.array([0.4, 0.0, 0.0])
    assert np.linalg.norm(halfway[tip] - elbow) < 0.97 * np.linalg.norm(points[tip] - elbow)


def test_shape_interpolation_is_carried_along_by_other_joints():
    rig, points, sculpts, made = sculpted()
    other = compared(points, rig, made, "interpolation")
    moved = turned("moved", root=(0, 90, 0), fore=(0, 0, 50))
    carried = skinned_at(rig, points, turned("root", root=(0, 90, 0)))
    far = evaluate(points, rig, other, moved)
    assert np.linalg.norm(np.ptp(far, axis=0)) > 0.0
    assert np.abs(far - sculpts[0].target).max() > 0.1  # it went along
    still = points[:, 0] < 0.02
    assert np.abs(far - carried)[still].max() < 0.02


def test_every_method_can_be_switched_to_and_back():
    rig, points, _, made = sculpted()
    for method in METHODS[1:]:
        back = compared(points, rig, compared(points, rig, made, method), "pose-space")
        for pose in (BENT, FOLDED, turned("new", fore=(0, 0, 70), upper=(0, 20, 0))):
            assert np.abs(evaluate(points, rig, back, pose) - evaluate(points, rig, made, pose)).max() < 1e-5
