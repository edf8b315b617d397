"""Actions of the pose craft: each does to the mesh what it says, as one named step, or refuses in words."""

import math

import numpy as np
import pytest

from core.document import Document, MeshObject, with_mesh
from core.errors import UserError
from core.formats.mesh_file import write_mesh
from core.leaves import same_bits
from core.pose.controls import without_noise
from core.pose.pose import Pose, local_of_pose
from core.pose.refusal import Refusal
from core.pose.sculpt.symmetry import opposites_by_axis
from core.pose.skinning import moved_number
from core.pose.synthesis import evaluate, pose_at
from core.pose.weights import weights_of
from core.record import freeze
from tests.tools.pose_scenes import document, item, rig, session, strip, turned
from tools import pose_edits
from tools.macro import play
from tools.pose.actions import ACTIONS
from tools.session import Session

LEFT = turned("left", arm_L=(0, 40, 30))
SAME = pose_edits.same_pose


def sculpted(s, pose, push=(0.0, 0.0, 0.03), centre=0.5):
    """Add a bump around x = `centre` at a pose."""
    now = evaluate(strip().points, item(s).rig, item(s).correctives, pose)
    share = np.clip(1.0 - ((strip().points[:, 0] - centre) / 0.4) ** 2, 0.0, 1.0)[:, None]
    s.edit("Sculpt", pose_edits.add_sculpt, 1, pose, now + share * np.array(push))


def hold(s, pose):
    s.edit("Hold", pose_edits.hold_pose, 1, pose)


def surface(s, pose):
    return evaluate(strip().points, item(s).rig, item(s).correctives, pose)


def names(s):
    layers = () if item(s).correctives is None else item(s).correctives.layers
    return [x.name for layer in layers for x in layer.space.samples]


def act(s, name, /, **params):
    before = s.history.names
    s.act(name, **params)
    assert s.history.names[len(before):] in ((), (ACTIONS[name].step,))


# -- sculpts


def test_a_sculpt_is_imported_at_the_pose_that_is_shown(tmp_path):
    s = session(pose=LEFT)
    wanted = surface(s, LEFT) + np.float32([0.0, 0.0, 0.02])
    for suffix in ("obj", "usda"):
        write_mesh(tmp_path / f"up.{suffix}", strip().replace(points=freeze(wanted)))
        act(s, "import_sculpt", file=str(tmp_path / f"up.{suffix}"))
        assert np.abs(surface(s, LEFT) - wanted).max() < 1e-6
        assert names(s) == ["up"]
    rest = session()
    with pytest.raises(UserError, match="away from rest"):
        rest.act("import_sculpt", file=str(tmp_path / "up.obj"))
    with pytest.raises(UserError, match="Which file"):
        s.act("import_sculpt")


def other_faces(how):
    """Files with all vertices of the strip, joined otherwise, and what must be said of each."""
    mesh = strip()
    quads = mesh.corners.reshape(-1, 4)
    if how == "triangles":
        corners = np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]]).astype(np.int32)
        count = len(corners)
        return mesh.replace(corners=freeze(corners.ravel()), counts=freeze(np.full(count, 3, np.int32)),
                            parts=freeze(np.zeros(count, np.int32))), r"96 faces and the rig 48; its face 1 joins"
    if how == "one face":
        swapped = quads.copy()
        swapped[7] = [7, 8, 12, 20]
        return mesh.replace(corners=freeze(swapped.ravel())), r"face 8 joins the vertices 8, 9, 13, 21 \(counted from 1"
    fewer = mesh.replace(corners=freeze(quads[:-1].ravel().copy()), counts=freeze(mesh.counts[:-1].copy()),
                         parts=freeze(mesh.parts[:-1].copy()))
    return fewer, "47 faces and the rig 48; 1 faces of the rig are not in it"


@pytest.mark.parametrize("how", ["triangles", "one face", "a face less"])
def test_another_topology_is_told_face_by_face_and_nothing_is_done(tmp_path, how):
    s = session(pose=LEFT)
    before = s.document
    mesh, said = other_faces(how)
    write_mesh(tmp_path / "other.obj", mesh)
    with pytest.raises(UserError, match=said):
        s.act("import_sculpt", file=str(tmp_path / "other.obj"))
    assert s.document is before
    assert s.history.names == ("New",)


