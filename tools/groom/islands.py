"""Islands: all hair on the connected piece of skin that is clicked."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np

from core.field import field
from core.groom.guides import Guides
from core.groom.select import pieces, select
from core.mesh.surface import root_vertices
from core.overlay import Overlays
from core.record import Record
from tools.groom.craft import GroomGround, nothing_to_do
from tools.ground import Pointer
from tools.tool import Stroke, Tool, Turn


class IslandsParams(Record):
    """Settings of Islands."""

    mode: Annotated[Literal["replace", "add", "remove"], field(
        "Does", "A click selects anew, adds to what is selected, or takes away from it.",
        choices=("replace", "add", "remove"))] = "replace"


class Islands(Tool[IslandsParams]):
    """Selects by connected skin."""

    name = "islands"
    label = "Islands"
    icon = "group"
    order = 62
    tooltip = "Selects all hair on the piece of skin that you click: an ear, a horn, a brow."
    hint = "Click: select a piece of skin   Shift: add   Ctrl: remove"
    step = "Select an island"
    edits = "selection"
    with_shift = Turn("islands", {"mode": "add"})
    with_ctrl = Turn("islands", {"mode": "remove"})
    with_eraser = Turn("islands", {"mode": "remove"})
    Params = IslandsParams

    def begin(self, ground: GroomGround, pointer: Pointer) -> Stroke[Guides]:
        """A click."""
        if len(ground.guides) == 0:
            raise nothing_to_do()
        return IslandsStroke(self.params, ground)


class IslandsStroke:
    """Selects what the last sample was over, at release."""

    def __init__(self, params: IslandsParams, ground: GroomGround) -> None:
        self.params, self.ground = params, ground
        self.last: Pointer | None = None

    def extend(self, guides: Guides, pointers: tuple[Pointer, ...]) -> Guides:
        """The hand may still move to another piece."""
        self.last = pointers[-1]
        return guides

    def finish(self, guides: Guides) -> Guides:
        """Guides of the piece under the hand selected; of none, beside the animal."""
        ground, mode = self.ground, self.params.mode
        if mode == "replace" and ground.mirrored:
            mode = "add"
        hit = None if self.last is None else ground.hit(self.last)
        mask = np.zeros(len(guides), np.bool_)
        if hit is not None:
            of_vertex = ground.evaluator.get(pieces, ground.item.mesh)
            wanted = of_vertex[ground.skin.triangles.vertices[hit.triangle, 0]]
            mask = of_vertex[root_vertices(ground.item.mesh, guides.roots)[:, 0]] == wanted
        return select(guides, mask, mode)

    def overlays(self) -> Overlays:
        """Nothing is drawn."""
        return ()
