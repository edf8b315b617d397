"""Feathers of a document follow it in the live scene: laid by jobs, shown where they were laid for this skin."""

import numpy as np
import pytest

from core.document import Document, MeshObject
from core.evaluator import Evaluator
from tests.core.feather.coat.bodies import egg
from tools.feather_edits import add_feathers, set_feathers
from viewport.live_feathers import FINE, QUICK
from viewport.live_scene import LiveScene

COUNT = 60


@pytest.fixture(scope="module")
def evaluator():
    made = Evaluator()
    yield made
    made.close()


@pytest.fixture(scope="module")
def document(evaluator):
    bare = Document(meshes=(MeshObject(id=4, name="egg", mesh=egg()),))
    return add_feathers(bare, 4, COUNT, evaluator, keys=6)


@pytest.fixture
def live(evaluator, document):
    made = LiveScene(evaluator)
    laid(made, document)
    return made


def laid(live, document):
    live.update(document, 1001.0)
    (job,) = [job for job in live.wanted_jobs() if job.kind == "lay"]
    live.adopt(job.run())
    return live.update(document, 1001.0).scene


def of_feathers(live):
    return [job.about.coat.name for job in live.wanted_jobs() if job.kind == "lay"]


def vertices(meshes):
    return sum(len(mesh.points) for mesh in meshes)


def test_a_coat_is_shown_once_it_is_laid_with_fewer_triangles_while_things_move(evaluator, document):
    live = LiveScene(evaluator)
    bare = live.update(document, 1001.0).scene
    assert bare.feathers == bare.quick_feathers == ()
    scene = laid(live, document)
    assert vertices(scene.feathers) == COUNT * FINE[0] * FINE[1]
    assert vertices(scene.quick_feathers) == COUNT * QUICK[0] * QUICK[1]
    assert scene.surfaces[0].color != bare.surfaces[0].color
    fine, quick = (np.concatenate([m.points for m in meshes]) for meshes in (scene.feathers, scene.quick_feathers))
    np.testing.assert_allclose(fine.mean(axis=0), quick.mean(axis=0), atol=0.05 * np.ptp(fine))
    assert of_feathers(live) == []


def test_combed_keys_lay_the_coat_anew_when_the_hand_rests(live, document):
    groom = document.grooms[0]
    points = groom.guides.points.copy()
    points[:, 1:] += 0.1 * np.linalg.norm(np.ptp(points, axis=(0, 1)))
    points.setflags(write=False)
    combed = document.replace(grooms=(groom.replace(guides=groom.guides.replace(points=points)),))
    before = live.update(combed, 1001.0, stroking=True).scene
    assert of_feathers(live) == []
    assert before.feathers
    after = laid(live, combed)
    assert not np.array_equal(after.feathers[0].points, before.feathers[0].points)


def test_while_things_move_feathers_are_carried_by_the_skin(live, document):
    rest = live.update(document, 1001.0).scene
    turn, way = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]], np.float32), np.float32([0.3, 1.0, -0.2])
    item = document.meshes[0]
    points = np.ascontiguousarray(item.mesh.points @ turn + way)
    points.setflags(write=False)
    moved = document.replace(meshes=(item.replace(mesh=item.mesh.replace(points=points)),))
    scene = live.update(moved, 1002.0, stroking=True).scene
    assert of_feathers(live) == []
    assert scene.feathers == scene.quick_feathers
    for was, now in zip(rest.quick_feathers, scene.quick_feathers, strict=True):
        np.testing.assert_allclose(now.points, was.points @ turn + way, atol=1e-4)
        np.testing.assert_allclose(now.normals, was.normals @ turn, atol=1e-4)
        assert now.triangles is was.triangles
    assert live.update(moved, 1002.0, stroking=True).scene.quick_feathers[0].points is scene.quick_feathers[0].points


def test_hidden_feathers_are_neither_laid_nor_shown(live, document):
    hidden = set_feathers(document, document.feathers[0].id, hidden=True)
    scene = live.update(hidden, 1001.0).scene
    assert scene.feathers == scene.quick_feathers == ()
    assert of_feathers(live) == []


def test_feathers_that_are_gone_are_forgotten(live, document):
    assert live.update(document.replace(feathers=()), 1001.0).scene.feathers == ()
    live.update(document, 1001.0)
    assert of_feathers(live) == [document.feathers[0].name]
