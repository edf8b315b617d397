"""The project file."""

import errno
import hashlib
import io
import os
import zipfile
from pathlib import Path

import msgspec
import numpy as np
import pytest

from core.document import Document, with_groom
from core.errors import UserError
from core.formats.arrays import ArrayHashes, ArraySpec, array_from, hash_array, spec_of
from core.formats.project import check_project, project_info, read_project, write_project
from core.formats.tree import decode_envelope, encode_tree
from core.formats.upgrade import FORMAT, upgrade
from core.leaves import array_bytes, leaves, same_bits
from core.pose.rig import Rig
from core.pose.skeleton import Clip, Skeleton, SkinWeights
from core.record import freeze, is_frozen
from core.value import formula
from core.workspace import Workspace
from tests.core.formats.failing_disk import Disk, failing
from tests.documents import small_document, small_workspace, stroked

BASELINES = Path(__file__).parents[3] / "resources" / "baselines"


def _with_rig(document):
    item = document.meshes[0]
    count = len(item.mesh.points)
    skeleton = Skeleton(
        names=("hip", "head"), parents=np.array([-1, 0], np.int32), rest=np.tile(np.eye(4), (2, 1, 1)),
        bind=np.tile(np.eye(4), (2, 1, 1)),
    )
    skin = SkinWeights(joints=np.zeros((count, 1), np.int32), weights=np.ones((count, 1), np.float32))
    clip = Clip(
        translations=np.zeros((3, 2, 3), np.float32), rotations=np.tile(np.float32([0, 0, 0, 1]), (3, 2, 1)),
        scales=np.ones((3, 2, 3), np.float32),
    )
    return document.replace(meshes=(item.replace(rig=Rig(skeleton=skeleton, skin=skin, clip=clip)),))


@pytest.fixture
def saved(tmp_path):
    document = _with_rig(small_document())
    path = tmp_path / "coat.filo"
    write_project(path, document, small_workspace())
    return path, document


def test_everything_comes_back_to_the_bit(saved):
    path, document = saved
    project = read_project(path)
    assert same_bits(project.document, document)
    assert same_bits(project.workspace.cameras, small_workspace().cameras)
    assert project.workspace.params == {"radius": 0.25}
    assert project.workspace.frame == 1012.5
    assert all(is_frozen(array) for _, array in leaves(project.document))
    assert check_project(path) == []


def test_values_and_expressions_come_back(tmp_path):
    document = small_document()
    groom = document.grooms[0]
    document = with_groom(document, groom.replace(coat=groom.coat.replace(length=formula("0.5 + 0.5 * rand(id, 3)"))))
    write_project(tmp_path / "a.filo", document)
    assert same_bits(read_project(tmp_path / "a.filo").document, document)


def test_an_empty_document_and_one_without_guides(tmp_path):
    for document in (Document(), small_document(guides=0)):
        write_project(tmp_path / "a.filo", document)
        assert same_bits(read_project(tmp_path / "a.filo").document, document)


def test_shared_arrays_stay_one_object_and_are_stored_once(tmp_path):
    document = small_document(guides=300, points=16)
    twin = document.grooms[0].replace(id=2, name="twin")
    alike = twin.replace(id=3, guides=twin.guides.replace(points=freeze(twin.guides.points.copy())))
    path = tmp_path / "a.filo"
    write_project(path, with_groom(with_groom(document, twin), alike))
    a, b, c = read_project(path).document.grooms
    assert a.guides.points is b.guides.points is c.guides.points
    assert path.stat().st_size < array_bytes(document) + 20_000


def test_plain_tools_can_read_it(saved):
    path, document = saved
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None
        tree = msgspec.json.decode(archive.read("document.json"))
        assert tree["format"] == FORMAT
        name = tree["document"]["grooms"][0]["guides"]["points"]
        data = archive.read(f"arrays/{name}.npy")
        assert hashlib.sha256(data).hexdigest() == name
        points = np.load(io.BytesIO(data), allow_pickle=False)
        np.testing.assert_array_equal(points, document.grooms[0].guides.points)


@pytest.mark.parametrize("shape", [(), (0,), (0, 3), (1,), (5, 4, 3), (123456,)])
@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.int32, np.bool_, np.uint8, np.int64])
def test_headers_are_those_numpy_writes_and_reads(shape, dtype):
    array = np.ones(shape, dtype)
    spec = spec_of(array)
    mine = io.BytesIO(spec.header() + array.tobytes())
    loaded = np.load(mine, allow_pickle=False)
    assert loaded.dtype == array.dtype
    assert loaded.shape == shape
    np.testing.assert_array_equal(loaded, array)
    assert same_bits(array_from(mine.getvalue(), spec), array)
    assert hash_array(array) == hashlib.sha256(mine.getvalue()).hexdigest()
    assert len(spec.header()) % 64 == 0


