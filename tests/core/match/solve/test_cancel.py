"""A solve can be ended at any time: it asks often, and what is raised then gets out."""

import time
from itertools import pairwise

import pytest

from core.match.solve.report import report
from core.match.solve.solution import Options
from core.match.solve.solve import solve
from tests.core.match.solve.shots import FOCAL, SIZE, shot


class _Stop(Exception):
    pass


def _run(tracks, frames, progress):
    made = shot("orbit", tracks, frames, seed=1)
    found = solve(made.observations, made.frames, tracks, SIZE, Options(FOCAL), progress)
    report(found, [str(k) for k in range(tracks)], progress=progress)


def test_a_solve_asks_often_from_beginning_to_end():
    _run(12, 10, lambda words: None)  # warm
    at = [time.thread_time()]  # of this thread alone, whatever else the machine does
    _run(200, 100, lambda words: at.append(time.thread_time()))
    at.append(time.thread_time())
    longest = max(after - before for before, after in pairwise(at))
    assert longest < 0.2 * (at[-1] - at[0])
    assert longest < 0.2


@pytest.mark.parametrize("share", [0.0, 0.3, 0.6, 0.9, 1.0])
def test_what_is_raised_when_it_asks_ends_it_there(share):
    words: list[str] = []
    _run(20, 16, words.append)
    last = int(share * (len(words) - 1))
    asked = 0

    def stop(_: str) -> None:
        nonlocal asked
        asked += 1
        if asked > last:
            raise _Stop

    with pytest.raises(_Stop):
        _run(20, 16, stop)
    assert asked == last + 1
