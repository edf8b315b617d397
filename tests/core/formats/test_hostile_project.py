"""Projects made to hurt: every one is refused in one sentence, quickly, without touching anything else."""

import os
import struct
import sys
import time
import tracemalloc
import zipfile

import numpy as np
import pytest

from core.errors import UserError
from core.formats.project import check_project, read_project, write_project
from core.leaves import same_bits
from core.workspace import Workspace
from tests.core.formats.hostile_parts import (
    DOCUMENT,
    ENCODED,
    POINTS,
    TREE,
    archive,
    changed,
    deep_json,
    end,
    hostile_pickle,
    members,
    npy,
    patched,
    quine_overlap,
    with_array,
    with_member,
)
from tests.documents import small_document

GROOM = ("grooms", 0)
GUIDES = (*GROOM, "guides")
D = "document"
NAN = float("nan")
FOUR = [("arrays/../../evil.npy", b""), ("/etc/evil", b""), ("..\\evil", b""), ("arrays/" + "a" * 64 + ".npz", b"")]
points = DOCUMENT.grooms[0].guides.points
mesh_points = DOCUMENT.meshes[0].mesh.points

HOSTILE = {
    # not a project at all
    "empty": b"",
    "text": b"hello",
    "one byte": b"P",
    "only the end of a zip": b"PK\5\6" + bytes(18),
    "zeros": bytes(100_000),
    "an empty zip": archive({}),
    "another zip": archive({"readme.txt": b"hi"}),
    "a zip behind junk": os.urandom(5000),
    # its list of members
    **{f"member {name!r}": archive([*members().items(), (name, data)]) for name, data in FOUR},
    "a folder": archive([*members().items(), ("arrays/", b"")]),
    "a name of 60,000 letters": archive([*members().items(), ("a" * 60_000, b"")]),
    "65,535 members announced": patched(lambda d: end(d) + 10, 0xFFFF, "<H"),
    "a list of 4 GB": patched(lambda d: end(d) + 12, 0xFFFFFFFF),
    "a list beyond the end": patched(lambda d: end(d) + 16, 0x7FFFFFFF),
    "members that overlap": quine_overlap(),
    "a member of 2^32-1 bytes": patched(lambda d: struct.unpack_from("<I", d, end(d) + 16)[0] + 24, 0xFFFFFFFF),
    "a member before the start": patched(lambda d: struct.unpack_from("<I", d, end(d) + 16)[0] + 42, 0x7FFFFFFF),
    "encrypted": patched(lambda d: struct.unpack_from("<I", d, end(d) + 16)[0] + 8, 1, "<H"),
    "an unknown compression": patched(lambda d: struct.unpack_from("<I", d, end(d) + 16)[0] + 10, 99, "<H"),
    "a bomb, deflated": archive(members(arrays={f"arrays/{POINTS}.npy": bytes(50 << 20)}), zipfile.ZIP_DEFLATED),
    "a bomb, bzip2": archive({"document.json": b" " * (30 << 20)}, zipfile.ZIP_BZIP2),
    "no document": archive({k: v for k, v in members().items() if k != "document.json"}),
    "no checksum": archive(members(), comment=b""),
    "a wrong checksum": archive(members(), comment=b"filoplume sha256 " + b"0" * 64),
    # its JSON
    "not JSON": archive(members(b"{")),
    "not UTF-8": archive(members(b'{"format": "\xff\xfe"}')),
    "JSON that is a list": archive(members(b"[]")),
    "JSON that is null": archive(members(b"null")),
    "NaN": archive(members(ENCODED.json.replace(b'"fps":24.0', b'"fps":NaN'))),
    "infinity": archive(members(ENCODED.json.replace(b'"fps":24.0', b'"fps":1e999'))),
    "a huge number": archive(members(ENCODED.json.replace(b'"fps":24.0', b'"fps":' + b"9" * 5000))),
    "100,000 deep": deep_json(100_000),
    "5,000 deep": deep_json(5_000),
    "100 deep": deep_json(100),
    "17 MB of JSON": archive(members(ENCODED.json + b" " * (17 << 20))),
    "a name of a megabyte": changed(D, *GROOM, "name", to="x" * (1 << 20)),
    "a key of 10,000 letters": changed("workspace", "params", "k" * 10_000, to=1),
    "no format": changed("format", drop=True),
    "format 0": changed("format", to=0),
    "format true": changed("format", to=True),
    "format of tomorrow": changed("format", to=999),
    "no arrays": changed("arrays", drop=True),
    "arrays as a list": changed("arrays", to=[]),
    "no document key": changed(D, drop=True),
    "no workspace key": changed("workspace", drop=True),
    "a document that is a number": changed(D, to=3),
    # its records
    "an unknown field": changed(D, "evil", to=1),
    "an unknown field deep down": changed(D, *GROOM, "coat", "evil", to=1),
    "a missing field": changed(D, *GUIDES, "hold", drop=True),
    "text for a number": changed(D, *GROOM, "id", to="1"),
    "a fraction for an id": changed(D, *GROOM, "id", to=1.5),
    "an id of 2^63": changed(D, *GROOM, "id", to=2**63),
    "next_id 2^40": changed(D, *GUIDES, "next_id", to=2**40),
    "next_id too low": changed(D, *GUIDES, "next_id", to=3),
    "a hundred million million hairs": changed(D, *GROOM, "coat", "count", to=10**14),
    "2^31 points on a hair": changed(D, *GROOM, "coat", "points", to=2**31),
    "negative density": changed(D, *GROOM, "coat", "density", to=-0.5),
    "a colour of two numbers": changed(D, *GROOM, "coat", "color_tip", to=[1.0, 1.0]),
    "a control character": changed(D, *GROOM, "name", to="a\u0000b"),
    "an empty name": changed(D, *GROOM, "name", to=""),
    "a unit nobody knows": changed(D, "unit", to="parsec"),
    "a groom on no mesh": changed(D, *GROOM, "mesh_id", to=99),
    "a map that is not there": changed(D, *GROOM, "coat", "length_map", to="ghost"),
    "two grooms of one id": changed(D, "grooms", to=[TREE[D]["grooms"][0]] * 2),
    "code in an expression": changed(
        D, *GROOM, "coat", "length", "base", to={"type": "expression", "source": "__import__('os').system('id')"}
    ),
    "a panel that is a number": changed("workspace", "panels", to=[1]),
    # its arrays
    "an array that is not there": changed(D, *GUIDES, "points", to="0" * 64),
    "an array by a path": changed(D, *GUIDES, "points", to="../../etc/passwd"),
    "an array in line": changed(D, *GUIDES, "points", to=[[[0.0, 0.0, 0.0]]]),
    "an array of objects": changed("arrays", POINTS, "dtype", to="|O"),
    "an array of text": changed("arrays", POINTS, "dtype", to="<U9"),
    "an array of records": changed("arrays", POINTS, "dtype", to="[('a','<f4')]"),
    "2^31 points": changed("arrays", POINTS, "shape", to=[2**31, 4, 3]),
    "2^62 points": changed("arrays", POINTS, "shape", to=[2**62, 4, 3]),
    "-1 points": changed("arrays", POINTS, "shape", to=[-1, 4, 3]),
    "thirty axes": changed("arrays", POINTS, "shape", to=[1] * 30),
    "a pickle": hostile_pickle(),
    "an array cut short": with_member(npy(points)[:-1]),
    "an array with a tail": with_member(npy(points) + b"\0"),
    "other numbers": with_member(npy(points + 1)),
    "an array with a strange header": with_member(npy(points).replace(b"order': False", b"order': True ")),
    "another type": with_array((*GUIDES, "points"), points.astype(np.float64)),
    "another number of rows": with_array((*GUIDES, "points"), points[:5]),
    "NaN in the points": with_array((*GUIDES, "points"), np.where(points > 0.05, np.float32(NAN), points)),
    "infinity in the mesh": with_array(("meshes", 0, "mesh", "points"), np.full_like(mesh_points, np.inf)),
    "corners beyond the mesh": with_array(
        ("meshes", 0, "mesh", "corners"), DOCUMENT.meshes[0].mesh.corners + np.int32(1000)
    ),
    "faces of 2^31-1 corners": with_array(("meshes", 0, "mesh", "counts"), np.full(9, 2**31 - 1, np.int32)),
    "roots on faces that are not there": with_array((*GUIDES, "roots", "faces"), np.full(12, 1_000_000, np.int32)),
    "roots on negative faces": with_array((*GUIDES, "roots", "faces"), np.full(12, -5, np.int32)),
    "roots on a fifth corner": with_array((*GUIDES, "roots", "corners"), np.full((12, 3), 4, np.int32)),
    "ids twice": with_array((*GUIDES, "ids"), np.zeros(12, np.int32)),
    "a map of another mesh": with_array((*GROOM, "maps", 0, "values"), np.zeros(3, np.float32)),
    "truth values of 7": with_array((*GUIDES, "selected"), np.full(12, 7, np.uint8).view(np.bool_)),
}


