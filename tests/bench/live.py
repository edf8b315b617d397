"""The scene while it is edited: what one event costs on the thread of the window, and what waits for other threads."""

from __future__ import annotations

import itertools
import statistics
import time
from collections.abc import Callable, Iterator

import numpy as np

from core.demo.document import demo_document
from core.document import with_groom
from core.evaluator import Evaluator
from core.groom.groom import Groom, Map
from core.groom.plant import plant_scatter
from core.groom.rows import take_rows
from core.mesh.skin import skin_at_rest
from core.record import freeze
from core.value import constant
from tests.bench.bench import Row
from viewport.live_scene import LiveScene

TITLE = "The live scene: 100,000 hairs on 2,500 guides"
HAIRS, GUIDES, SHOWN = 100_000, 2500, 3000
SLICE = 25.0  # milliseconds that the window may stand still


class Hand:
    """Drives a live scene as the window does."""

    def __init__(self) -> None:
        self.evaluator = Evaluator()
        self.document = demo_document(self.evaluator, HAIRS, GUIDES)
        self.scene = LiveScene(self.evaluator)
        self.frame = 1001.0

    @property
    def groom(self) -> Groom:
        return self.document.grooms[0]

    def update(self, stroking: bool = True, hairs: int | None = SHOWN) -> float:
        """Milliseconds of one update."""
        start = time.perf_counter()
        self.scene.update(self.document, self.frame, stroking=stroking, hairs=hairs)
        return (time.perf_counter() - start) * 1e3

    def edit(self, function: Callable[[Groom], Groom]) -> float:
        """Milliseconds of the update after an edit while the hand moves."""
        self.document = with_groom(self.document, function(self.groom))
        return self.update()

    def jobs(self) -> float:
        """Do what other threads would do; milliseconds."""
        start = time.perf_counter()
        for job in self.scene.wanted_jobs():
            self.scene.adopt(job.run())
        return (time.perf_counter() - start) * 1e3

    def slices(self) -> list[float]:
        """Milliseconds of every slice until nothing is owed."""
        found = []
        while True:
            start = time.perf_counter()
            if self.scene.catch_up() is None:
                return found
            found.append((time.perf_counter() - start) * 1e3)

    def rest(self) -> list[float]:
        """Everything that is owed, jobs too; milliseconds of the slices."""
        found = []
        for _ in range(6):
            self.update(stroking=False)
            self.jobs()
            self.update(stroking=False)
            found += self.slices()
        return found


def run() -> list[Row]:
    hand = Hand()
    rows = [Row("first update: guides and skin are there", hand.update(stroking=False), "ms", SLICE)]
    rows.append(Row("job: growing the coat and preparing the skin", hand.jobs(), "ms"))
    rows.append(Row("update that shows the coat", hand.update(stroking=False), "ms", SLICE))
    rows += _slices("after growing", hand.rest())
    rows += _strokes(hand, "")
    rows += _numbers(hand)
    rows += _playing(hand)
    hand.frame = 1020.0
    hand.rest()
    rows += _strokes(hand, " on the posed animal")
    hand.evaluator.close()
    return rows


def _slices(when: str, times: list[float]) -> list[Row]:
    return [
        Row(f"slices {when}, the longest", max(times), "ms", SLICE),
        Row(f"slices {when}, together ({len(times)})", sum(times), "ms"),
    ]


def _strokes(hand: Hand, where: str) -> list[Row]:
    near = np.argsort(np.linalg.norm(hand.groom.guides.points[:, 0] - hand.groom.guides.points[0, 0], axis=1))
    ring = near[: GUIDES // 20]

    def comb(groom: Groom) -> Groom:
        points = groom.guides.points.copy()
        points[ring, 1:] += np.float32(2e-4)
        return groom.replace(guides=groom.guides.replace(points=freeze(points)))

    events = [hand.edit(comb) for _ in range(25)]
    what = f"comb event, 5 % of {GUIDES:,} guides, {SHOWN:,} hairs shown{where}"
    rows = [Row(f"{what}, median", statistics.median(events), "ms", 3), Row(f"{what}, worst", max(events), "ms", SLICE)]
    release = hand.update(stroking=False)
    rows += [Row(f"release{where}", release, "ms", SLICE), *_slices(f"after a comb stroke{where}", hand.slices())]
    if where:
        return rows
    skin = skin_at_rest(hand.document.meshes[0].mesh, hand.evaluator)
    planted, deleted, bound, shown = [], [], [], []
    for seed in range(5):
        planted.append(hand.edit(lambda g, s=seed: g.replace(guides=plant_scatter(g.guides, skin, 1, seed=s))))
        hand.update(stroking=False)
        bound.append(hand.jobs())
        shown.append(hand.update(stroking=False))
        deleted.append(
            hand.edit(lambda g, s=seed: g.replace(guides=take_rows(g.guides, np.arange(len(g.guides)) != s)))
        )
        hand.rest()
    return [
        *rows,
        Row("plant one guide", statistics.median(planted), "ms", 5),
        Row("delete one", statistics.median(deleted), "ms", 5),
        Row("job: binding anew after planting", statistics.median(bound), "ms"),
        Row("update that shows the new binding", max(shown), "ms", SLICE),
    ]


def _numbers(hand: Hand) -> list[Row]:
    steps: Iterator[int] = itertools.count(1)

    def coat(**values: Callable[[int], object]) -> Callable[[Groom], Groom]:
        step = next(steps)
        return lambda g: g.replace(coat=g.coat.replace(**{k: make(step) for k, make in values.items()}))

    def paint(groom: Groom) -> Groom:
        lengths = next(m for m in groom.maps if m.name == groom.coat.length_map)
        assert lengths.values is not None
        values = lengths.values.copy()
        values[:400] *= np.float32(0.99)
        maps = tuple(Map(m.name, values=freeze(values)) if m is lengths else m for m in groom.maps)
        return groom.replace(maps=maps)

    def median(make: Callable[[], Callable[[Groom], Groom]]) -> float:
        return statistics.median([hand.edit(make()) for _ in range(15)])

    rows = [
        Row("a colour is changed", median(lambda: coat(color_tip=lambda s: (0.01 * s, 0.2, 0.1))), "ms", 5),
        Row("the density is changed", median(lambda: coat(density=lambda s: constant(1.0 - 0.01 * (s % 50)))),
            "ms", 12),
        Row("clump is changed", median(lambda: coat(clump=lambda s: constant(0.01 * (s % 50)))), "ms", 12),
        Row("a dab on the length map", median(lambda: paint), "ms", 25),
    ]
    hand.edit(coat(density=lambda _: constant(1.0)))
    hand.rest()
    return rows


def _playing(hand: Hand) -> list[Row]:
    def frames(hairs: int | None) -> float:
        times = []
        for frame in range(1002, 1022):
            hand.frame = float(frame)
            times.append(hand.update(hairs=hairs))
        return statistics.median(times)

    first, again, everything = frames(SHOWN), frames(SHOWN), frames(None)
    hand.update(stroking=False)
    preparing = hand.jobs()
    hand.update(stroking=False)
    return [
        Row(f"a frame played for the first time, {SHOWN:,} hairs shown", first, "ms", 12),
        Row("a frame played again", again, "ms", 6), Row("a frame played again, all hairs", everything, "ms", 40),
        Row("job: preparing the skin of a pose", preparing, "ms"),
        *_slices("after the timeline stopped", hand.slices()),
    ]
