"""A neck of three joints between a body and a head that were tracked."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.errors import UserError
from core.match.fit_rig import Anchors, Parameter, fit
from core.match.rig_places import posed, rig_parameter, rig_places
from core.match.solve.state import Observations, State, projected, start_lens
from core.pose.pose import REST, Pose, local_of_pose
from core.pose.rig import Constraint, Rig
from core.pose.skeleton import Skeleton, SkinWeights
from core.pose.skinning import object_matrices

FRAMES, FOCAL, SIZE = 6, 1600.0, (1920, 1080)
JOINTS = ("body", "low", "middle", "high")
BONE = 0.05  # metres
NAMES = tuple(f"{joint}.{axis}" for joint in JOINTS[1:] for axis in ("rx", "ry", "rz"))


def _rig() -> tuple[Rig, np.ndarray]:
    """A column of three bones, skin around them: vertices in rings, each bound to two joints."""
    rest = np.tile(np.eye(4), (4, 1, 1))
    rest[1:, 1, 3] = BONE
    skeleton = Skeleton(
        names=JOINTS, parents=np.array([-1, 0, 1, 2], np.int32), rest=rest,
        bind=object_matrices(Skeleton(
            names=JOINTS, parents=np.array([-1, 0, 1, 2], np.int32), rest=rest, bind=rest), rest),
    )
    points, joints, weights = [], [], []
    for ring, height in enumerate((0.06, 0.085, 0.11, 0.135, 0.16, 0.20)):
        for angle in np.linspace(0, 2 * np.pi, 8, endpoint=False):
            points.append([0.06 * np.cos(angle), height, 0.06 * np.sin(angle)])
            place = np.clip(height / BONE, 1, 3.99)
            low = int(place)
            share = 0.0 if ring == 5 else max(0.0, place - low - 0.5)
            joints.append([low, min(low + 1, 3)])
            weights.append([1 - share, share])
    skin = SkinWeights(joints=np.array(joints, np.int32), weights=np.array(weights, np.float32))
    limit = Constraint(joint="middle", kind="limit", low=(-0.6, -0.6, -0.6), high=(0.6, 0.6, 0.6))
    return Rig(skeleton=skeleton, skin=skin, constraints=(limit,)), np.array(points, np.float32)


def _camera() -> State:
    turn = np.tile(np.diag([1.0, -1.0, -1.0]), (FRAMES, 1, 1))
    shift = np.tile([0.0, 0.12, 0.6], (FRAMES, 1))
    return State(turn, shift, np.zeros((0, 3)), np.zeros(FRAMES), start_lens(FOCAL, *SIZE))


def _true(seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 1, FRAMES)[:, None]
    return 0.3 * np.sin(3 * t + rng.uniform(0, 6, 9)) * rng.uniform(0.3, 1, 9)


def _world() -> np.ndarray:
    turn = Rotation.from_euler("y", np.linspace(-0.3, 0.3, FRAMES)[:, None]).as_matrix()
    out = np.tile(np.eye(4), (FRAMES, 1, 1))
    out[:, :3, :3], out[:, 0, 3] = turn, 0.02 * np.arange(FRAMES)
    return out


# twelve tracks on the side of the neck that the camera sees: rows of vertices
SEEN = np.array([8 * ring + k for ring, ks in enumerate(((1, 3), (2, 1, 3), (2, 1), (3, 1), (2, 1, 3))) for k in ks])


def _seen(places, truth, camera, rng, noise):
    frame, track = (a.ravel() for a in np.meshgrid(np.arange(FRAMES), np.arange(12), indexing="ij"))
    there = np.stack([places(f, truth[f]) for f in range(FRAMES)])
    xy = projected(camera, frame, there[frame, track])[0] + rng.normal(0, noise, (len(frame), 2))
    root = np.tile([1.0 / noise, 0.0, 1.0 / noise], (len(frame), 1))
    return Observations(frame.astype(np.int32), track.astype(np.int32), xy, root)


@pytest.mark.parametrize("seed", range(2))
def test_a_neck_of_three_joints_is_found_between_body_and_head(seed):
    rig, points = _rig()
    world, camera, truth = _world(), _camera(), _true(seed)
    rng = np.random.default_rng(seed)
    head = np.array([40, 42, 45])  # of the last ring, which only the head carries
    vertices = np.concatenate([SEEN, head]).astype(np.int32)
    assert len(SEEN) == 12
    places = rig_places(rig, points, vertices, NAMES, [REST] * FRAMES, world)
    rows = _seen(places, truth, camera, rng, 0.3)
    # the head as its own matchmove has it: three of its points, to a few tenths of a millimetre
    frame = np.repeat(np.arange(FRAMES), 3).astype(np.int32)
    at = np.concatenate([places(f, truth[f])[12:] for f in range(FRAMES)])
    held = Anchors(
        frame, np.tile(np.arange(12, 15), FRAMES).astype(np.int32), at + rng.normal(0, 2e-4, at.shape),
        np.full(len(frame), 2e-4),
    )
    parameters = [rig_parameter(rig, name) for name in NAMES]
    found = fit(parameters, places, camera, rows, held)
    error = found.values - truth
    assert np.degrees(np.sqrt((error**2).mean())) < 0.5
    assert found.noise == pytest.approx(1.0, rel=0.2)
    assert 0.7 < np.sqrt((error**2 / found.sigma**2).mean()) < 1.4
    assert found.rms_px < 0.5
    steady = fit([one._replace(steady=0.05) for one in parameters], places, camera, rows, held)
    assert np.abs(steady.values - truth).mean() < 1.2 * np.abs(error).mean()


def test_what_is_shared_is_one_number_and_limits_hold():
    rig, points = _rig()
    world, camera = _world(), _camera()
    truth = np.zeros((FRAMES, 9))
    truth[:, 2] = 0.2
    truth[:, 5] = np.linspace(-0.8, 0.8, FRAMES)
    places = rig_places(rig, points, SEEN.astype(np.int32), NAMES, [REST] * FRAMES, world)
    rows = _seen(places, truth, camera, np.random.default_rng(0), 0.1)
    names = ("low.rz", "middle.rz")
    lean = rig_places(rig, points, SEEN.astype(np.int32), names, [REST] * FRAMES, world)
    found = fit([rig_parameter(rig, "low.rz", shared=True), rig_parameter(rig, "middle.rz", low=-1, high=1)],
                lean, camera, rows)
    assert np.ptp(found.values[:, 0]) == 0.0
    assert found.values[0, 0] == pytest.approx(0.2, abs=0.01)
    np.testing.assert_allclose(found.values[:, 1], truth[:, 5], atol=0.02)
    within = fit([Parameter("low.rz", shared=True), rig_parameter(rig, "middle.rz")], lean, camera, rows)
    assert within.values[0, 1] == -0.6
    assert within.at_limit[0, 1]
    assert within.sigma[0, 1] == 0.0


def test_a_prior_decides_what_no_track_says():
    rig, points = _rig()
    world, camera = _world(), _camera()
    names = ("body.ty", "high.ry")
    few = rig_places(rig, points, np.array([1, 2, 3], np.int32), names, [REST] * FRAMES, world)  # below the last joint
    frame = np.repeat(np.arange(FRAMES), 3).astype(np.int32)
    track = np.tile(np.arange(3), FRAMES).astype(np.int32)
    there = np.stack([few(f, np.array([0.01, 0.0])) for f in range(FRAMES)])
    rows = Observations(frame, track, projected(camera, frame, there[frame, track])[0], np.tile([1.0, 0, 1], (18, 1)))
    parameters = [Parameter("body.ty"), Parameter("high.ry", rest=0.25)]
    with pytest.raises(UserError, match="moves with high"):
        fit(parameters, few, camera, rows)
    found = fit([parameters[0], parameters[1]._replace(sigma=0.1)], few, camera, rows)
    np.testing.assert_allclose(found.values, np.tile([0.01, 0.25], (FRAMES, 1)), atol=1e-6)


def test_a_pose_keeps_what_is_not_asked_for():
    rig, _ = _rig()
    base = posed(Pose(numbers={"smile": 0.5}), ("low.rx", "low.rz"), np.array([0.1, 0.2]))
    after = posed(base, ("low.ry", "low.tx"), np.array([0.3, 0.01]))
    turn = Rotation.from_matrix(local_of_pose(rig.skeleton, after)[1, :3, :3])
    np.testing.assert_allclose(turn.as_euler("xyz"), [0.1, 0.3, 0.2], atol=1e-9)
    assert after.translations["low"] == (0.01, 0.0, 0.0)
    assert after.numbers == {"smile": 0.5}


@pytest.mark.parametrize("name", ["nobody.rx", "low.qx", "smile"])
def test_a_number_the_rig_does_not_have_is_refused(name):
    with pytest.raises(UserError, match="no number"):
        rig_parameter(_rig()[0], name)
