"""A groom: guides, the coat grown from them, and the maps that drive it."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from core.field import field, fields_of
from core.groom.guides import Guides
from core.record import Record, column, number, text
from core.value import Value, check_constant, check_names, constant, value_field

MOST_CHILDREN = 20_000_000
LARGEST_MAP = 16384  # pixels along a side
LONGEST = 1e3  # factor on the length of the guides
WIDEST = 1e3  # metres; only meshes in absurd units get there
NAMES = ("frame", "id", "u", "v")  # what an expression of a coat may read for each hair, beside the groom's maps


class Coat(Record):
    """What the children (the hairs) of a groom are like.

    What an artist would animate is a :class:`core.value.Value`: its expression may read :data:`NAMES` and every map of
    the groom, for each hair, and any of it may be multiplied by a map. The annotations hold the ranges: a lone
    constant must lie in the hard one, any other value is held in it after it is evaluated.

    density_map : name of the map of the groom the roots are scattered by, or None. `density` then takes hairs away
        without moving the others.
    length_map : name of the map of the groom that multiplies the length beside `length`, or None.
    """

    count: Annotated[int, field(
        "Hairs", "How many hairs are grown where the density is 1; change it to thicken the whole coat.",
        soft=(1_000, 500_000), hard=(0, MOST_CHILDREN),
    )] = 100_000
    seed: Annotated[int, field(
        "Seed", "Another number scatters and varies the hairs another way; the same one gives the same coat.",
        soft=(0, 100), hard=(0, 2**32 - 1), step=1,
    )] = 0
    density: Annotated[Value, value_field(
        "Density", "The share of the hairs that is kept; the others stay where they are when you change it.",
        soft=(0.0, 1.0), hard=(0.0, 1.0),
    )] = constant(1.0)
    reach: Annotated[float, field(
        "Reach", "How far over the skin hair grows from the nearest guide, thinning out; 0 m grows it everywhere.",
        "m", soft=(0.0, 0.2), hard=(0.0, LONGEST),
    )] = 0.0
    length: Annotated[Value, value_field(
        "Length", "Factor on the length of the guides for every hair; 1 is as long as the guides around it.",
        soft=(0.0, 2.0), hard=(0.0, LONGEST),
    )] = constant(1.0)
    width_root: Annotated[Value, value_field(
        "Width at the root", "Diameter of a hair where it leaves the skin, in metres; fur has about 0.00005.",
        "m", soft=(0.0, 5e-4), hard=(0.0, WIDEST),
    )] = constant(8e-5)
    width_tip: Annotated[Value, value_field(
        "Width at the tip", "Diameter of a hair at its end, in metres; less than at the root makes it taper.",
        "m", soft=(0.0, 5e-4), hard=(0.0, WIDEST),
    )] = constant(2e-5)
    color_root: Annotated[tuple[float, float, float], field(
        "Colour at the root", "Colour of the hairs where they leave the skin, as linear red, green and blue.",
        soft=(0.0, 1.0),
    )] = (0.10, 0.06, 0.035)
    color_tip: Annotated[tuple[float, float, float], field(
        "Colour at the tip", "Colour of the hairs at their ends, as linear red, green and blue.", soft=(0.0, 1.0),
    )] = (0.36, 0.24, 0.14)
    clump: Annotated[Value, value_field(
        "Clump", "How far hairs close up towards their guide at the tip; 0 not at all, 1 wet.",
        soft=(0.0, 1.0), hard=(0.0, 1.0),
    )] = constant(0.0)
    frizz: Annotated[Value, value_field(
        "Frizz", "How much each hair waves by itself, growing from its root to its tip; 0 is smooth.",
        soft=(0.0, 1.0), hard=(0.0, 1.0),
    )] = constant(0.0)
    length_variation: Annotated[Value, value_field(
        "Length variation", "The largest share by which a hair may be shorter than its neighbours; 0 cuts them even.",
        soft=(0.0, 1.0), hard=(0.0, 1.0),
    )] = constant(0.0)
    points: Annotated[int, field(
        "Points", "Points along every hair; more follow tight curls better but take more memory and time.",
        soft=(4, 32), hard=(2, 1024), step=1,
    )] = 16
    density_map: Annotated[str | None, field(
        "Density map", "The map that says where hair grows: 1 is full, 0 is bare skin.",
    )] = None
    length_map: Annotated[str | None, field(
        "Length map", "The map that multiplies the length of the hairs: 1 is full length, 0 none.",
    )] = None

    def __post_init__(self) -> None:
        number(self, "color_root", "color_tip", least=0.0, most=1e4)
        for name, known in COAT_FIELDS.items():
            if known.hard is not None:
                check = check_constant if name in COAT_VALUES else number
                check(self, name, least=known.hard[0], most=known.hard[1])


COAT_FIELDS = fields_of(Coat)
COAT_VALUES = ("density", "length", "width_root", "width_tip", "clump", "frizz", "length_variation")


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
    hidden : neither drawn nor exported, and no tool works on it.
    """

    id: int
    name: str
    mesh_id: int
    guides: Guides
    coat: Coat = Coat()
    maps: tuple[Map, ...] = ()
    hidden: Annotated[bool, field(
        "Hidden", "Leaves the groom out of the view, of pictures and of exports; it stays in the project.",
    )] = False
    locked: Annotated[bool, field(
        "Locked", "Keeps every tool and action off the groom until it is unlocked again.",
    )] = False

    def __post_init__(self) -> None:
        text(self, "name")
        number(self, "id", "mesh_id", least=0, most=2**31 - 1)
        names = [m.name for m in self.maps]
        if len(set(names)) != len(names):
            raise ValueError("Groom.maps holds two maps of the same name")
        for wanted in (self.coat.density_map, self.coat.length_map):
            if wanted is not None and wanted not in names:
                raise ValueError(f"Groom.coat uses the map {wanted!r}, which the groom does not have")
        readable = [name for name in names if name not in NAMES]
        for name in COAT_VALUES:
            check_names(getattr(self.coat, name), NAMES, readable, COAT_FIELDS[name].label)

    def map(self, name: str) -> Map | None:
        """The map of that name, or None."""
        return next((m for m in self.maps if m.name == name), None)
