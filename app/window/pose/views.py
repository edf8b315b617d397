"""What the view shows of a rig: a field as colours on the posed mesh, and the methods side by side.

Computed as the picture is drawn where that is quick; else on a worker, and what was there before stays until it comes.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any, NamedTuple, TypeVar

import numpy as np
from PySide6.QtCore import QObject, Signal

from app.window.desk import Desk
from core.document import MeshObject
from core.errors import UserError
from core.evaluator import Evaluator
from core.mesh.edges import edge_vertices
from core.mesh.mesh import Mesh
from core.mesh.normals import mesh_normals
from core.mesh.skin import skin_at_rest
from core.pose.compare import LABELS, METHODS, Method, compared
from core.pose.heat import (
    VIEWS,
    Heat,
    Points,
    View,
    condition_heat,
    delta_heat,
    error_heat,
    mask_heat,
    shape_heat,
    shares_of,
    strain_heat,
    weight_heat,
)
from core.pose.pose import Pose
from core.pose.pose_space import Correctives
from core.pose.rig import Rig
from core.pose.synthesis import pose_at, prepare
from core.posed import shown_points
from core.record import freeze
from viewport.document_scene import painted_parts
from viewport.legend import Legend
from viewport.panes import Pane
from viewport.scene import Scene, Surface

Result = TypeVar("Result")
MANY = 20_000  # vertices: fields of larger meshes are computed on a worker
ONLY_SKIN: tuple[Method, ...] = ("skin",)  # looked at alone
# methods side by side, as they are offered
SIDES: dict[str, tuple[Method, ...]] = {
    "off": (), "SSD · PSD": ("skin", "pose-space"), "SI · PSD": ("interpolation", "pose-space"),
    "PSD · WPSD": ("pose-space", "weighted"),
    "SSD · SI · PSD · WPSD": ("skin", "interpolation", "pose-space", "weighted"),
}


class _Shown(NamedTuple):
    """The mesh by one method: its name, the scene and the place of its surface in it, and its field."""

    name: str
    scene: Scene
    surface: Surface
    heat: Heat | None


class PoseViews(QObject):
    """What is shown of the mesh that is posed. fresh : something that took long has come, look again."""

    fresh = Signal()

    def __init__(self, desk: Desk) -> None:
        super().__init__(desk)
        self.desk = desk
        self._last: dict[Hashable, Any] = {}
        self._running: set[Hashable] = set()
        self._failed: dict[Hashable, tuple[Any, ...]] = {}
        desk.session_replaced.connect(self._forget)

    @property
    def methods(self) -> tuple[Method, ...]:
        """The methods side by side, or the one that is looked at; none for the usual view."""
        item = self.desk.posed
        if self.desk.session.tool.craft != "pose" or item is None or item.hidden:
            return ()
        return tuple(m for m in METHODS if m in self.desk.workspace.view.compare)

    @property
    def heat(self) -> View | None:
        """What is shown as colours: as chosen, else what the tool in the hand paints."""
        if self.desk.session.tool.craft != "pose":
            return None
        chosen = self.desk.workspace.view.heat
        for kind in VIEWS:
            if kind == chosen:
                return kind
        paints: dict[str, View] = {"mask": "mask", "weights": "weight"}
        return paints.get(self.desk.session.tool.edits)

    def panes(self, scene: Scene) -> tuple[Pane, ...]:
        """The scene as it is shown: in one pane or in several, the posed mesh in its colours."""
        item, methods = self.desk.posed, self.methods
        if item is None or item.rig is None or (not methods and self.heat is None):
            return (Pane(scene),)
        evaluator = self.desk.session.evaluator
        triangles = skin_at_rest(item.mesh, evaluator).triangles
        feathered = evaluator.get(painted_parts, item.mesh, triangles.faces, triangles.vertices)[0][1]
        at = next((
            i for i, s in enumerate(scene.surfaces) if s.triangles is triangles.vertices or s.triangles is feathered
        ), None)
        if at is None:
            return (Pane(scene),)
        surface = scene.surfaces[at]
        if methods:
            shown = [self._by(method, scene, surface, item) for method in methods]
        else:
            shown = [_Shown("", scene, surface, self._field(item, surface.points, ""))]
        widest = max((one.heat for one in shown if one.heat is not None), key=lambda heat: heat.high, default=None)
        return tuple(self._pane(one, at, item, widest) for one in shown)

    def _pane(self, shown: _Shown, at: int, item: MeshObject, widest: Heat | None) -> Pane:
        """One pane; fields side by side have one range, so that their colours can be compared."""
        surface, heat, legend = shown.surface, shown.heat, None
        if widest is not None:
            legend = Legend(widest.title, widest.ticks, widest.signed)
        elif self.heat == "weight" and _joint(item) is None:
            legend = Legend("Pick a joint with Rotate first", ("0", "0.5", "1"))
        if heat is not None and widest is not None and len(heat.values) == len(surface.points):
            values = self.desk.session.evaluator.get(_shares, heat.values, low=widest.low, high=widest.high)
            surface = surface._replace(values=values, ramp="signed" if widest.signed else "heat")
        surfaces = shown.scene.surfaces
        scene = shown.scene._replace(surfaces=(*surfaces[:at], surface, *surfaces[at + 1 :]))
        return Pane(scene, shown.name, legend)

    def _by(self, method: Method, scene: Scene, surface: Surface, item: MeshObject) -> _Shown:
        """The mesh by a method, without hair, which follows the usual one."""
        evaluator, name, correctives = self.desk.session.evaluator, LABELS[method], None
        if method != "skin" and item.correctives is not None:
            key = "method", item.id, method
            correctives = self._found(
                key, True, f"Taking the sculpts as {name}", compared, item.mesh.points, item.rig, item.correctives,
                method=method)
            if correctives is None:
                correctives, name = item.correctives, f"{name} …"
        taken = item.replace(correctives=correctives)
        points = shown_points(taken, self.desk.workspace.frame, evaluator)
        normals = skin_at_rest(item.mesh, evaluator).normals if points is item.mesh.points else \
            evaluator.get(_normals, item.mesh, points)
        surface = surface._replace(points=points, normals=normals)
        return _Shown(name, scene._replace(coats=(), guides=()), surface, self._field(taken, points, method))

    def _field(self, item: MeshObject, shown: Points, method: str) -> Heat | None:
        """The field of a mesh posed at `shown`; None where there is none, or not yet."""
        kind, rig, evaluator = self.heat, item.rig, self.desk.session.evaluator
        if kind is None or rig is None:
            return None
        key, slow = (kind, item.id, method), len(item.mesh.points) > MANY
        words = f"Colours of the {kind} view"
        if kind == "mask":
            return evaluator.get(_mask, item.mesh, item.mask)
        if kind == "weight":
            joint = _joint(item)
            return None if joint is None else evaluator.get(_weight, rig, joint=joint)
        if kind == "strain":
            return self._found(key, slow, words, _strain, item.mesh, shown, evaluator=evaluator)
        if kind == "shape":
            plain = shown_points(item.replace(correctives=None, surface=None), self.desk.workspace.frame, evaluator)
            return self._found(key, slow, words, _shape, item.mesh, plain, shown)
        if kind == "error":
            sculpts = None if self.desk.posed is None else self.desk.posed.correctives
            return None if sculpts is None else self._found(
                key, True, words, _error, item.mesh, rig, sculpts, item.correctives)
        pose = item.pose if item.pose is not None else evaluator.get(pose_at, rig, frame=self.desk.workspace.frame)
        if kind == "delta":
            return self._found(key, slow, words, _delta, item.mesh, rig, item.correctives, pose, evaluator=evaluator)
        return self._found(key, slow, words, _condition, item.mesh, rig, pose)

    def _found(
        self, key: Hashable, slow: bool, words: str, function: Callable[..., Result], *inputs: Any, **params: Hashable
    ) -> Result | None:
        """A value made of immutable ones: at once where it is quick or known, else that before until a job has it."""
        evaluator = self.desk.session.evaluator
        if not slow or evaluator.knows(function, *inputs, **params):
            self._last[key] = evaluator.get(function, *inputs, **params)
        elif key not in self._running and not _same(self._failed.get(key), inputs):
            self._running.add(key)

            def done(found: object) -> None:
                self._running.discard(key)
                self.fresh.emit()

            def failed(error: Exception) -> None:
                self._running.discard(key)
                self._failed[key] = inputs
                if isinstance(error, UserError):
                    self.desk.said.emit(str(error))

            self.desk.jobs.start(
                words, lambda progress, cancelled: evaluator.get(function, *inputs, **params), done, failed, self)
        found: Result | None = self._last.get(key)
        return found

    def _forget(self) -> None:
        self._last.clear()
        self._running.clear()
        self._failed.clear()


def _joint(item: MeshObject) -> str | None:
    """The joint whose weights are shown: the active one of those that are selected."""
    names = () if item.rig is None else item.rig.skeleton.names
    return next((name for name in reversed(item.joint_selection) if name in names), None)


def _same(failed: tuple[Any, ...] | None, inputs: tuple[Any, ...]) -> bool:
    return failed is not None and all(a is b for a, b in zip(failed, inputs, strict=True))


def _normals(mesh: Mesh, points: Points) -> Points:
    normals: Points = freeze(mesh_normals(mesh, points))
    return normals


# as the evaluator remembers them


def _kept(heat: Heat) -> Heat:
    return heat._replace(values=freeze(heat.values))


def _shares(values: Points, low: float, high: float) -> Points:
    shares: Points = freeze(shares_of(values, low, high))
    return shares


def _mask(mesh: Mesh, mask: Points | None) -> Heat:
    return _kept(mask_heat(np.zeros(len(mesh.points), np.float32) if mask is None else mask))


def _weight(rig: Rig, joint: str) -> Heat:
    return _kept(weight_heat(rig, joint))


def _strain(mesh: Mesh, shown: Points, evaluator: Evaluator) -> Heat:
    return _kept(strain_heat(mesh, evaluator.get(edge_vertices, mesh), shown))


def _shape(mesh: Mesh, plain: Points, shown: Points) -> Heat:
    return _kept(shape_heat(mesh, plain, shown))


def _error(mesh: Mesh, rig: Rig, sculpts: Correctives, correctives: Correctives | None) -> Heat:
    return _kept(error_heat(mesh, rig, sculpts, correctives))


def _delta(mesh: Mesh, rig: Rig, correctives: Correctives | None, pose: Pose, evaluator: Evaluator) -> Heat:
    prepared = () if correctives is None else evaluator.get(prepare, correctives, rig)
    return _kept(delta_heat(mesh, rig, prepared, pose))


def _condition(mesh: Mesh, rig: Rig, pose: Pose) -> Heat:
    return _kept(condition_heat(rig, len(mesh.points), pose))
