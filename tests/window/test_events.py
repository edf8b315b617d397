"""The window in the hand: real events of mouse, keys and pen, and what they make of the document."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QEvent, QPoint, Qt
from PySide6.QtTest import QTest

from app.window.commands import Commands
from core.document import Document
from tests.window.conftest import Opened
from tests.window.hand import CTRL, LEFT, RIGHT, SHIFT, Hand
from tools.ground import Pointer

BACK, ASIDE = (0.60, 0.42), (0.68, 0.36)  # on the animal's back
NOWHERE = (0.04, 0.55)


def guides(hand: Hand) -> np.ndarray:
    return hand.window.desk.document.grooms[0].guides.points


def names(hand: Hand) -> tuple[str, ...]:
    return hand.window.desk.session.history.names


def test_a_drag_combs_and_is_one_step(hand: Hand) -> None:
    before, session = guides(hand), hand.window.desk.session
    hand.press(BACK)
    assert session.stroking
    hand.move(ASIDE)
    hand.painted()
    assert guides(hand) is not before  # seen while the hand moves
    assert session.history.names[-1] != "Comb"
    hand.release(ASIDE)
    assert names(hand)[-1] == "Comb"
    assert not session.stroking
    moved = np.abs(guides(hand) - before).max(axis=(1, 2)) > 0
    assert 0 < moved.sum() < len(moved)
    hand.key(Qt.Key.Key_Z, CTRL)
    assert guides(hand) is before
    hand.key(Qt.Key.Key_Z, CTRL | SHIFT)
    assert guides(hand) is not before


def test_escape_gives_a_stroke_up_and_its_release_does_nothing(hand: Hand) -> None:
    before = hand.window.desk.document
    hand.press(BACK)
    hand.move(ASIDE)
    hand.painted()
    hand.key(Qt.Key.Key_Escape)
    assert hand.window.desk.document is before
    hand.release(ASIDE)
    assert hand.window.desk.document is before
    assert not hand.window.desk.session.stroking


def test_samples_between_two_pictures_come_as_one_batch(hand: Hand) -> None:
    batches: list[int] = []
    session = hand.window.desk.session
    extend = session.hand.move
    session.hand.move = lambda pointers: (batches.append(len(pointers)), extend(pointers))  # type: ignore[method-assign]
    hand.press(BACK)
    hand.painted()
    for x in range(6):
        hand.view._move(Pointer(400.0 + 4 * x, 260.0), QPoint())
    hand.painted()
    hand.release(ASIDE)
    assert 6 in batches


def test_the_pen_combs_with_its_pressure_and_no_mouse_paints_beside_it(hand: Hand) -> None:
    seen: list[Pointer] = []
    session = hand.window.desk.session
    recorded = session.hand.move
    session.hand.move = lambda pointers: (seen.extend(pointers), recorded(pointers))  # type: ignore[method-assign]
    kinds = QEvent.Type
    assert hand.pen(kinds.TabletPress, BACK, 0.25, (30.0, -20.0))
    QTest.mousePress(hand.view, LEFT, Qt.KeyboardModifier.NoModifier, hand.at(NOWHERE))  # what the system makes of it
    for pressure in (0.4, 0.7):
        assert hand.pen(kinds.TabletMove, ASIDE, pressure, (30.0, -20.0), eraser=False)
        QTest.mouseMove(hand.view, hand.at(NOWHERE))
        hand.painted()
    assert hand.pen(kinds.TabletRelease, ASIDE, 0.0)
    QTest.mouseRelease(hand.view, LEFT, Qt.KeyboardModifier.NoModifier, hand.at(NOWHERE))
    assert [round(p.pressure, 2) for p in seen] == [0.4, 0.7]
    assert np.allclose([(p.tilt_x, p.tilt_y) for p in seen], np.radians((30.0, -20.0)))
    assert names(hand)[-1] == "Comb"
    assert names(hand).count("Comb") == 1


def test_the_other_end_of_the_pen_is_known(hand: Hand) -> None:
    hand.pen(QEvent.Type.TabletPress, BACK, 0.5, eraser=True)
    assert hand.view.gestures.stroke is not None
    assert hand.view.gestures.stroke.pointer.eraser
    hand.pen(QEvent.Type.TabletRelease, BACK, 0.0, eraser=True)


def test_planting_cloning_spraying_undo_and_redo(hand: Hand) -> None:
    window, start = hand.window, hand.window.desk.document
    count = len(start.grooms[0].guides)
    window.commands.run("tool.plant")
    hand.drag(BACK, BACK, steps=1)
    assert len(window.desk.document.grooms[0].guides) > count
    window.commands.run("tool.hairspray")
    hand.drag(BACK, ASIDE)
    assert window.desk.document.grooms[0].guides.hold.max() > 0.0
    made = window.desk.document
    while window.desk.session.history.undo_name:
        hand.key(Qt.Key.Key_Z, CTRL)
    assert window.desk.document is start
    while window.desk.session.history.redo_name:
        hand.key(Qt.Key.Key_Z, CTRL | SHIFT)
    assert window.desk.document is made


def test_what_cannot_be_done_is_a_line_and_nothing_hangs(hand: Hand) -> None:
    desk = hand.window.desk
    desk.edit("Lock", lambda d: d.replace(meshes=(d.meshes[0].replace(locked=True),)))
    hand.press(BACK)
    assert "locked" in hand.window.status.words.text()
    assert not desk.session.stroking
    assert hand.view.gestures.drag is None
    hand.release(BACK)


def test_a_tool_that_fails_gives_its_stroke_up_and_says_so(hand: Hand) -> None:
    desk = hand.window.desk
    tool = type(desk.session.tool)

    class Broken:
        def extend(self, guides: object, pointers: object) -> object:
            raise ZeroDivisionError("of a studio's own")

    before, begin = desk.document, tool.begin
    tool.begin = lambda self, ground, pointer: Broken()  # type: ignore[method-assign,assignment,return-value]
    try:
        hand.press(BACK)
    finally:
        tool.begin = begin  # type: ignore[method-assign]
    assert desk.document is before
    assert not desk.session.stroking
    assert "of a studio's own" in hand.window.status.words.text()
    assert hand.window.status.copy.isVisible()
    hand.drag(BACK, ASIDE)
    assert names(hand)[-1] == "Comb"


def test_f_sizes_the_brush_by_hand_and_by_number(hand: Hand) -> None:
    size = lambda: hand.window.desk.session.tool.params.size  # noqa: E731
    start = size()
    hand.move((0.5, 0.5))
    hand.key(Qt.Key.Key_F)
    hand.move((0.6, 0.5))
    hand.painted()
    assert size() > start + 20.0
    hand.key(Qt.Key.Key_Escape)
    assert size() == start
    hand.key(Qt.Key.Key_F)
    for key in (Qt.Key.Key_4, Qt.Key.Key_2):
        hand.key(key)
    hand.key(Qt.Key.Key_Return)
    assert size() == 42.0
    assert hand.view.gestures.drag is None
    hand.key(Qt.Key.Key_F, SHIFT)
    hand.key(Qt.Key.Key_Period)
    hand.key(Qt.Key.Key_3)
    QTest.mouseClick(hand.view, LEFT, Qt.KeyboardModifier.NoModifier, hand.at((0.6, 0.5)))
    assert hand.window.desk.session.tool.params.strength == 0.3
    assert names(hand)[-1] == "New"  # the click that ended it made no stroke


def test_the_radial_menu_opens_with_the_right_button_and_chooses_by_a_flick(hand: Hand) -> None:
    chosen = hand.window.desk.session.tool.name
    hand.press((0.5, 0.5), RIGHT)
    radial = hand.view.gestures.radial
    assert radial is not None
    hand.move((0.62, 0.5))  # to the right: Smooth
    hand.release((0.62, 0.5), RIGHT)
    hand.until(lambda: hand.view.gestures.radial is None)
    assert chosen != "smooth"
    assert hand.window.desk.session.tool.name == "smooth"


def test_hotkeys_of_tools_work_over_the_view(hand: Hand) -> None:
    keymap = hand.window.hotkeys.keymap
    commands: Commands = hand.window.commands
    keys = {name: keymap.of(name)[0] for name in ("tool.smooth", "tool.cut") if keymap.of(name)}
    assert keys
    for name, text in keys.items():
        if len(text) == 1:
            QTest.keyClick(hand.view, text.lower())  # type: ignore[call-overload]
            assert f"tool.{hand.window.desk.session.tool.name}" == name
            assert name in commands


def test_closing_and_opening_the_view_fifty_times_keeps_its_picture(hand: Hand) -> None:
    context = hand.view.context()
    for _ in range(50):
        hand.window.view.float_out()
        hand.until(hand.view.isExposed)
        hand.window.view.dock()
        hand.until(hand.view.isExposed)
    assert hand.view.context() is not None
    assert hand.view.context() == context  # nothing had to be made anew
    hand.rest()
    image = hand.view.grabFramebuffer()
    assert len({image.pixel(x, image.height() // 2) for x in range(0, image.width(), 7)}) > 20
    hand.drag(BACK, ASIDE)
    assert names(hand)[-1] == "Comb"


def test_nothing_is_painted_at_rest(hand: Hand) -> None:
    hand.move(BACK)
    hand.finish()
    painted: list[int] = []
    hand.view.painted.connect(lambda: painted.append(1))
    QTest.qWait(400)
    assert not painted


def test_the_ring_follows_the_pointer_without_a_new_picture(hand: Hand) -> None:
    hand.move(BACK)
    hand.finish()
    frames = hand.view.frames
    for x in (0.3, 0.4, 0.5):
        hand.move((x, 0.5))
        hand.painted()
    assert hand.view.frames == frames
    assert hand.view.at_rest


def test_a_window_of_another_animal_shows_that(opened: Opened, animal: Document) -> None:
    hand = opened(animal)
    hand.window.commands.run("file.new")
    assert hand.window.middle.currentWidget() is hand.window.doors
    hand.window.desk.replace_session(hand.window.make_session(animal))
    assert hand.window.middle.currentWidget() is hand.window.sides
    hand.rest()
    hand.drag(BACK, ASIDE)
    assert names(hand)[-1] == "Comb"
