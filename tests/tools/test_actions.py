"""Actions on a whole groom."""

import numpy as np
import pytest

from core.document import Document
from core.errors import UserError
from core.groom.length import lengths
from core.record import freeze
from core.workspace import Respect, Workspace
from tests.tools.scenes import BENT, EVALUATOR, document, empty, guides_of, session, symmetric_fur
from tools.document_edits import set_groom_hidden, set_groom_locked
from tools.groom.actions import ACTIONS
from tools.session import Session


def marked(selected=(), frozen=(), held=()):
    guides = symmetric_fur()
    columns = {}
    for name, rows in (("selected", selected), ("frozen", frozen)):
        mask = np.zeros(len(guides), np.bool_)
        mask[list(rows)] = True
        columns[name] = freeze(mask)
    hold = np.zeros_like(guides.hold)
    hold[list(held)] = 1.0
    return guides.replace(**columns, hold=freeze(hold))


def done(name, guides=None, workspace=None, **params):
    s = session(symmetric_fur() if guides is None else guides, workspace)
    s.act(name, **params)
    assert s.history.names[1:] in ((), (ACTIONS[name].step,))
    return guides_of(s)


def test_selections():
    some = marked(selected=(3, 4, 5), frozen=(4, 9))
    count = len(some)
    assert done("select_all", marked(frozen=(9,))).selected.sum() == count - 1
    assert not done("select_none", marked(selected=(3, 5))).selected.any()
    assert done("select_inverse", marked(selected=(3, 5), frozen=(9,))).selected.sum() == count - 3
    more = done("select_more", marked(selected=(3,))).selected
    assert 3 < more.sum() < 20
    assert done("select_less", marked(selected=np.flatnonzero(more))).selected.sum() < more.sum()
    assert done("select_islands", marked(selected=(3,))).selected.all()


def test_freezing():
    frozen = done("freeze_selected", marked(selected=(3, 5)))
    assert np.flatnonzero(frozen.frozen).tolist() == [3, 5]
    assert not frozen.selected.any()
    assert (~done("freeze_others", marked(selected=(3, 5))).frozen).sum() == 2
    assert not done("thaw_all", marked(frozen=(1, 2))).frozen.any()


NEED_A_SELECTION = ("delete_selected", "freeze_selected", "freeze_others", "select_more", "select_islands")


@pytest.mark.parametrize("name", NEED_A_SELECTION)
def test_without_a_selection_it_says_so(name):
    s = session()
    before = s.document
    with pytest.raises(UserError, match="Nothing is selected"):
        s.act(name)
    assert s.document is before


def test_delete_leaves_what_is_frozen_or_held():
    after = done("delete_selected", marked(selected=(3, 4, 5, 6), held=(5,)))
    assert sorted(set(range(len(symmetric_fur()))) - set(np.searchsorted(symmetric_fur().ids, after.ids))) == [3, 4, 6]
    free = done(
        "delete_selected", marked(selected=(3, 4, 5, 6), held=(5, 7)), Workspace(respect=Respect(hairspray=False)))
    assert len(free) == len(symmetric_fur()) - 4
    assert free.hold.any(), "what is still there is held as before"


def test_spray_and_wash():
    sprayed = done("spray_selected", marked(selected=(3, 5)), amount=0.5)
    assert np.array_equal(np.flatnonzero(sprayed.hold.any(axis=1)), [3, 5])
    assert sprayed.hold.max() == 0.5
    assert not done("wash_all", marked(held=(1, 2, 3))).hold.any()


def test_what_is_not_respected_is_edited_and_comes_back():
    guides = marked(selected=(3, 5), held=(5, 8), frozen=(9,))
    everything = Workspace(respect=Respect(hairspray=False, selection=False))
    for workspace, changed in ((Workspace(), {3}), (everything, set(range(len(guides))) - {9})):
        after = done("scale_length", guides, workspace, factor=2.0)
        rows = np.flatnonzero((after.points != guides.points).any(axis=(1, 2)))
        assert set(rows.tolist()) == changed
        assert np.array_equal(after.hold, guides.hold)
        assert np.array_equal(after.selected, guides.selected)


def test_lengths():
    guides = marked(selected=(3, 5))
    after = lengths(done("set_length", guides, length=0.2).points)
    np.testing.assert_allclose(after[[3, 5]], 0.2, rtol=1e-5)
    assert np.array_equal(np.delete(after, [3, 5]), np.delete(lengths(guides.points), [3, 5]))
    grown = done("scale_length", marked(selected=(3,)), factor=3.0)
    mean = lengths(done("set_length", grown.replace(selected=np.zeros(len(grown), np.bool_))).points)
    np.testing.assert_allclose(mean, lengths(grown.points).mean(), rtol=1e-5)


@pytest.mark.parametrize("frame", [1001.0, BENT])
def test_mirror_resample_and_shape_work_at_rest_in_any_pose(frame):
    there = Workspace(frame=frame)
    one_side = marked(selected=np.flatnonzero(symmetric_fur().points[:, 0, 0] < 0))
    half = done("delete_selected", one_side, there)
    assert (half.points[:, 0, 0] > 0).all()
    whole = done("mirror", half, there)
    assert len(whole) == len(symmetric_fur())
    np.testing.assert_allclose(np.sort(whole.points[:, 0, 0]), np.sort(symmetric_fur().points[:, 0, 0]), atol=1e-5)
    with pytest.raises(UserError, match="no hair on the -X side"):
        done("mirror", half, there, source="-X")
    assert done("resample", half, there, points=5).points.shape[1] == 5
    inward = symmetric_fur()
    points = inward.points.copy()
    points[:, 1:] = inward.points[:, :1] * np.linspace(1.0, 0.8, points.shape[1])[None, 1:, None]
    out = done("push_out", inward.replace(points=freeze(points)), there)
    assert np.linalg.norm(out.points, axis=2).min() > 0.97
    assert done("push_out", out, there) is not None
    assert not np.array_equal(done("smooth_selected", out, there).points, out.points)
    straight = done("straighten", out, there).points
    assert np.linalg.norm(straight[:, -1] - straight[:, 0], axis=1).mean() > 0.9 * lengths(straight).mean()


def test_what_changes_nothing_is_no_step():
    s = session()
    s.act("thaw_all")
    s.act("wash_all")
    s.act("select_none")
    assert s.history.names == ("New",)


def test_no_groom_no_guides_a_lock_and_wrong_words():
    with pytest.raises(UserError, match="no action named"):
        session().act("no_such_action")
    with pytest.raises(UserError, match="amount"):
        session().act("spray_selected", amount=2.0)
    with pytest.raises(UserError, match="add a groom"):
        Session(Document(), evaluator=EVALUATOR).act("select_all")
    with pytest.raises(UserError, match="plant some"):
        session(empty()).act("mirror")
    with pytest.raises(UserError, match="ball is locked"):
        Session(document(locked=True), evaluator=EVALUATOR).act("select_all")
    for edit, word in ((set_groom_locked, "locked"), (set_groom_hidden, "hidden")):
        s = session()
        s.edit("Keep off", edit, 1, True)
        with pytest.raises(UserError, match=f"coat is {word}"):
            s.act("select_all")
        assert s.history.names == ("New", "Keep off")
