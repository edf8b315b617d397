"""The shot of the demo from its drawing to its neck: a plate of the project's own renderer, tracked and solved."""

from pathlib import Path

from app.report import Report
from app.shot_demo import make_shot
from core.formats.project import read_project
from core.formats.shot_file import read_shot


def test_camera_head_and_neck_are_those_the_plate_was_made_of(tmp_path: Path) -> None:
    done, written = make_shot(tmp_path, Report(True))
    assert not done.warnings
    assert done.camera_mm < 8.0
    assert done.camera_degrees < 0.5
    assert done.head_degrees < 1.2
    assert done.neck_degrees < 0.5
    assert all(Path(path).exists() for path in written)
    assert len(read_shot(tmp_path / "match.usda", None).frames) == 24
    document = read_project(tmp_path / "match.filo").document
    assert len(document.solves) == 1
    assert document.plates[0].path == "match-plate/plate.####.png"
