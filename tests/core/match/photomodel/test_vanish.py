import numpy as np
import pytest

from core.errors import UserError
from core.match.photomodel.records import Known, ModelPoint, Photomodel, picked
from core.match.photomodel.rows import seen_by
from core.match.photomodel.solve import solved
from core.match.photomodel.vanish import lined_up
from tests.core.match.photomodel.scenes import FOCAL, HOUSE, PHOTOS, house, photo, places

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
ALONG = (((0, 1), X), ((4, 5), X), ((0, 3), Z), ((4, 7), Z), ((0, 4), Y), ((1, 5), Y))


def lines(one, along=ALONG, focal=None, noise=0.0):
    """A photograph of the house with edges along axes; the first end of the first edge is the origin of the house."""
    rng = np.random.default_rng(1)
    points = []
    known = []
    for (a, b), axis in along:
        for k in (a, b):
            xy = seen_by(one, HOUSE[k][None])[0][0] + rng.normal(0.0, 1.0, 2) * noise
            points.append(ModelPoint(id=len(points) + 1, name=f"p{len(points)}", picks=picked([one.id], [tuple(xy)])))
        known.append(Known(kind="axis", points=(len(points) - 1, len(points)), value=axis))
    bare = one.replace(rotation=None, translation=None, focal_px=focal)
    return Photomodel(id=1, name="m", photos=(bare,), points=tuple(points), known=tuple(known))


@pytest.mark.parametrize("one", [PHOTOS[0], PHOTOS[2]])
@pytest.mark.parametrize("rows", [(0, 1, 2, 3), (0, 1, 2, 3, 4, 5)])
def test_edges_along_axes_give_the_camera_that_took_them(one, rows):
    height = float(-(one.rotation.T @ np.array(one.translation))[1])
    (found,) = lined_up(lines(one, [ALONG[k] for k in rows]), height).photos
    assert found.focal_px == pytest.approx(FOCAL, rel=1e-4)
    np.testing.assert_allclose(found.rotation, one.rotation, atol=1e-5)
    np.testing.assert_allclose(found.translation, one.translation, atol=1e-3)


def test_a_known_focal_length_is_kept_and_three_edges_are_enough():
    one = PHOTOS[0]
    (found,) = lined_up(lines(one, ALONG[:3], FOCAL), 2.0).photos
    assert found.focal_px == FOCAL
    np.testing.assert_allclose(found.rotation, one.rotation, atol=1e-6)
    (none,) = lined_up(lines(one, ALONG[:3])).photos
    assert none.rotation is None


def test_picks_half_a_pixel_off_turn_the_camera_by_less_than_half_a_degree():
    (found,) = lined_up(lines(PHOTOS[0], noise=0.5), 2.0).photos
    turn = np.degrees(np.arccos((np.trace(found.rotation @ PHOTOS[0].rotation.T) - 1.0) / 2.0))
    assert turn < 0.5
    assert found.focal_px == pytest.approx(FOCAL, rel=0.03)


def test_edges_that_do_not_converge_are_refused_in_words():
    for one in (PHOTOS[1], photo(1, (2.0, 1.8, -12.0))):  # x is parallel to both pictures, y to the last too
        for rows in ((0, 1, 2, 3), (0, 1, 4, 5)):
            with pytest.raises(UserError, match="do not converge"):
                lined_up(lines(one, [ALONG[k] for k in rows], noise=0.3))


def test_a_model_begun_by_a_line_up_has_its_world():
    model = house(0)
    known = tuple(Known(kind="axis", points=(a + 1, b + 1), value=axis) for (a, b), axis in ALONG[:4])
    there = places(solved(model.replace(known=known)).model)
    for (a, b), axis in ALONG:
        way = there[b] - there[a]
        np.testing.assert_allclose(way / np.linalg.norm(way), axis, atol=3e-3)
