import json
import re
import struct

import numpy as np
import pytest
from alembic3d import Abc, AbcGeom
from pxr import Usd
from scipy.spatial.transform import Rotation

from core.errors import UserError
from core.formats.shot_file import check_writable, read_shot, write_shot
from core.match.lens import start_lens
from core.match.solve.shot import Seen, Shot

SIZE = (1920, 1080)


def _shot(model: str = "brown", zoom: bool = False, bent: bool = True) -> Shot:
    rng = np.random.default_rng(4)
    t = np.linspace(0.0, 1.0, 12)
    rotation = Rotation.from_euler("yxz", np.stack([-0.3 + t, 0.4 * t, 2.0 * t], axis=1)).as_matrix()
    centres = np.stack([t, np.sin(3 * t), 0.2 * t], axis=1)
    focal = 1600.0 * (1.0 + 0.4 * t if zoom else np.ones(12))
    lens = start_lens(focal[0], *SIZE, model)
    if bent:
        lens[1:3] = -0.03, 0.01
        lens[6:8] = (0.002, -0.003)[: len(lens) - 6]
    translation = -np.einsum("fij,fj->fi", rotation, centres)
    seen = rng.uniform([-0.4, -0.2, 6.0], [0.4, 0.2, 12.0], (30, 3))
    points = (seen * [[8.0, 8.0, 1.0]] - translation[5]) @ rotation[5]
    return Shot(SIZE, np.arange(1001, 1013, dtype=np.int32), rotation, translation, focal, lens, points,
                tuple(f"t {k}" for k in range(30)))


def _same_pictures(a: Shot, b: Shot) -> None:
    np.testing.assert_array_equal(a.frames, b.frames)
    for row in range(len(a.frames)):
        ahead = a.points[(a.points @ a.rotation[row].T + a.translation[row])[:, 2] > 1.0]
        np.testing.assert_allclose(a.pixels(row, ahead), b.pixels(row, ahead), atol=0.01)


@pytest.mark.parametrize(("name", "model", "zoom"), [
    ("a.usda", "fisheye", False), ("a.usdc", "brown", True), ("cameras.txt", "brown", False),
    ("cameras.txt", "fisheye", True), ("cameras.bin", "brown", True), ("cameras.bin", "fisheye", False),
    ("cameras.txt", "brown5", False), ("cameras.bin", "brown5", True), ("a.usda", "brown5", True),
])  # fmt: skip
def test_what_is_written_is_read_again(name, model, zoom, tmp_path):
    made = _shot(model, zoom)
    write_shot(tmp_path / name, made, {})
    back = read_shot(tmp_path / name, None)
    _same_pictures(made, back)
    np.testing.assert_allclose(back.points, made.points, atol=1e-5)


@pytest.mark.parametrize("gap", [False, True])
def test_alembic_has_the_straight_camera_its_offsets_and_the_names_of_tracks(gap, tmp_path):
    made = _shot(zoom=True, bent=False)
    made.lens[4:6] += 31.0, -17.0
    made.lens[3] = 0.2
    if gap:
        made = made._replace(frames=made.frames + (np.arange(12) > 6).astype(np.int32))
    write_shot(tmp_path / "a.abc", made, {})
    back = read_shot(tmp_path / "a.abc", None)
    _same_pictures(made, back)
    assert (back.size, back.names) == (made.size, made.names)
    np.testing.assert_allclose(back.points, made.points, atol=1e-5)
    archive = Abc.IArchive(str(tmp_path / "a.abc"))
    node = AbcGeom.IXform(AbcGeom.IXform(archive.getTop(), "Solve"), "camera")
    sample = AbcGeom.ICamera(node, "cameraShape").getSchema().getValue(Abc.ISampleSelector(float(1004 / 24.0)))
    across = 2.0 * np.degrees(np.arctan2(0.5 * SIZE[0], made.focal[3]))
    assert sample.getFieldOfView() == pytest.approx(across, rel=1e-6)
    (tmp_path / "broken.abc").write_bytes(b"Ogawa" + bytes(60))
    with pytest.raises(UserError, match=r"broken\.abc"):
        read_shot(tmp_path / "broken.abc", None)


@pytest.mark.parametrize("name", ["a.nk", "a.chan"])
def test_nuke_has_the_straight_camera(name, tmp_path):
    made = _shot(zoom=True, bent=False)
    if name == "a.nk":
        made.lens[4:6] += 31.0, -17.0
    write_shot(tmp_path / name, made, {})
    _same_pictures(made, read_shot(tmp_path / name, SIZE))


