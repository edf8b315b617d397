"""The map of pose space against closed forms: ellipses of numbers, angles of swings, distances of flat points."""

from __future__ import annotations

import math

import numpy as np
import pytest

from core.pose.embedding import embed
from core.pose.pose import REST, Pose
from core.pose.pose_map import (
    Axis,
    at,
    axes_of,
    coordinate,
    embed_plane,
    falloff_ring,
    mixed_pose,
    placed_among,
    places,
    scaling,
    shares_near,
    spread_out,
    weight_grid,
)
from core.pose.pose_space import Dof, PoseSample, PoseSpace
from core.pose.rotation import quaternion_from_euler
from core.pose.solve import solve, weights

AXES = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0))


def numbers(**values: float) -> Pose:
    return Pose(name=str(sorted(values.items())), numbers=values)


def dial() -> PoseSpace:
    samples = [PoseSample(pose=numbers(joy=1.0, calm=0.0)), PoseSample(pose=numbers(joy=0.0, calm=2.0))]
    samples[1] = samples[1].replace(falloffs={"joy": (0.25,)})
    return PoseSpace(
        dofs=(Dof(control="joy", kind="number", falloff=(0.5,)), Dof(control="calm", kind="number", falloff=(1.5,))),
        samples=tuple(samples))


def elbow() -> PoseSpace:
    dof = Dof(control="elbow", axis=AXES[0], side=AXES[1], falloff=(0.7,))
    turns = [quaternion_from_euler(d).tolist() for d in ((0, 80, 10), (50, 0, 0))]
    return PoseSpace(
        dofs=(dof, Dof(control="dial", kind="number", falloff=(1.0,))),
        samples=tuple(PoseSample(pose=Pose(name=f"p{k}", rotations={"elbow": tuple(q)}))
                      for k, q in enumerate(turns)))


def test_the_rim_of_two_numbers_is_the_ellipse_of_the_falloffs() -> None:
    space = dial()
    axes = tuple(Axis(dof, "number") for dof in space.dofs)
    for sample, middle, halves in (
        (0, (1.0, 0.0), (0.5, 1.5)), (1, (0.0, 2.0), (0.25, 1.5)), (None, (0, 0), (0.5, 1.5)),
    ):
        rim = (falloff_ring(space, sample, axes) - middle) / halves
        assert np.abs(np.linalg.norm(rim, axis=1) - 1.0).max() < 1e-7


def test_the_rim_of_a_swing_round_rest_is_the_circle_of_its_angle() -> None:
    dof = Dof(control="elbow", kind="swing", axis=AXES[0], side=AXES[1], falloff=(0.7,))
    space = PoseSpace(dofs=(dof,))
    rim = falloff_ring(space, None, (Axis(dof, "lean"), Axis(dof, "lean across")))
    # with one falloff for both sides the distance is the chord, so that one falloff away is the angle itself
    assert np.abs(np.linalg.norm(rim, axis=1) - 0.7).max() < 1e-6


def test_axes_come_by_how_far_the_poses_go_and_equal_ones_as_the_rig_has_them() -> None:
    dofs = tuple(Dof(control=name, kind="number", falloff=(1.0,)) for name in ("arousal", "lid", "valence"))
    space = PoseSpace(dofs=dofs, samples=(PoseSample(pose=numbers(arousal=1.0, valence=-1.0, lid=3.0)),))
    assert [axis.name for axis in axes_of(space)] == ["lid", "arousal", "valence"]
    assert [axis.name for axis in axes_of(space, ("valence", "arousal"))] == ["lid", "valence", "arousal"]


@pytest.mark.parametrize("place", [(0.3, -0.4), (2.0, 1.0), (0.0, 0.0), (-1.2, 0.0)])
def test_a_pose_put_at_a_place_is_found_there(place: tuple[float, float]) -> None:
    space = elbow()
    axes = Axis(space.dofs[0], "lean"), Axis(space.dofs[0], "lean across")
    twisted = Pose(rotations={"elbow": tuple(quaternion_from_euler((0, 0, 40)).tolist())})
    pose = at(axes, twisted, place)
    assert places(axes, [pose])[0] == pytest.approx(place, abs=1e-9)
    assert coordinate(Axis(space.dofs[0], "twist"), pose) == pytest.approx(math.radians(40), abs=1e-9)


def test_many_places_at_once_are_what_one_by_one_are() -> None:
    space = elbow()
    plane = np.random.default_rng(1).uniform(-1.5, 1.5, (20, 2))
    base = space.samples[1].pose.replace(numbers={"dial": 0.3})
    for axes in (
        (Axis(space.dofs[0], "lean"), Axis(space.dofs[0], "twist")),
        (Axis(space.dofs[1], "number"), Axis(space.dofs[0], "lean across")),
    ):
        one_by_one = embed(space.dofs, [at(axes, base, place) for place in plane])
        assert np.abs(embed_plane(space.dofs, axes, base, plane) - one_by_one).max() < 1e-12


def test_the_painted_weights_are_those_of_the_space() -> None:
    space = elbow()
    axes = axes_of(space)[:2]
    xs, ys = np.linspace(-1, 1, 4), np.linspace(-1, 1, 3)
    grid = weight_grid(space, (axes[0], axes[1]), REST, xs, ys)
    assert grid.shape == (3, 4, 2)
    pose = at((axes[0], axes[1]), REST, (xs[3], ys[1]))
    assert grid[1, 3] == pytest.approx(weights(solve(space), pose), abs=1e-6)


def test_points_of_a_plane_come_back_with_their_distances() -> None:
    flat = np.random.default_rng(3).normal(size=(7, 2))
    distances = np.linalg.norm(flat[:, None] - flat[None], axis=2)
    found = scaling(distances)
    assert np.abs(np.linalg.norm(found[:, None] - found[None], axis=2) - distances).max() < 1e-12


def test_a_sample_is_placed_where_the_map_has_it() -> None:
    space = dial().replace(samples=tuple(s.replace(falloffs={}) for s in dial().samples))
    spread = spread_out(space)
    for k, pose in enumerate([REST, *(s.pose for s in space.samples)]):
        assert placed_among(space, spread, pose) == pytest.approx(spread[k], abs=1e-9)
    assert placed_among(space, spread, numbers(joy=0.5, calm=1.0)) == pytest.approx(spread[1:].mean(axis=0), abs=1e-9)


def test_shares_are_one_alone_at_a_pose_and_mix_half_way() -> None:
    spread = np.array([[0.0, 0.0], [2.0, 0.0]])
    assert shares_near(spread, (2.0, 0.0)).tolist() == [0.0, 1.0]
    turned = Pose(rotations={"elbow": tuple(quaternion_from_euler((80, 0, 0)).tolist())}, numbers={"dial": 1.0})
    half = mixed_pose((REST, turned), shares_near(spread, (1.0, 3.0)))
    assert half.rotations["elbow"] == pytest.approx(quaternion_from_euler((40, 0, 0)), abs=1e-12)
    assert half.numbers["dial"] == pytest.approx(0.5)
