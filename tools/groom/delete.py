"""Delete: hair under the ring goes."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from core.field import field
from core.groom.delete import delete
from core.groom.guides import Guides
from tools.brush import BrushStroke
from tools.groom.craft import GroomGround, nothing_to_do
from tools.ground import Pointer
from tools.ring import ReachParams
from tools.tool import Stroke, Tool


class DeleteParams(ReachParams):
    """Settings of Delete."""

    size: Annotated[float, field(
        "Size", "Radius of the ring, in pixels of the screen or along the skin.", "px", (4, 300), (1, 4000))] = 30.0
    roots_only: Annotated[bool, field(
        "Roots only", "Takes only hair that grows under the ring, not what hangs into it.")] = True


class Delete(Tool[DeleteParams]):
    """A brush that removes guides."""

    name = "delete"
    label = "Delete"
    icon = "delete"
    order = 80
    tooltip = "Deletes hair under the ring; frozen and sprayed hair stays where it is."
    hint = "Drag: delete"
    step = "Delete"
    Params = DeleteParams

    def begin(self, ground: GroomGround, pointer: Pointer) -> Stroke[Guides]:
        """A stroke that deletes."""
        if len(ground.guides) == 0:
            raise nothing_to_do()
        return DeleteStroke(self.params, ground)


class DeleteStroke(BrushStroke[DeleteParams]):
    """Deletes along the way."""

    def __init__(self, params: DeleteParams, ground: GroomGround) -> None:
        super().__init__(params, ground)
        self.only_selected = bool(ground.guides.selected.any())

    def brush(self, guides: Guides) -> Guides:
        """Guides without those under the ring."""
        if self.only_selected and not guides.selected.any():
            return guides  # all that was selected is gone: the rest is not free for that
        rows, _ = self.under(guides, roots_only=self.params.roots_only)
        mask = np.zeros(len(guides), np.bool_)
        mask[rows] = True
        return delete(guides, mask)
