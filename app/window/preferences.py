"""Preferences: a window beside the main one; every change works at once and is kept."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

from PySide6.QtCore import QPointF, QRectF, QSignalBlocker, Qt, QUrl, Signal
from PySide6.QtGui import QDesktopServices, QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDialog,
    QDoubleSpinBox,
    QFileDialog,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QPushButton,
    QSpinBox,
    QTabWidget,
    QVBoxLayout,
    QWidget,
)

from app.window.settings import Settings
from app.window.theme import look_of
from core.field import Field, fields_of
from core.formats.journal import state_folder
from tools.pen import PenSettings
from tools.registry import PLUGINS

Points = tuple[tuple[float, float], ...]
SETTINGS_FIELDS, PEN_FIELDS = fields_of(Settings), fields_of(PenSettings)


class SettingsOwner(Protocol):
    """Who keeps the preferences and acts on them: the main window."""

    @property
    def settings(self) -> Settings: ...

    def change_settings(self, **changes: Any) -> None: ...

    def show_keymap_editor(self) -> None: ...


class Preferences(QDialog):
    """All preferences in four tabs; `refresh` shows settings that changed elsewhere."""

    def __init__(self, parent: QWidget | None, owner: SettingsOwner) -> None:
        super().__init__(parent)
        self.setWindowTitle("Preferences")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self._owner = owner
        self._shows: list[Callable[[Settings], None]] = []
        tabs = QTabWidget(self)
        tabs.addTab(self._look(), "Look")
        tabs.addTab(self._hand(), "Hand")
        tabs.addTab(self._work(), "Work")
        tabs.addTab(self._files(), "Files")
        self.reset, close = QPushButton("Reset all", self), QPushButton("Close", self)
        self.reset.setToolTip("Brings every preference back to that of a new installation; recent files stay.")
        self.reset.setAutoDefault(False)
        self.reset.clicked.connect(self._reset)
        close.setAutoDefault(False)  # Return ends typing, not the window
        close.clicked.connect(self.close)
        low, layout = QHBoxLayout(), QVBoxLayout(self)
        low.addWidget(self.reset)
        low.addStretch(1)
        low.addWidget(close)
        layout.addWidget(tabs, 1)
        layout.addLayout(low)
        self.resize(460, 420)
        self.refresh()

    def refresh(self) -> None:
        """Show the settings as they are."""
        for show in self._shows:
            show(self._owner.settings)

    def _look(self) -> QWidget:
        page, form = _page()
        self._add(form, "theme")
        self._add(form, "text_size")
        self._add(form, "unit")
        return page

    def _hand(self) -> QWidget:
        page, form = _page()
        self._add(form, "keymap")
        keys = QPushButton("Hotkeys…", page)
        keys.setToolTip("Shows every hotkey, and lets you press another one for a command.")
        keys.setAutoDefault(False)
        keys.clicked.connect(self._owner.show_keymap_editor)
        form.addRow("", keys)
        curve = PressureCurve(page)
        curve.changed.connect(lambda points: self._change_pen("curve", points))
        self._shows.append(lambda s: curve.show_points(s.pen.curve))
        form.addRow("Pressure", curve)
        straight = QPushButton("Straight", page)
        straight.setToolTip("Makes the pressure curve a straight line again: what comes in goes out.")
        straight.setAutoDefault(False)
        straight.clicked.connect(lambda: self._change_pen("curve", PenSettings().curve))
        form.addRow("", straight)
        for name in PEN_FIELDS:
            self._add_field(
                form, name, PEN_FIELDS[name], lambda s, name=name: getattr(s.pen, name),
                lambda value, name=name: self._change_pen(name, value))
        return page

    def _work(self) -> QWidget:
        page, form = _page()
        self._add(form, "history_mb")
        self._add(form, "density_ms")
        return page

    def _files(self) -> QWidget:
        page, form = _page()
        note = QLabel(
            f"Every finished stroke is kept at once, saved or not, in {state_folder()}. After a crash the next start "
            "offers it.", page)
        note.setWordWrap(True)
        folder = QPushButton("Show folder", page)
        folder.setToolTip("Opens the folder of the autosaves in the file manager of this system.")
        folder.clicked.connect(_show_state_folder)
        form.addRow("Autosave", note)
        form.addRow("", folder)
        row, line, choose = QHBoxLayout(), QLineEdit(page), QPushButton("Choose…", page)
        line.setObjectName("plugin_folder")
        line.setPlaceholderText("none")
        line.setToolTip(
            f"Python files with a studio's own tools, read at the next start; {PLUGINS} names further folders.")
        line.editingFinished.connect(lambda: self._change("plugin_folder", line.text().strip()))
        choose.clicked.connect(lambda: self._choose_plugins())
        self._shows.append(lambda s: line.setText(s.plugin_folder))
        row.addWidget(line, 1)
        row.addWidget(choose)
        form.addRow("Plug-ins", row)
        self.clear_recent = clear = QPushButton("Clear recent files", page)
        clear.setToolTip("Forgets the names of the files you had open; the files themselves stay.")
        clear.clicked.connect(lambda: self._change("recent", ()))
        self._shows.append(lambda s: clear.setEnabled(bool(s.recent)))
        form.addRow("", clear)
        for button in (folder, choose, clear):
            button.setAutoDefault(False)
        return page

    def _add(self, form: QFormLayout, name: str) -> None:
        self._add_field(
            form, name, SETTINGS_FIELDS[name], lambda s: getattr(s, name), lambda value: self._change(name, value))

    def _add_field(
        self, form: QFormLayout, name: str, known: Field, get: Callable[[Settings], Any],
        put: Callable[[Any], None],
    ) -> None:
        """A row for a described field: words to choose from, a tick, or a number."""
        editor: QWidget
        if known.choices:
            box = QComboBox(self)
            box.addItems([choice.capitalize() if len(choice) > 2 else choice for choice in known.choices])
            box.activated.connect(lambda i: put(known.choices[i]))
            self._shows.append(lambda s: box.setCurrentIndex(known.choices.index(get(s))))
            editor = box
        elif isinstance(get(self._owner.settings), bool):
            tick = QCheckBox(known.label, self)
            tick.clicked.connect(lambda: put(tick.isChecked()))
            self._shows.append(lambda s: tick.setChecked(get(s)))
            editor = tick
        else:
            whole = isinstance(get(self._owner.settings), int)
            spin: QSpinBox | QDoubleSpinBox = QSpinBox(self) if whole else QDoubleSpinBox(self)
            low, high = known.hard or (0, 100)
            spin.setRange(low, high)
            spin.setSingleStep(known.step or (1 if whole else 0.05))
            spin.setSuffix(f" {_UNITS.get(name, known.unit)}".rstrip())
            spin.setKeyboardTracking(False)  # 1 of 12 must not make the text tiny while it is typed
            spin.valueChanged.connect(lambda: put(spin.value()))
            self._shows.append(lambda s: _show_number(spin, get(s)))
            editor = spin
        editor.setToolTip(known.tooltip)
        editor.setAccessibleName(known.label)
        editor.setObjectName(name)
        form.addRow("" if isinstance(editor, QCheckBox) else known.label, editor)

    def _change(self, name: str, value: Any) -> None:
        if getattr(self._owner.settings, name) != value:
            self._owner.change_settings(**{name: value})
            self.refresh()

    def _change_pen(self, name: str, value: Any) -> None:
        self._change("pen", self._owner.settings.pen.replace(**{name: value}))

    def _choose_plugins(self) -> None:
        folder = QFileDialog.getExistingDirectory(self, "Folder of plug-ins")
        if folder:
            self._change("plugin_folder", folder)

    def _reset(self) -> None:
        fresh = Settings()
        kept = ("recent", "geometry", "panels")
        names = (name for name in fresh.__struct_fields__ if name not in kept)
        self._owner.change_settings(**{name: getattr(fresh, name) for name in names})
        self.refresh()


class PressureCurve(QWidget):
    """What the pen sends (across) and what tools get (up). Drag points, double-click adds or takes one away."""

    changed = Signal(object)

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setFixedHeight(120)
        self.setToolTip("What the pen sends, across, and what tools get, up. Drag points; double-click adds one.")
        self.setAccessibleName("Pressure curve")
        self.points: Points = PenSettings().curve
        self._held: int | None = None

    def show_points(self, points: Points) -> None:
        """Show another curve."""
        self.points = points
        self.update()

    def place_of(self, point: tuple[float, float]) -> QPointF:
        """Where a point of the curve is drawn."""
        area = self._area()
        return QPointF(area.left() + point[0] * area.width(), area.bottom() - point[1] * area.height())

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Take a point."""
        self._held = self._near(event.position())

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag the point between its neighbours; the ends keep their side."""
        if self._held is None:
            return
        i, points = self._held, self.points
        x, y = self._point_at(event.position())
        x = points[i][0] if i in (0, len(points) - 1) else min(max(x, points[i - 1][0] + 0.01), points[i + 1][0] - 0.01)
        self.show_points((*points[:i], (x, y), *points[i + 1 :]))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Let the point go: the new curve holds."""
        if self._held is not None:
            self._held = None
            self.changed.emit(self.points)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Add a point, or take away the one under the pointer."""
        near, points = self._near(event.position()), self.points
        if near is None:
            x, y = self._point_at(event.position())
            if all(abs(x - a) > 0.01 for a, _ in points):
                self.show_points(tuple(sorted((*points, (x, y)))))
        elif 0 < near < len(points) - 1:
            self.show_points((*points[:near], *points[near + 1 :]))
        self._held = None
        self.changed.emit(self.points)

    def paintEvent(self, event: QPaintEvent) -> None:
        """The curve over a square of quarters."""
        painter, theme, area = QPainter(self), look_of().theme, self._area()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.fillRect(area, theme.colour("field"))
        painter.setPen(QPen(theme.colour("line"), 1.0))
        for i in range(5):
            x, y = area.left() + i * area.width() / 4, area.top() + i * area.height() / 4
            painter.drawLine(QPointF(x, area.top()), QPointF(x, area.bottom()))
            painter.drawLine(QPointF(area.left(), y), QPointF(area.right(), y))
        painter.setPen(QPen(theme.colour("accent"), 1.8))
        places = [self.place_of(point) for point in self.points]
        painter.drawPolyline(places)
        painter.setBrush(theme.colour("accent"))
        for place in places:
            painter.drawEllipse(place, 3.5, 3.5)
        painter.end()

    def _area(self) -> QRectF:
        return QRectF(self.rect()).adjusted(6, 6, -6, -6)

    def _near(self, place: QPointF) -> int | None:
        near = [i for i, point in enumerate(self.points) if (self.place_of(point) - place).manhattanLength() < 12.0]
        return near[0] if near else None

    def _point_at(self, place: QPointF) -> tuple[float, float]:
        area = self._area()
        x, y = (place.x() - area.left()) / area.width(), (area.bottom() - place.y()) / area.height()
        return min(max(x, 0.0), 1.0), min(max(y, 0.0), 1.0)


_UNITS = {"history_mb": "MB", "density_ms": "ms"}


def _page() -> tuple[QWidget, QFormLayout]:
    page = QWidget()
    form = QFormLayout(page)
    form.setContentsMargins(12, 12, 12, 12)
    form.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.ExpandingFieldsGrow)
    return page, form


def _show_number(spin: QSpinBox | QDoubleSpinBox, value: float) -> None:
    with QSignalBlocker(spin):
        spin.setValue(value)


def _show_state_folder() -> None:
    folder = Path(state_folder())
    folder.mkdir(parents=True, exist_ok=True)
    QDesktopServices.openUrl(QUrl.fromLocalFile(str(folder)))
