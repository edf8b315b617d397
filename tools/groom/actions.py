"""Actions: what is done to a whole groom at once, without a stroke. ``Session.act(name, **params)`` does them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np

from core.document import Document, MeshObject, mesh_to_edit, with_groom
from core.errors import UserError
from core.evaluator import Evaluator
from core.field import field
from core.groom.collide import push_out
from core.groom.delete import delete
from core.groom.freeze import freeze, freeze_others, unfreeze
from core.groom.groom import Groom
from core.groom.guides import Guides
from core.groom.hairspray import spray, wash
from core.groom.length import lengths, scale_length, set_length
from core.groom.mirror import mirror
from core.groom.region import editable
from core.groom.resample import with_point_count
from core.groom.select import (
    select_all,
    select_inverse,
    select_islands,
    select_less,
    select_more,
    select_none,
)
from core.groom.smooth import smooth
from core.groom.straighten import straighten
from core.mesh.distance_field import DistanceField
from core.mesh.skin import Skin
from core.posed import field_at, skin_at
from core.record import Record
from core.workspace import Respect
from tools.action import AmountParams, NoParams, params_of
from tools.respect import Edits, respected, restored


@dataclass(frozen=True)
class Scene:
    """What an action may ask of the place its groom grows at. Actions work at rest, whatever pose is shown."""

    item: MeshObject
    evaluator: Evaluator

    @property
    def skin(self) -> Skin:
        """The skin at rest."""
        return skin_at(self.item, None, self.evaluator)

    @property
    def field(self) -> DistanceField:
        """What to collide with at rest (made at the first asking)."""
        return field_at(self.item, None, self.evaluator)


class LengthParams(Record):
    """Of setting a length."""

    length: Annotated[float, field(
        "Length", "The length all selected hair gets; 0 takes the mean of what it has.", "m", (0, 0.3), (0, 1e4))] = 0.0


class ScaleParams(Record):
    """Of scaling lengths."""

    factor: Annotated[float, field(
        "Factor", "What the size of selected hair is multiplied by, curls and all.", "", (0.2, 2), (0.01, 100))] = 1.1


class PointsParams(Record):
    """Of the number of points."""

    points: Annotated[int, field(
        "Points", "How many points every guide of this groom gets; more can hold tighter curls.", "", (4, 32),
        (2, 256), 1)] = 16


class MirrorParams(Record):
    """Of mirroring."""

    source: Annotated[Literal["+X", "-X"], field(
        "From side", "The side of the animal that is copied; the other one takes it over.",
        choices=("+X", "-X"))] = "+X"


class SmoothParams(Record):
    """Of smoothing."""

    along: Annotated[float, field(
        "Along the hair", "How much bends and curls of a strand even out along its length.", "", (0, 1), (0, 1))] = 0.5
    across: Annotated[float, field(
        "To its neighbours", "How much a strand turns to lie like those around it; 0 keeps locks apart.", "", (0, 1),
        (0, 1))] = 0.2
    passes: Annotated[int, field(
        "Passes", "How often it is done; more makes it smoother and slower.", "", (1, 20), (1, 100), 1)] = 4


Run = Callable[[Guides, Scene, Any], Guides]


class Action(NamedTuple):
    """One thing that is done to the active groom.

    name, label, icon : id, words, file in resources/icons without suffix or None. tooltip : what it does and when.
    step : name of the undo step. run : guides, the place they grow at and the parameters to new guides.
    edits : as of tools. Params : what it can be told; its fields are described by core.field.
    """

    name: str
    label: str
    tooltip: str
    step: str
    run: Run
    edits: Edits = "shape"
    Params: type[Record] = NoParams
    icon: str | None = None

    def make(self, params: dict[str, Any]) -> Record:
        """Its parameters from plain values; UserError naming the one that is not as it should be."""
        return params_of(self.label, self.Params, params)


def act(
    document: Document, groom: Groom, action: Action, params: Record, respect: Respect, evaluator: Evaluator
) -> Document:
    """The document with one action done to a groom; frozen hair stays, the rest as `respect` says.

    Raises
    ------
    UserError
        The groom or its mesh is locked, the groom is hidden, or there is nothing to do it to.
    """
    item = mesh_to_edit(document, groom)
    before = groom.guides
    if len(before) == 0:
        raise UserError("This groom has no guides yet; plant some first (the Plant or Scatter tool).")
    guides = respected(before, respect, action.edits)
    done = action.run(guides, Scene(item, evaluator), params)
    if done is guides:
        return document
    return with_groom(document, groom.replace(guides=restored(before, done, respect, action.edits)))


def _chosen(guides: Guides) -> Guides:
    if not guides.selected.any():
        raise UserError("Nothing is selected; select some hair first (the Select or Lasso tool).")
    return guides


def _set_length(guides: Guides, scene: Scene, params: LengthParams) -> Guides:
    now = lengths(guides.points)[editable(guides)]
    if len(now) == 0:
        return guides
    return set_length(guides, params.length or float(now.mean()))


def _mirror(guides: Guides, scene: Scene, params: MirrorParams) -> Guides:
    side = 1 if params.source == "+X" else -1
    copied = guides.points[:, 0, 0] * side > 0.0
    if guides.selected.any():
        copied &= guides.selected
    if not copied.any():  # the other side would be cleared for nothing
        raise UserError(f"There is no hair on the {params.source} side to copy; choose the other side.")
    return mirror(guides, scene.skin, source=side)


def _smooth(guides: Guides, scene: Scene, params: SmoothParams) -> Guides:
    return smooth(
        guides, along=params.along, across=params.across, iterations=params.passes, field=scene.field,
        ranges=scene.evaluator.workers.ranges,
    )


def _push_out(guides: Guides, scene: Scene, params: NoParams) -> Guides:
    out = push_out(guides, scene.field, ranges=scene.evaluator.workers.ranges)
    return guides if np.array_equal(out.points, guides.points) else out


_TABLE: tuple[Action, ...] = (
    Action(
        "select_all", "Select all", "Selects all hair of the groom that is not frozen, near and far.", "Select all",
        lambda g, s, p: select_all(g), "selection", icon="select"),
    Action(
        "select_none", "Select none", "Selects nothing, so that tools may edit all of the hair again.", "Select none",
        lambda g, s, p: select_none(g), "selection"),
    Action(
        "select_inverse", "Invert selection", "Selects what is not selected and leaves what is; frozen hair stays out.",
        "Invert selection", lambda g, s, p: select_inverse(g), "selection", icon="invert"),
    Action(
        "select_more", "Select more", "Adds the neighbours of the selected hair, a ring at a time.", "Select more",
        lambda g, s, p: select_more(_chosen(g)), "selection", icon="grow"),
    Action(
        "select_less", "Select less", "Takes the rim of the selected hair away, a ring at a time.", "Select less",
        lambda g, s, p: select_less(_chosen(g)), "selection", icon="shrink"),
    Action(
        "select_islands", "Select islands", "Selects all hair on the pieces of skin where some is selected.",
        "Select islands", lambda g, s, p: select_islands(_chosen(g), s.item.mesh), "selection", icon="group"),
    Action(
        "freeze_selected", "Freeze selected", "Freezes the selected hair, so that no tool changes it any more.",
        "Freeze selected", lambda g, s, p: freeze(_chosen(g)), "selection", icon="freeze"),
    Action(
        "freeze_others", "Freeze the others", "Freezes all hair but the selected, which alone can then be edited.",
        "Freeze the others", lambda g, s, p: freeze_others(_chosen(g)), "selection"),
    Action(
        "thaw_all", "Thaw all", "Thaws all frozen hair of the groom, so that tools change it again.", "Thaw all",
        lambda g, s, p: unfreeze(g), "selection"),
    Action(
        "delete_selected", "Delete selected", "Deletes the selected hair; frozen and sprayed hair stays where it is.",
        "Delete selected", lambda g, s, p: delete(_chosen(g)), "shape", icon="delete"),
    Action(
        "spray_selected", "Spray selected", "Sprays the selected hair (all, where none is) so that it holds its shape.",
        "Spray", lambda g, s, p: spray(g, p.amount), "hold", AmountParams, "hairspray"),
    Action(
        "wash_all", "Wash all", "Washes hairspray out of the selected hair, or all where none is selected.", "Wash all",
        lambda g, s, p: wash(g, p.amount), "hold", AmountParams, "wash"),
    Action(
        "mirror", "Mirror", "Copies one side of the groom to the other side, across the animal's X = 0 plane.",
        "Mirror", _mirror, "shape", MirrorParams, "symmetry"),
    Action(
        "resample", "Number of points", "Gives every guide of the groom another number of points, shapes kept.",
        "Number of points", lambda g, s, p: with_point_count(g, p.points), "shape", PointsParams),
    Action(
        "set_length", "Set length", "Brings the selected hair (all, where none is) to one length.", "Set length",
        _set_length, "shape", LengthParams, "length"),
    Action(
        "scale_length", "Scale", "Scales the selected hair (all, where none is) about its roots.", "Scale",
        lambda g, s, p: scale_length(g, p.factor), "shape", ScaleParams),
    Action(
        "push_out", "Push out of the skin", "Lifts hair that runs through the skin out of it, lengths kept.",
        "Push out of the skin", _push_out, "shape", icon="lift"),
    Action(
        "smooth_selected", "Smooth selected", "Evens out bends of the selected hair (all, where none is).", "Smooth",
        _smooth, "shape", SmoothParams, "smooth"),
    Action(
        "straighten", "Straighten", "Stretches the selected hair (all, where none is) along its line from root to tip.",
        "Straighten", lambda g, s, p: straighten(g, p.amount, field=s.field), "shape", AmountParams),
)

ACTIONS: dict[str, Action] = {action.name: action for action in _TABLE}
