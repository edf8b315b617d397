"""What leaves the program: a hidden groom does not."""

from pathlib import Path

import numpy as np
import pytest

from app.conversion import convert
from app.deliver import deliver, exported_groom, saved_view
from core.camera import Camera, look_at, project
from core.errors import UserError
from core.formats.project import read_project, write_project
from core.gate import gate_box, gate_within
from core.workspace import ViewOptions, Workspace
from tests.documents import small_document
from tools.document_edits import set_groom_hidden


def test_the_first_groom_that_is_shown_is_exported(tmp_path: Path) -> None:
    document = small_document()
    second = document.replace(grooms=(*document.grooms, document.grooms[0].replace(id=9, name="trim")))
    assert exported_groom(second) is second.grooms[0]
    hidden = set_groom_hidden(second, second.grooms[0].id, True)
    assert exported_groom(hidden).id == 9
    nothing = set_groom_hidden(hidden, 9, True)
    project = tmp_path / "bald.filo"
    deliver(project, nothing, {})
    assert [g.hidden for g in read_project(project).document.grooms] == [True, True]  # a project keeps all of it
    with pytest.raises(UserError, match="is hidden; show the one to export"):
        convert(project, tmp_path / "bald.hair", None, None, lambda note: None)
    assert not (tmp_path / "bald.hair").exists()
    write_project(project, hidden)
    assert convert(project, tmp_path / "trim.hair", None, None, lambda note: None)["guides"] > 0
    assert (tmp_path / "trim.hair").exists()


@pytest.mark.parametrize(("size", "wide"), [(None, True), ((400, 400), True), ((800, 200), False)])
def test_a_saved_view_is_what_the_film_gate_takes(size: tuple[int, int] | None, wide: bool) -> None:
    camera = Camera(world_from_camera=look_at((3.0, 2.0, 5.0), np.zeros(3)))
    gate = gate_within(camera, 2.0, 1.5)
    left, top, right, bottom = gate_box(gate, camera, 1500, 1000) or (0.0,) * 4
    assert ((right - left) / (bottom - top)) == pytest.approx(2.0)
    point = np.array([[0.4, -0.3, 0.2]])
    (x, y), = project(camera, point, 1500, 1000).xy
    part = np.array([(x - left) / (right - left), (y - top) / (bottom - top)]) - 0.5  # of the gate
    found = saved_view(Workspace(cameras=(camera,), view=ViewOptions(gate=gate)), size)
    assert found is not None
    seen, (width, height) = found
    assert (width, height) == (size or (1600, 800))
    (px, py), = project(seen, point, width, height).xy
    gate_width, gate_height = (width, width / 2.0) if wide else (height * 2.0, height)
    whole = np.array([(px + 0.5 - 0.5 * width) / gate_width, (py + 0.5 - 0.5 * height) / gate_height])
    np.testing.assert_allclose(whole, part, atol=1e-6)
    hidden = Workspace(cameras=(camera,), view=ViewOptions(gate=gate, gate_shown=False))
    assert saved_view(hidden, (640, 480)) == (camera, (640, 480))
    assert saved_view(Workspace(), None) is None
