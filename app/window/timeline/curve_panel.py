"""The curve panel over the timeline: every keyed value in a list, the chosen ones as curves together."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, QPoint, QSize, Qt, Signal
from PySide6.QtGui import QEnterEvent, QIcon, QPainter, QPixmap, QShowEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHBoxLayout,
    QLabel,
    QMenu,
    QSizePolicy,
    QSplitter,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from app.window.commands import Commands
from app.window.desk import Desk
from app.window.fields.number_text import Scale, scale_of
from app.window.hotkeys import Hotkeys, at_curves, tooltip
from app.window.icons import IconButton
from app.window.pose.graph import line_colour
from app.window.status_line import GAP
from app.window.theme import look_of
from app.window.timeline.curve_view import CurveView, Shown
from app.window.timeline.timeline import NumberField
from core.curve import Curve, value_range
from core.workspace import Workspace
from tools.keyed import Keyed

ADDRESS = Qt.ItemDataRole.UserRole
BUTTONS = (
    ("curves.auto", "curves.linear", "curves.constant", "curves.aligned", "curves.free"),
    ("curves.insert", "curves.delete", "curves.copy", "curves.paste"),
    ("curves.snap", "curves.normalize", "curves.frame_all"),
)
EMPTY = "No value has keys yet. The diamond beside a number of the coat sets the first one."


HINT = GAP.join((
    "Drag: move keys or select", "Shift: one direction, or select more", "Ctrl: off whole frames, or on them",
    "Double click: set a key", "Alt: one handle alone", "Wheel: nearer", "Middle button: slide"))


class CurvePanel(QWidget):
    """List, buttons, curves, and the selected keys as numbers. hint : what mouse and keys do here, or nothing."""

    hint = Signal(str)

    def __init__(self, desk: Desk, commands: Commands, hotkeys: Hotkeys, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._desk, self._keys, self._hotkeys = desk, desk.keys, hotkeys
        self._seen: frozenset[str] = frozenset()
        self.list = CurveList(desk)
        self.view = CurveView()
        self.view.scrubs = True
        self.view.setToolTip("Drag keys and handles, or the box around several to scale them; drag over nothing to "
                             "select, double-click to set a key. Wheel: nearer (Ctrl: time, Shift: values alone).")
        self.view.installEventFilter(self)
        self.view.setContextMenuPolicy(Qt.ContextMenuPolicy.CustomContextMenu)
        self.view.customContextMenuRequested.connect(self._open_menu)
        self.frame = NumberField("The frame of the selected keys, of the first of several; type another to move them.",
                                 self._type_frame, 7)
        self.value = NumberField("The value of the selected keys, empty when they differ; type one for all of them.",
                                 self._type_value, 8)
        self.unit = QLabel()
        self.buttons = {name: CommandButton(name, commands, hotkeys) for group in BUTTONS for name in group}
        self._words = QLabel(EMPTY)
        self._words.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self._words.setWordWrap(True)
        self._words.setEnabled(False)
        self._lay_out()
        at_curves(self)
        self.setAccessibleName("Curves")
        self.view.edited.connect(self._edited)
        self.view.picked_changed.connect(lambda: self._keys.select(self.view.picked))
        self.view.scrubbed.connect(lambda frame: desk.set_workspace(frame=frame))
        self._keys.changed.connect(self.refresh)
        self._keys.shown.connect(self._show_keys)
        desk.workspace_changed.connect(self._workspace_changed)
        self.refresh()

    def _lay_out(self) -> None:
        bar = QHBoxLayout()
        bar.setSpacing(2)
        for group in BUTTONS:
            for name in group:
                bar.addWidget(self.buttons[name])
            bar.addSpacing(10)
        bar.addStretch(1)
        for word, field in (("Frame", self.frame), ("Value", self.value)):
            label = QLabel(word)
            label.setEnabled(False)
            bar.addWidget(label)
            bar.addSpacing(4)
            bar.addWidget(field)
            bar.addSpacing(8)
        bar.addWidget(self.unit)
        self._right = QWidget()
        down = QVBoxLayout(self._right)
        down.setContentsMargins(0, 0, 0, 0)
        down.setSpacing(4)
        down.addLayout(bar)
        down.addWidget(self.view, 1)
        self.split = QSplitter(Qt.Orientation.Horizontal)
        self.split.setChildrenCollapsible(False)
        self.split.setHandleWidth(look_of().grid)
        self.split.addWidget(self.list)
        self.split.addWidget(self._right)
        self.split.setStretchFactor(0, 0)
        self.split.setStretchFactor(1, 1)
        self.split.setSizes([16 * look_of().text, 80 * look_of().text])
        whole = QVBoxLayout(self)
        whole.setContentsMargins(12, 4, 12, 0)
        whole.addWidget(self.split, 1)
        whole.addWidget(self._words, 1)

    def sizeHint(self) -> QSize:
        look = look_of()
        return QSize(60 * look.text, 20 * look.text)

    def refresh(self) -> None:
        """Show keys and selection as they are."""
        shown = self._keys.curves
        any_keys = bool(self._keys.all)
        self.split.setVisible(any_keys)
        self._words.setVisible(not any_keys)
        colours = {keyed.address: place for place, keyed in enumerate(self._keys.all)}
        self.view.snaps, self.view.labels = self._keys.snaps, not self._keys.normalized
        self.view.set_shown({keyed.address: self._shown(keyed, colours[keyed.address]) for keyed in shown})
        if not self.view.editing:
            self.view.pick(dict(self._keys.selected))
        self._frame_new(frozenset(keyed.address for keyed in shown))
        for button in self.buttons.values():
            button.refresh()
        self._show_numbers()

    def _shown(self, keyed: Keyed, colour: int) -> Shown:
        if not self._keys.normalized:
            return Shown(keyed.curve, colour, 0.0, self._scale(keyed).factor)
        low, high = value_range(keyed.curve)
        return Shown(keyed.curve, colour, low, high - low if high - low > 1e-12 * max(1.0, abs(high)) else 1.0)

    def _scale(self, keyed: Keyed) -> Scale:
        return scale_of(keyed.known, self._desk.document.unit)

    def _frame_new(self, names: frozenset[str]) -> None:
        """Bring other curves than before into view; a panel that is not seen waits with it."""
        seen = names | ({"normalized"} if self._keys.normalized else frozenset())
        if seen != self._seen and self.isVisible():
            self._seen = seen
            self.view.show_keys()

    def _show_keys(self, which: str) -> None:
        self.view.show_keys(self._keys.selected if which == "selected" else None)

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self.view.set_frame(self._desk.workspace.frame)
        self.refresh()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() in (QEvent.Type.Enter, QEvent.Type.Leave):
            self.hint.emit(HINT if event.type() == QEvent.Type.Enter else "")
        return super().eventFilter(watched, event)

    # -- numbers ---------------------------------------------------------------------------------------------

    def _picked(self) -> list[Keyed]:
        return [keyed for keyed in self._keys.curves if self._keys.selected.get(keyed.address)]

    def _show_numbers(self) -> None:
        picked = self._picked()
        frames = [keyed.curve.keys[i].frame for keyed in picked for i in self._keys.selected[keyed.address]]
        values = {keyed.curve.keys[i].value / self._scale(keyed).factor
                  for keyed in picked for i in self._keys.selected[keyed.address]}
        units = {self._scale(keyed).unit for keyed in picked}
        self.frame.show_number(min(frames) if frames else None)
        self.value.show_number(round(values.pop(), 9) if len(values) == 1 else None)
        self.unit.setText(units.pop() if len(units) == 1 else "")
        for field in (self.frame, self.value):
            field.setEnabled(bool(picked))

    def _type_frame(self, frame: float) -> None:
        if self._keys.count:
            self._desk.attempt(self._keys.set_frame, frame)

    def _type_value(self, value: float) -> None:
        picked = self._picked()
        if picked:
            self._desk.attempt(self._keys.set_values,
                               {keyed.address: value * self._scale(keyed).factor for keyed in picked})

    # -- what the hand does ----------------------------------------------------------------------------------

    def _edited(self, step: str, curves: dict[str, Curve], final: bool) -> None:
        if final:
            self._keys.commit(step, curves, self.view.picked)
        else:
            self._keys.preview(curves, self.view.picked)

    def _open_menu(self, place: QPoint) -> None:
        menu = QMenu(self)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        menu.setToolTipsVisible(True)
        for group in (*BUTTONS[:2], ("curves.snap_keys",), BUTTONS[2]):
            for name in group:
                menu.addAction(self._hotkeys.action(name))
            menu.addSeparator()
        self._hotkeys.refresh()
        menu.popup(self.view.mapToGlobal(place))

    def _workspace_changed(self, old: Workspace, new: Workspace) -> None:
        if old.frame != new.frame and self.isVisible():
            self.view.set_frame(new.frame)


class CurveList(QTreeWidget):
    """Every keyed value below the thing it belongs to; the chosen ones are shown, all when none is chosen."""

    def __init__(self, desk: Desk, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._keys = desk.keys
        self._addresses: tuple[tuple[str, str], ...] = ()
        self._following = False
        self.setHeaderHidden(True)
        self.setIndentation(look_of().gap)
        self.setRootIsDecorated(False)
        self.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        self.setMinimumWidth(8 * look_of().text)
        self.setAccessibleName("Keyed values")
        self.setToolTip("Every keyed value. Choose some (Ctrl or Shift: several) to see their curves alone.")
        self.itemSelectionChanged.connect(self._chosen)
        desk.keys.changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Show the values and which are chosen."""
        addresses = tuple((keyed.owner, keyed.address) for keyed in self._keys.all)
        self._following = True
        try:
            if addresses != self._addresses:
                self._addresses = addresses
                self._fill()
            for item in self._values():
                item.setSelected(item.data(0, ADDRESS) in self._keys.chosen)
        finally:
            self._following = False

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange:
            for place, item in enumerate(self._values()):
                item.setIcon(0, _swatch(place))

    def mousePressEvent(self, event: object) -> None:
        if self.itemAt(event.position().toPoint()) is None:  # type: ignore[attr-defined]
            self.clearSelection()
        super().mousePressEvent(event)  # type: ignore[arg-type]

    def _fill(self) -> None:
        self.clear()
        owners: dict[str, QTreeWidgetItem] = {}
        for place, keyed in enumerate(self._keys.all):
            of = "/".join(keyed.address.split("/")[:2])
            if of not in owners:
                owners[of] = QTreeWidgetItem(self, [keyed.owner])
                owners[of].setToolTip(0, f"All keyed values of {keyed.owner}.")
            item = QTreeWidgetItem(owners[of], [keyed.known.label])
            item.setData(0, ADDRESS, keyed.address)
            item.setIcon(0, _swatch(place))
            item.setToolTip(0, keyed.known.tooltip)
        self.expandAll()

    def _values(self) -> list[QTreeWidgetItem]:
        tops = [self.topLevelItem(i) for i in range(self.topLevelItemCount())]
        return [top.child(i) for top in tops for i in range(top.childCount())]

    def _chosen(self) -> None:
        if self._following:
            return
        chosen = set()
        for item in self.selectedItems():
            rows = [item] if item.parent() is not None else [item.child(i) for i in range(item.childCount())]
            chosen |= {row.data(0, ADDRESS) for row in rows}
        self._keys.choose(chosen)


