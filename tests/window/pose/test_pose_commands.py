"""Commands of the pose craft's actions: one step of the name they promise, or a sentence; keys of the craft alone."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtWidgets import QInputDialog
from pytestqt.qtbot import QtBot

from app.window.files import file_actions
from app.window.main import MainWindow
from core.document import Document, MeshObject, with_mesh
from core.formats.mesh_file import write_mesh
from core.pose.pose_space import Correctives
from core.pose.rig import Constraint
from core.pose.skeleton import SkinWeights
from core.record import freeze
from tests.tools.pose_scenes import document, strip, turned
from tests.window.conftest import Opened
from tests.window.host import Host
from tools import pose_edits, posing_edits
from tools.pose.actions import ACTIONS
from tools.skin_edits import lock_joints

LEFT = turned("left", arm_L=(0, 40, 30))


def ready() -> Document:
    """A rig with something for every action to do."""
    made = document(joint_selection=("root", "lid"), locked_joints=("arm_R",))
    item = made.meshes[0]
    assert item.rig is not None
    skin = item.rig.skin.replace(weights=freeze((item.rig.skin.weights * np.float32(0.9995)).astype(np.float32)))
    mask = freeze((strip().points[:, 0] > 0.4).astype(np.float32))
    dial = item.rig.controls[0].replace(name="dial 2")
    rig = item.rig.replace(skin=skin, controls=(*item.rig.controls, dial))
    made = with_mesh(made, item.replace(rig=rig, mask=mask, correctives=Correctives()))
    for pose, push in ((LEFT, 0.02), (turned("far", arm_L=(0, 80, 30)), 0.04)):
        made = pose_edits.add_sculpt(made, 1, pose, strip().points + np.float32([0, 0, push]))
    made = pose_edits.keep_pose(made, 1, turned("kept", arm_R=(0, 20, 0)))
    held = turned("held", arm_L=(0, 40, 30), lid=(0, 0, 20))
    return pose_edits.hold_pose(made, 1, held)


@pytest.fixture
def rigged(qtbot: QtBot) -> Iterator[Host]:
    host = Host(ready())
    qtbot.addWidget(host)
    yield host
    host.desk.session.close(discard=True)


AT_A_SCULPT = ("mirror_sculpt", "merge_poses", "delete_pose")
FIRST = {  # what makes room for an action to do something
    "mirror_weights": lambda d: pose_edits.select_joints(d, 1, ()),
    "unlock_joints": lambda d: lock_joints(d, 1, ("lid",)),
    "delete_pose_key": lambda d: posing_edits.key_pose(d, 1, LEFT, 1001.0),
    "free_joints": lambda d: pose_edits.set_constraints(d, 1, [Constraint(joint="lid", kind="limit")]),
    "forget_pose": lambda d: pose_edits.hold_pose(d, 1, d.meshes[0].library[0]),
    "prune_weights": lambda d: with_mesh(d, _spread(d)),
    **{name: lambda d: pose_edits.hold_pose(d, 1, LEFT) for name in AT_A_SCULPT},
}


def _spread(made: Document) -> MeshObject:
    """Four joints at every vertex, one of them weakly."""
    item = made.meshes[0]
    count = len(strip().points)
    joints = np.tile(np.array([0, 1, 2, 3], np.int32), (count, 1))
    weights = np.tile(np.array([0.4, 0.3, 0.295, 0.005], np.float32), (count, 1))
    skin = SkinWeights(joints=freeze(joints), weights=freeze(weights))
    assert item.rig is not None
    spread: MeshObject = item.replace(rig=item.rig.replace(skin=skin))
    return spread


@pytest.mark.parametrize("name", [n for n, action in ACTIONS.items() if action.asks is None])
def test_the_step_has_the_name_it_promises(name: str, rigged: Host) -> None:
    session, command = rigged.desk.session, rigged.commands[f"pose.{name}"]
    if name in FIRST:
        session.edit("First", FIRST[name])
    before = session.document
    if name == "limit_influences":  # four at most is what all rigs here have
        session.act(name, influences=2)
    else:
        assert rigged.commands.run(command.name), rigged.failed
    assert session.document is not before
    assert session.history.undo_name == command.undo
    session.undo()
    assert session.document is before


def test_without_a_rig_they_say_why_not(host: Host) -> None:
    for name in ACTIONS:
        assert not host.commands.run(f"pose.{name}")
    assert set(host.said) == {"There is no rig yet: open a mesh with a skeleton or blend shapes first."}


@pytest.mark.parametrize("name", [n for n, action in ACTIONS.items() if action.asks in ("name", "to")])
def test_a_name_is_asked_for(name: str, rigged: Host) -> None:
    session = rigged.desk.session
    assert rigged.commands.run(f"pose.{name}")
    assert session.history.names == ("New",), "nothing is done before there is an answer"
    (dialog,) = rigged.findChildren(QInputDialog)
    assert dialog.windowTitle() == ACTIONS[name].label
    dialog.setTextValue("mood")
    dialog.accept()
    assert session.history.undo_name == ACTIONS[name].step
    rig = session.document.meshes[0].rig
    assert rig is not None
    assert "mood" in [control.name for control in rig.controls]


def test_a_sculpt_is_asked_for_and_imported(opened: Opened, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    hand = opened(ready())
    window: MainWindow = hand.window
    wanted = strip().points + np.float32([0, 0, 0.05])
    write_mesh(tmp_path / "up.obj", strip().replace(points=freeze(wanted)))

    def choose(parent, title, filters, done, save=None, start=None):  # type: ignore[no-untyped-def]
        assert "*.obj" in filters[0]
        done(tmp_path / "up.obj")

    monkeypatch.setattr(file_actions, "choose_file", choose)
    assert window.commands.run("pose.import_sculpt")
    hand.until(lambda: window.desk.session.history.undo_name == "Import sculpt")
