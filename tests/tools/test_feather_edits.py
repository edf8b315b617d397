"""Edits of feathers: documents in, documents out, undone like everything else."""

import numpy as np
import pytest

from core.document import Document, MeshObject, without_groom, without_mesh
from core.errors import UserError
from core.evaluator import Evaluator
from core.feather.attributes import ATTRIBUTES, COLUMNS
from core.feather.coat.coat import Placement
from core.feather.coat.place import place_feathers
from core.feather.coat.plumage import Plumage
from core.feather.coat.worn import worn_preset, worn_values
from core.feather.presets import preset_values
from core.formats.project import read_project, write_project
from core.mesh.skin import skin_at_rest
from core.value import constant
from tests.core.feather.coat.bodies import egg
from tools import feather_edits as edits


@pytest.fixture(scope="module")
def evaluator():
    made = Evaluator()
    yield made
    made.close()


@pytest.fixture(scope="module")
def document(evaluator):
    bare = Document(meshes=(MeshObject(id=4, name="egg", mesh=egg()),))
    return edits.add_feathers(bare, 4, 60, evaluator, keys=6)


def test_feathers_come_with_keys_to_comb_and_go_with_their_mesh(document):
    coat = document.feathers[0]
    assert len(next(g for g in document.grooms if g.id == coat.keys_id).guides) == 6
    assert without_groom(document, coat.keys_id).feathers[0].keys_id is None
    assert without_mesh(document, 4).feathers == ()
    assert edits.remove_feathers(document, coat.id).feathers == ()


def test_a_feather_taken_over_is_kept_in_the_file_and_given_back(document, evaluator, tmp_path):
    coat = document.feathers[0]
    plumage = Plumage(evaluator)
    taken = edits.promote_feather(document, coat.id, 11, plumage, 1001.0)
    shaft = taken.feathers[0].proxies[0].rest + np.float32(0.01)
    moved = edits.key_feather(taken, coat.id, 11, 1005.0, shaft)
    write_project(tmp_path / "bird.filo", moved)
    again = read_project(tmp_path / "bird.filo").document
    mesh, keys = document.meshes[0].mesh, document.grooms[0]
    rest = plumage.at_rest(coat, keys, mesh)
    known = plumage.at_frame(moved.feathers[0], keys, mesh, rest.skin, 1005.0)
    mesh = again.meshes[0].mesh
    loaded = Plumage(evaluator).at_frame(
        again.feathers[0], again.grooms[0], mesh, skin_at_rest(mesh, evaluator), 1005.0)
    np.testing.assert_array_equal(known.layered.vanes, loaded.layered.vanes)
    assert (known.layered.vanes[11] != rest.layered.vanes[11]).any()
    assert edits.demote_feather(moved, coat.id, 11).feathers[0].proxies == ()


def test_tracts_strokes_placements_and_fields_are_set(document):
    coat = document.feathers[0]
    line = [[0.0, 0.3, -0.3], [0.0, 0.3, 0.3]]
    made = edits.add_tract(document, coat.id, "back", line, 0.2)
    made = edits.add_placement(made, coat.id, Placement(kind="even", count=10, tract="back"))
    made = edits.set_feathers(edits.add_stroke(made, coat.id, line), coat.id, ruffle=constant(0.5))
    found = made.feathers[0]
    assert (len(found.placements), found.tracts[0].name, found.direction) == (2, "back", "strokes")
    assert document.feathers[0] is coat


