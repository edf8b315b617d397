"""What a pen's samples go through before a tool sees them: spikes out, pressure through a curve, the way smoothed."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from core.errors import UserError
from core.field import field
from core.record import Record, number
from tools.ground import Pointer

SETTLING = 0.04  # seconds after the first touch in which tablets report pressures that were never meant


class PenSettings(Record):
    """How the pen feels.

    curve : points (pressure in, pressure out), each 0 .. 1, the inputs growing; straight lines between them.
    """

    curve: tuple[tuple[float, float], ...] = ((0.0, 0.0), (1.0, 1.0))
    spikes: Annotated[bool, field(
        "Spike filter", "Ignores the short burst of pressure that many tablets send at the first touch.")] = True
    smoothing: Annotated[float, field(
        "Stroke smoothing", "Steadies the hand: 0 follows every tremor, 1 draws long calm curves.", "", (0, 1), (0, 1))
    ] = 0.2

    def __post_init__(self) -> None:
        number(self, "smoothing", least=0.0, most=1.0)
        ins = [a for a, _ in self.curve]
        if len(ins) < 2 or any(not 0.0 <= v <= 1.0 for point in self.curve for v in point) or ins != sorted(set(ins)):
            raise ValueError("PenSettings.curve needs two or more points from 0 to 1 with growing inputs")


class Pen:
    """The samples of one stroke, filtered as they come."""

    def __init__(self, settings: PenSettings) -> None:
        self.settings = settings
        self._first: Pointer | None = None
        self._last: Pointer | None = None
        self._raw: Pointer | None = None
        self._lightest = 1.0

    def filtered(self, pointers: tuple[Pointer, ...]) -> tuple[Pointer, ...]:
        """The samples as tools should see them, as many as came.

        Raises
        ------
        UserError
            A sample is not made of finite numbers.
        """
        return tuple(self._one(pointer) for pointer in pointers)

    def caught_up(self) -> tuple[Pointer, ...]:
        """One more sample where the hand really is, when smoothing has left the newest one behind; else none."""
        if self._last is None or self._raw is None or (self._last.x, self._last.y) == (self._raw.x, self._raw.y):
            return ()
        self._last = self._last._replace(x=self._raw.x, y=self._raw.y)
        return (self._last,)

    def _one(self, pointer: Pointer) -> Pointer:
        if not np.isfinite([pointer.x, pointer.y, pointer.pressure, pointer.time]).all():
            raise UserError("The pen sent a place that is no number; lift it and try again.")
        if self._first is None:
            self._first = pointer
        self._raw = pointer
        pressure = min(max(pointer.pressure, 0.0), 1.0)
        if self.settings.spikes and pointer.time - self._first.time < SETTLING and self._first.pressure < 1.0:
            # a hand presses on gradually: the lightest touch so far is the one that was meant
            self._lightest = min(self._lightest, pressure)
            pressure = self._lightest
        ins, outs = zip(*self.settings.curve, strict=True)
        pressure = float(np.interp(pressure, ins, outs))
        x, y = pointer.x, pointer.y
        if self._last is not None:
            keep = 0.85 * self.settings.smoothing
            x, y = x + keep * (self._last.x - x), y + keep * (self._last.y - y)
        self._last = pointer._replace(x=x, y=y, pressure=pressure)
        return self._last
