"""A groom: guides, the coat grown from them, and the maps that drive it."""

from __future__ import annotations

import numpy as np

from core.groom.guides import Guides
from core.record import Record, column, number, text
from core.value import Value, constant

MOST_CHILDREN = 20_000_000
LARGEST_MAP = 16384  # pixels along a side


class Coat(Record):
    """What the children (the hairs) of a groom are like.

    count : children wanted at density 1.
    seed : of everything random about the coat.
    density : 0 .. 1, the share of the children shown.
    length : factor on the length of the guides; may follow the frame, an expression, a map.
    width_root, width_tip : DIAMETERS in metres.
    color_root, color_tip : linear RGB.
    clump : 0 .. 1, how far hairs close up towards their guide.
    frizz : 0 .. 1.
    length_variation : 0 .. 1, the largest share a hair may be shorter.
    points : points on each child.
    density_map, length_map : names of maps of the groom, or None.
    """

    count: int = 100_000
    seed: int = 0
    density: float = 1.0
    length: Value = constant(1.0)
    width_root: float = 8e-5
    width_tip: float = 2e-5
    color_root: tuple[float, float, float] = (0.10, 0.06, 0.035)
    color_tip: tuple[float, float, float] = (0.36, 0.24, 0.14)
    clump: float = 0.0
    frizz: float = 0.0
    length_variation: float = 0.0
    points: int = 16
    density_map: str | None = None
    length_map: str | None = None

    def __post_init__(self) -> None:
        number(self, "count", least=0, most=MOST_CHILDREN)
        number(self, "seed", least=0, most=2**32 - 1)
        number(self, "density", "clump", "frizz", "length_variation", least=0.0, most=1.0)
        number(self, "width_root", "width_tip", least=0.0, most=1e3)
        number(self, "color_root", "color_tip", least=0.0, most=1e4)
        number(self, "points", least=2, most=1024)


class Map(Record):
    """A painted number over the skin, either per vertex or as an image laid out by UV.

    values : (V,) float32, one per vertex of the mesh, or None.
    image : (H, W) float32, its first row at v = 1, or None. Exactly one of the two is given.
    """

    name: str
    values: np.ndarray | None = None
    image: np.ndarray | None = None

    def __post_init__(self) -> None:
        text(self, "name")
        if (self.values is None) == (self.image is None):
            raise ValueError("Map needs either values (one per vertex) or an image, and not both")
        if self.values is not None:
            column(self, "values", np.float32, (None,))
        if self.image is not None:
            column(self, "image", np.float32, (None, None))
            if not (min(self.image.shape) >= 1 and max(self.image.shape) <= LARGEST_MAP):
                raise ValueError(f"Map.image must be 1 to {LARGEST_MAP} pixels along each side")


class Groom(Record):
    """One groom on one mesh of the document.

    id : stable, unique in the document.
    mesh_id : the mesh it grows on.
    """

    id: int
    name: str
    mesh_id: int
    guides: Guides
    coat: Coat = Coat()
    maps: tuple[Map, ...] = ()

    def __post_init__(self) -> None:
        text(self, "name")
        number(self, "id", "mesh_id", least=0, most=2**31 - 1)
        names = [m.name for m in self.maps]
        if len(set(names)) != len(names):
            raise ValueError("Groom.maps holds two maps of the same name")
        for wanted in (self.coat.density_map, self.coat.length_map):
            if wanted is not None and wanted not in names:
                raise ValueError(f"Groom.coat uses the map {wanted!r}, which the groom does not have")

    def map(self, name: str) -> Map | None:
        """The map of that name, or None."""
        return next((m for m in self.maps if m.name == name), None)
