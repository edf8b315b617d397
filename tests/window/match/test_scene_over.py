"""The document's meshes over the plate, through a camera whose lens bends: OpenCV says where they must be."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from PySide6.QtGui import QImage

from app.window.screenshot import view_image
from core.document import Document, MeshObject
from core.formats.frame_decoder import FrameDecoder
from core.formats.plate_file import read_plate
from core.image.plate_view import view_points
from core.mesh.mesh import Mesh
from tests.core.match.test_through import SIZE, UP, opencv, solved
from tests.window.conftest import Opened
from tests.window.hand import Hand

HALF = 0.04  # metres


def octahedron(centre: np.ndarray) -> Mesh:
    points = (centre + HALF * np.concatenate([np.eye(3), -np.eye(3)])).astype(np.float32)
    corners = [(0, 1, 2), (1, 3, 2), (3, 4, 2), (4, 0, 2), (1, 0, 5), (3, 1, 5), (4, 3, 5), (0, 4, 5)]
    return Mesh(
        points=points, counts=np.full(8, 3, np.int32), corners=np.array(corners, np.int32).ravel(), uvs=None,
        parts=np.zeros(8, np.int32), part_names=("gem",))


@pytest.fixture(scope="module")
def grey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("plate") / "grey"
    folder.mkdir()
    for n in range(3):
        cv2.imwrite(str(folder / f"grey.{1001 + n}.png"), np.full((SIZE[1], SIZE[0], 3), 12, np.uint8))
    return folder


def test_meshes_stand_where_the_lens_puts_them_on_every_frame(opened: Opened, grey: Path) -> None:
    decoder = FrameDecoder()
    plate = read_plate(grey, decoder)
    decoder.close()
    camera = solved()
    places = np.array([[-1.1, 0.5, 0.2], [1.2, -0.5, -0.1], [0.0, 0.1, 0.4], [1.0, 0.6, 0.0]])  # of the solve, y down
    meshes = tuple(
        MeshObject(id=k + 1, name=f"gem {k}", mesh=octahedron(place * UP)) for k, place in enumerate(places))
    hand = opened(Document(meshes=meshes, plates=(plate,), solves=(camera.replace(plate_id=plate.id),)))
    window, desk = hand.window, hand.window.desk
    window.commands.run("window.craft_match")
    assert desk.workspace.view.over_plate == 1.0
    for row, frame in enumerate((1001, 1003)):
        desk.set_workspace(frame=float(frame))
        hand.finish()
        on = _view_of(hand)
        window.commands.run("match.scene")
        hand.finish()
        off = _view_of(hand)
        window.commands.run("match.scene")
        hand.finish()
        seen = np.abs(on.astype(int) - off)[..., :3].max(axis=2) > 12
        count, labels, _, centres = cv2.connectedComponentsWithStats(seen.astype(np.uint8))
        found = [centres[k] for k in range(1, count) if (labels == k).sum() > 20]
        told = opencv(camera, 2 * row, places)
        expected = view_points(hand.view.eye.camera, 1.0, told, *hand.view.pixels())
        assert len(found) == len(expected)
        for place in expected:
            assert min(np.linalg.norm(np.array(found) - place, axis=1)) < 0.75  # the middle of what is seen of a gem


def _view_of(hand: Hand) -> NDArray[np.uint8]:
    """The picture of the view alone (H, W, 4)."""
    image = view_image(hand.view).convertToFormat(QImage.Format.Format_RGBA8888)
    return np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.width(), 4).copy()


def test_the_movie_of_the_solve_shows_them_there_too(opened: Opened, grey: Path, tmp_path: Path) -> None:
    decoder = FrameDecoder()
    plate = read_plate(grey, decoder)
    decoder.close()
    camera = solved().replace(plate_id=plate.id)
    place = np.array([0.9, 0.5, 0.1])
    gem = MeshObject(id=1, name="gem", mesh=octahedron(place * UP))
    hand = opened(Document(meshes=(gem,), plates=(plate,), solves=(camera,)))
    window, desk = hand.window, hand.window.desk
    window.commands.run("window.craft_match")
    hand.finish()
    for name, opacity in (("with", 1.0), ("without", 0.0)):
        desk.set_workspace(view=desk.workspace.view.replace(over_plate=opacity))
        window.match.doors.write_check_movie(tmp_path / f"{name}.mp4")
        hand.until(lambda name=name: (tmp_path / f"{name}.mp4").exists() and not desk.jobs.running, 60_000)
    films = [cv2.VideoCapture(str(tmp_path / f"{name}.mp4")) for name in ("with", "without")]
    for row in range(3):
        (good, on), (also, off) = (film.read() for film in films)
        assert good
        assert also
        seen = np.abs(on.astype(int) - off).max(axis=2) > 40  # more than the movie's own noise
        seen[:40, :240] = False  # its words
        y, x = np.nonzero(seen)
        told = opencv(camera, row, place[None])[0]
        assert len(x) > 20
        assert np.linalg.norm([x.mean() - told[0], y.mean() - told[1]]) < 1.5
