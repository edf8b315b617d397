"""The hand: what a press, a drag, a release, Esc, an error and a pose make of a document."""

import itertools
import time

import numpy as np
import pytest

from core.document import Document
from core.errors import UserError
from core.evaluator import Evaluator
from core.groom.guides import Guides
from core.groom.rows import take_rows
from core.leaves import same_bits
from core.posed import field_known, skin_at
from core.record import Record, freeze
from core.workspace import Respect, Workspace
from tests.core.groom.small_grooms import segment_lengths
from tests.tools.scenes import (
    BENT,
    EVALUATOR,
    document,
    empty,
    guides_of,
    line,
    pointers,
    session,
    sight,
    symmetric_fur,
)
from tools.document_edits import set_groom_hidden, set_groom_locked
from tools.registry import Registry
from tools.session import Session
from tools.tool import Tool

ALL = tuple(kind.name for kind in Registry(()).of("groom"))
WAY = line((150, 190), (250, 210))


def untouched(s, before, names=("New",)):
    assert s.document is before
    assert s.history.names == names
    assert not s.stroking


def test_a_stroke_is_a_preview_until_its_release_makes_one_step():
    s = session()
    before, seen = s.document, []
    s.changed = lambda old, new: seen.append(new)
    s.hand.press(sight(), WAY[0])
    s.hand.move(WAY[1:6])
    assert s.stroking
    assert s.document is not before
    assert s.history.current is before
    s.hand.move(WAY[6:])
    s.hand.release()
    assert s.history.names == ("New", "Comb")
    assert s.document is s.history.current
    assert len(seen) >= 3
    s.undo()
    assert s.document is before


@pytest.mark.parametrize("end", ["cancel", "tool", "frame", "respect", "groom", "undo", "redo", "edit", "act"])
def test_what_ends_a_stroke_puts_the_old_value_back(end):
    s = session()
    before = s.document
    s.hand.press(sight(), WAY[0])
    s.hand.move(WAY[1:])
    assert s.document is not before
    after = {
        "cancel": s.hand.cancel,
        "tool": lambda: s.choose("smooth"),
        "frame": lambda: s.set_workspace(frame=1002.0),
        "respect": lambda: s.set_workspace(respect=Respect(symmetry=True)),
        "groom": lambda: s.set_workspace(groom=1),
        "undo": s.undo,
        "redo": s.redo,
        "edit": lambda: s.edit("Slower", lambda d: d.replace(fps=12.0)),
        "act": lambda: s.act("select_all"),
    }
    after[end]()
    assert not s.stroking
    assert s.document.grooms[0].guides.points is before.grooms[0].guides.points
    s.hand.move(WAY)  # late samples and a late release do nothing
    s.hand.release()
    assert "Comb" not in s.history.names
    if end not in ("edit", "act"):
        untouched(s, before)


class Breaks(Tool[Record]):
    """A studio's tool with a fault."""

    Params = Record
    name = "breaks"
    step = "Break"

    def __init__(self, where):
        super().__init__(Record())
        self.where = where

    def begin(self, ground, pointer):
        if self.where == "begin":
            raise ZeroDivisionError
        return BreakingStroke(self.where)


class BreakingStroke:
    def __init__(self, where):
        self.where, self.count = where, 0

    def extend(self, guides, pointers):
        self.count += 1
        if self.where == "press" or (self.where == "move" and self.count == 2):
            raise ZeroDivisionError
        return guides.replace(points=freeze(guides.points + np.float32(0.1)))

    def finish(self, guides):
        if self.where == "release":
            raise ZeroDivisionError
        if self.where == "result":
            return guides.replace(points=guides.points * np.float32(np.nan))
        return guides

    def overlays(self):
        return ()


