"""Expressions, curves, skinning and the demo animal."""

from __future__ import annotations

import numpy as np

from core.curve import Curve, Key, curve_at
from core.demo.creature import demo_creature
from core.expression import evaluate, parse
from core.pose.skinning import posed_points
from tests.bench.bench import Row, median_ms

TITLE = "Values and the demo animal"


def run() -> list[Row]:
    rows = 200_000
    rng = np.random.default_rng(1)
    fields = {"id": np.arange(rows), "u": rng.random(rows), "v": rng.random(rows), "frame": 1001.0}
    typical = "fit(u, 0, 1, 0.2, 1) * (0.8 + 0.4 * rand(id, 7)) if v > 0.1 else 0.5 * smoothstep(0, 0.1, v)"
    curve = Curve(keys=tuple(Key(frame=float(f), value=float(rng.normal())) for f in range(0, 1000, 10)))
    mesh, rig, _ = demo_creature()
    program = parse(typical)
    return [
        Row("parse a typical expression", median_ms(lambda: parse(typical), 50), "ms"),
        Row("a typical expression, 200,000 hairs", median_ms(lambda: evaluate(program, fields)), "ms"),
        Row("fbm(u * 9, v * 9, 0, 4), 200,000 hairs",
            median_ms(lambda: evaluate("fbm(u * 9, v * 9, 0, 4)", fields), 5), "ms"),
        Row("a curve of 100 keys at one frame", median_ms(lambda: curve_at(curve, 503.25), 50), "ms"),
        Row("skin the demo animal at a frame", median_ms(lambda: posed_points(mesh.points, rig, 1015.5), 50), "ms"),
        Row("model the demo animal", median_ms(demo_creature, 3), "ms"),
    ]
