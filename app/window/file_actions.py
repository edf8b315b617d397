"""Files of the window: opened and saved beside it, in jobs; names are asked for without blocking."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from PySide6.QtWidgets import QFileDialog

from core.document import Document, MeshObject, find_mesh, free_id, with_mesh
from core.errors import UserError
from core.formats import curve_file, mesh_file
from core.formats.arrays import ArrayHashes
from core.formats.journal import Journal
from core.formats.mesh_file import MeshFile, read_mesh
from core.formats.project import read_project, write_project
from core.workspace import Reference, Workspace
from tools.registry import Registry
from tools.session import Session

if TYPE_CHECKING:
    from app.window.main import MainWindow

PROJECTS = (".filo", ".filo1")
PICTURES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".exr", ".hdr", ".bmp", ".webp")


class FileActions:
    """What commands of files do in one window."""

    COMMANDS: ClassVar[frozenset[str]] = frozenset({
        "new_document", "open_file", "show_recent", "save", "save_as", "save_copy", "import_mesh", "reload_mesh",
        "export_coat", "save_screenshot", "make_playblast", "camera_from_file", "choose_background", "pin_reference",
        "restart_safe", "save_macro", "play_macro",
    })

    def __init__(self, window: MainWindow) -> None:
        self._window, self._desk = window, window.desk

    # -- opening -----------------------------------------------------------------------------------------

    def new_document(self) -> None:
        """An empty document; what was open stays recoverable."""
        self.put(Session(journal=Journal(), tools=self._tools))

    def open_file(self, path: Path | None = None) -> None:
        """Open a project or a mesh."""
        if path is None:
            kinds = _patterns((*PROJECTS, *mesh_file.READ_SUFFIXES))
            self._ask_open("Open", f"Projects and meshes ({kinds});;All files (*)", self.open_file)
        elif path.suffix.lower() in PROJECTS:
            hashes = ArrayHashes()
            self._desk.jobs.start(
                f"Opening {path.name}", lambda progress, cancelled: read_project(path, hashes),
                lambda found: self._opened(path, found[0], found[1], hashes))
        else:
            self._read_mesh(path, lambda mesh: self._opened_mesh(path, mesh))

    def open_demo(self) -> None:
        """The demo animal with its first coat."""
        from core.demo import demo_document
        from core.evaluator import Evaluator

        def make(progress: object, cancelled: object) -> Document:
            evaluator = Evaluator()
            try:
                return demo_document(evaluator)
            finally:
                evaluator.close()

        self._desk.jobs.start("Opening the demo animal", make, lambda document: self.put(
            Session(document, _begun(document), journal=Journal(), tools=self._tools, name="Open the demo")))

    def put(self, session: Session) -> None:
        """Work on another session from now on."""
        self._desk.end_stroke()
        self._desk.replace_session(session)

    def drop(self, paths: list[Path]) -> None:
        """Files dropped on the window: projects open, meshes are added, pictures are pinned."""
        for path in paths:
            suffix = path.suffix.lower()
            if suffix in PICTURES:
                self._pin(path)
            elif suffix in PROJECTS or not self._desk.document.meshes:
                self.open_file(path)
            else:
                self.import_mesh(path)

    def show_recent(self) -> None:
        """The files opened last."""
        self._window.top.open_recent(self._window.settings.recent, self.open_file)

    def import_mesh(self, path: Path | None = None) -> None:
        """Add a mesh to the document."""
        if path is None:
            kinds = _patterns(mesh_file.READ_SUFFIXES)
            self._ask_open("Import mesh", f"Meshes ({kinds});;All files (*)", self.import_mesh)
            return
        self._read_mesh(path, lambda mesh: self._desk.edit("Import mesh", _with_new_mesh, mesh))

    def reload_mesh(self, path: Path | None = None) -> None:
        """Put another shape in place of the active mesh, with its hair."""
        from tools.scene import active_mesh

        item = active_mesh(self._desk.document, self._desk.workspace)
        if item is None:
            raise UserError("There is no mesh yet: open or import one first.")
        if path is None:
            kinds = _patterns(mesh_file.READ_SUFFIXES)
            self._ask_open(f"The new shape of {item.name}", f"Meshes ({kinds})", self.reload_mesh)
            return
        self._read_mesh(path, lambda mesh: self._desk.edit("Reload mesh", _with_shape, item.id, mesh))

    # -- saving ------------------------------------------------------------------------------------------

    def save(self) -> None:
        """Save to the file it came from; asks for a name the first time."""
        session = self._desk.session
        if session.path is None:
            self.save_as()
            return
        session.save()
        self._saved(session.path)

    def save_as(self, path: Path | None = None) -> None:
        """Save under a new name."""
        if path is None:
            self._ask_save("Save as", "Project (*.filo)", ".filo", self.save_as)
            return
        self._desk.session.save(path)
        self._saved(path)

    def save_copy(self, path: Path | None = None) -> None:
        """Save to another file and go on in the present one."""
        session = self._desk.session
        if path is None:
            self._ask_save("Save a copy", "Project (*.filo)", ".filo", self.save_copy)
            return
        write_project(path, session.history.current, session.workspace)
        self._desk.said.emit(f"A copy is in {path}.")

    def export_coat(self, path: Path | None = None) -> None:
        """Write the coat for a renderer."""
        from app.deliver import deliver
        from core.evaluator import Evaluator
        from core.groom.grow import grow

        groom = self._desk.groom
        if groom is None:
            raise UserError("There is no groom yet: import a mesh and groom it first.")
        if path is None:
            self._ask_save(
                "Export coat", f"Coats ({_patterns(curve_file.WRITE_SUFFIXES)})", ".usdc", self.export_coat)
            return
        document = self._desk.session.history.current

        def write(progress: object, cancelled: object) -> None:
            evaluator = Evaluator()
            try:
                mesh = find_mesh(document, groom.mesh_id).mesh
                only = document.replace(grooms=(groom,))
                deliver(path, only, {groom.id: grow(groom, mesh, evaluator)})
            finally:
                evaluator.close()

        self._desk.jobs.start(
            f"Writing {path.name}", write, lambda _: self._desk.said.emit(f"The coat is in {path}."))

    def save_screenshot(self, path: Path | None = None) -> None:
        """What the viewport shows, as a PNG."""
        if path is None:
            self._ask_save("Save a picture", "Picture (*.png)", ".png", self.save_screenshot)
            return
        from app.window.screenshot import view_image

        if not view_image(self._window.viewport).save(str(path)):
            raise UserError(f"{path} could not be written; choose another folder.")
        self._desk.said.emit(f"The picture is in {path}.")

    # -- how it looks ------------------------------------------------------------------------------------

    def choose_background(self, path: Path | None = None) -> None:
        """A picture behind everything."""
        if path is None:
            self._ask_open("Background image", f"Pictures ({_patterns(PICTURES)})", self.choose_background)
            return
        view = self._desk.workspace.view
        self._desk.set_workspace(view=view.replace(background=str(path)))

    def pin_reference(self) -> None:
        """A picture pinned to the view."""
        self._ask_open("Pin a reference", f"Pictures ({_patterns(PICTURES)})", self._pin)

    def _pin(self, path: Path) -> None:
        view = self._desk.workspace.view
        place = Reference(path=str(path), y=0.02 + 0.28 * (len(view.references) % 3), x=0.73)
        self._desk.set_workspace(view=view.replace(references=(*view.references, place)))

    # -- how -------------------------------------------------------------------------------------------

    @property
    def _tools(self) -> Registry:
        return self._desk.session.tools

    def _opened(self, path: Path, document: Document, workspace: Workspace, hashes: ArrayHashes) -> None:
        self.put(Session(
            document, workspace, path=path, journal=Journal(hashes=hashes), hashes=hashes, tools=self._tools,
            name="Open"))
        self._remember(path)

    def _opened_mesh(self, path: Path, mesh: MeshFile) -> None:
        document = _with_new_mesh(Document(), mesh)
        self.put(Session(document, _begun(document), journal=Journal(), tools=self._tools, name="Open mesh"))
        self._remember(path)

    def _read_mesh(self, path: Path, done: Callable[[MeshFile], object]) -> None:
        def read(progress: object, cancelled: Callable[[], bool]) -> MeshFile:
            return read_mesh(path, cancel=cancelled)

        def told(mesh: MeshFile) -> None:
            done(mesh)
            if mesh.notes:
                self._desk.said.emit(" ".join(mesh.notes))

        self._desk.jobs.start(f"Reading {path.name}", read, told)

    def _saved(self, path: Path) -> None:
        self._remember(path)
        self._desk.said.emit(f"Saved {path.name}.")
        self._window.show_saved()

    def _remember(self, path: Path) -> None:
        self._window.change_settings(recent=self._window.settings.opened(path).recent)

    def _ask_open(self, title: str, kinds: str, then: Callable[[Path], object]) -> None:
        self._ask(QFileDialog(self._window, title, self._folder(), kinds), then)

    def _ask_save(self, title: str, kinds: str, suffix: str, then: Callable[[Path], object]) -> None:
        dialog = QFileDialog(self._window, title, self._folder(), kinds)
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        dialog.setDefaultSuffix(suffix.lstrip("."))
        self._ask(dialog, then)

    def _ask(self, dialog: QFileDialog, then: Callable[[Path], object]) -> None:
        dialog.fileSelected.connect(lambda name: self._desk.attempt(then, Path(name)))
        dialog.open()

    def _folder(self) -> str:
        path, recent = self._desk.session.path, self._window.settings.recent
        return str(path.parent if path is not None else Path(recent[0]).parent if recent else Path.home())


def _begun(document: Document) -> Workspace:
    return Workspace(frame=float(document.first_frame), tool="comb" if document.grooms else "")


def _with_new_mesh(document: Document, mesh: MeshFile) -> Document:
    return with_mesh(document, MeshObject(id=free_id(document.meshes), name=mesh.name or "mesh", mesh=mesh.mesh))


def _with_shape(document: Document, mesh_id: int, mesh: MeshFile) -> Document:
    """The document with another mesh under the same id, and every groom's roots carried over."""
    from core.document import with_groom
    from core.mesh.rebind import rebind_roots

    item = find_mesh(document, mesh_id)
    changed = document
    for groom in document.grooms:
        if groom.mesh_id == mesh_id:
            roots, _, _ = rebind_roots(groom.guides.roots, item.mesh, mesh.mesh)
            changed = with_groom(changed, groom.replace(guides=groom.guides.replace(roots=roots)))
    rig = item.rig if item.rig is not None and len(item.rig.skin.joints) == len(mesh.mesh.points) else None
    return with_mesh(changed, item.replace(mesh=mesh.mesh, rig=rig))


def _patterns(suffixes: tuple[str, ...]) -> str:
    return " ".join(f"*{suffix}" for suffix in suffixes)