@pytest.fixture
def no_writes():
    """Fails the test when anything is opened for writing, run or removed while it is armed."""
    state = {"armed": False, "seen": []}

    def hook(event, args):
        if not state["armed"]:
            return
        if event in ("os.system", "subprocess.Popen", "os.remove", "os.rename", "pickle.find_class", "os.mkdir"):
            state["seen"].append((event, args))
        if event == "open" and isinstance(args[1], str) and set(args[1]) & set("wax+"):
            state["seen"].append((event, args))

    sys.addaudithook(hook)
    yield state
    state["armed"] = False


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_project_is_refused_in_one_sentence(name, tmp_path, no_writes):
    path = tmp_path / "evil.filo"
    path.write_bytes(HOSTILE[name])
    tracemalloc.start()
    start = time.process_time()  # of the processor: a busy machine is no fault
    no_writes["armed"] = True
    try:
        with pytest.raises(UserError) as refused:
            read_project(path)
        found = check_project(path)
    finally:
        no_writes["armed"] = False
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert no_writes["seen"] == []
    message = str(refused.value)
    assert message.startswith("evil.filo cannot be opened: ")
    assert len(message) < 600
    assert "\n" not in message
    assert found != []
    assert peak < 200 << 20
    assert time.process_time() - start < 10.0
    assert not os.path.exists("/tmp/filoplume-was-here")


