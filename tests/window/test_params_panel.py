"""Forms made of records, the panels of the desk, sections, and the picture of it all."""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QImage, QMouseEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QHBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from app.window.craft_panels import CoatPanel, RespectPanel, ToolPanel
from app.window.desk import Desk
from app.window.fields.choice_bar import ChoiceBar, SwitchBar
from app.window.fields.color_field import ColorField
from app.window.fields.number_bar import NumberBar
from app.window.fields.value_field import ValueField
from app.window.params_panel import MapBar, RecordForm, Setting, make_field
from app.window.sections import Column, FoldMemory, Section
from app.window.shelf import Shelf
from app.window.theme import apply, load_theme
from core.curve import Curve, Key
from core.field import Field, field, fields_of
from core.groom.groom import COAT_FIELDS, Coat
from core.record import Record
from core.value import Value, constant, formula
from core.workspace import Workspace
from tests.documents import small_document
from tools.registry import Registry
from tools.session import Session

LEFT, NONE = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier


class Brush(Record):
    size: Annotated[float, field("Size", "Radius of the ring in pixels of the view.", "px", (0, 100), (1, 400))] = 50.0
    count: Annotated[int, field("Count", "How many hairs one dab of the brush plants.", "", (1, 10))] = 3
    on: Annotated[bool, field("Switched on", "Whether the brush does anything at all now.")] = True
    mode: Annotated[str, field("Mode", "How the brush fades to its rim.", choices=("soft", "hard"))] = "soft"
    colour: Annotated[tuple[float, float, float], field("Colour", "Linear colour of the dab.")] = (0.1, 0.2, 0.3)
    amount: Annotated[Value, field("Amount", "How much of everything there is.", "", (0, 1))] = constant(0.5)
    map: Annotated[str | None, field("Map", "Where it works: 1 is full, 0 is nothing.")] = None
    secret: int = 7


STUDIO_TOOLS = """
from typing import Annotated
from core.field import field
from core.record import Record
from tools.tool import Tool

class Params(Record):
    radius: Annotated[float, field("Reach", "How far around the pointer it works, in pixels.", "px", (0, 100))] = 20.0

def tool(number):
    class Studio(Tool):
        name, label, icon, order = f"studio_{number}", f"Studio {number}", "puff", 900 + 5 * number
        tooltip = "A tool of a studio's own, which does nothing but stand in the shelf."
        hint, step = "Drag: nothing", "Nothing"
    Studio.Params, Studio.__name__ = Params, f"Studio{number}"
    return Studio

A, B, C, D = (tool(number) for number in range(4))
"""


@pytest.fixture
def desk(qapp: QApplication, tmp_path: Path) -> Iterator[Desk]:
    apply(qapp, load_theme("dark"), 12)
    (tmp_path / "studio_tools.py").write_text(STUDIO_TOOLS)
    tools = Registry((tmp_path,))
    assert tools.troubles == []
    desk = Desk(Session(small_document(), Workspace(tool="comb", frame=1001.0), tools=tools))
    yield desk
    desk.session.close(discard=True)


def shown(qtbot: QtBot, widget: QWidget, width: int = 340, height: int = 700) -> QWidget:
    qtbot.addWidget(widget)
    widget.resize(width, height)
    with qtbot.waitActive(widget):
        widget.show()
        widget.activateWindow()
    return widget


def drag(bar: QWidget, way: float, release: bool = True) -> None:
    """Drag a bar by a share of its width."""
    for kind, x, buttons in (
        (QEvent.Type.MouseButtonPress, 20.0, LEFT), (QEvent.Type.MouseMove, 20.0 + way * (bar.width() - 2) / 2, LEFT),
        (QEvent.Type.MouseMove, 20.0 + way * (bar.width() - 2), LEFT),
        (QEvent.Type.MouseButtonRelease, 20.0 + way * (bar.width() - 2), Qt.MouseButton.NoButton),
    ):
        if kind != QEvent.Type.MouseButtonRelease or release:
            button = Qt.MouseButton.NoButton if kind == QEvent.Type.MouseMove else LEFT
            at = QPointF(x, 10.0)
            QApplication.sendEvent(bar, QMouseEvent(kind, at, QPointF(bar.mapToGlobal(at)), button, buttons, NONE))


def test_every_described_field_gets_the_widget_of_its_type(qtbot: QtBot) -> None:
    form = RecordForm(Brush(), Setting(maps=("ears",)))
    qtbot.addWidget(form)
    kinds = {name: type(widget) for name, widget in form.fields.items()}
    assert kinds == {"size": NumberBar, "count": NumberBar, "on": SwitchBar, "mode": ChoiceBar, "colour": ColorField,
                     "amount": ValueField, "map": MapBar}
    assert [row.label.text() for row in form.rows.values()] == [f.label for f in fields_of(Brush).values()]


