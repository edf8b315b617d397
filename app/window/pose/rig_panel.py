"""What the rig has beside its joints: abstract controls with their ranges, and constraints of joints."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Any

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QGridLayout, QLabel, QPushButton, QTreeWidgetItem, QVBoxLayout, QWidget

from app.window.desk import Desk
from app.window.params_panel import RecordForm, Setting
from app.window.pose.names import Names
from core.document import Document
from core.field import field
from core.pose.rig import Constraint, Control
from core.record import Record
from core.workspace import Workspace
from tools import control_edits

_ROLE = Qt.ItemDataRole.UserRole
_WIDE, _ANY, _UNIT = (-10.0, 10.0), (-1e9, 1e9), (-1.0, 1.0)
_TURN = (-math.pi, math.pi)


class DialForm(Record):
    """What may be changed of a dial."""

    name: Annotated[str, field("Name", "What the control is called; poses, clips and sculpts follow the new name.")]
    low: Annotated[float, field("Lowest", "Where its range ends below; a script may set it beyond.", "", _WIDE, _ANY)]
    high: Annotated[float, field("Highest", "Where its range ends above; a script may set it beyond.", "", _WIDE,
                                 _ANY)]
    rest: Annotated[float, field("Rest", "Where it stands at rest, within its range.", "", _WIDE, _ANY)]


class SwitchForm(DialForm):
    """What may be changed of a control that something moves."""

    x: Annotated[float, field("Along X", "How much of the way measured goes along X of the object.", "", _UNIT, _ANY)]
    y: Annotated[float, field("Along Y", "How much of the way measured goes along Y of the object.", "", _UNIT, _ANY)]
    z: Annotated[float, field("Along Z", "How much of the way measured goes along Z of the object.", "", _UNIT, _ANY)]
    travel: Annotated[float, field("Travel", "How far it moves for its number to go up by 1.", "m", (0.001, 1.0),
                                   (1e-9, 1e9))]


class LimitForm(Record):
    """What may be changed of a limit."""

    low_x: Annotated[float, field("X from", "The least turn about X, from rest.", "rad", _TURN, _TURN)]
    high_x: Annotated[float, field("X to", "The greatest turn about X, from rest.", "rad", _TURN, _TURN)]
    low_y: Annotated[float, field("Y from", "The least turn about Y, from rest.", "rad", _TURN, _TURN)]
    high_y: Annotated[float, field("Y to", "The greatest turn about Y, from rest.", "rad", _TURN, _TURN)]
    low_z: Annotated[float, field("Z from", "The least turn about Z, from rest.", "rad", _TURN, _TURN)]
    high_z: Annotated[float, field("Z to", "The greatest turn about Z, from rest.", "rad", _TURN, _TURN)]


class LeadForm(Record):
    """What may be changed of a joint that is led by another."""

    weight: Annotated[float, field("Weight", "How much of it is done, from not at all at 0 to all of it at 1.", "",
                                   (0.0, 1.0), (0.0, 1.0))]


class AimForm(LeadForm):
    """What may be changed of a joint that aims at another."""

    x: Annotated[float, field("Axis X", "The direction of the joint that points at the other, along its X.", "",
                              _UNIT, _ANY)]
    y: Annotated[float, field("Axis Y", "The direction of the joint that points at the other, along its Y.", "",
                              _UNIT, _ANY)]
    z: Annotated[float, field("Axis Z", "The direction of the joint that points at the other, along its Z.", "",
                              _UNIT, _ANY)]


class RigPanel(QWidget):
    """Two lists, each with the settings of what is chosen in it and buttons that add and delete."""

    def __init__(self, desk: Desk, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.desk = desk
        self.controls = _Part(
            "Abstract controls", "No control of its own yet: a dial, a pad of two, or what moves.", self._control_form,
            {"dial": ("Add dial", "Gives the rig a named number with a range.", self._add_dial),
             "pad": ("Add pad", "Gives the rig two dials that make a two-dimensional pad.", self._add_pad),
             "joint": ("Joint switch", "Makes the movement of the active joint a number.", self._add_joint),
             "geometry": ("Geometry switch", "Makes the movement of the masked piece of the mesh a number; paint it "
                          "with the Mask brush first.", self._add_geometry),
             "delete": ("Delete", "Deletes the chosen control; sculpts that read it are named first.",
                        self._delete_control)})
        self.constraints = _Part(
            "Constraints", "No constraint: joints turn as far as you turn them.", self._constraint_form,
            {"limit": ("Limit", "Keeps the angles of the active joint within ranges.", self._act("limit_joint")),
             "aim": ("Aim", "The active joint points at the one selected before it.",
                     self._act("constrain_joint", kind="aim")),
             "point": ("Follow place", "The active joint goes where the one selected before it goes.",
                       self._act("constrain_joint", kind="point")),
             "orient": ("Turn along", "The active joint turns as the one selected before it turns.",
                        self._act("constrain_joint", kind="orient")),
             "delete": ("Delete", "Takes the chosen constraint away; the pose stays.", self._delete_constraint)})
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(8)
        column.addWidget(self.controls)
        column.addWidget(self.constraints)
        desk.changed.connect(self._document_changed)
        desk.workspace_changed.connect(self._workspace_changed)
        desk.session_replaced.connect(self.refresh)
        desk.stroke_ended.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Show the rig on the desk."""
        item = self.desk.posed
        if self.desk.session.stroking:
            return
        self.setEnabled(item is not None)
        rig = None if item is None else item.rig
        self.controls.show_all({} if rig is None else {
            control.name: (control, _control_words(control)) for control in rig.controls})
        self.constraints.show_all({} if rig is None else {
            str(at): (one, _constraint_words(one)) for at, one in enumerate(rig.constraints)})

    # -- controls ----------------------------------------------------------------------------------------

    def _control_form(self, control: Control) -> RecordForm:
        fields: dict[str, Any] = {n: getattr(control, n) for n in ("name", "low", "high", "rest")}
        if control.kind != "number":
            fields |= {**dict(zip("xyz", control.axis, strict=True)), "travel": control.travel}
        kind = DialForm if control.kind == "number" else SwitchForm
        form = RecordForm(kind(**fields), Setting(unit=self.desk.document.unit))
        form.changed.connect(lambda record, final: final and self._control_changed(control, record))
        return form

    def _control_changed(self, control: Control, record: DialForm) -> None:
        changes: dict[str, Any] = {"name": record.name.strip() or control.name, "low": record.low,
                                   "high": record.high, "rest": min(max(record.rest, record.low), record.high)}
        if isinstance(record, SwitchForm):
            changes |= {"axis": (record.x, record.y, record.z), "travel": record.travel}
        changes = {name: value for name, value in changes.items() if value != getattr(control, name)}
        if changes:
            self.controls.chosen = changes.get("name", control.name)
            self._edit("Edit control", control_edits.edit_control, control.name, **changes)

    def _add_dial(self) -> None:
        self._add(lambda name: self._act("add_dial", name=name)(), "dial")

    def _add_pad(self) -> None:
        item = self.desk.posed
        if item is not None and item.rig is not None:
            across = control_edits.free_control_name(item.rig, "valence")
            self.controls.chosen = across
            self._act("add_pad", across=across, up=control_edits.free_control_name(item.rig, "arousal"))()

    def _add_joint(self) -> None:
        item = self.desk.posed
        joint = item.joint_selection[-1] if item is not None and item.joint_selection else "joint"
        self._add(lambda name: self._act("add_joint_control", name=name)(), f"{joint} switch")

    def _add_geometry(self) -> None:
        self._add(lambda name: self._act("add_geometry_control", name=name)(), "piece")

    def _add(self, make: Callable[[str], object], base: str) -> None:
        item = self.desk.posed
        if item is not None and item.rig is not None:
            before = self.controls.chosen
            self.controls.chosen = name = control_edits.free_control_name(item.rig, base)
            make(name)
            if self.desk.posed is item:  # it was refused
                self.controls.chosen = before

    def _delete_control(self) -> None:
        if self.controls.chosen is not None:
            self._edit("Delete control", control_edits.remove_control, self.controls.chosen)

    # -- constraints -------------------------------------------------------------------------------------

    def _constraint_form(self, one: Constraint) -> RecordForm:
        if one.kind == "limit":
            made: Record = LimitForm(**{f"{end}_{axis}": getattr(one, end)[k]
                                        for end in ("low", "high") for k, axis in enumerate("xyz")})
        elif one.kind == "aim":
            made = AimForm(weight=one.weight, x=one.axis[0], y=one.axis[1], z=one.axis[2])
        else:
            made = LeadForm(weight=one.weight)
        form = RecordForm(made)
        form.changed.connect(lambda record, final: final and self._constraint_changed(record))
        return form

    def _constraint_changed(self, record: Record) -> None:
        if self.constraints.chosen is None:
            return
        if isinstance(record, LimitForm):
            changes: dict[str, Any] = {"low": (record.low_x, record.low_y, record.low_z),
                                       "high": (record.high_x, record.high_y, record.high_z)}
        else:
            assert isinstance(record, LeadForm)
            changes = {"weight": record.weight}
            if isinstance(record, AimForm):
                changes["axis"] = (record.x, record.y, record.z)
        self._edit("Edit constraint", control_edits.edit_constraint, int(self.constraints.chosen), **changes)

    def _delete_constraint(self) -> None:
        if self.constraints.chosen is not None:
            self._edit("Delete constraint", control_edits.remove_constraint, int(self.constraints.chosen))

    # -- what these share --------------------------------------------------------------------------------

    def _act(self, action: str, **params: Any) -> Callable[[], None]:
        return lambda: self.desk.attempt(lambda: self.desk.session.act(action, **params))

    def _edit(self, step: str, function: Callable[..., Document], *args: Any, **changes: Any) -> None:
        """One step; when it is refused the form goes back to what is there."""
        item = self.desk.posed
        if item is not None and not self.desk.edit(step, function, item.id, *args, **changes):
            QTimer.singleShot(0, self, self._again)  # after the signal of the form that is made anew

    def _again(self) -> None:
        self.controls.forget()
        self.constraints.forget()
        self.refresh()

    def _document_changed(self, old: Document, new: Document) -> None:
        if old.meshes is not new.meshes:
            self.refresh()

    def _workspace_changed(self, old: Workspace, new: Workspace) -> None:
        if old.mesh != new.mesh:
            self.refresh()


