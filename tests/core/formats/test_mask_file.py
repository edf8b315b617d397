"""Masks from files: what is there, and one sentence for what is not."""

import json

import numpy as np
import pytest

from core.errors import UserError
from core.formats.mask_file import read_masks
from core.match.outline import outline_at

TRIANGLE = [[0, 0], [10, 0], [0, 10]]


def test_masks_are_read_with_their_keys_in_order(tmp_path):
    path = tmp_path / "m.json"
    later = [[x + 4, y] for x, y in TRIANGLE]
    path.write_text(json.dumps({"masks": [{"keys": [[1009, later], [1001, TRIANGLE]], "smooth": True}]}))
    (mask,) = read_masks(path)
    assert (mask.smooth, mask.inverted, mask.frames.tolist()) == (True, False, [1001, 1009])
    np.testing.assert_allclose(outline_at(mask, 1005), np.array(TRIANGLE) + np.array([2, 0]))


@pytest.mark.parametrize(
    "text",
    [
        "", "[]", "{}", '{"masks": [{"keys": []}]}', '{"masks": [{"keys": [[1, [[0, 0]]]]}]}', "\xff", "[" * 5000,
        json.dumps({"masks": [{"keys": [[1, TRIANGLE], [1, TRIANGLE]]}]}),
        json.dumps({"masks": [{"keys": [[1, TRIANGLE], [2, [*TRIANGLE, [3, 3]]]]}]}),
        json.dumps({"masks": [{"keys": [[2**40, TRIANGLE]]}]}),
        '{"masks": [{"keys": [[1, [[0, 0], [1e999, 0], [0, 1]]]]}]}',
    ],
)  # fmt: skip
def test_what_is_no_mask_is_refused_in_one_sentence(tmp_path, text):
    path = tmp_path / "m.json"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(UserError) as error:
        read_masks(path)
    assert "\n" not in str(error.value)
    with pytest.raises(UserError):
        read_masks(tmp_path / "none.json")
