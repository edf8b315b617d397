"""Feathers in the window: laid beside it, changed by the panel of their keys, taken away; undo takes all of it back."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Literal, cast

import numpy as np
import pytest
from pxr import Usd, UsdGeom
from pytestqt.qtbot import QtBot

from app.window import feather_coats
from app.window.commands import Window
from app.window.craft_panels import CoatPanel
from app.window.desk import Desk
from app.window.outliner import Outliner
from core.camera import project
from core.document import Document, MeshObject, with_groom
from core.evaluator import Evaluator
from core.value import constant
from tests.core.feather.coat.bodies import egg
from tests.window.conftest import Opened
from tools.feather_edits import add_feathers, set_feathers
from tools.session import Session

COUNT = 60
NAMED = {command.name: command for command in feather_coats.FEATHER_COATS}


@pytest.fixture
def desk(qtbot: QtBot, monkeypatch: pytest.MonkeyPatch) -> Iterator[Desk]:
    """An egg that was dressed as an owl."""
    monkeypatch.setattr(feather_coats, "FEATHERS", COUNT)
    desk = Desk(Session(Document(meshes=(MeshObject(id=1, name="egg", mesh=egg()),))))
    feather_coats.dress_with_feathers(desk, desk.document.meshes[0], "owl")
    qtbot.waitUntil(lambda: bool(desk.document.feathers), timeout=120_000)
    yield desk
    assert desk.jobs.close()
    desk.session.close(discard=True)


def test_feathers_of_a_bird_come_with_keys_at_hand_as_one_step(desk: Desk) -> None:
    coat = desk.document.feathers[0]
    assert coat.preset == "owl"
    assert sum(placement.count for placement in coat.placements) == COUNT
    assert desk.groom is not None
    assert coat.keys_id == desk.groom.id
    assert desk.session.history.undo_name == "Dress with feathers"
    desk.session.undo()
    assert desk.document.feathers == ()
    assert desk.document.grooms == ()


def test_the_panel_of_keys_is_that_of_their_feathers(desk: Desk, qtbot: QtBot) -> None:
    panel = CoatPanel(desk)
    qtbot.addWidget(panel)
    assert panel.title == "Feathers"
    coat = desk.document.feathers[0]
    assert panel.form is not None
    assert panel.form.record() is coat
    longer = constant(1.5)
    panel.edited(coat.replace(length=longer), True)
    assert desk.document.feathers[0].length is longer
    assert desk.session.history.undo_name == "Feathers length"
    assert panel.form.record() is desk.document.feathers[0]


def test_deleting_the_keys_takes_their_feathers_too(desk: Desk, qtbot: QtBot) -> None:
    tree = Outliner(desk)
    qtbot.addWidget(tree)
    assert [tree.picture_of(item) for item in (desk.document.meshes[0], desk.document.grooms[0])] == ["mesh", "feather"]
    tree.delete(desk.groom)
    assert desk.document.feathers == ()
    assert desk.document.grooms == ()
    desk.session.undo()
    assert len(desk.document.feathers) == 1


def test_commands_hide_and_remove_what_the_keys_at_hand_hold(desk: Desk) -> None:
    window = cast(Window, SimpleNamespace(desk=desk))
    dress, hide, remove = (NAMED[f"feathers.{name}"] for name in ("dress", "hide", "remove"))
    assert dress.enabled(desk) is None
    assert hide.checked is not None
    for hidden in (True, False):
        hide.run(window)
        assert desk.document.feathers[0].hidden == hide.checked(desk) == hidden
    remove.run(window)
    assert desk.session.history.undo_name == remove.undo
    assert desk.document.feathers == ()
    assert hide.enabled(desk) is not None
    assert desk.groom is not None


def test_selected_keys_give_tracts_and_directions(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    window = cast(Window, SimpleNamespace(desk=desk))
    tract, gone, direction = (NAMED[f"feathers.{name}"] for name in ("tract", "remove_tract", "direction"))
    assert tract.enabled(desk) is not None
    assert gone.enabled(desk) is not None
    groom = desk.groom
    assert groom is not None
    selected = np.arange(len(groom.guides)) < 3
    desk.edit("Select", with_groom, groom.replace(guides=groom.guides.replace(selected=selected)))
    monkeypatch.setattr(feather_coats, "ask_text", lambda parent, title, label, done: done("back"))
    tract.run(window)
    assert [made.name for made in desk.document.feathers[0].tracts] == ["back"]
    assert desk.session.history.undo_name == tract.undo
    gone.run(window)
    assert desk.document.feathers[0].tracts == ()
    direction.run(window)
    assert len(desk.document.feathers[0].strokes) == 3
    assert desk.session.history.undo_name == direction.undo


def test_a_hand_takes_a_feather_in_the_view_bends_it_and_gives_it_back(opened: Opened, evaluator: Evaluator) -> None:
    bare = Document(meshes=(MeshObject(id=1, name="egg", mesh=egg()),))
    hand = opened(add_feathers(bare, 1, 300, evaluator, keys=12))
    window, desk = hand.window, hand.window.desk
    window.commands.run("window.craft_feather")
    window.look_from("left")
    hand.finish()
    assert [name for name in ("coat", "tool") if window.panels[name].isVisible()] == ["coat", "tool"]
    assert not window.panels["controls"].isVisible()
    assert hand.view.picture is not None
    assert "feathers 300" in window.viewport.figures.lines(hand.view.picture)
    hand.drag((0.5, 0.5), (0.55, 0.42))
    taken = desk.document.feathers[0].proxies
    assert len(taken) == 1
    assert (taken[0].shafts[0] != taken[0].rest).any()
    assert desk.session.history.undo_name == "Pose feather"
    hand.finish()
    window.commands.run("feathers.give_back")
    assert desk.document.feathers[0].proxies == ()
    desk.session.undo()
    desk.session.undo()
    assert desk.document.feathers[0].proxies == ()


def test_crossings_that_are_left_are_looked_at_one_after_another(opened: Opened, evaluator: Evaluator) -> None:
    bare = Document(meshes=(MeshObject(id=1, name="egg", mesh=egg()),))
    wild = set_feathers(add_feathers(bare, 1, 120, evaluator, keys=12), 1, layered=False, variation=4.0)
    hand = opened(wild)
    hand.finish()
    window, desk = hand.window, hand.window.desk
    lying = desk.session.plumages.last(1)
    assert lying is not None
    assert len(lying.left.first) > 3
    said: list[str] = []
    desk.said.connect(said.append)
    for number in range(2):
        window.commands.run("feathers.next_crossing")
        pair = [lying.left.first[number], lying.left.second[number]]
        first, second = lying.laid.ids[pair]
        assert f"feathers {first} and {second}" in said[-1]
        camera = desk.workspace.cameras[0]
        pixels = project(camera, lying.laid.layered.vanes[pair].reshape(-1, 3), 400, 300)
        np.testing.assert_allclose(pixels.xy.mean(axis=0), [200.0, 150.0], atol=60.0)


@pytest.mark.parametrize("form", ["instances", "nurbs", "barbs"])
def test_the_coat_at_hand_is_written_beside_the_window(
    desk: Desk, qtbot: QtBot, tmp_path: Path, form: Literal["instances", "nurbs", "barbs"]
) -> None:
    said: list[str] = []
    desk.said.connect(said.append)
    path = tmp_path / "coat.usdc"
    feather_coats.export_feathers(desk, path, form)
    qtbot.waitUntil(lambda: any(str(path) in words for words in said), timeout=60_000)
    stage, found = Usd.Stage.Open(str(path)), set[int]()
    for prim in stage.Traverse():
        ids = UsdGeom.PrimvarsAPI(prim).GetPrimvar("feather_id")
        if ids.IsDefined() and not prim.IsA(UsdGeom.NurbsPatch):
            found |= set(ids.Get())
    assert len(found) == COUNT
