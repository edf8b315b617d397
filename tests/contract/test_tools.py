"""What every tool and every action keeps, those of a studio's folder included."""

from importlib import resources
from typing import get_type_hints

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core.errors import UserError
from core.field import fields_of
from core.history import History
from core.leaves import same_bits
from core.workspace import Respect, Workspace
from tests.tools.scenes import BENT, guides_of, pointers, session, sight
from tests.tools.some_params import some_params
from tools.groom.actions import ACTIONS
from tools.ground import Pointer
from tools.pose.actions import ACTIONS as POSE_ACTIONS
from tools.registry import Registry
from tools.tool import Turn

REGISTRY = Registry(())
TOOLS = REGISTRY.tools
GROOM = [kind.name for kind in REGISTRY.of("groom")]
FEATHER = [kind.name for kind in REGISTRY.of("feather")]
POSE = [kind.name for kind in REGISTRY.of("pose")]
MATCH = [kind.name for kind in REGISTRY.of("match")]
HIDDEN = {"clone": {"source", "source_groom"}}  # what a stroke leaves in the settings; no panel shows it


def icons():
    return {entry.name[:-4] for entry in (resources.files("resources") / "icons").iterdir()}


def test_no_file_was_left_out_and_the_names_are_these():
    assert REGISTRY.troubles == []
    assert GROOM == [
        "plant", "scatter", "clone", "comb", "smooth", "length", "cut", "hairspray", "wash", "select", "lasso",
        "islands", "freeze", "paint_map", "delete", "measure",
    ]  # fmt: skip
    assert POSE == [
        "rotate", "move", "ik", "grab", "draw", "inflate", "sculpt_smooth", "relax", "pinch", "flatten", "restore",
        "mask", "weights",
    ]  # fmt: skip
    assert MATCH == [
        "track_point", "track_box", "track_plane", "roto", "nudge", "ruler", "track_pattern", "pick_point", "pick_edge",
        "pick_circle", "line_up_axis",
    ]  # fmt: skip
    assert FEATHER == ["shaft", "flow", "tract", "set_feather"]
    assert [*GROOM, *FEATHER, *POSE, *MATCH] == list(TOOLS)
    assert len({kind.order for kind in TOOLS.values()}) == len(TOOLS)


@pytest.mark.parametrize("name", TOOLS)
def test_a_tool_describes_itself(name):
    kind = TOOLS[name]
    assert kind.name == name
    assert kind.name.isidentifier()
    assert kind.icon in icons()
    assert 8 <= len(kind.tooltip.split()) <= 30
    assert kind.tooltip.endswith(".")
    assert ":" in kind.hint, "a hint says gesture: what it does"
    assert kind.edits in REGISTRY.crafts[kind.craft].edits
    assert kind.__module__.startswith(f"tools.{kind.craft}.")
    for turn in (kind.with_shift, kind.with_ctrl, kind.with_eraser):
        assert turn is None or (isinstance(turn, Turn) and turn.tool in TOOLS)
        if turn is not None:
            REGISTRY.make(turn.tool, dict(turn.params))
    for key, turn in (("Shift", kind.with_shift), ("Ctrl", kind.with_ctrl)):
        assert turn is None or key in kind.hint


def check_params(params, hidden=frozenset()):
    described = fields_of(params)
    names = {field.name for field in msgspec.structs.fields(params)}
    assert names - set(described) == set(hidden), "every setting has a label and a tooltip"
    assert set(get_type_hints(params)) == names
    defaults = params()
    for name, known in described.items():
        value = getattr(defaults, name)
        assert len(known.tooltip.split()) >= 8, (params, name)
        assert known.tooltip.endswith(".")
        assert known.label[0].isupper()
        assert len(known.label) <= 20
        if isinstance(value, str):
            assert value in (known.choices or (value,))
            for choice in known.choices:
                msgspec.convert({name: choice}, params)
            if known.choices:
                with pytest.raises(msgspec.ValidationError):
                    msgspec.convert({name: "no such thing"}, params)
        elif value is not None and not isinstance(value, bool):  # None: no map is named
            low, high = known.hard
            assert low <= known.soft[0] < known.soft[1] <= high
            assert low <= value <= high
            for beyond in (low - 1, high + 1):
                with pytest.raises(msgspec.ValidationError):
                    msgspec.convert({name: beyond}, params)


