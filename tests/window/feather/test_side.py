"""The editor of the feather at a real desk: what is turned, typed and drawn becomes steps of the document."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from pytestqt.qtbot import QtBot

from app.window.desk import Desk
from app.window.feather.attribute_list import CHANGED, found
from app.window.feather.side import BARB, FeatherSide, Shown, made
from app.window.fields.value_field import ValueField
from core.document import with_feathers
from core.feather.attributes import ATTRIBUTES, COLUMNS, GROUPS
from core.feather.coat.coat import FeatherCoat
from core.feather.coat.worn import worn_values
from core.feather.presets import preset_values
from core.value import constant
from tests.documents import small_document
from tools.session import Session

MADE: dict[tuple[bytes, str, bool], Shown] = {}


def made_once(values: np.ndarray, level: str, other: np.ndarray | None) -> Shown:
    """A feather as the editor shows it; the one all tests begin with is made for the first of them."""
    key = values.tobytes(), level, other is None
    if other is not None or key not in MADE:
        MADE[key] = made(values, level, other)
    return MADE[key]


@pytest.fixture
def side(qtbot: QtBot, monkeypatch: pytest.MonkeyPatch) -> Iterator[FeatherSide]:
    """The editor of a goldfinch's coat, whose keys are at hand."""
    monkeypatch.setattr("app.window.feather.side.made", made_once)
    document = small_document()
    groom = document.grooms[0]
    coat = FeatherCoat(id=1, name="coat", mesh_id=groom.mesh_id, keys_id=groom.id)
    desk = Desk(Session(with_feathers(document.replace(feathers=()), coat)))
    desk.set_workspace(groom=groom.id)
    side = FeatherSide(desk, lambda scene, camera, size: iter((None, np.full((size[1], size[0], 3), 7, np.uint8))))
    qtbot.addWidget(side)
    side.resize(500, 900)
    side.show()
    qtbot.waitUntil(lambda: side.solid.mesh is not None and not side._busy, timeout=120_000)
    yield side
    assert desk.jobs.close()
    desk.session.close(discard=True)


def worn(side: FeatherSide) -> np.ndarray:
    return worn_values(side.desk.document.feathers[0], "goldfinch-breast")


def test_every_attribute_is_in_a_group_and_found_by_words() -> None:
    listed = [name for group in GROUPS for name in found("", group, ())]
    assert sorted(listed) == sorted(known.name for known in ATTRIBUTES)
    for known in ATTRIBUTES:
        assert known.name in found(known.name, GROUPS[0], ())
    assert "barbAngleTipLeft" in found("angle barb tip", "down", ())
    assert found("no such thing", GROUPS[0], ()) == []


def test_an_attribute_is_changed_shown_as_changed_and_reset(side: FeatherSide) -> None:
    history, usual = side.desk.session.history, float(preset_values("goldfinch-breast")[COLUMNS["vaneWidthLeft"]])
    side.attributes.word.setText("vane width left")
    field = side.attributes.bars["vaneWidthLeft"]
    assert isinstance(field, ValueField)
    field.bar.preview(0.31)
    assert side.desk.document.feathers[0].attributes
    assert not history.current.feathers[0].attributes
    field.bar.finish()
    assert history.undo_name == "Feather vane width left"
    assert worn(side)[COLUMNS["vaneWidthLeft"]] == np.float32(0.31)
    side.attributes.word.clear()
    side.attributes.group.enter(CHANGED)
    assert list(side.attributes.bars) == ["vaneWidthLeft"]
    field = side.attributes.bars["vaneWidthLeft"]
    assert isinstance(field, ValueField)
    field.bar.enter(usual)
    assert side.desk.document.feathers[0].attributes == ()
    side.desk.session.undo()
    assert worn(side)[COLUMNS["vaneWidthLeft"]] == np.float32(0.31)


def test_a_dial_is_one_step_and_the_pictures_follow(side: FeatherSide, qtbot: QtBot) -> None:
    before = side.canvas.feather
    side.dials["width"].preview(0.3)
    side.dials["width"].cancel()
    assert side.desk.session.history.cursor == 0
    side.dials["width"].preview(0.6)
    side.dials["width"].finish()
    assert side.desk.session.history.undo_name == "Feather dial width"
    assert [dial.position for dial in side.desk.document.feathers[0].dials] == [0.6]
    qtbot.waitUntil(lambda: side.canvas.feather is not before and not side._busy, timeout=60_000)
    assert before is not None
    assert side.canvas.feather is not None
    assert side.canvas.feather.outlines[0][:, 0].max() > 1.2 * before.outlines[0][:, 0].max()
    side.desk.session.undo()
    assert side.dials["width"].value() == 0.0


