import numpy as np
import pytest

from app.solve_report import write_report
from core.document import Document
from core.formats.project import read_project, write_project
from core.image.plate import Plate
from core.match.solve.bundle import adjust
from core.match.solve.report import report
from core.match.solve.solution import Options
from core.match.solve.solve import solve
from core.match.solve.state import residuals
from core.match.solved import Advice, SolvedCamera, SolveSettings, frozen
from tests.core.match.solve.shots import FOCAL, SIZE, shot


def small_solve() -> SolvedCamera:
    """A camera of plate 1 on two frames, with the point of one track."""
    return SolvedCamera(
        id=1, plate_id=1, size=(64, 48), kind="free", lens=frozen([4.0, 0.1, 0, 0, 31.5, 23.5]),
        frames=frozen([1, 2], np.int32), rotation=frozen([np.eye(3)] * 2), translation=frozen(np.zeros((2, 3))),
        focal=frozen([50.0, 50.0]), points=frozen([[0.0, 0, 5]]), track_ids=frozen([3], np.int32), errors=frozen([0.2]),
        by_frame=frozen([0.2, 0.3]), rms=0.25, median=0.2, p95=0.3, focal_sigma=1.0, warnings=("it is small",),
        advice=(Advice(words="look", frame=2),), cubes=(3,), settings=SolveSettings(lens="brown"),
    )


def test_a_solved_camera_is_saved_and_opened_again(tmp_path):
    solved = small_solve()
    plate = Plate(id=1, name="p", path="p.####.png", first=1, last=2, width=64, height=48)
    write_project(tmp_path / "a.filo", Document(plates=(plate,), solves=(solved,)))
    (back,) = read_project(tmp_path / "a.filo").document.solves
    np.testing.assert_array_equal(back.lens, solved.lens)
    assert (back.cubes, back.advice[0].frame, back.settings.lens, back.warnings) == ((3,), 2, "brown", solved.warnings)


def test_what_leaving_out_a_frame_would_do_is_told_as_solving_again_finds_it(tmp_path):
    made = shot("orbit", 30, 20, seed=1)
    shaken = made.observations.frame == 9
    xy = made.observations.xy + np.random.default_rng(5).normal(0, 0.7, made.observations.xy.shape) * shaken[:, None]
    names = [f"t<{k}>" for k in range(30)]
    found = solve(made.observations._replace(xy=xy), made.frames, 30, SIZE, Options(FOCAL))
    told = report(found, names)
    first = told.fixes[0]
    assert (first.kind, first.row) == ("frame", 9)
    rest = found.observations.take(found.used & (found.observations.frame != 9))
    again = residuals(adjust(found.state, rest, found.free).state, rest)
    assert first.rms_px == pytest.approx(float(np.sqrt((again**2).sum(axis=1).mean())), rel=2e-3)
    assert first.rms_px < 0.97 * told.rms_px
    assert any("frame 1010" in words for words in told.advice)
    write_report(tmp_path / "page.html", found, told, names, "shot <1>")
    page = (tmp_path / "page.html").read_text()
    assert "frame 1010" in page
    assert "t&lt;4&gt;" in page
    assert "shot <1>" not in page
    assert "http" not in page
