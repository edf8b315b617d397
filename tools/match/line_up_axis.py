"""Line-up: edges drawn along the axes of the world give a single photograph its camera at once."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np

from core.document import free_id
from core.errors import UserError
from core.field import field
from core.match.photomodel.records import Known, ModelPoint, Photo, Photomodel, picked
from core.overlay import Overlays, Polyline, Tone
from core.record import Record
from tools.ground import Pointer
from tools.match.craft import Array, Marks, MatchGround
from tools.match.picks import inside, model_here
from tools.photomodel_edits import with_model
from tools.tool import Stroke, Tool, Turn

SHORTEST = 12.0  # pixels of the view
AXES: dict[str, tuple[int, tuple[float, float, float]]] = {
    "x": (0, (1.0, 0.0, 0.0)), "y": (1, (0.0, 1.0, 0.0)), "z": (2, (0.0, 0.0, 1.0))}
TONES: tuple[Tone, ...] = ("x", "y", "z")


class AxisParams(Record):
    """Settings of Line-up."""

    axis: Annotated[Literal["x", "y", "z"], field(
        "Axis", "The direction of the world that the edge has; y is up.", choices=("x", "y", "z"))] = "x"
    height: Annotated[float, field(
        "Camera height", "How high the camera stood above the ground, which says how large all is.", "m",
        (0.2, 10.0), (0.01, 10000.0), step=0.1)] = 1.6


class DrawEdge:
    """An edge from the press to the hand."""

    def __init__(self, params: AxisParams, ground: MatchGround, pointer: Pointer) -> None:
        self.params, self.ground = params, ground
        self.model, self.photo = model_here(ground)
        other = next((one for one in self.model.photos if one.rotation is not None and one.id != self.photo.id), None)
        if other is not None:
            raise UserError(f"{other.name} has its camera; say where the world is with Model x axis and Model ground.")
        self.start = self.end = inside(ground, pointer)

    def extend(self, matter: Marks, pointers: tuple[Pointer, ...]) -> Marks:
        """The camera as it would be with the edge, where one can be found."""
        self.end = self.ground.place(pointers[-1])
        if not self._long:
            return self.ground.marks
        try:
            return self._marks()
        except UserError:  # on the way of the hand; it is told at the release
            return self.ground.marks

    def finish(self, matter: Marks) -> Marks:
        """The edge as two points that are known to lie along the axis, and the camera they give."""
        if not self._long:
            raise UserError("Draw the edge longer, from one end of it to the other.")
        return self._marks()

    def overlays(self) -> Overlays:
        """The edge."""
        ends = np.array([self.start, self.end])
        return (Polyline(self.ground.in_view(ends), TONES[AXES[self.params.axis][0]], 2.5),)

    @property
    def _long(self) -> bool:
        return float(np.linalg.norm(self.end - self.start)) * self.ground.scale >= SHORTEST

    def _marks(self) -> Marks:
        from core.match.photomodel.vanish import lined_up  # the solver, which is large

        drawn = with_edge(self.model, self.photo, self.start, self.end, self.params.axis)
        changed = with_model(self.ground.marks.photomodels, lined_up(drawn, self.params.height))
        return self.ground.marks._replace(photomodels=changed)


def with_edge(model: Photomodel, photo: Photo, start: Array, end: Array, axis: str) -> Photomodel:
    """The model with two more points, picked in a photograph and known to lie along an axis."""
    first = free_id(model.points)
    made = tuple(
        ModelPoint(id=first + k, name=f"point_{first + k:02d}", picks=picked([photo.id], [(float(x), float(y))]))
        for k, (x, y) in enumerate((start, end)))
    known = Known(kind="axis", points=(first, first + 1), value=AXES[axis][1])
    return model.replace(points=(*model.points, *made), known=(*model.known, known))


class LineUpAxis(Tool[AxisParams]):
    """Gives a single photograph its camera."""

    name = "line_up_axis"
    label = "Line-up"
    icon = "axes"
    order = 220
    tooltip = "Gives one photograph its camera from edges drawn along the axes: two along x and two along y or z."
    hint = "Drag: draw an edge along x   Shift: along z   Ctrl: along y, which is up"
    step = "Line-up"
    craft = "match"
    edits = "marks"
    with_shift = Turn("line_up_axis", {"axis": "z"})
    with_ctrl = Turn("line_up_axis", {"axis": "y"})
    Params = AxisParams

    def begin(self, ground: MatchGround, pointer: Pointer) -> Stroke[Marks]:
        """An edge that is drawn."""
        return DrawEdge(self.params, ground, pointer)