def test_another_feather_is_compared_and_blended_in(side: FeatherSide, qtbot: QtBot) -> None:
    side.other.enter("owl-primary")
    qtbot.waitUntil(lambda: side.canvas.other is not None, timeout=60_000)
    assert "attributes" in side.told.text()
    side.blend.enter(1.0)
    np.testing.assert_array_equal(worn(side), preset_values("owl-primary"))
    assert side.desk.session.history.undo_name == "Blend with owl-primary"
    assert side.blend.value() == 0.0


def test_lines_drawn_over_the_flat_feather_become_its_edge_and_its_barbs(side: FeatherSide, qtbot: QtBot) -> None:
    assert side.canvas.feather is not None
    left = side.canvas.feather.outlines[0] * [-1.5, 1.0]
    side.canvas.drawn.emit(0, left)
    qtbot.waitUntil(lambda: bool(side.desk.document.feathers[0].attributes), timeout=60_000)
    assert side.desk.session.history.undo_name == "Draw outline of feather"
    assert worn(side)[COLUMNS["vaneWidthLeft"]] == pytest.approx(
        1.5 * preset_values("goldfinch-breast")[COLUMNS["vaneWidthLeft"]], rel=0.05)
    side.drawn.enter(BARB)
    before = worn(side)
    side.canvas.drawn.emit(1, np.array([[0.0, 0.5], [0.1, 0.55], [0.2, 0.6]]))
    qtbot.waitUntil(lambda: side.desk.session.history.undo_name == "Draw barb of feather", timeout=60_000)
    assert worn(side)[COLUMNS["barbAngleMiddleRight"]] != before[COLUMNS["barbAngleMiddleRight"]]
    assert abs(worn(side)[COLUMNS["barbCurveRight"]]) < 1e-6  # it was drawn straight


def test_the_feather_in_space_is_drawn_in_slices_and_turned_by_hand(side: FeatherSide, qtbot: QtBot) -> None:
    qtbot.waitUntil(lambda: side.solid._image is not None and not side.solid._slices.isActive())
    assert side.solid._image is not None
    wide = side.solid._image.width()
    before = side.solid.camera(1.0).world_from_camera
    qtbot.mousePress(side.solid, Qt.MouseButton.LeftButton, pos=QPoint(40, 60))
    qtbot.mouseMove(side.solid, QPoint(90, 60))
    qtbot.waitUntil(lambda: side.solid._image is not None and side.solid._image.width() < wide)  # coarse meanwhile
    qtbot.mouseRelease(side.solid, Qt.MouseButton.LeftButton, pos=QPoint(90, 60))
    qtbot.waitUntil(lambda: side.solid._image is not None and side.solid._image.width() == wide)
    assert not np.allclose(side.solid.camera(1.0).world_from_camera, before)


def test_without_feathers_at_hand_the_editor_says_how_to_get_some(side: FeatherSide) -> None:
    side.desk.edit("No feathers", lambda document: document.replace(feathers=()))
    assert side.canvas.feather is None
    assert "Dress with feathers" in side.canvas.words
    assert not side.attributes.isEnabled()


def test_an_expression_may_shape_the_feather(side: FeatherSide) -> None:
    side.attributes.group.enter("vane")
    side.attributes.edited.emit("vaneCupLeft", constant(0.5, "a map"), True)
    item = side.desk.document.feathers[0].attributes[0]
    assert (item.name, item.value.map) == ("vaneCupLeft", "a map")


def test_placements_are_added_changed_and_removed_in_steps(side: FeatherSide) -> None:
    listed, history = side.placements, side.desk.session.history
    listed.add.click()
    assert [p.kind for p in side.desk.document.feathers[0].placements] == ["rows", "even"]
    assert history.undo_name == "Set more feathers"
    assert listed.which.value() == 1
    listed.kind.enter("repulsion")
    listed.count.enter(77)
    made = side.desk.document.feathers[0].placements[1]
    assert (made.kind, made.count) == ("repulsion", 77)
    assert listed.which.words() == "2 · 77 repulsion"
    listed.remove.click()
    assert len(side.desk.document.feathers[0].placements) == 1
    assert listed.which.value() == 0


def test_a_photograph_is_traced(side: FeatherSide, qtbot: QtBot, tmp_path: Path) -> None:
    picture = np.full((300, 200, 3), 255, np.uint8)
    cv2.ellipse(picture, (100, 120), (40, 100), 0, 0, 360, (40, 40, 160), -1)  # blue, green, red
    cv2.line(picture, (100, 200), (100, 290), (40, 40, 160), 4)
    cv2.imwrite(str(tmp_path / "photo.png"), picture)
    side.trace_photograph(tmp_path / "photo.png")
    qtbot.waitUntil(lambda: side.desk.session.history.undo_name == "Trace feather", timeout=60_000)
    made = worn(side)
    assert made[COLUMNS["vaneStartLeft"]] == pytest.approx(70 / 270, abs=0.05)  # the quill is a quarter of it
    assert made[COLUMNS["colorMiddleRed"]] == pytest.approx(((160 / 255 + 0.055) / 1.055) ** 2.4, abs=0.01)
