"""Birds with wings on the command line: dressed from a project, baked and written with their wings as they lie."""

import json

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from app import cli
from core.demo.bird_document import bare_bird_document
from core.document import keys_of
from core.evaluator import Evaluator
from core.feather.coat.plumage import Plumage
from core.feather.coat.wing import WING_IDS
from core.formats.project import read_project, write_project
from core.mesh.skin import skin_posed
from core.pose.skinning import posed_points


def told(capsys, *arguments):
    with pytest.raises(SystemExit) as left:
        cli.main([*map(str, arguments), "--json"])
    assert left.value.code == 0
    return json.loads(capsys.readouterr().out)


def test_a_bird_with_wings_leaves_with_them_frame_by_frame(tmp_path, capsys):
    bare, dressed, coat = (tmp_path / name for name in ("bare.filo", "dressed.filo", "coat.usdc"))
    write_project(bare, bare_bird_document())
    result = told(
        capsys, "feathers", bare, "-o", dressed, "-o", coat, "--count", 300, "--keys", 40, "--frames", "1001-1002")
    document = read_project(dressed).document
    many = sum(row.count for wing in document.feathers[0].wings for row in wing.rows)
    assert (result["feathers"], result["wing_feathers"]) == (300, many)
    assert result["crossings_within_wings"] < many
    stage = Usd.Stage.Open(str(coat))
    instancer = UsdGeom.PointInstancer(stage.GetPrimAtPath("/Feathers/feathers"))
    assert len(instancer.GetIdsAttr().Get(1002.0)) == 300
    wings = UsdGeom.Mesh(stage.GetPrimAtPath("/Feathers/feathers_wings"))
    ids = np.array(UsdGeom.PrimvarsAPI(wings).GetPrimvar("feather_id").Get(1002.0))
    assert len(np.unique(ids)) == many
    assert ids.min() >= WING_IDS
    evaluator, item = Evaluator(), document.meshes[0]
    skin = skin_posed(item.mesh, posed_points(item.mesh.points, item.rig, 1002.0), evaluator)
    worn = document.feathers[0]
    laid = Plumage(evaluator).at_frame(worn, keys_of(document, worn), item.mesh, skin, 1002.0)
    np.testing.assert_allclose(
        np.array(wings.GetPointsAttr().Get(1002.0)), laid.layered.vanes[laid.ids >= WING_IDS].reshape(-1, 3), atol=1e-6)


def test_wings_are_left_out_when_asked(tmp_path, capsys):
    bare, plain = tmp_path / "bare.filo", tmp_path / "plain.filo"
    write_project(bare, bare_bird_document())
    result = told(capsys, "feathers", bare, "-o", plain, "--count", 60, "--keys", 12, "--no-wings")
    assert "wing_feathers" not in result
    assert read_project(plain).document.feathers[0].wings == ()


def test_a_project_with_wings_is_baked(tmp_path, capsys):
    bare, dressed = tmp_path / "bare.filo", tmp_path / "dressed.filo"
    write_project(bare, bare_bird_document())
    told(capsys, "feathers", bare, "-o", dressed, "--count", 60, "--keys", 12)
    result = told(capsys, "bake", dressed, "--frames", "1014-1015", "-o", tmp_path, "--processes", 1)
    stages = [Usd.Stage.Open(path) for path in result["outputs"]]
    meshes = [UsdGeom.Mesh(stage.GetPrimAtPath("/Feathers/feathers_wings")) for stage in stages]
    first, second = (np.array(mesh.GetPointsAttr().Get(1014.0 + k)) for k, mesh in enumerate(meshes))
    assert first.shape == second.shape
    assert np.linalg.norm(first - second, axis=1).max() > 0.002  # metres: the wing opens