def test_equal_documents_make_equal_files(tmp_path):
    for name in "ab":
        write_project(tmp_path / name, small_document())
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_the_file_before_is_kept(tmp_path):
    path, first = tmp_path / "a.filo", small_document()
    second = stroked(first, 1)
    write_project(path, first)
    write_project(path, second)
    assert same_bits(read_project(path).document, second)
    assert same_bits(read_project(tmp_path / "a.filo1").document, first)
    path.write_bytes(b"")
    with pytest.raises(UserError, match=r"The version before it is kept as a\.filo1"):
        read_project(path)


def test_remembered_hashes_are_the_right_ones(tmp_path):
    hashes = ArrayHashes()
    document = small_document()
    write_project(tmp_path / "a", document, hashes=hashes)
    for seed in range(5):
        document = stroked(document, seed)
        write_project(tmp_path / "a", document, hashes=hashes)
        assert same_bits(read_project(tmp_path / "a", hashes).document, document)


@pytest.mark.parametrize("error", [errno.ENOSPC, errno.EIO])
@pytest.mark.parametrize("for_good", [False, True])
def test_every_failing_operation_leaves_a_whole_file(tmp_path, monkeypatch, error, for_good):
    path, old = tmp_path / "a.filo", small_document()
    new = stroked(old, 1)
    write_project(path, old)
    with failing(Disk(tmp_path), monkeypatch) as disk:
        write_project(path, new)
    assert disk.count > 12
    outcomes = []
    for k in range(1, disk.count + 1):
        write_project(path, old)
        message = None
        with failing(Disk(tmp_path, k, error, for_good), monkeypatch):
            try:
                write_project(path, new)
            except UserError as failure:
                message = str(failure)
        document = read_project(path).document
        outcomes.append(same_bits(document, old))
        assert same_bits(document, old) or same_bits(document, new)
        if message is None:
            assert same_bits(document, new)
        else:
            assert "save" in message
            assert "not confirm" in message or same_bits(document, old)
        assert not [name for name in os.listdir(tmp_path) if ".part" in name]
    assert any(outcomes)


def test_a_disk_that_gives_back_something_else_is_noticed(tmp_path, monkeypatch):
    path, old = tmp_path / "a.filo", small_document()
    write_project(path, old)
    real = os.fsync

    def rotting(handle):  # what was written is changed on the way to the disk
        name = os.readlink(f"/proc/self/fd/{handle}")
        if ".part" in name:
            with open(name, "r+b") as file:
                file.seek(-3000, os.SEEK_END)
                byte = file.read(1)
                file.seek(-1, os.SEEK_CUR)
                file.write(bytes([byte[0] ^ 1]))
        real(handle)

    monkeypatch.setattr(os, "fsync", rotting)
    with pytest.raises(UserError, match="gave back something else"):
        write_project(path, stroked(old, 1))
    monkeypatch.undo()
    assert same_bits(read_project(path).document, old)


def test_the_sample_of_every_version_opens():
    for version in range(1, FORMAT + 1):
        project = read_project(BASELINES / f"format_{version}.filo")
        assert project.document.grooms
        assert len(project.document.grooms[0].guides) == 12
    document = read_project(BASELINES / "format_1.filo").document
    groom = document.grooms[0]
    assert groom.name == "coat"
    assert groom.coat.density_map == "density"
    assert hash_array(groom.guides.points) == hash_array(small_document().grooms[0].guides.points)
    assert check_project(BASELINES / "format_1.filo") == []


def test_older_files_are_upgraded_step_by_step():
    steps = {
        1: lambda raw: {**raw, "document": {"unit": raw["document"]["units"]}},
        2: lambda raw: {**raw, "document": {**raw["document"], "fps": 25.0}},
    }
    old = {"format": 1, "document": {"units": "cm"}}
    assert upgrade(old, steps, 3) == {"format": 3, "document": {"unit": "cm", "fps": 25.0}}
    assert old == {"format": 1, "document": {"units": "cm"}}  # pure
    with pytest.raises(ValueError, match="too old"):
        upgrade({"format": 1}, {}, 2)


def test_newer_files_are_refused_by_name():
    tree = encode_tree(Document(), Workspace(), ArrayHashes())
    newer = msgspec.json.decode(tree.json) | {"format": FORMAT + 4, "colours": 5}
    with pytest.raises(ValueError, match=rf"newer Filoplume \(format {FORMAT + 4}, this one reads up to {FORMAT}\)"):
        decode_envelope(msgspec.json.encode(newer))


def test_info_counts(saved):
    path, document = saved
    info = project_info(path)
    assert (info["kind"], info["vertices"], info["faces"]) == ("project", 16, 9)
    assert (info["guides"], info["hairs"]) == (12, 1000)
    assert info["parts"] == ["sheet"]
    with pytest.raises(UserError, match="No such file"):
        project_info(path.with_name("other.filo"))
    assert check_project(path.with_name("other.filo"))[0].startswith("other.filo cannot be opened")
    assert document.grooms[0].id == 1


def test_specs_refuse_what_cannot_be():
    for dtype, shape in (("|O", (1,)), ("<f4", (-1,)), ("<f4", (2**41,)), ("<f8", (2**20, 2**20)), ("<f4", (1,) * 5)):
        with pytest.raises(ValueError, match="array"):
            ArraySpec(dtype=dtype, shape=shape)
