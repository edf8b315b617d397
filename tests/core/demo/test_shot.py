"""The figure of the matchmove demo: marks lie on the parts they are named after, and what the neck carries moves."""

import numpy as np

from core.demo.shot import FIRST, FRAMES, NECK, figure, figure_points, moments


def test_marks_are_on_their_parts_and_the_neck_carries_the_head() -> None:
    model, shot = figure(), moments()
    assert len(shot) == FRAMES
    assert FIRST == 1001
    parts = np.zeros(len(model.mesh.points), int)
    parts[model.mesh.corners] = np.repeat(model.mesh.parts, model.mesh.counts)
    for part in (model.head, model.neck, model.body):
        rows = list(part.vertices.values())
        assert len(set(rows)) == len(rows)
        assert {model.mesh.part_names[p] for p in parts[rows]} == {part.name}
    still = shot[5]._replace(neck=np.zeros(len(NECK)))
    moved, rest = figure_points(model, shot[5]), figure_points(model, still)
    apart = np.linalg.norm(moved - rest, axis=1)
    assert apart[parts == 2].max() < 1e-6
    assert apart[parts == 0].min() > 1e-3
    # a head is rigid
    a, b = list(model.head.vertices.values())[:2]
    np.testing.assert_allclose(np.linalg.norm(moved[a] - moved[b]), np.linalg.norm(rest[a] - rest[b]), rtol=1e-5)
