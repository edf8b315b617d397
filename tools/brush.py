"""What strokes with a ring share: the way since the last samples, and the hair that the ring reached on it."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from core.groom.guides import Guides
from core.groom.region import editable
from core.groom.rows import take_rows
from core.overlay import Overlays
from core.record import freeze
from tools.groom.craft import GroomGround
from tools.ground import Ground, Pointer
from tools.ring import BrushParams, ReachParams, RingParams, ring_radius, ring_strength
from tools.screen import Screen

R = TypeVar("R", bound=RingParams)
A = TypeVar("A", bound=ReachParams)
G = TypeVar("G", bound=Ground)
V = TypeVar("V")
DAB = 0.25  # what a press alone does, as much as this way in radii
MOST_DABS = 32  # of one batch of samples


class RingStroke(Generic[R, G, V]):
    """A stroke with a ring, of any craft. A subclass says in :meth:`brush` what one piece of the way does.

    way : (K, 2) pixels since the last samples, one point at press. radius : pixels there. last : the newest sample.
    """

    def __init__(self, params: R, ground: G) -> None:
        self.params, self.ground = params, ground
        self.way: NDArray[np.float64] = np.empty((0, 2))
        self.radius = 0.0
        self.last: Pointer | None = None

    def brush(self, matter: V, /) -> V:
        """The matter after the piece `way` of the stroke."""
        raise NotImplementedError

    def extend(self, matter: V, pointers: tuple[Pointer, ...]) -> V:
        """The matter after these samples."""
        samples = pointers if self.last is None else (self.last, *pointers)
        self.way = np.array([(p.x, p.y) for p in samples], np.float64)
        self.last = pointers[-1]
        self.radius = ring_radius(self.params, self.ground, self.last)
        return self.brush(matter)

    def finish(self, matter: V) -> V:
        """Nothing more is done at release."""
        return matter

    def overlays(self) -> Overlays:
        """Nothing but the ring."""
        return ()

    @property
    def travel(self) -> float:
        """The way in radii: what a brush does per time must not depend on how often the mouse speaks."""
        if len(self.way) == 1:
            return DAB
        return float(np.linalg.norm(np.diff(self.way, axis=0), axis=1).sum()) / max(self.radius, 1e-9)

    def dabs(self) -> list[Pointer]:
        """The way in equal pieces, at most a quarter of a radius each: pointers at their ends, one at press."""
        assert self.last is not None
        count = min(max(int(np.ceil(self.travel / DAB)), 1), MOST_DABS)
        if len(self.way) == 1:
            return [self.last] * count
        length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(self.way, axis=0), axis=1))])
        at = length[-1] * np.arange(1, count + 1) / count
        places = (np.interp(at, length, self.way[:, k]).tolist() for k in range(2))
        return [self.last._replace(x=x, y=y) for x, y in zip(*places, strict=True)]

    @property
    def dose(self) -> float:
        """Strength times travel."""
        assert isinstance(self.params, BrushParams)
        assert self.last is not None
        return ring_strength(self.params, self.last) * self.travel


class BrushStroke(RingStroke[A, GroomGround, Guides]):
    """A stroke with a ring that reaches guides."""

    @cached_property
    def screen(self) -> Screen:
        """Where the guides are on the screen."""
        return Screen(self.ground.view, self.ground.guides)

    def under(
        self, guides: Guides, only_editable: bool = True, roots_only: bool = False
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Rows the ring reached on its way and weights (R, P) of their points (see :meth:`Screen.reach`)."""
        self.screen.follow(guides)
        shape = self.params.falloff if isinstance(self.params, BrushParams) else "constant"
        rows, weights = self.screen.reach(self.way, self.radius, shape, self.params.through, roots_only)
        if only_editable:
            may = editable(guides)[rows]
            rows, weights = rows[may], weights[may]
        return rows, weights


def on_rows(guides: Guides, rows: NDArray[np.int64], change: Callable[[Guides], Guides]) -> Guides:
    """Guides of which `change` saw and shaped only some rows, all of them editable. Ids and roots stay."""
    if len(rows) == 0:
        return guides
    part = take_rows(guides, rows)
    done = change(part)
    changes: dict[str, Any] = {}
    for name in ("points", "hold"):
        new = getattr(done, name)
        if new is not getattr(part, name):
            column = getattr(guides, name).copy()
            column[rows] = new
            changes[name] = freeze(column)
    return guides.replace(**changes) if changes else guides


