"""Feathers from the command line: dressed, baked, published, refused."""

import json
import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from pxr import Usd, UsdGeom

from app import cli
from core.formats.mesh_file import write_mesh
from core.formats.project import read_project
from tests.core.feather.coat.bodies import egg


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
    made = told(capsys, "publish", project, "--to", tmp_path / "shot", "--note", "first look", "--no-picture")
    version = json.loads((Path(made["path"]) / "version.json").read_text())
    assert version["note"] == "first look"
    assert set(version["files"]) == {"bird.filo", "feathers_1.usdc"}
    assert os.readlink(tmp_path / "shot" / "latest") == "v001"


@pytest.mark.parametrize(("arguments", "code", "words"), [
    (["feathers", "{bird}", "-o", "{tmp}/coat.fbx"], 1, "usdc"),
    (["feathers", "{tmp}/none.obj", "-o", "{tmp}/coat.usdc"], 1, "none.obj"),
    (["feathers", "{bird}", "-o", "{tmp}/coat.usdc", "--placement", "heap"], 2, "heap"),
    (["feathers", "{bird}", "-o", "{tmp}/coat.usdc", "--frames", "9-1"], 2, "before"),
    (["bake", "{bird}", "--frames", "1-2"], 1, "no project"),
    (["publish", "{bird}", "--to", "{tmp}/shot"], 1, "no project"),
])
def test_what_cannot_be_done_is_said_in_one_sentence(bird, tmp_path, capsys, arguments, code, words):
    found = told(capsys, *(part.format(bird=bird, tmp=tmp_path) for part in arguments), code=code)
    assert words in found["error"]
    assert "\n" not in found["error"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bird.obj"]
