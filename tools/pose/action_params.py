"""What actions of the pose craft can be told."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from core.field import field
from core.pose.pose import Vector
from core.record import Record

Axis = Literal["X", "Y", "Z"]
AXES: dict[Axis, Vector] = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}
_POSE = "Name of the sculpted pose; empty takes the one at the pose that is shown."


class FileParams(Record):
    """Of importing a sculpt."""

    file: Annotated[str, field(
        "File", "OBJ, USD or another mesh with the vertices and faces of the rig's file, in metres.")] = ""
    name: Annotated[str, field(
        "Name", "Name of the sculpted pose; empty takes that of the file, or of the sculpt that is there.")] = ""


class AddParams(Record):
    """Of making the pose that is shown a sample."""

    name: Annotated[str, field("Name", "Name of the new sculpted pose; empty finds a free one for it.")] = ""
    twins: Annotated[Literal["refuse", "merge", "delete"], field(
        "Twins", "What becomes of sculpts the pose cannot be told apart from: a refusal, one average, or deletion.",
        choices=("refuse", "merge", "delete"))] = "refuse"


class RestoreParams(Record):
    """Of taking sculpting back."""

    towards: Annotated[str, field(
        "Towards", "The pose whose shape is taken, by name; empty goes back to the skin without any sculpt.")] = ""
    amount: Annotated[float, field(
        "Amount", "How much of the way the surface goes, from nothing at 0 to all at 1.", "", (0, 1), (0, 1))] = 1.0


class MirrorSculptParams(Record):
    """Of mirroring a sculpt."""

    pose: Annotated[str, field("Pose", _POSE)] = ""
    way: Annotated[Literal["topology", "axis"], field(
        "Other side", "How the other side is found: by how polygons are joined, or by place at rest.",
        choices=("topology", "axis"))] = "topology"
    source: Annotated[Literal["+X", "-X"], field(
        "Source", "The side that is copied where the pose itself is the same on both sides.",
        choices=("+X", "-X"))] = "+X"


class PairParams(Record):
    """Of merging poses."""

    pose: Annotated[str, field("Pose", _POSE)] = ""
    into: Annotated[str, field(
        "Into", "Name of the pose of its layer that stays; empty takes the one nearest to it.")] = ""


class PoseParams(Record):
    """Of what is done to one sculpted pose."""

    pose: Annotated[str, field("Pose", _POSE)] = ""


class MoveParams(Record):
    """Of moving a sculpt to the pose that is shown."""

    pose: Annotated[str, field(
        "Pose", "Name of the sculpted pose to move; empty takes the one nearest to the pose shown.")] = ""


class MirrorPoseParams(Record):
    """Of mirroring the pose that is shown."""

    what: Annotated[Literal["whole pose", "selected joints"], field(
        "What", "The whole pose changes sides, or selected joints are copied to those opposite.",
        choices=("whole pose", "selected joints"))] = "whole pose"


class NameParams(Record):
    """Of storing a pose."""

    name: Annotated[str, field("Name", "Name of the pose in the library; empty finds a free one for it.")] = ""


class ApplyParams(Record):
    """Of taking a pose out of the library."""

    name: Annotated[str, field(
        "Name", "Name of a pose of the library, or of a sculpted one; empty takes the next of the library.")] = ""
    amount: Annotated[float, field(
        "Amount", "How much of the way the present pose goes there, from 0 to all at 1.", "", (0, 1), (0, 1))] = 1.0


class ForgetParams(Record):
    """Of deleting a pose of the library."""

    name: Annotated[str, field(
        "Name", "Name of the pose of the library to delete; empty takes the one that is shown.")] = ""


class SourceParams(Record):
    """Of mirroring weights."""

    source: Annotated[Literal["+X", "-X"], field(
        "Source", "The side of the mesh at rest whose weights are copied to the other.",
        choices=("+X", "-X"))] = "+X"


class SmoothParams(Record):
    """Of smoothing weights."""

    amount: Annotated[float, field(
        "Amount", "How far each weight goes to the mean of its neighbours, from 0 to 1.", "", (0, 1), (0, 1))] = 0.5
    passes: Annotated[int, field(
        "Passes", "How often it is done; more makes wider transitions and takes longer.", "", (1, 20), (1, 100),
        1)] = 2
    joints: Annotated[Literal["all", "active"], field(
        "Joints", "Smooth the weights of all joints, or of the active one while others make room.",
        choices=("all", "active"))] = "all"


class LimitParams(Record):
    """Of limiting influences."""

    influences: Annotated[int, field(
        "Influences", "How many joints may move one vertex at most; game engines often allow 4.", "", (1, 8), (1, 64),
        1)] = 4


class PruneParams(Record):
    """Of pruning weights."""

    least: Annotated[float, field(
        "Least", "Weights below this share are given to the other joints of their vertex.", "", (0, 0.1),
        (0, 0.5))] = 0.01


class TimesParams(Record):
    """Of growing, shrinking and blurring a mask."""

    times: Annotated[int, field(
        "Times", "How many rings of neighbours it goes, or how often the border is blurred.", "", (1, 10), (1, 100),
        1)] = 1


class DialParams(Record):
    """Of making a dial."""

    name: Annotated[str, field("Name", "Name of the dial, unlike that of any joint or control.")] = "dial"
    low: Annotated[float, field(
        "Lowest", "Where the dial ends below; it may be set beyond by a script.", "", (-10, 10), (-1e9, 1e9))] = 0.0
    high: Annotated[float, field(
        "Highest", "Where the dial ends above; it may be set beyond by a script.", "", (-10, 10), (-1e9, 1e9))] = 1.0
    rest: Annotated[float, field(
        "Rest", "Where the dial stands at rest, between its lowest and its highest.", "", (-10, 10),
        (-1e9, 1e9))] = 0.0


class PadParams(Record):
    """Of making a two-dimensional pad."""

    across: Annotated[str, field("Across", "Name of the dial that goes from left to right on the pad.")] = "valence"
    up: Annotated[str, field("Up", "Name of the dial that goes from below to above on the pad.")] = "arousal"
    reach: Annotated[float, field(
        "Reach", "Both dials go from minus this number to it, and rest in the middle.", "", (0.1, 10),
        (1e-6, 1e6))] = 1.0


class MovedParams(Record):
    """Of making something that moves a control."""

    name: Annotated[str, field("Name", "Name of the control, unlike that of any joint or control.")] = "switch"
    axis: Annotated[Axis, field(
        "Axis", "The direction of the object along which the movement is measured.", choices=("X", "Y", "Z"))] = "Y"
    travel: Annotated[float, field(
        "Travel", "How far it moves, in metres, for the number to go up by 1.", "m", (0.001, 1), (1e-9, 1e9))] = 0.1


class EditControlParams(Record):
    """Of changing a control."""

    name: Annotated[str, field("Name", "Name of the abstract control to change; empty takes the one added last.")] = ""
    to: Annotated[str, field("New name", "What it should be called; empty keeps the name that it has.")] = ""
    low: Annotated[float, field(
        "Lowest", "Where its range ends below; the same as above keeps the range it has.", "", (-10, 10),
        (-1e9, 1e9))] = 0.0
    high: Annotated[float, field(
        "Highest", "Where its range ends above; the same as below keeps the range it has.", "", (-10, 10),
        (-1e9, 1e9))] = 0.0
    rest: Annotated[float, field(
        "Rest", "Where it stands at rest within its new range, between lowest and highest.", "", (-10, 10),
        (-1e9, 1e9))] = 0.0


class ControlParams(Record):
    """Of deleting a control."""

    name: Annotated[str, field("Name", "Name of the abstract control to delete; empty takes the one added last.")] = ""


class AngleParams(Record):
    """Of limiting a joint."""

    low: Annotated[float, field(
        "Lowest", "The least angle about X, Y and Z, in degrees from rest.", "rad", (-math.pi, 0),
        (-math.pi, math.pi))] = -math.pi / 4
    high: Annotated[float, field(
        "Highest", "The greatest angle about X, Y and Z, in degrees from rest.", "rad", (0, math.pi),
        (-math.pi, math.pi))] = math.pi / 4


class ConstrainParams(Record):
    """Of leading a joint by another."""

    kind: Annotated[Literal["aim", "point", "orient"], field(
        "Kind", "The active joint aims at the other, follows its place, or turns along with it.",
        choices=("aim", "point", "orient"))] = "aim"
    weight: Annotated[float, field(
        "Weight", "How much of it is done, from not at all at 0 to all of it at 1.", "", (0, 1), (0, 1))] = 1.0
    axis: Annotated[Axis, field(
        "Axis", "Which axis of the joint points at the other, of the kind aim.", choices=("X", "Y", "Z"))] = "X"
