import json

import numpy as np
import pytest
from typer.testing import CliRunner

from app.cli import build
from core.errors import UserError
from core.formats import usd_solve
from core.match.solve.bundle import POSE, TURN, Free, adjust, smooth_zoom
from core.match.solve.observed import observations_of
from core.match.solve.report import report
from core.match.solve.shot import shot_of
from core.match.solve.solution import Options
from core.match.solve.solve import solve
from core.match.solve.state import FRAME_FOCAL, Observations, projected
from core.match.track import keyed_track
from tests.core.match.solve.shots import FOCAL, NOISE, SIZE, Shot, path_error, shot, turn_error


def _best(made: Shot, motion: str):
    """Bundle adjustment from the truth, of the good tracks alone."""
    good = made.observations.take(~made.bad[made.observations.track])
    truth = made.truth
    if motion == "nodal":
        truth = truth._replace(points=truth.points / np.linalg.norm(truth.points, axis=1, keepdims=True))
    zoom = smooth_zoom(made.frames) if motion == "zoom" else None
    columns = (TURN if motion == "nodal" else POSE) + ((FRAME_FOCAL,) if zoom is not None else ())
    return adjust(truth, good, Free(frame=columns, zoom=zoom), least_damping=1e-6 if motion == "nodal" else 1e-12).state


def _names(made: Shot) -> list[str]:
    return [f"t{k}" for k in range(len(made.bad))]


@pytest.mark.parametrize("motion", ["orbit", "nodal", "forward", "planar", "zoom"])
@pytest.mark.parametrize("outliers", [0.0, 0.2])
def test_a_shot_is_solved_as_well_as_from_the_truth_and_its_kind_told(motion, outliers):
    made = shot(motion, outliers=outliers, seed=1)
    found = solve(made.observations, made.frames, len(made.bad), SIZE, Options(FOCAL))
    told = report(found, _names(made))
    best = _best(made, motion)
    assert found.known.all()
    assert not (found.held & made.bad).any()
    assert told.kind == {"zoom": "free", "orbit": "free", "forward": "free"}.get(motion, motion)
    assert turn_error(found.state, made.truth, found.known) <= 1.1 * turn_error(best, made.truth, found.known)
    if motion != "nodal":
        error = path_error(found.state, made.truth, found.known)
        assert error <= 1.1 * path_error(best, made.truth, found.known)
        centres = made.truth.centres()
        size = np.sqrt(((centres - centres.mean(0)) ** 2).sum(1).mean())
        assert 0.4 < told.path_sigma * size / error < 2.5
    assert bool(told.warnings) == (motion == "zoom")
    if motion == "zoom":
        assert "zoom" in told.warnings[0]
        np.testing.assert_allclose(told.focal_px, FOCAL * np.exp(made.truth.focal), rtol=0.01)


@pytest.mark.parametrize("wrong", [0.85, 1.15])
def test_a_focal_length_that_may_be_found_is_found_within_its_own_doubt(wrong):
    made = shot("orbit", seed=2)
    found = solve(made.observations, made.frames, 40, SIZE, Options(wrong * FOCAL, free_focal=True))
    told = report(found, _names(made))
    assert 0 < told.focal_sigma_px < 0.02 * FOCAL
    assert abs(told.focal_px[0] - FOCAL) < 3 * told.focal_sigma_px
    assert not told.warnings


def test_a_focal_length_nobody_knows_is_found():
    made = shot("orbit", seed=3)
    told = report(solve(made.observations, made.frames, 40, SIZE), _names(made))
    assert abs(told.focal_px[0] - FOCAL) < 3 * told.focal_sigma_px


def test_a_focal_length_a_little_wrong_is_said_though_residuals_stay_small():
    made = shot("orbit", 80, seed=1)
    found = solve(made.observations, made.frames, 80, SIZE, Options(0.97 * FOCAL))
    told = report(found, _names(made))
    assert found.sigma < 1.15 * NOISE
    test = next(test for test in told.tests if test.name == "focal length")
    assert test.gain > 100
    assert test.better == pytest.approx(FOCAL, rel=0.01)
    assert any(words.startswith("Focal length") for words in told.warnings)


def test_a_bend_of_the_lens_nobody_declared_is_said_and_can_be_found():
    made = shot("orbit", 80, seed=1, k1=-0.05)
    told = report(solve(made.observations, made.frames, 80, SIZE, Options(FOCAL)), _names(made))
    assert any("k1" in words for words in told.warnings)
    found = solve(made.observations, made.frames, 80, SIZE, Options(FOCAL, distortion=True))
    assert found.state.lens[1] == pytest.approx(-0.05, abs=0.005)
    assert not report(found, _names(made)).warnings


