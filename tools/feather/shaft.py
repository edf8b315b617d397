"""Shaft: a feather taken by hand. Its shaft is pulled about its root, keyed at the frame, and given back."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np

from core.errors import UserError
from core.feather.coat.bend import place_on, pulled
from core.feather.coat.coat import FeatherCoat, Proxy
from core.feather.coat.pick import FeatherHit, feather_under
from core.feather.coat.plumages import Lying
from core.feather.coat.proxy import demoted, keyed, promoted, shaft_at
from core.feather.coat.wing import WING_IDS
from core.field import field
from core.overlay import Circle, Label, Marker, Overlay, Overlays, Polyline
from core.record import Record
from tools.feather.craft import Array, FeatherGround
from tools.ground import Pointer
from tools.tool import Stroke, Tool, Turn

How = Literal["bend", "turn", "lengthen", "roll", "give back"]
STILL = 3.0  # pixels the hand may move in a click
NEAREST = 0.2  # of the shaft: nearer to the root nothing is held
ROLLED = 0.01  # radians a pixel
SHOWN = 30  # pairs that cross, the worst


class ShaftParams(Record):
    """Settings of Shaft."""

    how: Annotated[How, field(
        "Drag", "A drag bends the shaft, turns it at its root, makes it longer too, rolls it, or gives it back.",
        choices=("bend", "turn", "lengthen", "roll", "give back"))] = "bend"


class HoldShaft:
    """A feather in the hand. A click only takes it over."""

    def __init__(
        self, params: ShaftParams, ground: FeatherGround, pointer: Pointer, lying: Lying, hit: FeatherHit
    ) -> None:
        self.how, self.ground, self.id = params.how, ground, hit.id
        self.pressed = np.array([pointer.x, pointer.y])
        proxy = proxy_of(ground.coat, hit.id)
        self.mine = proxy
        if proxy is None:
            rest = lying.rest
            proxy = promoted(
                ground.coat, hit.id, rest.layered.vanes[hit.row], rest.feathers.roots[hit.row],
                lying.rest_frames[hit.row], ground.frame).proxies[-1]
        self.taken = proxy
        self.local, self.roll = shaft_at(proxy, ground.frame)
        self.root = lying.laid.feathers.roots[hit.row].astype(np.float64)
        self.frame = lying.frames[hit.row].astype(np.float64)
        self.along = max(hit.along, NEAREST)
        origin, self.facing = ground.ray(pointer)
        self.at = origin + hit.distance * self.facing
        self.off = self.at - self._world(place_on(self.local, self.along))
        self.now, self.moved = self.local, False

    @property
    def step(self) -> str | None:
        """What the stroke turned out to be."""
        return None if self.moved else "Take over feather"

    def extend(self, matter: FeatherCoat, pointers: tuple[Pointer, ...]) -> FeatherCoat:
        """The coat with the feather where the hand has it."""
        last = np.array([pointers[-1].x, pointers[-1].y])
        self.moved = self.moved or bool(np.linalg.norm(last - self.pressed) > STILL)
        there = proxy_of(matter, self.id)
        if self.ground.mirrored and there is not self.mine:
            return matter  # on the midline: the other side has it in the hand
        if there is None:
            matter, self.mine = matter.replace(proxies=(*matter.proxies, self.taken)), self.taken
        if not self.moved:
            return matter
        roll = self.roll
        if self.how == "roll":
            roll += ROLLED * float((last - self.pressed) @ self._across())
        else:
            self.now = pulled(self.local, self.along, self._target(last), self.how)  # type: ignore[arg-type]
        made = keyed(matter, self.id, self.ground.frame, self.now.astype(np.float32), roll)
        self.mine = proxy_of(made, self.id)
        return made

    def finish(self, matter: FeatherCoat) -> FeatherCoat:
        """The coat as it is."""
        return matter

    def overlays(self) -> Overlays:
        """The shaft as it is now, and the place that is held."""
        held = self.ground.in_view(self._world(place_on(self.now, self.along))[None])[0]
        return (*_shaft_marks(self.ground, self._world(self.now)), Marker(float(held[0]), float(held[1])))

    def _world(self, local: Array) -> Array:
        return local @ self.frame + self.root

    def _target(self, pixel: Array) -> Array:
        """Where the hand wants the place it holds, in the frame of the root: it moves square to the line of sight."""
        origins, ways = self.ground.rays(pixel[None])
        depth = float((self.at - origins[0]) @ self.facing) / max(float(ways[0] @ self.facing), 1e-6)
        there: Array = (origins[0] + depth * ways[0] - self.off - self.root) @ self.frame.T
        return there

    def _across(self) -> Array:
        """The unit direction (2,) in the view square to the shaft."""
        root, tip = self.ground.in_view(self._world(self.local[[0, -1]]))
        along = tip - root
        return np.array([-along[1], along[0]]) / max(float(np.linalg.norm(along)), 1e-9)


class GiveBack:
    """A feather given back to the keys of its coat."""

    def __init__(self, ground: FeatherGround, feather: int) -> None:
        self.ground, self.id = ground, feather

    @property
    def step(self) -> str | None:
        """What it is."""
        return "Give feather back"

    def extend(self, matter: FeatherCoat, pointers: tuple[Pointer, ...]) -> FeatherCoat:
        """Nothing before the release."""
        return matter

    def finish(self, matter: FeatherCoat) -> FeatherCoat:
        """The coat with the feather procedural again."""
        return demoted(matter, self.id) if proxy_of(matter, self.id) is not None else matter

    def overlays(self) -> Overlays:
        """Nothing."""
        return ()


class Beside:
    """The mirrored hand where no feather is."""

    def extend(self, matter: FeatherCoat, pointers: tuple[Pointer, ...]) -> FeatherCoat:
        """Nothing."""
        return matter

    def finish(self, matter: FeatherCoat) -> FeatherCoat:
        """Nothing."""
        return matter

    def overlays(self) -> Overlays:
        """Nothing."""
        return ()


class Shaft(Tool[ShaftParams]):
    """Takes single feathers by hand (the proxies of the 2001 course)."""

    name = "shaft"
    label = "Shaft"
    icon = "shaft"
    order = 92
    tooltip = "Takes a single feather by hand: pull its shaft and it is keyed here, while its neighbours make way."
    hint = "Click: take a feather over   Drag: bend it   Shift+drag: turn it at its root   Ctrl+click: give it back"
    step = "Pose feather"
    craft = "feather"
    edits = "coat"
    with_shift = Turn("shaft", {"how": "turn"})
    with_ctrl = Turn("shaft", {"how": "give back"})
    with_eraser = Turn("shaft", {"how": "give back"})
    Params = ShaftParams

    def begin(self, ground: FeatherGround, pointer: Pointer) -> Stroke[FeatherCoat]:
        """The feather under the pointer in the hand."""
        lying = ground.lying()
        if lying is None:
            raise UserError("The feathers are still being laid; take one when they lie.")
        hit = picked(ground, lying, pointer)
        if hit is None:
            if ground.mirrored:
                return Beside()
            raise UserError("There is no feather here; press on the one to take by hand.")
        if hit.id >= WING_IDS:
            raise UserError("This feather is of a wing: choose its row and number under Wings in the feather panel.")
        if self.params.how != "give back":
            return HoldShaft(self.params, ground, pointer, lying, hit)
        if proxy_of(ground.coat, hit.id) is None and not ground.mirrored:
            raise UserError("This feather was not taken over by hand, so there is nothing to give back.")
        return GiveBack(ground, hit.id)

    def hover(self, ground: FeatherGround, pointer: Pointer) -> Overlays:
        """The feathers that were taken over, those that cross, and the outline of the one under the pointer."""
        known = ground.plumages.last(ground.coat.id)
        if known is None:
            return ()
        found: list[Overlay] = []
        for proxy in ground.coat.proxies:
            row = int(np.searchsorted(known.laid.ids, proxy.id))
            if row < len(known.laid.ids) and known.laid.ids[row] == proxy.id:
                shaft = shaft_at(proxy, ground.frame)[0] @ known.frames[row].astype(np.float64)
                found += _shaft_marks(ground, shaft + known.laid.feathers.roots[row])
        vanes = known.laid.layered.vanes
        for row in dict.fromkeys(np.stack([known.left.first, known.left.second], axis=1)[:SHOWN].ravel().tolist()):
            found.append(Polyline(ground.in_view(_border(vanes[row])), "trouble", 1.5, closed=True))
        lying = ground.lying() if not ground.waits else known
        hit = None if lying is None else picked(ground, lying, pointer)
        if lying is not None and hit is not None:
            words = f"feather {hit.id}" + ("" if proxy_of(ground.coat, hit.id) is None else ", by hand")
            found += [
                Polyline(ground.in_view(_border(lying.laid.layered.vanes[hit.row])), "selected", 1.5, closed=True),
                Label(pointer.x + 14.0, pointer.y - 10.0, words, "plain", plate=True)]
        return tuple(found)


def proxy_of(coat: FeatherCoat, feather: int) -> Proxy | None:
    """The proxy of a feather, or None while it is procedural."""
    return next((proxy for proxy in coat.proxies if proxy.id == feather), None)


def picked(ground: FeatherGround, lying: Lying, pointer: Pointer) -> FeatherHit | None:
    """The feather a pointer is on, or None."""
    origin, way = ground.ray(pointer)
    skin = ground.hit(pointer)
    within = np.inf if skin is None else float(np.linalg.norm(skin.point - origin)) + 1e-3 * ground.size
    return feather_under(lying.laid, origin, way, within)


def _border(vane: np.ndarray) -> Array:
    """The outline (K, 3) of a vane (R, C, 3)."""
    return np.concatenate([vane[:, 0], vane[-1, 1:-1], vane[::-1, -1], vane[0, -2:0:-1]]).astype(np.float64)


def _shaft_marks(ground: FeatherGround, shaft: Array) -> tuple[Overlay, ...]:
    """A shaft (P, 3) in space, and a ring at its root."""
    pixels = ground.in_view(shaft)
    return Polyline(pixels, "accent", 2.0), Circle(float(pixels[0, 0]), float(pixels[0, 1]), 3.5, "accent")
