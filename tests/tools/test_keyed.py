"""Keyed values by their addresses."""

import pytest

from core.curve import Curve, Key
from core.document import with_groom
from core.errors import UserError
from core.groom.groom import COAT_VALUES
from core.value import Constant
from tests.documents import animated_document, small_document
from tools.keyed import keyed_values, set_bases
from tools.session import Session

CURVE = Curve(keys=(Key(frame=1003.0, value=0.25), Key(frame=1009.0, value=0.75)))


def test_every_value_of_every_coat_is_found_once_it_is_keyed() -> None:
    document = small_document()
    assert keyed_values(document) == ()
    addresses = [f"grooms/1/coat/{name}" for name in COAT_VALUES]
    keyed = keyed_values(set_bases(document, dict.fromkeys(addresses, CURVE)))
    assert [one.address for one in keyed] == addresses
    assert {one.owner for one in keyed} == {"coat"}
    assert all(one.curve is CURVE for one in keyed)
    assert keyed[1].known.label == "Length"


def test_a_second_groom_has_addresses_of_its_own() -> None:
    document = animated_document()
    other = document.grooms[0].replace(id=5, name="whiskers")
    keyed = keyed_values(with_groom(document, other))
    assert [(one.owner, one.address) for one in keyed] == [
        ("coat", "grooms/1/coat/clump"), ("coat", "grooms/1/coat/frizz"),
        ("whiskers", "grooms/5/coat/clump"), ("whiskers", "grooms/5/coat/frizz")]


def test_a_base_is_set_as_a_step_and_the_map_stays() -> None:
    session = Session(animated_document())
    session.edit("Move keys", set_bases, {"grooms/1/coat/frizz": CURVE, "grooms/1/coat/clump": Constant(number=0.5)})
    coat = session.document.grooms[0].coat
    assert (coat.frizz.base, coat.frizz.map) == (CURVE, "density")
    assert coat.clump.base.number == 0.5
    assert session.history.undo_name == "Move keys"
    session.undo()
    assert len(keyed_values(session.document)) == 2
    session.close(discard=True)


@pytest.mark.parametrize("address", ["", "grooms", "grooms/1", "grooms/2/coat/clump", "grooms/1/coat/none", "a/b/c",
                                     "grooms/1/coat/count", "grooms/1/coat/clump/base", "grooms/1/coat/clump/x/y"])
def test_what_is_no_value_is_refused_in_words(address: str) -> None:
    with pytest.raises(UserError, match="no value"):
        set_bases(small_document(), {address: CURVE})


def test_what_the_document_refuses_is_said() -> None:
    with pytest.raises(UserError, match="density"):
        set_bases(small_document(), {"grooms/1/coat/density": Constant(number=7.0)})
