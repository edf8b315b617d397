"""Three doors into an empty document: open a mesh, open the demo, go on with a recent file."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QRectF, QSize, Qt, Signal
from PySide6.QtGui import QDragEnterEvent, QDragLeaveEvent, QDropEvent, QFontMetricsF, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QAbstractButton, QGridLayout, QHBoxLayout, QSizePolicy, QVBoxLayout, QWidget

from app.window.desk import Desk
from app.window.files.opening import Opening
from app.window.files.recent import RecentFile, look_up, short_folder
from app.window.icons import paint_icon
from app.window.theme import Look, look_of, text_font

SHOWN = 5  # recent files
HINT = "or drop a mesh or a project anywhere in the window"


class Door(QAbstractButton):
    """A card with an icon, a word and a sentence."""

    def __init__(self, icon: str, words: str, sentence: str) -> None:
        super().__init__()
        self._icon, self._sentence = icon, sentence
        self.setText(words)
        self.setToolTip(sentence)
        self.setAccessibleDescription(sentence)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAttribute(Qt.WidgetAttribute.WA_Hover)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)

    def sizeHint(self) -> QSize:
        return card_size(look_of())

    def paintEvent(self, event: QPaintEvent) -> None:
        look = look_of()
        lit = self.underMouse() or self.hasFocus()
        painter = QPainter(self)
        paint_card(painter, look, QRectF(self.rect()), lit, self.isDown())
        paint_heading(painter, look, QRectF(self.rect()), self._icon, self.text(), lit)
        painter.setFont(text_font(look))
        painter.setPen(look.theme.colour("dim"))
        area = QRectF(self.rect()).adjusted(2 * look.gap, 9.5 * look.text, -2 * look.gap, -look.gap)
        painter.drawText(area, Qt.AlignmentFlag.AlignHCenter | Qt.TextFlag.TextWordWrap, self._sentence)


class FileRow(QAbstractButton):
    """One recent file in its card."""

    def __init__(self, file: RecentFile) -> None:
        super().__init__()
        self.file = file
        self.setText(file.path.name)
        self.setToolTip(str(file.path) if file.there else f"{file.path} is not there any more.")
        self.setEnabled(file.there)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAttribute(Qt.WidgetAttribute.WA_Hover)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        if file.there:
            self.setCursor(Qt.CursorShape.PointingHandCursor)

    def sizeHint(self) -> QSize:
        look = look_of()
        return QSize(10 * look.text, look.row)

    def paintEvent(self, event: QPaintEvent) -> None:
        look = look_of()
        painter = QPainter(self)
        area = QRectF(self.rect())
        lit = self.isEnabled() and (self.underMouse() or self.hasFocus())
        if lit:
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(look.theme.colour("line"))
            painter.drawRoundedRect(area, 3.0, 3.0)
        painter.setFont(text_font(look))
        painter.setPen(look.theme.colour("text" if self.isEnabled() else "dim"))
        inside = area.adjusted(look.grid, 0, -look.grid, 0)
        metrics = QFontMetricsF(painter.font())
        name = metrics.elidedText(self.text(), Qt.TextElideMode.ElideMiddle, inside.width())
        painter.drawText(inside, Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignLeft, name)
        rest = inside.adjusted(metrics.horizontalAdvance(name) + look.gap, 0, 0, 0)
        note = short_folder(self.file.path) if self.isEnabled() else "missing"
        painter.setPen(look.theme.colour("dim"))
        painter.drawText(rest, Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignRight,
                         metrics.elidedText(note, Qt.TextElideMode.ElideMiddle, max(rest.width(), 0.0)))


class RecentCard(QWidget):
    """The card of the recent files. chosen : a path."""

    chosen = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        self.rows: list[FileRow] = []
        self._column = QVBoxLayout(self)
        self._column.setSpacing(0)
        self._column.addStretch(1)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)

    def sizeHint(self) -> QSize:
        return card_size(look_of())

    def show_files(self, files: list[RecentFile]) -> None:
        """List these."""
        for row in self.rows:
            self._column.removeWidget(row)
            row.deleteLater()
        look = look_of()
        self._column.setContentsMargins(look.gap, round(8.5 * look.text), look.gap, look.gap)
        self.rows = [FileRow(file) for file in files[:SHOWN]]
        for place, row in enumerate(self.rows):
            row.clicked.connect(lambda checked=False, row=row: self.chosen.emit(row.file.path))
            self._column.insertWidget(place, row)
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        look = look_of()
        painter = QPainter(self)
        paint_card(painter, look, QRectF(self.rect()), False, False)
        paint_heading(painter, look, QRectF(self.rect()), "recent", "Recent files", False)
        if not self.rows:
            painter.setFont(text_font(look))
            painter.setPen(look.theme.colour("dim"))
            area = QRectF(self.rect()).adjusted(2 * look.gap, 9.5 * look.text, -2 * look.gap, -look.gap)
            painter.drawText(area, Qt.AlignmentFlag.AlignHCenter | Qt.TextFlag.TextWordWrap,
                             "What you open will be listed here.")


class Doors(QWidget):
    """What an empty document shows in place of the view.

    Parameters
    ----------
    opening : opens what is behind the doors. recent : the paths of the recent files, newest first.

    needed : the document has become empty (True), or something is in it (False).
    """

    needed = Signal(bool)

    def __init__(
        self, desk: Desk, opening: Opening, recent: Callable[[], tuple[str, ...]] = tuple,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._desk, self._opening, self._recent = desk, opening, recent
        self._over = False
        self._empty: bool | None = None
        self.mesh = Door("mesh", "Open a mesh…",
                         "Your own animal: OBJ, PLY, glTF, STL, USD or Alembic. A project (.filo) opens here too.")
        self.demo = Door("groom", "Open the demo", "An animal with a coat of 100,000 hairs, ready to comb.")
        self.files = RecentCard()
        self.mesh.clicked.connect(opening.ask)
        self.demo.clicked.connect(opening.open_demo)
        self.files.chosen.connect(opening.open)
        cards = QHBoxLayout()
        cards.setSpacing(16)
        for card in (self.mesh, self.demo, self.files):
            cards.addWidget(card)
        grid = QGridLayout(self)
        grid.setColumnStretch(0, 1)
        grid.setColumnStretch(2, 1)
        grid.setRowStretch(0, 2)
        grid.setRowStretch(2, 3)
        grid.addLayout(cards, 1, 1)
        self.setAcceptDrops(True)
        desk.changed.connect(self._changed)
        desk.session_replaced.connect(self._look)
        self.refresh()
        self._look()

    def refresh(self) -> None:
        """Look again which recent files are there."""
        names = self._recent()
        self._desk.jobs.start("Look for recent files", lambda progress, cancelled: look_up(names),
                              self.files.show_files, lambda error: None, self)

    def _changed(self, old: object, new: object) -> None:
        self._look()

    def _look(self) -> None:
        empty = not (self._desk.document.meshes or self._desk.document.plates)
        if empty != self._empty:
            again, self._empty = self._empty is not None, empty
            if empty and again:
                self.refresh()
            self.needed.emit(empty)

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        if self._opening.takes(event.mimeData()):
            event.acceptProposedAction()
            self._over = True
            self.update()

    def dragLeaveEvent(self, event: QDragLeaveEvent) -> None:
        self._over = False
        self.update()

    def dropEvent(self, event: QDropEvent) -> None:
        self._over = False
        self.update()
        event.acceptProposedAction()
        self._opening.dropped(event.mimeData().urls())

    def paintEvent(self, event: QPaintEvent) -> None:
        look = look_of()
        painter = QPainter(self)
        painter.fillRect(self.rect(), look.theme.colour("ground"))
        painter.setFont(text_font(look))
        painter.setPen(look.theme.colour("accent" if self._over else "dim"))
        under = QRectF(0.0, self.mesh.geometry().bottom() + 20.0, self.width(), 2.0 * look.text)
        painter.drawText(under, Qt.AlignmentFlag.AlignHCenter, HINT)
        if self._over:
            pen = QPen(look.theme.colour("accent"), 1.5, Qt.PenStyle.DashLine)
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            painter.setPen(pen)
            painter.drawRoundedRect(QRectF(self.rect()).adjusted(8, 8, -8, -8), 5.0, 5.0)


def card_size(look: Look) -> QSize:
    """Of all three doors."""
    return QSize(21 * look.text, 20 * look.text)


def paint_card(painter: QPainter, look: Look, area: QRectF, lit: bool, down: bool) -> None:
    """The ground of a door."""
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(look.theme.colour("accent" if lit else "line"))
    painter.setBrush(look.theme.colour("hover" if lit and not down else "panel"))
    painter.drawRoundedRect(area.adjusted(0.5, 0.5, -0.5, -0.5), 5.0, 5.0)


def paint_heading(painter: QPainter, look: Look, area: QRectF, icon: str, words: str, lit: bool) -> None:
    """Icon and word of a door."""
    side = 3.0 * look.text
    place = QRectF(area.center().x() - side / 2, area.top() + 2.2 * look.text, side, side)
    paint_icon(painter, icon, place, look.theme.colour("accent" if lit else "dim"))
    painter.setFont(text_font(look, round(1.25 * look.text)))
    painter.setPen(look.theme.colour("text"))
    painter.drawText(QRectF(area.left(), area.top() + 6.2 * look.text, area.width(), 2 * look.text),
                     Qt.AlignmentFlag.AlignCenter, words)
