"""Rigs that are wrong: repaired with a word or refused in a sentence; seams that are welded, and lips that are not."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from core.document import find_mesh
from core.errors import UserError
from core.formats.project import read_project, write_project
from core.formats.rig_assembly import NoRig, assemble
from core.formats.rig_file import document_of, read_rig, rig_info
from core.formats.rig_parts import RawClip, RawRig, RawShape, pack_rig, unpack_rig
from core.mesh.polygons import Polygons
from core.pose.clip import local_matrices
from core.pose.skinning import object_matrices, posed_points

ANIMATION = Path(os.environ.get("FILOPLUME_DATA", "../shared/data")) / "animation"
EYE = np.eye(4)


def square(doubled=True):
    """Two triangles, or two quads when not doubled; doubled ones share no vertex along their common edge."""
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 0], [1, 1, 0], [0, 1, 0]], np.float64)
    corners = np.arange(6)
    if not doubled:
        points, corners = points[[0, 1, 2, 5]], np.array([0, 1, 2, 0, 2, 3])
    return Polygons(points, np.array([3, 3]), corners, None, np.zeros(2, np.int32), ("square",))


def raw(**changes):
    count = len(changes.get("polygons", square()).points) if "polygons" not in changes or changes["polygons"] else 0
    names = changes.get("names", ("root", "tip"))
    n = len(names)
    up = np.tile(EYE, (n, 1, 1))
    up[1:, 1, 3] = 1.0
    values = {
        "polygons": square(), "names": names, "parents": np.arange(n) - 1, "rest": up,
        "bind": object_of(up), "joints": np.tile([0, 1], (count, 1)), "weights": np.full((count, 2), 0.5),
        "metres_per_unit": 1.0, "up": "y",
    }
    return RawRig(**(values | changes))


def object_of(local):
    out = local.copy()
    for j in range(1, len(out)):
        out[j] = out[j - 1] @ out[j]
    return out


def motion(joints=2, frames=3, **changes):
    values = {
        "name": "move", "start": 1.0, "frames_per_second": 24.0, "translations": np.zeros((frames, joints, 3)),
        "rotations": np.tile([0.0, 0, 0, 1], (frames, joints, 1)), "scales": np.ones((frames, joints, 3)),
        "number_names": (), "numbers": np.zeros((frames, 0)),
    }
    return RawClip(**(values | changes))


def made(**changes):
    return assemble(raw(**changes), "rig", None, None)


def test_seams_are_welded_unless_their_sides_move_apart():
    found = made()
    assert len(found.mesh.points) == 4
    assert found.rig.file_vertices.tolist() == [0, 1, 2, 0, 2, 3]
    assert np.array_equal(found.mesh.points[found.rig.file_vertices], square().points)
    assert "welded" in found.notes[0]
    lips = RawShape("open", 1.0, np.array([3, 4]), np.array([[0, 0, 1.0], [0, 0, 1.0]]))
    assert len(made(shapes=(lips,)).mesh.points) == 6
    both = RawShape("lift", 1.0, np.array([0, 2, 3, 4]), np.tile([0, 0, 1.0], (4, 1)))
    lifted = made(shapes=(both,))
    assert len(lifted.mesh.points) == 4
    assert lifted.rig.shapes.vertices.tolist() == [0, 2]
    apart = np.full((6, 2), 0.5)
    apart[3:] = [0.4, 0.6]
    assert len(made(weights=apart).mesh.points) == 6
    swapped = np.tile([0, 1], (6, 1))
    swapped[3:] = [1, 0]  # the same weights in another order are the same skin
    assert len(made(joints=swapped).mesh.points) == 4
    assert made(polygons=square(False)).rig.file_vertices is None


@pytest.mark.parametrize(("changes", "said"), [
    ({"parents": np.array([1, 0])}, "own ancestor"),
    ({"parents": np.array([-1, 1])}, "own ancestor"),
    ({"parents": np.array([-1])}, "other numbers"),
    ({"rest": np.full((2, 4, 4), np.nan), "bind": np.full((2, 4, 4), np.inf)}, "nowhere"),
    ({"rest": np.zeros((2, 4, 4)), "bind": np.zeros((2, 4, 4))}, "scaled to nothing"),
    ({"joints": np.zeros((5, 2), np.int64), "weights": np.ones((5, 2))}, "weights for 5 vertices and a mesh of 6"),
    ({"joints": np.zeros((6, 3), np.int64)}, "weights for"),
    ({"clips": (motion(joints=3),)}, "does not fit its skeleton"),
    ({"clips": (motion(rotations=np.ones((2, 2, 4))),)}, "does not fit its skeleton"),
    ({"names": tuple(map(str, range(10_001)))}, "more than 10,000 joints"),
])
def test_what_cannot_be_meant_is_refused(changes, said):
    with pytest.raises(UserError, match=said):
        made(**changes)


def test_nothing_that_moves_is_no_rig():
    with pytest.raises(NoRig, match="no skeleton"):
        made(names=(), parents=np.zeros(0, np.int64), rest=np.zeros((0, 4, 4)), bind=np.zeros((0, 4, 4)))


def test_what_can_be_guessed_is_repaired_with_a_word():
    weights = np.full((6, 2), 0.5)
    weights[0], weights[1], weights[2] = (0, 0), (np.nan, 3.0), (-1, 1)
    rest = raw().rest.copy()
    rest[1, 0, 0] = np.nan
    found = made(
        weights=weights, parents=np.array([-1, 7]), names=("", "a\nb"), rest=rest, polygons=square(),
        shapes=(RawShape("s", 1.0, np.array([1, 1, 0]), np.array([[1.0, 0, 0], [2, 0, 0], [np.nan, 0, 0]])),
                RawShape("s", 1.0, np.array([0]), np.ones((1, 3))), RawShape("t", 0.0, np.array([0]), np.ones((1, 3))),
                RawShape("u", 1.0, np.array([9]), np.ones((1, 3)))),
        rests={"s": np.nan},
        clips=(motion(), motion(rotations=np.zeros((3, 2, 4))), motion(frames_per_second=0.0, start=np.inf)),
    )
    said = " ".join(found.notes)
    for word in ("no weights", "not finite", "normalised", "parent that does not exist", "other names",
                 "no finite rest", "could not be used", "moved 1 vertices nowhere", "rest there"):
        assert word in said, word
    rig = found.rig
    assert rig.skeleton.names == ("joint1", "a_b")
    assert np.allclose(rig.skin.weights.sum(axis=1), 1.0)
    assert rig.shapes.names == ("s",)
    assert rig.shapes.offsets.tolist() == [[2.0, 0.0, 0.0]]
    assert [clip.name for clip in found.clips] == ["move", "move_2", "move_3"]
    assert np.allclose(local_matrices(found.clips[1], 2), rig.skeleton.rest, atol=1e-6)
    assert (found.clips[2].start, found.clips[2].frames_per_second) == (0.0, 24.0)
    assert np.isfinite(posed_points(found.mesh.points, rig, 2)).all()


def test_parents_come_first_and_everything_follows():
    local = np.tile(EYE, (3, 1, 1))
    local[:, :3, 3] = [[0, 1, 0], [0, 0, 5], [2, 0, 0]]
    moved = np.zeros((2, 3, 3)) + local[:, :3, 3]
    moved[1, 2] = [9, 9, 9]
    found = made(
        names=("tip", "root", "middle"), parents=np.array([2, -1, 1]), rest=local, bind=np.zeros((3, 4, 4)),
        joints=np.zeros((6, 1), np.int64), weights=np.ones((6, 1)),
        clips=(motion(joints=3, frames=2, translations=moved),),
    )
    skeleton = found.rig.skeleton
    assert skeleton.names == ("root", "middle", "tip")
    assert skeleton.parents.tolist() == [-1, 0, 1]
    assert np.allclose(object_matrices(skeleton, skeleton.rest)[2, :3, 3], [2, 1, 5])
    assert found.rig.skin.joints.ravel().tolist() == [2] * 4
    assert np.allclose(posed_points(found.mesh.points, found.rig, 2), found.mesh.points + np.array([7, 9, 9]))


def test_what_no_joint_moves_stays_where_it_is():
    joints = np.tile([0, 0], (6, 1))
    joints[3:] = 2
    found = made(joints=joints, clips=(motion(translations=np.full((3, 2, 3), 4.0)),))
    assert found.rig.skeleton.names[-1] == "still"
    now = posed_points(found.mesh.points, found.rig, 1)[found.rig.file_vertices] if (
        found.rig.file_vertices is not None) else posed_points(found.mesh.points, found.rig, 1)
    assert np.allclose(now[3:], square().points[3:])
    assert np.allclose(now[:3], square().points[:3] + 4.0)


@pytest.mark.parametrize("up", ["y", "z"])
def test_units_and_axes_are_those_of_the_whole_rig(up):
    rng = np.random.default_rng(2)
    clip = motion(translations=rng.normal(size=(3, 2, 3)), rotations=rng.normal(size=(3, 2, 4)))
    plain = made(clips=(clip,))
    other = made(clips=(clip,), metres_per_unit=0.01, up=up)
    for frame in (1, 2, 3):
        truth = posed_points(plain.mesh.points, plain.rig, frame) * 0.01
        truth = truth[:, [0, 2, 1]] * [1, 1, -1] if up == "z" else truth
        assert np.allclose(posed_points(other.mesh.points, other.rig, frame), truth, atol=1e-7)


def test_an_answer_of_a_child_comes_back_whole():
    one = raw(shapes=(RawShape("s", 0.5, np.array([1]), np.ones((1, 3))),), clips=(motion(),), rests={"s": 0.25})
    back = unpack_rig(pack_rig(one))
    for field, before, after in zip(one._fields, one, back):
        if field not in ("polygons", "shapes", "clips"):
            assert np.array_equal(before, after), field
    assert back.shapes[0].at == 0.5
    assert np.array_equal(back.clips[0].rotations, one.clips[0].rotations)
    assert np.array_equal(back.polygons.points, one.polygons.points)


def test_a_document_keeps_all_of_a_rig(tmp_path):
    shape = RawShape("smile", 1.0, np.array([1]), np.ones((1, 3)))
    clips = (motion(number_names=("smile",), numbers=np.array([[0.0], [1.0], [0.5]])), motion(name="other"))
    found = made(shapes=(shape,), clips=clips, skinning="dual-quaternion", rests={"smile": 0.125})
    document = document_of(found)
    assert (document.fps, document.first_frame, document.last_frame) == (24.0, 1, 3)
    write_project(tmp_path / "rig.filo", document)
    rig = find_mesh(read_project(tmp_path / "rig.filo").document, 1).rig
    assert rig.skinning == "dual-quaternion"
    assert (rig.clip.name, rig.clip.number_names, rig.clips[0].name) == ("move", ("smile",), "other")
    assert rig.controls[0].rest == 0.125
    for field in ("shape", "at", "starts", "vertices", "offsets"):
        assert np.array_equal(getattr(rig.shapes, field), getattr(found.rig.shapes, field))
    assert np.array_equal(rig.file_vertices, found.rig.file_vertices)
    info = rig_info(found)
    assert info["controls"] == ["root", "tip", "smile"]
    assert [clip["name"] for clip in info["clips"]] == ["move", "other"]


def test_files_that_are_no_rigs(tmp_path):
    for name, said in (("a.fbx", "an FBX file, which is not read; export the rig as USD or glTF"),
                       ("a.xyz", "no rig format"), ("gone.glb", "not there")):
        if name != "gone.glb":
            (tmp_path / name).write_bytes(b"x")
        with pytest.raises(UserError, match=said):
            read_rig(tmp_path / name)
    (tmp_path / "empty.bvh").write_bytes(b"")
    with pytest.raises(UserError, match="empty"):
        read_rig(tmp_path / "empty.bvh")


@pytest.mark.skipif(not ANIMATION.is_dir(), reason="the shared data are not there")
def test_libigls_arm_has_its_weights_and_its_hand_a_pose(tmp_path):
    arm = read_rig(ANIMATION / "libigl_skin_A/arm.tgf")
    first = float((ANIMATION / "libigl_skin_A/arm-weights.dmat").read_text().split()[2])
    row = arm.rig.skin
    assert dict(zip(row.joints[0].tolist(), row.weights[0].tolist()))[0] == pytest.approx(first, abs=1e-3)
    assert arm.rig.skeleton.parents.tolist() == [-1, 0, 1, 2]
    assert len(read_rig(ANIMATION / "libigl_skin_A/hand.tgf").clips) == 1
    for text, said in (
        ("1 0 0 0\n#\n1 2\n", "does not have"), ("words", "not a skeleton"), ("1 0 0\n#\n1 1", "does not have"),
    ):
        (tmp_path / "a.tgf").write_text(text)
        with pytest.raises(UserError, match=said):
            read_rig(tmp_path / "a.tgf")
