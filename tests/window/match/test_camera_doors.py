"""A solved camera leaves by the dialog of the window, typed and taken with Return; its files are read without us."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from pxr import Usd, UsdGeom
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QFileDialog, QLineEdit
from scipy.spatial.transform import Rotation

from app.window.match.doors import CAMERAS
from core.document import Document
from core.formats.shot_file import WRITTEN
from core.image.plate import Plate
from core.match.solved import SolvedCamera, frozen, pixels_of
from core.match.track import keyed_track
from tests.core.match.test_solved import small_solve
from tests.window.conftest import Opened
from tests.window.hand import Hand

PLACE = np.array([0.7, -0.5, 5.0])  # m


@pytest.fixture
def solve() -> SolvedCamera:
    """A camera that turns and moves, and a point beside its axis."""
    turns = Rotation.from_euler("xyz", [[0.02, -0.03, 0.05], [-0.04, 0.06, 0.01]]).as_matrix()
    return small_solve().replace(
        rotation=frozen(turns), translation=frozen([[0.1, 0.2, 0.3], [-0.2, 0.1, 0.4]]), points=frozen(PLACE[None]))


def export(hand: Hand, path: Path) -> str:
    """Type a name into the dialog of the command, press Return; the filters it showed."""
    hand.window.commands.run("file.export_camera")
    hand.until(lambda: any(d.isVisible() for d in hand.window.findChildren(QFileDialog)))
    dialog = next(d for d in hand.window.findChildren(QFileDialog) if d.isVisible())
    line = dialog.findChild(QLineEdit, "fileNameEdit")
    filters, chosen = " ".join(dialog.nameFilters()), []
    dialog.fileSelected.connect(chosen.append)
    dialog.setDirectory(str(path.parent))
    line.setFocus()
    line.clear()
    QTest.keyClicks(line, path.name)
    QTest.keyClick(QApplication.activePopupWidget() or line, Qt.Key.Key_Return)
    hand.until(lambda: bool(chosen), 5000)
    assert chosen == [str(path)]
    hand.until(lambda: not hand.window.desk.jobs.running, 60_000)
    return filters


def bundler(path: Path) -> NDArray[np.float64]:
    """Where the first camera of a bundle sees its first point, by the words of Bundler's manual."""
    rows = [np.array(line.split(), float) for line in path.read_text().splitlines()[1:]]
    (focal, k1, k2), turn, shift = rows[1], np.array(rows[2:5]), rows[5]
    x, y, z = turn @ rows[1 + 5 * int(rows[0][0])] + shift
    flat = -np.array([x, y]) / z
    square = flat @ flat
    return focal * (1.0 + k1 * square + k2 * square**2) * flat * [1.0, -1.0] + [31.5, 23.5]


def opensfm(path: Path) -> NDArray[np.float64]:
    """Where the first shot of a reconstruction sees its first point, by OpenSfM's manual."""
    (found,) = json.loads(path.read_text())
    image = next(iter(found["shots"].values()))
    camera = found["cameras"][image["camera"]]
    at = Rotation.from_rotvec(image["rotation"]).apply(found["points"]["0"]["coordinates"]) + image["translation"]
    flat = at[:2] / at[2]
    square = flat @ flat
    flat = flat * (1.0 + camera["k1"] * square + camera["k2"] * square**2)
    return 64 * np.array([camera["focal_x"], camera["focal_y"]]) * flat + 64 * np.array(
        [camera["c_x"], camera["c_y"]]) + [31.5, 23.5]


def usd(path: Path) -> NDArray[np.float64]:
    """Where the camera of a stage sees PLACE on frame 1, by OpenUSD's own frustum."""
    stage = Usd.Stage.Open(str(path))
    camera = next(UsdGeom.Camera(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Camera))
    points = next(UsdGeom.Points(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Points))
    place = points.GetPointsAttr().Get(1) or points.GetPointsAttr().Get()
    world = points.ComputeLocalToWorldTransform(1).Transform(tuple(map(float, place[0])))
    frustum = camera.GetCamera(1).frustum
    x, y, _ = (frustum.ComputeViewMatrix() * frustum.ComputeProjectionMatrix()).Transform(world)
    return np.array([32.0 * (x + 1.0) - 0.5, 24.0 * (1.0 - y) - 0.5])


def test_cameras_leave_by_the_dialog_for_every_program(opened: Opened, tmp_path: Path, solve: SolvedCamera) -> None:
    track = keyed_track(3, "eye", np.array([[1, 30.0, 20.0], [2, 31.0, 20.0]]), 1)
    plate = Plate(id=1, name="p", path="p.####.png", first=1, last=2, width=64, height=48)
    hand = opened(Document(plates=(plate,), tracks=(track,), solves=(solve,), first_frame=1, last_frame=2))
    hand.window.desk.set_craft("match")
    said: list[str] = []
    hand.window.desk.failed.connect(lambda words, details: said.append(words))
    told = pixels_of(solve, 1, solve.points)
    straight = pixels_of(solve.replace(lens=frozen([4.0, 0, 0, 0, 31.5, 23.5])), 1, solve.points)
    assert told is not None
    assert straight is not None
    assert np.abs(told - straight).max() > 0.01  # px: Bundler and OpenSfM must have the bend, which USD does not say
    readers = {"bundle.out": bundler, "reconstruction.json": opensfm, "shot.usd": usd}
    for name, reader in readers.items():
        shown = export(hand, tmp_path / name)
        assert not said
        wanted = straight if reader is usd else told
        assert np.abs(reader(tmp_path / name) - wanted[0]).max() < 0.001, name
    assert "*.usd " in shown.replace(")", " ")
    export(hand, tmp_path / "shot.bin")
    assert "cameras.bin" in said[-1]
    assert not (tmp_path / "shot.bin").exists()
    export(hand, tmp_path / "cameras.bin")
    assert (tmp_path / "points3D.bin").exists()
    assert len(said) == 1


def test_the_dialog_offers_all_that_is_written() -> None:
    assert sorted(name for names in CAMERAS.values() for name in names) == sorted(WRITTEN)