def test_the_honest_file_made_the_same_way_opens(tmp_path):
    path = tmp_path / "good.filo"
    path.write_bytes(archive(members()))
    assert same_bits(read_project(path).document, DOCUMENT)


def test_the_message_has_the_path_of_the_field(tmp_path):
    path = tmp_path / "evil.filo"
    for data, where in (
        (HOSTILE["text for a number"], r"\$\.grooms\[0\]\.id"),
        (HOSTILE["an unknown field deep down"], r"\$\.grooms\[0\]\.coat"),
        (HOSTILE["another type"], r"\$\.grooms\[0\]\.guides"),
        (HOSTILE["an array that is not there"], r"\$\.grooms\[0\]\.guides\.points"),
    ):
        path.write_bytes(data)
        with pytest.raises(UserError, match=where):
            read_project(path)


def test_every_truncation_is_refused(tmp_path):
    path = tmp_path / "a.filo"
    write_project(path, small_document(guides=2, side=1, points=2), Workspace())
    for length in range(path.stat().st_size - 1, -1, -1):
        os.truncate(path, length)
        with pytest.raises(UserError):
            read_project(path)


def test_flipped_bits_are_refused_or_do_not_matter(tmp_path):
    path = tmp_path / "a.filo"
    document = small_document(guides=2, side=1, points=2)
    write_project(path, document, Workspace())
    data = bytearray(path.read_bytes())
    rng = np.random.default_rng(0)
    opened = 0
    for position in rng.integers(0, len(data), 600):
        bit = 1 << int(rng.integers(0, 8))
        data[position] ^= bit
        path.write_bytes(data)
        try:
            assert same_bits(read_project(path).document, document)
            opened += 1
        except UserError:
            pass
        data[position] ^= bit
    assert opened < 200  # dates and the like in the zip's own list


def test_there_are_enough_of_them():
    assert len(HOSTILE) >= 80
