"""Solving the model of photographs in a job, and writing what is built on it; walking through its photographs."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QWidget

from app.photomodel_file import write_model
from app.window.desk import Desk
from app.window.files.opening import choose_file, filter_of
from core.errors import UserError
from core.formats.frame_decoder import FrameDecoder
from core.match.photomodel.build import built
from core.match.photomodel.records import Photomodel
from core.match.photomodel.solve import Outcome, solved
from tools.match_edits import show_plate, shown_plate
from tools.photomodel_edits import NO_MODEL, model_of, put_model, walk

STEP = "Solve photomodel"
WRITTEN = (".obj", ".usda", ".usdc", ".glb", ".ply")
TEXELS = 2048  # of a side of the picture that is projected


class ModelJob(QObject):
    """Solves, walks and writes for one desk. parent : of the file dialogs."""

    def __init__(self, desk: Desk, parent: QWidget | None = None) -> None:
        super().__init__(desk)
        self._desk, self._parent = desk, parent
        self.outcome: Outcome | None = None

    def solve(self, *, again: bool = False) -> None:
        """Find the cameras and points of the model in a job; `again` from its picks alone."""
        model = self._model()

        def done(found: Outcome) -> None:
            if model_of(self._desk.document) is not model:
                self._desk.error(UserError("The model was changed while it was being solved; solve it again."))
                return
            if self._desk.edit(STEP, put_model, found.model):
                self.outcome = found
                self._desk.said.emit(words_of(found))

        self._desk.jobs.start(STEP, lambda progress, cancelled: solved(model, again=again), done, owner=self)

    def walk(self, way: int) -> None:
        """Look at the next photograph, or the one before; the point in hand stays in hand."""
        desk = self._desk
        plate = shown_plate(desk.document)
        here = (0, 0) if plate is None else (plate.id, round(desk.workspace.frame) - plate.offset)
        photo = walk(desk.document, *here, way)
        there = next((one for one in desk.document.plates if one.id == photo.plate_id), None)
        if there is None:
            raise UserError(f"The photograph {photo.name} names no file.")
        if there.hidden or there is not plate:
            desk.edit("Show plate", show_plate, there.id)
        desk.set_workspace(frame=float(photo.frame + there.offset))

    def ask_export(self) -> None:
        """Let the artist name a file for what is built; its suffix says of which kind."""
        built(self._model())  # says in words what is missing, before a name is asked for
        choose_file(self._parent, "Export model", [filter_of("Meshes", WRITTEN)],
                    lambda path: self._desk.attempt(self.export, path), save=".obj")

    def export(self, path: Path) -> None:
        """Write what is built with UVs and the photographs projected onto it."""
        model, plates = self._model(), self._desk.document.plates
        root = self._desk.session.path
        folder = Path.cwd() if root is None else root.parent

        def work() -> list[str]:
            decoder = FrameDecoder()
            try:
                return write_model(path, model, plates, folder, TEXELS, decoder)
            finally:
                decoder.close()

        self._desk.jobs.start(
            f"Write {path.name}", lambda progress, cancelled: work(),
            lambda written: self._desk.said.emit(f"{', '.join(Path(one).name for one in written)} were written."))

    def _model(self) -> Photomodel:
        model = model_of(self._desk.document)
        if model is None:
            raise UserError(NO_MODEL)
        return model


def words_of(found: Outcome) -> str:
    """What a solve says of itself in a line."""
    model = found.model
    points = sum(point.place is not None for point in model.points)
    words = (f"{int(found.known.sum())} of {len(model.photos)} photographs, {points} of {len(model.points)} points: "
             f"RMS {found.rms:.2f} px.")
    return " ".join([words, *found.warnings[:1], *found.advice[:1]])