def test_other_numbers_of_vertices_are_told(tmp_path):
    s = session(pose=LEFT)
    (tmp_path / "few.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(UserError, match="3 vertices and the rig 68"):
        s.act("import_sculpt", file=str(tmp_path / "few.obj"))


def test_turned_and_reordered_faces_are_the_same_topology_and_bare_points_are_taken(tmp_path):
    s, mesh = session(pose=LEFT), strip()
    quads = np.roll(mesh.corners.reshape(-1, 4)[::-1], 1, axis=1)
    wanted = surface(s, LEFT) + np.float32(0.01)
    write_mesh(tmp_path / "a.obj", mesh.replace(points=freeze(wanted), corners=freeze(quads.ravel().copy())))
    act(s, "import_sculpt", file=str(tmp_path / "a.obj"))
    assert np.abs(surface(s, LEFT) - wanted).max() < 1e-6
    (tmp_path / "b.obj").write_text("".join(f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in wanted + 0.01))
    act(s, "import_sculpt", file=str(tmp_path / "b.obj"))
    assert np.abs(surface(s, LEFT) - wanted - 0.01).max() < 1e-6


def test_restore_goes_to_the_skin_or_to_another_poses_shape():
    s = session()
    sculpted(s, LEFT)
    far = turned("far", arm_L=(0, 90, 60))
    sculpted(s, far, (0.0, 0.0, 0.08))
    hold(s, LEFT)
    skin = evaluate(strip().points, rig(), None, LEFT)
    half = 0.5 * (surface(s, LEFT) + skin)
    act(s, "restore_sculpt", amount=0.5)
    assert np.abs(surface(s, LEFT) - half).max() < 1e-6
    # a bump before skinning of the same height and place, turned as the arm is here
    act(s, "restore_sculpt", towards="far")
    bump = np.linalg.norm(surface(s, LEFT) - skin, axis=1)
    there = np.linalg.norm(surface(s, far) - evaluate(strip().points, rig(), None, far), axis=1)
    stiff = strip().points[:, 0] > 0.5  # one joint moves these, so lengths are kept
    assert there[stiff].max() > 0.05
    np.testing.assert_allclose(bump[stiff], there[stiff], atol=1e-6)
    act(s, "restore_sculpt")
    assert np.abs(surface(s, LEFT) - skin).max() < 1e-6
    with pytest.raises(UserError, match="no pose 'nowhere'"):
        s.act("restore_sculpt", towards="nowhere")


def test_the_mask_spares_what_is_restored():
    mask = np.zeros(len(strip().points), np.float32)
    mask[strip().points[:, 0] > 0.5] = 1.0
    s = session(pose=LEFT, mask=freeze(mask))
    sculpted(s, LEFT)
    before = surface(s, LEFT)
    act(s, "restore_sculpt")
    assert np.abs(surface(s, LEFT) - before)[mask == 1.0].max() < 1e-6
    assert np.abs(surface(s, LEFT) - before)[mask == 0.0].max() > 0.01


@pytest.mark.parametrize("way", ["topology", "axis"])
def test_a_mirrored_sculpt_is_the_reflected_surface_at_the_mirrored_pose(way):
    s = session(pose=LEFT)
    sculpted(s, LEFT, (0.01, 0.02, 0.03))
    act(s, "mirror_sculpt", way=way)
    act(s, "mirror_pose")
    pairs = opposites_by_axis(strip().points)
    there = item(s).pose
    assert set(there.rotations) == {"arm_R"}
    assert names(s) == ["left", "right"]
    image = surface(s, LEFT)[pairs] * [-1.0, 1.0, 1.0]
    assert np.abs(surface(s, there) - image).max() < 2e-6
    layers = item(s).correctives.layers
    assert layers[0].space.dofs[0].falloff == layers[1].space.dofs[0].falloff
    once = s.document
    act(s, "mirror_sculpt", way=way)  # and back: the sculpt that was there is what it was
    assert names(s) == ["right", "left"] or names(s) == ["left", "right"]
    for pose in (LEFT, there):
        before = evaluate(strip().points, rig(), once.meshes[0].correctives, pose)
        assert np.abs(surface(s, pose) - before).max() < 2e-6


def test_a_sculpt_at_a_symmetric_pose_becomes_symmetric():
    both = turned("both", arm_L=(0, 30, 0), arm_R=(0, -30, 0))
    s = session(pose=both)
    sculpted(s, both)
    one = surface(s, both)
    act(s, "mirror_sculpt")
    pairs, now = opposites_by_axis(strip().points), surface(s, both)
    assert names(s) == ["both"]
    np.testing.assert_allclose(now[pairs] * [-1, 1, 1], now, atol=2e-6)
    right = strip().points[:, 0] > 0.1
    assert np.abs(now - one)[right].max() < 1e-6


def test_delete_merge_and_move_take_the_pose_that_is_shown():
    s = session()
    near, far = turned("near", arm_L=(0, 20, 0)), turned("far", arm_L=(0, 80, 0))
    for pose in (near, far):
        sculpted(s, pose)
    hold(s, near)
    with pytest.raises(UserError, match="no sculpted pose 'nobody'"):
        s.act("delete_pose", pose="nobody")
    act(s, "merge_poses")
    assert names(s) == ["far"]
    s.undo()
    act(s, "delete_pose")
    assert names(s) == ["far"]
    s.undo()
    hold(s, turned("held", arm_L=(0, 30, 0)))
    act(s, "move_pose")
    assert names(s) == ["near", "far"]
    assert SAME(item(s).correctives.layers[0].space.samples[0].pose, item(s).pose)
    hold(s, turned("held", arm_L=(0, 50, 0)))
    with pytest.raises(UserError, match="no sculpt at the pose"):
        s.act("delete_pose")


# -- refusals and what may be done about them


def test_a_duplicate_is_refused_by_name_and_each_offer_mends_it():
    twin = turned("again", arm_L=(0, 40.0, 30.0))
    for offer in ("merge", "delete"):
        s = session()
        sculpted(s, LEFT)
        before = s.document
        with pytest.raises(Refusal) as refused:
            s.edit("Sculpt", pose_edits.add_sculpt, 1, twin, surface(s, LEFT) + np.float32([0, 0, 0.02]))
        assert (refused.value.reason, set(refused.value.poses)) == ("duplicate", {"left", "again"})
        assert refused.value.offers == ("merge", "delete", "move")
        assert s.document is before
        first, new = surface(s, LEFT), surface(s, LEFT) + np.float32([0, 0, 0.02])
        s.edit("Sculpt", pose_edits.add_sculpt, 1, twin, new, twins=offer)
        wanted = 0.5 * (first + new) if offer == "merge" else new
        assert np.abs(surface(s, LEFT) - wanted).max() < 2e-6
        assert names(s) == (["left"] if offer == "merge" else ["again"])
    s = session()
    sculpted(s, LEFT)
    s.edit("Move pose", pose_edits.move_pose, 1, "left", turned("left", arm_L=(0, 80, 30)))
    s.edit("Sculpt", pose_edits.add_sculpt, 1, twin)
    assert names(s) == ["left", "again"]


def test_a_near_duplicate_is_refused_and_the_offers_mend_it():
    near = turned("near", arm_L=(0, 40.00003, 30))
    for offer, left in (("merge", ["left"]), ("delete", ["near"])):
        s = session()
        sculpted(s, LEFT)
        with pytest.raises(Refusal) as refused:
            s.edit("Add", pose_edits.add_sculpt_as_seen, 1, near)
        assert (refused.value.reason, set(refused.value.poses)) == ("near-duplicate", {"left", "near"})
        s.edit("Add", pose_edits.add_sculpt_as_seen, 1, near, offer)
        assert names(s) == left


def test_a_pose_nearer_than_rounding_goes_on_with_the_sculpt_there():
    s = session(pose=turned("held", arm_L=(0, 40.00003, 30)))
    sculpted(s, LEFT)
    act(s, "add_sculpt", name="another")
    assert names(s) == ["left"]


def test_a_sculpt_hardly_apart_from_another_is_refused_and_the_offers_mend_it():
    for offer, left in (("merge", ["left"]), ("delete", ["near"])):
        s = session(pose=turned("held", arm_L=(0, 40.01, 30)))
        sculpted(s, LEFT)
        with pytest.raises(Refusal) as refused:
            s.act("add_sculpt", name="near")
        assert (refused.value.reason, set(refused.value.poses)) == ("near-duplicate", {"left", "near"})
        act(s, "add_sculpt", name="near", twins=offer)
        assert names(s) == left


def test_poses_a_new_reading_cannot_tell_apart_are_merged_deleted_or_moved():
    """Two twists of one swing: read by swing alone they are one."""
    plain, twisted = turned("plain", arm_L=(0, 40, 0)), turned("twisted", arm_L=(50, 40, 0))
    mends = {"merge_poses": {"pose": "twisted", "into": "plain"}, "delete_pose": {"pose": "twisted"},
             "move_pose": {"pose": "twisted"}}
    for name, params in mends.items():
        s = session(pose=turned("held", arm_L=(0, 80, 0)))
        for pose in (plain, twisted):
            sculpted(s, pose)
        layer = item(s).correctives.layers[0]
        swing = tuple(d.replace(kind="swing", axis=(1.0, 0.0, 0.0), side=(0.0, 1.0, 0.0)) for d in layer.space.dofs)
        with pytest.raises(Refusal) as refused:
            s.edit("Reading", pose_edits.set_space, 1, layer.name, dofs=swing)
        assert set(refused.value.poses) == {"plain", "twisted"}
        act(s, name, **params)
        s.edit("Reading", pose_edits.set_space, 1, layer.name, dofs=swing)
        assert [d.kind for d in item(s).correctives.layers[0].space.dofs] == ["swing"]


def test_coplanar_poses_are_refused_by_an_affine_part_and_moving_one_mends_it():
    s = session()
    for k, (left, right) in enumerate(((0.3, 0.3), (0.6, 0.6), (0.9, 0.9))):
        sculpted(s, Pose(name=f"p{k}", numbers={"smile_L": left, "smile_R": right}), (0, 0, 0.01 * (k + 1)), 0.0)
    layer = item(s).correctives.layers[0].name
    with pytest.raises(Refusal) as refused:
        s.edit("Affine", pose_edits.set_space, 1, layer, kernel="thin-plate", affine=True)
    assert refused.value.reason == "coplanar"
    assert set(refused.value.poses) <= {"rest", "p0", "p1", "p2"}
    assert refused.value.offers == ("move",)
    hold(s, Pose(name="held", numbers={"smile_L": 0.9, "smile_R": 0.2}))
    act(s, "move_pose", pose="p2")
    s.edit("Affine", pose_edits.set_space, 1, layer, kernel="thin-plate", affine=True)
    assert item(s).correctives.layers[0].space.affine


# -- poses


def test_mirror_pose_twice_is_the_pose_and_selected_joints_are_copied():
    pose = turned("held", {"smile_L": 0.25}, arm_L=(10, 40, 30), root=(0, 20, 0)).replace(
        translations={"arm_L": (0.1, 0.02, 0.03)})
    s = session(pose=pose)
    act(s, "mirror_pose")
    once = item(s).pose
    assert set(once.rotations) == {"arm_R", "root"}
    assert once.numbers == {"smile_R": 0.25}
    assert once.translations["arm_R"] == pytest.approx((-0.1, 0.02, 0.03))
    act(s, "mirror_pose")
    for field in ("rotations", "translations"):
        one, two = getattr(pose, field), getattr(item(s).pose, field)
        assert one.keys() == two.keys()
        for name in one:
            assert np.abs(np.subtract(one[name], two[name])).max() < 1e-9
    with pytest.raises(UserError, match="No joint is selected"):
        s.act("mirror_pose", what="selected joints")
    s.edit("Select joints", pose_edits.select_joints, 1, ("arm_L",))
    act(s, "mirror_pose", what="selected joints")
    assert item(s).pose.rotations["arm_L"] == pytest.approx(pose.rotations["arm_L"])
    assert item(s).pose.rotations["arm_R"] == pytest.approx(once.rotations["arm_R"])


def test_reset_all_or_what_is_selected():
    s = session(pose=turned("held", {"smile_L": 1.0}, arm_L=(0, 40, 0), arm_R=(0, 10, 0)), joint_selection=("arm_L",))
    act(s, "reset_joints")
    assert set(item(s).pose.rotations) == {"arm_R"}
    assert item(s).pose.numbers == {"smile_L": 1.0}
    act(s, "reset_pose")
    assert same_bits(item(s).pose, Pose(name="rest"))
    act(s, "reset_pose")  # nothing to do is no step
    assert s.history.names[1:] == ("Reset joints", "Reset pose")
    act(s, "follow_clip")
    assert item(s).pose is None


def test_keys_are_met_and_what_lies_between_goes_from_one_to_the_next():
    s = session(pose=turned("held", arm_L=(0, 0, 80)))
    act(s, "key_pose")
    assert item(s).pose is None
    for frame in (1001, 1010, 1024):  # a single key holds everywhere
        assert SAME(without_noise(rig(), pose_at(item(s).rig, frame)).replace(name="x"),
                    turned("x", arm_L=(0, 0, 80))) or angle(s, frame) == pytest.approx(80, abs=1e-4)
    s.set_workspace(frame=1011.0)
    hold(s, turned("held", {"smile_L": 1.0}, arm_L=(0, 0, 20)))
    act(s, "key_pose")
    s.set_workspace(frame=1021.0)
    hold(s, turned("held", {"smile_L": 0.0}, arm_L=(0, 0, -40)))
    act(s, "key_pose")
    clip = item(s).rig.clip
    assert [clip.start + k for k in clip.keys] == [1001, 1011, 1021]
    angles = [angle(s, f) for f in range(1001, 1025)]
    for frame, wanted in ((1001, 80), (1006, 50), (1011, 20), (1016, -10), (1021, -40), (1024, -40)):
        assert angles[frame - 1001] == pytest.approx(wanted, abs=1e-4)
    assert (np.diff(angles[:21]) < 0).all(), "from key to key without turning back"
    numbers = [pose_at(item(s).rig, f).numbers["smile_L"] for f in (1001, 1011, 1016, 1021)]
    assert numbers == pytest.approx([0.0, 1.0, 0.5, 0.0])
    s.set_workspace(frame=1040.0)  # beyond its end the clip gets longer
    hold(s, turned("held", arm_L=(0, 0, 0)))
    act(s, "key_pose")
    assert item(s).rig.clip.end == 1040
    assert angle(s, 1021) == pytest.approx(-40, abs=1e-4)
    s.set_workspace(frame=991.0)
    hold(s, turned("held", arm_L=(0, 0, 10)))
    act(s, "key_pose")
    assert item(s).rig.clip.start == 991
    assert angle(s, 1001) == pytest.approx(80, abs=1e-4)


def angle(s, frame):
    """Degrees about z of the left arm in the clip."""
    q = pose_at(item(s).rig, frame).rotations.get("arm_L", (0, 0, 0, 1))
    return np.degrees(2.0 * np.arctan2(q[2], q[3]))


def test_captured_motion_is_corrected_between_the_keys_beside_it():
    s = session()
    for frame, degrees in ((1001.0, 0.0), (1012.0, 60.0), (1024.0, -30.0)):
        s.set_workspace(frame=frame)
        hold(s, turned("held", arm_L=(0, 0, degrees)))
        act(s, "key_pose")
    captured = item(s).rig.replace(clip=item(s).rig.clip.replace(keys=(4, 14)))
    s.edit("Captured", lambda d: with_mesh(d, d.meshes[0].replace(rig=captured)))
    before = [angle(s, f) for f in range(1001, 1025)]
    s.set_workspace(frame=1010.0)
    hold(s, turned("held", arm_L=(0, 0, 0)))
    act(s, "key_pose")
    after = [angle(s, f) for f in range(1001, 1025)]
    assert after[9] == pytest.approx(0.0, abs=1e-4)
    outside = [k for k in range(24) if k <= 4 or k >= 14]
    np.testing.assert_allclose(np.array(after)[outside], np.array(before)[outside], atol=1e-4)


def test_the_library_stores_applies_and_deletes():
    s = session(pose=LEFT)
    act(s, "store_pose")
    hold(s, turned("other", arm_R=(0, 0, 50)))
    act(s, "store_pose", name="right")
    assert [p.name for p in item(s).library] == ["pose 1", "right"]
    act(s, "apply_pose")
    assert same_bits(item(s).pose, item(s).library[0])
    act(s, "apply_pose")
    assert same_bits(item(s).pose, item(s).library[1])
    act(s, "apply_pose", name="pose 1", amount=0.5)
    assert 2 * np.degrees(np.arccos(item(s).pose.rotations["arm_R"][3])) == pytest.approx(25.0)
    with pytest.raises(UserError, match="none of the library"):
        s.act("forget_pose")
    act(s, "forget_pose", name="right")
    assert [p.name for p in item(s).library] == ["pose 1"]
    empty = session()
    with pytest.raises(UserError, match="no pose yet"):
        empty.act("apply_pose")


# -- weights and masks


def test_mirrored_weights_are_symmetric_and_locked_joints_keep_theirs():
    uneven = rig().skin.weights.copy()
    right = strip().points[:, 0] < -0.05
    uneven[right] = [0.5, 0.2, 0.3]
    s = session(rig=rig().replace(skin=rig().skin.replace(weights=freeze(uneven))))
    act(s, "mirror_weights")
    skin, pairs = item(s).rig.skin, opposites_by_axis(strip().points)
    np.testing.assert_allclose(weights_of(skin, 2)[pairs], weights_of(skin, 1), atol=1e-6)
    np.testing.assert_allclose(weights_of(skin, 1), weights_of(rig().skin, 1), atol=1e-6)
    once = s.document
    s.act("mirror_weights")
    assert np.abs(weights_of(item(s).rig.skin, 2) - weights_of(once.meshes[0].rig.skin, 2)).max() < 1e-6
    s = session(rig=rig().replace(skin=rig().skin.replace(weights=freeze(uneven))), locked_joints=("root",))
    act(s, "mirror_weights")
    np.testing.assert_allclose(weights_of(item(s).rig.skin, 0), uneven[:, 0], atol=1e-6)


def test_smooth_limit_prune_and_normalise():
    s = session(joint_selection=("arm_L",))

    def rough(skin):
        edges = strip().corners.reshape(-1, 4)
        w = np.stack([weights_of(skin, j) for j in range(3)], axis=1)
        return ((w[edges] - w[np.roll(edges, 1, axis=1)]) ** 2).sum()

    before = rough(item(s).rig.skin)
    act(s, "smooth_weights", passes=3)
    assert rough(item(s).rig.skin) < before
    act(s, "smooth_weights", joints="active")
    act(s, "limit_influences", influences=2)
    assert (item(s).rig.skin.weights > 0).sum(axis=1).max() == 2
    act(s, "prune_weights", least=0.2)
    some = item(s).rig.skin.weights
    assert some[some > 0].min() >= 0.2
    np.testing.assert_allclose(some.sum(axis=1), 1.0, atol=1e-6)
    loose = rig().skin.replace(weights=freeze(rig().skin.weights * np.float32(0.9995)))
    s = session(rig=rig().replace(skin=loose))
    act(s, "normalise_weights")
    np.testing.assert_allclose(item(s).rig.skin.weights.sum(axis=1, dtype=np.float64), 1.0, atol=1e-7)
    act(s, "normalise_weights")
    assert s.history.names == ("New", "Normalise weights")


def test_weights_change_under_sculpts_that_stand():
    s = session(pose=LEFT)
    sculpted(s, LEFT)
    before = surface(s, LEFT)
    moved = item(s).correctives.layers[0].vertices
    act(s, "smooth_weights", passes=4)
    assert np.abs(surface(s, LEFT) - before)[moved].max() < 2e-6


def test_locks_follow_the_selection():
    s = session(joint_selection=("arm_R", "arm_L"))
    act(s, "lock_joints")
    assert item(s).locked_joints == ("arm_L", "arm_R")
    s.edit("Select joints", pose_edits.select_joints, 1, ("arm_L",))
    act(s, "unlock_joints")
    assert item(s).locked_joints == ("arm_R",)
    s.edit("Select joints", pose_edits.select_joints, 1, ())
    act(s, "unlock_joints")
    assert item(s).locked_joints == ()
    with pytest.raises(UserError, match="No joint is selected"):
        s.act("lock_joints")


def test_masks_grow_by_rings_shrink_back_invert_and_blur():
    column = np.zeros((17, 4), np.float32)
    column[8] = 1.0
    s = session(mask=freeze(column.ravel().copy()))
    act(s, "grow_mask", times=2)
    wanted = np.zeros((17, 4))
    wanted[6:11] = 1.0
    assert np.array_equal(item(s).mask.reshape(17, 4), wanted)
    act(s, "shrink_mask", times=2)
    assert np.array_equal(item(s).mask.reshape(17, 4), column)
    act(s, "invert_mask")
    assert np.array_equal(item(s).mask.reshape(17, 4), 1.0 - column)
    act(s, "blur_mask")
    assert 0.0 < item(s).mask.reshape(17, 4)[8].min() < 1.0
    act(s, "clear_mask")
    assert item(s).mask is None
    act(s, "clear_mask")
    assert len(s.history.names) == 6


# -- controls and constraints


def test_dials_pads_switches_and_pieces_of_geometry():
    s = session(joint_selection=("lid",))
    act(s, "add_dial", name="mood", low=-1.0, high=2.0)
    act(s, "add_pad")
    act(s, "add_joint_control", name="blink", axis="Y", travel=0.1)
    column = np.zeros(len(strip().points), np.float32)
    column[-4:] = 1.0
    with pytest.raises(UserError, match="Nothing is masked"):
        s.act("add_geometry_control", name="tip")
    s.edit("Mask", lambda d: with_mesh(d, d.meshes[0].replace(mask=freeze(column))))
    act(s, "add_geometry_control", name="tip", axis="Z", travel=0.5)
    controls = {c.name: c for c in item(s).rig.controls}
    assert list(controls) == ["smile_L", "smile_R", "mood", "valence", "arousal", "blink", "tip"]
    assert (controls["mood"].low, controls["mood"].high) == (-1.0, 2.0)
    assert (controls["valence"].low, controls["valence"].rest, controls["arousal"].high) == (-1.0, 0.0, 1.0)
    skeleton = item(s).rig.skeleton
    lifted = Pose(translations={"lid": (0.0, 0.25, 0.0)})
    assert moved_number(controls["blink"], item(s).rig, strip().points, local_of_pose(skeleton, lifted)) \
        == pytest.approx(2.5)
    raised = Pose(translations={"arm_L": (0.0, 0.0, 1.0)})
    assert moved_number(controls["tip"], item(s).rig, strip().points, local_of_pose(skeleton, raised)) \
        == pytest.approx(2.0)
    for name, params in (("add_dial", {"name": "mood"}), ("add_dial", {"name": "arm_L"}),
                         ("add_dial", {"name": "x", "low": 1.0, "high": 1.0})):
        with pytest.raises(UserError, match="cannot be made"):
            s.act(name, **params)


def test_a_control_is_renamed_everywhere_and_deleted_when_nobody_reads_it():
    s = session(pose=Pose(name="grin", numbers={"smile_L": 1.0}))
    sculpted(s, item(s).pose)
    act(s, "store_pose", name="kept")
    before = surface(s, item(s).pose)
    act(s, "edit_control", name="smile_L", to="grin_L", low=-1.0, high=2.0)
    held = item(s).pose
    assert held.numbers == {"grin_L": 1.0}
    assert item(s).library[0].numbers == {"grin_L": 1.0}
    assert np.abs(surface(s, held) - before).max() < 1e-6
    assert np.abs(before - strip().points).max() > 0.02
    assert item(s).rig.controls[0].high == 2.0
    with pytest.raises(UserError, match="sculpts grin are read"):
        s.act("delete_control", name="grin_L")
    act(s, "delete_pose")
    act(s, "delete_control", name="grin_L")
    assert [c.name for c in item(s).rig.controls] == ["smile_R"]
    assert item(s).pose.numbers == {}
    assert item(s).library[0].numbers == {}
    act(s, "delete_control")
    with pytest.raises(UserError, match="add a dial first"):
        s.act("delete_control")


def test_a_clip_forgets_or_renames_a_control_as_well():
    s = session(pose=Pose(name="held", numbers={"smile_L": 1.0, "smile_R": 0.5}))
    act(s, "key_pose")
    act(s, "edit_control", name="smile_L", to="grin", high=1.0)
    assert item(s).rig.clip.number_names == ("grin", "smile_R")
    act(s, "delete_control", name="grin")
    assert pose_at(item(s).rig, 1001).numbers == {"smile_R": 0.5}


def test_limits_and_constraints_hold_sliders_the_library_and_held_poses():
    s = session(pose=turned("held", arm_L=(0, 0, 80)), joint_selection=("arm_L",))
    act(s, "limit_joint", high=math.radians(30))
    assert np.degrees(2 * np.arcsin(item(s).pose.rotations["arm_L"][2])) == pytest.approx(30)
    hold(s, turned("held", arm_L=(0, 0, 60)))  # what a slider and a click in a list call
    assert np.degrees(2 * np.arcsin(item(s).pose.rotations["arm_L"][2])) == pytest.approx(30)
    before = s.document
    hold(s, item(s).pose)
    assert s.document is before
    act(s, "free_joints")
    hold(s, turned("held", arm_L=(0, 0, 60)))
    assert np.degrees(2 * np.arcsin(item(s).pose.rotations["arm_L"][2])) == pytest.approx(60)
    s.edit("Select joints", pose_edits.select_joints, 1, ("arm_L", "arm_R"))
    act(s, "constrain_joint", kind="orient", weight=0.5)
    assert np.degrees(2 * np.arcsin(item(s).pose.rotations["arm_R"][2])) == pytest.approx(30)
    for _ in range(3):  # held again and again it does not creep
        hold(s, item(s).pose.replace(numbers={"smile_L": 0.1}))
        assert np.degrees(2 * np.arcsin(item(s).pose.rotations["arm_R"][2])) == pytest.approx(30)
    s.edit("Select joints", pose_edits.select_joints, 1, ("arm_L", "root"))
    with pytest.raises(UserError, match="carries"):
        s.act("constrain_joint")
    s.edit("Select joints", pose_edits.select_joints, 1, ("arm_L",))
    with pytest.raises(UserError, match="Select two joints"):
        s.act("constrain_joint")


# -- all of them


def test_a_macro_of_actions_makes_the_same_bits(tmp_path):
    s = session(pose=LEFT, joint_selection=("arm_L",))
    s.save(tmp_path / "start.filo")
    macro = s.record()
    for name, params in (
        ("add_sculpt", {}), ("mirror_sculpt", {}), ("smooth_weights", {}), ("store_pose", {"name": "kept"}),
        ("mirror_pose", {}), ("lock_joints", {}), ("invert_mask", {}), ("add_pad", {}), ("limit_joint", {}),
        ("restore_sculpt", {"towards": "left"}), ("key_pose", {}), ("apply_pose", {}), ("delete_pose", {}),
    ):
        s.act(name, **params)
    s.stop_recording()
    macro.save(tmp_path / "macro.py")
    assert "left out" not in (tmp_path / "macro.py").read_text()
    again = Session.open(tmp_path / "start.filo")
    play(tmp_path / "macro.py", again)
    assert same_bits(again.document, s.document)
    assert again.history.names[1:] == s.history.names[1:]


def test_without_a_rig_or_locked_they_say_so():
    plain = Session(Document(meshes=(MeshObject(id=1, name="strip", mesh=strip()),)))
    plain.set_workspace(mesh=1)
    cases = {
        "no mesh with a rig": Session(Document()), "strip has no rig": plain,
        "unlock it": Session(document(locked=True)), "show it": Session(document(hidden=True)),
    }
    for said, s in cases.items():
        for name in ACTIONS:
            with pytest.raises(UserError, match=said):
                s.act(name)
