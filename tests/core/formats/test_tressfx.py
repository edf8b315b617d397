"""TressFX assets, by the struct module and a real one."""

from __future__ import annotations

import os
import struct
from pathlib import Path

import numpy as np
import pytest

from core.errors import UserError
from core.formats.curve_file import read_groom, write_groom
from tests.core.formats.coat_samples import make_groom


def asset(version=4.0, strands=2, per_strand=3, points_at=160, uvs_at=0, body=None):
    head = struct.pack("<f7I", version, strands, per_strand, points_at, uvs_at, 0, 0, 0).ljust(160, b"\0")
    return head + (np.arange(24, dtype="<f4").tobytes() if body is None else body)


def test_points_and_uvs(tmp_path):
    body = np.arange(28, dtype="<f4").tobytes()
    (tmp_path / "a.tfx").write_bytes(asset(uvs_at=160 + 96, body=body))
    hair = read_groom(tmp_path / "a.tfx").children
    assert hair.counts.tolist() == [3, 3]
    assert hair.points.tolist() == [[4 * k, 4 * k + 1, 4 * k + 2] for k in range(6)]
    assert hair.root_uvs.tolist() == [[24, 25], [26, 27]]


@pytest.mark.parametrize("data", [
    b"", asset(version=3.0), asset(strands=2**32 - 1, per_strand=2**32 - 1), asset(points_at=4),
    asset(points_at=2**32 - 1), asset(uvs_at=250), asset(per_strand=1), asset(strands=0),
])  # fmt: skip
def test_damaged_files_are_refused(tmp_path, data):
    (tmp_path / "a.tfx").write_bytes(data)
    with pytest.raises(UserError, match=r"^a\.tfx"):
        read_groom(tmp_path / "a.tfx")


def test_it_is_not_written(tmp_path):
    with pytest.raises(UserError, match="only read"):
        write_groom(tmp_path / "a.tfx", make_groom())


def test_the_real_mohawk():
    if "FILOPLUME_DATA" not in os.environ:
        pytest.skip("FILOPLUME_DATA is not set")
    folder = Path(os.environ["FILOPLUME_DATA"]) / "hair/tressfx_ratboy_mohawk/HairAsset/Ratboy"
    hair = read_groom(folder / "Ratboy_mohawk.tfx").children
    assert (len(hair), set(hair.counts.tolist())) == (2228, {32})
    lengths = np.linalg.norm(np.diff(hair.points.reshape(2228, 32, 3), axis=1), axis=2).sum(axis=1)
    assert 0.01 < np.median(lengths) < 0.5  # a creature of a metre or so with a mohawk
    assert lengths.max() < 1.0
