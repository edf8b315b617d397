"""Pictures in the view by numbers: place, size and opacity of each pinned reference, and the one behind everything."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QDialog, QHBoxLayout, QLabel, QPushButton, QScrollArea, QVBoxLayout, QWidget

from app.window.desk import Desk
from app.window.icons import IconButton
from app.window.params_panel import RecordForm
from app.window.theme import look_of
from core.record import Record
from core.workspace import Workspace


class PicturesDialog(QDialog):
    """A window beside the main one; every change is seen at once. It follows what the hand does in the view."""

    def __init__(self, parent: QWidget | None, desk: Desk) -> None:
        super().__init__(parent)
        self.setWindowTitle("Pictures in the view")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self._desk = desk
        self._paths: tuple[str, ...] | None = None
        self.panels: list[RecordForm] = []
        self._area = QScrollArea()
        self._area.setWidgetResizable(True)
        close = QPushButton("Close")
        close.setToolTip("Closes this window; what was changed holds already and is kept.")
        close.setAutoDefault(False)
        close.clicked.connect(self.close)
        low, whole = QHBoxLayout(), QVBoxLayout(self)
        low.addStretch(1)
        low.addWidget(close)
        whole.addWidget(self._area, 1)
        whole.addLayout(low)
        self.resize(35 * look_of().text, 32 * look_of().text)
        desk.workspace_changed.connect(self._workspace_changed)
        desk.session_replaced.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Show the pictures there are."""
        view = self._desk.workspace.view
        paths = (view.background or "", *(reference.path for reference in view.references))
        if paths != self._paths:
            self._paths = paths
            self._build()
        for panel, reference in zip(self.panels, view.references, strict=True):
            panel.set_record(reference)

    def _build(self) -> None:
        view = self._desk.workspace.view
        page = QWidget()
        rows = QVBoxLayout(page)
        self.panels = []
        if view.background:
            rows.addLayout(self._heading(f"Behind everything: {Path(view.background).name}", view.background, None))
        for row, reference in enumerate(view.references):
            rows.addLayout(self._heading(Path(reference.path).name, reference.path, row))
            panel = RecordForm(reference)
            panel.changed.connect(lambda record, final, row=row: self._put(row, record))
            self.panels.append(panel)
            rows.addWidget(panel)
        if not view.background and not view.references:
            rows.addWidget(QLabel("There are none: drop a picture on the window, or pin one."))
        rows.addStretch(1)
        self._area.setWidget(page)

    def _heading(self, words: str, path: str, row: int | None) -> QHBoxLayout:
        line, label = QHBoxLayout(), QLabel(words)
        label.setToolTip(path)
        remove = IconButton("close", "Takes this picture out of the view; its file stays.")
        remove.clicked.connect(lambda: self._remove(row))
        line.addWidget(label, 1)
        line.addWidget(remove)
        return line

    def _put(self, row: int, reference: Record) -> None:
        view = self._desk.workspace.view
        if row < len(view.references):
            references = (*view.references[:row], reference, *view.references[row + 1:])
            self._desk.set_workspace(view=view.replace(references=references))

    def _remove(self, row: int | None) -> None:
        view = self._desk.workspace.view
        if row is None:
            self._desk.set_workspace(view=view.replace(background=None))
        else:
            kept = (*view.references[:row], *view.references[row + 1:])
            self._desk.set_workspace(view=view.replace(references=kept))

    def _workspace_changed(self, old: Workspace, new: Workspace) -> None:
        if old.view is not new.view:
            self.refresh()
