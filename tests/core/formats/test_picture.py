"""Pictures come back as the numbers that were written, and hostile ones are refused in a sentence."""

from __future__ import annotations

import struct
import zlib

import cv2
import numpy as np
import pytest

from core.errors import UserError
from core.formats.picture import read_colors, read_picture


def png(width, height, depth, colour, body):
    """A PNG written by hand from the standard, independent of OpenCV."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", zlib.compress(body)) + chunk(b"IEND", b"")


def test_colours_are_red_green_blue_and_whole_numbers_become_0_to_1(tmp_path):
    rows = b"\0" + bytes([255, 0, 0, 0, 128, 0]) + b"\0" + bytes([0, 0, 64, 1, 2, 3])
    (tmp_path / "c.png").write_bytes(png(2, 2, 8, 2, rows))
    pixels = read_picture(tmp_path / "c.png")
    assert pixels.dtype == np.float32
    expected = np.array([[[255, 0, 0], [0, 128, 0]], [[0, 0, 64], [1, 2, 3]]]) / 255
    np.testing.assert_allclose(pixels, expected, atol=1e-7)


def test_sixteen_bits_are_kept(tmp_path):
    values = [0, 1, 32768, 65535]
    (tmp_path / "g.png").write_bytes(png(4, 1, 16, 0, b"\0" + struct.pack(">4H", *values)))
    np.testing.assert_allclose(read_picture(tmp_path / "g.png"), [np.array(values) / 65535], atol=1e-7)


def test_alpha_stays_last(tmp_path):
    (tmp_path / "a.png").write_bytes(png(1, 1, 8, 6, b"\0" + bytes([10, 20, 30, 40])))
    np.testing.assert_allclose(read_picture(tmp_path / "a.png")[0, 0] * 255, [10, 20, 30, 40], atol=1e-4)


def test_floating_tiff_is_untouched_but_for_what_is_not_finite(tmp_path):
    values = np.array([[0.25, -3.5], [7e4, np.nan]], np.float32)
    cv2.imwrite(str(tmp_path / "f.tiff"), values)
    np.testing.assert_array_equal(read_picture(tmp_path / "f.tiff"), [[0.25, -3.5], [7e4, 0.0]])


@pytest.mark.parametrize(("content", "words"), [
    (b"", "no PNG, JPEG or TIFF"),
    (b"\x76\x2f\x31\x01rest", "OpenEXR"),
    (b"GIF89a", "no PNG, JPEG or TIFF"),
    (b"\x89PNG\r\n\x1a\n", "damaged"),
    (png(4, 4, 8, 2, b"")[:-20], "damaged"),
    (png(1 << 30, 1 << 30, 8, 2, b""), "pixels|damaged"),
    (png(60_000, 60_000, 8, 0, b""), "pixels"),
    (b"II*\0" + b"\xff" * 40, "damaged"),
    (b"\xff\xd8\xff\xe0" + b"\0" * 100, "damaged"),
])  # fmt: skip
def test_what_is_no_sound_picture_is_refused(content, words, tmp_path):
    (tmp_path / "bad.png").write_bytes(content)
    with pytest.raises(UserError, match=words):
        read_picture(tmp_path / "bad.png")


def test_a_missing_picture_is_named(tmp_path):
    with pytest.raises(UserError, match=r"gone\.png"):
        read_picture(tmp_path / "gone.png")


def test_pictures_become_colours_of_the_screen_on_white(tmp_path):
    pixel = np.array([[[10, 20, 200, 0], [10, 20, 200, 255]]], np.uint8)  # blue, green, red, alpha
    cv2.imwrite(str(tmp_path / "some.png"), pixel)
    np.testing.assert_array_equal(read_colors(tmp_path / "some.png"), [[[255, 255, 255], [200, 20, 10]]])
    cv2.imwrite(str(tmp_path / "grey.png"), np.array([[7, 9]], np.uint8))
    np.testing.assert_array_equal(read_colors(tmp_path / "grey.png"), [[[7] * 3, [9] * 3]])
