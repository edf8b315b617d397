"""What each way of interpolating is worth on the demo's arm: every sculpt left out and predicted from the others."""

from __future__ import annotations

import numpy as np

from core.demo.arm import arm
from core.demo.arm_sculpts import arm_sculpts
from core.pose.ablation import METHODS, leave_one_out
from tests.bench.bench import Row

TITLE = "Ablation: leave one pose out, root mean square error of the vertices that any sculpt moves"
SHARES = (0.25, 0.5, 0.75, 1.0)


def run() -> list[Row]:
    model = arm()
    sculpts = [sculpt for share in SHARES for sculpt in arm_sculpts(model, share)]
    found = leave_one_out(model.mesh.points, model.rig, sculpts)
    size = float(np.linalg.norm(np.ptp(model.mesh.points, axis=0)))
    rows = []
    for what in ("elbow bent", "forearm twisted", "shoulder raised"):
        for ends, label in ((False, "between sculpts"), (True, "beyond the last")):
            for method in METHODS:
                errors = [r.rms for r in found if r.method == method and r.pose.startswith(what)
                          and (r.pose == what) == ends]
                rows.append(Row(f"{what}, {label}: {method}", float(np.mean(errors)) * size * 1000.0, "mm"))
    return rows
