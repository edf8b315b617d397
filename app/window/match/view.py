"""The plate in the viewport: the frame of the desk, what is marked on it, and the pattern enlarged beside it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import moderngl
import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QWidget

from app.window.desk import Desk
from app.window.match.doors import MatchDoors
from app.window.match.eye import PlateEye
from app.window.match.marks import Sheet, marks_of
from app.window.match.model_job import ModelJob
from app.window.match.model_marks import model_marks
from app.window.match.pattern import patches
from app.window.match.scene_over import SceneOver
from app.window.match.screen import PlateScreen, Shown
from app.window.match.slow_motion import SlowMotion
from app.window.match.solve_job import SolveJob
from app.window.match.solve_marks import solve_marks
from app.window.match.tracking import MatchTracking
from core.image.plate_view import pixels_per_pixel, plate_size
from core.match.track import errors_of
from core.overlay import Fill, Overlays, Polyline
from tools.ground import Pointer
from tools.match_edits import place_at, selected_tracks
from tools.photomodel_edits import model_of, photo_of
from tools.solve_edits import solved_of
from viewport.plate import Box, PlatePicture
from viewport.view import HudLine, View3D

LETTER, LINE_HEIGHT = 6.6, 16.5  # pixels of Qt's


class PlateView(QObject):
    """What the viewport shows in the craft of matchmoving.

    fresh : something that is shown has changed by itself.
    """

    fresh = Signal()

    def __init__(self, desk: Desk, size: Callable[[], tuple[int, int]], window: QWidget | None = None) -> None:
        super().__init__(desk)
        self.desk = desk
        self.eye = PlateEye(desk, size, self.fresh.emit)
        self.screen = PlateScreen(desk)
        self.tracking = MatchTracking(desk, self.screen)
        self.slow = SlowMotion(desk, self.screen)
        self.solving = SolveJob(desk)
        self.model = ModelJob(desk, window)
        self.doors = MatchDoors(desk, window)
        self.scene = SceneOver(desk)
        self.screen.fresh.connect(self.fresh)
        self.tracking.made.connect(self.fresh)
        self.slow.made.connect(self.fresh)
        self._picture: PlatePicture | None = None
        desk.session_replaced.connect(self._session_replaced)

    @property
    def shown(self) -> bool:
        """True while a plate is looked at instead of the scene."""
        return self.eye.shown

    @property
    def settled(self) -> bool:
        """True when the frame of the desk is on the screen."""
        return not (self.screen.waiting or self.scene.wanted)

    def paint(
        self, view: View3D, framebuffer: moderngl.Framebuffer, size: tuple[int, int], over: Overlays,
        pointer: Pointer | None, ratio: float,
    ) -> None:
        """Draw the plate with its marks, and `over` over all."""
        plate = self.eye.plate
        if plate is None:
            return
        if self._picture is None or self._picture.view is not view:
            self._picture = PlatePicture(view)
        frame, camera = self.eye.frame, self.eye.camera
        shown = self.screen.picture(plate, frame)
        between = self.slow.picture(plate, self.desk.workspace.frame - plate.offset)
        sheet = Sheet(plate, frame, camera, size, ratio)
        marks = marks_of(self.desk.document, sheet) + self._live(sheet) + model_marks(self.desk.document, sheet)
        solved = solved_of(self.desk.document, plate.id)
        if solved is not None:
            marks += solve_marks(solved, sheet)
        box = self._box(sheet)
        small = patches(self.desk.document, self.screen, sheet, pointer)
        marks += small.marks
        words = self._words(shown, frame)
        here = shown is not None and shown.frame == frame
        self._picture.present(
            framebuffer, size, between if between is not None else None if shown is None else shown.pixels, box,
            (*ground_of(words, ratio), *marks, *over), words, ratio, small.insets,
            self.scene.over(plate, sheet) if here else None)

    def release(self) -> None:
        """Give back what is on the graphics card, its context current."""
        if self._picture is not None:
            self._picture.release()
            self._picture = None

    def close(self) -> None:
        """Give back frames and the child that reads them."""
        self.screen.close()

    def _box(self, sheet: Sheet) -> Box:
        wide, tall = plate_size(sheet.plate)
        ends: NDArray[np.float64] = sheet.at(np.array([[-0.5, -0.5], [wide - 0.5, tall - 0.5]])) + 0.5
        return float(ends[0, 0]), float(ends[0, 1]), float(ends[1, 0]), float(ends[1, 1])

    def _live(self, sheet: Sheet) -> Overlays:
        """Tails of tracks that are being made."""
        return tuple(Polyline(sheet.at(points), "selected", 1.5) for points in self.tracking.tails() if len(points) > 1)

    def _words(self, shown: Shown | None, frame: int) -> list[HudLine]:
        document, plate = self.desk.document, self.eye.plate
        if plate is None or not self.desk.workspace.view.hud:
            return []
        wide, tall = plate_size(plate)
        tracks = [t for t in document.tracks if t.plate_id == plate.id]
        seen = sum(place_at(t, frame) is not None for t in tracks)
        zoom = 100.0 * pixels_per_pixel(self.eye.camera, self.eye.size()[1])
        lines: list[HudLine] = [
            (self.desk.session.tool.label, "accent"), f"{plate.name} · {wide} x {tall} · {zoom:.0f} %",
            f"frame {frame} · {seen} of {len(tracks)} tracks seen" if tracks else f"frame {frame} · no tracks yet"]
        if (model := model_of(document)) is not None and (photo := photo_of(model, plate.id, frame)) is not None:
            here = sum(bool((point.picks.photo == photo.id).any()) for point in model.points)
            place = f"photograph {model.photos.index(photo) + 1} of {len(model.photos)}"
            lines[-1] = f"{place} · {here} of {len(model.points)} points picked"
        chosen = selected_tracks(document)
        if chosen and (at := np.flatnonzero(chosen[-1].frames == frame)).size:
            track = chosen[-1]
            lines.append(f"{track.name} · x {track.points[at[0], 0]:.3f} y {track.points[at[0], 1]:.3f} · "
                         f"error {errors_of(track)[at[0]]:.3f} px · likeness {track.score[at[0]]:.2f}")
        if look := self.desk.workspace.plate_look.words():
            lines.append((look, "accent"))
        if self.eye.still is not None:
            lines.append(("held still at a track", "accent"))
        if shown is None or (shown.frame != frame and not shown.words):
            lines.append(f"reading frame {frame}")
        elif shown.words:
            lines.append((shown.words, "trouble"))
        return lines

    def play_speed(self) -> float:
        """Frames that pass in the time of one while this plate plays."""
        return self.desk.workspace.plate_look.speed if self.shown else 1.0

    def _session_replaced(self) -> None:
        self.eye.forget()
        self.screen.close()


def ground_of(words: Sequence[HudLine], ratio: float) -> Overlays:
    """Darkness behind the words in the corner, so that they are read on every plate."""
    if not words:
        return ()
    longest = max(len(line if isinstance(line, str) else line[0]) for line in words)
    right, bottom = 26.0 + LETTER * longest, 22.0 + LINE_HEIGHT * len(words)
    return (Fill(6.0 * ratio, 6.0 * ratio, right * ratio, bottom * ratio, 0.55),)
