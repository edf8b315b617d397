"""kill -9 at random moments of saving and autosaving. Ten thousand of each are in tests/soak."""

import pytest

from tests.core.formats.crash import Crasher, kill_journals, kill_saves


@pytest.fixture
def crasher(tmp_path):
    crasher = Crasher(tmp_path)
    yield crasher
    crasher.close()


def test_a_hundred_kills_while_saving(crasher):
    assert kill_saves(crasher, 100) > 0  # some met the middle of a save


def test_a_hundred_kills_while_autosaving(crasher):
    kill_journals(crasher, 100)
