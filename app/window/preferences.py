"""Preferences: a window beside the main one; every change works at once and is kept."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol, get_type_hints

from PySide6.QtCore import QPointF, QRectF, Qt, QUrl, Signal
from PySide6.QtGui import QDesktopServices, QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import (
    QDialog,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QPushButton,
    QSizePolicy,
    QTabWidget,
    QVBoxLayout,
    QWidget,
)

from app.window.files.opening import choose_file
from app.window.params_panel import make_field
from app.window.sections import Row
from app.window.settings import Settings
from app.window.theme import look_of
from core.field import Field, fields_of
from core.formats.journal import state_folder
from core.record import Record
from tools.pen import PenSettings
from tools.registry import PLUGINS

Points = tuple[tuple[float, float], ...]


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
        self.reset = _button(
            "Reset all", "Brings every preference back to that of a new installation; recent files stay.")
        self.reset.clicked.connect(self._reset)
        close = _button("Close", "Closes this window; what was changed holds already and is kept.")
        close.clicked.connect(self.close)
        low, layout = QHBoxLayout(), QVBoxLayout(self)
        low.addWidget(self.reset)
        low.addStretch(1)
        low.addWidget(close)
        layout.addWidget(tabs, 1)
        layout.addLayout(low)
        self.resize(38 * look_of().text, 35 * look_of().text)
        self.refresh()

    def refresh(self) -> None:
        """Show the settings as they are."""
        for show in self._shows:
            show(self._owner.settings)

    def _look(self) -> QWidget:
        page, rows = _page()
        for name in ("theme", "text_size", "unit"):
            rows.addWidget(self._setting(name))
        rows.addStretch(1)
        return page

    def _hand(self) -> QWidget:
        page, rows = _page()
        for name in ("keymap", "orbit"):
            rows.addWidget(self._setting(name))
        keys = _button("Hotkeys…", "Shows every hotkey, and lets you press another one for a command.")
        keys.clicked.connect(self._owner.show_keymap_editor)
        rows.addWidget(Row("", keys))
        curve = PressureCurve(page)
        curve.changed.connect(lambda points: self._change_pen("curve", points))
        self._shows.append(lambda s: curve.show_points(s.pen.curve))
        rows.addWidget(Row("Pen pressure", curve))
        straight = _button("Straight", "Makes the pressure curve a straight line again: what comes in goes out.")
        straight.clicked.connect(lambda: self._change_pen("curve", PenSettings().curve))
        rows.addWidget(Row("", straight))
        for name, known in fields_of(PenSettings).items():
            rows.addWidget(self._row(
                PenSettings, name, known, lambda s, name=name: getattr(s.pen, name),
                lambda value, name=name: self._change_pen(name, value)))
        rows.addStretch(1)
        return page

    def _work(self) -> QWidget:
        page, rows = _page()
        for name in ("history_mb", "frames_mb", "density_ms"):
            rows.addWidget(self._setting(name))
        rows.addStretch(1)
        return page

    def _files(self) -> QWidget:
        page, rows = _page()
        note = QLabel(
            f"Every finished stroke is kept at once, saved or not, in {state_folder()}. After a crash the next start "
            "offers it.", page)
        note.setWordWrap(True)
        folder = _button("Show folder", "Opens the folder of the autosaves in the file manager of this system.")
        folder.clicked.connect(_show_state_folder)
        line = QLineEdit(page)
        line.setObjectName("plugin_folder")
        line.setPlaceholderText("none")
        line.setToolTip(
            f"Python files with a studio's own tools, read at the next start; {PLUGINS} names further folders.")
        line.editingFinished.connect(lambda: self._change("plugin_folder", line.text().strip()))
        self._shows.append(lambda s: line.setText(s.plugin_folder))
        choose = _button("Choose…", "Chooses the folder of a studio's own tools, read at the next start.")
        choose.clicked.connect(self._choose_plugins)
        self.clear_recent = _button(
            "Clear recent files", "Forgets the names of the files you had open; the files themselves stay.")
        self.clear_recent.clicked.connect(lambda: self._change("recent", ()))
        self._shows.append(lambda s: self.clear_recent.setEnabled(bool(s.recent)))
        rows.addWidget(note)
        for label, widget in (
                ("Autosaves", folder), ("Plug-ins", line), ("", choose), ("Recent files", self.clear_recent)):
            rows.addWidget(Row(label, widget))
        rows.addStretch(1)
        return page

    def _setting(self, name: str) -> QWidget:
        return self._row(
            Settings, name, fields_of(Settings)[name], lambda s: getattr(s, name),
            lambda value: self._change(name, value))

    def _row(
        self, kind: type[Record], name: str, known: Field, get: Callable[[Settings], Any], put: Callable[[Any], None],
    ) -> QWidget:
        """The label and bar of a described field; the value counts when the hand lets go."""
        hint = get_type_hints(kind, include_extras=True)[name]
        bar = make_field(known, hint, get(self._owner.settings), getattr(kind(), name))
        bar.setObjectName(name)
        bar.edited.connect(lambda value, final: put(value) if final else None)
        self._shows.append(lambda s: bar.set_value(get(s)))
        return Row(known.label, bar)

    def _change(self, name: str, value: Any) -> None:
        if getattr(self._owner.settings, name) != value:
            self._owner.change_settings(**{name: value})
            self.refresh()

    def _change_pen(self, name: str, value: Any) -> None:
        self._change("pen", self._owner.settings.pen.replace(**{name: value}))

    def _choose_plugins(self) -> None:
        choose_file(
            self, "Folder of plug-ins", [], lambda folder: self._change("plugin_folder", str(folder)), folder=True)

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
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
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


def _page() -> tuple[QWidget, QVBoxLayout]:
    page = QWidget()
    rows = QVBoxLayout(page)
    rows.setContentsMargins(8, 12, 8, 8)
    rows.setSpacing(4)
    return page, rows


def _button(label: str, tooltip: str) -> QPushButton:
    button = QPushButton(label)
    button.setToolTip(tooltip)
    button.setAutoDefault(False)  # Return ends typing and presses nothing
    return button


def _show_state_folder() -> None:
    folder = Path(state_folder())
    folder.mkdir(parents=True, exist_ok=True)
    QDesktopServices.openUrl(QUrl.fromLocalFile(str(folder)))
