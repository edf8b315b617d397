"""Pick circle: clicks along the outline of something round."""

from __future__ import annotations

from typing import Annotated

from core.field import field
from core.overlay import Overlays
from tools.ground import Pointer
from tools.match.craft import Marks, MatchGround
from tools.match.picks import MovePick, PickParams, added, inside, model_here, pick_near, ring_about
from tools.photomodel_edits import with_circle
from tools.tool import Stroke, Tool, Turn


class CirclePickParams(PickParams):
    """Settings of Pick circle."""

    new: Annotated[bool, field(
        "New circle", "The next click begins another circle instead of going on with the last one.")] = False


class PickCircle(Tool[CirclePickParams]):
    """Picks along circles."""

    name = "pick_circle"
    label = "Pick circle"
    icon = "pick-circle"
    order = 219
    tooltip = "Picks along the outline of something round: three clicks or more in each of two photographs or more."
    hint = "Click: pick along the last circle   Shift: a new circle   Drag: move a pick   Ctrl: a tenth as far"
    step = "Pick circle"
    craft = "match"
    edits = "marks"
    with_shift = Turn("pick_circle", {"new": True})
    with_ctrl = Turn("pick_circle", {"speed": 0.1})
    Params = CirclePickParams

    def begin(self, ground: MatchGround, pointer: Pointer) -> Stroke[Marks]:
        """A pick in the hand."""
        model, photo = model_here(ground)
        near = pick_near(ground, pointer, "circles")
        if near is not None:
            return MovePick(self.params, ground, pointer, model, near, new=False)
        last = None if self.params.new or not model.circles else model.circles[-1].id
        model, circle = with_circle(model, last)
        model, held = added(model, "circles", circle.id, photo, inside(ground, pointer))
        return MovePick(self.params, ground, pointer, model, held, new=True)

    def hover(self, ground: MatchGround, pointer: Pointer) -> Overlays:
        """The pick that a press would take hold of."""
        return ring_about(ground, pointer, "circles")
