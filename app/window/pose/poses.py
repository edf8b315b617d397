"""Sculpted poses in their layers, what the rig is interpolated by, how far a pose reaches; and the library of poses."""

from __future__ import annotations

from collections.abc import Callable
from typing import get_args

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import (
    QGridLayout,
    QInputDialog,
    QLabel,
    QPushButton,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from app.window.desk import Desk
from app.window.fields.choice_bar import ChoiceBar
from app.window.params_panel import RecordForm
from app.window.pose.names import Names
from app.window.pose.reach import Reach
from app.window.pose.refused import RefusedBar
from app.window.pose.views import ONLY_SKIN
from app.window.sections import Row
from core.document import Document
from core.errors import UserError
from core.field import Field, fields_of
from core.pose.compare import LABELS, METHODS, Method
from core.pose.pose import REST, Pose
from core.pose.pose_space import Dof, Falloff, PoseLayer, PoseSample, PoseSpace
from core.pose.refusal import Refusal
from core.pose.synthesis import pose_at
from core.workspace import Workspace
from tools import pose_edits
from tools.pose_compare import set_method

_WAY = Field("Method", "How sculpts are interpolated: by the pose space, or by others to compare it with; "
             "Skin only just looks at the skin without them.")
_READS = Field("Reads", "What of this joint the layer reads: where it points (swing), its turn about itself (twist), "
               "or the turn about one axis.")
READINGS: tuple[pose_edits.Reading, ...] = get_args(pose_edits.Reading)
_ROLE = Qt.ItemDataRole.UserRole


class PoseList(QWidget):
    """Layers and their poses: a click holds a pose; its falloffs are the bars below."""

    def __init__(self, desk: Desk, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.desk = desk
        self.list = Names("Sculpted poses")
        self.way = ChoiceBar(_WAY, "pose-space", "pose-space", METHODS, tuple(LABELS[way] for way in METHODS))
        self.falloffs: dict[str, Reach] = {}
        self.settings: RecordForm | None = None  # of the layer that is chosen
        self.readings: dict[str, ChoiceBar] = {}
        self.said = QLabel()
        self.said.setWordWrap(True)
        self.said.setEnabled(False)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(4)
        self.refused = RefusedBar(desk)
        column.addWidget(self.said)
        column.addWidget(self.refused)
        column.addWidget(self.list)
        self._reach = QVBoxLayout()
        self._reach.setSpacing(4)
        column.addLayout(self._reach)
        self.buttons = {
            "add": _button("Add sculpt here", "Makes the pose that is held a sample of pose space, as it looks.",
                           self._add),
            "move": _button("Move here", "Moves the chosen sculpt to the pose that is held; it stays as it is.",
                            self._move),
            "merge": _button("Merge", "Makes one pose of the chosen poses of a layer, their sculpts averaged.",
                             self._merge),
            "delete": _button("Delete", "Deletes the chosen poses with their sculpts; undo brings them back.",
                              self._delete),
        }
        grid = QGridLayout()
        grid.setSpacing(4)
        for at, button in enumerate(self.buttons.values()):
            grid.addWidget(button, at // 2, at % 2)
        column.addLayout(grid)
        self.method = Row(_WAY.label, self.way)
        column.addWidget(self.method)
        self._filling = False
        self._seen: object = None
        self.list.itemSelectionChanged.connect(self._selected)
        self.list.itemClicked.connect(self._clicked)
        self.list.itemChanged.connect(self._changed)
        self.way.edited.connect(self._way_chosen)
        desk.changed.connect(self._document_changed)
        desk.workspace_changed.connect(self._workspace_changed)
        desk.session_replaced.connect(self.refresh)
        desk.stroke_ended.connect(self.refresh)
        desk.refused.connect(self._offer)
        self.refresh()

    @property
    def chosen(self) -> list[str]:
        """Names of the poses that are chosen in the list."""
        return [item.data(0, _ROLE) for item in self.list.selectedItems() if item.parent() is not None]

    @property
    def chosen_layer(self) -> str | None:
        """Name of the layer that alone is chosen in the list."""
        rows = self.list.selectedItems()
        return rows[0].data(0, _ROLE) if len(rows) == 1 and rows[0].parent() is None else None

    def refresh(self) -> None:
        """Show what is on the desk now."""
        item = self.desk.posed
        layers: tuple[PoseLayer, ...] = () if item is None or item.correctives is None else item.correctives.layers
        if layers:
            self.way.set_value(self._method(layers[0]))
        seen = None if item is None else (item.id, item.correctives)
        if self.desk.session.stroking or (seen is not None and seen == self._seen):
            return
        self._seen = seen
        kept, layer_kept = self.chosen, self.chosen_layer
        self._filling = True
        self.list.clear()
        for layer in layers:
            top = QTreeWidgetItem([f"{layer.name}   {len(layer.vertices):,} vertices"])
            top.setData(0, _ROLE, layer.name)
            top.setFlags(top.flags() | Qt.ItemFlag.ItemIsUserCheckable)
            top.setCheckState(0, Qt.CheckState.Checked if layer.enabled else Qt.CheckState.Unchecked)
            top.setToolTip(0, f"Layer {layer.name}: the box switches its corrections on and off; a click shows its "
                           "kernel and what else it is set to.")
            self.list.addTopLevelItem(top)
            top.setSelected(layer.name == layer_kept)
            for sample in layer.space.samples:
                one = QTreeWidgetItem(top, [sample.name])
                one.setData(0, _ROLE, sample.name)
                one.setToolTip(0, f"{sample.name}: click to hold this pose; its falloffs stand below.")
                one.setSelected(sample.name in kept)
            top.setExpanded(True)
        self._filling = False
        self.list.setVisible(bool(layers))
        self.method.setVisible(bool(layers))
        self.said.setVisible(not layers)
        self.said.setText("No sculpts yet. Pose the rig, then sculpt with a brush or add the pose as it looks."
                          if item is not None else "No rig yet. Open a USD, glTF or project file with joints.")
        self.list.updateGeometry()
        self._selected()

    # -- what the hand does ------------------------------------------------------------------------------

    def _clicked(self, entry: QTreeWidgetItem) -> None:
        item, found = self.desk.posed, None if entry.parent() is None else self._sample(entry.data(0, _ROLE))
        if item is not None and found is not None and len(self.chosen) == 1:
            self.desk.edit("Pose", pose_edits.hold_pose, item.id, found[1].pose)

    def _changed(self, entry: QTreeWidgetItem) -> None:
        item = self.desk.posed
        if not self._filling and item is not None and entry.parent() is None:
            on = entry.checkState(0) == Qt.CheckState.Checked
            step, name = "Show layer" if on else "Hide layer", entry.data(0, _ROLE)
            # after this signal, for the edit fills the list anew, and its row is still at work here
            QTimer.singleShot(0, self, lambda: self._edit(step, pose_edits.set_layer_enabled, name, on))

    def _selected(self) -> None:
        if self._filling:
            return
        while (old := self._reach.takeAt(0)) is not None:
            widget = old.widget()
            if widget is not None:
                widget.hide()
                widget.deleteLater()
        self.falloffs, self.settings, self.readings, chosen = {}, None, {}, self.chosen
        if self.chosen_layer is not None:
            self._show_layer(self.chosen_layer)
        found = self._sample(chosen[0]) if len(chosen) == 1 else None
        for dof in () if found is None else found[0].space.dofs:
            assert found is not None
            reach = self.falloffs[dof.control] = Reach(found[1], dof, self.desk.document.unit)
            reach.edited.connect(lambda falloff, dof=dof: self._reached(dof, falloff))
            self._reach.addWidget(reach)
        item = self.desk.posed
        self.buttons["add"].setEnabled(item is not None)
        for name, enough in (("move", len(chosen) == 1), ("merge", len(chosen) > 1), ("delete", bool(chosen))):
            self.buttons[name].setEnabled(enough)

    def _show_layer(self, name: str) -> None:
        """What a layer is set to, below the list."""
        item = self.desk.posed
        layers = () if item is None or item.correctives is None else item.correctives.layers
        layer = next((one for one in layers if one.name == name), None)
        if layer is None or item is None or item.rig is None:
            return
        self.settings = RecordForm(layer.space)
        self.settings.changed.connect(lambda space, final: final and self._set_layer(layer, space))
        self._reach.addWidget(self.settings)
        for dof in layer.space.dofs:
            if dof.control in item.rig.skeleton.names and dof.kind != "translation":
                bar = self.readings[dof.control] = ChoiceBar(_READS, dof.kind, None, READINGS, READINGS)
                bar.edited.connect(lambda value, final, dof=dof: final and self._edit(
                    "Reading", pose_edits.set_reading, name, dof.control, value))
                self._reach.addWidget(Row(f"Reads {dof.control}", bar))

    def _set_layer(self, layer: PoseLayer, space: PoseSpace) -> None:
        """Take what the hand made of the settings of a layer."""
        changes = {field: getattr(space, field) for field in fields_of(PoseSpace)
                   if getattr(space, field) != getattr(layer.space, field)}
        if changes:
            self._edit("Layer settings", pose_edits.set_space, layer.name, **changes)

    def _reached(self, dof: Dof, falloff: Falloff) -> None:
        if len(self.chosen) == 1:
            self._edit("Falloff", pose_edits.set_falloff, self.chosen[0], dof.control, falloff)

    def _add(self) -> None:
        item = self.desk.posed
        if item is None or item.rig is None:
            return
        pose = item.pose if item.pose is not None else pose_at(item.rig, self.desk.workspace.frame)
        named = pose.replace(name=pose_edits.sculpt_name(item.correctives, pose.replace(name="sculpt")))
        self._edit("Add sculpt", pose_edits.add_sculpt, named)

    def _move(self) -> None:
        item = self.desk.posed
        if item is None or item.pose is None:
            self.desk.error(UserError("Hold the pose to move the sculpt to first: turn a joint or move a dial."))
        elif len(self.chosen) == 1:
            name = self.chosen[0]
            self._edit("Move pose", pose_edits.move_pose, name, item.pose.replace(name=name))

    def _merge(self) -> None:
        self._edit("Merge poses", pose_edits.merge_poses, tuple(self.chosen))

    def _delete(self) -> None:
        for name in self.chosen:
            self._edit("Delete pose", pose_edits.remove_pose, name)

    def _method(self, layer: PoseLayer) -> Method:
        """By which method the sculpts are taken, or shown."""
        if self.desk.workspace.view.compare == ONLY_SKIN:
            return "skin"
        return "weighted" if layer.kind == "pose-space" and layer.space.weighted else layer.kind

    def _way_chosen(self, way: Method, final: bool) -> None:
        if not final:
            return
        view = self.desk.workspace.view
        if way == "skin":
            self.desk.set_workspace(view=view.replace(compare=ONLY_SKIN))
            return
        if view.compare == ONLY_SKIN:
            self.desk.set_workspace(view=view.replace(compare=()))
        item = self.desk.posed
        if item is not None and item.correctives is not None and self._method(item.correctives.layers[0]) != way:
            self._edit("Method", set_method, way)

    def _edit(self, step: str, function: Callable[..., Document], *args: object, **parameters: object) -> None:
        item = self.desk.posed
        if item is not None:
            self.desk.edit(step, function, item.id, *args, **parameters)
            self._seen = None  # what was refused goes back to what it was
            self.refresh()

    def _offer(self, refusal: Refusal) -> None:
        """Choose the poses that a refusal names, so that they can be merged, deleted or moved at once."""
        self.refused.offer(refusal)
        self.list.clearSelection()
        for row in range(self.list.topLevelItemCount()):
            top = self.list.topLevelItem(row)
            for entry in (top.child(k) for k in range(top.childCount())):
                entry.setSelected(entry.data(0, _ROLE) in refusal.poses)

    # -- what changes ------------------------------------------------------------------------------------

    def _sample(self, name: str) -> tuple[PoseLayer, PoseSample] | None:
        item = self.desk.posed
        for layer in () if item is None or item.correctives is None else item.correctives.layers:
            for sample in layer.space.samples:
                if sample.name == name:
                    return layer, sample
        return None

    def _document_changed(self, old: Document, new: Document) -> None:
        if old.meshes is not new.meshes:
            self.refresh()

    def _workspace_changed(self, old: Workspace, new: Workspace) -> None:
        if old.mesh != new.mesh or old.craft != new.craft or old.view.compare != new.view.compare:
            self.refresh()


class PoseLibrary(QWidget):
    """Poses kept by name: a click holds one."""

    def __init__(self, desk: Desk, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.desk = desk
        self.list = Names("Poses of the library")
        self.said = QLabel("No poses kept yet. Keep the pose you hold under a name, to come back to it later.")
        self.said.setWordWrap(True)
        self.said.setEnabled(False)
        self.keep_button = _button("Keep this pose…", "Keeps the pose that is shown in the library by name.", self._ask)
        self.forget_button = _button("Forget", "Takes the chosen poses out of the library; undo brings them back.",
                                     self._forget)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(4)
        column.addWidget(self.said)
        column.addWidget(self.list)
        grid = QGridLayout()
        grid.setSpacing(4)
        grid.addWidget(self.keep_button, 0, 0)
        grid.addWidget(self.forget_button, 0, 1)
        column.addLayout(grid)
        self.list.itemClicked.connect(self._clicked)
        desk.changed.connect(lambda old, new: old.meshes is not new.meshes and self.refresh())
        desk.workspace_changed.connect(lambda old, new: old.mesh != new.mesh and self.refresh())
        desk.session_replaced.connect(self.refresh)
        self._seen: tuple[Pose, ...] | None = None
        self.refresh()

    def refresh(self) -> None:
        """Show what is on the desk now."""
        item = self.desk.posed
        library = () if item is None else item.library
        self.keep_button.setEnabled(item is not None)
        if library is self._seen:
            return
        self._seen = library
        self.list.clear()
        for pose in library:
            one = QTreeWidgetItem([pose.name])
            one.setToolTip(0, f"{pose.name}: click to hold this pose of the library.")
            self.list.addTopLevelItem(one)
        self.list.setVisible(bool(library))
        self.said.setVisible(not library)
        self.forget_button.setEnabled(bool(library))
        self.list.updateGeometry()

    def keep(self, name: str) -> None:
        """Keep the pose that is shown under a name."""
        item = self.desk.posed
        if item is not None and item.rig is not None and name.strip():
            pose = item.pose if item.pose is not None else pose_at(item.rig, self.desk.workspace.frame)
            self.desk.edit("Keep pose", pose_edits.keep_pose, item.id, pose.replace(name=name.strip()[:200]))

    def _ask(self) -> None:
        dialog = QInputDialog(self)
        dialog.setWindowTitle("Keep this pose")
        dialog.setLabelText("Name of the pose")
        dialog.textValueSelected.connect(self.keep)
        dialog.finished.connect(dialog.deleteLater)
        dialog.open()

    def _clicked(self, entry: QTreeWidgetItem) -> None:
        item = self.desk.posed
        if item is not None:
            pose = next((pose for pose in item.library if pose.name == entry.text(0)), REST)
            self.desk.edit("Pose", pose_edits.hold_pose, item.id, pose)

    def _forget(self) -> None:
        item = self.desk.posed
        for entry in self.list.selectedItems() if item is not None else ():
            assert item is not None
            self.desk.edit("Forget pose", pose_edits.forget_pose, item.id, entry.text(0))


def _button(words: str, tooltip: str, run: Callable[[], object]) -> QPushButton:
    button = QPushButton(words)
    button.setToolTip(tooltip)
    button.clicked.connect(lambda: run())
    return button