def test_a_strong_bend_nobody_declared_is_found_and_taken_for_no_zoom():
    made = shot("orbit", 40, seed=2, k1=-0.12)
    found = solve(made.observations, made.frames, 40, SIZE, Options(FOCAL))
    assert found.state.lens[1] == pytest.approx(-0.12, abs=0.006)
    assert any("lens bends lines" in words for words in found.said)
    assert not any("zoom" in words for words in found.said)


def test_of_two_motions_one_is_left_out_and_that_is_said():
    made, other = shot("orbit", 30, seed=1), shot("forward", 30, seed=5)
    second = other.observations._replace(track=other.observations.track + 30)
    order = np.argsort(np.concatenate([made.observations.frame, second.frame]), kind="stable")
    both = Observations(*(np.concatenate(pair)[order] for pair in zip(made.observations, second, strict=True)))
    found = solve(both, made.frames, 60, SIZE, Options(FOCAL))
    told = report(found, [str(k) for k in range(60)])
    assert not (found.held[:30].any() and found.held[30:].any())
    assert found.sigma < 1.1 * NOISE
    assert any("do not fit" in words for words in told.warnings)


def _garbage():
    rng = np.random.default_rng(0)
    return [keyed_track(k, f"t{k}", np.column_stack([np.arange(20), rng.uniform(0, 1000, (20, 2))])) for k in range(20)]


def _moved(tracks, scale, shift):
    return [track.replace(points=scale * track.points + shift) for track in tracks]


@pytest.mark.parametrize(
    ("tracks", "words"),
    [
        ([], "no tracks"),
        ([keyed_track(k, "t", np.array([[1.0, 10 * k, 5.0]])) for k in range(20)], "one frame"),
        ([keyed_track(k, "t", np.array([[1.0, 10 * k, 5.0], [2.0, 10 * k + 1, 5.0]])) for k in range(3)], "needs 8"),
        (_garbage(), "jump about"),
        (_moved(_garbage(), 1e-4, 500.0), "of each other"),
        (_moved(_garbage(), 1.0, -3000.0), "outside of a plate"),
    ],
)
def test_what_no_camera_explains_is_refused_in_words(tracks, words):
    def try_it():
        observations, frames = observations_of(tracks)
        return solve(observations, frames, len(tracks), SIZE, Options(FOCAL))

    with pytest.raises(UserError, match=words):
        try_it()


def test_the_camera_of_the_file_sees_the_points_where_the_solve_does(tmp_path):
    from pxr import Gf, Usd, UsdGeom

    made = shot("zoom", 30, 12, seed=4)
    found = solve(made.observations, made.frames, 30, SIZE, Options(FOCAL, zoom=True))
    path = tmp_path / "solve.usda"
    usd_solve.write(path, shot_of(found, _names(made)), {})
    stage = Usd.Stage.Open(str(path))
    points = np.array(UsdGeom.Points(stage.GetPrimAtPath("/Solve/points")).GetPointsAttr().Get(), float)
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (1001, 1012)
    for row in (0, 5, 11):
        camera = UsdGeom.Camera(stage.GetPrimAtPath("/Solve/camera")).GetCamera(Usd.TimeCode(1001 + row))
        frustum = camera.frustum
        clip = frustum.ComputeViewMatrix() * frustum.ComputeProjectionMatrix()
        ours, _ = projected(found.state, np.full(len(points), row), found.state.points[found.held])
        for point, xy in zip(points, ours, strict=True):
            at = clip.Transform(Gf.Vec3d(*point))
            theirs = (0.5 + 0.5 * at[0]) * SIZE[0] - 0.5, (0.5 - 0.5 * at[1]) * SIZE[1] - 0.5
            np.testing.assert_allclose(theirs, xy, atol=0.01)


def test_the_command_solves_a_file_of_tracks_and_says_what_it_found(tmp_path):
    made = shot("orbit", 30, 12)
    rows = made.observations
    tracks = [
        {"name": f"t{k}", "points": [[int(made.frames[f]), *map(float, xy)] for f, xy in zip(
            rows.frame[rows.track == k], rows.xy[rows.track == k], strict=True)]}
        for k in range(30)
    ]  # fmt: skip
    source = tmp_path / "tracks.json"
    source.write_text(json.dumps({"size": SIZE, "frames": [1001, 1012], "tracks": tracks}))
    out = tmp_path / "out.usda"
    cli = build(("solve", "bench"))
    done = CliRunner().invoke(cli, ["solve", str(source), "--focal-px", "1600", "-o", str(out), "--json"])
    assert done.exit_code == 0, done.output
    told = json.loads(done.stdout)
    assert told["cameras"] == 12
    assert told["points"] == 30
    assert told["kind"] == "free"
    assert told["rms_px"] == pytest.approx(NOISE * np.sqrt(2), rel=0.25)
    assert set(told) >= {"observations", "median_px", "focal_px", "focal_sigma_px", "keyframes", "seconds", "warnings"}
    assert out.is_file()
