"""At scales of 1, 1.5 and 2 a click lands on the hair, or the place of a plate, under the pointer."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.window.conftest import OFFSCREEN


@pytest.mark.skipif(OFFSCREEN is not None, reason=str(OFFSCREEN))
@pytest.mark.parametrize("scale", ["1", "1.5", "2"])
@pytest.mark.parametrize("program", ["tests.window.click_scaled", "tests.window.match.pick_scaled"])
def test_a_click_lands_on_what_is_under_the_pointer(program: str, scale: str, tmp_path: Path) -> None:
    environment = {
        **os.environ, "QT_SCALE_FACTOR": scale, "FILOPLUME_STATE": str(tmp_path / "state"),
        "FILOPLUME_SETTINGS": str(tmp_path / "settings")}
    command = [sys.executable, "-W", "error", "-m", program]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=240, check=False)
    assert done.returncode == 0, done.stderr
