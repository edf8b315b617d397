"""A coat of feathers as a record: where feathers stand, how they lie, what is animated by hand."""

from __future__ import annotations

import re
from typing import Annotated

import numpy as np

from core.feather.coat.wing import Wing
from core.feather.dials import DIAL_NAMES
from core.feather.presets import bird_names
from core.field import field, fields_of
from core.mesh.roots import Roots
from core.record import Record, column, number, text
from core.value import Value, check_constant, constant, value_field

PLACEMENTS = ("even", "repulsion", "random", "rows", "grid", "uv", "field", "hand")
DIRECTIONS = ("keys", "flow", "strokes", "curvature")
MOST_FEATHERS = 2_000_000
NAMES = ("id", "u", "v", "tract", "age", "frame", "length", "spacing")  # what an expression may read for each feather
IDS = 1 << 24  # ids of one placement; the next one's begin after them


class Placement(Record):
    """One way of setting feathers on the skin; a coat may mix several, each with ids of its own.

    density_map, field_map : names of maps of the keys' groom; `field_map` is what kind "field" follows.
    tract : name of the tract feathers are kept in, or None.
    hand : the places of kind "hand". hand_ids : (N,) int32, ascending, their ids within the placement, below `count`,
        which counts all that were ever set; None while none was taken away.
    """

    kind: Annotated[str, field(
        "Placement",
        "How feathers are set: even, repulsion, random, in rows, on a grid, along UV or a field, or by hand.",
        choices=PLACEMENTS,
    )] = "rows"
    count: Annotated[int, field(
        "Feathers", "How many feathers are set where the density is 1; by hand it counts what was set.",
        soft=(100, 50_000), hard=(0, MOST_FEATHERS),
    )] = 10_000
    seed: Annotated[int, field(
        "Seed", "Another number sets and varies the feathers another way; the same one gives the same coat.",
        soft=(0, 100), hard=(0, 2**31 - 1), step=1,
    )] = 0
    density_map: str | None = None
    field_map: str | None = None
    tract: str | None = None
    hand: Roots | None = None
    hand_ids: np.ndarray | None = None

    def __post_init__(self) -> None:
        if self.kind not in PLACEMENTS:
            raise ValueError(f"Placement.kind must be one of {', '.join(PLACEMENTS)}, not {self.kind!r}")
        number(self, "count", least=0, most=MOST_FEATHERS)
        number(self, "seed", least=0, most=2**31 - 1)
        if (self.kind == "hand") != (self.hand is not None):
            raise ValueError("Placement.hand holds the places of kind hand, and of no other")
        if self.hand_ids is not None:
            column(self, "hand_ids", np.int32, (0 if self.hand is None else len(self.hand.faces),))
            if np.any(np.diff(self.hand_ids, prepend=-1, append=self.count) <= 0):
                raise ValueError("Placement.hand_ids ascend from 0 and stay below count")
        if self.kind == "field" and self.field_map is None:
            raise ValueError("Placement.field_map names the map that kind field follows")


class Tract(Record):
    """A band of skin on which feathers grow (a pteryla), drawn as a line of some width.

    line : (P, 3) float32, metres, on the skin at rest. width : metres, from edge to edge.
    """

    name: str
    line: np.ndarray
    width: float

    def __post_init__(self) -> None:
        text(self, "name")
        column(self, "line", np.float32, (None, 3))
        if not len(self.line):
            raise ValueError("Tract.line needs a point at least")
        number(self, "width", least=0.0)

    @property
    def part(self) -> str:
        """The part of the bird it is called after: its name without a number at the end."""
        return re.sub(r"[ _]\d+$", "", self.name)


class Stroke(Record):
    """A stroke on the skin that says which way feathers lie: points (P, 3) float32, metres at rest, root to tip."""

    points: np.ndarray

    def __post_init__(self) -> None:
        column(self, "points", np.float32, (None, 3))
        if len(self.points) < 2:
            raise ValueError("Stroke.points needs at least 2 points")


class AttributeValue(Record):
    """An attribute of the feathers (``core.feather.attributes``) and what it comes to on this coat."""

    name: str
    value: Value


