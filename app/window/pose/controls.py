"""Sliders of the rig: the angles of a joint, and every dial. A drag is a preview, its end one named step."""

from __future__ import annotations

import math

import numpy as np
from PySide6.QtWidgets import QHBoxLayout, QPushButton, QVBoxLayout, QWidget

from app.window.desk import Desk
from app.window.fields.choice_bar import ChoiceBar
from app.window.fields.number_bar import NumberBar
from app.window.pose.pad import DialPad
from app.window.sections import Row
from core.document import Document, MeshObject
from core.field import Field
from core.pose.pose import REST, Pose, moved_controls
from core.pose.rig import Control, Rig
from core.pose.rotation import euler_from_quaternion, quaternion_from_euler
from core.pose.synthesis import pose_at
from core.workspace import Workspace
from tools.pose_edits import hold_pose, select_joints

_MESH = Field("Rig", "Which mesh with a rig the sliders, the map and the brushes of this craft work on.")
_JOINT = Field("Joint", "The joint whose angles the sliders below turn, relative to rest.")
_PAD = (Field("Pad across", "The dial that goes from left to right on the pad below."),
        Field("Pad up", "The dial that goes from below to above on the pad below."))
_ANGLES = tuple(
    Field(f"Turn {axis}", f"Turns the joint about its {axis} axis at rest, in degrees from rest.", "rad",
          (-math.pi, math.pi), (-4.0 * math.pi, 4.0 * math.pi))
    for axis in "XYZ")


