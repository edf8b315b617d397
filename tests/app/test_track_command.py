"""``filoplume track`` and ``filoplume flow`` as a script calls them."""

import json

import cv2
import numpy as np
import pytest

from core.formats.flow_file import read_flo
from tests.app import command_line
from tests.core.match.plates import frame, place

POINT = np.array([70.0, 62.0])


def filoplume(*arguments):
    """Exit code, standard output and standard error."""
    return tuple(command_line.filoplume(*arguments))


@pytest.fixture(scope="module")
def plate(tmp_path_factory):
    """Frames 1001 to 1008, without 1005, and 1006 broken."""
    path = tmp_path_factory.mktemp("plate")
    for k in range(8):
        cv2.imwrite(str(path / f"shot.{1001 + k}.png"), np.round(frame(k)[:, :, ::-1]).clip(0, 255).astype(np.uint8))
    (path / "shot.1005.png").unlink()
    (path / "shot.1006.png").write_bytes(b"\x89PNG\r\n\x1a\n broken")
    return path


def test_keys_are_followed_in_the_numbers_of_the_files(plate, tmp_path):
    keys, out, page = tmp_path / "in.json", tmp_path / "out.json", tmp_path / "page.html"
    keys.write_text(
        json.dumps(
            {"size": [160, 120], "frames": [1001, 1008], "tracks": [{"name": "eye", "points": [[1001, *POINT]]}]}
        )
    )
    code, words, _ = filoplume("track", plate, "--tracks", keys, "--tracks-out", out, "--report", page, "--json")
    assert code == 0
    result = json.loads(words)
    assert {"frames", "tracks", "observations", "seconds", "ms_per_track_frame", "warnings"} <= result.keys()
    assert (result["frames"], result["tracks"], result["observations"]) == ([1001, 1008], 1, 6)
    assert any("1005" in w for w in result["warnings"])
    assert any("1006" in w for w in result["warnings"])
    made = json.loads(out.read_text())
    assert (made["size"], made["frames"]) == ([160, 120], [1001, 1008])
    (track,) = made["tracks"]
    assert track["name"] == "eye"
    assert [p[0] for p in track["points"]] == [1001, 1002, 1003, 1004, 1007, 1008]
    for number, x, y, sxx, sxy, syy, score in track["points"]:
        assert np.linalg.norm([x, y] - place(POINT, number - 1001)) < 0.15
        assert sxx > 0
        assert sxx * syy > sxy**2
        assert 0 <= score <= 1
    text = page.read_text()
    assert "eye" in text
    assert 'src="http' not in text


def test_a_part_of_the_plate_is_tracked_and_the_rest_stays(plate, tmp_path):
    keys, out = tmp_path / "in.json", tmp_path / "out.json"
    old = [1001, *POINT, 0.01, 0.0, 0.01, 0.5]
    given = [
        {"name": "first", "keys": [1003], "points": [old, [1003, *place(POINT, 2)]]},
        {"name": "away", "points": [[1001, *POINT]]},
    ]
    keys.write_text(json.dumps({"tracks": given}))
    arguments = ("--tracks", keys, "--frames", "1003-1004", "--tracks-out", out, "--auto", "900", "--json")
    code, words, error = filoplume("track", plate, *arguments)
    assert code == 0, error
    first, away = json.loads(out.read_text())["tracks"][:2]
    assert [p[0] for p in first["points"]] == [1001, 1003, 1004]
    assert first["points"][0][1:] == pytest.approx(old[1:])
    assert [p[0] for p in away["points"]] == [1001]
    warnings = json.loads(words)["warnings"]
    assert any("away" in w and "left as it was" in w for w in warnings)
    assert any("of 900 features" in w for w in warnings)


def test_features_are_found_by_themselves_and_masks_hold_them_off(plate, tmp_path):
    masks, out = tmp_path / "masks.json", tmp_path / "out.json"
    left = [[-1, -1], [80, -1], [80, 130], [-1, 130]]
    masks.write_text(json.dumps({"masks": [{"keys": [[1001, left]]}]}))
    code, words, _ = filoplume("track", plate, "--auto", "10", "--masks", masks, "--tracks-out", out, "--json")
    assert code == 0
    assert json.loads(words)["tracks"] >= 8
    assert min(track["points"][0][1] for track in json.loads(out.read_text())["tracks"]) > 80


def test_a_plate_becomes_a_camera_in_one_command(plate, tmp_path):
    from pxr import Usd, UsdGeom

    out, page = tmp_path / "shot.usda", tmp_path / "solve.html"
    code, words, error = filoplume(
        "track", plate, "--auto", "30", "--solve", "--focal-px", "160", "-o", out, "--solve-report", page, "--json")
    assert code == 0, error
    solved = json.loads(words)["solve"]
    assert {"cameras", "points", "observations", "rms_px", "median_px", "focal_px", "focal_sigma_px", "keyframes",
            "kind", "warnings", "advice"} <= solved.keys()
    assert solved["cameras"] == 6
    assert "<svg" in page.read_text()
    stage = Usd.Stage.Open(str(out))
    (camera,) = [UsdGeom.Camera(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Camera)]
    (points,) = [UsdGeom.Points(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Points)]
    places = np.array(points.GetPointsAttr().Get(), float)

    def seen(frame):
        lens = camera.GetCamera(frame)
        there = np.c_[places, np.ones(len(places))] @ np.array(lens.transform.GetInverse())
        flat = there[:, :2] / -there[:, 2:3] * lens.focalLength / lens.horizontalAperture * 160
        return flat * [1, -1] + [79.5, 59.5]

    first, last = seen(1001), seen(1008)
    wanted = np.array([place(point, 7) for point in first])
    assert np.median(np.linalg.norm(last - wanted, axis=1)) < 0.3


