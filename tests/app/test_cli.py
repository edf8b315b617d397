"""The command line as a user or a farm calls it: a process, its words, its files, its exit code."""

import json
import os
import signal
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from app.cli import COMMANDS
from tests.app.command_line import ROOT, filoplume, filoplume_process


def write_ball(path: Path, rings: int = 24, segments: int = 32) -> Path:
    """A UV sphere of quads (triangles at the poles) with UVs, as OBJ."""
    lines = []
    for i in range(rings + 1):
        for j in range(segments + 1):
            theta, phi = np.pi * i / rings, 2 * np.pi * j / segments
            lines.append(f"vt {j / segments:.6f} {1 - i / rings:.6f}")
            if j < segments and 0 < i < rings:
                x, y, z = np.sin(theta) * np.cos(phi), np.cos(theta), -np.sin(theta) * np.sin(phi)
                lines.append(f"v {x:.7f} {y:.7f} {z:.7f}")
    lines += ["v 0 1 0", "v 0 -1 0"]
    north, south = (rings - 1) * segments + 1, (rings - 1) * segments + 2

    def vertex(i: int, j: int) -> int:
        return north if i == 0 else south if i == rings else (i - 1) * segments + j % segments + 1

    for i in range(rings):
        for j in range(segments):
            corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
            unique = [c for k, c in enumerate(corners) if vertex(*c) != vertex(*corners[k - 1])]
            lines.append("f " + " ".join(f"{vertex(a, b)}/{a * (segments + 1) + b + 1}" for a, b in unique))
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture(scope="module")
def groomed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("groomed")
    ball = write_ball(folder / "ball.obj")
    outputs = [folder / f"coat.{suffix}" for suffix in ("filo", "usdc", "abc", "hair")]
    flags = [flag for path in outputs for flag in ("-o", path)]
    done = filoplume_process("groom", ball, *flags, "--guides", 120, "--hairs", 2500, "--seed", 5, "--json")
    assert done.returncode == 0, done.stderr
    return folder, json.loads(done.stdout), done


def test_groom_json_is_one_object_with_exact_counts(groomed):
    _, result, _ = groomed
    assert result["guides"] == 120
    assert result["hairs"] == 2500
    assert result["points"] == 2500 * 16
    assert result["inside_segments"] == 0
    assert 0 <= result["root_error_max"] < 1e-6
    assert result["peak_mb"] > 10
    assert {"load", "scatter", "bind", "evaluate", "export_filo", "export_usdc"} <= result["seconds"].keys()
    assert all(Path(path).stat().st_size > 0 for path in result["outputs"])
    assert len(result["outputs"]) == 4


def test_every_output_holds_the_same_coat(groomed):
    from core.formats.curve_file import read_groom

    folder, _, _ = groomed
    usd, abc, hair = (read_groom(folder / f"coat.{s}") for s in ("usdc", "abc", "hair"))
    assert len(usd.guides) == len(abc.guides) == 120
    assert len(usd.children) == len(abc.children) == 2500
    np.testing.assert_array_equal(usd.children.points, abc.children.points)
    np.testing.assert_array_equal(usd.children.ids, np.arange(2500))
    np.testing.assert_array_equal(abc.children.ids, usd.children.ids)
    magic, strands, _ = struct.unpack("<4sII", (folder / "coat.hair").read_bytes()[:12])
    assert (magic, strands) == (b"HAIR", 2500)
    np.testing.assert_array_equal(hair.children.points, usd.children.points)


def test_roots_stand_on_the_ball_and_hairs_outside_it(groomed):
    from core.formats.curve_file import read_groom

    folder, _, _ = groomed
    points = read_groom(folder / "coat.usdc").children.points.reshape(2500, 16, 3)
    radius = np.linalg.norm(points, axis=2)
    assert radius[:, 0].max() <= 1 + 1e-5
    assert radius[:, 0].min() > 0.98  # on flat faces between the vertices
    assert (radius[:, 4:].min(axis=1) >= radius[:, 0] - 1e-4).all()


