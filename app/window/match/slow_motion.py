"""A plate in slow motion: the frames between its frames, made by optical flow as a job and held within a budget."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from app.window.desk import Desk
from app.window.jobs import Asked, Cancelled, Job, Progress
from app.window.match.reel import Reel
from app.window.match.screen import PlateScreen
from core.errors import UserError
from core.image.frame_cache import GivenUp
from core.image.mix import to_float
from core.image.plate import Plate
from tools.match_edits import shown_plate

STEP = 1000  # parts of a frame that are told apart
SHARE = 2  # of the budget of frames: one in so many is for those between


class SlowMotion(QObject):
    """Frames between frames of the plate in view, as the screen shows them.

    screen : where whole frames come from. made : some are there.
    """

    made = Signal()

    def __init__(self, desk: Desk, screen: PlateScreen) -> None:
        super().__init__(desk)
        self.desk, self._screen = desk, screen
        self.job: Job | None = None
        self._key: tuple[Any, ...] = ()
        self._held: dict[int, NDArray[np.uint8]] = {}
        desk.session_replaced.connect(self.forget)

    def picture(self, plate: Plate, place: float) -> NDArray[np.uint8] | None:
        """The picture (H, W, 3) at a place of the plate between two frames; None where it was not made."""
        if not self._held or self._key != self._key_of(plate):
            return None
        return self._held.get(round(place * STEP))

    def forget(self) -> None:
        """Give everything back."""
        self._held, self._key = {}, ()

    def make(self) -> None:
        """Make what the timeline shows at the speed that is set, on another thread."""
        desk = self.desk
        plate, speed = shown_plate(desk.document), desk.workspace.plate_look.speed
        if plate is None:
            raise UserError("There is no plate to slow down; open one from the File menu, or drop its folder here.")
        if speed >= 1.0:
            raise UserError("Set Speed, under On the screen of the plate, below 1 first: at 0.5 it plays half as fast.")
        if self.job is not None and self.job in desk.jobs.running:
            raise UserError("Slow motion is being made; wait for it, or cancel that first.")
        first = max(desk.document.first_frame - plate.offset, plate.first)
        last = min(desk.document.last_frame - plate.offset, plate.last)
        if last <= first:
            raise UserError("The timeline shows no two frames of this plate; there is nothing between them.")
        reel, held, key = self._screen.reel(plate), {}, self._key_of(plate)
        budget = self._screen.budget // SHARE

        def done(full: bool) -> None:
            self._held, self._key = held, key
            self.made.emit()
            desk.said.emit(
                f"{len(held)} frames in between were made" + (
                    "; the others did not fit, see Frames, MB in the preferences." if full else "; play to see them."))

        def failed(error: Exception) -> None:
            if isinstance(error, Cancelled):
                desk.said.emit("Slow motion: cancelled.")
            else:
                desk.error(error)

        self.job = desk.jobs.start(
            "Slow motion", lambda progress, cancelled: _make(
                reel, range(first, last + 1), speed, held, budget, progress, cancelled), done, failed, self)

    def _key_of(self, plate: Plate) -> tuple[Any, ...]:
        look = self.desk.workspace.plate_look
        return plate.id, plate.path, plate.crop, plate.color_space, look.seen()


def _make(
    reel: Reel, frames: range, speed: float, held: dict[int, NDArray[np.uint8]], budget: int, progress: Progress,
    cancelled: Asked,
) -> bool:
    """Make the frames between into `held`; True when the budget ended it."""
    from core.match.retime import flow_pair, frame_between, frames_at_speed  # kernels: the start does without

    places = [place for place in frames_at_speed(frames[0], frames[-1], speed) if place != int(place)]
    size, pair, at = 0, None, None
    with reel.reading():
        try:
            for number, place in enumerate(places):
                if cancelled():
                    raise Cancelled
                if int(place) != at:
                    at = int(place)
                    here, there = (reel.shown.get(frame, cancelled) for frame in (at, at + 1))
                    pair = None
                    if here is not None and there is not None and here.shape == there.shape:
                        pair = flow_pair(to_float(here), to_float(there), cancel=cancelled)
                if pair is not None and here is not None and there is not None:
                    held[round(place * STEP)] = frame_between(here, there, pair, place - at)
                    size += here.nbytes
                    if size > budget:
                        return True
                progress((number + 1) / len(places))
        except GivenUp:
            raise Cancelled from None
    return False
