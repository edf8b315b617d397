"""Tracking as a job: plain data on another thread, points shown as they are made, one step of history at the end."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, QTimer, Signal

from app.window.desk import Desk
from app.window.jobs import Asked, Cancelled, Job, Progress
from app.window.match.reel import Reel
from app.window.match.screen import PlateScreen
from core.errors import UserError
from core.image.frame_cache import GivenUp
from core.image.plate import Plate
from core.image.plate_view import plate_size
from core.match.follow import NOT_FOLLOWED, Stretch, Way, stretch_of, with_found
from core.match.outline import Mask, held_off
from core.match.track import PlaneTrack, Track, TrackSettings, gaps_of
from tools.match_edits import add_tracks, put_planes, put_tracks, selected_tracks, shown_plate

if TYPE_CHECKING:
    from core.match.tracker import Step

STEPS = {
    "forward": "Track forward", "backward": "Track backward", "next": "Track one frame on",
    "previous": "Track one frame back", "between": "Track between keys", "both": "Track both ways",
}
SHOWN_EVERY = 30  # ms; a picture takes the time in which many more points are made


class Work:
    """What a job needs of a plate and its marks; made on the thread of the window, used on another."""

    def __init__(self, plate: Plate, reel: Reel, masks: tuple[Mask, ...]) -> None:
        self.plate, self.reel, self.masks = plate, reel, masks

    def run(
        self, tasks: tuple[Stretch, ...], settings: TrackSettings, auto: int, steps: deque[Step], progress: Progress,
        cancelled: Asked,
    ) -> tuple[Track, ...]:
        """Follow what is to be followed; every step goes to `steps` at once."""
        from core.match.tracker import Tracking  # its kernels and scipy.fft: the start of the window does without

        frames = range(min(t.frames[0] for t in tasks), max(t.frames[-1] for t in tasks) + 1) if tasks \
            else self.plate.frames
        groups: dict[tuple[Any, ...], tuple[TrackSettings, list[Track]]] = {}
        for one in tasks:  # tracks of the same settings are followed together, in one pass through the plate
            own = one.task.settings or settings
            values = tuple(getattr(own, name) for name in TrackSettings.__struct_fields__)
            groups.setdefault(values, (own, []))[1].append(one.task)
        made: tuple[Track, ...] = ()
        with self._opened(cancelled) as read:
            for number, (own, tracks) in enumerate(groups.values() if groups else ((settings, []),)):
                tracking = Tracking(
                    read, frames, tuple(tracks), own, auto=auto, hold=self._held, ranges=_stopped_by(cancelled))
                for step in tracking.steps():
                    steps.append(step)
                    progress((number + step.done / step.total) / max(1, len(groups)))
                made += tracking.tracks()
        return made

    def follow_planes(
        self, planes: tuple[PlaneTrack, ...], progress: Progress, cancelled: Asked
    ) -> tuple[PlaneTrack, ...]:
        """Follow planes from their keys through the plate."""
        from core.match.plane_tracker import plane_steps  # as above

        made, count = [], len(self.plate.frames)
        with self._opened(cancelled) as read:
            for number, plane in enumerate(planes):
                for done, step in enumerate(plane_steps(
                        plane, read, self.plate.frames, hold=self._held, ranges=_stopped_by(cancelled))):
                    plane = step
                    progress(min((number + done / count) / len(planes), 1.0))
                made.append(plane)
        return tuple(made)

    def fill(self, tracks: tuple[Track, ...], progress: Progress, cancelled: Asked) -> tuple[Track, ...]:
        """The tracks with their gaps filled by optical flow."""
        from core.match.fill import fill_gaps  # as above

        with self._opened(cancelled) as read:
            made = fill_gaps(tracks, read, ranges=_stopped_by(cancelled), progress=progress, cancel=cancelled)
        if cancelled():
            raise Cancelled
        return made

    @contextmanager
    def _opened(self, cancelled: Asked) -> Iterator[Callable[[int], NDArray[np.float32] | None]]:
        """What reads the frames as tracking looks at them, and ends with a cancelled job."""
        with self.reel.reading() as reel:
            seen = reel.seen(self.plate.mix)

            def read(frame: int) -> NDArray[np.float32] | None:
                if cancelled():
                    raise Cancelled
                try:
                    return seen.get(frame, cancelled)
                except GivenUp:
                    raise Cancelled from None

            yield read

    def _held(self, frame: int) -> NDArray[np.bool_] | None:
        width, height = plate_size(self.plate)
        return held_off(self.masks, frame, height, width)


class MatchTracking(QObject):
    """Begins tracking jobs of a desk and shows what they make.

    screen : where the frames come from. made : points were made.
    """

    made = Signal()

    def __init__(self, desk: Desk, screen: PlateScreen) -> None:
        super().__init__(desk)
        self.desk, self._screen = desk, screen
        self.job: Job | None = None
        self._steps: deque[Step] = deque()
        self._tails: dict[int, list[tuple[int, NDArray[np.float64]]]] = {}
        self._show = QTimer(self, interval=SHOWN_EVERY, singleShot=True)
        self._show.timeout.connect(self.made)
        desk.jobs.changed.connect(self._listen)

    @property
    def running(self) -> bool:
        """True while tracks are made."""
        return self.job is not None and self.job in self.desk.jobs.running

    def tails(self) -> list[NDArray[np.float64]]:
        """Points (N, 2) of every track that is being made, in the order of frames."""
        return [np.array([p for _, p in sorted(rows, key=lambda row: row[0])]) for rows in self._tails.values()]

    def track(self, way: Way, *, everything: bool = False) -> None:
        """Follow the selected tracks (or all that are free) from the frame of the desk."""
        document, plate = self.desk.document, shown_plate(self.desk.document)
        if plate is None:
            raise UserError("There is no plate to track; open one from the File menu, or drop its folder here.")
        self._one_at_a_time()
        given = document.tracks if everything else selected_tracks(document)
        tracks = [t for t in given if t.plate_id == plate.id and not (everything and (t.locked or t.hidden))]
        if not tracks:
            raise UserError("No track is selected; click one, or place one with Track point.")
        locked = next((t.name for t in tracks if t.locked), None)
        if locked is not None:
            raise UserError(f"Track {locked} is locked; unlock it first.")
        frame = round(self.desk.workspace.frame) - plate.offset
        stretches = self._stretches(tracks, frame, way, plate, everything)
        settings = tracks[-1].settings or TrackSettings()

        def done(found: tuple[Track, ...]) -> None:
            self._forget()
            now = {t.id: t for t in self.desk.session.history.current.tracks}
            by_id = {t.id: t for t in found}
            ready = tuple(
                with_found(now[i], by_id[i], s.made) for i, s in stretches.items() if i in now and i in by_id)
            if ready and self.desk.edit(STEPS[way], put_tracks, ready) and way in ("next", "previous"):
                self.desk.set_workspace(frame=self.desk.workspace.frame + (1.0 if way == "next" else -1.0))
            still = [t.name for t in ready if len(t.frames) <= len(t.keys)]
            if still:
                words = NOT_FOLLOWED.format(", ".join(still))
                self.desk.said.emit(f"{words[0].upper()}{words[1:]}.")

        self._start(STEPS[way], plate, tuple(stretches.values()), settings, 0, done)

    def find(self, count: int) -> None:
        """Find so many features by themselves and follow them through the plate."""
        plate = shown_plate(self.desk.document)
        if plate is None:
            raise UserError("There is no plate to track; open one from the File menu, or drop its folder here.")
        self._one_at_a_time()

        def done(found: tuple[Track, ...]) -> None:
            self._forget()
            if not found:
                self.desk.said.emit("No features were found; even out the contrast of a dark plate, or use less grain.")
                return
            if self.desk.edit("Automatic features", add_tracks, found, plate.id):
                self.desk.said.emit(f"{len(found)} tracks were made by themselves.")

        self._start("Automatic features", plate, (), TrackSettings(), count, done)

    def fill_gaps(self) -> None:
        """Fill the gaps of the selected tracks by optical flow, on another thread."""
        plate = shown_plate(self.desk.document)
        tracks = tuple(t for t in selected_tracks(self.desk.document) if plate is not None and t.plate_id == plate.id)
        if plate is None or not tracks:
            raise UserError("No track is selected; click one, or place one with Track point.")
        if any(t.locked for t in tracks):
            raise UserError(f"Track {next(t.name for t in tracks if t.locked)} is locked; unlock it first.")
        if not any(gaps_of(t) for t in tracks):
            raise UserError("The selected tracks have no gaps: they are seen on all frames between their ends.")
        self._one_at_a_time()
        self._forget()

        def done(found: tuple[Track, ...]) -> None:
            now = {t.id: t for t in self.desk.session.history.current.tracks}
            old = {t.id: t for t in tracks}
            ready = tuple(t for t in found if now.get(t.id) is old[t.id] and t is not old[t.id])
            if ready:
                self.desk.edit("Fill gaps", put_tracks, ready)
            else:
                self.desk.said.emit("Flow reached none of the gaps: frames are missing there.")

        work = self._work(plate)
        self._begin("Fill gaps", lambda progress, cancelled: work.fill(tracks, progress, cancelled), done)

    def track_planes(self) -> None:
        """Follow every plane of the plate that is not locked or hidden through the plate."""
        document, plate = self.desk.document, shown_plate(self.desk.document)
        planes = tuple(p for p in document.planes if plate is not None and p.plate_id == plate.id
                       and not (p.locked or p.hidden))
        if plate is None or not planes:
            raise UserError("There is no plane to track; draw one with Track plane.")
        self._one_at_a_time()

        def done(found: tuple[PlaneTrack, ...]) -> None:
            self._forget()
            self.desk.edit("Track planes", put_planes, found)

        work = self._work(plate)
        self._begin("Track planes", lambda progress, cancelled: work.follow_planes(planes, progress, cancelled), done)

    def _stretches(
        self, tracks: list[Track], frame: int, way: Way, plate: Plate, lenient: bool
    ) -> dict[int, Stretch]:
        found: dict[int, Stretch] = {}
        trouble: UserError | None = None
        for track in tracks:
            try:
                found[track.id] = stretch_of(track, frame, way, plate.frames)
            except UserError as error:
                trouble = trouble or error
        if trouble is not None and not (lenient and found):
            raise trouble
        return found

    def _start(
        self, name: str, plate: Plate, tasks: tuple[Stretch, ...], settings: TrackSettings, auto: int, done: Any
    ) -> None:
        work = self._work(plate)
        steps: deque[Step] = deque()
        self._forget()
        self._steps = steps
        self._begin(
            name, lambda progress, cancelled: work.run(tasks, settings, auto, steps, progress, cancelled), done)

    def _work(self, plate: Plate) -> Work:
        masks = tuple(m for m in self.desk.document.masks if m.plate_id == plate.id)
        return Work(plate, self._screen.reel(plate), masks)

    def _begin(self, name: str, function: Callable[[Progress, Asked], Any], done: Callable[[Any], None]) -> None:
        def failed(error: Exception) -> None:
            self._forget()
            if isinstance(error, Cancelled):
                self.desk.said.emit(f"{name}: cancelled; the tracks are as before.")
            else:
                self.desk.error(error)

        self.job = self.desk.jobs.start(name, function, done, failed, self)

    def _one_at_a_time(self) -> None:
        if self.running:
            raise UserError("Tracks are being made; wait for them, or cancel that first.")

    def _listen(self) -> None:
        if not self._steps:
            return
        while self._steps:
            step = self._steps.popleft()
            for number, point in zip(step.tracks, step.points, strict=True):
                self._tails.setdefault(int(number), []).append((step.frame, point))
        if not self._show.isActive():
            self._show.start()

    def _forget(self) -> None:
        shown = bool(self._tails)
        self._steps, self._tails = deque(), {}
        self._show.stop()
        if shown:
            self.made.emit()


def _stopped_by(cancelled: Asked) -> Callable[[int, Callable[[int, int], object], int], None]:
    """Ranges one after the other as the tracker asks for them, and none any more once the job was cancelled."""

    def ranges(count: int, call: Callable[[int, int], object], grain: int = 2048) -> None:
        for start in range(0, count, max(grain, 1)):
            if cancelled():
                raise Cancelled
            call(start, min(start + grain, count))

    return ranges