@pytest.mark.parametrize("where", ["begin", "press", "move", "release", "result"])
@pytest.mark.parametrize("frame", [1001.0, BENT])
def test_an_error_in_a_tool_puts_the_old_value_back(where, frame):
    s = session(workspace=Workspace(frame=frame))
    before = s.document

    def stroke():
        s.hand.press(sight(), WAY[0], Breaks(where))
        s.hand.move(WAY[1:])
        s.hand.release()

    with pytest.raises((ZeroDivisionError, ValueError)):
        stroke()
    untouched(s, before)
    s.hand.stroke(sight(), WAY)  # and the next stroke is as good as ever
    assert s.history.names == ("New", "Comb")


@pytest.mark.parametrize("name", ALL)
def test_no_groom_and_a_locked_mesh_are_said_in_words(name):
    nothing = Session(Document(), evaluator=EVALUATOR)
    nothing.choose(name)
    with pytest.raises(UserError, match="add a groom"):
        nothing.hand.press(sight(), WAY[0])
    assert nothing.hand.hover(sight(), WAY[0]) == ()
    locked = Session(document(locked=True), evaluator=EVALUATOR)
    before = locked.document
    locked.choose(name)
    with pytest.raises(UserError, match="ball is locked"):
        locked.hand.press(sight(), WAY[0])
    assert locked.hand.hover(sight(), WAY[0]) == ()
    untouched(locked, before)


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize(("edit", "word"), [(set_groom_locked, "locked"), (set_groom_hidden, "hidden")])
def test_a_locked_or_hidden_groom_refuses_strokes(name, edit, word):
    s = session()
    s.edit("Keep off", edit, 1, True)
    before = s.document
    s.choose(name)
    with pytest.raises(UserError, match=f"coat is {word}"):
        s.hand.press(sight(), WAY[0])
    assert s.hand.hover(sight(), WAY[0]) == ()
    assert s.document is before
    assert not s.stroking
    s.edit("Let", edit, 1, False)
    s.hand.press(sight(), WAY[0])
    s.hand.cancel()


@pytest.mark.parametrize("frame", [1001.0, BENT])
@pytest.mark.parametrize("name", ALL)
def test_an_empty_groom_is_planted_on_or_refused_in_words(name, frame):
    s = session(empty(), Workspace(frame=frame))
    s.choose(name)
    before = s.document
    s.hand.hover(sight(), WAY[3])
    if name in ("plant", "scatter", "measure", "paint_map"):
        s.hand.stroke(sight(), WAY)
        assert (len(guides_of(s)) > 0) == (name in ("plant", "scatter"))
    else:
        with pytest.raises(UserError, match="Plant"):
            s.hand.stroke(sight(), WAY)
        untouched(s, before)


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("symmetry", [False, True])
def test_beside_the_animal_nothing_happens(name, symmetry):
    s = session(workspace=Workspace(respect=Respect(symmetry=symmetry)))
    s.choose(name)
    before = guides_of(s)
    away = line((2, 2), (6, 8))
    s.hand.hover(sight(), away[0])
    try:
        s.hand.stroke(sight(), away)
    except UserError:
        assert name == "clone"
    after = guides_of(s)
    assert after.points is before.points
    assert np.array_equal(after.hold, before.hold)


@pytest.mark.parametrize("name", [n for n in ALL if n not in ("measure", "clone", "islands")])
def test_every_tool_does_something_to_fur(name):
    guides = symmetric_fur()
    s = session(guides.replace(hold=np.full_like(guides.hold, 0.2)) if name == "wash" else guides)
    s.choose(name)
    s.hand.stroke(sight(), line((100, 100), (300, 120), 4) + line((300, 300), (100, 280), 4))
    assert s.history.names == ("New", s.tools.tools[name].step)


def mirrored_rows(guides: Guides):
    """For each guide the row of the one at the mirrored root."""
    roots = guides.points[:, 0].astype(np.float64)
    distance = np.linalg.norm(roots[:, None] * [-1.0, 1.0, 1.0] - roots[None], axis=2)
    assert distance.min(axis=1).max() < 1e-5
    return np.argmin(distance, axis=1)


