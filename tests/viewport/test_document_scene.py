"""From a document to what is drawn: the hairs shown, as wide as their coat says."""

import numpy as np
import pytest

from core.document import Document, MeshObject
from core.evaluator import Evaluator
from core.groom.dress import dress
from core.groom.groom import Groom
from core.groom.grow import grow
from core.groom.rows import no_guides
from core.groom.style import load_style
from core.mesh.skin import skin_at_rest
from core.value import constant, formula
from tests.documents import grid_mesh
from viewport.document_scene import SKIN, scene_of
from viewport.drawables.strands import strand_tints
from viewport.scene import mean_width, thinned


@pytest.fixture(scope="module")
def drawn():
    """A function that gives the children and the drawn coat of a sheet whose coat has the given values."""
    evaluator, mesh = Evaluator(), grid_mesh(4)
    groom = dress(mesh, load_style("fur"), evaluator, 30, 500)

    def draw(**changes):
        changed = groom.replace(coat=groom.coat.replace(**changes))
        children = grow(changed, mesh, evaluator)
        document = Document(meshes=(MeshObject(id=1, name="sheet", mesh=mesh),), grooms=(changed,))
        return children, scene_of(document, {1: skin_at_rest(mesh, evaluator)}, {1: children}).coats[0]

    yield draw
    evaluator.close()


def test_a_whole_coat_is_drawn_from_the_very_arrays_of_its_children(drawn):
    children, coat = drawn(width_root=constant(2e-3), width_tip=constant(5e-4))
    assert coat.points is children.points
    assert coat.ids is children.ids
    assert coat.widths is None
    assert (coat.look.root_width, coat.look.tip_width) == (2e-3, 5e-4)


def test_only_the_hairs_a_density_keeps_are_drawn(drawn):
    children, coat = drawn(density=constant(0.1))
    assert np.sort(coat.ids).tolist() == list(range(50))
    np.testing.assert_array_equal(coat.points, children.points[np.isin(children.ids, np.arange(50))])
    assert coat.points.flags.c_contiguous
    assert len(coat.normals) == 50
    _, coat = drawn(density=formula("id % 2"), width_tip=formula("1e-4 * (1 + u)"))
    assert np.sort(coat.ids).tolist() == list(range(1, 500, 2))
    assert len(coat.widths) == 250


def test_a_hidden_groom_is_not_drawn(drawn):
    children, _ = drawn()
    document = Document(
        meshes=(MeshObject(id=1, name="sheet", mesh=grid_mesh(4)),),
        grooms=(Groom(id=1, name="fur", mesh_id=1, guides=no_guides(4), hidden=True),))
    evaluator = Evaluator()
    scene = scene_of(document, {1: skin_at_rest(document.meshes[0].mesh, evaluator)}, {1: children})
    evaluator.close()
    assert (len(scene.surfaces), len(scene.coats)) == (1, 0)
    assert scene.surfaces[0].color == SKIN


def test_hairs_of_different_widths_are_drawn_so(drawn):
    _, coat = drawn(width_root=formula("0.003 if id % 2 else 0.001"), width_tip=constant(0.0))
    assert coat.look.root_width == pytest.approx(0.002)
    odd = coat.ids % 2 == 1
    width = coat.widths * mean_width(coat.look)
    np.testing.assert_allclose(width[odd], 0.003 * 2 / 3, rtol=1e-5)
    np.testing.assert_allclose(width[~odd], 0.001 * 2 / 3, rtol=1e-5)
    plain = strand_tints(coat._replace(widths=None))
    np.testing.assert_array_equal(strand_tints(coat)[:, 3], plain[:, 3] * coat.widths)
    np.testing.assert_array_equal(strand_tints(coat)[:, :3], plain[:, :3])
    np.testing.assert_array_equal(thinned(coat, 250).widths, coat.widths[::2])
    _, none = drawn(width_root=constant(0.0), width_tip=formula("0 * id"))
    assert not none.widths.any()
