import numpy as np
import pytest

from core.errors import UserError
from core.match.photomodel.guide import epipolar_line, foretold, next_photo
from core.match.photomodel.records import (
    NOTHING,
    Known,
    ModelCircle,
    ModelLine,
    ModelPoint,
    Photomodel,
    WorldFrame,
    moved_pick,
    picked,
)
from core.match.photomodel.solve import solved
from tests.core.match.photomodel.scenes import (
    FOCAL,
    HOUSE,
    PHOTOS,
    edge_errors,
    house,
    photo,
    picks_of,
    places,
    unsolved,
)

FRAME = WorldFrame(origin=1, axis=(1, 2), plane=(1, 2, 3, 4), distance=(1, 2), length=4.0)


@pytest.mark.parametrize("seed", range(4))
def test_edges_of_twelve_points_in_three_photographs_are_true(seed):
    found = solved(house(seed))
    assert found.known.all()
    assert np.abs(edge_errors(found.model)).max() < 0.005
    assert 0.2 < found.rms < 0.8
    assert not found.warnings


def test_a_focal_length_nobody_knows_is_found_from_the_picks():
    model = house(1)
    model = model.replace(photos=tuple(one.replace(focal_px=None) for one in model.photos))
    found = solved(model)
    assert found.model.photos[0].focal_px == pytest.approx(FOCAL, rel=0.03)
    assert np.abs(edge_errors(found.model)).max() < 0.02


def test_what_is_known_makes_it_right():
    """Right angles of the box and its symmetry, while the focal length is free."""
    model = house(1, frame=FRAME, known=(
        Known(kind="right", points=(1, 2, 2, 3)), Known(kind="right", points=(1, 2, 1, 5)),
        Known(kind="right", points=(2, 3, 2, 6)), Known(kind="plane", points=(1, 2, 5, 6, 9, 11, 12)),
        Known(kind="symmetric", points=(1, 2, 5, 6, 8, 7, 4, 3)), Known(kind="parallel", points=(9, 10, 2, 3)),
    ))
    model = model.replace(photos=tuple(one.replace(focal_px=None) for one in model.photos))
    found = solved(model)
    assert found.misses.max() < 1e-3
    np.testing.assert_allclose(places(found.model)[0], 0.0, atol=1e-9)
    assert places(found.model)[1][0] == pytest.approx(4.0)
    assert places(found.model)[5][1] > 2.9
    assert np.abs(edge_errors(found.model)).max() < 0.01


def test_measured_points_say_where_the_world_is():
    known = tuple(Known(kind="survey", points=(k + 1,), value=tuple(HOUSE[k]), sigma=0.005) for k in (0, 2, 5, 9))
    found = solved(house(2, known=known))
    assert np.abs(places(found.model) - HOUSE).max() < 0.02
    assert found.misses.max() < 0.01


def test_a_pick_that_is_dragged_moves_cameras_and_points_at_once():
    model = solved(house(0, frame=FRAME)).model
    for step in range(6):
        xy = model.points[3].picks.xy[1] + [2.0, -1.0]
        outcome = solved(moved_pick(model, 4, 2, tuple(xy)))
        assert not np.allclose(places(outcome.model)[3], places(model)[3], atol=1e-6), step
        model = outcome.model
    afresh = solved(model, again=True)
    np.testing.assert_allclose(places(model), places(afresh.model), atol=1e-3)
    assert any("look at" in words.lower() for words in outcome.advice)


