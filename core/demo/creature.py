"""The animal of the demo: mesh, rig and painted maps."""

from __future__ import annotations

from typing import NamedTuple

from core.demo.maps import maps
from core.demo.rig import rig
from core.demo.shape import shape
from core.groom.groom import Map
from core.mesh.mesh import Mesh
from core.pose.rig import Rig


class Creature(NamedTuple):
    """A mesh at rest, the rig that moves it, and its maps "length" and "density" (per vertex, 0 .. 1)."""

    mesh: Mesh
    rig: Rig
    maps: tuple[Map, ...]


def demo_creature() -> Creature:
    """The animal: 8,192 quads, closed, symmetric across x = 0, y up, metres, looking along +z; always the same.

    Its rig has eight joints and a clip of 48 frames at 24 per second from frame 1001, in which it looks about. The maps
    are fractions of the coat's full length and density: nose, eyes and pads are bare.
    """
    animal = shape()
    painted = tuple(Map(name=name, values=values) for name, values in maps(animal.mesh).items())
    return Creature(animal.mesh, rig(animal), painted)
