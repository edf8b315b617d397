"""The command solves a plate together with a witness, photographs and a mesh that moves by itself."""

import json
import os
import re
from pathlib import Path

import numpy as np
import pytest
from pxr import Usd, UsdGeom
from scipy.spatial.transform import Rotation

from core.formats.lens_file import read_lens
from core.match.solve.shot import FLIP
from core.match.solve.state import projected
from tests.app.command_line import filoplume
from tests.core.match.solve.shots import SIZE, shot
from tests.core.match.solve.test_moving import HEAD, _head
from tests.core.match.solve.test_views import PHONE, _stills

DATA = os.environ.get("FILOPLUME_DATA")


def _tracks(rows, prefix: str, first: int) -> list[dict]:
    return [
        {"name": f"{prefix}{k}", "points": [
            [int(rows.frame[n]) + first, *rows.xy[n].tolist()] for n in np.flatnonzero(rows.track == k)]}
        for k in np.unique(rows.track)
    ]


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A plate with a head before it, a witness of another lens, photographs; and the truth."""
    folder = tmp_path_factory.mktemp("together")
    made = shot("orbit", 40, 12, seed=1)
    truth, head = _head(8, seed=1)
    head = head.take(head.frame < 12)

    def write(name, content):
        (folder / name).write_text(json.dumps(content))

    write("plate.json", {"size": SIZE, "tracks": _tracks(made.observations, "t", 1001) + _tracks(head, "h", 1001)})
    witness = PHONE._replace(size=(1280, 720), focal=1000.0, k1=-0.06)
    _, seen = _stills(6, made.truth.points, witness, seed=3)
    write("b.json", {"size": [1280, 720], "tracks": _tracks(seen, "t", 1)})
    write("witness.json", {"tracks": "b.json", "name": "B", "focal_px": 1030.0, "find_focal": True, "find_k1": True})
    _, seen = _stills(3, made.truth.points, PHONE, seed=4)
    picks = [{"name": f"t{k}", "sigma": 0.5, "picks": {
        f"p{seen.frame[n]}": seen.xy[n].tolist() for n in np.flatnonzero(seen.track == k)}} for k in range(40)]
    write("photos.json", {
        "photographs": [{"name": f"p{k}", "size": PHONE.size, "focal_px": PHONE.focal} for k in range(3)],
        "points": picks})
    rows = "".join("v {} {} {}\n".format(*place) for place in HEAD)
    (folder / "head.obj").write_text(rows + "f 1 2 3\nf 4 5 6\n")
    write("head.json", {"mesh": "head.obj", "points": {"h0": 0} | {f"h{k}": HEAD[k].tolist() for k in range(1, 8)}})
    return folder, made, truth


def _solved(folder, *options):
    done = filoplume("solve", folder / "plate.json", "--focal-px", 1600, *options, "--json")
    return json.loads(done.stdout) if done.returncode == 0 else done.stderr


def test_a_witness_and_photographs_stand_where_they_stood_and_the_head_is_in_the_file(files):
    folder, _, truth = files
    out = folder / "shot.usda"
    told = _solved(
        folder, "--with", folder / "witness.json", "--with", folder / "photos.json", "--object", folder / "head.json",
        "-o", out)
    assert (told["cameras"], told["points"], told["frames"]) == (12, 40, [1001, 1012])
    names = [one["name"] for one in told["others"]]
    assert names == [f"B {k}" for k in range(1, 7)] + [f"photograph p{k}" for k in range(3)]
    assert told["others"][0]["focal_px"] == pytest.approx(1000.0, rel=5e-3)
    assert told["others"][0]["k1"] == pytest.approx(-0.06, abs=0.006)
    assert "Nothing says how large" in told["warnings"][0]
    head = told["things"][0]
    assert (head["name"], head["poses"], head["left_out"]) == ("head", 12, 0)
    assert head["rms_px"] == pytest.approx(0.3 * np.sqrt(2) * np.sqrt(1 - 6 / 16), rel=0.15)
    assert 0.01 < head["turn_sigma_degrees"] < 0.1
    # through the camera of the file, each point of the mesh is where it was tracked
    stage = Usd.Stage.Open(str(out))
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/Solve/head/mesh"))
    points = np.array(mesh.GetPointsAttr().Get(), float)
    for row in (0, 7):
        now = Usd.TimeCode(1001 + row)
        camera = np.array(UsdGeom.Camera(stage.GetPrimAtPath("/Solve/camera")).GetCamera(now).transform).T
        world = np.array(UsdGeom.Imageable(mesh).ComputeLocalToWorldTransform(now)).T
        seen = np.linalg.inv(camera) @ world @ np.column_stack([points, np.ones(len(points))]).T
        turn = FLIP @ (np.linalg.inv(camera) @ world)[:3, :3]
        apart = Rotation.from_matrix(turn @ truth.rotation[row].T).magnitude()
        assert np.degrees(apart) < 0.2
        there = points @ truth.rotation[row].T + truth.translation[row]
        np.testing.assert_allclose((seen[:2] / -seen[2]).T * [1, -1], there[:, :2] / there[:, 2:], atol=1.0 / 1600)


@pytest.mark.skipif(DATA is None, reason="FILOPLUME_DATA is not set")
def test_a_lens_of_a_chessboard_is_given_to_a_solve_and_to_maps(tmp_path):
    folder = Path(str(DATA)) / "matchmove" / "stereo_chessboard_1" / "calib_imgs" / "1"
    photographs = [folder / f"left{k}.jpg" for k in (1, 11, 12, 13)]
    done = filoplume("grid", *photographs, "--grid", "9x6", "-o", tmp_path / "lens.json", "--json")
    told = json.loads(done.stdout)
    assert (told["photographs"], told["warnings"]) == (4, [])
    assert told["rms_px"] < 0.5
    lens, size = read_lens(tmp_path / "lens.json", None)
    assert told["focal_px"] == pytest.approx(np.exp(lens[0]))
    made = shot("orbit", 40, 20, seed=2)
    truth = made.truth._replace(lens=lens)
    xy, depth = projected(truth, made.observations.frame, truth.points[made.observations.track])
    inside = np.flatnonzero((depth > 0) & (xy > 0).all(1) & (xy < size).all(1))
    rows = made.observations._replace(xy=xy + np.random.default_rng(0).normal(0, 0.1, xy.shape)).take(inside)
    (tmp_path / "plate.json").write_text(json.dumps({"size": size, "tracks": _tracks(rows, "t", 1)}))
    given = ("--lens-file", tmp_path / "lens.json")
    told = json.loads(filoplume("solve", tmp_path / "plate.json", *given, "-o", tmp_path / "a.usda", "--json").stdout)
    assert told["rms_px"] < 0.2
    assert not told["warnings"]
    np.testing.assert_allclose(read_lens(tmp_path / "a.usda", None)[0], lens, atol=1e-6)
    assert filoplume("stmap", tmp_path / "lens.json", "--undistort", tmp_path / "u.exr").returncode == 0
    wrong = json.loads((tmp_path / "lens.json").read_text()) | {"size": [320, 180]}
    (tmp_path / "lens.json").write_text(json.dumps(wrong))
    assert "320 x 180" in filoplume("solve", tmp_path / "plate.json", *given).stderr


@pytest.mark.parametrize(("content", "words"), [
    ('{"tracks": "none.json"}', "none.json"), ('{"size": [3, 4]}', "neither tracks"), ("[", "not a witness"),
    ('{"tracks": "b.json", "focal_px": -4}', "focal length of -4"),
])  # fmt: skip
def test_what_is_no_witness_is_refused(files, content, words):
    (files[0] / "bad.json").write_text(content)
    assert words in _solved(files[0], "--with", files[0] / "bad.json")


@pytest.mark.parametrize(("points", "words"), [
    ('{"h0": 99, "h1": 1, "h2": 2, "h3": 3, "h4": 4}', "no vertex 99"),
    ('{"h0": 0, "h1": 1, "h2": 2, "h3": 3, "nobody": 4}', "no track 'nobody'"),
    ('{"h0": 0}', "head.*points of its mesh"),
])  # fmt: skip
def test_a_thing_that_cannot_be_is_refused(files, points, words):
    (files[0] / "head_bad.json").write_text(f'{{"name": "head", "mesh": "head.obj", "points": {points}}}')
    told = _solved(files[0], "--object", files[0] / "head_bad.json")
    assert isinstance(told, str)
    assert re.search(words, told)
