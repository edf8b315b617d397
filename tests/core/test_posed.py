"""The animal at a frame."""

import numpy as np

from core.demo.creature import demo_creature
from core.document import MeshObject
from core.evaluator import Evaluator
from core.mesh.distance_field import sample_points
from core.pose.skinning import posed_points
from core.posed import field_at, field_known, skin_at


def test_a_frame_is_posed_once_and_rest_is_rest() -> None:
    creature = demo_creature()
    item = MeshObject(id=1, name="animal", mesh=creature.mesh, rig=creature.rig)
    still = MeshObject(id=2, name="statue", mesh=creature.mesh)
    evaluator = Evaluator()
    rest = skin_at(item, None, evaluator)
    assert rest.points is creature.mesh.points
    assert skin_at(still, 1014, evaluator) is rest
    assert skin_at(item, 1001, evaluator).points is creature.mesh.points, "the first frame stands as modelled"
    turned = skin_at(item, 1014, evaluator)
    assert skin_at(item, 1014, evaluator) is turned
    np.testing.assert_array_equal(turned.points, posed_points(creature.mesh.points, creature.rig, 1014))
    assert np.abs(turned.points - rest.points).max() > 0.01
    evaluator.close()


def test_the_field_stands_where_the_skin_stands() -> None:
    creature = demo_creature()
    item = MeshObject(id=1, name="animal", mesh=creature.mesh, rig=creature.rig)
    evaluator = Evaluator()
    skin, field = skin_at(item, 1014, evaluator), field_at(item, 1014, evaluator)
    outside = (skin.points + 0.004 * skin.normals).astype(np.float32)
    distances = sample_points(field, outside)
    assert np.median(np.abs(distances - 0.004)) < 0.001
    assert field_known(item, 1014, evaluator)
    assert not field_known(item, 1015, evaluator)
    assert not field_known(item, None, evaluator)
    field_at(item, None, evaluator)
    assert field_known(item, None, evaluator)
    evaluator.close()