def test_a_type_without_a_field_is_named() -> None:
    with pytest.raises(TypeError, match="no field for Odd"):
        make_field(Field("Odd", "Something nobody can edit."), dict, {})


def test_a_drag_changes_one_field_of_the_record(qtbot: QtBot) -> None:
    start = Brush()
    form = RecordForm(start)
    told: list[tuple[Brush, bool]] = []
    form.changed.connect(lambda record, final: told.append((record, final)))
    shown(qtbot, form)
    drag(form.fields["size"], 0.25)
    assert [final for _, final in told] == [False, False, True]
    assert told[-1][0].size == pytest.approx(75.0)
    assert told[-1][0].secret == 7
    assert told[-1][0].colour is start.colour
    QTest.mouseClick(form.fields["on"], LEFT, NONE, QPoint(10, 10))
    assert (told[-1][0].size, told[-1][0].on, told[-1][1]) == (pytest.approx(75.0), False, True)


def test_an_edit_taken_back_gives_the_very_record(qtbot: QtBot) -> None:
    start = Brush()
    form = RecordForm(start)
    told: list[tuple[Brush, bool]] = []
    form.changed.connect(lambda record, final: told.append((record, final)))
    shown(qtbot, form)
    for name in ("size", "count"):
        drag(form.fields[name], 0.2, release=False)
        QTest.keyClick(form.fields[name], Qt.Key.Key_Escape)
        assert told[-1] == (start, True)
        assert told[-1][0] is start
    amount = form.fields["amount"]
    assert isinstance(amount, ValueField)
    drag(amount.bar, 0.2, release=False)
    QTest.keyClick(amount.bar, Qt.Key.Key_Escape)
    assert told[-1][0] is start


def test_a_record_from_outside_is_shown_without_being_said_again(qtbot: QtBot) -> None:
    form = RecordForm(Brush())
    told: list[object] = []
    form.changed.connect(lambda record, final: told.append(record))
    shown(qtbot, form)
    form.set_record(Brush(size=80.0, on=False, mode="hard", amount=formula("frame / 2"), map="gone"))
    assert form.fields["size"].value() == 80.0
    assert form.fields["on"].value() is False
    assert form.fields["mode"].value() == "hard"
    amount = form.fields["amount"]
    assert isinstance(amount, ValueField)
    assert amount.line.text() == "frame / 2"
    assert form.fields["map"].words() == "gone"  # type: ignore[union-attr]
    assert told == []


def test_the_tool_panel_follows_the_tool_and_changes_its_parameters(qtbot: QtBot, desk: Desk) -> None:
    panel = ToolPanel(desk)
    shown(qtbot, panel)
    assert panel.title == desk.session.tool.label
    assert panel.form is not None
    size = desk.session.tool.params.size
    history = len(desk.session.history.names)
    drag(panel.form.fields["size"], 0.2)
    assert desk.session.tool.params.size > size
    assert len(desk.session.history.names) == history  # parameters are outside undo
    desk.choose("comb", size=123.0)
    assert panel.form.fields["size"].value() == 123.0
    desk.choose("studio_2")
    assert panel.title == "Studio 2"
    assert list(panel.form.fields) == ["radius"]


def test_switching_tools_leaves_no_widgets_behind(qtbot: QtBot, desk: Desk) -> None:
    shown(qtbot, ToolPanel(desk))
    counts = []
    for _ in range(6):
        for name in ("studio_1", "comb"):
            desk.choose(name)
            QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
            QApplication.processEvents()
        counts.append(len(QApplication.allWidgets()))
    assert len(set(counts[1:])) == 1, counts


def test_the_respect_panel_is_the_workspace(qtbot: QtBot, desk: Desk) -> None:
    panel = RespectPanel(desk)
    shown(qtbot, panel)
    assert panel.form is not None
    QTest.mouseClick(panel.form.fields["symmetry"], LEFT, NONE, QPoint(10, 10))
    assert desk.workspace.respect.symmetry is True
    desk.set_workspace(respect=desk.workspace.respect.replace(hairspray=False))
    assert panel.form.fields["hairspray"].value() is False


