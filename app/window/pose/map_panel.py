"""The map of pose space beside the model: sculpts in a plane, how far each reaches, and the pose that is held as a dot.

The dot is dragged and the model follows. Behind it the weight of one sculpt is painted, computed in a job.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PySide6.QtWidgets import QVBoxLayout, QWidget

from app.window.desk import Desk
from app.window.fields.choice_bar import ChoiceBar
from app.window.pose.map_canvas import Chart, MapCanvas, chart_of
from app.window.sections import Row
from core.document import Document, MeshObject
from core.errors import UserError
from core.field import Field
from core.pose.pose import REST, Pose
from core.pose.pose_map import (
    Axis,
    at,
    axes_of,
    mixed_pose,
    placed_among,
    places,
    shares_near,
    weight_grid,
)
from core.pose.pose_space import PoseLayer
from core.pose.rig import control_names
from core.pose.synthesis import pose_at
from core.workspace import Workspace
from tools.pose_edits import hold_pose, same_pose

ALL = "all poses (by distance)"
GRID = 40  # cells of the painted weights on a side
AT_ONCE = 8  # sculpts: a map of more is laid out by a job
_LAYER = Field("Layer", "Which layer of sculpts the map shows; each has a pose space of its own.")
_ACROSS = Field("Across", "What the map shows from left to right: one axis of a control, or all poses by distance.")
_UP = Field("Up", "What the map shows from the bottom to the top: another axis of a control.")
_HEAT = Field("Weight of", "Whose weight is painted behind the map; a bright place feels that sculpt most.")


class PoseMap(QWidget):
    """The map with what it shows, for the mesh that is posed."""

    def __init__(self, desk: Desk, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.desk = desk
        self.canvas = MapCanvas()
        self.layer, self.across, self.up, self.heat = (
            ChoiceBar(known, "", None, ("",)) for known in (_LAYER, _ACROSS, _UP, _HEAT))
        column = QVBoxLayout(self)
        column.setContentsMargins(8, 8, 8, 4)
        column.setSpacing(4)
        self.rows = {bar: Row(bar.known.label, bar) for bar in (self.layer, self.across, self.up, self.heat)}
        for bar, row in self.rows.items():
            column.addWidget(row)
            bar.edited.connect(lambda value, final, bar=bar: self._chosen(bar))
        column.addWidget(self.canvas, 1)
        self._shown: tuple[object, ...] = ()
        self._asked: tuple[object, ...] = ()
        self._axes: dict[str, Axis] = {}
        self.canvas.moved.connect(self._moved)
        self.canvas.picked.connect(self._picked)
        desk.changed.connect(self._document_changed)
        desk.workspace_changed.connect(self._workspace_changed)
        desk.session_replaced.connect(self.refresh)
        desk.stroke_ended.connect(self.refresh)
        self.refresh()

    # -- what is shown -----------------------------------------------------------------------------------

    @property
    def item(self) -> MeshObject | None:
        """The mesh that is posed."""
        return self.desk.posed

    def pose(self) -> Pose:
        """The pose that is shown: held, or of the clip."""
        item = self.item
        if item is None or item.rig is None:
            return REST
        return item.pose if item.pose is not None else pose_at(item.rig, self.desk.workspace.frame)

    def refresh(self) -> None:
        """Show what is on the desk now."""
        if self.desk.session.stroking or not self.isVisible():
            return
        item = self.item
        layers = () if item is None or item.correctives is None else item.correctives.layers
        layer = self._layer(layers)
        if layer is None or not layer.space.samples:
            self.canvas.chart, self._shown = None, ()
            self.canvas.words = ("Open a rig: USD, glTF or a project with joints, and its poses are laid out here."
                                 if item is None else
                                 "No sculpts yet. Pose the rig with the sliders, sculpt with a brush, and the pose "
                                 "appears here with its falloff.")
            for row in self.rows.values():
                row.hide()
            self.canvas.update()
            return
        key = item.id if item is not None else 0, layer.name, layer.space
        if self._shown[:3] != key:
            self._take(layer, key)
        self._place_dot()
        self._paint_heat()

    def _layer(self, layers: tuple[PoseLayer, ...]) -> PoseLayer | None:
        wanted = next((layer for layer in layers if layer.name == self.layer.value()), None)
        return wanted or (layers[0] if layers else None)

    def _take(self, layer: PoseLayer, key: tuple[object, ...]) -> None:
        item = self.item
        assert item is not None
        assert item.correctives is not None
        known = axes_of(layer.space, () if item.rig is None else control_names(item.rig))  # as the pad has its dials
        self._axes = {axis.name: axis for axis in known}
        names = tuple(self._axes)
        two = len(names) > 1
        same_layer = self._shown[1:2] == (layer.name,)
        across = self.across.value() if same_layer and self.across.value() in (*names, ALL) else names[0]
        up = self.up.value() if same_layer and self.up.value() in names else names[1] if two else names[0]
        if across == up and two:
            up = next(name for name in names if name != across)
        if not two:
            across = ALL
        _offer(self.layer, [one.name for one in item.correctives.layers], layer.name)
        _offer(self.across, [*(names if two else ()), ALL], across)
        _offer(self.up, names, up)
        samples = [s.name for s in layer.space.samples]
        _offer(self.heat, [*samples, "nothing"], self.heat.value() if self.heat.value() in samples else samples[0])
        for bar, row in self.rows.items():
            row.setVisible(bar is not self.up or across != ALL)
        self._shown = key
        axes = None if across == ALL else (self._axes[across], self._axes[up])
        self.canvas.chart = self.canvas.chosen = None
        self._asked = ()
        self.canvas.set_heat(None)
        space = layer.space
        if len(space.samples) <= AT_ONCE:
            self.canvas.chart = chart_of(space, axes)
            return
        self.canvas.words = "Laying out the poses\N{HORIZONTAL ELLIPSIS}"

        def done(chart: Chart) -> None:
            if self._shown is key:
                self.canvas.chart = chart
                self.refresh()

        self.desk.jobs.start("Laying out the map of poses", lambda progress, cancelled: chart_of(space, axes), done,
                             None, self)

    def _place_dot(self) -> None:
        chart, pose = self.canvas.chart, self.pose()
        if chart is None:
            return
        self.canvas.dot = placed_among(chart.space, chart.spots, pose) if chart.axes is None else \
            places(chart.axes, [pose])[0]
        named = [k + 1 for k, s in enumerate(chart.space.samples) if same_pose(s.pose, pose)]
        self.canvas.chosen = named[0] if named else None
        self.canvas.update()

    def _paint_heat(self) -> None:
        """Ask for the weights of the chosen sculpt over the plane, when they are other ones than are shown."""
        chart, wanted = self.canvas.chart, self.heat.value()
        names = [] if chart is None else [s.name for s in chart.space.samples]
        if chart is None or chart.axes is None or wanted not in names:
            self._asked = ()
            self.canvas.set_heat(None)
            return
        axes, pose, space = chart.axes, at(chart.axes, self.pose(), (0.0, 0.0)), chart.space
        asked = (space, wanted, axes[0].name, axes[1].name, _rounded(pose))
        if asked == self._asked:
            return
        self._asked = asked
        xs, ys = (np.linspace(low, high, GRID) for low, high in zip(chart.low, chart.high, strict=True))

        def done(found: NDArray[np.float32]) -> None:
            if self._asked == asked:
                self.canvas.set_heat(found[..., names.index(wanted)])

        def failed(error: Exception) -> None:
            if not isinstance(error, UserError):
                self.desk.error(error)
            self.canvas.set_heat(None)

        self.desk.jobs.start(
            "Painting the map of poses", lambda progress, cancelled: weight_grid(space, axes, pose, xs, ys), done,
            failed, self)

    # -- what the hand does ------------------------------------------------------------------------------

    def pose_of(self, place: tuple[float, float]) -> Pose:
        """The pose at a place of the map."""
        chart = self.canvas.chart
        assert chart is not None
        if chart.axes is not None:
            return at(chart.axes, self.pose(), place).replace(name="held")
        poses = [REST, *(s.pose for s in chart.space.samples)]
        return mixed_pose(poses, shares_near(chart.spots, place), "held")

    def _moved(self, x: float, y: float, final: bool) -> None:
        item, session = self.item, self.desk.session
        if item is None or self.canvas.chart is None:
            return
        pose = self.pose_of((x, y))
        if final:
            self.desk.edit("Pose", hold_pose, item.id, pose)
            self.refresh()
        else:
            self.desk.attempt(lambda: session.preview(hold_pose(session.document, item.id, pose)))

    def _picked(self, k: int) -> None:
        item, chart = self.item, self.canvas.chart
        if item is not None and chart is not None:
            pose = REST if k == 0 else chart.space.samples[k - 1].pose
            self.desk.edit("Pose", hold_pose, item.id, pose)
            if k:
                self.heat.set_value(chart.space.samples[k - 1].name)
            self.refresh()

    def _chosen(self, bar: ChoiceBar) -> None:
        if bar is not self.heat:
            self._shown = self._shown[:2] if bar is not self.layer else ()
        self.refresh()

    # -- what changes ------------------------------------------------------------------------------------

    def showEvent(self, event: object) -> None:
        super().showEvent(event)  # type: ignore[arg-type]
        self.refresh()

    def _document_changed(self, old: Document, new: Document) -> None:
        if old.meshes is not new.meshes and not self.canvas._dragged:
            self.refresh()

    def _workspace_changed(self, old: Workspace, new: Workspace) -> None:
        if old.frame != new.frame or old.mesh != new.mesh or old.craft != new.craft:
            self.refresh()


def _offer(bar: ChoiceBar, names: list[str] | tuple[str, ...], chosen: str) -> None:
    bar.set_choices(tuple(names), tuple(names))
    bar.set_value(chosen)


def _rounded(pose: Pose) -> tuple[object, ...]:
    return (
        tuple((k, *np.round(v, 6)) for k, v in sorted(pose.rotations.items())),
        tuple((k, *np.round(v, 6)) for k, v in sorted(pose.translations.items())),
        tuple((k, round(v, 6)) for k, v in sorted(pose.numbers.items())))
