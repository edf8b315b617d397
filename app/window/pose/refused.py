"""A bar over the list of poses after a refusal: which poses cannot be told apart, and what can be done about it."""

from __future__ import annotations

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QGridLayout, QLabel, QPushButton, QVBoxLayout, QWidget

from app.window.desk import Desk
from core.document import Document
from core.pose.refusal import Refusal
from core.pose.synthesis import pose_at
from tools.pose.refused import keep_refused, move_refused
from tools.pose_edits import Twins

_OFFERS: dict[str, tuple[str, str]] = {
    "merge": ("Merge with it", "Averages what was sculpted with the pose named, at the place of that pose."),
    "delete": ("Replace it", "Deletes the pose named and keeps what was sculpted now."),
    "move": ("Put it here", "Keeps what was sculpted now for the pose that is shown: pose the rig elsewhere first."),
    "leave": ("Leave it", "Lets go of what was sculpted; the poses stay as they were."),
}


class RefusedBar(QWidget):
    """What was refused last. done : it was dealt with."""

    done = Signal()

    def __init__(self, desk: Desk, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.desk = desk
        self.refusal: Refusal | None = None
        self._mesh = 0
        self.words = QLabel()
        self.words.setWordWrap(True)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 4)
        column.setSpacing(4)
        column.addWidget(self.words)
        grid = QGridLayout()
        grid.setSpacing(4)
        self.buttons: dict[str, QPushButton] = {}
        for at, (name, (label, tooltip)) in enumerate(_OFFERS.items()):
            button = self.buttons[name] = QPushButton(label)
            button.setToolTip(tooltip)
            button.clicked.connect(lambda checked=False, name=name: self._take(name))
            grid.addWidget(button, at // 2, at % 2)
        column.addLayout(grid)
        desk.changed.connect(self._document_changed)
        desk.session_replaced.connect(self.forget)
        self.hide()

    def offer(self, refusal: Refusal) -> None:
        """Say what was refused, and offer what helps; a sculpt that was lost by it can still be kept."""
        item = self.desk.posed
        if item is None or refusal.sculpt is None:
            self.forget()
            return
        self.refusal, self._mesh = refusal, item.id
        self.words.setText(str(refusal))
        for name, button in self.buttons.items():
            button.setVisible(name == "leave" or name in refusal.offers)
        self.show()

    def forget(self) -> None:
        """Nothing is to be dealt with."""
        self.refusal = None
        self.hide()

    def _take(self, name: str) -> None:
        refusal, item = self.refusal, self.desk.posed
        if refusal is None or refusal.sculpt is None or item is None or item.rig is None or name == "leave":
            self.forget()
            return
        pose, surface = refusal.sculpt
        if name == "move":
            to = item.pose if item.pose is not None else pose_at(item.rig, self.desk.workspace.frame)
            made = self.desk.edit("Sculpt", move_refused, item.id, pose, surface, to)
        else:
            twins: Twins = "merge" if name == "merge" else "delete"
            made = self.desk.edit("Merge poses" if name == "merge" else "Replace pose", keep_refused, item.id, pose,
                                  surface, twins)
        if made:
            self.forget()
            self.done.emit()

    def _document_changed(self, old: Document, new: Document) -> None:
        """Another mesh in its place, or other sculpts: the offer is no longer of what is there."""
        if self.refusal is None or old.meshes is new.meshes:
            return
        before, after = (next((m for m in d.meshes if m.id == self._mesh), None) for d in (old, new))
        if after is None or (before is not None and before.correctives is not after.correctives):
            self.forget()