class DialTurn(Record):
    """A dial (``core.feather.dials``) turned away from 0; `position` from -1 to 1."""

    name: str
    position: float

    def __post_init__(self) -> None:
        number(self, "position", least=-1.0, most=1.0)
        if self.name not in DIAL_NAMES:
            raise ValueError(f"DialTurn.name must be one of {', '.join(DIAL_NAMES)}, not {self.name!r}")


class KeyAttributes(Record):
    """Attributes of single keys, interpolated over the skin between them.

    ids : (K,) int32, keys (guides of the groom); names : A of them; values : (K, A) float32.
    """

    ids: np.ndarray
    names: tuple[str, ...]
    values: np.ndarray

    def __post_init__(self) -> None:
        column(self, "ids", np.int32, (None,))
        column(self, "values", np.float32, (len(self.ids), len(self.names)))
        if len(set(self.ids.tolist())) != len(self.ids) or len(set(self.names)) != len(self.names):
            raise ValueError("KeyAttributes holds a key or a name twice")


class Proxy(Record):
    """A feather taken over by hand: its shaft at keyed frames, in the frame of its root, so that it rides on the skin.

    id : of the feather. rest : (P, 3) float32, its shaft when it was taken over, metres: right, along, out.
    frames : (F,) float32, ascending. shafts : (F, P, 3) float32, as `rest`.
    rolls : (F,) float32, radians about the shaft.
    """

    id: int
    rest: np.ndarray
    frames: np.ndarray
    shafts: np.ndarray
    rolls: np.ndarray

    def __post_init__(self) -> None:
        number(self, "id", least=0, most=2**31 - 1)
        column(self, "frames", np.float32, (None,))
        column(self, "rest", np.float32, (None, 3))
        column(self, "shafts", np.float32, (len(self.frames), len(self.rest), 3))
        column(self, "rolls", np.float32, (len(self.frames),))
        if not len(self.frames) or np.any(np.diff(self.frames) <= 0.0):
            raise ValueError("Proxy.frames must ascend, and there must be one")
        if len(self.rest) < 2:
            raise ValueError("Proxy.rest needs at least 2 points on the shaft")


