"""Wings and tails as records: rows of quills on bones, whose fan opens and folds with the joints.

A wing is held by anchors: patches of skin that one joint moves stiffly, so that a wing follows whatever moves the mesh.
A row is a line of stations from the body outward, each on an anchor. The feathers of a row stand evenly along it, and
point between two directions, that of the innermost feather and that of the outermost, each carried by an anchor: as the
tendon behind a wing's edge does, which opens and closes the quills with elbow and wrist.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np

from core.field import Field, field, fields_of
from core.record import Record, column, number, text
from core.value import Value, check_constant, constant, value_field

KINDS = ("wing", "tail")
WING_NAMES = ("k", "number", "open", "frame")  # what an expression reads; open is 1 as at rest
MOST_WINGS, MOST_ROWS, MOST_FEATHERS = 64, 64, 256
WING_IDS = 127 << 24  # ids of feathers of wings begin here, above those of every placement


class Anchor(Record):
    """A patch of skin that moves as one: the vertices a joint alone moves.

    joint : its name. vertices : (K,) int32 of the mesh, 3 or more that do not lie on a line.
    """

    joint: str
    vertices: np.ndarray

    def __post_init__(self) -> None:
        text(self, "joint")
        column(self, "vertices", np.int32, (None,))
        if len(self.vertices) < 3 or self.vertices.min() < 0:
            raise ValueError("Anchor.vertices needs at least 3 vertices of the mesh")


class WingOffset(Record):
    """What a hand adds to one feather of a row; numbers may be keyed, or follow an expression.

    number : of the feather, 1 the innermost.
    """

    number: int
    spread: Annotated[Value, value_field(
        "Spread", "Angle in the wing's plane by which this feather turns outward, away from the body.",
        "rad", soft=(-0.5, 0.5), hard=(-3.2, 3.2),
    )] = constant(0.0)
    lift: Annotated[Value, value_field(
        "Lift", "Angle by which this feather stands off the wing towards its upper side.",
        "rad", soft=(-0.5, 0.5), hard=(-1.6, 1.6),
    )] = constant(0.0)
    bend: Annotated[Value, value_field(
        "Bend", "Angle by which the tip of this feather bends up, as under load; below 0 it bends down.",
        "rad", soft=(-1.0, 1.0), hard=(-3.2, 3.2),
    )] = constant(0.0)
    twist: Annotated[Value, value_field(
        "Twist", "Angle by which this feather turns about its shaft, its leading edge up above 0.",
        "rad", soft=(-1.0, 1.0), hard=(-3.2, 3.2),
    )] = constant(0.0)

    def __post_init__(self) -> None:
        number(self, "number", least=1, most=MOST_FEATHERS)
        _check_values(self, OFFSET_FIELDS, OFFSET_VALUES)


class WingRow(Record):
    """A row of feathers of a wing, from the body outward, with S stations.

    id : stable, unique in the wing. part : of the bird, whose feathers these are (``core.feather.presets``).
    anchors : (S,) int32, of the wing. places, normals : (S, 3) float32, metres at rest; normals to the upper side.
    shares : (S,) float32, where between the wing's innermost direction 0 and outermost 1 a feather points.
    lengths : (S,) float32, metres. widths : (S,) float32, factors on the vanes.
    height : metres the row lies above its line. step : metres from a feather up to the next that lies over it.
    top : where in the row, 0 .. 1, lies the feather that lies over all others.
    roll : radians every feather of the row is rolled while it is open, its leading edge up, like tiles.
    cup : 1 / metre, how far vanes are bent across, so that a row lies around what it stands on.
    follow : how far the row follows the fan; 0 stays with the skin as at rest, 1 goes with the quills.
    """

    id: int
    name: str
    part: str
    anchors: np.ndarray
    places: np.ndarray
    normals: np.ndarray
    shares: np.ndarray
    lengths: np.ndarray
    widths: np.ndarray
    height: float = 0.0
    step: float = 1e-4
    top: float = 0.0
    roll: float = 0.0
    cup: float = 0.0
    count: Annotated[int, field(
        "Feathers", "How many feathers stand in this row, evenly from the body outward.",
        soft=(1, 24), hard=(0, MOST_FEATHERS), step=1,
    )] = 9
    follow: Annotated[float, field(
        "Follow", "How far this row goes with the fan of the quills: 0 stays with the skin, 1 goes all the way.",
        soft=(0.0, 1.0), hard=(0.0, 1.0),
    )] = 1.0
    length: Annotated[Value, value_field(
        "Length", "Factor on the length of the feathers of this row.", soft=(0.5, 1.5), hard=(1e-3, 10.0),
    )] = constant(1.0)
    width: Annotated[Value, value_field(
        "Width", "Factor on the width of the vanes of this row.", soft=(0.5, 2.0), hard=(1e-3, 10.0),
    )] = constant(1.0)
    spread: Annotated[Value, value_field(
        "Spread", "Angle in the wing's plane by which the feathers of this row turn outward, away from the body.",
        "rad", soft=(-0.5, 0.5), hard=(-3.2, 3.2),
    )] = constant(0.0)
    lift: Annotated[Value, value_field(
        "Lift", "Angle by which the feathers of this row stand off the wing towards its upper side.",
        "rad", soft=(-0.5, 0.5), hard=(-1.6, 1.6),
    )] = constant(0.0)
    bend: Annotated[Value, value_field(
        "Bend", "Angle by which the tips of this row bend up, as under load; below 0 they bend down.",
        "rad", soft=(-1.0, 1.0), hard=(-3.2, 3.2),
    )] = constant(0.0)
    twist: Annotated[Value, value_field(
        "Twist", "Angle by which the feathers of this row turn about their shafts, leading edges up above 0.",
        "rad", soft=(-1.0, 1.0), hard=(-3.2, 3.2),
    )] = constant(0.0)
    offsets: tuple[WingOffset, ...] = ()

    def __post_init__(self) -> None:
        text(self, "name", "part")
        number(self, "id", least=0, most=MOST_ROWS - 1)
        number(self, "count", least=0, most=MOST_FEATHERS)
        number(self, "follow", "top", least=0.0, most=1.0)
        number(self, "height", "step", least=-1e3, most=1e3)
        number(self, "cup", least=-1e6, most=1e6)
        number(self, "roll", least=-1.5, most=1.5)
        column(self, "anchors", np.int32, (None,))
        stations = len(self.anchors)
        column(self, "places", np.float32, (stations, 3))
        column(self, "normals", np.float32, (stations, 3))
        for name in ("shares", "lengths", "widths"):
            column(self, name, np.float32, (stations,))
        if stations < 1 or self.lengths.min() <= 0.0 or self.widths.min() <= 0.0:
            raise ValueError("WingRow needs a station at least, and lengths and widths above 0")
        if len({offset.number for offset in self.offsets}) != len(self.offsets):
            raise ValueError("WingRow.offsets holds two of one feather")
        _check_values(self, ROW_FIELDS, ROW_VALUES)


class Wing(Record):
    """The feathers of a wing or a tail.

    id : stable, unique in the coat. kind : the narrow vanes look outward from the body, in a tail from its middle.
    inner, outer : anchors that carry the directions of the innermost and of the outermost feather; `inner_direction`,
    `outer_direction` : those at rest, object space. middle : the share about which ``fan`` opens and closes.
    """

    id: int
    name: str
    kind: str
    anchors: tuple[Anchor, ...]
    rows: tuple[WingRow, ...]
    inner: int
    outer: int
    inner_direction: tuple[float, float, float]
    outer_direction: tuple[float, float, float]
    middle: float = 0.0
    fan: Annotated[Value, value_field(
        "Fan", "Factor on how far the fan is open: 1 as the joints open it, 0 folds every feather onto the others.",
        soft=(0.0, 1.5), hard=(-1.0, 3.0),
    )] = constant(1.0)

    def __post_init__(self) -> None:
        text(self, "name")
        number(self, "id", least=0, most=MOST_WINGS - 1)
        number(self, "middle", least=0.0, most=1.0)
        number(self, "inner_direction", "outer_direction", least=-1e6, most=1e6)
        if self.kind not in KINDS:
            raise ValueError(f"Wing.kind must be one of {', '.join(KINDS)}, not {self.kind!r}")
        if not any(self.inner_direction) or not any(self.outer_direction):
            raise ValueError("Wing needs directions that are not 0")
        if not (0 <= self.inner < len(self.anchors) and 0 <= self.outer < len(self.anchors)):
            raise ValueError("Wing.inner and Wing.outer name anchors of the wing")
        if len({row.id for row in self.rows}) != len(self.rows):
            raise ValueError("Wing.rows holds two of the same id")
        for row in self.rows:
            if row.anchors.min() < 0 or row.anchors.max() >= len(self.anchors):
                raise ValueError(f"Wing.rows: {row.name!r} stands on an anchor that the wing does not have")
        _check_values(self, WING_FIELDS, ("fan",))


OFFSET_FIELDS, ROW_FIELDS, WING_FIELDS = fields_of(WingOffset), fields_of(WingRow), fields_of(Wing)
OFFSET_VALUES = ("spread", "lift", "bend", "twist")
ROW_VALUES = ("length", "width", *OFFSET_VALUES)


def first_id(wing: Wing, row: WingRow) -> int:
    """The id of the innermost feather of a row; the others follow outward."""
    return WING_IDS + (wing.id << 16) + (row.id << 8)


def _check_values(record: Record, fields: dict[str, Field], names: tuple[str, ...]) -> None:
    for name in names:
        hard = fields[name].hard
        assert hard is not None  # every value of a wing has its range
        check_constant(record, name, least=hard[0], most=hard[1])