def test_what_cannot_be_done_is_said(plate, tmp_path):
    keys = tmp_path / "in.json"
    keys.write_text(json.dumps({"size": [100, 100], "tracks": [{"name": "a", "points": [[1, 2, 3]]}]}))
    for arguments in (
        (plate, "--tracks", keys),
        (tmp_path / "none", "--auto", "3"),
        (plate, "--auto", "3", "--tracks-out", tmp_path / "a.doc"),
    ):
        code, words, error = filoplume("track", *arguments, "--json")
        assert code == 1
        assert "error" in json.loads(words)
        assert len(error.strip().splitlines()) == 1


def test_flow_goes_into_a_file(plate, tmp_path):
    out = tmp_path / "a.flo"
    code, words, _ = filoplume("flow", plate / "shot.1001.png", plate / "shot.1002.png", "-o", out, "--json")
    assert code == 0
    flow = read_flo(out)
    truth = place(POINT, 1) - POINT
    np.testing.assert_allclose(flow[62, 70], truth, atol=0.15)
    assert json.loads(words)["size"] == [160, 120]


def test_a_plane_is_followed_as_a_corner_pin(plate, tmp_path):
    drawn, out = tmp_path / "drawn.json", tmp_path / "corners.json"
    square = [[50.0, 40.0], [90.0, 40.0], [90.0, 80.0], [50.0, 80.0]]
    drawn.write_text(json.dumps({"planes": [{"name": "wall", "frame": 1001, "outline": square}]}))
    code, words, error = filoplume("track", plate, "--planes", drawn, "--planes-out", out, "--json")
    assert code == 0, error
    assert json.loads(words)["planes"] == 1
    (plane,) = json.loads(out.read_text())["planes"]
    assert plane["name"] == "wall"
    assert [row[0] for row in plane["frames"]] == [1001, 1002, 1003, 1004, 1007, 1008]
    for number, corners, error, score in plane["frames"]:
        wanted = [place(np.array(corner), number - 1001) for corner in square]
        assert np.linalg.norm(np.array(corners) - wanted, axis=1).max() < 0.6
        assert error < 1.0
        assert score > 0.5


@pytest.mark.parametrize(("text", "word"), [
    ("{", "not a file of planes"),
    ('{"planes": [{"frame": 1001, "outline": [[1, 2]]}]}', "outline"),
    ('{"planes": [{"frame": 77, "outline": [[1, 2], [30, 2], [1, 40]]}]}', "77"),
    ('{"planes": [{"frame": 1001, "outline": [[1, 2], [1e999, 2], [1, 40]]}]}', "planes"),
])
def test_planes_that_cannot_be_followed_are_refused_in_a_sentence(plate, tmp_path, text, word):
    (tmp_path / "drawn.json").write_text(text)
    code, _, error = filoplume(
        "track", plate, "--planes", tmp_path / "drawn.json", "--planes-out", tmp_path / "o.json", "--json")
    assert code == 1
    assert word in error
    assert not (tmp_path / "o.json").exists()


def test_a_plate_is_written_at_half_its_speed_and_gaps_are_filled(plate, tmp_path):
    code, words, _ = filoplume("retime", plate, "--speed", "0.5", "-o", tmp_path / "slow.####.png", "--json")
    assert code == 0
    result = json.loads(words)
    # 1001 to 1008 by halves are 15; what needs 1005 or 1006 is left out and named
    assert (result["frames"], len(result["warnings"])) == (10, 5)
    same, between = (cv2.imread(str(tmp_path / f"slow.000{n}.png")) for n in (1, 2))
    assert np.array_equal(same, cv2.imread(str(plate / "shot.1001.png")))
    truth = frame(0.5, noise=0.0)[:, :, ::-1]
    inner = np.s_[10:-10, 10:-10]
    assert np.abs(between - truth)[inner].mean() < 3.0
    assert filoplume("retime", plate, "-o", tmp_path / "slow.####.exr")[0] == 1
    assert filoplume("retime", plate, "-o", tmp_path / "no" / "slow.####.png")[0] == 1
    keys, out = tmp_path / "in.json", tmp_path / "out.json"
    hidden = [[k, *place(POINT, k - 1001), 0.01, 0.0, 0.01, 1.0] for k in (1001, 1004)]
    keys.write_text(json.dumps({"size": [160, 120], "frames": [1001, 1008], "tracks": [
        {"name": "eye", "keys": [1008], "points": [*hidden, [1008, *place(POINT, 7)]]}]}))
    code, _, _ = filoplume("track", plate, "--tracks", keys, "--tracks-out", out, "--fill", "--json")
    assert code == 0
    points = {p[0]: p[1:3] for p in json.loads(out.read_text())["tracks"][0]["points"]}
    assert {1001, 1002, 1003, 1004, 1007, 1008} <= points.keys()
    assert np.linalg.norm(points[1002] - place(POINT, 1)) < 0.3
