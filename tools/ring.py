"""The ring of a brush: its settings, and how large and strong it is at a pointer."""

from __future__ import annotations

from typing import Annotated

from core.falloff import SHAPES, Shape
from core.field import field
from core.overlay import Circle, Overlays
from core.record import Record
from tools.ground import Ground, Pointer

WORLD_PIXELS = 1000.0  # a size in the world is given as pixels at this many pixels per diagonal of the skin
LIGHTEST = 0.05  # of its size a ring keeps under the lightest touch
HALF = {"smooth": 0.5, "flat": 0.6, "linear": 0.5, "sharp": 0.3, "constant": 1.0}  # of the radius, where half is left


class RingParams(Record):
    """What everything with a ring has."""

    size: Annotated[float, field(
        "Size", "Radius of the ring, in pixels of the screen or along the skin.", "px", (8, 300), (1, 4000))] = 70.0
    world: Annotated[bool, field(
        "Size in world", "Keeps the ring the same size on the skin when you zoom; off keeps it in pixels.")] = False
    pressure_size: Annotated[bool, field(
        "Pen sizes", "Pressing the pen harder makes the ring larger, up to its full size.")] = False


class ReachParams(RingParams):
    """What every ring has that reaches hair which is there already."""

    through: Annotated[bool, field(
        "Far side too", "Reaches hair on the far side of the animal as well as what you see.")] = False


class BrushParams(ReachParams):
    """What every brush has: a ring that fades, more or less strong."""

    strength: Annotated[float, field(
        "Strength", "How much one pass of the brush does, from nothing at 0 to all at 1.", "", (0, 1), (0, 1))] = 0.6
    falloff: Annotated[Shape, field(
        "Falloff", "How the brush fades from the middle of its ring to the rim.", choices=SHAPES)] = "smooth"
    pressure_strength: Annotated[bool, field(
        "Pen strength", "Pressing the pen harder makes the brush stronger, up to its full strength.")] = True


def ring_radius(params: RingParams, ground: Ground, pointer: Pointer) -> float:
    """Radius of the ring in pixels at a pointer, the pen's pressure included."""
    radius = params.size
    if params.world:
        hit = ground.hit(pointer)
        metres = params.size / WORLD_PIXELS * ground.size
        radius = metres * ground.pixels_per_metre(None if hit is None else hit.point)
    return radius * (max(pointer.pressure, LIGHTEST) if params.pressure_size else 1.0)


def ring_strength(params: BrushParams, pointer: Pointer) -> float:
    """Strength 0 .. 1 at a pointer, the pen's pressure included."""
    return params.strength * (pointer.pressure if params.pressure_strength else 1.0)


def ring_overlays(params: RingParams, ground: Ground, pointer: Pointer) -> Overlays:
    """The ring at the pointer, and within it where a brush that fades has half its weight."""
    radius = ring_radius(params, ground, pointer)
    ring = Circle(pointer.x, pointer.y, radius)
    half = HALF[params.falloff] if isinstance(params, BrushParams) else 1.0
    return (ring,) if half == 1.0 else (ring, Circle(pointer.x, pointer.y, half * radius, "faint", 1.0))
