"""Guides: the curves an artist shapes, from which a coat of children is grown."""

from __future__ import annotations

import numpy as np

from core.mesh.roots import Roots
from core.record import Record, column, number


class Guides(Record):
    """Guide curves of one groom, all with the same number of points.

    ids : (G,) int32, stable and unique; everything random is keyed on them.
    roots : where each guide stands on the skin.
    points : (G, P, 3) float32, metres, object space of the rest mesh, root first; points[:, 0] lie on the skin.
    hold : (G, P) float32, hairspray: 0 free .. 1 locked, per point.
    selected, frozen : (G,) bool.
    next_id : the id the next planted guide gets (ids are never used twice).
    """

    ids: np.ndarray
    roots: Roots
    points: np.ndarray
    hold: np.ndarray
    selected: np.ndarray
    frozen: np.ndarray
    next_id: int

    def __post_init__(self) -> None:
        n = len(self.ids)
        column(self, "ids", np.int32, (n,))
        column(self, "points", np.float32, (n, None, 3))
        if n and self.points.shape[1] < 2:
            raise ValueError("Guides.points needs at least 2 points on every guide")
        column(self, "hold", np.float32, (n, self.points.shape[1]))
        column(self, "selected", np.bool_, (n,))
        column(self, "frozen", np.bool_, (n,))
        if len(self.roots.faces) != n:
            raise ValueError(f"Guides.roots has {len(self.roots.faces)} rows for {n} guides")
        ids = self.ids if np.all(self.ids[1:] > self.ids[:-1]) else np.sort(self.ids)  # mostly sorted already
        if n and (self.next_id <= int(ids[-1]) or np.any(ids[1:] == ids[:-1])):
            raise ValueError("Guides.ids must be unique and below next_id")
        number(self, "next_id", least=0, most=2**31 - 1)

    def __len__(self) -> int:
        return len(self.ids)
