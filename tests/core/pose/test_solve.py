"""Truths: scipy's RBFInterpolator, cardinal weights, and pairs of poses planted to be found."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import RBFInterpolator
from scipy.spatial.transform import Rotation

from core.pose.embedding import coordinates, embed, scales
from core.pose.kernels import inverse_squares, kernel
from core.pose.pose import Pose
from core.pose.pose_space import Dof, PoseSample, PoseSpace
from core.pose.refusal import Refusal
from core.pose.solve import solve, weights, weights_at
from tests.core.pose.arms import arm, turned

SCIPY = {
    "gaussian": ("gaussian", 2**-0.5, -1), "multiquadric": ("multiquadric", 1.0, -1), "linear": ("linear", 1.0, -1),
    "inverse-multiquadric": ("inverse_multiquadric", 1.0, -1), "thin-plate": ("thin_plate_spline", 1.0, 1),
    "cubic": ("cubic", 1.0, 1),
}
KERNELS = (*SCIPY, "wendland", "shepard")


def random_poses(count, joints=3, seed=0, size=0.8):
    turns = Rotation.from_rotvec(np.random.default_rng(seed).normal(size=(count * joints, 3)) * size)
    q = turns.as_quat().reshape(count, joints, 4)
    return [Pose(name=f"p{k}", rotations={f"j{j}": tuple(q[k, j]) for j in range(joints)}) for k in range(count)]


def space_of(poses, joints=3, **options):
    dofs = options.pop("dofs", tuple(Dof(control=f"j{j}", falloff=(1.0,)) for j in range(joints)))
    return PoseSpace(dofs=dofs, samples=tuple(PoseSample(pose=p) for p in poses), **options)


def numbers_space(places, names="xyzuvw", **options):
    places = np.atleast_2d(places)
    poses = [Pose(name=f"p{k}", numbers=dict(zip(names, map(float, row)))) for k, row in enumerate(places)]
    dofs = tuple(Dof(control=n, kind="number", falloff=(1.0,)) for n in names[: places.shape[1]])
    return space_of(poses, dofs=dofs, **options)


@pytest.mark.parametrize("name", SCIPY)
def test_weights_are_scipys(name):
    space = space_of(random_poses(24), kernel=name)
    solved = solve(space)
    theirs, epsilon, degree = SCIPY[name]
    centres = solved.centres * scales(space.dofs)
    oracle = RBFInterpolator(centres, np.eye(25), kernel=theirs, epsilon=epsilon, degree=degree)
    for pose in random_poses(40, seed=1, size=1.5):
        truth = oracle(coordinates(pose, space)[None])[0, 1:]
        assert np.abs(weights(solved, pose) - truth).max() <= 1e-10


@pytest.mark.parametrize("name", ["gaussian", "multiquadric", "linear", "inverse-multiquadric"])
def test_with_an_affine_part_they_are_scipys_too(name):
    space = numbers_space(np.random.default_rng(4).normal(size=(20, 3)), kernel=name, affine=True)
    solved = solve(space)
    theirs, epsilon, _ = SCIPY[name]
    oracle = RBFInterpolator(solved.centres, np.eye(21), kernel=theirs, epsilon=epsilon, degree=1)
    at = np.random.default_rng(5).normal(size=(30, 3)) * 3
    assert np.abs(weights_at(solved, at) - oracle(at)).max() <= 1e-10


def test_wendland_is_that_of_the_book_in_three_dimensions_and_positive_in_many():
    r = np.linspace(0, 4, 50)
    truth = np.clip(1 - r / 3, 0, None) ** 4 * (4 * r / 3 + 1)
    assert np.allclose(kernel("wendland", 3)(r * r), truth)
    for dimensions in (1, 3, 5, 10, 20):
        x = np.random.default_rng(dimensions).normal(size=(80, dimensions))
        squared = ((x[:, None] - x[None]) ** 2).sum(axis=2)
        assert np.linalg.eigvalsh(kernel("wendland", dimensions)(squared))[0] > 0


@pytest.mark.parametrize("name", KERNELS)
@pytest.mark.parametrize("options", [
    {}, {"normalise": "above-one"}, {"normalise": "always"}, {"clamp": True}, {"affine": True}, {"table": 1000}])
def test_at_every_pose_its_weight_is_one_and_the_others_are_none(name, options):
    poses = random_poses(20)
    solved = solve(space_of(poses, kernel=name, **options))
    for k, pose in enumerate(poses):
        assert np.abs(weights(solved, pose) - np.eye(20)[k]).max() <= 1e-9
    assert np.abs(weights(solved, Pose())).max() <= 1e-9
    assert solved.loss.max() <= 1e-9


def test_falloffs_of_their_own_are_exact_too_and_reach_as_told():
    poses = random_poses(8)
    samples = tuple(PoseSample(pose=p, falloffs={"j0": (0.6 + 0.1 * k, 1.0, 0.8)}) for k, p in enumerate(poses))
    solved = solve(space_of(poses).replace(samples=samples))
    for k, pose in enumerate(poses):
        assert np.abs(weights(solved, pose) - np.eye(8)[k]).max() <= 1e-10
    one = numbers_space([[5.0]])
    near = [weights(solve(one.replace(samples=(one.samples[0].replace(falloffs={"x": (f,)}),))),
                    Pose(numbers={"x": 6.0}))[0] for f in (0.5, 1.0, 2.0)]
    assert near[0] < near[1] < near[2]
    assert np.isclose(near[1], np.exp(-0.5), atol=1e-5)


def test_what_normalising_and_clamping_do():
    space = numbers_space([[1.0], [2.0]])
    far = Pose(numbers={"x": 9.0})
    assert weights(solve(space), far).max() < 1e-9
    assert np.isclose(weights(solve(space.replace(clamp=True)), far)[1], 1.0)
    wide = space.replace(kernel="multiquadric", normalise="above-one")
    for x in np.linspace(-5, 5, 50):
        assert weights_at(solve(wide), np.array([[x]])).sum() <= 1 + 1e-9
        always = weights_at(solve(wide.replace(normalise="always")), np.array([[x]]))
        assert np.isclose(np.abs(always).sum(), 1.0)


def test_shepard_stays_within_and_is_smooth_at_its_poses():
    squared = np.array([[0.0, 1.0, 4.0], [1.0, 1.0, 2.0]])
    found = inverse_squares(squared)
    assert np.allclose(found, [[1, 0, 0], [0.4, 0.4, 0.2]])


def test_smoothing_tells_its_loss():
    space = space_of(random_poses(12), smoothing=0.1)
    solved = solve(space)
    own = [weights(solved, s.pose)[k] for k, s in enumerate(space.samples)]
    assert solved.loss.min() > 1e-3
    assert np.all(1 - np.array(own) <= solved.loss[1:] + 1e-12)


def test_nothing_of_the_root_and_of_joints_not_picked_is_felt():
    rig, _ = arm()
    space = PoseSpace(dofs=(Dof(control="fore"),), samples=(PoseSample(pose=turned("a", fore=(0, 0, 90))),))
    solved = solve(space)
    truth = weights(solved, turned("p", fore=(5, 10, 60)))
    moved = turned("p", fore=(5, 10, 60), root=(10, 170, 80), hand=(0, 9, 0))
    moved = moved.replace(translations={"root": (5.0, 100.0, -3.0)})
    assert np.abs(weights(solved, moved) - truth).max() <= 1e-12
    assert rig.skeleton.names[0] == "root"


def test_order_of_the_samples_does_not_matter():
    poses = random_poses(15)
    at = random_poses(1, seed=9)[0]
    order = np.random.default_rng(0).permutation(15)
    for name in KERNELS:
        straight = weights(solve(space_of(poses, kernel=name)), at)
        mixed = weights(solve(space_of([poses[i] for i in order], kernel=name)), at)
        assert np.abs(mixed - straight[order]).max() <= 1e-11


@given(st.sampled_from(KERNELS), st.integers(0, 9), st.sampled_from([0.0, 1e-9, 1e-10]), st.integers(0, 1000),
       st.booleans())
@settings(max_examples=120, deadline=None)
def test_twins_are_refused_by_name(name, k, apart, seed, turn):
    poses = random_poses(10, seed=seed)
    twin = (Rotation.from_quat(poses[k].rotations["j1"]) * Rotation.from_rotvec([apart, 0, 0])).as_quat()
    sign = -1 if turn else 1
    poses.append(Pose(name="twin", rotations={**poses[k].rotations, "j1": tuple(sign * twin)}))
    with pytest.raises(Refusal) as refused:
        solve(space_of(poses, kernel=name))
    assert refused.value.poses == (f"p{k}", "twin")
    assert refused.value.reason in ("duplicate", "near-duplicate")
    assert "'twin'" in str(refused.value)
    for word in ("merge", "delete", "move"):
        assert word in str(refused.value)


def test_the_smallest_singular_vector_names_the_same_pair():
    """The pair is far enough apart to pass for two, and near enough for the matrix to be lost."""
    places = np.random.default_rng(1).uniform(-4, 4, size=(12, 2))
    places[7] = places[3] + 3e-6
    with pytest.raises(Refusal) as refused:
        solve(numbers_space(places))
    assert refused.value.reason == "singular"
    assert refused.value.poses == ("p3", "p7")


def test_a_pose_at_rest_and_falloffs_without_end_are_refused():
    with pytest.raises(Refusal) as refused:
        solve(numbers_space([[1.0, 0.0], [0.0, 0.0]]))
    assert refused.value.poses == ("rest", "p1")
    wide = numbers_space(np.arange(1.0, 12.0)[:, None])
    wide = wide.replace(dofs=(wide.dofs[0].replace(falloff=(500.0,)),))
    with pytest.raises(Refusal, match="narrow") as refused:
        solve(wide)
    assert refused.value.reason == "singular"


@given(st.integers(0, 10_000), st.integers(2, 4), st.sampled_from(["thin-plate", "cubic"]), st.booleans())
@settings(max_examples=80, deadline=None)
def test_poses_in_a_plane_are_refused_and_unused_axes_are_not(seed, dimensions, name, oblique):
    rng = np.random.default_rng(seed)
    flat = rng.normal(size=(dimensions + 4, dimensions))
    if not oblique:  # one control is never used: that is no fault
        flat[:, -1] = 0.0
        solve(numbers_space(flat, kernel=name))
        return
    flat[:, -1] = flat[:, :-1] @ rng.uniform(0.5, 1.5, dimensions - 1)
    with pytest.raises(Refusal) as refused:
        solve(numbers_space(flat, kernel=name))
    assert refused.value.reason == "coplanar"
    assert set(refused.value.poses) == {"rest", *(f"p{k}" for k in range(len(flat)))}


@pytest.mark.parametrize("name", KERNELS)
@pytest.mark.parametrize("apart", [1e-3, 0.5, 1.0, 1.0 + 1e-12, 2.0, 50.0])
def test_a_single_pose_however_far(name, apart):
    """At a distance of 1 the thin plate is 0, everywhere between two poses."""
    solved = solve(numbers_space([[apart]], kernel=name))
    found = weights_at(solved, np.array([[0.0], [apart], [0.5 * apart]]))[:, 1]
    assert np.allclose(found[:2], [0.0, 1.0], atol=1e-9)
    assert 0.0 <= found[2] < 1.0


def test_a_hinge_is_not_a_plane():
    for axis in ((0, 0, 1), (0.3, 0.2, 0.9), (1, 0, 0)):
        hinge = [Pose(name=str(t), rotations={"j0": tuple(
            Rotation.from_rotvec(np.radians(t) * np.array(axis) / np.linalg.norm(axis)).as_quat())})
            for t in (20, 45, 70, 95, 120)]
        for count in (1, 2, 5):
            solved = solve(space_of(hinge[:count], joints=1, kernel="thin-plate"))
            assert np.abs(weights(solved, hinge[0])[0] - 1) <= 1e-9


@given(st.integers(0, 10_000))
@settings(max_examples=60, deadline=None)
def test_falloffs_that_turn_the_system_over_are_refused(seed):
    """Where the determinant is negative the system has passed through a singular one; and only there, or worse."""
    rng = np.random.default_rng(seed)
    places = rng.uniform(-1, 1, size=(4, 2))
    space = numbers_space(places)
    falloffs = np.exp(rng.uniform(-1.5, 2.5, size=(4, 2)))
    samples = tuple(s.replace(falloffs={"x": (float(f[0]),), "y": (float(f[1]),)})
                    for s, f in zip(space.samples, falloffs))
    centres = np.vstack([np.zeros(2), places])
    each = 1.0 / np.vstack([np.ones(2), falloffs])
    matrix = np.exp(-0.5 * (((centres[:, None] - centres[None]) * each[None]) ** 2).sum(axis=2))
    solved, refused = attempt(space.replace(samples=samples))
    if refused is None:
        assert np.linalg.det(matrix) > 0
        assert np.abs(weights_at(solved, centres) - np.eye(5)).max() <= 1e-6
    else:
        values = np.linalg.eigvals(matrix)
        assert values[np.abs(values.imag) < 1e-9].real.min() <= 1e-9
        assert refused.poses
        assert refused.reason in ("unsymmetric", "singular")


def attempt(space):
    try:
        return solve(space), None
    except Refusal as refused:
        return None, refused


def test_a_known_unsymmetric_system_names_its_poses():
    rng = np.random.default_rng(0)
    seen = 0
    for _ in range(300):
        places, falloffs = rng.uniform(-1, 1, (4, 1)), np.exp(rng.uniform(-1.5, 2.5, 4))
        far = numbers_space([*places, [100.0], [200.0]])
        samples = tuple(s.replace(falloffs={"x": (float(f),)}) for s, f in zip(far.samples, (*falloffs, 1.0, 1.0)))
        _, refused = attempt(far.replace(samples=samples))
        if refused is not None:
            seen += refused.reason == "unsymmetric"
            assert not {"p4", "p5"} & set(refused.poses)  # those far off have nothing to do with it
    assert seen > 10


def test_a_subset_is_solved_by_itself():
    poses = random_poses(10)
    known = np.arange(10) % 2 == 0
    part, alone = solve(space_of(poses), known), solve(space_of([p for p, k in zip(poses, known) if k]))
    at = embed(part.dofs, random_poses(3, seed=3))
    assert np.array_equal(weights_at(part, at), weights_at(alone, at))


def test_through_half_a_turn_of_swing_the_weights_step_little():
    """Printed, and bounded by what the coordinates do."""
    poses = [turned(f"p{k}", j0=d) for k, d in enumerate([(0, 90, 0), (40, 150, 0), (0, 170, 60), (0, -150, 20)])]
    solved = solve(space_of(poses, joints=1))
    sweep = [turned("s", j0=(10, t, 1)) for t in np.linspace(150, 210, 3001)]
    steps = np.abs(np.diff([weights(solved, p) for p in sweep], axis=0)).max()
    print(f"largest step of a weight in 0.02 degrees of swing through 180: {steps:.2e}")
    assert steps < 0.01