def test_attributes_and_dials_of_a_coat_shape_its_feathers_and_go_back(document):
    coat = document.feathers[0]
    body = preset_values("goldfinch-breast")
    made = edits.set_attributes(document, coat.id, {"vaneWidthLeft": 0.4, "vaneCupRight": constant(1.0)})
    made = edits.turn_dial(made, coat.id, "stiffness", 1.0)
    worn = worn_values(made.feathers[0], "goldfinch-breast")
    assert worn[COLUMNS["vaneWidthLeft"]] == np.float32(0.4)
    assert worn[COLUMNS["vaneCupRight"]] == 1.0
    np.testing.assert_allclose(worn[COLUMNS["shaftRadius"]], 1.5 * body[COLUMNS["shaftRadius"]], rtol=1e-6)
    made = edits.turn_dial(edits.reset_attributes(made, coat.id, ["vaneWidthLeft"]), coat.id, "stiffness", 0.0)
    worn = worn_values(made.feathers[0], "goldfinch-breast")
    assert [ATTRIBUTES[k].name for k in np.flatnonzero(worn != body)] == ["vaneCupRight"]
    assert worn_values(edits.reset_attributes(made, coat.id).feathers[0], "goldfinch-breast") is body


def test_placements_are_changed_and_taken_away_and_ids_of_the_others_stay(document, evaluator):
    coat = document.feathers[0]
    mixed = edits.add_placement(document, coat.id, Placement(kind="even", count=12))
    mixed = edits.set_placement(mixed, coat.id, 1, count=9, seed=3)
    assert [(p.kind, p.count, p.seed) for p in mixed.feathers[0].placements] == [("rows", 60, 0), ("even", 9, 3)]
    ids = place_feathers(mixed.feathers[0], document.meshes[0].mesh, (), evaluator).ids
    fewer = edits.remove_placement(mixed, coat.id, 0).feathers[0]
    np.testing.assert_array_equal(place_feathers(fewer, document.meshes[0].mesh, (), evaluator).ids, ids[60:])
    assert len(edits.remove_placement(mixed, coat.id, 1).feathers[0].placements) == 1
    with pytest.raises(UserError, match="no number 7"):
        edits.set_placement(document, coat.id, 7, count=1)
    with pytest.raises(UserError, match="field_map"):
        edits.set_placement(document, coat.id, 0, kind="field")


def test_keys_draw_tracts_and_directions(document):
    coat, guides = document.feathers[0], document.grooms[0].guides
    chosen = guides.ids[[0, 3, 5]]
    made = edits.tract_of_keys(document, coat.id, chosen, "back")
    held = edits.set_placement(made, coat.id, 0, tract="back")
    tract = held.feathers[0].tracts[0]
    assert {tuple(point) for point in tract.line} == {tuple(point) for point in guides.points[[0, 3, 5], 0]}
    assert tract.width > 0.0
    free = edits.remove_tract(held, coat.id, "back").feathers[0]
    assert free.tracts == ()
    assert free.placements[0].tract is None
    along = edits.strokes_of_keys(document, coat.id, chosen[:1]).feathers[0]
    assert along.direction == "strokes"
    np.testing.assert_array_equal(along.strokes[0].points, guides.points[0])
    with pytest.raises(UserError, match="two or more keys"):
        edits.tract_of_keys(document, coat.id, chosen[:1], "back")
    with pytest.raises(UserError, match="Select the keys"):
        edits.strokes_of_keys(document, coat.id, [])


def test_a_coat_becomes_a_feather_of_another_bird(document):
    wanted = preset_values("owl-primary")
    turned = edits.turn_dial(document, 1, "wear", 0.5)
    made = edits.wear_feather(turned, 1, wanted).feathers[0]
    np.testing.assert_array_equal(worn_values(made, worn_preset(made)), wanted)


def test_what_cannot_be_done_is_said(document, evaluator):
    coat = document.feathers[0]
    for edit, words in (
        (lambda: edits.set_feathers(document, coat.id, colour=1), "no colour"),
        (lambda: edits.set_feathers(document, coat.id, ruffle=constant(99.0)), "ruffle"),
        (lambda: edits.set_feathers(document, 9), "no feathers 9"),
        (lambda: edits.promote_feather(document, coat.id, 999, Plumage(evaluator), 1.0), "no feather 999"),
        (lambda: edits.demote_feather(document, coat.id, 3), "not animated by hand"),
        (lambda: edits.add_tract(edits.set_feathers(document, coat.id, locked=True), coat.id, "a", [[0, 0, 0]], 1.0),
         "locked"),
    ):
        with pytest.raises(UserError, match=words):
            edit()