@pytest.mark.parametrize("name", TOOLS)
def test_the_settings_of_a_tool_are_described(name):
    kind = TOOLS[name]
    check_params(kind.Params, HIDDEN.get(name, frozenset()))
    plain = msgspec.to_builtins(kind.Params())
    assert same_bits(msgspec.json.decode(msgspec.json.encode(plain), type=kind.Params), kind.Params())
    with pytest.raises(UserError, match=kind.label):
        REGISTRY.make(name, {"no_such_setting": 1})


def test_no_two_actions_have_one_name():
    assert not ACTIONS.keys() & POSE_ACTIONS.keys()


@pytest.mark.parametrize("name", [*ACTIONS, *POSE_ACTIONS])
def test_an_action_describes_itself(name):
    action = {**ACTIONS, **POSE_ACTIONS}[name]
    assert action.name == name
    assert action.label
    assert action.step
    assert len(action.tooltip.split()) >= 8
    assert action.tooltip.endswith(".")
    assert action.icon is None or action.icon in icons()
    check_params(action.Params)
    with pytest.raises(UserError, match=action.label):
        action.make({"no_such_setting": 1})


def test_the_eraser_does_the_opposite():
    turns = {name: TOOLS[name].with_eraser for name in GROOM if TOOLS[name].with_eraser is not None}
    assert {name: (turn.tool, dict(turn.params)) for name, turn in turns.items()} == {
        "plant": ("delete", {}), "scatter": ("delete", {}), "comb": ("smooth", {}),
        "length": ("length", {"how": "shrink"}), "hairspray": ("wash", {}), "select": ("select", {"mode": "remove"}),
        "lasso": ("lasso", {"mode": "remove"}), "islands": ("islands", {"mode": "remove"}),
        "freeze": ("freeze", {"how": "thaw"}), "paint_map": ("paint_map", {"how": "reverse"}),
    }  # fmt: skip


def test_held_keys_turn_a_tool_and_the_ring_keeps_its_size():
    s = session()
    s.choose("smooth", size=33.0, strength=0.9)
    s.choose("comb", size=120.0, world=True)
    plain = Pointer(200.0, 200.0)
    assert s.hand.tool_for(plain).name == "comb"
    turned = s.hand.tool_for(plain._replace(shift=True))
    p = turned.params
    assert (turned.name, p.size, p.world, p.strength) == ("smooth", 120.0, True, 0.9)
    s.choose("length")
    assert s.hand.tool_for(plain._replace(ctrl=True)).params.how == "shrink"
    assert s.hand.tool_for(plain._replace(eraser=True)).params.how == "shrink"
    s.choose("plant")
    assert s.hand.tool_for(plain._replace(eraser=True)).name == "delete"
    assert s.hand.tool_for(plain._replace(eraser=True, shift=True)).name == "delete"


STROKES = st.tuples(
    st.sampled_from(sorted(GROOM)), st.integers(0, 2**31 - 1), st.sampled_from([1001.0, 1004.0, BENT]),
    st.booleans(), st.booleans(), st.booleans(),
)


