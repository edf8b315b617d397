"""A model of photographs at the real window: clicks, keys, the list, a drag that all follows, and a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from app.window.match.model_panel import NOTHING, ModelPanel
from core.document import Document
from core.formats.mesh_file import read_mesh
from core.image.plate import Plate
from core.match.photomodel.records import NOTHING as NO_PICKS
from core.match.photomodel.records import ModelPoint, Photomodel, picked
from core.match.photomodel.rows import seen_by
from core.match.photomodel.solve import solved
from docs.first_photomodel import CORNERS, click, drags, go_on, model
from tests.core.match.photomodel.scenes import HOUSE, places
from tests.window.conftest import Opened
from tests.window.hand import LEFT, NONE
from tests.window.match.photographs import FOCAL, PHOTOS, SIZE, corner, photographed


def pictured(folder: Path) -> Document:
    """Three photographs in which the corners of a house are picked, but for the last one; solved."""
    first = photographed(folder)
    plate = Plate(id=1, name="house", path=str(first).replace(".1.", ".#."), first=1, last=3, width=SIZE[0],
                  height=SIZE[1])
    points = tuple(ModelPoint(id=k + 1, name=f"corner {number}", picks=picked(
        [1, 2, 3], [tuple(corner(number, frame)) for frame in (1, 2, 3)])) for k, number in enumerate(CORNERS))
    photos = tuple(one.replace(plate_id=1, frame=one.id, focal_px=FOCAL, rotation=None, translation=None)
                   for one in PHOTOS)
    house = solved(Photomodel(id=1, name="house", photos=photos, points=points)).model
    last = house.points[-1].replace(picks=NO_PICKS, place=None)
    house = house.replace(points=(*house.points[:-1], last), selection=(last.id,))
    return Document(plates=(plate,), photomodels=(house,), first_frame=1, last_frame=3)


def test_a_model_is_picked_walked_built_dragged_and_given_away(opened: Opened, tmp_path: Path) -> None:
    hand = opened(pictured(tmp_path))
    window, desk = hand.window, hand.window.desk
    desk.choose("pick_point")
    desk.set_workspace(frame=1.0)
    hand.until(hand.view.isExposed)
    hand.rest()
    panel = window.findChild(ModelPanel)
    assert panel is not None
    assert "9 of 10 points solved" in panel.figures.text()
    click(hand, CORNERS[-1])
    assert model(hand).points[-1].place is None
    go_on(hand)
    assert desk.workspace.frame != 1.0
    click(hand, CORNERS[-1])
    seen = seen_by(PHOTOS[0], HOUSE[CORNERS[-1]][None])[0][0]
    there = seen_by(model(hand).photos[0], np.array([model(hand).points[-1].place]))[0][0]
    assert np.linalg.norm(there - seen) < 3.0  # pixels of the screen are as large as two of the photograph
    assert "10 of 10 points solved" in panel.figures.text()
    entry = next(panel.list.topLevelItem(k) for k in range(10) if "corner 0 " in panel.list.topLevelItem(k).text(0))
    QTest.mouseClick(panel.list.viewport(), LEFT, NONE, panel.list.visualItemRect(entry).center())
    assert model(hand).selection == (1,)
    for number in (1, 3, 4):
        click(hand, number, Qt.KeyboardModifier.ShiftModifier)
    window.commands.run("match.build_box")
    assert [part.kind for part in model(hand).parts] == ["box"]
    before = model(hand)
    drags(hand, tmp_path)
    assert desk.session.history.undo_name == "Move pick"
    assert not np.allclose(places(model(hand)), places(before), atol=1e-4)
    window.commands.run("edit.undo")
    assert model(hand) is before
    window.match.model.export(tmp_path / "house.obj")
    hand.until(lambda: not desk.jobs.running, 60_000)
    mesh = read_mesh(tmp_path / "house.obj", unit="m", up="y").mesh
    assert len(mesh.counts) == 6
    assert mesh.uvs is not None
    assert (tmp_path / "house.png").is_file()
    window.commands.run("match.model_to_scene")
    assert desk.document.meshes[-1].name == "house"
    for _ in range(3):
        window.commands.run("edit.undo")
    assert not model(hand).parts


def test_without_photographs_the_panel_says_how_to_begin(opened: Opened) -> None:
    hand = opened(Document())
    panel = hand.window.findChild(ModelPanel)
    assert panel is not None
    assert panel.figures.text() == NOTHING
