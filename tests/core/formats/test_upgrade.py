"""Files of older formats, and values of every kind there and back."""

import zipfile
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from core.curve import Curve, Key
from core.document import Document, with_groom
from core.errors import UserError
from core.formats.arrays import ArrayHashes
from core.formats.project import check_project, project_info, read_project, write_project
from core.formats.tree import decode_envelope, decode_part, encode_tree
from core.formats.upgrade import FORMAT, VALUES_OF_2, upgrade
from core.groom.groom import COAT_FIELDS, COAT_VALUES
from core.leaves import same_bits
from core.value import Constant, Formula, Value, constant, formula
from core.workspace import Workspace
from tests.documents import animated_document, small_document

BASELINES = Path(__file__).parents[3] / "resources" / "baselines"


def tree_of(path):
    with zipfile.ZipFile(path) as archive:
        return msgspec.json.decode(archive.read("document.json"))


def test_format_1_opens_with_equal_numbers():
    path = BASELINES / "format_1.filo"
    old = tree_of(path)["document"]["grooms"][0]["coat"]
    coat = read_project(path).document.grooms[0].coat
    assert set(VALUES_OF_2) == set(COAT_VALUES) - {"length"}
    for name in VALUES_OF_2:
        assert isinstance(old[name], float)
        assert same_bits(getattr(coat, name), constant(old[name]))
    assert same_bits(coat.length, constant(old["length"]["base"]["number"]))
    assert same_bits(coat, small_document().grooms[0].coat)


def test_the_newest_sample_holds_values_of_every_kind():
    path = BASELINES / f"format_{FORMAT}.filo"
    assert tree_of(path)["format"] == FORMAT
    assert check_project(path) == []
    assert same_bits(read_project(path).document, animated_document())


@pytest.mark.parametrize(
    "document",
    [
        None, [], {}, {"grooms": None},
        {"grooms": [None, 3, {}, {"coat": None}, {"coat": {"clump": [True], "frizz": True, "count": 3}}]},
    ],
)  # fmt: skip
def test_what_has_not_the_expected_form_is_left_for_decoding_to_refuse(document):
    assert upgrade({"format": 1, "document": document}) == {"format": FORMAT, "document": document}


def test_numbers_out_of_range_of_an_older_file_are_refused_with_their_path():
    tree = tree_of(BASELINES / "format_1.filo")
    tree["document"]["grooms"][0]["coat"]["clump"] = 1.5
    envelope = decode_envelope(msgspec.json.encode(tree))
    arrays = encode_tree(small_document(), Workspace(), ArrayHashes()).arrays
    with pytest.raises(ValueError, match=r"Coat\.clump must be a finite number from 0 to 1, not 1\.5 .*grooms\["):
        decode_part(envelope, "document", Document, arrays)


def test_an_expression_of_a_file_is_checked_when_it_is_opened():
    tree = encode_tree(animated_document(), Workspace(), ArrayHashes())
    for source, said in (("1 +", "Column 4 of the expr.*frizz"), ("1 + ghost", "Frizz: Column 5 of the expr.*ghost")):
        raw = msgspec.json.decode(tree.json)
        raw["document"]["grooms"][0]["coat"]["frizz"]["base"] = {"type": "expression", "source": source}
        with pytest.raises(ValueError, match=said):
            decode_part(decode_envelope(msgspec.json.encode(raw)), "document", Document, tree.arrays)


def test_hairs_are_counted_as_far_as_a_description_can(tmp_path):
    document = small_document()
    groom, path = document.grooms[0], tmp_path / "a.filo"
    known, unknown = {0.1: 100, 0.0: 0}, (formula("u"), constant(0.5, "density"))
    for density, hairs in [(constant(d), n) for d, n in known.items()] + [(d, 1000) for d in unknown]:
        write_project(path, with_groom(document, groom.replace(coat=groom.coat.replace(density=density))))
        assert project_info(path)["hairs"] == hairs


numbers = st.floats(0.0, 1.0)
frames = st.lists(st.integers(-10_000, 10_000), min_size=1, max_size=5, unique=True).map(sorted)
tangents = st.sampled_from(["step", "linear", "smooth", "free"])
keys = st.tuples(st.floats(-1e30, 1e30), tangents, tangents, st.floats(0.0, 1e9), st.floats(-1e30, 1e30))
curves = st.builds(
    lambda at, parts, before, after: Curve(
        keys=tuple(
            Key(frame=float(frame), value=v, arrive=a, leave=b, arrive_handle=(-x, y), leave_handle=(x, y))
            for frame, (v, a, b, x, y) in zip(at, parts, strict=False)
        ),
        before=before, after=after,
    ),
    frames, st.lists(keys, min_size=5, max_size=5), *[st.sampled_from(["hold", "linear", "cycle"])] * 2,
)
sources = st.sampled_from(["0.2 + 0.3 * rand(id, 7)", "u if v < 0.5 else density", "smoothstep(0, 1, frame / 24)"])
values = st.builds(
    lambda base, map: Value(base=base, map=map),
    st.one_of(numbers.map(lambda x: Constant(number=x)), curves, sources.map(lambda s: Formula(source=s))),
    st.sampled_from([None, "density"]),
)


@given(st.fixed_dictionaries(dict.fromkeys(COAT_VALUES, values)))
def test_values_of_every_kind_come_back_to_the_bit(changes):
    document = small_document()
    groom = document.grooms[0]
    document = with_groom(document, groom.replace(coat=groom.coat.replace(**changes)))
    tree = encode_tree(document, Workspace(), ArrayHashes())
    assert same_bits(decode_part(decode_envelope(tree.json), "document", Document, tree.arrays), document)


def test_a_sentence_of_a_label_is_one_line():
    groom = small_document().grooms[0]
    for name in COAT_VALUES:
        with pytest.raises(UserError) as error:
            groom.replace(coat=groom.coat.replace(**{name: formula("nothing * 2")}))
        assert str(error.value).startswith(f"{COAT_FIELDS[name].label}: Column 1 of the expression: ")
        assert "\n" not in str(error.value)
