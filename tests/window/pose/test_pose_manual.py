"""The walk-through of docs/pose.md is that of the program, and can be followed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from core.pose.synthesis import evaluate
from docs.first_pose import SIZE, STEPS, chapter, picture_of
from tests.window.alone import hand_at
from tests.window.conftest import OFFSCREEN

DOCS = Path(__file__).parents[3] / "docs"


def test_the_chapter_is_that_of_the_steps() -> None:
    assert chapter() in (DOCS / "pose.md").read_text("utf-8"), "make pictures"
    for number in range(1, len(STEPS) + 1):
        assert (DOCS / "pictures" / picture_of(number)).is_file()


@pytest.mark.timeout(200)
def test_the_first_corrective_followed_literally(home: Path, qapp: object) -> None:
    if OFFSCREEN is not None:
        pytest.skip(OFFSCREEN)
    hand = hand_at(None, SIZE)
    made: list[str] = []
    for step in STEPS:
        step.do(hand, home)
        made += step.made
        assert list(hand.window.desk.session.history.names)[1:] == made, step.title
    item = hand.window.desk.document.meshes[0]
    elbow, _, wrist = item.correctives.layers
    assert len(elbow.space.samples) == 2
    mine = elbow.space.samples[1].pose
    surface = evaluate(item.mesh.points, item.rig, item.correctives, mine)
    without = evaluate(item.mesh.points, item.rig, item.correctives.replace(layers=()), mine)
    assert np.linalg.norm(surface - without, axis=1).max() > 0.005
    assert wrist.space.samples[0].falloffs["wrist"] == pytest.approx((np.radians(40.0),))
    assert hand.window.pose_side.graph.lines
    hand.window.close_unasked()
