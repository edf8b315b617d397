"""The headless session."""

from pathlib import Path

import numpy as np
import pytest

from core.document import Document
from core.errors import UserError
from core.formats.journal import CURRENT, Journal
from core.formats.project import read_project
from core.formats.recovery import abandoned
from core.leaves import same_bits
from core.workspace import Workspace
from tests.documents import small_document, stroked
from tools.session import Session


@pytest.fixture
def session(tmp_path):
    session = Session(small_document(), journal=Journal(tmp_path / "state"))
    yield session
    session.close(discard=True)


def test_a_preview_is_no_step_and_cancel_puts_the_value_back(session):
    start, seen = session.document, []
    session.changed = lambda old, new: seen.append((old, new))
    shown = [stroked(start, i) for i in range(3)]
    for document in shown:
        session.preview(document)
    assert session.document is shown[2]
    assert session.history.names == ("New",)
    session.cancel()
    assert session.document is start
    assert seen == [(start, shown[0]), (shown[0], shown[1]), (shown[1], shown[2]), (shown[2], start)]
    session.cancel()
    assert len(seen) == 4  # nothing changed, nobody is told


def test_release_makes_one_named_step(session):
    start = session.document
    session.preview(stroked(start, 1))
    session.commit("Comb", session.document)
    end = session.document
    assert session.history.names == ("New", "Comb")
    session.undo()
    assert session.document is start
    session.redo()
    assert session.document is end
    session.jump(0)
    assert session.document is start


def test_edit_applies_to_the_committed_value(session):
    session.preview(stroked(session.document, 5, share=1.0))
    session.edit("Slower", lambda document, fps: document.replace(fps=fps), 12.0)
    assert session.document.fps == 12.0
    assert session.document.grooms is session.history.jump(0).grooms


def test_a_failing_edit_changes_nothing(session):
    start = session.document
    session.preview(stroked(start, 1))

    def fail(document):
        raise UserError("no")

    with pytest.raises(UserError, match="no"):
        session.edit("Fail", fail)
    assert session.document is start
    assert session.history.names == ("New",)


def test_workspace_is_outside_undo_and_saved_beside(session, tmp_path):
    session.workspace = Workspace(frame=7.0, tool="comb", params={"size": [1, 2]})
    session.edit("Slower", lambda document: document.replace(fps=12.0))
    session.undo()
    assert session.workspace.frame == 7.0
    session.save(tmp_path / "a.filo")
    assert read_project(tmp_path / "a.filo").workspace.params == {"size": [1, 2]}


def test_saved_follows_the_value(session, tmp_path):
    assert session.saved
    with pytest.raises(UserError, match="no file yet"):
        session.save()
    session.edit("Slower", lambda document: document.replace(fps=12.0))
    assert not session.saved
    session.save(tmp_path / "a.filo")
    assert session.saved
    session.undo()
    assert not session.saved
    session.redo()
    assert session.saved
    session.undo()
    session.save()
    assert read_project(tmp_path / "a.filo").document.fps == 24.0
    assert read_project(tmp_path / "a.filo1").document.fps == 12.0


def test_a_failed_save_leaves_the_session_unsaved(session):
    session.edit("Slower", lambda document: document.replace(fps=12.0))
    with pytest.raises(UserError, match="could not be saved"):
        session.save("/proc/none/a.filo")
    assert not session.saved
    assert session.path is None


def test_open_and_go_on(session, tmp_path):
    session.save(tmp_path / "a.filo")
    other = Session.open(tmp_path / "a.filo")
    assert same_bits(other.document, session.document)
    assert other.saved
    assert other.history.names == ("Open",)
    other.close()
    with pytest.raises(UserError, match="cannot be opened"):
        Session.open(tmp_path / "b.filo")


def test_unsaved_work_is_recovered_with_its_file_and_undo_steps_since(tmp_path):
    folder = tmp_path / "state"
    first = Session(small_document(), journal=Journal(folder))
    first.save(tmp_path / "a.filo")
    first.edit("Comb", stroked, 3)
    end = first.document
    first._journal.flush()
    first._journal.close(remove=False)  # what death leaves behind
    assert len(abandoned(folder)) == 1

    second = Session.recover(folder)
    assert same_bits(second.document, end)
    assert second.path == tmp_path / "a.filo"
    assert not second.saved
    assert abandoned(folder) == []  # the old journal is gone, the new one is alive
    assert len(list(folder.glob("*" + CURRENT))) == 1
    second.save()
    second.close()
    assert list(folder.iterdir()) == []
    assert Session.recover(folder) is None
    first.history.close()
    first.evaluator.close()


def test_saved_or_untouched_work_leaves_nothing_to_recover(tmp_path):
    folder = tmp_path / "state"
    for document in (Document(), small_document()):
        session = Session(document, journal=Journal(folder))
        session.close()
    assert Session.recover(folder) is None
    session = Session(small_document(), journal=Journal(folder))
    session.edit("Comb", stroked, 3)
    session.close()  # not saved, not discarded
    found = Session.recover(folder)
    assert found is not None
    found.close(discard=True)
    assert Session.recover(folder) is None


def test_tidy_removes_only_what_is_saved(tmp_path):
    folder = tmp_path / "state"
    for save in (True, False):
        session = Session(small_document(), journal=Journal(folder))
        session.edit("Comb", stroked, 3)
        if save:
            session.save(tmp_path / "a.filo")
        session._journal.flush()
        session._journal.close(remove=False)
        session.history.close()
        session.evaluator.close()
    assert len(abandoned(folder)) == 2
    Session.tidy(folder)
    assert len(abandoned(folder)) == 1
    found = Session.recover(folder)
    assert found is not None
    found.close(discard=True)


def test_work_goes_on_without_a_disk():
    session = Session(small_document(), journal=Journal(Path("/proc/none")))
    session.edit("Comb", stroked, 3)
    session._journal.flush()
    assert "save your work" in str(session.autosave_error)
    session.undo()
    assert np.array_equal(session.document.grooms[0].guides.points, small_document().grooms[0].guides.points)
    session.close()
