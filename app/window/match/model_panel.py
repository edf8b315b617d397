"""The model of photographs in a panel: how well it is solved, its points, the worst first, and what is known."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QHBoxLayout, QLabel, QPushButton, QTreeWidgetItem, QVBoxLayout, QWidget

from app.window.desk import Desk
from app.window.match.model_job import ModelJob
from app.window.match.model_marks import misses
from app.window.pose.names import Names
from core.match.photomodel.records import Photomodel
from tools.photomodel_edits import model_of, points_in_hand, select_points

_ROLE = Qt.ItemDataRole.UserRole
NOTHING = "No photographs are modelled yet. Click a corner of one with Pick point."


class ModelPanel(QWidget):
    """Figures, two buttons and a list; a click on a row takes its points in hand."""

    def __init__(self, desk: Desk, job: ModelJob, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.desk, self.job = desk, job
        self.figures = QLabel()
        self.figures.setWordWrap(True)
        self.solve = QPushButton("Solve")
        self.solve.setToolTip("Finds where the photographs were taken and where the points are, from what is picked.")
        self.solve.clicked.connect(lambda checked=False: desk.attempt(job.solve))
        self.walk = QPushButton("Next photograph")
        self.walk.setToolTip("Looks at the photograph in which the point in hand should be picked next.")
        self.walk.clicked.connect(lambda checked=False: desk.attempt(job.walk, 1))
        self.list = Names("Points of the model and what is known of them")
        self.list.itemSelectionChanged.connect(self._chosen)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(4)
        line = QHBoxLayout()
        line.setSpacing(4)
        line.addWidget(self.solve)
        line.addWidget(self.walk)
        column.addWidget(self.figures)
        column.addLayout(line)
        column.addWidget(self.list)
        self._seen: Photomodel | None = None
        self._filling = False
        desk.changed.connect(lambda old, new: self.refresh())
        desk.session_replaced.connect(self.refresh)
        desk.stroke_ended.connect(self.refresh)
        self._show(model_of(desk.document))

    def refresh(self) -> None:
        """Show what is on the desk now; quiet while a stroke goes on."""
        model = model_of(self.desk.document)
        if model is not self._seen and not self.desk.session.stroking:
            self._show(model)

    def _show(self, model: Photomodel | None) -> None:
        self._seen = model
        for widget in (self.solve, self.walk, self.list):
            widget.setVisible(model is not None)
        self.figures.setText(NOTHING if model is None else figures_of(model))
        self._filling = True
        self.list.clear()
        if model is not None:
            hand, away = points_in_hand(model), misses(model)
            for point in sorted(model.points, key=lambda one: -away.get(one.id, 1e9)):
                picks = len(point.picks.photo)
                told = f"{away[point.id]:.2f} px" if point.id in away else "no place yet"
                words = f"{point.name}   {picks} pick{'' if picks == 1 else 's'}   {told}"
                self._row(words, (point.id,), "A click takes this point in hand; Ctrl and Shift take more.",
                          chosen=point.id in hand)
            names = {point.id: point.name for point in model.points}
            for known in model.known:
                value = "".join(f" {number:g}" for number in known.value)
                self._row(f"{known.kind}{value}: {', '.join(names[id_] for id_ in known.points)}", known.points,
                          "A click takes the points of what is known in hand; Forget what is known lets go of it.")
        self._filling = False
        self.list.updateGeometry()

    def _row(self, words: str, points: tuple[int, ...], tooltip: str, *, chosen: bool = False) -> None:
        entry = QTreeWidgetItem([words])
        entry.setData(0, _ROLE, points)
        entry.setToolTip(0, f"{words}\n{tooltip}")
        self.list.addTopLevelItem(entry)
        entry.setSelected(chosen)

    def _chosen(self) -> None:
        if self._filling:
            return
        points = [id_ for entry in self.list.selectedItems() for id_ in entry.data(0, _ROLE)]
        self.desk.edit("Select points", select_points, tuple(points))


def figures_of(model: Photomodel) -> str:
    """What there is and how well it fits, in lines."""
    there = [photo for photo in model.photos if photo.rotation is not None]
    placed = sum(point.place is not None for point in model.points)
    away = sorted(misses(model).values())
    parts = f"{len(model.parts) or 'no'} part{'' if len(model.parts) == 1 else 's'} built"
    words = f"{len(there)} of {len(model.photos)} photographs, {placed} of {len(model.points)} points solved; {parts}"
    focal = sorted({round(photo.focal_px, 1) for photo in there if photo.focal_px is not None})
    if focal:
        words += f"\nfocal length {focal[0]:.1f}" + (f" to {focal[-1]:.1f} px" if len(focal) > 1 else " px")
    return f"{words}\nmedian {away[len(away) // 2]:.2f}   worst {away[-1]:.2f} px" if away else words
