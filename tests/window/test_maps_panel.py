"""Maps by mouse and keys: loaded, assigned, shown, deleted; the UV view says what is under the pointer."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from PySide6.QtCore import QMimeData, QPoint, QPointF, QRectF, Qt, QUrl
from PySide6.QtGui import QColor, QDragEnterEvent, QDropEvent, QWheelEvent
from PySide6.QtWidgets import QApplication, QComboBox
from pytestqt.qtbot import QtBot

from app.window.desk import Desk
from app.window.maps_panel import MapsPanel, _Rows
from app.window.theme import look_of
from app.window.uv_view import NO_GROOM, NO_UVS
from tests.documents import small_document, stroked
from tools.session import Session


@pytest.fixture
def desk() -> Iterator[Desk]:
    desk = Desk(Session(small_document()))
    yield desk
    assert desk.jobs.close()
    desk.session.close(discard=True)


@pytest.fixture
def panel(desk: Desk, qtbot: QtBot) -> MapsPanel:
    panel = MapsPanel(desk)
    qtbot.addWidget(panel)
    panel.resize(300, 560)
    with qtbot.waitExposed(panel):
        panel.show()
    idle(desk, qtbot)
    return panel


def idle(desk: Desk, qtbot: QtBot) -> None:
    qtbot.waitUntil(lambda: not desk.jobs.running, timeout=20_000)


def names(panel: MapsPanel) -> list[str]:
    return [panel.list.item(row).text() for row in range(panel.list.count())]


def picture(folder: Path, name: str = "Streifen 猫.png") -> Path:
    pixels = np.tile(np.array([[0, 255], [255, 0]], np.uint8), (8, 8))
    Image.fromarray(pixels).save(folder / name)
    return folder / name


def pick(box: QComboBox, qtbot: QtBot, words: str) -> None:
    box.setFocus()
    qtbot.keyClick(box, words[0].lower())


def test_an_image_is_loaded_assigned_and_taken_back(
    desk: Desk, panel: MapsPanel, tmp_path: Path, qtbot: QtBot
) -> None:
    assert names(panel) == ["density"]
    assert panel.described("density") == "per vertex · density"
    panel.load(picture(tmp_path))
    idle(desk, qtbot)
    assert names(panel) == ["density", "Streifen 猫"]
    assert panel.chosen == "Streifen 猫"
    assert panel.described("Streifen 猫") == "16 × 16"
    pick(panel.roles["length_map"], qtbot, "Streifen 猫")
    assert desk.document.grooms[0].coat.length_map == "Streifen 猫"
    assert panel.described("Streifen 猫") == "16 × 16 · length"
    pick(panel.roles["density_map"], qtbot, "none · even")
    assert desk.document.grooms[0].coat.density_map is None
    assert desk.session.history.names[-3:] == ("Load map", "Length map", "Density map")
    for _ in range(3):
        desk.session.undo()
    assert names(panel) == ["density"]
    assert panel.roles["density_map"].currentText() == "density"
    failed: list[str] = []
    desk.failed.connect(lambda sentence, details: failed.append(sentence))
    (tmp_path / "no.png").write_bytes(b"nothing")
    panel.load(tmp_path / "no.png")
    idle(desk, qtbot)
    assert "no.png" in failed[0]
    assert names(panel) == ["density"]


def test_the_eye_shows_a_map_on_the_skin(desk: Desk, panel: MapsPanel, qtbot: QtBot) -> None:
    area = panel.list.visualItemRect(panel.list.item(0))
    eye = _Rows.eye(QRectF(area)).center().toPoint()
    qtbot.mouseClick(panel.list.viewport(), Qt.MouseButton.LeftButton, pos=eye)
    assert desk.workspace.view.map == "density"
    qtbot.mouseClick(panel.list.viewport(), Qt.MouseButton.LeftButton, pos=eye)
    assert desk.workspace.view.map is None
    assert desk.session.history.undo_name is None


def test_delete_takes_the_chosen_map_and_its_overlay(desk: Desk, panel: MapsPanel, qtbot: QtBot) -> None:
    panel.toggle_overlay("density")
    panel.activateWindow()
    panel.list.setFocus()
    qtbot.waitUntil(panel.list.hasFocus)  # the window manager gives it, in its own time
    qtbot.keyClick(panel.list, Qt.Key.Key_Delete)
    assert desk.document.grooms[0].maps == ()
    assert desk.document.grooms[0].coat.density_map is None
    assert desk.workspace.view.map is None
    assert not panel.delete_button.isEnabled()
    desk.session.undo()
    assert names(panel) == ["density"]
    qtbot.mouseClick(panel.delete_button, Qt.MouseButton.LeftButton)
    assert names(panel) == []


def test_pictures_are_dropped_as_maps(desk: Desk, panel: MapsPanel, tmp_path: Path, qtbot: QtBot) -> None:
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(str(picture(tmp_path, "a.png"))), QUrl.fromLocalFile("/cat.obj")])
    copy, left, plain = Qt.DropAction.CopyAction, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
    QApplication.sendEvent(panel, QDragEnterEvent(QPoint(20, 20), copy, data, left, plain))
    QApplication.sendEvent(panel, QDropEvent(QPointF(20, 20), copy, data, left, plain))
    idle(desk, qtbot)
    assert names(panel) == ["density", "a"]


def test_hovering_tells_u_v_and_value(desk: Desk, panel: MapsPanel, qtbot: QtBot) -> None:
    view = panel.view
    assert view.words == ""
    qtbot.mouseMove(view, view.place_of(0.5, 0.25).toPoint())
    qtbot.waitUntil(lambda: view.about != "")
    u, v, value = (float(word) for word in view.about.split()[1::2])
    assert (u, v) == (pytest.approx(0.5, abs=0.01), pytest.approx(0.25, abs=0.01))
    assert 0.0 < value < 0.6  # the map rises with v
    place = QPoint(view.width() // 2, 3)
    qtbot.mouseMove(view, place)
    qtbot.waitUntil(lambda: "value" not in view.about)


def test_it_slides_zooms_at_the_pointer_and_fits(panel: MapsPanel, qtbot: QtBot) -> None:
    view = panel.view
    place = QPointF(60.0, 70.0)
    before = view.uv_at(place)
    wheel = QWheelEvent(place, view.mapToGlobal(place), QPoint(), QPoint(0, 600), Qt.MouseButton.NoButton,
                        Qt.KeyboardModifier.NoModifier, Qt.ScrollPhase.NoScrollPhase, False)
    QApplication.sendEvent(view, wheel)
    assert view.uv_at(place) == pytest.approx(before)
    assert view.uv_at(QPointF(160.0, 70.0))[0] - before[0] < 0.3
    start, end = QPoint(60, 70), QPoint(100, 30)
    held = view.uv_at(QPointF(start))
    qtbot.mousePress(view, Qt.MouseButton.LeftButton, pos=start)
    qtbot.mouseMove(view, end)
    qtbot.waitUntil(lambda: view.uv_at(QPointF(end)) == pytest.approx(held))
    qtbot.mouseRelease(view, Qt.MouseButton.LeftButton, pos=end)
    qtbot.mouseDClick(view, Qt.MouseButton.LeftButton, pos=end)
    middle = QPointF(view.width() / 2, view.height() / 2)
    assert view.uv_at(middle) == pytest.approx((0.5, 0.5))


def test_edges_and_roots_are_drawn(desk: Desk, panel: MapsPanel, qtbot: QtBot) -> None:
    view, theme = panel.view, look_of().theme
    u, v = desk.document.grooms[0].guides.roots.uvs[0].tolist()
    place = view.place_of(u, v)

    def near() -> list[int]:
        image = view.grab().toImage()
        r = image.devicePixelRatio()
        spots = [(dx, dy) for dx in (-1, 0, 1) for dy in (-1, 0, 1)]
        accent = QColor(theme.accent)
        return [abs(QColor(image.pixel(round(place.x() * r) + dx, round(place.y() * r) + dy)).red() - accent.red())
                + abs(QColor(image.pixel(round(place.x() * r) + dx, round(place.y() * r) + dy)).blue() - accent.blue())
                for dx, dy in spots]

    assert min(near()) < 60
    desk.edit("Delete", lambda d: d.replace(grooms=()))
    assert view.words == NO_GROOM
    view.grab()


def test_a_mesh_without_uvs_is_explained(desk: Desk, panel: MapsPanel, qtbot: QtBot) -> None:
    desk.edit("Strip", lambda d: d.replace(meshes=tuple(
        m.replace(mesh=m.mesh.replace(uvs=None)) for m in d.meshes)))
    assert panel.view.words == NO_UVS
    assert panel.view.about == ""
    panel.view.grab()
    desk.session.undo()
    idle(desk, qtbot)
    assert panel.view.words == ""


def test_nothing_is_laid_flat_again_during_a_stroke(
    desk: Desk, panel: MapsPanel, monkeypatch: pytest.MonkeyPatch, qtbot: QtBot
) -> None:
    monkeypatch.setattr(Session, "stroking", True)
    desk.edit("Comb", stroked, 1)
    desk.edit("Maps", lambda d: d.replace(grooms=(d.grooms[0].replace(
        maps=(), coat=d.grooms[0].coat.replace(density_map=None)),)))
    assert not desk.jobs.running
    assert names(panel) == ["density"]
    monkeypatch.undo()
    desk.stroke_ended.emit()
    assert names(panel) == []
    idle(desk, qtbot)


def test_without_a_groom_the_panel_waits(desk: Desk, panel: MapsPanel, qtbot: QtBot) -> None:
    desk.replace_session(Session())
    assert names(panel) == []
    assert not panel.load_button.isEnabled()
    assert not panel.roles["density_map"].isEnabled()
    assert panel.view.words == NO_GROOM


def test_paint_takes_the_brush_for_the_map_and_shows_it_without_hair_until_another_tool(
    desk: Desk, panel: MapsPanel, qtbot: QtBot, tmp_path: Path
) -> None:
    before = names(panel)
    qtbot.mouseClick(panel.new_button, Qt.MouseButton.LeftButton)
    made = names(panel)[-1]
    assert len(names(panel)) == len(before) + 1
    qtbot.mouseClick(panel.paint_button, Qt.MouseButton.LeftButton)
    assert desk.session.tool.name == "paint_map"
    assert (desk.session.tool.params.map, panel.overlay, desk.workspace.view.hair) == (made, made, False)
    panel.load(picture(tmp_path))
    idle(desk, qtbot)
    assert panel.chosen == picture(tmp_path).stem
    assert panel.overlay == made, "an image cannot be painted on before it is copied"
    qtbot.mouseClick(panel.paint_button, Qt.MouseButton.LeftButton)
    copy = f"{picture(tmp_path).stem} painted"
    assert (desk.session.tool.params.map, panel.overlay, panel.chosen) == (copy, copy, copy)
    desk.choose("comb")
    assert (panel.overlay, desk.workspace.view.hair) == (None, True)
