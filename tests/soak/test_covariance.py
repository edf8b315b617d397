"""What a solve says of its own certainty against how it spreads over 200 noises."""

import numpy as np

from core.match.solve.bundle import RIGID, adjust
from core.match.solve.coordinates import onto
from core.match.solve.report import report
from core.match.solve.solution import Options
from core.match.solve.solve import solve
from core.match.solve.state import projected
from tests.core.match.solve.shots import FOCAL, NOISE, SIZE, shot

RUNS = 200


def test_points_and_cameras_spread_as_foretold():
    made = shot("orbit", 24, 12, seed=3)
    rows, truth = made.observations, made.truth
    clean, _ = projected(truth, rows.frame, truth.points[rows.track])
    found = solve(rows, made.frames, 24, SIZE, Options(FOCAL))
    told = report(found, [str(k) for k in range(24)])
    there = onto(found.state.points, truth.points)
    share = (there.scale * NOISE / found.sigma) ** 2
    inverse = [
        np.linalg.inv(share * np.einsum("ij,pjk,lk->pil", there.turn, sigma, there.turn))
        for sigma in (told.point_sigma, told.centre_sigma)
    ]
    rng = np.random.default_rng(0)
    chi = []
    for _ in range(RUNS):
        noisy = rows._replace(xy=clean + rng.normal(0, NOISE, clean.shape))
        state = adjust(truth, noisy, RIGID, iterations=20, tolerance=1e-9).state
        back = onto(state.points, truth.points)
        away = back.points(state.points) - truth.points, back.points(state.centres()) - truth.centres()
        chi.append([np.einsum("pi,pij,pj->p", d, m, d).mean() / 3 for d, m in zip(away, inverse, strict=True)])
    points, centres = np.mean(chi, axis=0)
    assert 0.9 < points < 1.1
    assert 0.9 < centres < 1.1
