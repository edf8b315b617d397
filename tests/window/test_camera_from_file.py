"""A shot's camera in the window: asked for by a command, seen whole in a window of any shape."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtWidgets import QFileDialog, QMenu

from app.window.files.playblast import PlayblastDialog
from core.camera import project
from core.gate import gate_box
from tests.window.hand import Hand

LENS = {"type": "perspective", "perspective": {"yfov": 0.4, "aspectRatio": 2.39, "znear": 0.1}}


def written(path: Path, names: tuple[str, ...]) -> Path:
    nodes = [{"name": name, "camera": 0, "translation": [0.1 * row, 0.3, 2.0]} for row, name in enumerate(names)]
    path.write_text(json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(len(names)))}], "nodes": nodes,
        "cameras": [LENS]}))
    return path


def test_the_command_asks_for_a_file_and_shows_all_that_its_camera_sees(hand: Hand, tmp_path: Path) -> None:
    window = hand.window
    assert window.commands.run("view.camera_from_file")
    dialog = next(d for d in window.findChildren(QFileDialog) if d.isVisible())
    dialog.fileSelected.emit(str(written(tmp_path / "shot.gltf", ("hero",))))
    dialog.close()
    hand.until(lambda: bool(window.desk.workspace.cameras) and np.allclose(
        window.desk.workspace.cameras[0].position, (0, 0.3, 2)))
    hand.rest()
    assert "hero" in window.status.words.text()
    width, height = hand.view.pixels()
    assert width / height < 2.39  # so it must be opened to be seen whole
    tall = np.tan(0.2)
    corners = [(x * tall * 2.39, 0.3 + y * tall, 1.0) for x in (-1, 1) for y in (-1, 1)]
    seen = project(window.desk.workspace.cameras[0], corners, width, height).xy
    assert ((seen > 0) & (seen < [width, height])).all()
    assert np.ptp(seen[:, 0]) > 0.9 * width
    gate = window.desk.workspace.view.gate
    assert gate is not None
    box = gate_box(gate, window.desk.workspace.cameras[0], width, height)
    assert box is not None
    assert np.allclose([seen.min(axis=0), seen.max(axis=0)], [box[:2], box[2:]], atol=0.01)

    def brightness(y: float) -> float:
        return hand.view.grabFramebuffer().pixelColor(width // 2, round(y)).lightnessF()

    outside, inside = 0.5 * box.top, box.top + 0.5 * box.top
    dark, ground = brightness(outside), brightness(inside)
    window.commands.run("view.gate")
    hand.rest()
    assert dark < 0.6 * brightness(outside)
    assert brightness(inside) == ground
    window.commands.run("view.gate")
    window.make_playblast()
    dialog = next(d for d in window.findChildren(PlayblastDialog) if d.isVisible())
    assert dialog.width_box.value() / dialog.height_box.value() == pytest.approx(2.39, rel=0.01)
    dialog.close()


def test_several_cameras_are_chosen_from_by_name(hand: Hand, tmp_path: Path) -> None:
    window = hand.window
    window.camera_from_file(written(tmp_path / "shot.gltf", ("hero", "witness")))
    menus: list[QMenu] = []
    hand.until(lambda: bool(menus) or bool(
        menus.extend(m for m in window.findChildren(QMenu) if m.isVisible())) or bool(menus))
    assert [action.text() for action in menus[0].actions()] == ["hero", "witness"]
    menus[0].actions()[1].trigger()
    menus[0].close()
    assert np.allclose(window.desk.workspace.cameras[0].position, (0.1, 0.3, 2))


def test_a_file_without_a_camera_is_said_and_the_view_stays(hand: Hand, tmp_path: Path) -> None:
    hand.rest()  # the first view fits the window once that has its size
    before = hand.window.desk.workspace.cameras
    hand.window.camera_from_file(written(tmp_path / "none.gltf", ()))
    hand.until(lambda: "holds no camera" in hand.window.status.words.text())
    assert hand.window.desk.workspace.cameras is before
