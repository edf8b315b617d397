"""What stands beside the model in the craft of posing: the map, and below it a graph of a way or of the clip."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QSplitter, QVBoxLayout, QWidget

from app.window.desk import Desk
from app.window.fields.choice_bar import ChoiceBar
from app.window.pose.graph import Graph, Line
from app.window.pose.look import PoseLook
from app.window.pose.map_panel import PoseMap
from app.window.pose.talk import TalkTable
from app.window.sections import Row
from app.window.theme import look_of
from core.document import Document, MeshObject
from core.errors import UserError
from core.field import Field
from core.pose.edit_layers import cross_talk
from core.pose.pose import REST, Pose
from core.pose.pose_path import Motion, clip_weights, most_moved, walk
from core.pose.pose_space import PoseSample
from core.workspace import Workspace
from tools.pose_edits import hold_pose

LOW = 480  # pixels of height below which the map stands alone
NARROW = 760  # pixels of the middle below which map and model stand one over the other
MOST_FRAMES = 240  # of the graph of a clip
CLIP, WALK, TALK = "clip", "walk", "talk"
_GRAPH = Field("Graph", "What is plotted: weights of sculpts over the clip, how a point moves on a way, or who "
               "disturbs whom among the sculpts.")
_FROM = Field("From", "Where the way through pose space begins: at rest or at a sculpt.")
_TO = Field("To", "Where the way ends: the surface point this sculpt moves most is followed.")


class PoseSide(QWidget):
    """What the view shows, the map, and the graph."""

    def __init__(self, desk: Desk, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.desk = desk
        self.setMinimumWidth(200)
        self.look = PoseLook(desk)
        self.map = PoseMap(desk)
        self.graph = Graph()
        self.kind = ChoiceBar(
            _GRAPH, CLIP, CLIP, (CLIP, WALK, TALK), ("weights over the clip", "walk to a pose", "cross-talk"))
        self.talk = TalkTable()
        self.talk.picked.connect(self._picked)
        self.start, self.end = ChoiceBar(_FROM, "rest", "rest", ("rest",)), ChoiceBar(_TO, "", None, ("",))
        self.ways = [Row(_FROM.label, self.start), Row(_TO.label, self.end)]
        below = self._below = QWidget()
        column = QVBoxLayout(below)
        column.setContentsMargins(8, 4, 8, 8)
        column.setSpacing(4)
        for row in (Row(_GRAPH.label, self.kind), *self.ways):
            column.addWidget(row)
        column.addWidget(self.graph, 1)
        column.addWidget(self.talk, 1)
        self.parts = QSplitter(Qt.Orientation.Vertical)
        self.parts.setChildrenCollapsible(False)
        self.parts.setHandleWidth(look_of().grid)
        self.parts.addWidget(self.map)
        self.parts.addWidget(below)
        self.parts.setStretchFactor(0, 3)
        self.parts.setStretchFactor(1, 1)
        whole = QVBoxLayout(self)
        whole.setContentsMargins(0, 0, 0, 0)
        whole.setSpacing(0)
        whole.addWidget(self.look)
        whole.addWidget(self.parts, 1)
        self._seen: tuple[object, ...] = ()
        for bar in (self.kind, self.start, self.end):
            bar.edited.connect(lambda value, final: self.refresh())
        self.graph.pointed.connect(self._pointed)
        desk.changed.connect(self._document_changed)
        desk.workspace_changed.connect(self._workspace_changed)
        desk.session_replaced.connect(self.refresh)
        desk.stroke_ended.connect(self.refresh)

    def sizeHint(self) -> QSize:
        return QSize(33 * look_of().text, 400)

    def showEvent(self, event: object) -> None:
        super().showEvent(event)  # type: ignore[arg-type]
        self.refresh()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """The map comes first where there is little room."""
        super().resizeEvent(event)
        self._below.setVisible(self.height() >= LOW)
        self.refresh()

    def refresh(self) -> None:
        """Plot what is on the desk now; the work is a job."""
        item = self.desk.posed
        if self.desk.session.stroking or not self.isVisible() or self._below.isHidden():
            return
        samples, talks = _samples(item), self.kind.value() == TALK
        self.talk.setVisible(talks)
        self.graph.setVisible(not talks)
        for row in self.ways:
            row.setVisible(self.kind.value() == WALK and bool(samples))
        if item is None or item.rig is None or not samples or item.correctives is None:
            self._seen = ()
            self.graph.show_words("Sculpts have weights to plot here once there are some.")
            self.talk.show_words("Once there are sculpts, this table says which is felt at the poses of others.")
            return
        names = ["rest", *(s.name for s in samples)]
        self.start.set_choices(tuple(names), tuple(names))
        self.end.set_choices(tuple(names[1:]), tuple(names[1:]))
        if self.start.value() not in names:
            self.start.set_value("rest")
        if self.end.value() not in names[1:]:
            self.end.set_value(names[1])
        seen = (item.id, item.rig, item.correctives, self.kind.value(), self.start.value(), self.end.value())
        if len(seen) == len(self._seen) and all(a is b or (isinstance(a, str | int) and a == b)
                                                for a, b in zip(seen, self._seen, strict=True)):
            return
        self._seen = seen
        if talks:
            self._tabulate(item, seen)
        elif self.kind.value() == CLIP:
            self._plot_clip(item, seen)
        else:
            self._plot_walk(item, {s.name: s.pose for s in samples}, seen)

    def _tabulate(self, item: MeshObject, seen: tuple[object, ...]) -> None:
        rig, correctives, points = item.rig, item.correctives, item.mesh.points
        assert rig is not None
        assert correctives is not None

        def done(found: tuple[tuple[str, ...], np.ndarray]) -> None:
            if self._seen is seen:
                self.talk.show_table(*found)

        def failed(error: Exception) -> None:
            self.talk.show_words(str(error) if isinstance(error, UserError) else "The table could not be made.")

        self.desk.jobs.start(
            "Looking who disturbs whom", lambda progress, cancelled: cross_talk(points, rig, correctives), done,
            failed, self)

    def _picked(self, name: str) -> None:
        """Hold the pose of a row of the table."""
        item = self.desk.posed
        pose = next((s.pose for s in _samples(item) if s.name == name), None)
        if item is not None and pose is not None:
            self.desk.edit("Pose", hold_pose, item.id, pose)

    def _plot_clip(self, item: MeshObject, seen: tuple[object, ...]) -> None:
        rig, correctives, points = item.rig, item.correctives, item.mesh.points
        if rig is None or correctives is None or rig.clip is None:
            self.graph.show_words("This rig has no clip. Drop a BVH file on the window, or choose a walk to a pose.")
            return
        first, last = rig.clip.start, rig.clip.end
        frames = np.linspace(first, last, min(int(last - first) + 1, MOST_FRAMES))

        def done(found: tuple[tuple[str, ...], np.ndarray]) -> None:
            if self._seen is seen:
                lines = [Line(name, frames, found[1][:, k].astype(np.float64)) for k, name in enumerate(found[0])]
                self.graph.show_lines(lines, "frame", "weight", self.desk.workspace.frame)

        self.desk.jobs.start(
            "Plotting weights over the clip",
            lambda progress, cancelled: clip_weights(points, rig, correctives, frames, progress), done, None, self)

    def _plot_walk(self, item: MeshObject, poses: dict[str, Pose], seen: tuple[object, ...]) -> None:
        rig, correctives, points = item.rig, item.correctives, item.mesh.points
        assert rig is not None
        start, end = poses.get(self.start.value(), REST), poses[self.end.value()]
        vertex = most_moved(correctives, self.end.value())
        if vertex is None or start is end:
            self.graph.show_words("Choose a way between two poses, to a sculpt that moves something.")
            return
        vertices = np.array([vertex], np.int32)

        def done(found: Motion) -> None:
            if self._seen is not seen:
                return
            middle = 100.0 * 0.5 * (found.shares[1:] + found.shares[:-1])
            speed = 100.0 * found.speed[:, 0]
            marks = [(100.0 * float(found.shares[step]), "kink") for step in found.kinks[0]]
            self.graph.show_lines([Line(f"speed of vertex {vertex:,}", middle, speed)],
                                  "% of the way", "cm for the whole way", None, marks)

        def failed(error: Exception) -> None:
            self.graph.show_words(str(error) if isinstance(error, UserError) else "This way could not be walked.")

        self.desk.jobs.start(
            "Walking through pose space",
            lambda progress, cancelled: walk(points, rig, correctives, start, end, vertices, say=progress), done,
            failed, self)

    def _pointed(self, x: float) -> None:
        if self.kind.value() == CLIP and self._seen:
            self.desk.set_workspace(frame=float(round(x)))

    def _document_changed(self, old: Document, new: Document) -> None:
        if old.meshes is not new.meshes:
            self.refresh()

    def _workspace_changed(self, old: Workspace, new: Workspace) -> None:
        if old.mesh != new.mesh or old.craft != new.craft:
            self.refresh()
        if old.frame != new.frame and self.kind.value() == CLIP:
            self.graph.mark(new.frame)


class BesideView(QSplitter):
    """The view with what a craft shows beside it: to its right, or below it where the window is narrow."""

    def __init__(self, view: QWidget, side: QWidget) -> None:
        super().__init__(Qt.Orientation.Horizontal)
        self._side, self._laid = side, False
        self.setChildrenCollapsible(False)
        self.setHandleWidth(look_of().grid)
        self.addWidget(view)
        self.addWidget(side)
        self.setStretchFactor(0, 1)
        self.setStretchFactor(1, 0)
        self.setSizes([62, 38])

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Turn when there is no room side by side."""
        if event.oldSize().width() <= 0 or not self._laid:
            self._laid = self._side.isVisible()
            self.setSizes([62 * self.width() // 100, 38 * self.width() // 100])
        wanted = Qt.Orientation.Vertical if self.width() < NARROW else Qt.Orientation.Horizontal
        if wanted != self.orientation():
            self.setOrientation(wanted)
            self.setSizes([3 * self.height() // 5, 2 * self.height() // 5] if wanted == Qt.Orientation.Vertical
                          else [2 * self.width() // 3, self.width() // 3])
        super().resizeEvent(event)


def _samples(item: MeshObject | None) -> list[PoseSample]:
    layers = () if item is None or item.correctives is None else item.correctives.layers
    return [sample for layer in layers if layer.enabled for sample in layer.space.samples]
