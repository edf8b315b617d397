"""Feathers for the wings and the tail of a rig: rows measured by the bones, as those of a small perching bird.

From the body outward stand tertials on the upper arm, secondaries on the forearm and primaries on the hand; over their
quills lie greater, median and lesser coverts in one row each from the shoulder to the finger, so that the rows of the
wing run on into those of the back; below them coverts of the underside; on the thumb the alula.
"""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.feather.coat.tail_dress import anchor_of, as_triple, dress_tail, joint_patch
from core.feather.coat.wing import Wing, WingRow
from core.mesh.mesh import Mesh
from core.pose.rig import Rig
from core.record import freeze
from core.transform import normalized
from core.value import constant, formula

Array = NDArray[np.float64]

BONES = {
    "humerus": r"humerus|upper_?arm|up_?arm", "forearm": r"fore_?arm|ulna|radius|lower_?arm|elbow",
    "hand": r"hand|manus|carp|wrist",
}

RISING = 0.16  # by which the innermost feathers point up from the wing, so that they lie on the back when it folds
TILED = 0.08  # radians quills are rolled, so that neighbours lie over one another like tiles
DROP = 0.012  # of the arm, from one bone to the next, by which feathers outward lie lower than those they stand beside
FOLDED_AWAY = "0.3 + 0.7 * clamp(open, 0, 1)"  # of their length is left of feathers below a folded wing


class Plan(NamedTuple):
    """A row as it is measured by the bones: lengths are in those of the whole arm, angles in degrees.

    begin, end : on the bones, 0 the shoulder, 1 the elbow, 2 the wrist, 3 the finger tip; below 0 on the body.
    before : how far before the bones. shares, lengths, widths : from the body outward. height : above the bones.
    """

    name: str
    part: str
    many: int
    begin: float
    end: float
    before: float
    shares: tuple[float, ...]
    lengths: tuple[float, ...]
    widths: tuple[float, ...]
    height: float
    follow: float
    lift: float = 0.0
    bend: float = 0.0
    below: bool = False


ROWS = (
    Plan("tertials", "tertials", 3, 0.3, 0.95, -0.03, (0.0, 0.03), (0.5, 0.66), (1.5, 1.45), 0.0, 1.0),
    Plan("secondaries", "secondaries", 9, 1.0, 1.98, -0.03, (0.05, 0.34), (0.8, 0.88), (1.35, 1.25), 0.0, 1.0),
    Plan("primaries", "primaries", 9, 2.06, 2.97, -0.012, (0.39, 0.68, 1.0), (0.92, 1.1, 1.04), (1.15, 1.0, 0.85), 0.0,
         1.0),
    Plan("primary coverts", "primary coverts", 9, 2.06, 2.94, 0.006, (0.42, 0.68, 1.0), (0.36, 0.34, 0.3), (1.0, 0.9),
         0.012, 0.95),
    Plan("greater coverts", "greater coverts", 13, 0.1, 1.98, 0.0, (0.0, 0.12, 0.38), (0.32, 0.4, 0.4), (1.25, 1.2),
         0.013, 0.92),
    Plan("alula", "alula", 3, 2.05, 2.3, 0.022, (0.78, 0.95), (0.2, 0.3), (0.8, 0.8), 0.018, 0.9),
    Plan("median coverts", "median coverts", 15, -0.15, 2.1, 0.022, (0.0, 0.12, 0.42), (0.24, 0.26, 0.24), (1.5, 1.4),
         0.02, 0.85),
    Plan("lesser coverts, lower", "lesser coverts", 18, -0.25, 2.35, 0.034, (0.0, 0.15, 0.55), (0.19, 0.19, 0.16),
         (1.5, 1.5), 0.026, 0.75, 0.0, -1.0),
    Plan("lesser coverts, upper", "lesser coverts", 20, -0.35, 2.6, 0.044, (0.0, 0.15, 0.6), (0.16, 0.16, 0.13),
         (1.6, 1.5), 0.031, 0.7, 1.0, -2.0),
    Plan("marginal coverts", "lesser coverts", 24, -0.45, 2.95, 0.052, (0.0, 0.2, 0.75), (0.13, 0.13, 0.1), (1.6, 1.5),
         0.034, 0.6, 1.0, -4.0),
    Plan("greater under coverts", "under coverts", 19, 0.3, 2.9, 0.01, (0.0, 0.25, 1.0), (0.34, 0.36, 0.24), (1.3, 1.2),
         0.02, 0.95, below=True),
    Plan("lesser under coverts", "under coverts", 22, 0.1, 2.8, 0.04, (0.0, 0.2, 0.9), (0.2, 0.2, 0.14), (1.6, 1.5),
         0.026, 0.8, 4.0, -4.0, below=True),
)


class WingBones(NamedTuple):
    """A wing of a rig: joints of body, upper arm, forearm and hand, and places (4, 3) of shoulder .. finger tip."""

    joints: tuple[int, int, int, int]
    places: Array


def find_wings(mesh: Mesh, rig: Rig) -> list[WingBones]:
    """The wings of a rig, by the names of its joints: an upper arm, a forearm below it and a hand below that."""
    names = [name.lower() for name in rig.skeleton.names]
    found = []
    for joint, name in enumerate(names):
        if not re.search(BONES["humerus"], name) or rig.skeleton.parents[joint] < 0:
            continue
        forearm = _below(rig, joint, BONES["forearm"])
        hand = None if forearm is None else _below(rig, forearm, BONES["hand"])
        if forearm is None or hand is None:
            continue
        bind = rig.skeleton.bind[:, :3, 3]
        moved = mesh.points[joint_patch(rig, hand, 0.4)].astype(np.float64)
        if not len(moved):
            continue
        away = normalized(bind[hand] - bind[forearm])
        tip = moved[np.argmax((moved - bind[hand]) @ (away + normalized(bind[hand] - bind[joint])))]
        places = np.stack([bind[joint], bind[forearm], bind[hand], tip])
        found.append(WingBones((int(rig.skeleton.parents[joint]), joint, forearm, hand), places))
    return found


