"""Feathers from the command line: dressed, baked, published, refused."""

import json
import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from pxr import Usd, UsdGeom

from app import cli
from app.feather_frames import CURVES, say_beyond_clips
from app.report import Report
from core.document import Document, MeshObject, with_feathers, with_groom
from core.evaluator import Evaluator
from core.feather.coat.dress import dress_feathers
from core.formats.mesh_file import write_mesh
from core.formats.project import read_project, write_project
from core.groom.dress import dress
from core.groom.groom import Map
from core.groom.style import load_style
from core.record import freeze
from tests.core.feather.coat.bodies import egg
from tests.tools import scenes


@pytest.fixture
def bird(tmp_path):
    path = tmp_path / "bird.obj"
    write_mesh(path, egg())
    return path


def told(capsys, *arguments, code=0):
    with pytest.raises(SystemExit) as left:
        cli.main([*map(str, arguments), "--json"])
    assert left.value.code == code
    return json.loads(capsys.readouterr().out)


@pytest.mark.parametrize(("count", "placement"), [(0, "rows"), (137, "rows"), (90, "repulsion")])
def test_a_bird_is_dressed_with_exactly_the_count(bird, tmp_path, capsys, count, placement):
    out = tmp_path / "coat.usdc"
    found = told(capsys, "feathers", bird, "-o", out, "--count", count, "--keys", 9, "--placement", placement)
    assert {"keys", "feathers", "crossings", "skin_hits", "seconds", "outputs"} <= found.keys()
    assert (found["keys"], found["feathers"], found["crossings"], found["skin_hits"]) == (9, count, 0, 0)
    stage = Usd.Stage.Open(found["outputs"][0])
    ids = np.array(UsdGeom.PointInstancer(stage.GetPrimAtPath("/Feathers/feathers")).GetIdsAttr().Get())
    assert len(ids) == len(np.unique(ids)) == count


@pytest.mark.parametrize("form", [("--meshes",), ("--nurbs",), *(("--curves", kind) for kind in CURVES)])
@pytest.mark.parametrize("count", [0, 23])
def test_every_form_holds_every_feather_in_every_frame(bird, tmp_path, capsys, form, count):
    out = tmp_path / "coat.usdc"
    found = told(
        capsys, "feathers", bird, "-o", out, "--count", count, "--keys", 6, "--frames", "1001-1002", "--barbs", 4,
        *form)
    assert (found["feathers"], found["crossings"]) == (count, 0)
    stage = Usd.Stage.Open(str(out))
    for frame in (1001.0, 1002.0):
        ids = []
        for prim in stage.Traverse():
            made = UsdGeom.PrimvarsAPI(prim).GetPrimvar("feather_id")
            if made.IsDefined() and not prim.IsA(UsdGeom.NurbsPatch):
                ids += list(made.Get(frame) or ())
        assert len(set(ids)) == count


def test_two_forms_at_once_are_wrong_usage(bird, tmp_path, capsys):
    with pytest.raises(SystemExit) as left:
        cli.main(["feathers", str(bird), "-o", str(tmp_path / "a.usdc"), "--meshes", "--nurbs"])
    assert left.value.code == 2
    assert "choose one of" in capsys.readouterr().err


def test_a_project_of_feathers_is_baked_and_published(bird, tmp_path, capsys):
    project = tmp_path / "bird.filo"
    told(capsys, "feathers", bird, "-o", project, "--count", 60, "--keys", 6)
    document = read_project(project).document
    assert document.feathers[0].keys_id == document.grooms[0].id
    for file, name in ((project, "dressed"), (bird, "bare")):
        told(capsys, "render", file, "-o", tmp_path / f"{name}.png", "--size", "160x120")
    dressed, bare = (cv2.imread(str(tmp_path / f"{name}.png")).astype(float) for name in ("dressed", "bare"))
    there = np.abs(bare - bare[0, 0]).max(axis=2) > 40  # the body before the background
    yellow = dressed[..., 2] - dressed[..., 0]  # of a goldfinch; the bare body is grey
    assert there.sum() > 1000
    assert (yellow[there] > 40).mean() > 0.5
    assert np.abs(bare[..., 2] - bare[..., 0])[there].max() < 40
    baked = told(capsys, "bake", project, "--frames", "1001-1003", "--processes", 1)
    assert [Path(path).name for path in baked["outputs"]] == [f"bird.feathers.{n}.usdc" for n in (1001, 1002, 1003)]
    first = Usd.Stage.Open(baked["outputs"][0]).ExportToString()
    again = told(capsys, "bake", project, "--frames", "1001", "--processes", 1)
    assert Usd.Stage.Open(again["outputs"][0]).ExportToString() == first
    pooled = told(
        capsys, "bake", project, "--frames", "1001-1002", "--processes", 2, "--curves", "barbs", "--barbs", 3,
        "-o", tmp_path)
    alone = Usd.Stage.Open(pooled["outputs"][1]).ExportToString()
    told(
        capsys, "bake", project, "--frames", "1002", "--processes", 1, "--curves", "barbs", "--barbs", 3,
        "-o", tmp_path)
    Usd.Stage.Open(pooled["outputs"][1]).Reload()
    assert Usd.Stage.Open(pooled["outputs"][1]).ExportToString() == alone
    made = told(capsys, "publish", project, "--to", tmp_path / "shot", "--note", "first look", "--no-picture")
    version = json.loads((Path(made["path"]) / "version.json").read_text())
    assert version["note"] == "first look"
    assert set(version["files"]) == {"bird.filo", "feathers_1.usdc"}
    assert os.readlink(tmp_path / "shot" / "latest") == "v001"


