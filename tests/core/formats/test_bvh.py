"""BVH against scipy's Euler angles and against files that are wrong."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from core.errors import UserError
from core.formats.rig_file import read_rig
from core.pose.clip import clip_of_matrices, local_matrices, numbers_at, onto_skeleton, rate_of, resampled
from core.pose.skinning import object_matrices

GOOD = """HIERARCHY
ROOT Hips
{
  OFFSET 1 2 3
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Left Leg {
    OFFSET 0 -4 0
    CHANNELS 3 Yrotation Zrotation Xrotation
    End Site
    { OFFSET 0 -3 0 }
  }
  JOINT Spine
  {
    OFFSET 0 5 0
    CHANNELS 1 Xrotation
  }
}
MOTION
Frames:    2
Frame Time: 0.0333333
0 10 0  10 20 30  5 15 25  40
1 11 2 -80 70 33  9 8 7 -170
"""


def written(tmp_path, text, name="walk.bvh"):
    path = tmp_path / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def test_any_order_of_channels_in_degrees(tmp_path):
    found = read_rig(written(tmp_path, GOOD), unit="cm")
    skeleton, clip = found.rig.skeleton, found.clips[0]
    assert found.mesh is None
    assert skeleton.names == ("Hips", "Left Leg", "Spine")
    assert skeleton.parents.tolist() == [-1, 0, 0]
    assert (clip.name, clip.start, clip.end, clip.frames_per_second) == ("walk", 1.0, 2.0, 30.0)
    for frame, rows in ((1, [[10, 20, 30], [5, 15, 25], 40]), (2, [[-80, 70, 33], [9, 8, 7], -170])):
        local = local_matrices(clip, frame)
        for j, (order, angles) in enumerate(zip(("ZXY", "YZX", "X"), rows)):
            truth = Rotation.from_euler(order, angles, degrees=True).as_matrix()
            assert np.allclose(local[j, :3, :3], truth, atol=1e-6)
    assert np.allclose(local_matrices(clip, 2)[:, :3, 3], np.array([[1, 11, 2], [0, -4, 0], [0, 5, 0]]) * 0.01)
    assert np.allclose(object_matrices(skeleton, skeleton.rest)[1, :3, 3], [0.01, -0.02, 0.03])


@pytest.mark.parametrize(("change", "said"), [
    (lambda t: t[:300], "cut short|not a BVH|frames"),
    (lambda t: t.replace("Frames:    2", "Frames: 3"), "numbers where 3 frames"),
    (lambda t: t.replace("Frames:    2", "Frames: 999999999999"), "numbers where"),
    (lambda t: t.replace("Frames:    2", "Frames: -2"), "numbers where"),
    (lambda t: t.replace("0.0333333", "0"), "makes no sense"),
    (lambda t: t.replace("0.0333333", "nan"), "makes no sense"),
    (lambda t: t.replace("-170", "much"), "words among"),
    (lambda t: t.replace("Zrotation Xrotation Yrotation", "Zrotation Wrotation Yrotation"), "channels are"),
    (lambda t: t.replace("Zrotation Xrotation Yrotation", "Zrotation Zrotation Yrotation"), "channels are"),
    (lambda t: t.replace("OFFSET 1 2 3", "OFFSET 1 x 3"), "not a number"),
    (lambda t: t.replace("OFFSET 1 2 3", "OFFSET 1 2"), "three numbers"),
    (lambda t: t.replace("}\nMOTION", "MOTION"), "cut short"),
    (lambda t: t.replace("ROOT Hips\n{", "ROOT Hips\n{ GHOST"), "not expected"),
    (lambda t: "HIERARCHY\nMOTION\nFrames: 1\nFrame Time: 1\n", "no joints"),
    (lambda t: "\0" * 500, "not a BVH"),
    (lambda t: "", "empty"),
])
def test_what_is_wrong_is_refused_in_a_sentence(tmp_path, change, said):
    with pytest.raises(UserError, match=said) as error:
        read_rig(written(tmp_path, change(GOOD)))
    assert "walk.bvh" in str(error.value)


def test_bad_numbers_and_names_are_repaired_with_a_word(tmp_path):
    found = read_rig(written(tmp_path, GOOD.replace("Spine", "Hips").replace("5 15 25", "5 nan 1e999")))
    assert found.rig.skeleton.names == ("Hips", "Left Leg", "Hips_2")
    assert any("used twice" in note for note in found.notes)
    assert any("not finite" in note for note in found.notes)
    assert np.allclose(local_matrices(found.clips[0], 1)[1], found.rig.skeleton.rest[1])


def test_deep_hierarchies_take_no_recursion(tmp_path):
    deep = 3000
    text = "HIERARCHY\n" + "".join(
        f"{'ROOT' if i == 0 else 'JOINT'} j{i}\n{{\nOFFSET 0 1 0\nCHANNELS 1 Xrotation\n" for i in range(deep)
    ) + "}\n" * deep + "MOTION\nFrames: 1\nFrame Time: .01\n" + "0 " * deep
    assert len(read_rig(written(tmp_path, text)).rig.skeleton.names) == deep


def test_another_frame_rate_has_the_same_motion(tmp_path):
    clip = read_rig(written(tmp_path, GOOD)).clips[0]
    fine = resampled(clip, 120.0, start=1001.0)
    assert (fine.start, fine.end, fine.frames_per_second) == (1001.0, 1005.0, 120.0)
    for step in range(5):
        assert np.allclose(local_matrices(fine, 1001 + step), local_matrices(clip, 1 + step / 4), atol=1e-5)
    back = resampled(fine, 30.0, start=1.0)
    assert np.allclose(back.rotations, clip.rotations, atol=1e-6)
    with pytest.raises(UserError, match="too long"):
        resampled(clip.replace(frames_per_second=0.001), 1e6)


def test_usual_rates_are_found_in_seconds():
    assert rate_of(np.arange(20) / 24) == 24.0
    assert rate_of(np.float32(np.arange(20) / 30)) == 30.0
    assert rate_of([0.0, 0.0077]) == 24.0


def test_a_clip_moves_joints_of_the_same_names(tmp_path):
    walk = read_rig(written(tmp_path, GOOD))
    turn = np.eye(4)
    turn[:3, :3] = Rotation.from_euler("Y", 90, degrees=True).as_matrix()
    target = walk.rig.skeleton.replace(
        names=("Spine", "Hips", "Other"), parents=np.array([-1, 0, 1], np.int32), rest=np.stack([turn, turn, turn]))
    moved = onto_skeleton(walk.clips[0], walk.rig.skeleton, target)
    local, source = local_matrices(moved, 2), local_matrices(walk.clips[0], 2)
    assert np.allclose(local[0, :3, :3], turn[:3, :3] @ source[2, :3, :3], atol=1e-6)
    assert np.allclose(local[1, :3, :3], turn[:3, :3] @ source[0, :3, :3], atol=1e-6)
    assert np.allclose(local[2], turn)
    with pytest.raises(UserError, match="none of the joints"):
        onto_skeleton(walk.clips[0], walk.rig.skeleton, target.replace(names=("x", "y", "z")))


def test_matrices_and_numbers_come_back_from_a_clip():
    rng = np.random.default_rng(1)
    matrices = np.tile(np.eye(4), (3, 2, 1, 1))
    matrices[..., :3, :3] = Rotation.random(6, random_state=4).as_matrix().reshape(3, 2, 3, 3) * [2.0, -0.5, 1.0]
    matrices[..., :3, 3] = rng.normal(size=(3, 2, 3))
    clip = clip_of_matrices("all", 5, 24, matrices, ("smile",), [[0.0], [1.0], [0.5]])
    for f in range(3):
        assert np.allclose(local_matrices(clip, 5 + f), matrices[f], atol=1e-5)
    assert numbers_at(clip, 5.5)["smile"] == pytest.approx(0.5)
    assert numbers_at(clip, 99)["smile"] == pytest.approx(0.5)