class FeatherCoat(Record):
    """Feathers on one mesh of the document.

    id : stable, unique among feather coats. keys_id : the groom whose guides are the keys, or None.
    preset : the bird feathers take their attributes from (``core.feather.presets``). Over it come `attributes`, over
        those that are one number for all feathers the `dials` (``core.feather.coat.worn``).
    """

    id: int
    name: str
    mesh_id: int
    keys_id: int | None = None
    preset: Annotated[str, field(
        "Bird", "The bird whose feathers these are: their form and colours on every part of the body.",
        choices=tuple(bird_names()),
    )] = "goldfinch"
    placements: tuple[Placement, ...] = (Placement(),)
    tracts: tuple[Tract, ...] = ()
    strokes: tuple[Stroke, ...] = ()
    attributes: tuple[AttributeValue, ...] = ()
    dials: tuple[DialTurn, ...] = ()
    key_attributes: KeyAttributes | None = None
    proxies: tuple[Proxy, ...] = ()
    wings: tuple[Wing, ...] = ()
    direction: Annotated[str, field(
        "Direction", "What says which way feathers lie: the combed keys, the body's flow, strokes, or its curvature.",
        choices=DIRECTIONS,
    )] = "keys"
    density: Annotated[Value, value_field(
        "Density", "The share of the feathers that is kept; the others stay where they are when you change it.",
        soft=(0.0, 1.0), hard=(0.0, 1.0),
    )] = constant(1.0)
    length: Annotated[Value, value_field(
        "Length", "Factor on the length of the keys for every feather; 1 is as long as the keys around it.",
        soft=(0.2, 2.0), hard=(1e-3, 1e3),
    )] = constant(1.0)
    width: Annotated[Value, value_field(
        "Width", "Factor on the width of every vane; wider feathers hide more of their neighbours.",
        soft=(0.3, 2.0), hard=(1e-3, 10.0),
    )] = constant(1.0)
    lift: Annotated[Value, value_field(
        "Lift", "Angle added to how far feathers stand off the skin; ruffled birds have a lot of it.",
        "rad", soft=(-0.2, 1.0), hard=(-1.0, 1.5),
    )] = constant(0.0)
    roll: Annotated[Value, value_field(
        "Roll", "Angle about the shaft by which the back lies over the flanks; neighbours then do not share a plane.",
        "rad", soft=(0.0, 0.3), hard=(-1.5, 1.5),
    )] = constant(0.12)
    curl: Annotated[Value, value_field(
        "Curl", "Angle by which the tips curl away from the skin, beyond what the keys do; below 0 they curl in.",
        "rad", soft=(-1.0, 1.0), hard=(-3.0, 3.0),
    )] = constant(0.0)
    yaw: Annotated[Value, value_field(
        "Yaw", "Angle in the skin by which feathers turn to their right, away from their direction.",
        "rad", soft=(-0.5, 0.5), hard=(-3.2, 3.2),
    )] = constant(0.0)
    ruffle: Annotated[Value, value_field(
        "Ruffle", "How far feathers stand up, each by its own share; key it for a bird that shakes itself.",
        soft=(0.0, 1.0), hard=(0.0, 4.0),
    )] = constant(0.0)
    puff: Annotated[Value, value_field(
        "Puff", "How far all feathers stand up together and curl in at the tips, as of a bird in the cold.",
        soft=(0.0, 1.0), hard=(0.0, 4.0),
    )] = constant(0.0)
    wind: Annotated[Value, value_field(
        "Wind", "Strength of the wind that lifts and turns the feathers it meets from behind; 1 is a strong one.",
        soft=(0.0, 1.0), hard=(0.0, 4.0),
    )] = constant(0.0)
    wind_direction: Annotated[tuple[float, float, float], field(
        "Wind direction", "Where the wind blows to, as a vector in the space of the scene; its length does not count.",
        soft=(-1.0, 1.0),
    )] = (0.0, 0.0, -1.0)
    variation: Annotated[float, field(
        "Variation", "How much feathers differ in length, lift, twist and direction; 0 sets them like tin tiles.",
        soft=(0.0, 1.0), hard=(0.0, 4.0),
    )] = 0.35
    overlap: Annotated[float, field(
        "Overlap", "How many rows a feather covers, where there are no keys to say how long it is.",
        soft=(2.0, 6.0), hard=(0.1, 50.0),
    )] = 3.7
    layered: Annotated[bool, field(
        "Layered", "Lays feathers over one another so that none passes through another or the skin.",
    )] = True
    hidden: Annotated[bool, field(
        "Hidden", "Leaves the feathers out of the view, of pictures and of exports; they stay in the project.",
    )] = False
    locked: Annotated[bool, field(
        "Locked", "Keeps every edit off these feathers until they are unlocked again.",
    )] = False

    def __post_init__(self) -> None:
        text(self, "name", "preset")
        number(self, "id", "mesh_id", least=0, most=2**31 - 1)
        number(self, "wind_direction")
        if self.direction not in DIRECTIONS:
            raise ValueError(f"FeatherCoat.direction must be one of {', '.join(DIRECTIONS)}, not {self.direction!r}")
        if len(self.placements) > 2**7 - 1:
            raise ValueError("FeatherCoat.placements are at most 127")
        for name, items in (("tracts", self.tracts), ("attributes", self.attributes), ("dials", self.dials)):
            if len({item.name for item in items}) != len(items):
                raise ValueError(f"FeatherCoat.{name} holds two of the same name")
        if len({proxy.id for proxy in self.proxies}) != len(self.proxies):
            raise ValueError("FeatherCoat.proxies holds two of one feather")
        if len({wing.id for wing in self.wings}) != len(self.wings):
            raise ValueError("FeatherCoat.wings holds two of the same id")
        named = {tract.name for tract in self.tracts}
        for placement in self.placements:
            if placement.tract is not None and placement.tract not in named:
                raise ValueError(f"FeatherCoat.placements: there is no tract {placement.tract!r}")
        for name, known in FEATHER_FIELDS.items():
            if known.hard is not None:
                check = check_constant if name in FEATHER_VALUES else number
                check(self, name, least=known.hard[0], most=known.hard[1])


FEATHER_FIELDS = fields_of(FeatherCoat)
FEATHER_VALUES = ("density", "length", "width", "lift", "roll", "curl", "yaw", "ruffle", "puff", "wind")
