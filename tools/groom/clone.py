"""Clone: a strand or a lock is picked, then stamped elsewhere."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np

from core.errors import UserError
from core.field import field
from core.groom.clone import clone
from core.groom.guides import Guides
from core.overlay import Marker, Overlays, Polyline
from tools.groom.craft import GroomGround, nothing_to_do
from tools.ground import Pointer
from tools.ring import RingParams, ring_overlays, ring_radius
from tools.tool import Stroke, Tool

PICK = 12.0  # pixels around the pointer within which a single strand is found
MOST_SHOWN = 64  # strands of the source that are drawn


class CloneParams(RingParams):
    """Settings of Clone.

    source : ids of the picked guides. source_groom : id of their groom.
    """

    lock: Annotated[bool, field(
        "Whole lock", "Picks all strands that grow under the ring; off picks the one under the pointer.")] = False
    onto: Annotated[Literal["new", "strands"], field(
        "Stamps", "Plants new strands in place of what stands there, or reshapes the hair under the ring.",
        choices=("new", "strands"))] = "new"
    scale: Annotated[float, field(
        "Scale", "Size of the stamp: 1 is as large as what was picked.", "", (0.1, 3), (0.01, 100))] = 1.0
    twist: Annotated[float, field(
        "Twist", "Turns the stamp about the skin's normal where it goes, in degrees.", "rad", (-3.1416, 3.1416),
        (-100, 100))] = 0.0
    flip: Annotated[bool, field(
        "Flip", "Exchanges left and right of the stamp, for the other side of a body.")] = False
    variation: Annotated[float, field(
        "Variation", "How much each strand of a stamp differs in size, turn and lean.", "", (0, 1), (0, 1))] = 0.0
    source: tuple[int, ...] = ()
    source_groom: int = -1


class Clone(Tool[CloneParams]):
    """Picks and stamps."""

    name = "clone"
    label = "Clone"
    icon = "clone"
    order = 12
    tooltip = "Copies a strand or a whole lock: click one to pick it, then click where it should go."
    hint = "Click: pick, then stamp   Ctrl or Alt: pick another"
    step = "Clone"
    at_rest = True
    Params = CloneParams

    def begin(self, ground: GroomGround, pointer: Pointer) -> Stroke[Guides]:
        """Picks, or stamps what is picked."""
        if len(ground.guides) == 0:
            raise nothing_to_do()
        if pointer.ctrl or pointer.alt or not self._picked(ground).any():
            return PickStroke(self.params, ground, pointer)
        return StampStroke(self.params, ground)

    def hover(self, ground: GroomGround, pointer: Pointer) -> Overlays:
        """The ring and what is picked."""
        ring = self.params.lock or self.params.onto == "strands"
        found = ring_overlays(self.params, ground, pointer) if ring else ()
        rows = np.flatnonzero(self._picked(ground))[:MOST_SHOWN]
        if len(rows) == 0:
            return found
        return found + tuple(Polyline(line, "accent", 2.0) for line in ground.screen.pixels[rows])

    def _picked(self, ground: GroomGround) -> np.ndarray:
        """(G,) bool: what is picked of this groom."""
        if self.params.source_groom != ground.groom.id or not self.params.source:
            return np.zeros(len(ground.guides), np.bool_)
        return np.isin(ground.guides.ids, np.array(self.params.source, np.int64))


class PickStroke:
    """Picks at press."""

    def __init__(self, params: CloneParams, ground: GroomGround, pointer: Pointer) -> None:
        place = np.array([[pointer.x, pointer.y]], np.float64)
        if params.lock:
            radius = ring_radius(params, ground, pointer)
            rows, _ = ground.screen.reach(place, radius, through=False, roots_only=True)
        else:
            row = ground.screen.nearest(place[0], PICK)
            rows = np.array([] if row is None else [row], np.int64)
        if len(rows) == 0 and not ground.mirrored:
            raise UserError("There is no hair under the pointer; click a strand to pick what you want to copy.")
        self.picked: dict[str, Any] = {
            "source": ground.guides.ids[rows].tolist(), "source_groom": ground.groom.id,
        }
        self.lines = ground.screen.pixels[rows[:MOST_SHOWN]]

    def extend(self, guides: Guides, pointers: tuple[Pointer, ...]) -> Guides:
        """Picking edits nothing."""
        return guides

    def finish(self, guides: Guides) -> Guides:
        """Picking edits nothing."""
        return guides

    def overlays(self) -> Overlays:
        """What is picked."""
        return tuple(Polyline(line, "accent", 2.0) for line in self.lines)


class StampStroke:
    """Stamps at press; until the release the stamp follows the hand."""

    def __init__(self, params: CloneParams, ground: GroomGround) -> None:
        self.params, self.ground = params, ground
        self.last: Pointer | None = None

    def extend(self, guides: Guides, pointers: tuple[Pointer, ...]) -> Guides:
        """Guides with one stamp at the newest place."""
        self.last = pointers[-1]
        ground, p = self.ground, self.params
        base = guides if ground.mirrored else ground.guides  # the stamp of the sample before is gone
        hit = ground.hit(self.last)
        if hit is None:
            return base
        radius = None
        if p.onto == "strands":
            radius = ring_radius(p, ground, self.last) / ground.pixels_per_metre(hit.point)
        return clone(
            base, ground.rest, p.source, hit.triangle, hit.barycentric, scale=p.scale, twist=p.twist,
            flip=p.flip != ground.mirrored, variation=p.variation, seed=ground.seed, radius=radius, onto=p.onto,
            field=ground.rest_field,
        )

    def finish(self, guides: Guides) -> Guides:
        """Nothing more is done at release."""
        return guides

    def overlays(self) -> Overlays:
        """Where the middle of the stamp is."""
        return () if self.last is None else (Marker(self.last.x, self.last.y),)
