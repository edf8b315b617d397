"""What the main window does with files beyond opening them: saving, exporting, pictures, macros."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QPoint, QProcess, Qt
from PySide6.QtWidgets import QMenu

from app.window.files.opening import MESH_SUFFIXES, PICTURE_SUFFIXES, choose_file, filter_of, without_options
from app.window.files.recent import RecentMenu
from app.window.pose.sculpt_door import import_sculpt
from app.window.screenshot import view_image
from core.document import Document, find_mesh
from core.errors import UserError
from core.evaluator import Evaluator
from core.formats import camera_file, curve_file
from core.formats.camera_file import FileCamera, read_cameras
from core.formats.mesh_file import MeshFile
from core.formats.project import write_project
from core.gate import gate_of
from core.navigate import whole_in
from core.workspace import Reference
from tools.document_edits import Replaced, read_mesh_again, replaced_mesh, set_mesh_source, space_given
from tools.macro import play
from tools.scene import active_mesh

if TYPE_CHECKING:
    from app.window.main import MainWindow

PROJECT = ["Project (*.filo)"]
SCRIPT = ["Python script (*.py)"]


class FileActions:
    """The part of one main window that is about files. Every method asks for the name that is not given."""

    def __init__(self, window: MainWindow) -> None:
        self._window, self._desk = window, window.desk

    def new_document(self) -> None:
        """An empty document; what was open stays recoverable."""
        self._desk.end_stroke()
        self._desk.replace_session(self._window.make_session())

    def save(self) -> None:
        """Save to the file it came from."""
        session = self._desk.session
        if session.path is None:
            self.save_as()
            return
        session.save()
        self._saved(session.path)

    def save_as(self, path: Path | None = None) -> None:
        """Save under a new name."""
        if path is None:
            self._choose("Save as", PROJECT, self.save_as, save=".filo")
            return
        self._desk.session.save(path)
        self._saved(path)

    def save_copy(self, path: Path | None = None) -> None:
        """Save to another file and go on in the present one."""
        session = self._desk.session
        if path is None:
            self._choose("Save a copy", PROJECT, self.save_copy, save=".filo")
            return
        write_project(path, session.history.current, session.workspace)
        self._desk.said.emit(f"A copy is in {path}.")

    def show_recent(self) -> None:
        """The files opened last, as a menu."""
        top = self._window.top
        menu = RecentMenu(self._desk, self._window.settings.recent, self._window.opening.open, top)
        menu.popup(top.mapToGlobal(top.rect().bottomLeft()))

    def import_sculpt(self, path: Path | None = None) -> None:
        """Take the sculpt of another program's file for the pose that is shown."""
        if path is None:
            self._choose("Import a sculpt", [filter_of("Meshes", MESH_SUFFIXES)], self.import_sculpt)
            return
        import_sculpt(self._desk, path)

    def reload_mesh(self, path: Path | None = None, mesh_id: int | None = None, ask: bool = False) -> None:
        """Put the updated shape in place of a mesh, the active one unless it is named; its hair comes along.

        path : of the file; None for the one the mesh was read from, which is asked for when it is not there (or in
        any case, with `ask`).
        """
        document = self._desk.session.history.current
        active = active_mesh(document, self._desk.workspace)
        item = active if mesh_id is None else find_mesh(document, mesh_id)
        if item is None:
            raise UserError("There is no mesh yet: open or import one first.")
        if path is None:
            known = Path(item.source) if item.source else None
            there = known is not None and known.is_file()
            if not there or ask:
                if known is not None and not there:
                    self._desk.said.emit(f"{known} is no longer there; choose where {item.name} is now.")
                near = known is not None and known.parent.is_dir()
                self._choose(
                    f"The new shape of {item.name}", [filter_of("Meshes", MESH_SUFFIXES)],
                    lambda name: self.reload_mesh(name, item.id), start=known if near else None)
                return
            path = known
        assert path is not None

        def work(progress: Callable[[float], None], cancelled: Callable[[], bool]) -> tuple[MeshFile, Replaced]:
            found = read_mesh_again(item, path, cancel=cancelled)
            progress(0.7)
            return found, replaced_mesh(document, item.id, found.mesh)

        def done(result: tuple[MeshFile, Replaced]) -> None:
            found, replaced = result

            def put(now: Document) -> Document:
                # the hair may have been combed meanwhile: what was made beside the window is then made anew
                made = replaced if now is document else replaced_mesh(now, item.id, found.mesh)
                return set_mesh_source(made.with_selection(), item.id, str(path.absolute()), *space_given(found))

            if self._desk.edit("Reload mesh", put):
                self._desk.said.emit(" ".join((reloaded(path.name, replaced), *map(without_options, found.notes))))

        self._desk.jobs.start(f"Read {path.name}", work, done)

    def export_coat(self, path: Path | None = None) -> None:
        """Write the active groom with its hairs for a renderer."""
        groom = self._desk.groom
        if groom is None:
            raise UserError("There is no groom yet: import a mesh and groom it first.")
        if path is None:
            self._choose("Export coat", [filter_of("Coats", curve_file.WRITE_SUFFIXES)], self.export_coat, ".usdc")
            return
        document = self._desk.session.history.current

        def write(progress: Callable[[float], None], cancelled: Callable[[], bool]) -> None:
            from app.deliver import deliver  # with every kernel of a coat: the start of the window does without
            from core.groom.grow import grow

            evaluator = Evaluator()
            try:
                children = grow(groom, find_mesh(document, groom.mesh_id).mesh, evaluator)
                progress(0.4)
                deliver(path, document.replace(grooms=(groom,)), {groom.id: children})
            finally:
                evaluator.close()

        self._desk.jobs.start(
            f"Write {path.name}", write, lambda _: self._desk.said.emit(f"The coat is in {path}."))

    def save_screenshot(self, path: Path | None = None) -> None:
        """What the viewport shows, or of it what a film gate takes, as a PNG."""
        if path is None:
            self._choose("Save a picture", ["Picture (*.png)"], self.save_screenshot, ".png")
        elif view_image(self._window.viewport).copy(self._window.viewport.gate_rect()).save(str(path)):
            self._desk.said.emit(f"The picture is in {path}.")
        else:
            raise UserError(f"{path} could not be written; choose another folder.")

    def choose_background(self, path: Path | None = None) -> None:
        """A picture behind everything."""
        if path is None:
            self._choose("Background image", [filter_of("Pictures", PICTURE_SUFFIXES)], self.choose_background)
            return
        self._desk.set_workspace(view=self._desk.workspace.view.replace(background=str(path)))

    def pin_reference(self, path: Path | None = None) -> None:
        """A picture pinned to the view."""
        if path is None:
            self._choose("Pin a reference", [filter_of("Pictures", PICTURE_SUFFIXES)], self.pin_reference)
            return
        view = self._desk.workspace.view
        offset = 0.03 * (len(view.references) % 8)
        pinned = Reference(path=str(path), x=0.02 + offset, y=0.2 + offset)
        self._desk.set_workspace(view=view.replace(references=(*view.references, pinned)))

    def camera_from_file(self, path: Path | None = None) -> None:
        """Look through a camera of a shot at the current frame; asks which when there are several."""
        if path is None:
            filters = [filter_of("Cameras", camera_file.READ_SUFFIXES)]
            self._choose("Camera from a file", filters, self.camera_from_file)
            return
        document, frame = self._desk.document, self._desk.workspace.frame

        def done(found: tuple[FileCamera, ...]) -> None:
            if len(found) == 1:
                self._look_through(found[0])
                return
            menu = QMenu(self._window)
            menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
            for one in found:
                menu.addAction(one.name.replace("&", "&&")).triggered.connect(
                    lambda checked=False, one=one: self._look_through(one))
            menu.popup(self._window.view.mapToGlobal(QPoint(8, 8)))

        self._desk.jobs.start(
            f"Read {path.name}", lambda progress, cancelled: read_cameras(path, frame, document.fps, cancel=cancelled),
            done)

    def _look_through(self, found: FileCamera) -> None:
        width, height = self._window.viewport.pixels()
        self._desk.set_workspace(view=self._desk.workspace.view.replace(
            gate=gate_of(found.camera, found.aspect), gate_shown=True))
        self._window.look(whole_in(found.camera, found.aspect, width / height))
        shift = " Its picture is shifted aside in the file; here it is centred." if found.off_centre else ""
        self._desk.said.emit(f"This is what {found.name} sees at frame {self._desk.workspace.frame:g}.{shift}")

    def save_macro(self, path: Path | None = None) -> None:
        """End the recording and write it."""
        if path is None:
            self._choose("Save the macro", SCRIPT, self.save_macro, ".py")
            return
        macro = self._desk.session.stop_recording()
        if macro is not None:
            macro.save(path)
            self._desk.said.emit(f"The macro is in {path}.")

    def play_macro(self, path: Path | None = None) -> None:
        """Do again what a macro says."""
        if path is None:
            self._choose("Play a macro", SCRIPT, self.play_macro)
            return
        play(path, self._desk.session)
        self._desk.stroke_ended.emit()

    def restart_safe(self) -> None:
        """Leave, and start again without a studio's own tools; the work is in the journal and offered there."""
        path = self._desk.session.path
        arguments = ["-m", "app", "--safe", *([str(path)] if path is not None else [])]
        self._window.close()
        QProcess.startDetached(sys.executable, arguments)

    def _saved(self, path: Path) -> None:
        self._window.remember(path)
        self._desk.said.emit(f"Saved {path.name}.")
        self._window.show_saved()

    def _choose(
        self, title: str, filters: list[str], done: Callable[[Path], object], save: str = "", start: Path | None = None,
    ) -> None:
        path, recent = self._desk.session.path, self._window.settings.recent
        if start is None:
            start = path.parent if path is not None else Path(recent[0]).parent if recent else None
        if save == ".filo" and path is not None:
            start = path
        choose_file(self._window, title, filters, lambda name: self._desk.attempt(done, name), save, start=start)


def reloaded(name: str, replaced: Replaced) -> str:
    """What became of the hair on an updated mesh, in a sentence."""
    guides = sum(len(ids) for ids in replaced.doubtful.values())
    if not guides:
        return f"{name} is in place, with all its hair."
    return (f"{name} is in place. The skin under {guides:,} {'guide' if guides == 1 else 'guides'} is gone: "
            "their nearest place was guessed and they are selected, look at them.")