class _Part(QWidget):
    """A list of things by key, the settings of the chosen one, and buttons below."""

    def __init__(
        self, title: str, empty: str, form: Callable[[Any], RecordForm],
        buttons: dict[str, tuple[str, str, Callable[[], object]]],
    ) -> None:
        super().__init__()
        self._form_of, self._filling = form, False
        self._shown: dict[str, Any] = {}
        self.chosen: str | None = None
        self.form: RecordForm | None = None
        self._formed: object = None
        self.list = Names(title)
        self.said = QLabel(empty)
        self.said.setWordWrap(True)
        self.said.setEnabled(False)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(4)
        heading = QLabel(title)
        heading.setEnabled(False)
        column.addWidget(heading)
        column.addWidget(self.said)
        column.addWidget(self.list)
        self._settings = QVBoxLayout()
        column.addLayout(self._settings)
        grid = QGridLayout()
        grid.setSpacing(4)
        self.buttons: dict[str, QPushButton] = {}
        for at, (name, (words, tooltip, run)) in enumerate(buttons.items()):
            button = self.buttons[name] = QPushButton(words)
            button.setToolTip(tooltip)
            button.clicked.connect(lambda checked=False, run=run: run())
            grid.addWidget(button, at // 2, at % 2)
        column.addLayout(grid)
        self.list.itemSelectionChanged.connect(self._selected)

    def show_all(self, things: dict[str, tuple[Any, tuple[str, str]]]) -> None:
        """Show these, by key: the thing, its words and its tooltip."""
        seen = {key: thing for key, (thing, _) in things.items()}
        if seen.keys() == self._shown.keys() and all(seen[k] is self._shown[k] for k in seen):
            self._show_form()
            return
        self._shown, self._filling = seen, True
        self.list.clear()
        for key, (_, (words, tooltip)) in things.items():
            entry = QTreeWidgetItem([words])
            entry.setData(0, _ROLE, key)
            entry.setToolTip(0, tooltip)
            self.list.addTopLevelItem(entry)
            entry.setSelected(key == self.chosen)
        self._filling = False
        if self.chosen not in seen:
            self.chosen = None
        self.list.setVisible(bool(things))
        self.said.setVisible(not things)
        self.list.updateGeometry()
        self._show_form()

    def forget(self) -> None:
        """Make the settings anew at the next look."""
        self._formed = None

    def _selected(self) -> None:
        if not self._filling:
            entries = self.list.selectedItems()
            self.chosen = entries[-1].data(0, _ROLE) if entries else None
            self._show_form()

    def _show_form(self) -> None:
        self.buttons["delete"].setEnabled(self.chosen is not None)
        thing = None if self.chosen is None else self._shown.get(self.chosen)
        if thing is self._formed:
            return
        self._formed = thing
        while (old := self._settings.takeAt(0)) is not None:
            widget = old.widget()
            if widget is not None:
                widget.hide()
                widget.deleteLater()
        self.form = None if thing is None else self._form_of(thing)
        if self.form is not None:
            self._settings.addWidget(self.form)


def _control_words(control: Control) -> tuple[str, str]:
    moved = {"number": "dial", "joint": f"moved by {control.joint}", "geometry": "moved by a piece of the mesh"}
    words = f"{control.name}   {control.low:g} to {control.high:g}"
    return (words if control.kind == "number" else f"{words}   {moved[control.kind]}",
            f"{control.name}, {moved[control.kind]}: click to change its name, range and rest.")


def _constraint_words(one: Constraint) -> tuple[str, str]:
    words = {"limit": f"{one.joint} keeps within angles", "aim": f"{one.joint} aims at {one.target}",
             "point": f"{one.joint} follows {one.target}", "orient": f"{one.joint} turns with {one.target}"}[one.kind]
    return words, f"{words}: click to change how much."
