import numpy as np
import pytest

from core.document import Document
from core.formats.project import read_project, write_project
from core.match.photomodel.records import Known, ModelCircle, ModelLine, Part, Photomodel, WorldFrame, picked
from core.match.photomodel.solve import solved
from tests.core.match.photomodel.scenes import house


def test_a_model_is_kept_in_the_project(tmp_path):
    model = solved(house(0)).model.replace(
        lines=(ModelLine(id=1, name="ridge", points=(9, 10), picks=picked([1], [(5.0, 6.0)])),),
        circles=(ModelCircle(id=1, name="window"),),
        known=(Known(kind="distance", points=(1, 2), value=(4.0,)),), frame=WorldFrame(origin=1, axis=(1, 2)),
        parts=(Part(id=1, name="front", kind="polygon", points=(1, 2, 6, 5)),),
    )
    write_project(tmp_path / "house.filo", Document(photomodels=(model,)))
    back = read_project(tmp_path / "house.filo").document.photomodels[0]
    np.testing.assert_array_equal(back.points[3].picks.xy, model.points[3].picks.xy)
    np.testing.assert_array_equal(back.photos[1].rotation, model.photos[1].rotation)
    assert back.points[3].place == model.points[3].place
    assert (back.known[0].value, back.frame.axis, back.parts[0].points) == ((4.0,), (1, 2), (1, 2, 6, 5))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"lines": (ModelLine(id=1, name="l", points=(1, 99)),)}, "not there"),
        ({"parts": (Part(id=1, name="m", kind="mirror", parts=(2,)),)}, "before it"),
        ({"points": (house().points[0], house().points[0])}, "same id"),
        ({"frame": WorldFrame(origin=77)}, "not there"),
    ],
)
def test_a_model_that_names_what_is_not_there_is_none(change, words):
    with pytest.raises(ValueError, match=words):
        house().replace(**change)


def test_two_models_of_one_id_are_no_document():
    with pytest.raises(ValueError, match="same id"):
        Document(photomodels=(Photomodel(id=1, name="a"), Photomodel(id=1, name="b")))
