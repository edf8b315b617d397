"""The comb: milliseconds of one dab, and passes to reach the styles of its benchmark."""

from __future__ import annotations

import numpy as np

from core.groom.comb import comb
from core.workers import Workers
from tests.bench import comb_targets as styles
from tests.bench.bench import Row, median_ms

TITLE = "Comb"
SEEDS = (2, 3)


def run() -> list[Row]:
    rows = []
    field = styles.field_of(True)
    view = styles.orthographic(False)
    workers = Workers(2)
    for count, target in ((5_000, 5.0), (20_000, 16.0)):
        guides = styles.hair(1, True, (0.8, 0.8), True, count)
        radius = 0.45 * styles.PIXELS  # reaches a quarter of these guides
        dab = styles.to_pixels(np.array([[0.0, 0.0], [0.045, 0.0]]))

        def one() -> object:
            return comb(guides, view, dab, radius, field=field, ranges=workers.ranges)  # noqa: B023

        after = comb(guides, view, dab, radius, field=field)
        share = float((after.points != guides.points).any(axis=(1, 2)).mean())
        what = f"comb dab, ring over {share:.0%} of {count:,} guides x 16 points, collision on"
        rows.append(Row(what, median_ms(one, runs=31, warm=3), "ms", target))
    workers.close()
    rows += _passes()
    return rows


def _passes() -> list[Row]:
    rows = []
    fields = {sphere: styles.field_of(sphere) for sphere in (False, True)}

    def ours(guides, view, path, radius, sphere):  # type: ignore[no-untyped-def]
        return comb(guides, view, path, radius, field=fields[sphere])

    for seed in SEEDS:
        mine, plain = (
            [styles.passes_needed(t, sphere, brush, seed)[0] for t in styles.TARGETS for sphere in fields]
            for brush in (ours, styles.plain_brush)
        )
        reached = sum(n == 1 for n in mine)
        rows.append(Row(f"comb styles reached in one pass, of 10 (seed {seed})", reached, "", 9, True))
        share = sum(mine) / sum(plain)
        rows.append(Row(f"passes of the comb over passes of a plain brush (seed {seed})", share, "", 0.5))
    return rows
