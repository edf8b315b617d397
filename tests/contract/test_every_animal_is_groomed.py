"""Every mesh of the shared data is groomed, or refused in one sentence; no other error, nothing non-finite."""

import os
from pathlib import Path

import numpy as np
import pytest

from core.errors import UserError
from core.evaluator import Evaluator
from core.formats.mesh_file import READ_SUFFIXES, read_mesh
from core.groom.dress import dress
from core.groom.export import groom_strands
from core.groom.grow import grow, measure
from core.groom.style import load_style, style_names
from core.mesh.edges import is_closed

GUIDES, HAIRS = 60, 400


def animals() -> list[Path]:
    root = os.environ.get("FILOPLUME_DATA")
    if not root:
        return []
    folders = [Path(root) / name for name in ("meshes", "hair", "animation")]
    found = (path for folder in folders for path in sorted(folder.rglob("*")))
    return [path for path in found if path.is_file() and path.suffix.lower() in READ_SUFFIXES]


FILES = animals()


@pytest.fixture(scope="module")
def evaluator():
    made = Evaluator()
    yield made
    made.close()


@pytest.mark.skipif(not FILES, reason="FILOPLUME_DATA is not set")
@pytest.mark.parametrize("path", FILES, ids=lambda path: "/".join(path.parts[-2:]))
def test_groomed_or_refused(path, evaluator):
    refusal = None
    try:
        mesh = read_mesh(path).mesh
        groom = dress(mesh, load_style("fur"), evaluator, GUIDES, HAIRS, seed=3)
    except UserError as error:
        refusal = str(error)
    if refusal is not None:
        assert len(refusal) > 10
        assert "\n" not in refusal
        return
    children = grow(groom, mesh, evaluator)
    strands = groom_strands(groom, mesh, children)
    assert len(strands.guides) == GUIDES
    assert len(strands.children) == HAIRS
    assert np.isfinite(strands.children.points).all()
    np.testing.assert_allclose(strands.children.guide_weights.sum(axis=1), 1.0, atol=1e-4)
    figures = measure(groom, mesh, children, evaluator)
    rounding = float(np.spacing(np.abs(mesh.points).max()))  # roots are float32, however far from the origin
    assert figures.root_error_max < 2 * rounding / np.linalg.norm(np.ptp(mesh.points, axis=0)) + 1e-7
    assert figures.inside_segments == (0 if is_closed(mesh) else None)
    evaluator.forget()


@pytest.mark.skipif(not FILES, reason="FILOPLUME_DATA is not set")
def test_sound_animals_are_not_refused():
    named = {path.name: path for path in FILES}
    for name in ("cat-low-resolution.obj", "spot.obj", "horse_quad.obj", "camelhead.off", "Fox.glb", "monkey.glb"):
        assert len(read_mesh(named[name]).mesh.counts) > 300


@pytest.mark.parametrize("name", style_names())
def test_every_style_grows_on_the_demo_animal(name, evaluator):
    from core.demo.creature import demo_creature

    creature = demo_creature()
    style = load_style(name)
    assert style.name == name
    assert style.description
    groom = dress(creature.mesh, style, evaluator, 300, 1000, maps=creature.maps, density_map="density")
    children = grow(groom, creature.mesh, evaluator)
    length = np.linalg.norm(np.diff(children.points, axis=2), axis=1).sum(axis=1)
    diagonal = np.linalg.norm(np.ptp(creature.mesh.points, axis=0))
    assert 0.1 * style.length < np.percentile(length, 95) / diagonal < 1.3 * style.length
    assert measure(groom, creature.mesh, children, evaluator).inside_segments == 0
