"""A rig into the window: what moves opens in the craft of posing."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.window.conftest import Opened

DATA = os.environ.get("FILOPLUME_DATA")


@pytest.mark.skipif(DATA is None, reason="FILOPLUME_DATA is not set")
def test_a_rig_opens_in_the_craft_of_posing_and_a_clip_of_strangers_is_refused(opened: Opened) -> None:
    folder = Path(str(DATA)) / "animation"
    hand = opened(None)
    desk, said = hand.window.desk, list[str]()
    desk.failed.connect(lambda words, details: said.append(words))
    hand.window.opening.open(next((folder / "fox_gltf").rglob("*.gl*")))
    hand.until(lambda: desk.posed is not None, 60_000)
    hand.rest()
    assert desk.workspace.craft == "pose"
    assert desk.posed.rig.clip is not None
    assert said == []
    hand.window.opening.open(folder / "bvh_cmu_A" / "01_01.bvh")
    hand.until(lambda: not desk.jobs.running, 60_000)
    assert len(said) == 1
    assert "none of the joints" in said[0]
