"""Ways through pose space: kinks where there are some and nowhere else, and weights along a clip."""

from __future__ import annotations

import numpy as np
import pytest

from core.demo.pose_document import pose_document
from core.pose.pose import REST
from core.pose.pose_path import clip_weights, kinks, most_moved, walk


@pytest.mark.parametrize("bend", [0.5, 0.37, 0.6043])
def test_a_bend_in_a_path_is_found_where_it_is(bend: float) -> None:
    t = np.linspace(0.0, 1.0, 65)
    path = np.stack([t, np.abs(t - bend), 0.1 * t**2], axis=1)
    found = kinks(path)
    assert len(found) == 1
    assert abs(found[0] / 64 - bend) < 1.5 / 64


def test_a_jump_is_a_kink() -> None:
    t = np.linspace(0.0, 1.0, 65)
    assert kinks(np.stack([t, np.where(t > 0.5, 0.2, 0.0), t], axis=1))


def test_smooth_motion_has_no_kink() -> None:
    t = np.linspace(0.0, 1.0, 65)
    for path in (
        np.stack([t, t**2, t**3], axis=1), np.stack([np.cos(3 * t), np.sin(3 * t), t], axis=1),
        np.stack([np.exp(-(((t - 0.5) / 0.2) ** 2)), t, 0 * t], axis=1), np.zeros((65, 3)),
    ):
        assert kinks(path) == ()


def test_the_elbow_of_the_demo_bends_without_a_kink_and_ends_at_its_sculpt() -> None:
    item = pose_document().meshes[0]
    poses = {s.name: s.pose for layer in item.correctives.layers for s in layer.space.samples}
    vertex = most_moved(item.correctives, "elbow bent")
    assert vertex is not None
    found = walk(item.mesh.points, item.rig, item.correctives, REST, poses["elbow bent"],
                 np.array([vertex], np.int32))
    layer = next(one for one in item.correctives.layers if "elbow bent" in [s.name for s in one.space.samples])
    k = [s.name for s in layer.space.samples].index("elbow bent")
    target = layer.targets[k, np.flatnonzero(layer.vertices == vertex)[0]]
    assert np.linalg.norm(found.points[0, 0] - item.mesh.points[vertex]) < 1e-6
    assert np.linalg.norm(found.points[-1, 0] - target) < 1e-5
    assert found.kinks == ((),)
    assert found.travel[-1, 0] == pytest.approx(found.speed[:, 0].mean(), rel=1e-9)


def test_weights_over_the_clip_reach_one_where_it_passes_a_sculpt() -> None:
    item = pose_document().meshes[1]
    frames = np.array([1001.0, 1017.0, 1037.0])
    names, found = clip_weights(item.mesh.points, item.rig, item.correctives, frames)
    assert np.abs(found[0]).max() < 1e-5
    assert found[1].max() == pytest.approx(1.0, abs=1e-4)
    assert names[int(found[1].argmax())] == "joy"