def test_the_same_seed_gives_the_same_file_and_another_seed_another_coat(groomed, tmp_path):
    folder, _, _ = groomed
    for name, seed in (("again", 5), ("other", 6)):
        out = tmp_path / f"{name}.hair"
        filoplume("groom", folder / "ball.obj", "-o", out, "--guides", 120, "--hairs", 2500, "--seed", seed)
    assert (tmp_path / "again.hair").read_bytes() == (folder / "coat.hair").read_bytes()
    assert (tmp_path / "other.hair").read_bytes() != (folder / "coat.hair").read_bytes()


def test_a_project_converts_to_the_same_coat(groomed, tmp_path):
    folder, _, _ = groomed
    done = filoplume("convert", folder / "coat.filo", tmp_path / "again.hair")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "again.hair").read_bytes() == (folder / "coat.hair").read_bytes()


def test_a_density_map_keeps_hair_off_the_black_half(tmp_path):
    import cv2

    from core.formats.curve_file import read_groom

    ball = write_ball(tmp_path / "ball.obj")
    image = np.zeros((64, 64), np.uint8)
    image[:, 40:] = 255
    cv2.imwrite(str(tmp_path / "map.png"), image)
    done = filoplume(
        "groom", ball, "-o", tmp_path / "half.usdc", "--guides", 60, "--hairs", 1000,
        "--density-map", tmp_path / "map.png",
    )
    assert done.returncode == 0, done.stderr
    hairs = read_groom(tmp_path / "half.usdc").children
    assert len(hairs) == 1000
    u = hairs.root_uvs[:, 0]
    # half a texel of blending at the edge of the white, and at the seam, where the image repeats
    assert ((u > 39.5 / 64) | (u < 0.5 / 64)).all()
    assert (u > 41 / 64).mean() > 0.9


def test_info_and_check_tell_what_is_there(groomed):
    folder, _, _ = groomed
    project = json.loads(filoplume("info", folder / "coat.filo", "--json").stdout)
    assert (project["guides"], project["hairs"], project["vertices"]) == (120, 2500, 23 * 32 + 2)
    mesh = json.loads(filoplume("info", folder / "ball.obj", "--json").stdout)
    assert (mesh["kind"], mesh["vertices"], mesh["faces"]) == ("mesh", 23 * 32 + 2, 24 * 32)
    groom = json.loads(filoplume("info", folder / "coat.abc", "--json").stdout)
    assert (groom["kind"], groom["guides"], groom["hairs"]) == ("groom", 120, 2500)
    for name in ("coat.filo", "coat.usdc", "coat.abc", "coat.hair"):
        done = filoplume("check", folder / name, "--json")
        assert done.returncode == 0, done.stdout
    broken = folder / "broken.filo"
    data = bytearray((folder / "coat.filo").read_bytes())
    data[len(data) // 2] ^= 0x10
    broken.write_bytes(data)
    done = filoplume("check", broken, "--json")
    assert done.returncode == 1
    assert json.loads(done.stdout)["whole"] is False


def test_a_picture_is_drawn(groomed, tmp_path):
    import cv2

    folder, _, _ = groomed
    done = filoplume("render", folder / "coat.filo", "-o", tmp_path / "p.png", "--size", "320x200")
    if "OpenGL" in done.stderr or "EGL" in done.stderr:
        pytest.skip(f"no GL here: {done.stderr.strip()}")
    assert done.returncode == 0, done.stderr
    image = cv2.imread(str(tmp_path / "p.png"))
    assert image.shape == (200, 320, 3)
    assert image.std() > 5


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["groom", "no-such.obj", "-o", "x.usdc"], 1, "no-such.obj"),
        (["groom", "no-such.obj", "-o", "x.xyz"], 1, "suffix"),
        (["groom", "no-such.obj"], 2, "output"),
        (["groom", "x.obj", "-o", "x.usdc", "--guides", "0"], 2, "guides"),
        (["groom", "x.obj", "-o", "x.usdc", "--preset", "wool"], 1, "fur"),
        (["render", "x.filo", "-o", "x.png", "--size", "big"], 2, "size"),
        (["no-such-command"], 2, "no-such-command"),
        (["bench", "no-such"], 1, "no-such"),
        (["run", "no-such.py"], 1, "no-such.py"),
    ],
)
def test_what_cannot_be_done_is_one_sentence(arguments, code, words, tmp_path):
    done = filoplume(*arguments, cwd=tmp_path)
    assert done.returncode == code
    assert words in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""


