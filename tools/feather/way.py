"""The way of a hand over the skin, as tools that draw on it keep it."""

from __future__ import annotations

import numpy as np

from core.overlay import Overlays, Polyline, Tone
from tools.feather.craft import Array, FeatherGround
from tools.ground import Pointer
from tools.places import places_under

STEP = 3.0  # pixels between the places that are looked at
LEAST = 1e-3  # of the animal's diagonal: what a line of fewer points may be off


class SkinWay:
    """Where a hand went over the skin. Beside the animal it is not; when it comes back, the line goes on."""

    def __init__(self, ground: FeatherGround, tone: Tone, width: float = 2.0) -> None:
        self._ground, self._tone, self._width = ground, tone, width
        self._last: Array | None = None
        self._rest: list[Array] = []
        self._pixels: list[Array] = []

    def extend(self, pointers: tuple[Pointer, ...]) -> None:
        """The hand went on."""
        for pointer in pointers:
            end = np.array([pointer.x, pointer.y])
            start = end if self._last is None else self._last
            steps = max(1, int(np.ceil(np.linalg.norm(end - start) / STEP)))
            pixels = start + (end - start) * (np.arange(1, steps + 1) / steps)[:, None]
            found = places_under(self._ground, pixels)
            there = found.triangle >= 0
            self._rest.extend(found.rest[there])
            self._pixels.extend(pixels[there])
            self._last = end

    def line(self, off: float = 0.0) -> Array:
        """As few points (P, 3) at rest as keep within `off` metres of the way; none when it met no skin."""
        points = np.array(self._rest).reshape(-1, 3)
        if len(points) < 3:
            return points[np.r_[True, np.any(np.diff(points, axis=0) != 0.0, axis=1)]] if len(points) else points
        kept = _simplified(points, max(off, LEAST * self._ground.rest.diagonal))
        return points[kept]

    def overlays(self) -> Overlays:
        """The way so far."""
        if len(self._pixels) < 2:
            return ()
        return (Polyline(np.array(self._pixels), self._tone, self._width),)


def _simplified(points: Array, off: float) -> np.ndarray:
    """Rows of a line (P, 3) that keep it within `off` (Douglas and Peucker 1973)."""
    keep = np.zeros(len(points), bool)
    keep[[0, -1]] = True
    spans = [(0, len(points) - 1)]
    while spans:
        a, b = spans.pop()
        if b - a < 2:
            continue
        step = points[b] - points[a]
        t = np.clip((points[a + 1:b] - points[a]) @ step / max(float(step @ step), 1e-30), 0.0, 1.0)
        away = np.linalg.norm(points[a + 1:b] - points[a] - t[:, None] * step, axis=1)
        worst = int(away.argmax())
        if away[worst] > off:
            middle = a + 1 + worst
            keep[middle] = True
            spans += [(a, middle), (middle, b)]
    return np.flatnonzero(keep)
