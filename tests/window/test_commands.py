"""Every command has what it must have, and does what it says."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
import pytest

from app.window.all_commands import all_commands
from app.window.commands import Command
from app.window.icons import icon_names
from app.window.radial import MOST
from app.window.tool_commands import radial_names
from core.camera import Camera, frame_points, look_at
from core.curve import Curve, Key
from core.document import with_groom
from core.errors import UserError
from core.value import Value
from tests.window.host import Host
from tools.ground import Pointer, Sight
from tools.registry import Registry

TABLE = all_commands(Registry(()))
EVERY = pytest.mark.parametrize("command", TABLE, ids=[command.name for command in TABLE])


def named(dotted: str) -> Any:
    """What a dotted name stands for."""
    parts = dotted.split(".")
    for cut in range(len(parts) - 1, 0, -1):
        try:
            found: Any = importlib.import_module(".".join(parts[:cut]))
        except ModuleNotFoundError:
            continue
        for part in parts[cut:]:
            found = getattr(found, part)
        return found
    raise ImportError(dotted)


@EVERY
def test_a_command_has_words_an_icon_and_a_twin(command: Command) -> None:
    category, _, rest = command.name.partition(".")
    assert category
    assert rest.isidentifier()
    assert command.label[0].isupper()
    assert len(command.label) <= 32
    assert len(command.tooltip.split()) >= 8, command.tooltip
    assert command.tooltip.endswith(".")
    assert command.icon is None or command.icon in icon_names()
    assert (command.undo is not None) == (command.touches == "document")
    assert callable(named(command.twin))


@EVERY
def test_the_palette_finds_a_command_by_its_label(command: Command, host: Host) -> None:
    found = host.commands.find(command.label.replace("…", ""))
    assert command.name in [c.name for c in found[:3]]


def test_names_and_labels_are_unique_and_every_tool_is_there(host: Host) -> None:
    assert len({command.name for command in TABLE}) == len(TABLE)
    labels = [(command.category, command.label) for command in TABLE]
    assert len(set(labels)) == len(labels)
    for tool in host.desk.session.tools:
        assert f"tool.{tool.name}" in host.commands
    with pytest.raises(ValueError, match=r"two commands edit\.undo"):
        host.commands.add([host.commands["edit.undo"]])


# these ask for a file first; the window's own tests drive them
ASKING = ("file.import_mesh", "file.reload_mesh", "file.open_plate", "file.import_tracks")
BEFORE = {
    "curves.paste": "curves.copy", "view.unhide_all": "view.hide", "groom.thaw_all": "groom.freeze_others",
    "groom.wash_all": "groom.spray_selected"}


OWN_FILES = ("Pose", "Match", "Feathers")  # categories whose steps have tests of their own
STEPS = [c for c in TABLE if c.undo is not None and c.name not in ASKING and c.category not in OWN_FILES]


@pytest.mark.parametrize("command", STEPS, ids=lambda c: c.name)
def test_the_step_has_the_name_it_promises(command: Command, host: Host) -> None:
    bend_and_select(host)
    if command.name in BEFORE:
        assert host.commands.run(BEFORE[command.name]), host.failed
    before = host.desk.document
    assert host.commands.run(command.name), host.failed
    assert host.desk.document is not before
    assert host.desk.session.history.undo_name == command.undo
    host.commands.run("edit.undo")
    assert host.desk.document is before


def bend_and_select(host: Host) -> None:
    """Bent hair, half of it selected, some through the skin, and two kinds of keys: something for every command."""
    document = host.desk.document
    groom = document.grooms[0]
    points = groom.guides.points.copy()
    points[:, 2, 0] += np.linspace(0.01, 0.05, len(points))
    points[0, -1, 1] = -0.05
    selected = np.arange(len(points)) % 2 == 0
    keys = (Key(frame=990.3, value=0.1), Key(frame=1004.6, value=0.5, arrive="linear", leave="linear"))
    host.desk.session.commit("Bend", with_groom(document, groom.replace(
        guides=groom.guides.replace(points=points, selected=selected),
        coat=groom.coat.replace(clump=Value(base=Curve(keys=keys))))))
    host.desk.keys.select_all()


def test_every_tool_has_a_radial_menu_of_commands(host: Host) -> None:
    for tool in host.desk.session.tools:
        names = radial_names(tool.name)
        assert len(names) <= MOST
        assert len(set(names)) == len(names)
        assert all(name in host.commands for name in names)


def test_undo_and_redo_say_why_they_cannot(host: Host) -> None:
    assert host.commands.reason("edit.undo") == "There is nothing to undo."
    assert not host.commands.run("edit.undo")
    assert host.said == ["There is nothing to undo."]
    host.commands.run("view.hide")
    assert host.desk.document.meshes[0].hidden
    assert host.commands.run("edit.undo")
    assert not host.desk.document.meshes[0].hidden
    assert host.commands.run("edit.redo")
    assert host.desk.document.meshes[0].hidden
    assert host.commands.run("view.unhide_all")
    assert host.commands.run("edit.revert")
    assert host.desk.session.history.cursor == 0


def test_what_goes_wrong_is_said_in_words(host: Host) -> None:
    def fail(_: object) -> None:
        raise UserError("There is no paper in the printer.")

    host.commands.add([Command("test.fail", "Fail", "Fails.", fail, "builtins.print")])
    assert not host.commands.run("test.fail")
    assert host.failed == ["There is no paper in the printer."]
    assert host.commands.recent == ["test.fail"]


@pytest.mark.parametrize("name", ["wire", "grid", "axes", "hud", "hair", "guides"])
def test_switches_switch(host: Host, name: str) -> None:
    command = host.commands["view.wire_overlay" if name == "wire" else f"view.{name}"]
    assert command.checked is not None
    before = command.checked(host.desk)
    assert getattr(host.desk.workspace.view, name) == before
    host.commands.run(command.name)
    assert command.checked(host.desk) is not before
    assert getattr(host.desk.workspace.view, name) is not before
    assert host.desk.session.history.undo_name is None


def test_shadings_go_and_come_back(host: Host) -> None:
    for name in ("matcap", "wire", "lines"):
        host.commands.run(f"view.{name}")
        assert host.desk.workspace.view.shading == name
        host.commands.run(f"view.{name}")
        assert host.desk.workspace.view.shading == "shaded"


def test_isolate_ghost_and_show_all(host: Host) -> None:
    mesh = host.desk.document.meshes[0].id
    host.commands.run("view.isolate")
    host.commands.run("view.ghost")
    assert host.desk.workspace.view.isolated == (mesh,)
    assert host.desk.workspace.view.ghosted == (mesh,)
    assert host.commands["view.ghost"].checked is not None
    assert host.commands["view.ghost"].checked(host.desk)
    host.commands.run("view.unhide_all")
    assert host.desk.workspace.view.isolated == host.desk.workspace.view.ghosted == ()
    assert host.desk.session.history.undo_name is None  # nothing was hidden in the document
    assert host.commands.reason("view.unhide_all") == "Nothing is hidden."


def test_frames_stay_on_the_timeline(host: Host) -> None:
    document = host.desk.document
    host.commands.run("frame.last")
    assert host.desk.workspace.frame == document.last_frame
    host.commands.run("frame.next")
    assert host.desk.workspace.frame == document.last_frame
    host.commands.run("frame.previous")
    assert host.desk.workspace.frame == document.last_frame - 1
    host.commands.run("frame.first")
    assert host.desk.workspace.frame == document.first_frame


def test_views_are_kept_and_looked_through_again(host: Host) -> None:
    assert host.commands.reason("view.store_3") is not None
    one, other = (Camera(world_from_camera=look_at([0.0, 0.0, z], [0.0, 0.0, 0.0])) for z in (2.0, 5.0))
    host.desk.set_workspace(cameras=(one,))
    assert host.commands.reason("view.recall_3") == "No view is kept under 3 yet."
    host.commands.run("view.store_3")
    host.desk.set_workspace(cameras=(other,))
    host.commands.run("view.recall_3")
    assert host.desk.workspace.cameras[0] is one


def test_the_brush_and_what_it_respects(host: Host) -> None:
    host.commands.run("tool.comb")
    size = host.desk.session.tool.params.size
    host.commands.run("tool.larger")
    assert host.desk.session.tool.params.size == pytest.approx(1.15 * size)
    host.commands.run("tool.smaller")
    assert host.desk.session.tool.params.size == pytest.approx(size)
    for _ in range(30):
        host.commands.run("tool.stronger")
    assert host.desk.session.tool.params.strength == 1.0
    for _ in range(30):
        host.commands.run("tool.weaker")
    assert host.desk.session.tool.params.strength == 0.0
    host.desk.choose("comb", falloff="constant")
    host.commands.run("tool.falloff")
    assert host.desk.session.tool.params.falloff == "smooth"
    host.commands.run("tool.falloff")
    assert host.desk.session.tool.params.falloff == "flat"
    host.commands.run("tool.world_size")
    assert host.desk.session.tool.params.world
    for name in ("symmetry", "hairspray", "selection"):
        command = host.commands["tool.symmetry" if name == "symmetry" else f"tool.respect_{name}"]
        before = getattr(host.desk.workspace.respect, name)
        host.commands.run(command.name)
        assert getattr(host.desk.workspace.respect, name) is not before
        assert command.checked is not None
        assert command.checked(host.desk) is not before


def test_undo_amidst_a_stroke_takes_the_stroke_back(host: Host) -> None:
    before = host.desk.document
    camera = frame_points(before.grooms[0].guides.points.reshape(-1, 3), (0.0, -0.3, -1.0))
    host.commands.run("tool.comb")
    hand, sight = host.desk.session.hand, Sight(camera, 300, 300)
    hand.press(sight, Pointer(120.0, 120.0))
    hand.move((Pointer(180.0, 150.0),))
    assert host.desk.document is not before
    host.commands.run("view.grid")
    assert host.desk.session.stroking  # to look otherwise disturbs no stroke
    assert host.commands.run("edit.undo")
    assert not host.desk.session.stroking
    assert host.desk.document is before
    assert host.desk.session.history.redo_name == "Comb"


def test_a_macro_is_recorded_and_forgotten(host: Host) -> None:
    session = host.desk.session
    assert host.commands.reason("macro.save") is not None
    assert host.commands.run("macro.record")
    macro = session.recording
    assert macro is not None
    assert not host.commands.run("macro.record")
    host.commands.run("groom.select_all")
    host.commands.run("view.hide")
    assert [step.name for step in macro.steps] == ["select_all", "Hide"]
    assert host.commands.reason("macro.save") is None
    assert host.commands.run("macro.discard")
    assert session.recording is None


def test_theme_and_text(host: Host) -> None:
    host.commands.run("window.theme")
    assert host.settings.theme == "light"
    for _ in range(20):
        host.commands.run("window.text_larger")
    assert host.settings.text_size == 20
    for _ in range(20):
        host.commands.run("window.text_smaller")
    assert host.settings.text_size == 10


@pytest.mark.parametrize(("words", "name"), [
    ("undo", "edit.undo"), ("save", "file.save"), ("redo again", "edit.redo"), ("frame sel", "view.frame_selected"),
    ("import", "file.import_mesh"), ("screenshot", "file.screenshot"), ("wireframe", "view.wire"),
    ("both sides", "tool.symmetry"), ("mirror", "groom.mirror"), ("bigger brush", "tool.larger"),
    ("hotkey", "window.keymap"), ("record", "macro.record"),
    ("prefrences", "window.preferences"), ("symetry", "tool.symmetry"), ("simetry", "tool.symmetry"),
    ("plybalst", "file.playblast"), ("prefernces…", "window.preferences"),
    ("view top", "view.top"), ("pyth", "window.console"), ("comb", "tool.comb"),
])
def test_words_find_their_command_first(host: Host, words: str, name: str) -> None:
    assert host.commands.find(words)[0].name == name


def test_nonsense_finds_nothing_and_no_words_the_last_used(host: Host) -> None:
    assert host.commands.find("xqzwvk") == []
    assert {c.category for c in host.commands.find("undo")} == {"Edit"}
    assert len(host.commands.find("  ")) == len(TABLE)
    host.commands.run("view.grid")
    host.commands.run("view.axes")
    assert [c.name for c in host.commands.find("")[:2]] == ["view.axes", "view.grid"]


def test_safe_start_leaves_plug_ins_out(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    plugin = (
        "from tools.groom.comb import CombParams\nfrom tools.tool import Tool\n"
        "class Twist(Tool):\n    name='studio_twist'; label='Twist'; icon='twist'; order=900\n"
        "    tooltip='Twists hair about its root the way our studio likes it.'\n"
        "    hint='Drag: twist'; step='Twist'; Params=CombParams\n")
    (tmp_path / "twist.py").write_text(plugin)
    (tmp_path / "broken.py").write_text("import nothing_of_that_name\n")
    monkeypatch.setenv("FILOPLUME_PLUGINS", str(tmp_path))
    registry = Registry()
    assert "tool.studio_twist" in [command.name for command in all_commands(registry)]
    assert [trouble.file for trouble in registry.troubles] == [str(tmp_path / "broken.py")]
    assert "nothing_of_that_name" in registry.troubles[0].reason
    assert "tool.studio_twist" not in [command.name for command in all_commands(Registry(()))]
