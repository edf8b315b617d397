"""A mesh whose file says neither unit nor up axis: what was assumed is said in a bar, which reads it again as given."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from app.window.notice import NoticeBar
from core.formats.mesh_file import MeshFile

if TYPE_CHECKING:
    from PySide6.QtWidgets import QWidget

    from app.window.desk import Desk

UNITS = {"Metres": "m", "Centimetres": "cm", "Millimetres": "mm", "Inches": "in", "Feet": "ft"}
NEW_UP = {"y": "z", "z": "y"}


class UnitBar(NoticeBar):
    """Offers the other units and up axes of the mesh that has just come in, until the document is worked on.

    Parameters
    ----------
    read_as : called with the path, the unit and the up axis to read the mesh again in place of the one that came.
    """

    def __init__(self, desk: Desk, read_as: Callable[[Path, str, str], object], parent: QWidget | None = None) -> None:
        super().__init__("mesh", parent)
        self._read_as = read_as
        self._path, self._unit, self._up = Path(), "m", "y"
        for label, unit in UNITS.items():
            self.button(label, f"Reads the mesh again as one made in {label.lower()}, in place of this one.",
                        partial(self._made_in, unit))
        self.turn_button = self.button(
            "Turn upright", "Reads the mesh again with its other axis up: Z in place of Y, or back to Y.",
            lambda: self._answer(self._unit, NEW_UP[self._up]))
        desk.changed.connect(self.hide)
        desk.session_replaced.connect(self.hide)

    def offer(self, path: Path, found: MeshFile, unit: str) -> None:
        """Say what was assumed of a mesh that has just come in. unit : it was read with."""
        self._path, self._unit, self._up = path, unit, found.up
        x, y, z = (found.mesh.points.max(axis=0) - found.mesh.points.min(axis=0)).tolist()
        word = next(label.lower() for label, name in UNITS.items() if name == unit)
        for label, name in UNITS.items():
            self.buttons[label].setVisible(name != unit)
        self.tell(f"{path.name} does not say its unit: read in {word}, {found.up.upper()} up, it is "
                  f"{x:.3g} × {y:.3g} × {z:.3g} m. It was made in:")

    def _made_in(self, unit: str) -> None:
        self._answer(unit, self._up)

    def _answer(self, unit: str, up: str) -> None:
        self.hide()
        self._read_as(self._path, unit, up)