def asymmetry(guides: Guides):
    twin = mirrored_rows(guides)
    return np.abs(guides.points * np.array([-1, 1, 1], np.float32) - guides.points[twin]).max(axis=(1, 2))


SYMMETRIC = ("comb", "length", "smooth", "cut", "plant", "scatter", "hairspray", "select", "delete")


@pytest.mark.parametrize("name", SYMMETRIC)
def test_symmetric_strokes_keep_a_symmetric_groom_symmetric(name):
    s = session(workspace=Workspace(respect=Respect(symmetry=True)))
    start = guides_of(s)
    assert asymmetry(start).max() < 1e-5
    s.choose(name, **({"size": 30.0} if name != "plant" else {}))
    s.hand.stroke(sight((-0.3, -0.2, -1.0)), line((235, 170), (265, 240)))
    after = guides_of(s)
    assert s.history.names[-1] != "New"
    if name in ("plant", "scatter"):
        assert len(after) > len(start) + 4
    whole = len(after) == len(start)
    # at the plane itself the two strokes meet and follow each other
    after = take_rows(after, np.abs(after.points[:, 0, 0]) > 0.3)
    start = take_rows(start, np.abs(start.points[:, 0, 0]) > 0.3)
    twin = mirrored_rows(after)
    assert asymmetry(after).max() < 2e-5
    assert np.array_equal(after.selected, after.selected[twin])
    np.testing.assert_allclose(after.hold, after.hold[twin], atol=1e-5)
    if whole and name != "select":
        changed = (after.points != start.points).any(axis=(1, 2)) | (after.hold != start.hold).any(axis=1)
        assert (changed & (after.points[:, 0, 0] > 0)).sum() == (changed & (after.points[:, 0, 0] < 0)).sum() > 0


@pytest.mark.parametrize("name", ["comb", "smooth", "cut", "length", "hairspray", "delete", "select"])
def test_in_a_pose_lengths_roots_and_what_was_not_touched_stay(name):
    s = session(workspace=Workspace(frame=BENT))
    s.choose(name)
    before = guides_of(s)
    s.hand.press(sight(), WAY[0])
    for pointer in WAY[1:]:
        s.hand.move((pointer,))
    s.hand.release()
    after = guides_of(s)
    assert s.history.names[-1] != "New"
    rows = np.flatnonzero(np.isin(before.ids, after.ids))
    assert np.array_equal(before.ids[rows], after.ids)
    assert np.array_equal(before.points[rows, 0], after.points[:, 0])
    for column in ("faces", "corners", "weights", "uvs", "frames"):
        assert np.array_equal(getattr(before.roots, column)[rows], getattr(after.roots, column))
    moved = (before.points[rows] != after.points).any(axis=(1, 2))
    if name in ("hairspray", "select", "delete"):
        assert not moved.any()
        assert len(rows) < len(before) or name != "delete"
        return
    assert 0 < moved.sum() < 0.9 * len(rows)
    if name in ("comb", "smooth"):
        np.testing.assert_allclose(segment_lengths(after), segment_lengths(before), atol=2e-6)
    # what was reached lies under the stroke in the picture of the pose, not in that of the rest
    ground = s.hand._grounds(sight(), s.tool)[0]
    pixels = ground.screen.pixels[moved]
    path = np.array([(p.x, p.y) for p in WAY])
    nearest = np.linalg.norm(pixels[:, :, None] - path, axis=3).min(axis=(1, 2))
    assert nearest.max() < 70.0 + 20.0


def test_in_a_pose_the_far_side_is_that_of_the_pose():
    s = session(workspace=Workspace(frame=BENT))
    ground = s.hand._grounds(sight(), s.tool)[0]
    skin = skin_at(s.document.meshes[0], BENT, EVALUATOR)
    assert skin.points is not s.document.meshes[0].mesh.points
    roots = ground.guides.points[:, 0].astype(np.float64)
    nearest = np.argmin(np.linalg.norm(roots[:, None] - skin.points, axis=2), axis=1)
    facing = np.einsum("na,na->n", skin.normals[nearest], np.array([0.0, 0.0, 6.0]) - roots)
    clear = np.abs(facing) > 1.6
    assert np.array_equal(ground.screen.seen[clear], facing[clear] > 0.0)


