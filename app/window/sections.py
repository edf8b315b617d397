"""The column of panels: sections that fold and remember it, rows of a label and a field."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QEvent, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent, QMouseEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QScrollArea, QSizePolicy, QVBoxLayout, QWidget

from app.window.icons import paint_icon
from app.window.settings import read_strictly, settings_folder, write_whole
from app.window.theme import look_of, text_font
from core.errors import UserError
from core.record import Record

FILE = "folded.json"


class Folded(Record):
    """Names of the sections that are folded."""

    sections: tuple[str, ...] = ()


class FoldMemory:
    """Which sections are folded, from one start of the program to the next. One is handed to all sections."""

    def __init__(self, folder: Path | None = None) -> None:
        self._path = (folder or settings_folder()) / FILE
        self._folded = set(read_strictly(self._path, Folded)[0].sections)

    def __contains__(self, name: str) -> bool:
        return name in self._folded

    def set(self, name: str, folded: bool) -> None:
        """Remember it; a disk that refuses is no reason to stop the hand."""
        if folded != (name in self._folded):
            self._folded ^= {name}
            try:
                write_whole(self._path, Folded(sections=tuple(sorted(self._folded))))
            except UserError:
                return


class SectionHeader(QWidget):
    """The heading of a section: a click, Space or Enter folds it."""

    pressed = Signal()

    def __init__(self, title: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.title, self.folded = title, False
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.setAttribute(Qt.WidgetAttribute.WA_Hover)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setToolTip("Click to fold this section away or open it again; it stays so.")
        self.setAccessibleName(title)

    def set_folded(self, folded: bool) -> None:
        """Show it so."""
        self.folded = folded
        self.setAccessibleDescription("folded" if folded else "open")
        self.update()

    def sizeHint(self) -> QSize:
        look = look_of()
        return QSize(look.label, look.row)

    def minimumSizeHint(self) -> QSize:
        return QSize(look_of().text * 4, look_of().row)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self.pressed.emit()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Space, Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.pressed.emit()
        else:
            super().keyPressEvent(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        look = look_of()
        painter = QPainter(self)
        painter.setFont(text_font(look, look.small, 1.0))
        painter.setPen(look.theme.colour("text" if self.underMouse() or self.hasFocus() else "dim"))
        area = QRectF(self.rect())
        painter.drawText(area, Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter, self.title.upper())
        if self.folded or self.underMouse() or self.hasFocus():
            side = float(look.text)
            place = QRectF(area.right() - side - 2, area.center().y() - side / 2, side, side)
            paint_icon(painter, "chevron-right" if self.folded else "chevron-down", place, look.theme.colour("dim"))


class Section(QWidget):
    """A heading over something that it folds away.

    Parameters
    ----------
    memory : of what is folded; None for a section that forgets. name : it is remembered by; its title by default.
    """

    def __init__(
        self, title: str, content: QWidget, memory: FoldMemory | None = None, name: str = "",
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.content, self._memory, self._name = content, memory, name or title
        self.header = SectionHeader(title)
        self.header.pressed.connect(lambda: self.fold(not self.folded))
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 8)
        column.setSpacing(0)
        column.addWidget(self.header)
        column.addWidget(content)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Maximum)
        self._show(memory is not None and self._name in memory)

    @property
    def folded(self) -> bool:
        """True when only the heading is seen."""
        return self.header.folded

    @property
    def title(self) -> str:
        """Its heading."""
        return self.header.title

    def set_title(self, title: str) -> None:
        """Give it another heading; it is still remembered by its name."""
        self.header.title = title
        self.header.setAccessibleName(title)
        self.header.update()

    def fold(self, folded: bool) -> None:
        """Fold it away or open it, and remember it."""
        self._show(folded)
        if self._memory is not None:
            self._memory.set(self._name, folded)

    def _show(self, folded: bool) -> None:
        self.header.set_folded(folded)
        self.content.setVisible(not folded)


class Row(QWidget):
    """A label and a field; all labels are of one width, so that the fields stand in a column."""

    def __init__(self, label: str, field: QWidget, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.label = QLabel(label)
        self.label.setBuddy(field)
        self.field = field
        line = QHBoxLayout(self)
        line.setContentsMargins(0, 0, 0, 0)
        line.setSpacing(4)
        line.addWidget(self.label, 0, Qt.AlignmentFlag.AlignTop)
        line.addWidget(field, 1)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self._measure()

    def changeEvent(self, event: QEvent) -> None:
        if event.type() in (QEvent.Type.FontChange, QEvent.Type.StyleChange):
            self._measure()
        super().changeEvent(event)

    def _measure(self) -> None:
        look = look_of()
        self.label.setFixedSize(look.label, look.row)


class Column(QScrollArea):
    """Sections under one another, scrolled when the window is low; the wheel over a bar scrolls too."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setWidgetResizable(True)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        inside = QWidget()
        inside.setObjectName("column")
        self._column = QVBoxLayout(inside)
        self._column.setContentsMargins(12, 4, 12, 12)
        self._column.setSpacing(0)
        self._column.addStretch(1)
        self.setWidget(inside)

    def add(self, widget: QWidget) -> None:
        """Put a section below the others."""
        self._column.insertWidget(self._column.count() - 1, widget)

    def sizeHint(self) -> QSize:
        look = look_of()
        return QSize(look.text * 25, look.text * 40)