def some_stroke(s, stroke):
    """One stroke of anything by anybody's hand, or a refusal in words; True when it was made."""
    name, seed, frame, hairspray, selection, symmetry = stroke
    rng = np.random.default_rng(seed)
    s.choose(name, **some_params(rng, TOOLS[name]))
    s.set_workspace(frame=frame, respect=Respect(hairspray=hairspray, selection=selection, symmetry=symmetry))
    eye = sight(rng.normal(size=3), float(rng.uniform(1.5, 8.0)), bool(rng.integers(2)))
    count = int(rng.integers(1, 9))
    way = 200.0 + np.cumsum(rng.normal(0.0, 60.0, (count, 2)), axis=0)
    keys = {key: bool(rng.random() < 0.15) for key in ("shift", "ctrl", "alt", "eraser")}
    path = pointers(way, pressure=float(rng.random()), tilt_x=float(rng.normal(0.0, 0.5)), **keys)
    before, steps = s.history.current, s.history.names
    try:
        s.hand.hover(eye, path[0])
        s.hand.press(eye, path[0])
        for i in range(1, count, 2):
            s.hand.move(path[i : i + 2])
            s.hand.hover(eye, path[i])
        if rng.random() < 0.1:
            s.hand.cancel()
            assert s.document is before
        s.hand.release()
    except UserError:
        assert s.document is before
        assert s.history.names == steps
    assert not s.stroking
    assert s.document is s.history.current


@settings(max_examples=25, deadline=None)
@given(st.lists(STROKES, min_size=1, max_size=8))
def test_any_strokes_are_undone_and_redone_to_the_bit(strokes):
    s = session()
    s.history = History(s.document, keep=1)
    states = [s.document]
    for stroke in strokes:
        frozen, points = guides_of(s).frozen, guides_of(s)
        some_stroke(s, stroke)
        if s.document is not states[-1]:
            states.append(s.document)
            after = guides_of(s)
            assert np.isfinite(after.points).all()
            stays = np.isin(points.ids, after.ids)
            assert stays[frozen].all(), "frozen guides stay"
            rows = np.searchsorted(after.ids, points.ids[frozen], sorter=np.argsort(after.ids))
            rows = np.argsort(after.ids)[rows]
            assert np.array_equal(after.points[rows], points.points[frozen])
        s.history.flush()
    assert len(s.history.names) == len(states)
    for state in reversed(states):
        assert same_bits(s.document, state)
        s.undo()
        s.history.flush()
    for state in states:
        assert same_bits(s.document, state)
        s.redo()
    s.history.close()


DOINGS = st.tuples(st.sampled_from(sorted(ACTIONS)), st.integers(0, 2**31 - 1), STROKES)


@settings(max_examples=15, deadline=None)
@given(st.lists(DOINGS, min_size=1, max_size=6))
def test_any_actions_are_undone_and_redone_to_the_bit(doings):
    s = session(workspace=Workspace())
    states = [s.document]
    for name, seed, stroke in doings:
        some_stroke(s, stroke)
        if s.document is not states[-1]:
            states.append(s.document)
        rng = np.random.default_rng(seed)
        before = s.document
        try:
            s.act(name, **some_params(rng, ACTIONS[name]))
        except UserError:
            assert s.document is before
        if s.document is not states[-1]:
            states.append(s.document)
            assert s.history.names[-1] == ACTIONS[name].step
    for state in reversed(states):
        assert same_bits(s.document, state)
        s.undo()
    for state in states:
        assert same_bits(s.document, state)
        s.redo()
    s.history.close()


def test_a_studio_has_tools_of_its_own(tmp_path):
    (tmp_path / "fluff.py").write_text(
        "from tools.groom.comb import Comb\n\n\n"
        "class Fluff(Comb):\n    name = 'fluff'\n    label = 'Fluff'\n    order = 35\n    step = 'Fluff'\n"
    )
    (tmp_path / "broken.py").write_text("import a_module_that_is_not_there\n")
    (tmp_path / "comb.py").write_text((tmp_path / "fluff.py").read_text().replace("'fluff'", "'comb'"))
    (tmp_path / "silent.py").write_text((tmp_path / "fluff.py").read_text().replace("'Fluff'", "''"))
    registry = Registry((tmp_path, tmp_path / "nowhere"))
    assert set(registry.tools) == set(TOOLS) | {"fluff"}
    assert [t.file.rsplit("/", 1)[-1] for t in registry.troubles] == ["broken.py", "comb.py", "silent.py", "nowhere"]
    assert "a_module_that_is_not_there" in registry.troubles[0].reason
    assert registry.tools["comb"] is TOOLS["comb"]
    assert list(registry.tools).index("fluff") > list(registry.tools).index("smooth")
