"""The planes and roto masks of the plate in view: chosen ones are deleted, hidden or locked."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QHBoxLayout, QPushButton, QTreeWidgetItem, QVBoxLayout, QWidget

from app.window.desk import Desk
from app.window.pose.names import Names
from core.document import Document
from core.match.outline import Mask
from core.match.track import PlaneTrack
from tools.match_edits import delete_marks, set_marks, shown_plate

_ROLE = Qt.ItemDataRole.UserRole


class ShapeList(QWidget):
    """A list with three buttons; away while the plate has neither planes nor masks."""

    def __init__(self, desk: Desk, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.desk = desk
        self.list = Names("Planes and masks")
        self.buttons: dict[str, QPushButton] = {}
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(4)
        column.addWidget(self.list)
        line = QHBoxLayout()
        line.setSpacing(4)
        told: tuple[tuple[str, str, str, Callable[[], object]], ...] = (
            ("delete", "Delete", "Deletes the chosen planes and masks; the others stay.", self._delete),
            ("hide", "Hide", "Leaves the chosen planes and masks out of view, or back in; masks still hold off.",
             lambda: self._turn("hidden")),
            ("lock", "Lock", "Keeps tools off the chosen planes and masks, or lets them at them again.",
             lambda: self._turn("locked")))
        for name, words, tooltip, run in told:
            button = self.buttons[name] = QPushButton(words)
            button.setToolTip(tooltip)
            button.clicked.connect(lambda checked=False, run=run: run())
            line.addWidget(button)
        column.addLayout(line)
        self._seen: tuple[object, ...] = ()
        self.list.itemSelectionChanged.connect(self._enable)
        desk.changed.connect(lambda old, new: self.refresh())
        desk.session_replaced.connect(self.refresh)
        desk.stroke_ended.connect(self.refresh)
        self.refresh()

    @property
    def chosen(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Ids of the chosen planes, and of the chosen masks."""
        rows = [entry.data(0, _ROLE) for entry in self.list.selectedItems()]
        return (tuple(number for kind, number in rows if kind == "plane"),
                tuple(number for kind, number in rows if kind == "mask"))

    def refresh(self) -> None:
        """Show what is on the desk."""
        document = self.desk.document
        seen = (document.planes, document.masks, document.plates)
        if self.desk.session.stroking or (len(self._seen) == 3 and all(
                a is b for a, b in zip(seen, self._seen, strict=True))):
            return
        self._seen, kept = seen, self.chosen
        plate = shown_plate(document)
        here = -1 if plate is None else plate.id
        self.list.clear()
        for kind, marks, chosen in (("plane", document.planes, kept[0]), ("mask", document.masks, kept[1])):
            for mark in (m for m in marks if m.plate_id == here):
                entry = QTreeWidgetItem([_words(kind, mark)])
                entry.setData(0, _ROLE, (kind, mark.id))
                entry.setToolTip(0, f"{mark.name}: choose it to delete, hide or lock it; Shift and Ctrl choose more.")
                self.list.addTopLevelItem(entry)
                entry.setSelected(mark.id in chosen)
        self.list.updateGeometry()
        self.setVisible(self.list.topLevelItemCount() > 0)
        self._enable()

    def _enable(self) -> None:
        planes, masks = self.chosen
        for button in self.buttons.values():
            button.setEnabled(bool(planes or masks))

    def _delete(self) -> None:
        self.desk.edit("Delete shapes", delete_marks, *self.chosen)

    def _turn(self, field: str) -> None:
        """On, or off when all of them have it on."""
        planes, masks = self.chosen
        document: Document = self.desk.document
        marks = (*(p for p in document.planes if p.id in planes), *(m for m in document.masks if m.id in masks))
        on = not all(getattr(mark, field) for mark in marks)
        self.desk.edit("Hide shapes" if field == "hidden" else "Lock shapes", set_marks, planes, masks, **{field: on})


def _words(kind: str, mark: PlaneTrack | Mask) -> str:
    state = "   hidden" if mark.hidden else ""
    state += "   locked" if mark.locked else ""
    seen = f"   {len(mark.frames)} frames" if isinstance(mark, PlaneTrack) else ""
    return f"{mark.name}   {kind}{seen}{state}"
