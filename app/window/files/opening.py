"""Files into the window: chosen, dropped or opened again. Reading is a job; what cannot be read changes nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from PySide6.QtCore import QMimeData, QObject, QUrl, Signal
from PySide6.QtWidgets import QFileDialog, QWidget

from app.window.desk import Desk
from app.window.files.file_dialog import FileDialog
from app.window.jobs import Asked, Progress
from core.demo import demo_document
from core.document import Document
from core.errors import UserError
from core.evaluator import Evaluator
from core.formats import mesh_file, picture, rig_file
from core.formats.arrays import ArrayHashes
from core.formats.mesh_file import MeshFile, read_mesh
from core.formats.plate_file import is_plate
from core.formats.project import Project, read_project
from core.formats.rig_assembly import NoRig, RigFile
from core.formats.rig_file import document_of, read_rig
from core.workspace import Reference
from tools.document_edits import add_empty_groom, add_mesh_file, with_mesh_as_read
from tools.pose_edits import add_rig, play_clip_file
from tools.session import Session

PROJECT_SUFFIXES = (".filo", ".filo1")
MESH_SUFFIXES = mesh_file.READ_SUFFIXES
RIG_SUFFIXES = rig_file.READ_SUFFIXES
CLIP_SUFFIXES = (".bvh",)  # motion of joints without a mesh
PICTURE_SUFFIXES = picture.READ_SUFFIXES
OTHER_UP = {"y": "z", "z": "y"}
DEMO_GUIDES, DEMO_HAIRS = 2_500, 100_000
_STAGES = 6  # of the demo, about


class MakeSession(Protocol):
    """Makes the sessions of a window, with its journal and its tools."""

    def __call__(self, document: Document | None = None, *args: Any, **settings: Any) -> Session: ...


class Assumed(NamedTuple):
    """A mesh that came in from a file which does not say its unit, or which axis is up."""

    mesh_id: int
    path: Path
    found: MeshFile


class Opening(QObject):
    """Opens and imports for one desk.

    Parameters
    ----------
    parent : of the file dialogs.
    make : makes sessions. remember : called with every file that was opened. open_plate : opens a plate.

    opened : a document or a mesh came in; a view may frame it.
    assumed : after it, of a mesh whose file does not say its unit or its up axis: an `Assumed`.
    """

    opened = Signal()
    assumed = Signal(object)

    def __init__(
        self, desk: Desk, parent: QWidget | None = None, make: MakeSession = Session,
        remember: Callable[[Path], object] = lambda path: None,
        open_plate: Callable[[Path], object] = lambda path: None,
    ) -> None:
        super().__init__(desk)
        self._desk, self._parent, self._make, self._remember = desk, parent, make, remember
        self._open_plate = open_plate

    # -- asking ----------------------------------------------------------------------------------------------

    def ask(self) -> None:
        """Let the artist choose what to open."""
        choose_file(self._parent, "Open", open_filters(), self.open)

    def ask_import(self) -> None:
        """Let the artist choose a mesh to add."""
        choose_file(self._parent, "Import a mesh", [filter_of("Meshes", MESH_SUFFIXES)], self.import_mesh)

    # -- opening ---------------------------------------------------------------------------------------------

    def open(self, path: Path) -> None:
        """Open a project, or a mesh as a new document (into the present one while that is empty)."""
        suffix = path.suffix.lower()
        if is_plate(path):
            self._open_plate(path)
        elif suffix in PROJECT_SUFFIXES:
            self._open_project(path)
        elif suffix in CLIP_SUFFIXES:
            self._read_clip(path)
        elif suffix in RIG_SUFFIXES:
            self._read_rig(path, new=bool(self._desk.document.meshes))
        elif suffix in MESH_SUFFIXES or suffix in mesh_file.INSTEAD:
            self._read_mesh(path, self._open_mesh if self._desk.document.meshes else self._import_mesh)
        else:
            self._desk.error(UserError(
                f"{path.name} is nothing that can be opened; choose a project (.filo) or a mesh "
                f"({', '.join(MESH_SUFFIXES)}) or a rig ({', '.join(RIG_SUFFIXES)})."))

    def import_mesh(self, path: Path) -> None:
        """Add a mesh to the document, with an empty groom to plant in, or a rig to pose."""
        if path.suffix.lower() in CLIP_SUFFIXES:
            self._read_clip(path)
        elif path.suffix.lower() in RIG_SUFFIXES:
            self._read_rig(path, new=False)
        else:
            self._read_mesh(path, self._import_mesh)

    def open_demo(self) -> None:
        """Open the project's own animal, groomed."""

        def work(progress: Progress, cancelled: Asked) -> tuple[Document, Evaluator]:
            evaluator, done = Evaluator(), 0

            @contextmanager
            def stage(name: str) -> Iterator[None]:
                nonlocal done
                progress(min(0.95, done / _STAGES))
                yield
                done += 1

            try:
                return demo_document(evaluator, DEMO_HAIRS, DEMO_GUIDES, stage), evaluator
            except BaseException:
                evaluator.close()
                raise

        def done(result: tuple[Document, Evaluator]) -> None:
            document, evaluator = result
            self._show(self._make(document, evaluator=evaluator, name="Demo"), document.first_frame)

        self._desk.jobs.start("Open the demo", work, done)

    def open_bare_bird(self) -> None:
        """Open the project's own finch without a feather, to be dressed."""

        def work(progress: Progress, cancelled: Asked) -> Document:
            from core.demo.bird_document import bare_bird_document

            return bare_bird_document()

        def done(document: Document) -> None:
            self._show(self._make(document, name="Demo bird"), document.first_frame)

        self._desk.jobs.start("Open the demo bird", work, done)

    def _open_project(self, path: Path) -> None:
        hashes = ArrayHashes()

        def done(project: Project) -> None:
            session = self._make(project.document, project.workspace, path=path, hashes=hashes, name="Open")
            self._show(session, None)
            if session.document.meshes and not session.document.grooms and self._desk.posed is not None:
                self._desk.set_craft("pose")
            self._remember(path)

        self._desk.jobs.start(f"Open {path.name}", lambda progress, cancelled: read_project(path, hashes), done)

    def read_as(self, these: Sequence[Assumed], unit: str | None = None, turn: bool = False) -> None:
        """Read meshes that came in again, in place of themselves: in another unit, or with their other axis up."""
        what = these[0].path.name if len(these) == 1 else f"{len(these)} meshes"

        def work(progress: Progress, cancelled: Asked) -> list[MeshFile]:
            return [
                read_mesh(
                    path, unit=unit or found.metres_per_unit, up=OTHER_UP[found.up] if turn else found.up,
                    cancel=cancelled)
                for _, path, found in these
            ]

        def done(read: list[MeshFile]) -> None:
            def put(document: Document) -> Document:
                for (mesh_id, _, _), found in zip(these, read, strict=True):
                    document = with_mesh_as_read(document, mesh_id, found)
                return document

            if self._desk.edit("Turn upright" if turn else "Read in another unit", put):
                self.opened.emit()
                self._desk.said.emit(f"{what} read again; undo brings back what was there.")
                for (mesh_id, path, _), found in zip(these, read, strict=True):
                    self.assumed.emit(Assumed(mesh_id, path, found))

        self._desk.jobs.start(f"Read {what}", work, done)

    def _read_mesh(self, path: Path, then: Callable[[Path, MeshFile], int | None]) -> None:
        """Read a mesh; `then` puts it into a document and says under which id, None where it could not."""

        def done(found: MeshFile) -> None:
            mesh_id = then(path, found)
            if mesh_id is None:
                return
            self._remember(path)
            if found.notes:
                self._desk.said.emit(" ".join(without_options(note) for note in found.notes))
            self.opened.emit()
            if (found.unit_source, found.up_source) != ("file", "file"):
                self.assumed.emit(Assumed(mesh_id, path, found))

        self._desk.jobs.start(
            f"Read {path.name}", lambda progress, cancelled: read_mesh(path, cancel=cancelled), done)

    def _read_rig(self, path: Path, new: bool) -> None:
        """Open a rig in the craft of posing; a file of the format in which nothing moves is a mesh."""

        def done(found: RigFile | None) -> None:
            if found is None:
                self._read_mesh(path, self._open_mesh if new else self._import_mesh)
                return
            if new:
                self._show(self._make(document_of(found), name=f"Open {path.name}"[:255]), None)
            elif not self._desk.edit("Import rig", add_rig, document_of(found).meshes[0]):
                return
            document = self._desk.document
            self._desk.set_workspace(mesh=document.meshes[-1].id, frame=float(document.first_frame))
            self._desk.set_craft("pose")
            self._remember(path)
            if found.notes:
                self._desk.said.emit(" ".join(without_options(note) for note in found.notes))
            self.opened.emit()

        def work(progress: Progress, cancelled: Asked) -> RigFile | None:
            try:
                found = read_rig(path, cancel=cancelled)
            except NoRig:
                return None
            document_of(found)
            return found

        self._desk.jobs.start(f"Read {path.name}", work, done)

    def _read_clip(self, path: Path) -> None:
        """Let the rig that is posed play the motion of a file."""
        item = self._desk.posed
        if item is None:
            self._desk.error(UserError(f"{path.name} moves joints and has no mesh; open the rig that it moves first."))
            return

        def done(found: RigFile) -> None:
            if self._desk.edit("Import clip", play_clip_file, item.id, found.rig):
                self._desk.set_workspace(frame=float(self._desk.document.first_frame))
                self._desk.set_craft("pose")

        self._desk.jobs.start(f"Read {path.name}", lambda progress, cancelled: read_rig(path, cancel=cancelled), done)

    def _open_mesh(self, path: Path, found: MeshFile) -> int | None:
        document = with_mesh_to_plant(Document(), found, str(path.absolute()))
        self._desk.replace_session(self._make(document, name=f"Open {path.name}"[:255]))
        self._desk.set_workspace(frame=float(document.first_frame))
        return document.meshes[-1].id

    def _import_mesh(self, path: Path, found: MeshFile) -> int | None:
        if not self._desk.edit("Import mesh", with_mesh_to_plant, found, str(path.absolute())):
            return None
        document = self._desk.document
        added = document.meshes[-1].id
        self._desk.set_workspace(groom=next(g.id for g in document.grooms if g.mesh_id == added))
        return added

    def _show(self, session: Session, frame: int | None) -> None:
        self._desk.replace_session(session)
        if frame is not None:
            self._desk.set_workspace(frame=float(frame))
        self.opened.emit()

    # -- dropping --------------------------------------------------------------------------------------------

    def takes(self, data: QMimeData) -> bool:
        """True when something of this kind may be dropped on the window."""
        return any(url.isLocalFile() for url in data.urls())

    def dropped(self, urls: Sequence[QUrl]) -> None:
        """Files were dropped: a project is opened, meshes are added, pictures are pinned to the view."""
        paths = [Path(url.toLocalFile()) for url in urls if url.isLocalFile()]
        kinds = {suffix: kind for kind, suffixes in (
            ("picture", PICTURE_SUFFIXES), ("mesh", (*RIG_SUFFIXES, *MESH_SUFFIXES)), ("project", PROJECT_SUFFIXES),
        ) for suffix in suffixes}
        by_kind: dict[str, list[Path]] = {}
        for path in paths:
            kind = "plate" if is_plate(path) else kinds.get(path.suffix.lower(), "other")
            by_kind.setdefault(kind, []).append(path)
        for path in by_kind.get("project", [])[:1]:
            self.open(path)
        if "project" not in by_kind:
            for path in by_kind.get("mesh", []):
                self.import_mesh(path)
            self._pin(by_kind.get("picture", []))
            for path in by_kind.get("plate", []):
                self._open_plate(path)
        strange = by_kind.get("other", [])
        if strange or not paths:
            what = strange[0].name if strange else "What was dropped"
            self._desk.error(UserError(
                f"{what} is nothing that can be opened; drop a project (.filo), a mesh, a rig, a plate or a picture."))
        elif len(paths) > 1 and "project" in by_kind:
            self._desk.said.emit(f"{by_kind['project'][0].name} is opened; drop the other files after it.")

    def _pin(self, paths: Sequence[Path]) -> None:
        view = self._desk.workspace.view
        pinned = list(view.references)
        for path in paths:
            offset = 0.03 * (len(pinned) % 8)
            pinned.append(Reference(path=str(path), x=0.02 + offset, y=0.2 + offset))  # below the figures
        if len(pinned) > len(view.references):
            self._desk.set_workspace(view=view.replace(references=tuple(pinned)))


