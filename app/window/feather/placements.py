"""How the feathers of a coat are set: the list of its placements, each with its kind, number, map and tract."""

from __future__ import annotations

from typing import Any

from PySide6.QtWidgets import QHBoxLayout, QPushButton, QVBoxLayout, QWidget

from app.window.desk import Desk
from app.window.fields.choice_bar import ChoiceBar
from app.window.fields.number_bar import NumberBar
from app.window.sections import Row
from core.feather.coat.coat import PLACEMENTS, FeatherCoat, Placement
from core.field import Field, fields_of

FIRST = 500  # feathers of a placement that is added
_KNOWN = fields_of(Placement)
_WHICH = Field("Set", "Which of the ways feathers are set on this coat is shown below; a coat may mix several.")
_DENSITY = Field("Density map", "A painted map that says how closely feathers stand: black skin stays bare.")
_FOLLOWS = Field("Follows map", "The painted map whose lines of equal value the feathers of kind field stand along.")
_TRACT = Field("Tract", "The drawn band of skin these feathers keep to, or none for all of the skin.")
_LABELS = {"density_map": _DENSITY, "field_map": _FOLLOWS, "tract": _TRACT}


class PlacementList(QWidget):
    """The placements of one coat; every change is a step of the document, made when the hand lets go."""

    def __init__(self, desk: Desk, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.desk = desk
        self.coat: FeatherCoat | None = None
        self.which = ChoiceBar(_WHICH, 0, None, (0,))
        self.kind = ChoiceBar(_KNOWN["kind"], "rows", None)
        self.count = NumberBar(_KNOWN["count"], FIRST, whole=True)
        self.seed = NumberBar(_KNOWN["seed"], 0, 0, whole=True)
        self.names = {name: ChoiceBar(known, None, None, (None,), ("none",)) for name, known in _LABELS.items()}
        self.add, self.remove = QPushButton("Add"), QPushButton("Remove")
        self.add.setToolTip("Sets more feathers in another way; those there are stay as they stand.")
        self.remove.setToolTip("Takes the feathers of this placement away; all others stay as they stand.")
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(4)
        self.rows = {}
        for bar in (self.which, self.kind, self.count, self.seed, *self.names.values()):
            self.rows[bar] = Row(bar.known.label, bar)
            column.addWidget(self.rows[bar])
        buttons = QHBoxLayout()
        buttons.addStretch(1)
        buttons.addWidget(self.add)
        buttons.addWidget(self.remove)
        column.addLayout(buttons)
        self.which.edited.connect(lambda number, final: self.show_coat(self.coat, self._maps))
        self.kind.edited.connect(self._kind_chosen)
        self.count.edited.connect(lambda count, final: self._set(final, count=count))
        self.seed.edited.connect(lambda seed, final: self._set(final, seed=seed))
        for name, choice in self.names.items():
            choice.edited.connect(lambda value, final, name=name: self._set(final, **{name: value}))
        self.add.clicked.connect(self._add)
        self.remove.clicked.connect(self._remove)
        self._maps: tuple[str, ...] = ()

    def show_coat(self, coat: FeatherCoat | None, maps: tuple[str, ...]) -> None:
        """Show the placements of a coat, whose keys have these maps."""
        self.coat, self._maps = coat, maps
        there = [] if coat is None else [
            number for number, placement in enumerate(coat.placements) if placement.count or placement.hand is not None]
        self.setEnabled(coat is not None and not coat.locked)
        for row in self.rows.values():
            row.setVisible(bool(there))
        self.remove.setEnabled(bool(there))
        if coat is None or not there:
            return
        self.which.set_choices(there, [
            f"{number + 1} · {_many(coat.placements[number]):,} {coat.placements[number].kind}" for number in there])
        if self.which.value() not in there:
            self.which.set_value(there[0])
        placement, by_hand = coat.placements[self.which.value()], coat.placements[self.which.value()].hand is not None
        kinds = ["hand"] if by_hand else [kind for kind in PLACEMENTS if kind != "hand" and (kind != "field" or maps)]
        self.kind.set_choices(kinds)
        self.kind.set_value(placement.kind)
        self.count.set_value(placement.count)
        self.seed.set_value(placement.seed)
        offered = {"density_map": maps, "field_map": maps, "tract": tuple(tract.name for tract in coat.tracts)}
        for name, choice in self.names.items():
            choice.set_choices((None, *offered[name]), ("none", *offered[name]))
            choice.set_value(getattr(placement, name))
        self.rows[self.count].setVisible(not by_hand)
        self.rows[self.names["density_map"]].setVisible(not by_hand)
        self.rows[self.names["tract"]].setVisible(not by_hand)
        self.rows[self.names["field_map"]].setVisible(placement.kind == "field")

    def _kind_chosen(self, kind: str, final: bool) -> None:
        self._set(final, kind=kind, field_map=self._maps[0] if kind == "field" else None)

    def _set(self, final: bool, **changes: Any) -> None:
        from tools.feather_edits import set_placement

        if final and self.coat is not None:
            self.desk.edit("Set feathers otherwise", set_placement, self.coat.id, self.which.value(), **changes)
            self._again()

    def _add(self) -> None:
        from tools.feather_edits import add_placement

        if self.coat is not None:
            number = len(self.coat.placements)
            if self.desk.edit("Set more feathers", add_placement, self.coat.id, Placement(kind="even", count=FIRST)):
                self.which.set_value(number)
            self._again()

    def _remove(self) -> None:
        from tools.feather_edits import remove_placement

        if self.coat is not None:
            self.desk.edit("Remove placement", remove_placement, self.coat.id, self.which.value())
            self._again()

    def _again(self) -> None:
        """Show what the document has; what was refused goes back to what it was."""
        coats = {coat.id: coat for coat in self.desk.document.feathers}
        if self.coat is not None:
            self.show_coat(coats.get(self.coat.id), self._maps)


def _many(placement: Placement) -> int:
    return placement.count if placement.hand is None else len(placement.hand.faces)
