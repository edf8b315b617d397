"""The craft of grooming: strokes change guides or maps, in the pose shown, on both sides, and heed what is to be
respected."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from core.document import Document, mesh_to_edit, with_groom
from core.errors import UserError
from core.groom.groom import Groom
from core.groom.guides import Guides
from core.mesh.distance_field import DistanceField
from core.posed import field_at, field_known, skin_at
from core.workspace import Respect
from tools.craft import Work
from tools.ground import Sight
from tools.map_edits import map_to_paint, paint_map
from tools.posed_guides import BackToRest, in_pose
from tools.respect import Edits, respected, restored
from tools.screen import Screen
from tools.skin_ground import TwoSidedGround, both_sides
from tools.tool import Tool


@dataclass(frozen=True, kw_only=True)
class GroomGround(TwoSidedGround):
    """What a stroke of grooming works on.

    guides : at press, in the pose shown (at rest for tools with ``at_rest``), with what is not respected taken off.
    at_rest : the tool works at rest, whatever pose is shown; roots are planted there.
    waits : see :attr:`field`.
    """

    groom: Groom
    guides: Guides
    respect: Respect
    at_rest: bool = False
    waits: bool = True

    @property
    def seed(self) -> int:
        """Of this stroke, for everything random in it."""
        return self.groom.guides.next_id

    @cached_property
    def shown(self) -> Guides:
        """The guides at press in the pose shown, for tools that work at rest too."""
        return in_pose(self.guides, self.skin) if self.at_rest and self.skin is not self.rest else self.guides

    @cached_property
    def screen(self) -> Screen:
        """Where the guides at press are on the screen (made at the first asking)."""
        return Screen(self.view, self.shown)

    @cached_property
    def back(self) -> BackToRest:
        """The way of edited guides from the pose shown to rest."""
        return BackToRest(self.guides, self.groom.guides, self.skin, self.evaluator.workers.ranges)

    @property
    def field(self) -> DistanceField | None:
        """What to collide with in the pose shown, made at the first asking.

        None while it is made elsewhere and nobody waits for it: the hand makes the stroke again when it is there.
        """
        if not self.waits and not field_known(self.item, self.frame, self.evaluator):
            return None
        return field_at(self.item, self.frame, self.evaluator)

    @property
    def rest_field(self) -> DistanceField:
        """What to collide with at rest."""
        return field_at(self.item, None, self.evaluator)


class GroomCraft:
    """Strokes that change the guides of the active groom."""

    name = "groom"
    label = "Groom"
    first = "comb"
    edits = ("shape", "hold", "selection", "map", "nothing")

    def __init__(self) -> None:
        self._known: tuple[tuple[Any, ...], tuple[GroomGround, ...]] | None = None
        self._prepared: tuple[Any, ...] | None = None  # what was last handed out to be prepared

    def grounds(self, session: Work, sight: Sight, tool: Tool[Any]) -> tuple[GroomGround, ...]:
        """The groom on one or both sides; UserError when there is none or something is locked."""
        workspace, document, groom = session.workspace, session.history.current, session.groom
        item, waits = mesh_to_edit(document, groom), session.waits
        key = (
            groom, item, workspace.frame, workspace.respect, sight.camera, sight.width, sight.height, document.unit,
            tool.at_rest, tool.edits, waits,
        )
        if self._known is not None and _same(self._known[0], key):
            return self._known[1]
        frame, evaluator = workspace.frame, session.evaluator
        skin, rest = skin_at(item, frame, evaluator), skin_at(item, None, evaluator)
        guides = respected(groom.guides, workspace.respect, cast(Edits, tool.edits))
        if not tool.at_rest and skin is not rest:
            guides = in_pose(guides, skin)
        grounds = tuple(
            GroomGround(
                sight, view, document.unit, mirrored, item=item,
                frame=frame, skin=skin, rest=rest, evaluator=evaluator, groom=groom, guides=guides,
                respect=workspace.respect, at_rest=tool.at_rest, waits=waits,
            )
            for view, mirrored in both_sides(sight, workspace.respect.symmetry)
        )
        self._known = (key, grounds)
        return grounds

    def matter(self, tool: Tool[Any], ground: GroomGround) -> Guides | NDArray[np.float32]:
        """The guides at press, or the values (V,) of the map that the tool paints."""
        return map_to_paint(ground.groom, ground.item, tool.params.map) if tool.edits == "map" else ground.guides

    def document(self, document: Document, tool: Tool[Any], ground: GroomGround, matter: Any) -> Document:
        """The document with these guides, at rest, or this map in place of what was at press."""
        if tool.edits == "map":
            return paint_map(document, ground.groom.id, matter, tool.params.map)
        if matter is ground.guides:
            return document
        guides = matter if tool.at_rest or ground.skin is ground.rest else ground.back(matter)
        guides = restored(ground.groom.guides, guides, ground.respect, cast(Edits, tool.edits))
        groom: Groom = ground.groom.replace(guides=guides)
        return with_groom(document, groom)

    shown = document

    def place(self, session: Work, ground: GroomGround) -> dict[str, Any]:
        """The groom, the frame and what is respected."""
        return {"groom": ground.groom.id, "frame": ground.frame, "respect": ground.respect}

    def ready(self, tool: Tool[Any], ground: GroomGround) -> bool:
        """False while a tool that shapes hair has nothing to collide with yet."""
        return tool.edits != "shape" or ground.field is not None

    def wait(self, ground: GroomGround) -> None:
        """Make what to collide with."""
        field_at(ground.item, ground.frame, ground.evaluator)

    def preparation(self, session: Work) -> Callable[[], object] | None:
        """The making of what to collide with at the present frame and at rest."""
        frame, evaluator = session.workspace.frame, session.evaluator
        try:
            item = mesh_to_edit(session.history.current, session.groom)
        except UserError:
            return None
        frames = [at for at in (frame, None) if not field_known(item, at, evaluator)]
        key = item.mesh, item.rig, item.correctives, item.pose, frame
        if not frames or (self._prepared is not None and _same(self._prepared, key)):
            return None
        self._prepared = key
        return lambda: [field_at(item, at, evaluator) for at in frames]


def nothing_to_do() -> UserError:
    """The same words everywhere for a groom without guides."""
    return UserError("This groom has no guides yet; plant some first (the Plant or Scatter tool).")


def _same(one: tuple[Any, ...], other: tuple[Any, ...]) -> bool:
    """True when all parts are the same object or equal."""
    return all(a is b or a == b for a, b in zip(one, other, strict=True))
