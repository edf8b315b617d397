"""How many hairs are drawn while the hand moves: as many as keep the picture at the hand, changed rarely."""

from __future__ import annotations

import statistics

FLOOR = 3000
STEP = 1.3
LOOKED_AT = 5  # frames whose median decides
TOO_SLOW, FAR_TOO_SLOW = 1.12, 1.6  # of the budget: one step down, two
ROOM = 0.85  # of the budget: a step up must be expected to stay below it
COST_OF_STEP = 1.35
CALM = 10  # frames in a row before a step up


class DensityController:
    """Chooses a number of hairs from frame times (start of paint to picture shown), see :meth:`frame`.

    A number is only lowered inside a stroke, so that the coat does not grow under the hand; it is never below the
    floor or above what there is. It stands on a ladder of steps of 1.3, so that noise does not move it.
    """

    def __init__(self, budget_ms: float = 26.0, hairs: int = 8000, floor: int = FLOOR) -> None:
        self.budget_ms = budget_ms
        self.floor = floor
        self.hairs = max(hairs, floor)
        self.most = 1 << 30
        self.in_stroke = False
        self._times: list[float] = []
        self._calm = 0

    def begin_stroke(self) -> None:
        """From now on hairs may only become fewer."""
        self.in_stroke = True
        self._forget()

    def end_stroke(self) -> None:
        """From now on hairs may become more again."""
        self.in_stroke = False
        self._forget()

    def limit(self, most: int) -> None:
        """There are `most` hairs to draw."""
        self.most = max(most, 0)

    def frame(self, milliseconds: float) -> int:
        """Take note of the time of one moving frame; how many hairs the next one draws."""
        self._times = [*self._times[1 - LOOKED_AT :], milliseconds]
        if len(self._times) == LOOKED_AT:
            usual = statistics.median(self._times)
            if usual > TOO_SLOW * self.budget_ms:
                self._move(2 if usual > FAR_TOO_SLOW * self.budget_ms else 1, 1.0 / STEP)
            elif COST_OF_STEP * usual < ROOM * self.budget_ms:
                self._calm += 1
                if self._calm >= CALM and not self.in_stroke:
                    self._move(1, STEP)
            else:
                self._calm = 0
        return self.drawn

    @property
    def drawn(self) -> int:
        """How many hairs to draw now."""
        return min(self.hairs, self.most)

    def _move(self, steps: int, factor: float) -> None:
        wanted = max(round(self.hairs * factor**steps), self.floor)
        if factor > 1.0 and self.hairs >= self.most:
            wanted = self.hairs
        if wanted != self.hairs:
            self.hairs = wanted
        self._forget()

    def _forget(self) -> None:
        self._times = []
        self._calm = 0