def test_a_drag_in_the_coat_is_a_preview_and_one_step_of_history(qtbot: QtBot, desk: Desk) -> None:
    panel = CoatPanel(desk)
    shown(qtbot, panel)
    assert panel.form is not None
    session, before = desk.session, desk.document
    steps = len(session.history.names)
    bar = panel.form.fields["clump"].bar  # type: ignore[union-attr]
    drag(bar, 0.3, release=False)
    assert session.history.current is before
    assert desk.document.grooms[0].coat.clump.base.number == pytest.approx(0.3, abs=1e-3)
    drag(bar, 0.0)  # press again ends the first drag: what was previewed is one step
    assert len(session.history.names) == steps + 1
    assert session.history.names[-1] == "Coat clump"
    session.undo()
    assert desk.document is before
    assert bar.value() == before.grooms[0].coat.clump.base.number  # type: ignore[union-attr]


def test_escape_in_the_coat_leaves_the_document_and_history_alone(qtbot: QtBot, desk: Desk) -> None:
    panel = CoatPanel(desk)
    shown(qtbot, panel)
    assert panel.form is not None
    before, steps = desk.document, len(desk.session.history.names)
    bar = panel.form.fields["count"]
    drag(bar, 0.3, release=False)
    assert desk.document is not before
    QTest.keyClick(bar, Qt.Key.Key_Escape)
    assert desk.document is before
    assert len(desk.session.history.names) == steps


def test_what_the_document_refuses_is_said_and_put_back(qtbot: QtBot, desk: Desk) -> None:
    panel = CoatPanel(desk)
    shown(qtbot, panel)
    said: list[str] = []
    desk.failed.connect(lambda sentence, details: said.append(sentence))
    assert panel.form is not None
    coat, before = desk.document.grooms[0].coat, desk.document
    panel.form.fields["frizz"].edited.emit(formula("nobody * 2"), True)
    assert desk.document is before
    assert len(said) == 1
    assert "nobody" in said[0]
    assert panel.form.record() is coat
    assert panel.form.fields["frizz"].value() is coat.frizz


def test_panels_follow_another_document_and_say_what_is_missing(qtbot: QtBot, desk: Desk) -> None:
    panels = [CoatPanel(desk), ToolPanel(desk), RespectPanel(desk)]
    for panel in panels:
        shown(qtbot, panel)
    desk.replace_session(Session(), discard=True)
    assert panels[0].form is None
    assert "No groom yet" in panels[0].box.layout().itemAt(0).widget().text()
    desk.replace_session(Session(small_document()), discard=True)
    assert panels[0].form is not None
    assert list(panels[0].form.fields) == list(COAT_FIELDS)


def test_sections_fold_and_remember_it(qtbot: QtBot, tmp_path: Path) -> None:
    section = Section("Coat", RecordForm(Brush()), FoldMemory(tmp_path))
    shown(qtbot, section)
    QTest.mouseClick(section.header, LEFT, NONE, QPoint(10, 10))
    assert section.folded
    assert not section.content.isVisible()
    again = Section("Coat", RecordForm(Brush()), FoldMemory(tmp_path))
    shown(qtbot, again)
    assert again.folded
    QTest.keyClick(again.header, Qt.Key.Key_Space)
    assert again.content.isVisible()
    assert "Coat" not in FoldMemory(tmp_path)


def test_a_folded_section_leaves_no_hole(qtbot: QtBot, tmp_path: Path) -> None:
    column = Column()
    first, second = (Section(name, RecordForm(Brush()), FoldMemory(tmp_path)) for name in ("One", "Two"))
    column.add(first)
    column.add(second)
    shown(qtbot, column)
    below = second.y()
    first.fold(True)
    qtbot.waitUntil(lambda: second.y() < first.y() + 2 * first.header.height())
    first.fold(False)
    qtbot.waitUntil(lambda: second.y() == below)


def test_the_shelf_has_every_tool_and_shows_the_active_one(qtbot: QtBot, desk: Desk) -> None:
    shelf = Shelf(desk, lambda name: "C" if name == "comb" else "")
    shown(qtbot, shelf, shelf.sizeHint().width(), 900)
    assert list(shelf.buttons) == [tool.name for tool in desk.session.tools.of("groom")]
    for tool in desk.session.tools.of("groom"):
        QTest.mouseClick(shelf.buttons[tool.name], LEFT)
        assert desk.session.tool.name == tool.name
        assert [name for name, button in shelf.buttons.items() if button.isChecked()] == [tool.name]
        assert tool.label in shelf.buttons[tool.name].toolTip()
    assert ">C<" in shelf.buttons["comb"].toolTip()
    QTest.mouseClick(shelf.buttons[desk.session.tool.name], LEFT)  # again: it stays lit
    assert shelf.buttons[desk.session.tool.name].isChecked()