def planted_where_the_pointer_is(frame, direction):
    s = session(empty(), Workspace(frame=frame))
    s.choose("plant")
    place = pointers([(230, 150)])[0]
    s.hand.press(sight(direction), place)
    s.hand.release()
    ground = s.hand._grounds(sight(direction), s.tool)[0]
    assert len(ground.shown) == 1
    np.testing.assert_allclose(ground.screen.pixels[0, 0], (230, 150), atol=0.5)


def test_a_guide_is_planted_where_the_pointer_is_in_any_pose():
    for frame in (1001.0, BENT):
        for direction in ((0.0, 0.0, -1.0), (1.0, -0.3, 0.5)):
            planted_where_the_pointer_is(frame, direction)


def sprayed_and_selected():
    guides = guides_of(session())
    hold = np.zeros_like(guides.hold)
    hold[::2] = 1.0
    selected = np.zeros(len(guides), np.bool_)
    selected[: len(guides) // 4] = True
    frozen = np.zeros(len(guides), np.bool_)
    frozen[-len(guides) // 8 :] = True
    return guides.replace(hold=freeze(hold), selected=freeze(selected), frozen=freeze(frozen))


@pytest.mark.parametrize("frame", [1001.0, BENT])
@pytest.mark.parametrize("name", ["comb", "length", "cut", "smooth", "delete", "plant", "freeze", "hairspray"])
@pytest.mark.parametrize("hairspray", [True, False])
@pytest.mark.parametrize("selection", [True, False])
def test_what_is_not_respected_is_edited_and_put_back(name, hairspray, selection, frame):
    respect = Respect(hairspray=hairspray, selection=selection)
    s = session(sprayed_and_selected(), Workspace(frame=frame, respect=respect))
    before = guides_of(s)
    s.choose(name, **({} if name == "plant" else {"size": 150.0, "through": True}))
    s.hand.stroke(sight(), WAY)
    after = guides_of(s)
    rows = np.flatnonzero(np.isin(before.ids, after.ids))
    same = np.isin(after.ids, before.ids)
    if name != "hairspray":
        assert np.array_equal(before.hold[rows], after.hold[same])
    if name != "freeze":
        assert np.array_equal(before.selected[rows], after.selected[same])
    else:
        assert not (after.selected & after.frozen).any()
    assert not (before.frozen & ~np.isin(before.ids, after.ids)).any(), "frozen guides stay"
    held, chosen = before.hold.any(axis=1), before.selected
    if name in ("comb", "length", "cut"):
        moved = (before.points != after.points).any(axis=(1, 2))
        assert not moved[before.frozen].any()
        assert moved[held & chosen].any() == (not hairspray)
        assert moved[~held & ~chosen].any() == (not selection)
        assert moved[~held & chosen].any()


def test_the_ground_of_a_hover_is_kept_until_something_changes():
    s = session()
    first = s.hand._grounds(sight_ := sight(), s.tool)
    assert s.hand._grounds(sight_, s.tool) is first
    assert s.hand._grounds(sight_, s.tool_named("smooth")) is first
    s.hand.stroke(sight_, WAY)
    assert s.hand._grounds(sight_, s.tool) is not first


def test_symmetry_shows_a_ghost_where_it_works():
    s = session(workspace=Workspace(respect=Respect(symmetry=True)))
    s.choose("comb", size=25.0)
    eye = sight((0.6, 0.0, -1.0))
    place = pointers([(240, 190)])[0]
    *_, ghost = s.hand.hover(eye, place)
    ground = s.hand._grounds(eye, s.tool)[0]
    there = ground.view.pixels(ground.hit(place).point * [-1.0, 1.0, 1.0])[0]
    np.testing.assert_allclose((ghost.x, ghost.y), there, atol=1e-6)
    near = ground.view.pixels(ground.hit(place).point)[1]
    far = ground.view.pixels(ground.hit(place).point * [-1.0, 1.0, 1.0])[1]
    assert ghost.radius == pytest.approx(25.0 * near / far)
    assert ghost.tone == "faint"


def test_a_stroke_needs_a_place():
    with pytest.raises(UserError):
        session().hand.stroke(sight(), ())


def test_replaying_gives_the_same_bits():
    first, second = session(), session()
    records = []
    first.hand.recorded = records.append
    for name in ("comb", "length", "scatter", "hairspray"):
        first.choose(name)
        first.hand.stroke(sight(), line((150, 190), (250, 210), pressure=0.7, tilt_x=0.3))
    for record in records:
        second.hand.replay(record)
    assert len(records) == 4
    assert same_bits(first.document.grooms, second.document.grooms)


@pytest.mark.parametrize("name", ["comb", "smooth", "cut", "select"])
@pytest.mark.parametrize("when", ["before", "amid", "at release", "by itself"])
def test_a_hand_that_does_not_wait_for_the_skin_makes_the_same_document(name, when):
    def fresh(waits):
        s = Session(document(), Workspace(frame=BENT), evaluator=Evaluator())
        s.hand.waits = waits
        s.choose(name)
        return s

    patient, s = fresh(True), fresh(False)
    way = line((200, 130), (215, 240), 14)
    patient.hand.stroke(sight(), way)
    item = s.document.meshes[0]
    if when != "by itself":  # then the hand has it made on a thread of its own
        work = s.hand.preparation()
        assert s.hand.preparation() is None, "it is handed out once"
    if when == "before":
        work()
    s.hand.press(sight(), way[0])
    shapes = s.tool.edits == "shape"
    assert s.hand._bare == (shapes and when != "before") or when == "by itself"
    for number, pointer in enumerate(way[1:]):
        if number == 6 and when == "amid":
            work()
        if number == 6 and when == "by itself" and shapes:
            end = time.monotonic() + 60.0
            while not field_known(item, BENT, s.evaluator):
                assert time.monotonic() < end
                time.sleep(0.005)
        s.hand.move((pointer,))
        if when in ("amid", "by itself") and number >= 6:
            assert not s.hand._bare
    s.hand.release()
    for column in ("points", "hold", "selected", "ids"):
        np.testing.assert_array_equal(getattr(guides_of(s), column), getattr(guides_of(patient), column))
    if shapes:
        assert s.history.names == patient.history.names == ("New", s.tool.step)
    for one in (s, patient):
        one.close(discard=True)


def test_a_stroke_goes_through_the_skin_only_until_it_is_there():
    s = Session(document(), Workspace(frame=BENT), evaluator=Evaluator())
    s.hand.waits = False
    work = s.hand.preparation()
    s.choose("comb", strength=1.0, size=60.0)
    way = line((200, 120), (200, 280), 10)
    s.hand.press(sight(), way[0])
    s.hand.move(way[1:])
    bare = guides_of(s).points
    work()
    assert s.hand.preparation() is None
    s.hand.move((way[-1]._replace(x=way[-1].x + 1.0),))
    assert (np.abs(guides_of(s).points - bare).max(axis=(1, 2)) > 1e-3).sum() > 3
    s.hand.cancel()
    assert s.document is s.history.current
    s.close(discard=True)


def test_what_gets_ready_between_the_press_and_its_first_sample_is_no_stumbling_block():
    def stroked(at_once):
        s = Session(document(), Workspace(frame=BENT), evaluator=Evaluator())
        s.hand.waits = False
        s.choose("cut")
        work = s.hand.preparation()
        # another thread may be as quick as this: after the stroke began without the skin, before its first sample
        s.hand.preparation = (lambda: work() and None) if at_once else (lambda: None)
        s.hand.stroke(sight(), line((200, 130), (215, 240), 6))
        s.close(discard=True)
        return guides_of(s).points

    np.testing.assert_array_equal(stroked(True), stroked(False))


def bent_tops(name: str, direction: tuple[float, float, float]):
    """A session at the frame where the upper half is turned aside as a whole, and pixels of that half on one side."""
    s = session(workspace=Workspace(frame=BENT, respect=Respect(symmetry=True)))
    eye = sight(direction)
    s.choose(name, size=60.0 if name == "cut" else 30.0)
    ground = s.hand._grounds(eye, s.tool)[0]
    tops = np.flatnonzero(ground.rest.points[:, 1] > 0.75)
    aside = ground.rest.points[tops, 0]
    return s, eye, [ground.view.pixels(ground.skin.points[tops[np.argmin(np.abs(aside - x))]].astype(np.float64))[0]
                    for x in (0.35, 0.15)]


@pytest.mark.parametrize("name", ["comb", "length", "hairspray", "cut"])
@pytest.mark.parametrize("beside", [False, True])
def test_a_turned_head_is_mirrored_by_its_own_sides(name, beside):
    """What the hand does to one cheek happens to the other one, wherever that has gone."""
    s, eye, (one, other) = bent_tops(name, (0.0, -0.2, -1.0) if beside else (-0.3, -0.9, -0.5))
    start = guides_of(s)
    places = [one, other]
    if beside:
        ground = s.hand._grounds(eye, s.tool)[0]
        pixels = ground.view.pixels(ground.skin.points.astype(np.float64))[0]
        places.insert(0, pixels[np.argmin(pixels[:, 1])] - [0.0, 25.0])
    s.hand.stroke(eye, tuple(p for a, b in itertools.pairwise(places) for p in line(a, b)))
    after = guides_of(s)
    top = (after.points[:, 0, 1] > 0.6) & (np.abs(after.points[:, 0, 0]) > 0.08)
    was, mine = take_rows(start, top), take_rows(after, top)
    changed = (mine.points != was.points).any(axis=(1, 2)) | (mine.hold != was.hold).any(axis=1)
    left, right = (changed & (side * mine.points[:, 0, 0] > 0) for side in (1, -1))
    assert left.sum() == right.sum() > 0
    assert asymmetry(mine).max() < 5e-3
    np.testing.assert_allclose(mine.hold, mine.hold[mirrored_rows(mine)], atol=1e-4)


def test_guides_are_scattered_on_both_sides_of_a_turned_head():
    s, eye, (one, _) = bent_tops("scatter", (-0.3, -0.9, -0.5))
    s.hand.stroke(eye, line(one, one, 2))
    roots = guides_of(s).points[:, 0][guides_of(s).ids >= symmetric_fur().next_id].astype(np.float64)
    roots = roots[np.abs(roots[:, 0]) > 0.15]
    twins = np.linalg.norm(roots[:, None] * [-1.0, 1.0, 1.0] - roots[None], axis=2).min(axis=1)
    assert len(roots) > 6
    assert np.median(twins) < 1e-3
    assert abs((roots[:, 0] > 0).mean() - 0.5) < 0.2


def test_the_ghost_of_a_turned_head_lies_on_its_other_side():
    s, eye, (one, _) = bent_tops("comb", (-0.3, -0.9, -0.5))
    ground = s.hand._grounds(eye, s.tool)[0]
    hit = ground.hit(pointers([one])[0])
    corners = ground.rest.triangles.vertices[hit.triangle]
    twin = [int(np.argmin(np.linalg.norm(ground.rest.points - p * [-1.0, 1.0, 1.0], axis=1)))
            for p in ground.rest.points[corners]]
    there = hit.barycentric @ ground.skin.points[twin]
    np.testing.assert_allclose(ground.opposite(hit), there, atol=2e-3)
    assert np.linalg.norm(there - hit.point * [-1.0, 1.0, 1.0]) > 0.2
