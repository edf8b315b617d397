"""A disk that is really full (a tiny one, where this may be mounted)."""

import os
import subprocess

import pytest

from core.errors import UserError
from core.formats.journal import Journal
from core.formats.project import read_project, write_project
from core.formats.recovery import recover
from core.leaves import same_bits
from core.workspace import Workspace
from tests.documents import small_document, stroked


@pytest.fixture
def tiny_disk(tmp_path):
    """A folder on a file system of 256 kilobytes."""
    folder = tmp_path / "tiny"
    folder.mkdir()
    try:
        mount = ["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(folder)]
        subprocess.run(mount, check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("a small file system cannot be mounted here")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def test_a_save_that_does_not_fit_leaves_the_one_before(tiny_disk):
    path, small = tiny_disk / "a.filo", small_document()
    write_project(path, small)
    large = small_document(guides=2000, points=16)
    with pytest.raises(UserError, match="free some space or save to another disk") as failure:
        write_project(path, large)
    assert "The earlier file is as it was." in str(failure.value)
    assert same_bits(read_project(path).document, small)
    assert os.listdir(tiny_disk) == ["a.filo"]
    write_project(path, stroked(small, 1))  # what fits is saved again
    assert same_bits(read_project(path).document, stroked(small, 1))


def test_an_autosave_that_does_not_fit_is_said_and_earlier_states_stay(tiny_disk):
    journal = Journal(tiny_disk)
    state = durable = small_document(guides=200)
    for i in range(400):
        state = stroked(state, i)
        number = journal.commit(state, Workspace())
        if journal.flush() < number:
            break
        durable = state
    assert "save your work" in str(journal.error)
    found = recover(tiny_disk, journal.token)
    assert same_bits(found.document, durable) or same_bits(found.document, state)
    journal.close(remove=True)
    assert os.listdir(tiny_disk) == []