def with_mesh_to_plant(document: Document, found: MeshFile, source: str) -> Document:
    """The document with the mesh of a file and an empty groom on it, so that a hand can plant at once."""
    added = add_mesh_file(document, found, source)
    return add_empty_groom(added, added.meshes[-1].id, "coat")


def without_options(note: str) -> str:
    """A note of a reader without the options of the command line that would change what it tells."""
    words, found, _ = note.partition("; set --")
    return words + "." if found else note


def filter_of(words: str, suffixes: Sequence[str]) -> str:
    """A filter of a file dialog: "Meshes (*.obj *.ply)"; what begins without a dot is a whole name."""
    return f"{words} ({' '.join('*' * suffix.startswith('.') + suffix for suffix in suffixes)})"


def open_filters() -> list[str]:
    """Filters for what :meth:`Opening.open` takes."""
    return [
        filter_of("Projects, meshes and rigs", (*PROJECT_SUFFIXES, *dict.fromkeys((*MESH_SUFFIXES, *RIG_SUFFIXES)))),
        filter_of("Projects", PROJECT_SUFFIXES), filter_of("Meshes", MESH_SUFFIXES),
        filter_of("Rigs and clips", RIG_SUFFIXES), "All files (*)",
    ]


def choose_file(
    parent: QWidget | None, title: str, filters: Sequence[str], done: Callable[[Path], object], save: str = "",
    folder: bool = False, start: Path | None = None,
) -> QFileDialog:
    """Show a file dialog; `done` gets the path that was chosen.

    Parameters
    ----------
    save : suffix a new file gets, such as ".filo"; "" to choose one that exists. folder : choose a folder instead.
    start : folder to begin in, or a file to propose; by default where the dialog before this ended.
    """
    dialog = FileDialog(parent, title)
    dialog.setNameFilters(list(filters))
    if save:
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        dialog.setDefaultSuffix(save.lstrip("."))
    elif folder:
        dialog.setFileMode(QFileDialog.FileMode.Directory)
        dialog.setOption(QFileDialog.Option.ShowDirsOnly)
    else:
        dialog.setFileMode(QFileDialog.FileMode.ExistingFile)
    if start is not None:
        dialog.setDirectory(str(start if start.is_dir() else start.parent))
        if not start.is_dir():
            dialog.selectFile(start.name)
    dialog.fileSelected.connect(lambda name: done(Path(name)))
    dialog.finished.connect(dialog.deleteLater)
    dialog.open()
    return dialog
