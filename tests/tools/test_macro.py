"""A macro is a script that does the same again, to the bit."""

import subprocess
import sys

import numpy as np
import pytest

from core.errors import UserError
from core.formats.project import read_project
from core.leaves import leaves, same_bits
from core.value import constant, formula
from core.workspace import Respect
from tests.tools.scenes import BENT, line, session, sight
from tools.document_edits import add_empty_groom, move_groom, rename_groom, set_coat, set_mesh_hidden
from tools.macro import play
from tools.session import Session

CLICK = line((210, 170), (210, 170), 1)


def groom_for_a_while(s):
    """A bit of everything, as a hand would do it."""
    eyes = [sight(), sight((0.5, -0.3, -1.0)), sight((0.0, 0.0, -1.0), orthographic=True)]

    def stroke(name, way, eye=0, **params):
        s.choose(name, **params)
        s.hand.stroke(eyes[eye], way)

    stroke("comb", line((150, 190), (250, 213.3), pressure=0.61, tilt_x=0.3), tilt_lift=0.5, world=True)
    stroke("plant", line((170, 120), (230, 140)), 1, inherit=0)
    stroke("scatter", line((150, 230), (260, 250)), size=40.0)
    s.set_workspace(respect=Respect(symmetry=True, hairspray=False))
    stroke("hairspray", line((220, 150), (260, 220)), 1, start=0.1)
    stroke("length", line((220, 150), (260, 220), ctrl=True), 1)
    s.set_workspace(frame=BENT)
    stroke("smooth", line((150, 190), (250, 210)), 2)
    stroke("cut", line((150, 230), (250, 230)), size=12.0)
    stroke("comb", line((250, 150), (150, 170), eraser=True))
    stroke("clone", line((190, 215), (190, 215), 1), lock=True, size=40.0)
    stroke("clone", CLICK, scale=0.5, variation=0.4)
    stroke("lasso", line((150, 150), (250, 150), 4) + line((250, 220), (150, 220), 4))
    s.act("select_more")
    s.act("smooth_selected", passes=2)
    s.act("freeze_selected")
    stroke("select", line((120, 190), (170, 210)))
    s.act("straighten", amount=0.3)
    stroke("delete", line((230, 190), (250, 200)))  # not selected: nothing is deleted
    s.undo()
    s.undo()
    s.redo()
    s.edit("Rename", rename_groom, 1, 'a "mane" of \\ 鬃')
    s.edit("Coat", set_coat, 1, count=777, frizz=formula("0.1 + 0.2 * u"), clump=constant(1 / 3))
    s.edit("Groom", add_empty_groom, 1, "whiskers", points=8)
    s.edit("Order", move_groom, 2, 0)
    s.edit("Hide", set_mesh_hidden, 1, hidden=True)


@pytest.fixture
def recorded(tmp_path):
    s = session()
    s.save(tmp_path / "start.filo")
    macro = s.record()
    groom_for_a_while(s)
    assert s.stop_recording() is macro
    s.set_workspace(groom=1)
    s.act("select_all")  # no longer recorded
    s.undo()
    macro.save(tmp_path / "macro.py")
    s.save(tmp_path / "hand.filo")
    return s, macro, tmp_path


def test_the_script_run_as_a_program_makes_the_same_bits(recorded):
    _, _, folder = recorded
    done = subprocess.run(
        [sys.executable, "-W", "error", "-m", "app", "run", "macro.py", "start.filo", "script.filo"], cwd=folder,
        capture_output=True, text=True, timeout=250, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    by_hand, by_script = (read_project(folder / f"{name}.filo").document for name in ("hand", "script"))
    count = 0
    for (path, ours), (other, theirs) in zip(leaves(by_hand), leaves(by_script), strict=True):
        assert path == other
        assert ours.dtype == theirs.dtype
        assert ours.tobytes() == theirs.tobytes(), path
        count += 1
    assert count > 20
    assert same_bits(by_hand, by_script)
    start = read_project(folder / "start.filo").document
    assert not np.array_equal(by_hand.grooms[1].guides.points[:5], start.grooms[0].guides.points[:5])


def test_it_is_played_in_a_session_too(recorded):
    s, _, folder = recorded
    again = Session.open(folder / "start.filo")
    play(folder / "macro.py", again)
    assert same_bits(again.document, s.document)
    assert again.history.names[1:] == s.history.names[1:-1]


def test_the_script_names_public_things_only(recorded):
    text = (recorded[2] / "macro.py").read_text()
    for row in text.splitlines():
        if row.startswith(("import", "from")):
            assert "_" not in row.replace("document_edits", "").replace("rename_groom", "").replace(
                "set_coat", "").replace("add_empty_groom", "").replace("move_groom", "").replace("set_mesh_hidden", "")
    assert "left out" not in text
    assert text.count("SIGHT_") == 3 + text.count("session.hand.replay")
    compile(text, "macro.py", "exec")


def test_what_was_undone_is_not_part_of_it():
    s = session()
    s.act("select_all")
    macro = s.record()
    s.act("spray_selected", amount=0.5)
    s.act("freeze_selected")
    s.undo()
    s.act("wash_all", amount=0.25)
    s.undo()
    s.undo()
    s.redo()
    assert [step.name for step in macro.steps] == ["spray_selected"]
    s.jump(len(s.history.names) - 1)
    assert [step.name for step in macro.steps] == ["spray_selected", "wash_all"]
    s.jump(0)
    with pytest.raises(UserError, match="before the recording began"):
        macro.script()
    s.jump(1)
    assert macro.steps == ()
    compile(macro.script(), "macro.py", "exec")


def test_what_changed_nothing_is_not_recorded():
    s = session()
    macro = s.record()
    s.act("thaw_all")
    s.choose("wash")
    s.hand.stroke(sight(), line((150, 190), (250, 213)))
    s.choose("clone")
    screen = s.hand._grounds(sight(), s.tool)[0].screen
    x, y = screen.pixels[screen.seen][0, 4]
    s.hand.stroke(sight(), line((x, y), (x, y), 1))  # a pick edits nothing
    assert s.tool.params.source
    s.edit("Nothing", lambda document: document)
    assert macro.steps == ()


def test_a_function_of_a_console_is_named_as_left_out():
    s = session()
    macro = s.record()
    s.edit("By hand", lambda document: document.replace(fps=12.0))
    s.act("select_all")
    text = macro.script()
    assert "# left out, it is no function of the program's own: By hand" in text
    assert "session.act('select_all')" in text


@pytest.mark.parametrize("text", ["replay = (", "x = 1", "import nothing_of_that_name"])
def test_what_is_no_macro_is_refused(tmp_path, text):
    (tmp_path / "bad.py").write_text(text)
    with pytest.raises(UserError, match=r"bad\.py"):
        play(tmp_path / "bad.py", session())
    with pytest.raises(UserError, match=r"none\.py"):
        play(tmp_path / "none.py", session())
