"""Plates and tracks into the window and out of it: chosen, dropped, read in jobs."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QWidget

from app.movie import MOVIE_SUFFIXES
from app.window.desk import Desk
from app.window.files.opening import choose_file, filter_of
from app.window.jobs import Asked, Cancelled, Job, Progress
from app.window.match.scene_over import Drawn
from core.errors import UserError
from core.formats.atomic import atomic_write
from core.formats.frame_decoder import FrameDecoder
from core.formats.plate_file import MOVIES, PICTURES, read_plate
from core.formats.stmap_file import write_stmap
from core.formats.track_file import SUFFIXES, read_tracks, write_tracks
from core.formats.tracks_json import Tracks
from core.image.plate import Plate
from core.image.plate_view import plate_size
from core.match.solved import SolvedCamera, shot_of_record
from tools.match_edits import add_plate, add_tracks, shown_plate
from tools.plate_edits import relink_plate
from tools.solve_edits import solved_of

if TYPE_CHECKING:
    from core.match.lens_maps import Canvas

Work = Callable[[Progress, Asked], Any]
CAMERAS = {  # program -> the names of its files; all that core.formats.shot_file.WRITTEN has
    "USD": (".usda", ".usdc", ".usd"), "Alembic": (".abc",), "Nuke": (".nk", ".chan"), "Maya": (".ma",),
    "Blender": (".py",), "COLMAP": ("cameras.txt", "cameras.bin"), "Bundler": (".out",),
    "OpenSfM": ("reconstruction.json",), "Lens of 3DEqualizer": (".txt",),
}
NO_PLATE = "There is no plate yet: open one from the File menu, or drop its folder on the window."
WAIT = 0.05  # s before a scene that is still being made is asked for again


class MatchDoors(QObject):
    """Opens plates, reads and writes tracks. parent : of the file dialogs."""

    def __init__(self, desk: Desk, parent: QWidget | None = None) -> None:
        super().__init__(desk)
        self._desk, self._parent = desk, parent
        self.draw_scene: Callable[[int], object] | None = None  # of the view, where there is one
        self._writing: Job | None = None
        self._waiting: list[tuple[str, Work, Callable[[Any], None]]] = []

    def ask_plate(self) -> None:
        """Let the artist choose a frame of a plate, or a movie."""
        kinds = [filter_of("Plates: a frame of a sequence, or a movie", (*PICTURES, *MOVIES)), "All files (*)"]
        choose_file(self._parent, "Open a plate", kinds, self.open_plate)

    def open_plate(self, path: Path) -> None:
        """Look at a plate in a job and put it in view, in the craft of matchmoving."""
        def done(plate: Plate) -> None:
            if not self._desk.edit("Open plate", add_plate, plate):
                return
            self._desk.set_workspace(frame=float(self._desk.document.first_frame))
            self._desk.set_craft("match")
            if plate.missing:
                self._desk.said.emit(f"{plate.name} misses {len(plate.missing)} of its frames; tracks go on over them.")

        self._look_at(path, done)

    def ask_relink(self, plate_id: int) -> None:
        """Let the artist choose a frame of a plate at its new place."""
        kinds = [filter_of("Plates: a frame of a sequence, or a movie", (*PICTURES, *MOVIES)), "All files (*)"]
        choose_file(self._parent, "Where is the plate now?", kinds, lambda path: self.relink(plate_id, path))

    def relink(self, plate_id: int, path: Path) -> None:
        """Look at a plate at its new place in a job, and take its files from there."""
        known = next((p.digest for p in self._desk.document.plates if p.id == plate_id), "")

        def done(found: Plate) -> None:
            if self._desk.edit("Relink plate", relink_plate, plate_id, found) and found.digest != known:
                self._desk.said.emit(f"{found.name} begins with another picture than before; see that it is the one.")

        self._look_at(path, done)

    def _look_at(self, path: Path, done: Callable[[Plate], None]) -> None:
        def work() -> Plate:
            decoder = FrameDecoder()
            try:
                return read_plate(path.absolute(), decoder)
            finally:
                decoder.close()

        self._desk.jobs.start(f"Look at {path.name}", lambda progress, cancelled: work(), done)

    def ask_import(self) -> None:
        """Let the artist choose a file of tracks."""
        self._plate()
        kinds = [filter_of("Tracks", tuple(s for s in SUFFIXES if s != ".py")), "All files (*)"]
        choose_file(self._parent, "Import tracks", kinds,
                    lambda path: self._desk.attempt(self.import_tracks, path))

    def import_tracks(self, path: Path) -> None:
        """Add the tracks of a file to the plate in view."""
        plate = self._plate()
        size = plate_size(plate)

        def done(found: Tracks) -> None:
            if found.size is not None and tuple(found.size) != size:
                self._desk.error(UserError(
                    f"{path.name} is of a plate of {found.size[0]} x {found.size[1]} pixels, "
                    f"{plate.name} has {size[0]} x {size[1]}."))
            elif self._desk.edit("Import tracks", add_tracks, found.tracks, plate.id):
                self._desk.said.emit(f"{len(found.tracks)} tracks of {path.name} were added.")

        self._desk.jobs.start(f"Read {path.name}", lambda progress, cancelled: read_tracks(path, size=size), done)

    def ask_export(self) -> None:
        """Let the artist name a file for the tracks; its suffix says for which program."""
        plate = self._plate()
        if not any(t.plate_id == plate.id for t in self._desk.document.tracks):
            raise UserError("This plate has no tracks yet: place some first.")
        choose_file(self._parent, "Export tracks", [filter_of("Tracks", SUFFIXES)],
                    lambda path: self._desk.attempt(self.export_tracks, path), save=".json")

    def export_tracks(self, path: Path) -> None:
        """Write the tracks of the plate in view; hidden ones are left out."""
        plate = self._plate()
        tracks = tuple(t for t in self._desk.document.tracks if t.plate_id == plate.id and not t.hidden)
        if path.suffix.lower() not in SUFFIXES:
            raise UserError(f"{path.name}: tracks are written as {', '.join(SUFFIXES)}; choose one of these suffixes.")
        written = Tracks(tracks, plate_size(plate), (plate.first, plate.last))

        def work() -> None:
            with atomic_write(path) as beside:
                write_tracks(beside, written, path.suffix)

        self._desk.jobs.start(
            f"Write {path.name}", lambda progress, cancelled: work(),
            lambda nothing: self._desk.said.emit(f"{len(tracks)} tracks were written to {path.name}."))

    def ask_export_camera(self) -> None:
        """Let the artist name a file for the solved camera; its suffix says for which program."""
        self._solved()
        everything = tuple(name for names in CAMERAS.values() for name in names)
        kinds = [filter_of("Cameras", everything), *(filter_of(words, names) for words, names in CAMERAS.items())]
        choose_file(self._parent, "Export camera", kinds,
                    lambda path: self._desk.attempt(self.export_camera, path), save=".usda")

    def export_camera(self, path: Path) -> None:
        """Write the solved camera of the plate in view with its points."""
        from core.formats.shot_file import check_writable, write_shot  # the solver with it, which is large

        check_writable(path)
        solved = self._solved()
        shot = shot_of_record(solved, {track.id: track.name for track in self._desk.document.tracks})
        self._write(
            f"Write {path.name}", lambda progress, cancelled: write_shot(path, shot, {"kind": solved.kind}),
            lambda nothing: self._desk.said.emit(f"The camera was written to {path.name}."))

    def ask_check_movie(self) -> None:
        """Let the artist name a movie of the plate with what the solve puts over it."""
        self._solved()
        choose_file(self._parent, "Movie of the solve", [filter_of("Movies", MOVIE_SUFFIXES)],
                    lambda path: self._desk.attempt(self.write_check_movie, path), save=".mp4")

    def write_check_movie(self, path: Path) -> None:
        """Write the solved frames of the plate in view as a movie, in a job."""
        from app.window.match.check_movie import write_check_movie  # with the writer of movies

        plate, solved, fps, saved = self._plate(), self._solved(), self._desk.document.fps, self._desk.session.path
        root = None if saved is None else saved.parent
        document, workspace = self._desk.document, self._desk.workspace
        opacity, look = workspace.view.over_plate, workspace.plate_look
        scene = self._scene_at if self.draw_scene is not None and document.meshes and opacity else None
        self._write(
            f"Write {path.name}",
            lambda progress, cancelled: write_check_movie(
                path, plate, solved, fps, root, progress, scene, opacity, look),
            lambda count: self._desk.said.emit(f"{count} frames of the plate with the solve are in {path.name}."))

    def _scene_at(self, frame: int) -> Drawn | None:
        """What stands in the document on a frame, drawn on the thread of the window; called by a job, which waits."""
        while True:
            found = self._desk.jobs.on_window(self.draw_scene, frame)
            if found is None or isinstance(found, Drawn):
                return found
            time.sleep(WAIT)  # hair or feathers are still being made

    def ask_lens_maps(self) -> None:
        """Let the artist name the STMaps of the solved lens."""
        self._solved()
        choose_file(self._parent, "Export lens maps", [filter_of("STMaps", (".exr",))],
                    lambda path: self._desk.attempt(self.export_lens_maps, path), save=".exr")

    def export_lens_maps(self, path: Path) -> None:
        """Write two STMaps of the solved lens, NAME.undistort.exr and NAME.redistort.exr, in a job."""
        solved = self._solved()
        if path.suffix.lower() != ".exr":
            raise UserError(f"{path.name}: maps are written as .exr; give a name that ends so.")
        names = tuple(path.with_name(f"{path.stem}.{way}.exr") for way in ("undistort", "redistort"))

        def work(progress: Progress, cancelled: Asked) -> Canvas:
            from core.match.lens_maps import canvas, redistort_map, undistort_map  # of the solver, which is large

            room = canvas(solved.lens, solved.size)
            for number, (name, make) in enumerate(zip(names, (undistort_map, redistort_map), strict=True)):
                progress(0.5 * number)
                with atomic_write(name) as beside:
                    write_stmap(beside, make(solved.lens, solved.size, room))
            return room

        self._write(
            f"Write lens maps {path.stem}", work, lambda room: self._desk.said.emit(
                f"{names[0].name} and {names[1].name}: the straight picture has {room.size[0]} x {room.size[1]} "
                "pixels."))

    def _write(self, name: str, work: Work, done: Callable[[Any], None]) -> None:
        """Write in a job, one file after another: USD, while it is loaded, waits for ever for another library that is
        loaded on another thread at that moment."""
        self._waiting.append((name, work, done))
        self._write_next()

    def _write_next(self) -> None:
        if self._writing is not None or not self._waiting:
            return
        name, work, done = self._waiting.pop(0)

        def ended(result: Any) -> None:
            self._writing = None
            done(result)
            self._write_next()

        def failed(error: Exception) -> None:
            self._writing = None
            if isinstance(error, Cancelled):
                self._desk.said.emit(f"{name}: cancelled.")
            else:
                self._desk.error(error)
            self._write_next()

        self._writing = self._desk.jobs.start(name, work, ended, failed)

    def _solved(self) -> SolvedCamera:
        solved = solved_of(self._desk.document, self._plate().id)
        if solved is None:
            raise UserError("The camera of this plate is not solved yet: solve it first.")
        return solved

    def _plate(self) -> Plate:
        plate = shown_plate(self._desk.document)
        if plate is None:
            raise UserError(NO_PLATE)
        return plate
