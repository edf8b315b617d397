"""Bodies no modeller meant: open, torn, in pieces, tiny, huge, flat, with faces of no size."""

import numpy as np
import pytest

from core.errors import UserError
from core.evaluator import Evaluator
from core.feather.coat.dress import dress_feathers
from core.feather.coat.layering import crossings
from core.feather.coat.plumage import Plumage
from core.mesh.mesh import Mesh
from tests.core.feather.coat.bodies import crossing_by_solving, egg

COUNT = 60
EGG = egg()
POINTS = EGG.points.astype(np.float64)
FACES = [face.tolist() for face in np.split(EGG.corners, np.cumsum(EGG.counts)[:-1])]
TOP = len(POINTS)  # one more vertex


def body(points, faces=FACES) -> Mesh:
    return Mesh(
        points=np.array(points, np.float32), counts=np.array([len(face) for face in faces], np.int32),
        corners=np.concatenate(faces).astype(np.int32), parts=np.zeros(len(faces), np.int32), part_names=("body",))


def beside(scale):
    """Two eggs, the second of another size."""
    return body([*POINTS, *(POINTS * scale + [2.0, 0.0, 0.0])], FACES + [[c + TOP for c in face] for face in FACES])


BODIES = {
    "open": body(POINTS, FACES[: len(FACES) // 2]),
    "inside out": body(POINTS, [face[::-1] for face in FACES]),
    "two islands": beside(1.0), "an island a hundred times smaller": beside(0.01),
    "three faces at an edge": body([*POINTS, [0.0, 0.0, 2.0]], [*FACES, [0, 1, TOP], [0, 1, 30]]),
    "faces of no size": body(POINTS, [*FACES, [0, 0, 1], [5, 5, 5], [3, 4, 4]]),
    "flat": body(POINTS * [1.0, 0.0, 1.0]), "one triangle": body(np.eye(3), [[0, 1, 2]]),
    "a needle": body([[0, 0, 0], [1, 0, 0], [0.5, 1e-6, 0]], [[0, 1, 2]]),
    "tiny": body(POINTS * 1e-4), "huge": body(POINTS * 1e4), "far away": body(POINTS + 1000.0),
}


@pytest.fixture(scope="module")
def evaluator():
    made = Evaluator()
    yield made
    made.close()


@pytest.mark.parametrize("name", BODIES)
def test_an_odd_body_is_feathered_exactly_and_cleanly(name, evaluator):
    mesh = BODIES[name]
    coat, keys = dress_feathers(mesh, evaluator, COUNT, keys=8)
    laid = Plumage(evaluator).at_rest(coat, keys, mesh)
    assert len(np.unique(laid.ids)) == laid.shown.sum() == COUNT
    assert np.isfinite(laid.layered.vanes).all()
    told = crossings(laid.layered, laid.skin.bvh, evaluator.workers)
    assert len(told.first) == len(told.skin) == 0
    size = np.ptp(mesh.points, axis=0).max()  # in the unit of the body, so that tiny ones are judged alike
    if name != "far away":  # whose float32 are too coarse for a test that shares nothing with ours
        assert crossing_by_solving((laid.layered.vanes - mesh.points.mean(axis=0)) / size) == set()


@pytest.mark.parametrize("spread", [0.0, 1.0])  # all at one point, or along a line
def test_a_body_without_a_surface_is_refused(spread, evaluator):
    with pytest.raises(UserError, match="no surface"):
        dress_feathers(body([[0, 0, 0], [spread, 0, 0], [2.0 * spread, 0, 0]], [[0, 1, 2]]), evaluator, COUNT)
