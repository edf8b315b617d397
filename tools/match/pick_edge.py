"""Pick edge: clicks anywhere along a straight edge between two points of the model."""

from __future__ import annotations

from core.errors import UserError
from core.overlay import Overlays
from tools.ground import Pointer
from tools.match.craft import Marks, MatchGround
from tools.match.picks import MovePick, PickParams, added, inside, model_here, pick_near, ring_about
from tools.photomodel_edits import points_in_hand, with_line
from tools.tool import Stroke, Tool, Turn


class EdgePickParams(PickParams):
    """Settings of Pick edge."""


class PickEdge(Tool[EdgePickParams]):
    """Picks along edges."""

    name = "pick_edge"
    label = "Pick edge"
    icon = "pick-edge"
    order = 218
    tooltip = "Picks anywhere along the straight edge between the two points in hand, where no corner can be seen."
    hint = "Click: pick along the edge of the two points in hand   Drag: move a pick   Ctrl: a tenth as far"
    step = "Pick edge"
    craft = "match"
    edits = "marks"
    with_ctrl = Turn("pick_edge", {"speed": 0.1})
    Params = EdgePickParams

    def begin(self, ground: MatchGround, pointer: Pointer) -> Stroke[Marks]:
        """A pick in the hand."""
        model, photo = model_here(ground)
        near = pick_near(ground, pointer, "lines")
        if near is not None:
            return MovePick(self.params, ground, pointer, model, near, new=False)
        ends = points_in_hand(model)
        if len(ends) != 2:
            raise UserError("Select the two ends of the edge with Pick point first; Shift adds the second.")
        model, line = with_line(model, (ends[0], ends[1]))
        model, held = added(model, "lines", line.id, photo, inside(ground, pointer))
        return MovePick(self.params, ground, pointer, model, held, new=True)

    def hover(self, ground: MatchGround, pointer: Pointer) -> Overlays:
        """The pick that a press would take hold of."""
        return ring_about(ground, pointer, "lines")