def test_nukes_window_and_mayas_film_are_moved_as_their_projections_have_it(tmp_path):
    """Nuke: x over -z times twice the focal length over the aperture, less the window, is -1 to 1 across. Maya: a film
    moved to the right sees what lies right of the axis in its middle."""
    made = _shot(bent=False)
    made.lens[4:6] += 31.0, -17.0
    place = made.up()[1][3]
    seen = np.append(place, 1.0) @ np.linalg.inv(made.up()[0][4]).T
    flat = seen[:2] / -seen[2]
    write_shot(tmp_path / "a.nk", made, {})
    knob = {name: np.array(words.strip("{}").split(), float) for name, words in re.findall(
        r"^ (focal|haperture|win_translate) (.*)$", (tmp_path / "a.nk").read_text(), re.M)}
    unit = 2.0 * knob["focal"] / knob["haperture"] * flat - knob["win_translate"]
    pixel = np.array([0.5 * SIZE[0] * (1.0 + unit[0]), 0.5 * SIZE[1] - 0.5 * SIZE[0] * unit[1]]) - 0.5
    np.testing.assert_allclose(pixel, made.pixels(4, made.points[3:4])[0], atol=1e-3)
    write_shot(tmp_path / "a.ma", made, {})
    inches = {name: float(value) for name, value in re.findall(
        r'setAttr "\.(hfo|vfo|fl)" (\S+);', (tmp_path / "a.ma").read_text())}
    on_film = inches["fl"] / 25.4 * flat - [inches["hfo"], inches["vfo"]]
    inch = float(re.search(r'"\.cap" -type "double2" (\S+)', (tmp_path / "a.ma").read_text())[1]) / SIZE[0]
    middle = 0.5 * (np.array(SIZE) - 1.0)
    np.testing.assert_allclose(on_film / inch * [1, -1] + middle, made.pixels(4, made.points[3:4])[0], atol=1e-3)


def test_nuke_turns_in_the_order_it_says(tmp_path):
    """Its rotations done one after the other: z, then x, then y."""
    made = _shot(bent=False)
    write_shot(tmp_path / "a.chan", made, {})
    row = np.loadtxt(tmp_path / "a.chan")[7]
    x, y, z = np.radians(row[4:7])
    c, s = np.cos, np.sin
    about_x = np.array([[1, 0, 0], [0, c(x), -s(x)], [0, s(x), c(x)]])
    about_y = np.array([[c(y), 0, s(y)], [0, 1, 0], [-s(y), 0, c(y)]])
    about_z = np.array([[c(z), -s(z), 0], [s(z), c(z), 0], [0, 0, 1]])
    np.testing.assert_allclose(about_y @ about_x @ about_z, made.up()[0][7, :3, :3], atol=1e-9)


def test_mayas_curves_place_the_camera(tmp_path):
    made = _shot(zoom=True, bent=False)
    write_shot(tmp_path / "a.ma", made, {})
    text = (tmp_path / "a.ma").read_text()
    curves = {}
    found = re.findall(r'animCurve\w+ -n "filoplume_camera_(\w+)";.*?ktv\[[\d:]+\]"([^;]*);', text, re.S)
    for name, keys in found:
        curves[name] = dict(np.array(keys.split(), float).reshape(-1, 2))
    frame = 1008
    turn = [curves[f"r{axis}"][frame] for axis in "xyz"]
    matrix = made.up()[0][7]
    np.testing.assert_allclose(Rotation.from_euler("xyz", turn, degrees=True).as_matrix(), matrix[:3, :3], atol=1e-9)
    np.testing.assert_allclose([curves[f"t{axis}"][frame] for axis in "xyz"], matrix[:3, 3], atol=1e-9)
    across = float(re.search(r'"\.cap" -type "double2" (\S+)', text)[1]) * 25.4
    assert curves["fl"][frame] / across * SIZE[0] == pytest.approx(made.focal[7], rel=1e-9)


def test_a_camera_off_its_centre_is_refused_where_it_cannot_be_said(tmp_path):
    made = _shot()
    made.lens[4] += 3.0
    with pytest.raises(UserError, match=r"3\.0 px off"):
        write_shot(tmp_path / "a.chan", made, {})


def test_a_stage_of_another_program_is_read(tmp_path):
    made = _shot(bent=False)
    made.lens[4:6] += 12.0, -7.0
    write_shot(tmp_path / "a.usda", made, {})
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    stage.GetDefaultPrim().ClearCustomData()
    stage.Export(str(tmp_path / "b.usda"))
    _same_pictures(made, read_shot(tmp_path / "b.usda", None))


def test_bundler_is_read(tmp_path):
    made = _shot()
    flip = np.diag([1.0, -1.0, -1.0])
    lines = ["# Bundle file v0.3", f"{len(made.frames)} {len(made.points)}"]
    for turn, shift in zip(made.rotation, made.translation, strict=True):
        lines += [f"1600 {made.lens[1]} {made.lens[2]}", *(" ".join(map(repr, row)) for row in (flip @ turn).tolist())]
        lines.append(" ".join(map(repr, (flip @ shift).tolist())))
    for place in made.points.tolist():
        lines += [" ".join(map(repr, place)), "0 0 0", "2 0 5 0.0 0.0 1 6 1.0 1.0"]
    (tmp_path / "bundle.out").write_text("\n".join(lines))
    back = read_shot(tmp_path / "bundle.out", SIZE)
    _same_pictures(made._replace(frames=back.frames), back)
    np.testing.assert_allclose(back.points, made.points)


