"""What stands in the document, seen through the solved camera: drawn beside the work, kept for every frame."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.window.desk import Desk
from app.window.match.marks import Sheet
from core.image.plate import Plate
from core.image.plate_view import pixels_per_pixel
from core.match.solved import SolvedCamera
from core.match.through import Through, through_lens
from tools.solve_edits import solved_of
from viewport.through_lens import Bent

if TYPE_CHECKING:  # with kernels of coats, which a window starts without
    from app.window.live_picture import LivePicture

KEPT = 256 << 20  # bytes of pictures
COARSEST = 0.125  # pixels drawn for one of the plate


class Drawn(NamedTuple):
    """A picture (h, w, 4) uint8 of a frame, and the grid that brings it onto the plate; None where nothing is seen."""

    through: Through
    pixels: NDArray[np.uint8]


class SceneOver:
    """Pictures of the scene for frames of the plate in view. Everything runs on the thread of the window."""

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self._kept: OrderedDict[tuple[Any, ...], Drawn | None] = OrderedDict()
        self._held: tuple[Any, ...] = ()  # what the pictures are of; keeps the ids in their keys alive
        self._drawing: tuple[tuple[Any, ...], Iterator[Drawn | None]] | None = None
        self._key: tuple[Any, ...] | None = None

    @property
    def wanted(self) -> bool:
        """True while the picture of the frame in view is not drawn yet."""
        return self._key is not None and self._key not in self._kept

    def over(self, plate: Plate, sheet: Sheet) -> Bent | None:
        """What to draw over the frame of a sheet, as far as it is there. Never waits."""
        opacity = self._desk.workspace.view.over_plate
        solved = solved_of(self._desk.document, plate.id)
        self._key = None
        if solved is None or not opacity or not self._desk.document.meshes or sheet.frame not in solved.frames:
            return None
        density = pixels_per_pixel(sheet.camera, sheet.size[1])
        density = float(np.clip(2.0 ** np.ceil(np.log2(max(density, 1e-3))), COARSEST, 1.0))
        self._key = (*self._told(solved), sheet.frame, density)
        drawn = self._kept.get(self._key)
        if drawn is None:
            return None
        self._kept.move_to_end(self._key)
        through = drawn.through
        nodes = sheet.at(through.nodes.reshape(-1, 2)).reshape(through.nodes.shape) + 0.5
        return Bent(drawn.pixels, through.places, nodes, opacity)

    def rest(self, picture: LivePicture) -> bool:
        """One slice of the picture that is wanted, the context current; False when there is nothing to do now."""
        key = self._key
        if key is None or key in self._kept:
            self._drawing = None
            return False
        if self._drawing is None or self._drawing[0] != key:
            plate_id, frame, density = key[1], key[-2], key[-1]
            solved = solved_of(self._desk.document, plate_id)
            if solved is None:
                return False
            self._drawing = key, self.drawn(picture, solved, frame, density)
        try:
            found = next(self._drawing[1])
        except StopIteration:  # what it needs is still being made on another thread
            self._drawing = None
            return False
        if isinstance(found, Drawn) or found is not WAITING:
            self._keep(key, found)
            self._drawing = None
        return True

    def drawn(
        self, picture: LivePicture, solved: SolvedCamera, frame: int, density: float = 1.0
    ) -> Iterator[Any]:
        """Draw a frame, as the files count, in short slices; the last item is what was drawn, others are WAITING.

        It ends without that while hair or feathers are still being made.
        """
        through = through_lens(solved, frame, density)
        if through is None:
            yield None
            return
        plate = next(p for p in self._desk.document.plates if p.id == solved.plate_id)
        for part in picture.clear_picture(float(frame + plate.offset), through.camera, through.size):
            if isinstance(part, np.ndarray):
                yield Drawn(through, part)
                return
            if part is None:
                return
            yield WAITING

    def _told(self, solved: SolvedCamera) -> tuple[Any, ...]:
        """What a picture depends on, beside its frame."""
        document, view = self._desk.document, self._desk.workspace.view
        held = document.meshes, document.grooms, document.feathers, solved
        if len(held) != len(self._held) or any(a is not b for a, b in zip(held, self._held, strict=True)):
            self._held = held
            self._kept.clear()
        return (
            "of", solved.plate_id, view.shading, view.wire, view.hair, view.map, view.heat, view.isolated, view.ghosted)

    def _keep(self, key: tuple[Any, ...], drawn: Drawn | None) -> None:
        self._kept[key] = drawn
        size = sum(one.pixels.nbytes for one in self._kept.values() if one is not None)
        while size > KEPT and len(self._kept) > 1:
            _, old = self._kept.popitem(last=False)
            size -= 0 if old is None else old.pixels.nbytes


WAITING = object()  # a slice of drawing after which there is more to do