def test_errors_with_json_are_one_object_on_standard_output(tmp_path):
    done = filoplume("groom", tmp_path / "none.obj", "-o", tmp_path / "x.usdc", "--json")
    assert done.returncode == 1
    assert list(json.loads(done.stdout)) == ["error"]


def test_a_script_has_the_same_calls_and_its_own_arguments(groomed, tmp_path):
    folder, _, _ = groomed
    script = tmp_path / "lock.py"
    script.write_text(
        "import sys\n"
        "from tools.session import Session\n"
        "session = Session.open(sys.argv[1])\n"
        "groom = session.document.grooms[0]\n"
        "fewer = groom.replace(coat=groom.coat.replace(count=10))\n"
        "session.edit('Fewer', lambda document: document.replace(grooms=(fewer,)))\n"
        "session.save(sys.argv[2])\n"
        "print(len(groom.guides))\n"
    )
    done = filoplume_process("run", script, folder / "coat.filo", tmp_path / "fewer.filo")
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "120"
    assert json.loads(filoplume("info", tmp_path / "fewer.filo", "--json").stdout)["hairs"] == 10


def test_a_script_that_fails_names_its_line(tmp_path):
    script = tmp_path / "bad.py"
    script.write_text("x = 1\n1 / 0\n")
    done = filoplume("run", script)
    assert done.returncode == 1
    assert "line 2" in done.stderr
    assert "ZeroDivisionError" in done.stderr


def test_the_list_of_commands_is_whole_and_loads_no_kernel_no_qt_no_gl_and_no_library_of_formats():
    code = (
        "import sys, contextlib, app.cli\n"
        "with contextlib.suppress(SystemExit): app.cli.main(['--help'])\n"
        "print(sorted({m.split('.')[0] for m in sys.modules} & {'PySide6', 'moderngl', 'av', 'pxr', 'OpenImageIO', "
        "'PyOpenColorIO', 'poselib', 'trimesh', 'alembic', 'rapidfuzz', 'numba', 'cv2'}))")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    assert done.stdout.strip().endswith("[]")
    for name in COMMANDS:
        assert f" {name} " in done.stdout


def test_commands_load_no_qt_no_gl_and_no_library_of_formats_before_they_run():
    code = (
        "import sys, app.cli; app.cli.build(); print(sorted({m.split('.')[0] for m in sys.modules} & "
        "{'PySide6', 'moderngl', 'av', 'pxr', 'OpenImageIO', 'PyOpenColorIO', 'poselib', 'trimesh', 'alembic', "
        "'rapidfuzz'}))")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    assert done.stdout.strip() == "[]"


def test_ctrl_c_leaves_no_half_written_file(tmp_path):
    """Interrupted at moments spread over the whole run: every output is whole or not there, nothing else is left."""
    ball = write_ball(tmp_path / "ball.obj")
    folder = tmp_path / "out"
    folder.mkdir()
    command = [
        sys.executable, "-m", "app", "groom", str(ball), "-o", str(folder / "a.usdc"), "-o", str(folder / "a.filo"),
        "--guides", "100", "--hairs", "20000",
    ]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    for seconds in (0.8, 2.4, 3.6):
        child = subprocess.Popen(command, cwd=ROOT, env=environment, stderr=subprocess.PIPE, text=True)
        try:
            _, words = child.communicate(timeout=seconds)
        except subprocess.TimeoutExpired:
            child.send_signal(signal.SIGINT)
            _, words = child.communicate(timeout=60)
        assert child.returncode in (0, 130, -signal.SIGINT), words
        assert {path.name for path in folder.iterdir()} <= {"a.usdc", "a.filo"}
        for path in folder.iterdir():
            assert filoplume("check", path).returncode == 0
            path.unlink()


def test_a_demo_is_written_and_its_window_asked_for(tmp_path, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"):
        monkeypatch.delenv(name, raising=False)
    ball = write_ball(tmp_path / "ball.obj")
    wanted = ("demo", "--mesh", ball, "--hairs", 40, "--folder", tmp_path / "out")
    done = filoplume(*wanted, "--json")
    assert done.returncode == 0, done.stderr
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"demo.filo", "demo.usdc", "demo.png"}
    shown = filoplume(*wanted, "--open")
    assert shown.returncode == 1
    assert "needs a display" in shown.stderr
    assert filoplume("demo", "cat").returncode == 2
