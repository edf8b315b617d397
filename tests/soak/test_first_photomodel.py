"""The walk-through of docs/model.md is followed by hand, and gives a house of its true measures."""

from pathlib import Path

import numpy as np
import pytest

from core.match.photomodel.build import built
from docs.first_photomodel import CORNERS, SIZE, STEPS, model
from tests.core.match.photomodel.scenes import HOUSE, places
from tests.window.alone import hand_at
from tests.window.conftest import OFFSCREEN, home  # noqa: F401 (fixture)


@pytest.mark.skipif(OFFSCREEN is not None, reason=str(OFFSCREEN))
@pytest.mark.timeout(200)
def test_the_first_model_followed_literally(home: Path, qapp: object) -> None:  # noqa: F811
    hand = hand_at(None, SIZE)
    history = hand.window.desk.session.history
    for step in STEPS[:-1]:
        step.do(hand, home)
    there = places(model(hand))
    true = HOUSE[list(CORNERS)]
    apart = [(a, b) for a in range(len(true)) for b in range(a)]
    lengths = np.array([[np.linalg.norm(x[a] - x[b]) for a, b in apart] for x in (there, true)])
    assert np.abs(lengths[0] / lengths[1] - 1.0).max() < 0.03  # picks are those of whole pixels of the screen
    assert np.abs(there[[0, 1, 2], 1]).max() < 1e-6
    assert len(built(model(hand)).counts) == 8
    before = model(hand)
    STEPS[-1].do(hand, home)
    assert history.undo_name == "Move pick"
    assert not np.allclose(places(model(hand)), there, atol=1e-4)
    hand.window.commands.run("edit.undo")
    assert model(hand) is before
    hand.window.close_unasked()