class CommandButton(IconButton):
    """A command as an icon: checked while it is on, its tooltip says why it cannot run."""

    def __init__(self, name: str, commands: Commands, hotkeys: Hotkeys) -> None:
        self._command, self._commands, self._hotkeys = commands[name], commands, hotkeys
        super().__init__(self._command.icon or "", self._command.tooltip)
        self.setCheckable(self._command.checked is not None)
        self.setAccessibleName(self._command.label)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.clicked.connect(self._run)

    def refresh(self) -> None:
        """Show whether it can run and is on."""
        self.setEnabled(self._commands.reason(self._command.name) is None)
        if self._command.checked is not None:
            self.setChecked(self._command.checked(self._commands.desk))

    def enterEvent(self, event: QEnterEvent) -> None:
        self.setToolTip(tooltip(self._command, self._hotkeys.keymap, self._commands.reason(self._command.name)))
        super().enterEvent(event)

    def _run(self) -> None:
        self._commands.run(self._command.name)
        self.refresh()


def _swatch(place: int) -> QIcon:
    """The colour of a curve as a short line."""
    look = look_of()
    made = QPixmap(look.text, look.text)
    made.fill(Qt.GlobalColor.transparent)
    painter = QPainter(made)
    painter.fillRect(0, look.text // 2 - 1, look.text, 3, line_colour(place + 1))
    painter.end()
    return QIcon(made)