def test_an_owl_with_feathers_and_bristles_round_its_beak_is_one_file(tmp_path, capsys):
    mesh, beak, project = egg(), np.array([0.0, 0.0, 0.6]), tmp_path / "owl.filo"
    near = Map(name="beak", values=freeze((np.linalg.norm(mesh.points - beak, axis=1) < 0.2).astype(np.float32)))
    evaluator = Evaluator()
    coat, keys = dress_feathers(mesh, evaluator, 80, preset="owl", keys=6)
    bristles = dress(
        mesh, load_style("short"), evaluator, 12, 40, maps=(near,), density_map="beak", name="bristles").replace(id=2)
    evaluator.close()
    owl = Document(meshes=(MeshObject(id=1, name="owl", mesh=mesh),))
    write_project(project, with_groom(with_feathers(with_groom(owl, keys), coat), bristles))
    made = Path(told(capsys, "publish", project, "--to", tmp_path / "owl", "--no-picture")["path"])
    assert {path.name for path in made.iterdir()} == {"owl.filo", "feathers_1.usdc", "groom_2.usdc", "version.json"}
    feathers, hair = (Usd.Stage.Open(str(made / name)) for name in ("feathers_1.usdc", "groom_2.usdc"))
    assert len(UsdGeom.PointInstancer(feathers.GetPrimAtPath("/Feathers/feathers")).GetIdsAttr().Get()) == 80
    hairs = [UsdGeom.BasisCurves(prim) for prim in hair.Traverse() if prim.IsA(UsdGeom.BasisCurves)]
    most = max(hairs, key=lambda curves: len(curves.GetCurveVertexCountsAttr().Get()))
    counts = np.array(most.GetCurveVertexCountsAttr().Get())
    assert len(counts) == 40
    roots = np.array(most.GetPointsAttr().Get())[np.cumsum(counts) - counts]
    assert np.linalg.norm(roots - beak, axis=1).max() < 0.35  # the map fades over the next vertices


@pytest.mark.parametrize(("clip", "frames", "words"), [
    (False, (1001, 1002), "no clip"), (True, (1, 36), "all of 1-36"), (True, (1021, 1040), "all of 1021-1040"),
    (True, (1010, 1021), "before and after"), (True, (1000, 1005), "before and after"), (True, (1001, 1020), None),
])
def test_frames_outside_the_clip_are_said(clip, frames, words, capsys):
    document = scenes.document(**({} if clip else {"rig": None}))
    say_beyond_clips(document, frames, Report(True))
    said = capsys.readouterr().err
    assert said.count("note:") == (words is not None)
    assert words is None or words in said


@pytest.mark.parametrize(("arguments", "code", "words"), [
    (["feathers", "{bird}", "-o", "{tmp}/coat.fbx"], 1, "usdc"),
    (["feathers", "{tmp}/none.obj", "-o", "{tmp}/coat.usdc"], 1, "none.obj"),
    (["feathers", "{bird}", "-o", "{tmp}/coat.usdc", "--placement", "heap"], 2, "heap"),
    (["feathers", "{bird}", "-o", "{tmp}/coat.usdc", "--frames", "9-1"], 2, "before"),
    (["feathers", "{bird}", "-o", "{tmp}/coat.usdc", "--frames", "1001-"], 2, "two numbers"),
    (["bake", "{bird}", "--frames", "1-2"], 1, "no project"),
    (["publish", "{bird}", "--to", "{tmp}/shot"], 1, "no project"),
])
def test_what_cannot_be_done_is_said_in_one_sentence(bird, tmp_path, capsys, arguments, code, words):
    found = told(capsys, *(part.format(bird=bird, tmp=tmp_path) for part in arguments), code=code)
    assert words in found["error"]
    assert "\n" not in found["error"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bird.obj"]
