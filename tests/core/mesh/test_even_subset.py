"""The even subset beside one that looks at every candidate and every root at every level, and sleeps never."""

from __future__ import annotations

import numpy as np
import pytest

from core.mesh.dart_kernels import FIRST_RADIUS, SAME_SIDE, SHRINK
from core.mesh.even_subset import Candidates, even_subset
from core.workers import Workers


def _candidates(stretched: bool) -> Candidates:
    """Candidates on both sides of a thin bent sheet, face by face within each batch."""
    rng = np.random.default_rng(3)
    ends = np.array([64, 96, 160, 300, 600, 1200], np.int64)
    faces = np.concatenate([np.sort(rng.integers(0, 8, n)) for n in np.diff(ends, prepend=0)]).astype(np.int32)
    u, v = rng.random(len(faces)), rng.random(len(faces))
    along = (faces % 4 + u) / 4.0
    places = np.stack([along, v, 0.2 * np.sin(3.0 * along) + 0.001 * (faces // 4)], axis=1).astype(np.float32)
    up = np.where(np.arange(8) < 4, -1.0, 1.0)
    normals = np.stack([np.zeros(8), np.zeros(8), up], axis=1).astype(np.float32)
    stretch = (1.0 + 2.0 * v if stretched else np.ones(len(faces))).astype(np.float32)
    stretch[::17] = 0.0
    return Candidates(faces, places, stretch, normals, ends)


def _by_looking_at_all(given: Candidates, size: float, per_root: float, count: int) -> list[int]:
    delta = given.places[:, None] - given.places[None]
    near = delta[..., 0] ** 2 + delta[..., 1] ** 2 + delta[..., 2] ** 2
    both = np.minimum(given.stretch[:, None], given.stretch[None])
    normal = given.normals[given.triangle]
    sees = normal @ normal.T > SAME_SIDE
    chosen: list[int] = []
    batch, end, seen, level = 0, 0, 0, 0
    while len(chosen) < count:
        while seen == 0 or seen < 1.25 * per_root * len(chosen) / SHRINK**2:
            begin, end = end, int(given.ends[batch])
            seen += int((given.stretch[begin:end] > 0.0).sum())
            batch += 1
        too_near = sees & (near < np.float32((FIRST_RADIUS * size * SHRINK**level) ** 2) * (both * both))
        taken = set(chosen)
        for c in range(end):
            if given.stretch[c] > 0.0 and c not in taken and not too_near[c, chosen].any():
                chosen.append(c)
        level += 1
    return chosen


@pytest.mark.parametrize("stretched", [False, True])
def test_it_chooses_what_looking_at_all_would(stretched: bool) -> None:
    given = _candidates(stretched)
    expected = _by_looking_at_all(given, 1.4, 2.0, 200)
    workers = Workers(3)
    try:
        for threads in (None, workers):
            found = even_subset(given, 1.4, 2.0, 200, threads)
            assert found.chosen.tolist() == expected
            assert not found.dry
    finally:
        workers.close()
