"""Ten thousand kills (half an hour on two cores); see tests/core/formats/crash.py."""

import os
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "core" / "formats"))
from crash import Crasher, kill_journals, kill_saves

KILLS = int(os.environ.get("FILOPLUME_KILLS", "10000"))
pytestmark = pytest.mark.timeout(4 * 3600)


@pytest.fixture
def crasher(tmp_path):
    crasher = Crasher(tmp_path, seed=int.from_bytes(os.urandom(4), "little"))
    yield crasher
    crasher.close()


def test_kills_while_saving(crasher):
    assert kill_saves(crasher, KILLS // 2) > 0


def test_kills_while_autosaving(crasher):
    kill_journals(crasher, KILLS // 2)
