"""Starting the program as people do: a process with a display, without one, with old OpenGL; killed, begun anew."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtGui import QImage

from core.document import Document
from core.formats.project import read_project, write_project
from core.formats.recovery import recover_newest
from core.workspace import Workspace
from tests.window.conftest import OFFSCREEN

ROOT = Path(__file__).parents[2]
real = pytest.mark.skipif(OFFSCREEN is not None, reason=str(OFFSCREEN))


def start(home: Path, *arguments: object, **variables: str | None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "app", *map(str, arguments)], capture_output=True, text=True, cwd=ROOT,
        env=_environment(home, **variables), timeout=200, check=False)


def _environment(home: Path, **variables: str | None) -> dict[str, str]:
    all_of_it = {
        **os.environ, "PYTHONPATH": str(ROOT), "FILOPLUME_STATE": str(home / "journals"),
        "FILOPLUME_SETTINGS": str(home / "settings"), **variables}
    return {name: value for name, value in all_of_it.items() if value is not None}


@pytest.fixture
def project(tmp_path: Path, animal: Document) -> Path:
    path = tmp_path / "animal.filo"
    write_project(path, animal, Workspace(tool="comb"))
    return path


@real
def test_a_picture_of_the_settled_window_has_its_size_and_the_scripts_work(home: Path, project: Path) -> None:
    script = home / "after.py"
    script.write_text("desk.choose('comb', size=33.0)\nwindow.commands.run('view.front')\nsession.save()\n")
    done = start(home, project, "--screenshot", home / "a.png", "--size", "1000x700", "--after", script)
    assert done.returncode == 0, done.stderr
    image = QImage(str(home / "a.png"))
    assert (image.width(), image.height()) == (1000, 700)
    colours = {image.pixel(x, y) for x in range(100, 600, 5) for y in range(150, 550, 5)}
    assert len(colours) > 200  # an animal, no empty plate
    _, workspace = read_project(project)
    assert workspace.params["comb"]["size"] == 33.0
    assert workspace.cameras[0].forward == pytest.approx((0, 0, -1))
    assert recover_newest(home / "journals") is None  # a picture leaves nothing behind


@real
def test_a_script_that_fails_is_one_sentence_with_its_line(home: Path, project: Path) -> None:
    script = home / "after.py"
    script.write_text("\nwindow.nothing()\n")
    done = start(home, project, "--screenshot", home / "a.png", "--after", script)
    assert done.returncode == 1
    assert "after.py stopped on line 2" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not (home / "a.png").exists()


@real
@pytest.mark.parametrize("version", ["2.1", "3.2"])
def test_old_opengl_is_said_in_the_window(version: str, home: Path, project: Path) -> None:
    script = home / "after.py"
    script.write_text(f"open({str(home / 'said')!r}, 'w').write(window.view.trouble.text())\n")
    done = start(
        home, project, "--screenshot", home / "a.png", "--after", script,
        MESA_GL_VERSION_OVERRIDE=version, MESA_GLSL_VERSION_OVERRIDE="120")
    assert done.returncode == 0, done.stderr
    said = (home / "said").read_text()
    assert "OpenGL 3.3" in said
    assert (home / "a.png").exists()


@pytest.mark.parametrize(
    "variables",
    [{"DISPLAY": None, "WAYLAND_DISPLAY": None, "QT_QPA_PLATFORM": None},
     {"DISPLAY": ":4321", "WAYLAND_DISPLAY": None, "QT_QPA_PLATFORM": None}])
def test_without_a_display_it_is_one_sentence(variables: dict[str, str | None], home: Path) -> None:
    done = start(home, **variables)
    assert done.returncode == 1
    assert "display" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert "Traceback" not in done.stderr


def test_an_empty_window_needs_no_library_that_only_work_needs() -> None:
    code = (
        "import sys, app.window.start, app.window.main\n"
        "late = {'scipy.fft', 'scipy.ndimage', 'scipy.optimize', 'scipy.stats', 'av', 'alembic', 'OpenImageIO', "
        "'PyOpenColorIO', 'poselib', 'trimesh', 'core.groom.children', 'core.mesh.intrinsic', 'core.match.runs'}\n"
        "print(sorted(late & set(sys.modules)))")
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, timeout=120, check=True)
    assert done.stdout.strip() == "[]"


def test_a_file_that_is_not_there_is_one_sentence(home: Path) -> None:
    done = start(home, home / "nothing.filo")
    assert done.returncode == 1
    assert "there is no file" in done.stderr


def test_a_mistyped_command_is_no_file(home: Path) -> None:
    done = start(home, "gromm")
    assert done.returncode == 2


@real
def test_killed_amidst_work_the_next_start_offers_it_and_brings_it_back(home: Path, project: Path) -> None:
    work = home / "work.py"
    work.write_text(
        "import time\n"
        "from tools.ground import Pointer, Sight\n"
        "view = window.viewport\n"
        "width, height = view.pixels()\n"
        "points = tuple(Pointer(0.5 * width + 6 * i, 0.45 * height) for i in range(9))\n"
        "session.hand.stroke(Sight(view.eye.camera, width, height), points)\n"
        "session._journal.flush(10)\n"
        f"open({str(home / 'ready')!r}, 'w').close()\n"
        "time.sleep(60)\n")
    child = subprocess.Popen(
        [sys.executable, "-m", "app", "window", str(project), "--after", str(work)], cwd=ROOT, env=_environment(home))
    end = time.monotonic() + 120
    while not (home / "ready").exists() and time.monotonic() < end:
        assert child.poll() is None
        time.sleep(0.05)  # a process, not an event loop
    child.send_signal(signal.SIGKILL)
    child.wait(20)
    lost = recover_newest(home / "journals")
    assert lost is not None
    assert lost.name == "Comb"
    again = home / "again.py"
    again.write_text(
        "window.offer_lost_work()\n"
        "bar = window.recovery\n"
        "import time\n"
        "from PySide6.QtTest import QTest\n"
        "def until(true):\n"
        "    end = time.monotonic() + 30\n"
        "    while not true():\n"
        "        assert time.monotonic() < end\n"
        "        QTest.qWait(10)\n"
        "until(bar.isVisible)\n"
        "bar.buttons['Recover'].click()\n"
        "until(lambda: window.desk.session.path is not None)\n"
        f"window.files.save_copy(__import__('pathlib').Path({str(home / 'back.filo')!r}))\n")
    done = start(home, "--screenshot", home / "a.png", "--after", again)
    assert done.returncode == 0, done.stderr
    back, _ = read_project(home / "back.filo")
    assert np.array_equal(back.grooms[0].guides.points, lost.document.grooms[0].guides.points)
    before, _ = read_project(project)
    assert not np.array_equal(back.grooms[0].guides.points, before.grooms[0].guides.points)
