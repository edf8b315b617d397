"""Meshes whose files do not say their unit or up axis: what was assumed is said in a bar, which reads them again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from app.window.files.opening import Assumed
from app.window.notice import NoticeBar
from core.document import Document
from core.formats.mesh_file import MeshFile
from core.units import METRES_PER_UNIT

if TYPE_CHECKING:
    from PySide6.QtWidgets import QWidget

    from app.window.desk import Desk

UNITS = {"Metres": "m", "Centimetres": "cm", "Millimetres": "mm", "Inches": "in", "Feet": "ft"}


class UnitBar(NoticeBar):
    """Offers the other units and up axes of the meshes that have just come in, until the document is worked on.

    Parameters
    ----------
    read_as : called with the `Assumed` and `unit` or `turn`, to read their files again in place of what came.
    """

    def __init__(self, desk: Desk, read_as: Callable[..., object], parent: QWidget | None = None) -> None:
        super().__init__("mesh", parent)
        self._read_as = read_as
        self._assumed: list[Assumed] = []
        for label, unit in UNITS.items():
            self.button(label, f"Reads what came in again as made in {label.lower()}, in place of it.",
                        partial(self._answer, unit=unit))
        self.turn_button = self.button(
            "Turn upright", "Reads what came in again with its other axis up: Z in place of Y, or back to Y.",
            partial(self._answer, turn=True))
        desk.changed.connect(self._document_changed)
        desk.session_replaced.connect(self._forget)

    def offer(self, assumed: Assumed) -> None:
        """Say what was assumed of a mesh that has just come in, together with those that came before it."""
        self._assumed.append(assumed)
        found = [one.found for one in self._assumed]
        units = units_of(found)
        for label in UNITS:
            self.buttons[label].setVisible(bool(units) and units != {label})
        self.turn_button.setVisible(any(one.up_source != "file" for one in found))
        self.tell(sentence([one.path.name for one in self._assumed], found))

    def _answer(self, **how: object) -> None:
        these = self._assumed
        self._forget()
        self._read_as(these, **how)

    def _document_changed(self, old: Document, new: Document) -> None:
        """Meshes that come in beside what there is are no work on it."""
        there = {id(item) for item in (*new.meshes, *new.grooms)}
        if len(new.meshes) <= len(old.meshes) or any(id(item) not in there for item in (*old.meshes, *old.grooms)):
            self._forget()

    def _forget(self) -> None:
        self._assumed = []
        self.hide()


def units_of(found: Sequence[MeshFile]) -> set[str]:
    """The units that files which do not say theirs were read in, as the buttons name them."""
    metres = {one.metres_per_unit for one in found if one.unit_source != "file"}
    return {label for label, unit in UNITS.items() if METRES_PER_UNIT[unit] in metres}


def sentence(names: Sequence[str], found: Sequence[MeshFile]) -> str:
    """What files with these names do not say, and how they were read."""
    units, ups = units_of(found), {one.up.upper() for one in found if one.up_source != "file"}
    read = [f"in {' and '.join(sorted(units)).lower()}"] if units else []
    read += [f"{' and '.join(sorted(ups))} up"] if ups else []
    corners = np.concatenate([[one.mesh.points.min(axis=0), one.mesh.points.max(axis=0)] for one in found])
    x, y, z = np.ptp(corners, axis=0).tolist()
    how = f"read {', '.join(read)}"
    size = f"{x:.3g} × {y:.3g} × {z:.3g} m"
    if len(names) == 1:
        lacks = "its unit" if units else "which axis is up"
        return f"{names[0]} does not say {lacks}: {how}, it is {size}." + (" It was made in:" if units else "")
    lacks = "their unit" if units else "which axis is up"
    return (f"{names[0]} and {len(names) - 1} more do not say {lacks}: {how}, together they are {size}."
            + (" They were made in:" if units else ""))