def arm_length(bones: WingBones) -> float:
    """Metres from the shoulder along the bones to the finger tip."""
    return float(np.linalg.norm(np.diff(bones.places, axis=0), axis=1).sum())


def dress_wings(mesh: Mesh, rig: Rig) -> tuple[Wing, ...]:
    """Wings for all arms of a rig that are wings, and a tail for its last joint of the tail.

    Raises
    ------
    UserError
        No joints of the rig are called as those of a wing.
    """
    bones = find_wings(mesh, rig)
    if not bones:
        raise UserError(
            "The rig has no wing: name the joints of each wing humerus, forearm and hand, one below the other.")
    made = [_wing(mesh, rig, one, number) for number, one in enumerate(bones)]
    size = float(np.mean([arm_length(one) for one in bones]))
    tail = dress_tail(mesh, rig, size, len(made))
    return (*made, *(() if tail is None else (tail,)))


def _below(rig: Rig, joint: int, pattern: str) -> int | None:
    """The nearest joint below another whose name has a pattern."""
    names, parents = rig.skeleton.names, rig.skeleton.parents
    under = {joint}
    for other in range(joint + 1, len(names)):
        if int(parents[other]) in under:
            if re.search(pattern, names[other].lower()):
                return other
            under.add(other)
    return None


def _wing(mesh: Mesh, rig: Rig, bones: WingBones, number: int) -> Wing:
    body, arm, forearm, hand = bones.joints
    places = bones.places
    size = arm_length(bones)
    normal, back = _plane(bones)
    anchors = tuple(
        anchor_of(mesh, rig, joint, places[max(k - 1, 0)]) for k, joint in enumerate((body, arm, forearm, hand)))
    end = normalized(places[3] - places[2])
    outer = normalized(end + 0.12 * back)
    body_way = normalized(places[0] - places[1])
    rows = tuple(_row(k, row, places, size, normal, back, body_way) for k, row in enumerate(ROWS))
    side = "left" if float(places[:, 0].mean()) > 0.0 else "right"  # animals look along +z
    return Wing(
        id=number, name=f"{side} wing" if number < 2 else f"{side} wing {number + 1}", kind="wing",
        anchors=anchors, rows=rows, inner=0, outer=3,
        inner_direction=as_triple(back + RISING * normal), outer_direction=as_triple(outer))


def _plane(bones: WingBones) -> tuple[Array, Array]:
    """The upper side of a wing and the way back from it, both unit and square to one another."""
    places = bones.places
    out = normalized(places[3] - places[0])
    bent = places[1] - places[0]
    back = bent - out * (bent @ out)  # the elbow lies behind the line from shoulder to finger
    if np.linalg.norm(back) < 0.02 * np.linalg.norm(places[3] - places[0]):
        back = np.array([0.0, 0.0, -1.0])  # where it is straight, away from where animals look
        back = back - out * (back @ out)
    back = normalized(back)
    normal = normalized(np.cross(out, back))
    if normal[1] < 0.0:  # documents have y up, and a wing's upper side looks there at rest
        normal = -normal
    return normal, back


def _on_bones(places: Array, at: float, body_way: Array) -> Array:
    if at <= 0.0:
        return places[0] - at * body_way * float(np.linalg.norm(places[1] - places[0]))
    low = min(int(at), 2)
    return np.asarray(places[low] + (at - low) * (places[low + 1] - places[low]))


def _row(number: int, plan: Plan, places: Array, size: float, normal: Array, back: Array, body_way: Array) -> WingRow:
    begin, end = plan.begin, plan.end
    # stations beside a joint rather than on it, so that each goes with one bone
    inside = [k + d for k in (1.0, 2.0) for d in (-0.12, 0.12) if begin < k + d < end]
    at = np.array(sorted({begin, end, *inside, *([0.0] if begin < 0.0 else [])}))
    way = (at - begin) / (end - begin)
    stations = np.stack([_on_bones(places, one, body_way) for one in at]) - plan.before * size * back
    anchors = np.clip(np.floor(at).astype(int) + 1, 0, 3)
    shares, lengths, widths = (
        np.interp(way, np.linspace(0.0, 1.0, len(v)), v) for v in (plan.shares, plan.lengths, plan.widths))
    return WingRow(
        id=number, name=plan.name, part=plan.part, count=plan.many, anchors=freeze(anchors.astype(np.int32)),
        places=freeze(stations.astype(np.float32)),
        normals=freeze(np.tile(-normal if plan.below else normal, (len(at), 1)).astype(np.float32)),
        shares=freeze(shares.astype(np.float32)), lengths=freeze((lengths * size).astype(np.float32)),
        widths=freeze(widths.astype(np.float32)), height=(plan.height + DROP * (3.0 - begin)) * size,
        step=DROP * (end - begin) / (plan.many - 1) * size, follow=plan.follow,
        roll=TILED if plan.follow == 1.0 else 0.0,
        length=formula(FOLDED_AWAY) if plan.below else constant(1.0),
        lift=constant(float(np.radians(plan.lift))), bend=constant(float(np.radians(plan.bend))),
    )
