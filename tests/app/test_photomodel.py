import json

import cv2
import numpy as np
import pytest
import trimesh
from typer.testing import CliRunner

from app.cli import build
from core.errors import UserError
from core.formats.picks_json import read_picks
from core.formats.project import read_project
from core.match.photomodel.rows import seen_by
from tests.core.match.photomodel.scenes import HOUSE, NAMES, photo

SIZE = (600, 400)
PHOTOS = tuple(
    photo(k, centre, size=SIZE, focal=520.0) for k, centre in enumerate([(-6, 2, -9), (2, 4, -12), (10, 3, -8)], 1))


def _picks(folder, **more):
    """Photographs of a house with its sky, and the file of what was picked in them."""
    rng = np.random.default_rng(0)
    for one in PHOTOS:
        picture = np.full((SIZE[1], SIZE[0], 3), 90 + 40 * one.id, np.uint8)
        cv2.imwrite(str(folder / f"house_{one.id}.png"), picture)
    seen = [seen_by(one, HOUSE)[0] + rng.normal(0, 0.1, (len(HOUSE), 2)) for one in PHOTOS]
    made = {
        "photographs": [
            {"name": f"h{one.id}", "path": f"house_{one.id}.png", "focal_px": one.focal_px} for one in PHOTOS],
        "points": [
            {"name": name, "picks": {f"h{k + 1}": list(map(float, xy[row])) for k, xy in enumerate(seen)}}
            for row, name in enumerate(NAMES)
        ],
        "known": [{"kind": "right", "points": ["a", "b", "a", "e"]}],
        "frame": {"origin": "a", "axis": ["a", "b"], "plane": ["a", "b", "c"], "distance": ["a", "b"], "length": 4},
        "parts": [{"name": "walls", "kind": "box", "points": ["a", "b", "d", "e"]}],
        **more,
    }
    path = folder / "house.json"
    path.write_text(json.dumps(made))
    return path


def _run(*words):
    return CliRunner().invoke(build(("photomodel", "bench")), ["photomodel", *map(str, words)])


def test_picks_become_a_model_a_mesh_and_its_texture(tmp_path):
    picks, project, out = _picks(tmp_path), tmp_path / "house.filo", tmp_path / "house.obj"
    done = _run(project, "--picks", picks, "--solve", "-o", out, "--texture", 256, "--json")
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    assert told["cameras"] == 3
    assert told["points"] == 12
    assert told["rms_px"] < 0.3
    np.testing.assert_allclose(told["places"]["g"], [4, 3, 6], atol=0.2)
    assert {"kind": "right"}.items() <= told["constraints"][0].items()
    mesh = trimesh.load(out, process=False)
    assert mesh.visual.material.image.size == (256, 256)
    assert 60 < abs(mesh.volume) < 85
    kept = read_project(project).document
    assert kept.photomodels[0].photos[2].rotation is not None
    assert {plate.path for plate in kept.plates} == {"house_#.png"}
    assert [one.frame for one in kept.photomodels[0].photos] == [1, 2, 3]
    again = json.loads(_run(project, "--solve", "--json").stdout)
    assert again["rms_px"] == pytest.approx(told["rms_px"], rel=1e-3)


def test_a_project_without_a_model_says_so(tmp_path):
    picks = _picks(tmp_path, points=[], parts=[], known=[], frame=None)
    with pytest.raises(UserError, match="0 tracks"):
        raise _run(tmp_path / "a.filo", "--picks", picks, "--solve").exception
    _run(tmp_path / "b.filo", "--picks", picks)
    with pytest.raises(UserError, match="no model 'x'"):
        raise _run(tmp_path / "b.filo", "--model", "x").exception


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"points": [{"name": "a", "picks": {"nobody": [1, 2]}}]}, "'nobody'"),
        ({"points": [{"name": "a"}, {"name": "a"}]}, "given twice"),
        ({"points": [{"name": "a", "picks": {"h1": [1e9, 2]}}]}, "pixels away"),
        ({"photographs": [{"name": "h1"}]}, "path or a size"),
        ({"photographs": "x"}, "Expected `array`"),
        ({"known": [{"kind": "round", "points": []}]}, "must be one of"),
        ({"more": 1}, "more"),
    ],
)
def test_a_file_of_picks_that_is_none_is_refused_in_words(tmp_path, change, words):
    path = tmp_path / "picks.json"
    whole = {"photographs": [{"name": "h1", "size": [100, 100]}], "points": [{"name": "a"}], **change}
    path.write_text(json.dumps(whole))
    with pytest.raises(UserError, match=words):
        read_picks(path)