def _all_seen(made: Shot) -> Shot:
    """With every place in the picture, to a hundredth of a pixel."""
    rows = []
    for frame in range(len(made.frames)):
        ahead = (made.points @ made.rotation[frame].T + made.translation[frame])[:, 2] > 1.0
        xy = made.pixels(frame, made.points)
        rows += [(frame, k, *np.round(xy[k], 2)) for k in np.flatnonzero(ahead)]
    table = np.array(rows)
    return made._replace(seen=Seen(table[:, 0].astype(np.int32), table[:, 1].astype(np.int32), table[:, 2:]))


@pytest.mark.parametrize("suffix", [".txt", ".bin"])
def test_colmap_has_who_saw_what(suffix, tmp_path):
    made = _all_seen(_shot())
    write_shot(tmp_path / f"cameras{suffix}", made, {})
    _same_pictures(made, read_shot(tmp_path / f"cameras{suffix}", None))
    if suffix == ".bin":
        return
    images = (tmp_path / "images.txt").read_text().splitlines()
    points = (tmp_path / "points3D.txt").read_text().splitlines()
    seen = np.array(images[2 * 4 + 1].split(), float).reshape(-1, 3)
    rows = seen[:, 2].astype(int) - 1
    np.testing.assert_allclose(seen[:, :2] - 0.5, made.pixels(4, made.points[rows]), atol=0.006)
    for row in rows:  # the point names the picture, and its place there
        back = np.array(points[row].split()[8:], int).reshape(-1, 2)
        place = dict(back.tolist())[5]
        assert int(seen[place, 2]) == row + 1


def test_bundler_and_opensfm_are_written(tmp_path):
    made = _all_seen(_shot(zoom=True))
    write_shot(tmp_path / "bundle.out", made, {})
    back = read_shot(tmp_path / "bundle.out", SIZE)
    _same_pictures(made._replace(frames=back.frames), back)
    views = (tmp_path / "bundle.out").read_text().splitlines()[2 + 5 * 12 + 2 :: 3]
    frame, point, x, y = views[7].split()[1:5]
    at = made.pixels(int(frame), made.points[7:8])[0]
    assert point == "7"
    np.testing.assert_allclose([float(x) + 959.5, 539.5 - float(y)], at, atol=0.006)
    with pytest.raises(UserError, match="Bundler has only"):
        write_shot(tmp_path / "b.out", _shot("fisheye"), {})
    for model in ("brown", "brown5", "fisheye"):
        made = _shot(model, zoom=model == "brown")
        if model == "brown5":
            made.lens[8] = 0.004
        made.lens[3:6] += 0.1, 11.0, -5.0
        write_shot(tmp_path / "reconstruction.json", made, {})
        _same_pictures(made, read_shot(tmp_path / "reconstruction.json", None))
    with pytest.raises(UserError, match="written as"):
        check_writable(tmp_path / "solve.json")


def test_colmap_has_no_third_number_of_brown(tmp_path):
    made = _shot("brown5")
    made.lens[8] = 0.004
    with pytest.raises(UserError, match="brown5 with a k3"):
        write_shot(tmp_path / "cameras.txt", made, {})


def test_opensfm_is_read(tmp_path):
    made = _shot()
    shots = {
        f"plate.{frame}.jpg": {
            "camera": "c", "rotation": Rotation.from_matrix(turn).as_rotvec().tolist(), "translation": shift.tolist()}
        for frame, turn, shift in zip(made.frames, made.rotation, made.translation, strict=True)
    }  # fmt: skip
    camera = {"projection_type": "perspective", "width": 1920, "height": 1080, "focal": 1600 / 1920}
    camera |= {"k1": -0.03, "k2": 0.01}
    points = {str(k): {"coordinates": place} for k, place in enumerate(made.points.tolist())}
    (tmp_path / "r.json").write_text(json.dumps([{"cameras": {"c": camera}, "shots": shots, "points": points}]))
    _same_pictures(made, read_shot(tmp_path / "r.json", None))


@pytest.mark.parametrize(("name", "data"), [
    ("cameras.txt", b"1 OPENCV 10"), ("cameras.bin", struct.pack("<Q", 1 << 60)),
    ("a.nk", b"Camera2 {\n translate {{curve x}}\n}\n"), ("a.nk", b""), ("a.chan", b"1 2 3"), ("a.chan", b""),
    ("a.out", b"99999999999 1"), ("a.json", b"[]"), ("a.json", b"[[["), ("a.usda", b"#usda 1.0\n"), ("a.abc", b""),
])  # fmt: skip
def test_broken_files_are_refused_in_words(name, data, tmp_path):
    for part in ("images", "points3D"):
        (tmp_path / f"{part}.{name[-3:]}").write_bytes(b"")
    (tmp_path / name).write_bytes(data)
    with pytest.raises(UserError):
        read_shot(tmp_path / name, SIZE)


@pytest.mark.parametrize("name", ["images.bin", "points3D.bin", "shot.bin"])
def test_other_files_of_bin_are_refused_at_once_with_the_name_to_choose(name, tmp_path):
    with pytest.raises(UserError, match=r"cameras\.bin"):
        check_writable(tmp_path / name)
    (tmp_path / name).write_bytes(bytes(64))
    with pytest.raises(UserError, match=r"cameras\.bin"):
        read_shot(tmp_path / name, None)