def test_the_shelf_shows_the_tools_of_the_craft(qtbot: QtBot, desk: Desk) -> None:
    shelf = Shelf(desk)
    shown(qtbot, shelf, shelf.sizeHint().width(), 900)
    desk.set_craft("pose")
    assert list(shelf.buttons) == [tool.name for tool in desk.session.tools.of("pose")]
    assert shelf.buttons[desk.session.tool.name].isChecked()
    desk.set_craft("groom")
    assert "comb" in shelf.buttons


def test_a_low_shelf_has_a_menu_of_the_others(qtbot: QtBot, desk: Desk) -> None:
    shelf = Shelf(desk)
    shown(qtbot, shelf, shelf.sizeHint().width(), 3 * 44)
    hidden = shelf.overflow
    assert len(hidden) > 0
    assert shelf.more.isVisible()
    bottom = max(b.geometry().bottom() for b in (*shelf.buttons.values(), shelf.more) if b.isVisible())
    assert bottom < shelf.height()
    label = desk.session.tools.tools[hidden[-1]].label
    menu = shelf.menu()
    next(action for action in menu.actions() if action.text() == label).trigger()
    assert desk.session.tool.name == hidden[-1]
    assert shelf.buttons[hidden[-1]].isVisible()
    shelf.resize(shelf.width(), 2000)
    QApplication.processEvents()
    assert shelf.overflow == ()
    assert not shelf.more.isVisible()


@pytest.mark.parametrize("theme", ["dark", "light"])
@pytest.mark.parametrize("size", [12, 18])
def test_the_column_stands_in_line(qtbot: QtBot, qapp: QApplication, desk: Desk, tmp_path: Path, theme: str, size: int,
                                   ) -> None:
    look = apply(qapp, load_theme(theme), size)
    window = demo(desk)
    shown(qtbot, window, 34 * size, 84 * size)
    forms = window.findChildren(RecordForm)
    rows = [row for form in forms for row in form.rows.values()]
    assert len(rows) > 20
    lefts = {row.field.mapTo(window, QPoint(0, 0)).x() for row in rows}
    rights = {row.field.mapTo(window, QPoint(row.field.width(), 0)).x() for row in rows}
    assert len(lefts) == len(rights) == 1
    bars = [bar for kind in (NumberBar, SwitchBar, ChoiceBar, ColorField) for bar in window.findChildren(kind)]
    assert {bar.height() for bar in bars if bar.isVisible()} == {look.row}
    for row in rows:
        metrics = row.label.fontMetrics()
        assert metrics.horizontalAdvance(row.label.text()) <= row.label.width(), row.label.text()
    picture = tmp_path / f"column_{theme}_{size}.png"
    assert window.grab().save(str(picture))
    shares = _shares(QImage(str(picture)))
    for name in ("panel", "field", "fill"):
        assert shares[tuple(look.theme.colour(name).getRgb()[:3])] > 0.01, name


def test_another_text_size_and_theme_reach_what_is_shown_already(qtbot: QtBot, qapp: QApplication, desk: Desk) -> None:
    window = demo(desk)
    shown(qtbot, window, 700, 1400)
    bar = next(bar for bar in window.findChildren(NumberBar) if bar.isVisible())
    shelf = window.findChild(Shelf)
    assert shelf is not None
    small = bar.height(), shelf.sizeHint().width(), bar.fontMetrics().height()
    look = apply(qapp, load_theme("light"), 18)
    qtbot.waitUntil(lambda: bar.height() == look.row)
    qtbot.waitUntil(lambda: shelf.buttons["comb"].isVisible() and shelf.buttons["comb"].width() == look.shelf)
    large = bar.height(), shelf.sizeHint().width(), bar.fontMetrics().height()
    assert all(b > a for a, b in zip(small, large, strict=True))
    picture = _shares(window.grab().toImage())
    dark = load_theme("dark")
    for name in ("panel", "field", "fill"):  # a rim of a letter may have any colour between
        assert picture.get(tuple(dark.colour(name).getRgb()[:3]), 0.0) < 0.001, name
        assert picture[tuple(look.theme.colour(name).getRgb()[:3])] > 0.01, name
    apply(qapp, load_theme("dark"), 12)


def demo(desk: Desk) -> QWidget:
    """A shelf beside a column with a field of every kind."""
    keys = (Key(frame=1001.0, value=0.2), Key(frame=1012.0, value=0.9), Key(frame=1030.0, value=0.4))
    coat = Coat(clump=Value(base=Curve(keys=keys)), frizz=formula("noise(id * 3) * 0.3"),
                length_variation=constant(0.3, "stripe"), density_map="stripe")
    window = QWidget()
    line = QHBoxLayout(window)
    line.setContentsMargins(0, 0, 0, 0)
    line.setSpacing(0)
    line.addWidget(Shelf(desk))
    column = Column()
    line.addWidget(column, 1)
    column.add(ToolPanel(desk))
    column.add(RespectPanel(desk))
    form = RecordForm(coat, Setting("cm", 1012.0, ("frame", "id"), ("stripe",)))
    clump = form.fields["clump"]
    assert isinstance(clump, ValueField)
    clump.show_curve(True)
    column.add(Section("Coat", form))
    return window


