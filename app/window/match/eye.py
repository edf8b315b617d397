"""How the artist looks at a plate: which part of it, how large, and whether it is held still at a track."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from app.window.desk import Desk
from core.camera import Camera
from core.image.plate import Plate
from core.image.plate_view import plate_camera, plate_points, whole_plate
from tools.match_edits import place_at, selected_tracks, shown_plate

Array = NDArray[np.float64]


class PlateEye:
    """The view of the plate that is shown. A plate that was not moved yet is seen whole.

    still : id of the track the picture is held still at, or None.
    """

    def __init__(self, desk: Desk, size: Callable[[], tuple[int, int]], changed: Callable[[], object]) -> None:
        self.desk, self.size, self.changed = desk, size, changed
        self.still: int | None = None
        self._cameras: dict[int, Camera] = {}

    @property
    def plate(self) -> Plate | None:
        """The plate in view; None in another craft or without plates."""
        return shown_plate(self.desk.document) if self.desk.session.tool.craft == "match" else None

    @property
    def shown(self) -> bool:
        """True while a plate is looked at."""
        return self.plate is not None

    @property
    def frame(self) -> int:
        """The frame of the desk as the files of the plate count."""
        plate = self.plate
        return round(self.desk.workspace.frame) - (0 if plate is None else plate.offset)

    @property
    def camera(self) -> Camera:
        """The camera over the plate."""
        plate = self.plate
        assert plate is not None
        camera = self._cameras.get(plate.id)
        if camera is None:
            camera = whole_plate(plate, *self.size())
        x, y = self._held_by()
        return plate_camera(camera.position[0] + x, camera.position[1] + y, camera.height)

    def look(self, camera: Camera) -> None:
        """See another part of the plate."""
        plate = self.plate
        assert plate is not None
        x, y = self._held_by()
        self._cameras[plate.id] = plate_camera(camera.position[0] - x, camera.position[1] - y, camera.height)
        self.changed()

    def forget(self) -> None:
        """Every plate is seen whole again."""
        self.still = None
        self._cameras.clear()

    def look_at(self, place: Array) -> None:
        """Bring a place (2,) of the plate to the middle."""
        plate = self.plate
        if plate is not None:
            self.look(plate_camera(place[0] * plate.pixel_aspect, -place[1], self.camera.height))

    def find_active(self) -> None:
        """Bring the active track to the middle."""
        tracks = selected_tracks(self.desk.document)
        place = place_at(tracks[-1], self.frame) if tracks else None
        if place is None:
            self.fit()
        else:
            self.look_at(place)

    def fit(self) -> None:
        """See all of the plate."""
        if (plate := self.plate) is not None:
            self._cameras.pop(plate.id, None)
            self.changed()

    def natural(self) -> None:
        """One pixel of the plate on one of the screen."""
        if self.plate is not None:
            x, y, _ = self.camera.position
            self.look(plate_camera(x, y, float(self.size()[1])))

    def hold_still(self, track_id: int | None) -> None:
        """Hold the picture still at a track; None lets it move again. What is in view stays in view."""
        if self.plate is not None:
            camera = self.camera
            self.still = track_id
            self.look(camera)

    def under(self, x: float, y: float) -> Array:
        """The point (3,) of the plate's world under a pixel."""
        plate = self.plate
        assert plate is not None
        u, v = plate_points(self.camera, plate.pixel_aspect, (x, y), *self.size())[0]
        return np.array([u * plate.pixel_aspect, -v, 0.0])

    def _held_by(self) -> tuple[float, float]:
        """How far the picture is moved so that a track stays where it first is."""
        track = next((t for t in self.desk.document.tracks if t.id == self.still), None)
        plate = self.plate
        if track is None or plate is None or track.plate_id != plate.id or not len(track.frames):
            return 0.0, 0.0
        # where the track is not seen the picture goes on evenly from one place to the next, and rests beyond them
        x, y = (np.interp(self.frame, track.frames, along) - along[0] for along in track.points.T)
        return float(x) * plate.pixel_aspect, -float(y)
