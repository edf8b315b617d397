"""Every mesh of the shared data is feathered, or refused in one sentence; exact, finite, not through one another."""

import numpy as np
import pytest

from core.errors import UserError
from core.evaluator import Evaluator
from core.feather.coat.dress import dress_feathers
from core.feather.coat.layering import crossings
from core.feather.coat.plumage import Plumage
from core.formats.mesh_file import read_mesh
from tests.contract.test_every_animal_is_groomed import FILES

COUNT = 60
SANDBOXED = (".usd", ".usda", ".usdc", ".usdz", ".abc")  # read by a process each; what is in them is no other


@pytest.fixture(scope="module")
def evaluator():
    made = Evaluator()
    yield made
    made.close()


@pytest.mark.skipif(not FILES, reason="FILOPLUME_DATA is not set")
@pytest.mark.parametrize(
    "path", [path for path in FILES if path.suffix.lower() not in SANDBOXED][::3],
    ids=lambda path: "/".join(path.parts[-2:]),
)
def test_feathered_or_refused(path, evaluator):
    refusal = None
    try:
        mesh = read_mesh(path).mesh
        coat, keys = dress_feathers(mesh, evaluator, COUNT, keys=8, placement="even")
    except UserError as error:
        refusal = str(error)
    if refusal is not None:
        assert len(refusal) > 10
        assert "\n" not in refusal
        return
    laid = Plumage(evaluator).at_rest(coat, keys, mesh)
    assert len(np.unique(laid.ids)) == COUNT
    assert np.isfinite(laid.layered.vanes).all()
    left = crossings(laid.layered, laid.skin.bvh, evaluator.workers)
    assert len(left.first) <= 0.05 * max(left.pairs, 20)
