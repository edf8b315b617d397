"""Pick point: a click picks a point of the model in a photograph, a drag moves a pick and all follows."""

from __future__ import annotations

from typing import Annotated

from core.document import free_id
from core.field import field
from core.match.photomodel.records import ModelPoint
from core.overlay import Overlays
from tools.ground import Pointer
from tools.match.craft import Marks, MatchGround
from tools.match.picks import MovePick, PickParams, added, inside, model_here, pick_near, ring_about
from tools.match_edits import selected_with
from tools.photomodel_edits import active_point, with_model
from tools.tool import Stroke, Tool, Turn


class PointPickParams(PickParams):
    """Settings of Pick point."""

    adds: Annotated[bool, field(
        "Add to selection", "A click on a pick takes its point in hand beside the others, or lets it go.")] = False
    new: Annotated[bool, field(
        "New point", "A click picks a new point, even where the one in hand is not picked in this photograph.")] = False


class SelectPoint:
    """A click on a pick that adds its point to those in hand."""

    def __init__(self, ground: MatchGround, marks: Marks) -> None:
        self.ground, self.marks = ground, marks

    @property
    def step(self) -> str | None:
        """What the stroke is."""
        return "Select points"

    def extend(self, matter: Marks, pointers: tuple[Pointer, ...]) -> Marks:
        """The marks with the selection."""
        return self.marks

    def finish(self, matter: Marks) -> Marks:
        """As they are."""
        return self.marks

    def overlays(self) -> Overlays:
        """Nothing: the marks themselves are drawn."""
        return ()


class PickPoint(Tool[PointPickParams]):
    """Picks points of a model."""

    name = "pick_point"
    label = "Pick point"
    icon = "pick-point"
    order = 217
    tooltip = "Picks a corner in photographs of one thing; a point in hand is picked in the next photograph too."
    hint = "Click: pick the point in hand, or a new one   Drag: move a pick   Shift: add   Ctrl: a tenth as far"
    step = "Pick point"
    craft = "match"
    edits = "marks"
    with_shift = Turn("pick_point", {"adds": True})
    with_ctrl = Turn("pick_point", {"speed": 0.1})
    Params = PointPickParams

    def begin(self, ground: MatchGround, pointer: Pointer) -> Stroke[Marks]:
        """A pick in the hand: one that is there, that of the point in hand, or that of a new point."""
        model, photo = model_here(ground)
        near = pick_near(ground, pointer, "points")
        if near is not None:
            if self.params.adds:
                chosen = model.replace(selection=selected_with(model.selection, near.id))
                models = with_model(ground.marks.photomodels, chosen)
                return SelectPoint(ground, ground.marks._replace(photomodels=models))
            return MovePick(self.params, ground, pointer, model.replace(selection=(near.id,)), near, new=False)
        place = inside(ground, pointer)
        active = active_point(model)
        if active is None or self.params.new or photo.id in model.points[active].picks.photo:
            number = free_id(model.points)
            model = model.replace(points=(*model.points, ModelPoint(id=number, name=f"point_{number:02d}")))
            active = len(model.points) - 1
        id_ = model.points[active].id
        model, held = added(model.replace(selection=(id_,)), "points", id_, photo, place)
        return MovePick(self.params, ground, pointer, model, held, new=True)

    def hover(self, ground: MatchGround, pointer: Pointer) -> Overlays:
        """The pick that a press would take hold of."""
        return ring_about(ground, pointer, "points")
