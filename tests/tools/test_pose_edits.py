"""Edits of sculpted poses: each does what it says, and every other sculpt stays what it was."""

import numpy as np
import pytest

from core.document import Document, MeshObject, find_mesh
from core.errors import UserError
from core.formats.mesh_file import write_mesh
from core.mesh.mesh import Mesh
from core.pose.edit_layers import sculpt_errors
from core.pose.layers import Sculpt, build
from core.pose.refusal import Refusal
from core.pose.rig import Constraint
from core.pose.synthesis import evaluate
from core.record import freeze
from tests.core.pose.arms import arm, bumped, turned
from tools import pose_edits as edits

BENT, FOLDED, BOTH = turned("bent", fore=(0, 0, 50)), turned("folded", fore=(0, 0, 100)), turned(
    "both", fore=(0, 0, 50), upper=(0, 60, 0))
NEW = turned("raised", upper=(0, 70, 0))


@pytest.fixture
def document():
    rig, points = arm()
    faces = np.arange(len(points) // 3 * 3, dtype=np.int32)
    count = len(faces) // 3
    mesh = Mesh(points=freeze(points), counts=freeze(np.full(count, 3, np.int32)), corners=freeze(faces),
                parts=freeze(np.zeros(count, np.int32)), part_names=("arm",))
    sculpts = [Sculpt(p, bumped(rig, points, p, seed)) for seed, p in enumerate((BENT, FOLDED, BOTH))]
    item = MeshObject(id=1, name="arm", mesh=mesh, rig=rig, correctives=build(points, rig, sculpts).correctives)
    return Document(meshes=(item,))


def at(document, pose):
    item = find_mesh(document, 1)
    return evaluate(item.mesh.points, item.rig, item.correctives, pose)


def names(document):
    return [s.name for layer in find_mesh(document, 1).correctives.layers for s in layer.space.samples]


def test_a_sculpt_added_is_met_and_the_others_stay(document):
    item = find_mesh(document, 1)
    target = bumped(item.rig, item.mesh.points, NEW, 9)
    after = edits.add_sculpt(document, 1, NEW, target)
    assert np.abs(at(after, NEW) - target).max() < 2e-6
    for pose in (BENT, FOLDED, BOTH):
        assert np.abs(at(after, pose) - at(document, pose)).max() < 2e-6
    assert names(document) == ["bent", "folded", "both"]  # an edit never touches the value it is made from


def test_a_pose_without_a_sculpt_changes_nothing_there(document):
    after = edits.add_sculpt(document, 1, NEW)
    assert "raised" in names(after)
    assert np.abs(at(after, NEW) - at(document, NEW)).max() < 2e-6


def test_a_sculpt_of_a_file(document, tmp_path):
    item = find_mesh(document, 1)
    target = bumped(item.rig, item.mesh.points, NEW, 9)
    write_mesh(tmp_path / "raised.obj", item.mesh.replace(points=freeze(target)))
    assert np.abs(at(edits.import_sculpt(document, 1, NEW, tmp_path / "raised.obj"), NEW) - target).max() < 2e-6
    with pytest.raises(UserError, match="raised"):
        edits.import_sculpt(document, 1, NEW, tmp_path / "none.obj")


def test_delete_merge_move_and_rename(document):
    less = edits.remove_pose(document, 1, "bent")
    assert names(less) == ["folded", "both"]
    assert np.abs(at(less, FOLDED) - at(document, FOLDED)).max() < 2e-6
    assert np.abs(at(less, BOTH) - at(document, BOTH)).max() < 2e-6
    assert names(edits.merge_poses(document, 1, ["bent", "folded"])) == ["bent", "both"]
    moved = edits.move_pose(document, 1, "folded", turned("any", fore=(0, 0, 130)))
    there = find_mesh(moved, 1).correctives.layers[0].space.samples[1]
    assert there.name == "folded"
    assert there.pose.rotations["fore"] == turned("x", fore=(0, 0, 130)).rotations["fore"]
    named = edits.rename_pose(document, 1, "bent", "bow")
    assert names(named) == ["bow", "folded", "both"]
    for name, to in (("bent", "folded"), ("bent", "rest"), ("bent", "  "), ("nobody", "x")):
        with pytest.raises(UserError):
            edits.rename_pose(document, 1, name, to)


def test_the_last_pose_takes_its_layer_along(document):
    after = edits.remove_pose(document, 1, "both")
    assert len(find_mesh(after, 1).correctives.layers) == 1
    for name in ("bent", "folded"):
        after = edits.remove_pose(after, 1, name)
    assert find_mesh(after, 1).correctives.layers == ()


def test_a_space_is_changed_and_every_sculpt_still_met(document):
    for changes in ({"kernel": "thin-plate"}, {"normalise": "above-one"}, {"weighted": 4}):
        after = edits.set_space(document, 1, "fore", **changes)
        item = find_mesh(after, 1)
        errors = sculpt_errors(item.mesh.points, item.rig, item.correctives)
        assert max(e.max() for e in errors.values()) < 3e-6, changes
    with pytest.raises(UserError, match="kernel"):
        edits.set_space(document, 1, "fore", kernel="magic")


def test_a_smaller_falloff_reaches_less_far(document):
    between = turned("between", fore=(0, 0, 20))
    skin = evaluate(find_mesh(document, 1).mesh.points, find_mesh(document, 1).rig, None, between)

    def correction(document):
        return np.abs(at(document, between) - skin).max()

    narrow = edits.set_falloff(edits.set_falloff(document, 1, "bent", "fore", (0.1,)), 1, "folded", "fore", (0.1,))
    assert correction(narrow) < 0.2 * correction(document)
    again = edits.set_falloff(edits.set_falloff(narrow, 1, "bent", "fore", None), 1, "folded", "fore", None)
    assert abs(correction(again) - correction(document)) < 1e-6


def test_what_is_read_of_a_joint(document):
    after = edits.set_reading(document, 1, "fore", "fore", "swing")
    assert [d.kind for d in find_mesh(after, 1).correctives.layers[0].space.dofs] == ["swing"]
    assert np.abs(at(after, BENT) - at(document, BENT)).max() < 2e-6
    item = find_mesh(document, 1)
    twisted = turned("twisted", fore=(90, 0, 0))
    with_twist = edits.add_sculpt(document, 1, twisted, bumped(item.rig, item.mesh.points, twisted, 4))
    axis = next(d.axis for d in find_mesh(with_twist, 1).correctives.layers[0].space.dofs if d.control == "fore")
    if abs(axis[0]) > 0.999:
        with pytest.raises(Refusal, match="twisted"):
            edits.set_reading(with_twist, 1, "fore", "fore", "swing")


def test_layers_are_switched_named_and_taken_another_way(document):
    off = edits.set_layer_enabled(document, 1, "fore", False)
    skin = evaluate(find_mesh(document, 1).mesh.points, find_mesh(document, 1).rig, None, BENT)
    assert np.abs(at(off, BENT) - skin).max() < 1e-6
    assert find_mesh(edits.rename_layer(document, 1, "fore", "elbow"), 1).correctives.layers[0].name == "elbow"
    with pytest.raises(UserError):
        edits.rename_layer(document, 1, "fore", "fore+upper")
    mixed = edits.set_way(document, 1, "interpolation")
    assert {layer.kind for layer in find_mesh(mixed, 1).correctives.layers} == {"interpolation"}


def test_constraints_belong_to_the_rig(document):
    limit = Constraint(joint="fore", kind="limit")
    assert find_mesh(edits.set_constraints(document, 1, [limit]), 1).rig.constraints == (limit,)
    with pytest.raises(UserError, match="knee"):
        edits.set_constraints(document, 1, [Constraint(joint="knee", kind="limit")])


def test_a_mesh_without_a_rig_is_told():
    with pytest.raises(UserError, match="no mesh"):
        edits.remove_pose(Document(), 1, "x")
