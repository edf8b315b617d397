"""What the view shows of a rig, chosen by the hand: a field in colours, and methods side by side."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtWidgets import QVBoxLayout, QWidget

from app.window.commands import Command, Window
from app.window.desk import Desk
from app.window.fields.choice_bar import ChoiceBar
from app.window.pose.views import SIDES
from app.window.sections import Row
from core.field import Field
from core.pose.compare import LABELS, Method
from core.pose.heat import VIEWS
from core.workspace import Workspace

NAMES = {"": "plain", "shape": "shape", "delta": "delta", "strain": "strain", "condition": "condition",
         "error": "error", "mask": "mask", "weight": "weight of the joint"}
TOOLTIPS = {
    "": "Shows the posed mesh as it is, without colours of a field.",
    "shape": "Colours how far the sculpts lift the surface above the skin alone, in metres; blue is below.",
    "delta": "Colours how long the corrections are that are added at this pose, in metres.",
    "strain": "Colours how much longer edges are than at rest, in percent; blue is shorter.",
    "condition": "Colours how badly the skin can be inverted at this pose; beyond 30 sculpts are added after it.",
    "error": "Colours how far the surface misses its sculpts, at the pose where it misses most, in metres.",
    "mask": "Colours the mask: what is kept from every brush, from 0 to 1.",
    "weight": "Colours how much the active joint moves the skin, from 0 to 1.",
}
_HEAT = Field("Colours", "What the posed mesh is coloured by; Mask and Weights show theirs while this is plain.")
_SIDES = Field("Side by side", "The same pose by several methods next to each other, all live: skin only (SSD), shapes "
               "(SI), pose space (PSD), weighted (WPSD).")
_OPTIONS = "core.workspace.ViewOptions"


class PoseLook(QWidget):
    """Two rows: the field, and the methods."""

    def __init__(self, desk: Desk, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.desk = desk
        self.heat = ChoiceBar(_HEAT, "", "", ("", *VIEWS), tuple(NAMES[kind] for kind in ("", *VIEWS)))
        self.sides = ChoiceBar(_SIDES, "off", "off", tuple(SIDES), tuple(SIDES))
        column = QVBoxLayout(self)
        column.setContentsMargins(8, 8, 8, 0)
        column.setSpacing(4)
        for bar in (self.heat, self.sides):
            column.addWidget(Row(bar.known.label, bar))
        self.heat.edited.connect(lambda kind, final: self._set(heat=kind))
        self.sides.edited.connect(lambda name, final: self._set(compare=SIDES[name]))
        desk.workspace_changed.connect(self._workspace_changed)
        desk.session_replaced.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Show what the view shows now."""
        view = self.desk.workspace.view
        self.heat.set_value(view.heat if view.heat in VIEWS else "")
        self.sides.set_value(next((name for name, methods in SIDES.items() if methods == view.compare), "off"))

    def _set(self, **changes: object) -> None:
        self.desk.set_workspace(view=self.desk.workspace.view.replace(**changes))

    def _workspace_changed(self, old: Workspace, new: Workspace) -> None:
        if old.view is not new.view:
            self.refresh()


def _needs_rig(desk: Desk) -> str | None:
    return None if desk.posed is not None else "There is no rig yet: open a USD, glTF or project file with joints."


def _with(**changes: object) -> Callable[[Window], None]:
    def run(window: Window) -> None:
        desk = window.desk
        desk.set_craft("pose")
        desk.set_workspace(view=desk.workspace.view.replace(**changes))

    return run


def _is(field: str, value: object) -> Callable[[Desk], bool]:
    return lambda desk: getattr(desk.workspace.view, field) == value


def _heat(kind: str) -> Command:
    return Command(
        f"view.heat_{kind or 'plain'}", f"Colours: {NAMES[kind]}", TOOLTIPS[kind], _with(heat=kind), _OPTIONS,
        enabled=_needs_rig, checked=_is("heat", kind), words="heat map field ramp pose rig show")


def _sides(name: str, methods: tuple[Method, ...]) -> Command:
    if not methods:
        return Command(
            "view.single", "Single view", "Shows the rig once again, by the method that its layers are set to.",
            _with(compare=()), _OPTIONS, enabled=_needs_rig, checked=_is("compare", ()), words="compare split panes")
    return Command(
        f"view.compare_{'_'.join(methods).replace('-', '_')}", f"Compare {name}",
        f"Shows the pose by {len(methods)} methods next to each other: {', '.join(LABELS[m] for m in methods)}.",
        _with(compare=methods), _OPTIONS, enabled=_needs_rig, checked=_is("compare", methods),
        words="compare split panes")


POSE_LOOK: tuple[Command, ...] = (
    *(_heat(kind) for kind in ("", *VIEWS)), *(_sides(name, methods) for name, methods in SIDES.items()))