def _shares(image: QImage) -> dict[tuple[int, ...], float]:
    """The share of the picture that each colour covers."""
    image = image.convertToFormat(QImage.Format.Format_RGB32)
    pixels = np.frombuffer(image.constBits(), np.uint8).reshape(-1, 4)[:, 2::-1].copy()
    colours, counts = np.unique(pixels, axis=0, return_counts=True)
    return {tuple(int(c) for c in row): n / len(pixels) for row, n in zip(colours, counts, strict=True)}


def sweep(first: QWidget, last: QWidget, way: float, release: bool = True) -> None:
    """Press on a widget, go down to another, then to the side by a share of the width of a bar."""
    start, end = (QPointF(w.mapToGlobal(QPointF(20.0, 0.5 * w.height()))) for w in (first, last))
    end.setX(start.x())
    places = [start, 0.5 * (start + end), end, end + QPointF(11.0, 0.0)]
    places += [places[-1] + QPointF(part * way * 200.0, 0.0) for part in (0.5, 1.0) if way]
    for number, place in enumerate(places if way else places[:3]):
        kind = QEvent.Type.MouseMove if number else QEvent.Type.MouseButtonPress
        QApplication.sendEvent(first, QMouseEvent(
            kind, QPointF(first.mapFromGlobal(place)), place, Qt.MouseButton.NoButton if number else LEFT, LEFT, NONE))
    if release:
        QApplication.sendEvent(first, QMouseEvent(
            QEvent.Type.MouseButtonRelease, QPointF(first.mapFromGlobal(place)), place, LEFT,
            Qt.MouseButton.NoButton, NONE))


@pytest.mark.parametrize("on_label", [False, True])
def test_a_drag_down_over_bars_and_then_sideways_changes_them_all_in_one_step(
    qtbot: QtBot, desk: Desk, on_label: bool,
) -> None:
    panel = CoatPanel(desk)
    shown(qtbot, panel)
    assert panel.form is not None
    form, session, before = panel.form, desk.session, desk.document
    bars = {name: form.fields[name].bar for name in ("density", "length", "width_root")}  # type: ignore[union-attr]
    old = {name: bar.value() for name, bar in bars.items()}
    share = 200.0 / (bars["length"].width() - 2)
    sweep(form.rows["length"].label if on_label else bars["length"], bars["width_root"], -0.2)
    coat = desk.document.grooms[0].coat
    for name in ("length", "width_root"):
        low, high = bars[name].soft
        wanted = max(old[name] - 0.2 * share * (high - low), low)
        assert getattr(coat, name).base.number == pytest.approx(wanted, rel=1e-3)
    assert coat.density is before.grooms[0].coat.density
    assert session.history.undo_name == "Coat 2 values"
    session.undo()
    assert desk.document is before
    sweep(bars["length"], bars["width_root"], 0.3, release=False)
    assert session.document is not before
    QTest.keyClick(bars["length"], Qt.Key.Key_Escape)
    assert session.document is before
    assert {name: bar.value() for name, bar in bars.items()} == old
    sweep(bars["length"], bars["length"], 0.2)
    assert session.history.undo_name == "Coat length"


def test_a_drag_over_bars_that_is_let_go_types_one_number_into_all(qtbot: QtBot, desk: Desk) -> None:
    panel = CoatPanel(desk)
    shown(qtbot, panel)
    assert panel.form is not None
    before, form = desk.document, panel.form
    bars = {name: form.fields[name].bar for name in ("clump", "frizz", "length_variation")}  # type: ignore[union-attr]
    for words, key in (("0.25", Qt.Key.Key_Return), ("0.75", Qt.Key.Key_Escape)):
        sweep(bars["clump"], bars["length_variation"], 0.0)
        assert bars["clump"].line is not None
        assert bars["frizz"].gathered
        bars["clump"].line.selectAll()
        QTest.keyClicks(bars["clump"].line, words)
        QTest.keyClick(bars["clump"].line, key)
        qtbot.waitUntil(lambda: not bars["frizz"].gathered)
        assert [bar.value() for bar in bars.values()] == [0.25] * 3
        assert not form.editing
    assert desk.session.history.undo_name == "Coat 3 values"
    desk.session.undo()
    assert desk.document is before