def test_lines_and_circles_are_picked_along_themselves():
    rng = np.random.default_rng(3)
    model = house(3)
    corner, end = HOUSE[8], HOUSE[9]
    along = [tuple(picks_of([one], corner + s * (end - corner), rng).xy[0]) for one in PHOTOS for s in (0.2, 0.7)]
    line = ModelLine(id=1, name="ridge", points=(9, 10), picks=picked([1, 1, 2, 2, 3, 3], along))
    ring = [np.array([2 + 0.7 * np.cos(a), 2.2 + 0.7 * np.sin(a), 0]) for a in np.linspace(0.3, 5.5, 6)]
    seen = [(one.id, tuple(picks_of([one], place, rng).xy[0])) for one in PHOTOS for place in ring]
    window = ModelCircle(id=1, name="window", picks=picked(*map(list, zip(*seen, strict=True))))
    model = model.replace(lines=(line,), circles=(window,), known=tuple(
        Known(kind="survey", points=(k + 1,), value=tuple(HOUSE[k]), sigma=0.002) for k in (0, 2, 5, 9)))
    found = solved(model)
    circle = found.model.circles[0]
    assert circle.radius == pytest.approx(0.7, abs=0.01)
    np.testing.assert_allclose(circle.centre, [2, 2.2, 0], atol=0.02)
    assert abs(circle.normal[2]) > 0.999
    assert found.rms < 0.8
    assert (found.picks[:, 1] == 1).sum() == 6


def test_a_point_seen_once_is_placed_by_its_plane_or_its_mirror_image():
    model = house(0)
    points = list(model.points)
    points[11] = points[11].replace(picks=picked([2], [tuple(points[11].picks.xy[1])]))
    points[6] = points[6].replace(picks=NOTHING)
    found = solved(model.replace(points=tuple(points), known=(
        Known(kind="plane", points=(1, 2, 5, 6, 12)), Known(kind="symmetric", points=(1, 2, 5, 6, 4, 3, 8, 7)),
        *(Known(kind="survey", points=(k + 1,), value=tuple(HOUSE[k]), sigma=0.005) for k in (0, 2, 5, 9)),
    )))
    np.testing.assert_allclose(places(found.model)[[6, 11]], HOUSE[[6, 11]], atol=0.05)


def test_the_guide_leads_to_where_the_point_is():
    found = solved(house(0, noise=0.0)).model
    true = found.points[5].picks.xy
    line = epipolar_line(found, 1, tuple(true[0]), 3)
    across = np.linalg.norm(line - true[2], axis=1)
    k = int(across.argmin())
    a, b = line[max(k - 1, 0)], line[min(k + 1, len(line) - 1)]
    way = (b - a) / np.linalg.norm(b - a)
    offset = true[2] - a
    assert abs(way[0] * offset[1] - way[1] * offset[0]) < 0.1
    np.testing.assert_allclose(foretold(found, 6, 3), true[2], atol=0.1)
    half = moved_pick(found, 6, 1, tuple(true[0]))
    lone = half.points[5].replace(picks=picked([1], [tuple(true[0])]))
    half = half.replace(points=(*half.points[:5], lone, *half.points[6:]))
    assert next_photo(half, 6) == 3
    assert foretold(house(), 6, 3) is None
    assert not len(epipolar_line(house(), 1, (5.0, 5.0), 2))


def test_photographs_of_two_cameras_are_solved_together():
    phone = photo(4, (0, 5, -10), size=(1200, 1600), focal=1500.0, camera=2)
    cameras = (*PHOTOS, phone.replace(find_focal=True, focal_px=1350.0))
    model = house(5, photos=(*PHOTOS, phone)).replace(photos=unsolved(cameras))
    found = solved(model)
    assert found.known.all()
    assert found.model.photos[3].focal_px == pytest.approx(1500.0, rel=0.01)
    assert np.abs(edge_errors(found.model)).max() < 0.005


@pytest.mark.parametrize(
    ("model", "words"),
    [
        (Photomodel(id=1, name="m"), "two photographs"),
        (Photomodel(id=1, name="m", photos=unsolved(PHOTOS)), "0 tracks"),
        (house().replace(points=house().points[:4]), "needs 6"),
        (house().replace(known=(Known(kind="plane", points=(1, 2, 3)),)), "4 points"),
    ],
)
def test_what_cannot_be_solved_is_refused_in_words(model, words):
    with pytest.raises(UserError, match=words):
        solved(model)


def test_a_pick_of_a_photograph_that_is_not_there_is_no_model():
    with pytest.raises(ValueError, match="not there"):
        Photomodel(id=1, name="m", points=(ModelPoint(id=1, name="p", picks=picked([7], [(1.0, 2.0)])),))