class PoseControls(QWidget):
    """Which rig, its joints and its dials; below, back to rest or back to the clip."""

    def __init__(self, desk: Desk, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.desk = desk
        self.mesh, self.joint = ChoiceBar(_MESH, "", None, ("",)), ChoiceBar(_JOINT, "", None, ("",))
        self.angles = tuple(NumberBar(known, 0.0, 0.0) for known in _ANGLES)
        self.dials: dict[str, NumberBar] = {}
        self.pad: DialPad | None = None
        self.axes: tuple[ChoiceBar, ...] = ()  # which dials the pad is of, where there are more than two
        self._pairs: dict[int, tuple[str, str]] = {}  # by mesh, "" for no dial
        self._about: tuple[object, ...] = ()
        self._held: tuple[str, Pose, np.ndarray] | None = None  # joint, its pose, and angles the hand set
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(4)
        self.rows = {bar: Row(bar.known.label, bar) for bar in (self.mesh, self.joint, *self.angles)}
        for row in self.rows.values():
            column.addWidget(row)
        self._dial_rows = QVBoxLayout()
        self._dial_rows.setSpacing(4)
        column.addLayout(self._dial_rows)
        self.rest = QPushButton("Rest pose")
        self.rest.setToolTip("Puts every joint and dial back to rest, as one step of undo.")
        self.rest.clicked.connect(lambda: self.hold(REST, True))
        self.play = QPushButton("Follow the clip")
        self.play.setToolTip("Lets go of the pose that is held, so that the clip moves the rig again.")
        self.play.clicked.connect(self._let_go)
        buttons = QHBoxLayout()
        buttons.setSpacing(4)
        buttons.addWidget(self.rest)
        buttons.addWidget(self.play)
        column.addLayout(buttons)
        self.mesh.edited.connect(self._mesh_chosen)
        self.joint.edited.connect(self._joint_chosen)
        for bar in self.angles:
            bar.edited.connect(lambda value, final: self._turned(final))
        desk.changed.connect(self._document_changed)
        desk.workspace_changed.connect(self._workspace_changed)
        desk.session_replaced.connect(self.refresh)
        desk.stroke_ended.connect(self.refresh)
        self.refresh()

    def pose(self) -> Pose:
        """The pose that is shown: held, or of the clip at the frame."""
        item = self.desk.posed
        if item is None or item.rig is None:
            return REST
        return item.pose if item.pose is not None else pose_at(item.rig, self.desk.workspace.frame)

    def hold(self, pose: Pose, final: bool) -> None:
        """Show a pose, or make it the one that is held."""
        item, session = self.desk.posed, self.desk.session
        if item is None:
            return
        if final:
            self.desk.edit("Pose", hold_pose, item.id, pose)
            self.refresh()
        else:
            self.desk.attempt(lambda: session.preview(hold_pose(session.document, item.id, pose)))

    def refresh(self) -> None:
        """Show what is on the desk now."""
        if self.desk.session.stroking:
            return
        item = self.desk.posed
        for widget in (self.rest, self.play, *self.rows.values()):
            widget.setVisible(item is not None)
        if item is None or item.rig is None:
            self._clear_dials()
            self._about = ()
            return
        rigged = [one.name for one in self.desk.document.meshes if one.rig is not None]
        about = (item.id, item.rig.skeleton, item.rig.controls, tuple(rigged))
        if len(about) != len(self._about) or any(
            a is not b and a != b for a, b in zip(about[:1] + about[3:], self._about[:1] + self._about[3:], strict=True)
        ) or about[1] is not self._about[1] or about[2] is not self._about[2]:
            self._build(item, item.rig, rigged)
            self._about = about
        self.rows[self.mesh].setVisible(len(rigged) > 1)
        selected = item.joint_selection[-1] if item.joint_selection else None
        if selected is not None and selected != self.joint.value():
            self.joint.set_value(selected)
        self._show(item.rig)
        self.play.setEnabled(item.pose is not None)

    def _build(self, item: MeshObject, rig: Rig, rigged: list[str]) -> None:
        self.mesh.set_choices(tuple(rigged), tuple(rigged))
        self.mesh.set_value(item.name)
        names = rig.skeleton.names
        self.joint.set_choices(names, names)
        if self.joint.value() not in names and names:
            self.joint.set_value(_first_joint(item, rig))
        self._clear_dials()
        dials = [control for control in rig.controls if control.kind == "number"]
        if len(dials) > 1:
            self._build_pad(item, rig, dials)
        for control in dials:
            bar = self.dials[control.name] = NumberBar(_dial(control), control.rest, control.rest)
            bar.edited.connect(lambda value, final, name=control.name: self._dialled(name, value, final))
            self._dial_rows.addWidget(Row(control.name, bar))

    def _build_pad(self, item: MeshObject, rig: Rig, dials: list[Control]) -> None:
        """A pad of two dials; of more than two the hand chooses which, once for each mesh."""
        by_name = {control.name: control for control in dials}
        pair = self._pairs.get(item.id, ())
        if len(pair) != 2 or not set(pair) <= by_name.keys() | {""}:
            pair = self._pairs[item.id] = _pair_at_first(item, rig, dials)
        if len(dials) > 2:
            names = ("", *by_name)
            for at, known in enumerate(_PAD):
                bar = ChoiceBar(known, pair[at], None, names, ("none", *by_name))
                bar.edited.connect(lambda name, final, at=at: final and self._pair_chosen(item.id, at, name))
                self.axes = (*self.axes, bar)
                self._dial_rows.addWidget(Row(known.label, bar))
        if "" not in pair and pair[0] != pair[1]:
            self.pad = DialPad(by_name[pair[0]], by_name[pair[1]])
            self.pad.moved.connect(self._padded)
            self._dial_rows.addWidget(self.pad)

    def _pair_chosen(self, mesh_id: int, at: int, name: str) -> None:
        """Another dial goes along an axis of the pad; the one that went there takes the place of a twin."""
        pair, old = list(self._pairs[mesh_id]), self._pairs[mesh_id][at]
        pair[at] = name
        if name and pair[1 - at] == name:
            pair[1 - at] = old
        self._pairs[mesh_id], self._about = (pair[0], pair[1]), ()
        self.refresh()

    def _clear_dials(self) -> None:
        while (entry := self._dial_rows.takeAt(0)) is not None:
            widget = entry.widget()
            if widget is not None:
                widget.hide()
                widget.deleteLater()
        self.dials, self.pad, self.axes = {}, None, ()

    def _show(self, rig: Rig) -> None:
        pose, joint = self.pose(), self.joint.value()
        if any(bar.editing for bar in self.angles):
            return
        turn = pose.rotations.get(joint, (0.0, 0.0, 0.0, 1.0))
        held = self._held
        if held is not None and held[0] == joint and held[1].rotations.get(joint, (0.0, 0.0, 0.0, 1.0)) == turn:
            angles = held[2]  # of the many angles of one turn those the hand set
        else:
            angles = euler_from_quaternion(np.array(turn))
        for bar, angle in zip(self.angles, angles, strict=True):
            bar.set_value(float(angle) if abs(angle) > 1e-9 else 0.0)
        still = not rig.skeleton.names or (bool(self.dials) and len(rig.skeleton.names) == 1)
        for field in (self.joint, *self.angles):  # a lone root beside dials is nothing to pose by
            self.rows[field].setVisible(not still)
        rests = {control.name: control.rest for control in rig.controls}
        for name, dial in self.dials.items():
            dial.set_value(float(pose.numbers.get(name, rests[name])))
        if self.pad is not None and not self.pad.dragging:
            self.pad.show_pose(pose, self._on_pad())

    def _on_pad(self) -> tuple[Pose, ...]:
        """The sculpts that only the two dials of the pad are about."""
        item, pad = self.desk.posed, self.pad
        if pad is None:
            return ()
        layers = () if item is None or item.correctives is None else item.correctives.layers
        return tuple(s.pose for layer in layers for s in layer.space.samples
                     if set(moved_controls(s.pose)) <= {pad.across.name, pad.up.name})

    def _padded(self, x: float, y: float, final: bool) -> None:
        pad, pose = self.pad, self.pose()
        if pad is not None:
            numbers = {**pose.numbers, pad.across.name: x, pad.up.name: y}
            self.hold(pose.replace(name="held", numbers=numbers), final)

    def _turned(self, final: bool) -> None:
        joint, pose = self.joint.value(), self.pose()
        angles = np.array([bar.value() for bar in self.angles], np.float64)
        x, y, z, w = map(float, quaternion_from_euler(np.degrees(angles)))
        turned = pose.replace(name="held", rotations={**pose.rotations, joint: (x, y, z, w)})
        self._held = joint, turned, angles
        self.hold(turned, final)

    def _dialled(self, name: str, value: float, final: bool) -> None:
        pose = self.pose()
        self.hold(pose.replace(name="held", numbers={**pose.numbers, name: float(value)}), final)

    def _let_go(self) -> None:
        item = self.desk.posed
        if item is not None:
            self.desk.edit("Follow the clip", hold_pose, item.id, None)
            self.refresh()

    def _mesh_chosen(self, name: str, final: bool) -> None:
        item = next((one for one in self.desk.document.meshes if one.name == name and one.rig is not None), None)
        if item is not None:
            self.desk.set_workspace(mesh=item.id)

    def _joint_chosen(self, name: str, final: bool) -> None:
        item = self.desk.posed
        if item is not None and final:
            self.desk.edit("Select joint", select_joints, item.id, (name,))
            self.refresh()

    def _document_changed(self, old: Document, new: Document) -> None:
        if old.meshes is not new.meshes:
            self.refresh()

    def _workspace_changed(self, old: Workspace, new: Workspace) -> None:
        if old.frame != new.frame or old.mesh != new.mesh or old.craft != new.craft:
            self.refresh()


def _first_joint(item: MeshObject, rig: Rig) -> str:
    """A joint that sculpts are about, else the first that has a parent."""
    for layer in () if item.correctives is None else item.correctives.layers:
        for dof in layer.space.dofs:
            if dof.control in rig.skeleton.names:
                return dof.control
    return next((n for n, p in zip(rig.skeleton.names, rig.skeleton.parents, strict=True) if p >= 0),
                rig.skeleton.names[0])


def _pair_at_first(item: MeshObject, rig: Rig, dials: list[Control]) -> tuple[str, str]:
    """The two dials a sculpt reads together, else the first two that are no shapes of the file, else none of many."""
    names = [control.name for control in dials]
    if len(names) == 2:
        return names[0], names[1]
    for layer in () if item.correctives is None else item.correctives.layers:
        read = [name for name in names if name in layer.space.controls]
        if len(read) > 1:
            return read[0], read[1]
    shapes = () if rig.shapes is None else rig.shapes.names
    own = [name for name in names if name not in shapes]
    return (own[0], own[1]) if len(own) > 1 else ("", "")


def _dial(control: Control) -> Field:
    return Field(control.name, f"Sets the dial {control.name}, a number from {control.low:g} to {control.high:g}.",
                 soft=(control.low, control.high))
