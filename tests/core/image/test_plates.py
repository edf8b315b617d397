"""Plates from disk: numbers of frames, what is missing or broken, depths, movies, the bounded cache."""

import shutil
import threading
from fractions import Fraction

import av
import cv2
import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image
from PIL.TiffImagePlugin import IFDRational

from core.errors import UserError
from core.formats.frame_decoder import FrameDecoder
from core.formats.plate_file import PlateFrames, read_plate
from core.image.frame_cache import FrameCache, GivenUp
from core.image.mix import mixed
from core.image.plate import ChannelMix, frame_name

RNG = np.random.default_rng(0)
PIXELS = RNG.integers(0, 256, (40, 60, 3), dtype=np.uint8)


@pytest.fixture(scope="module")
def decoder():
    made = FrameDecoder(seconds=20.0)
    yield made
    made.close()


def write(path, pixels):
    spec = oiio.ImageSpec(
        pixels.shape[1],
        pixels.shape[0],
        pixels.shape[2],
        str(pixels.dtype).replace("float16", "half").replace("float32", "float"),
    )
    image = oiio.ImageBuf(spec)
    image.set_pixels(oiio.ROI(), pixels)
    assert image.write(str(path)), image.geterror()


@pytest.mark.parametrize(
    ("suffix", "dtype"),
    [("png", "uint8"), ("tif", "uint16"), ("dpx", "uint16"), ("exr", "float16"), ("exr", "float32")],
)
def test_every_kind_comes_back_as_it_was(tmp_path, decoder, suffix, dtype):
    scale = {"uint8": 1, "uint16": 257}.get(dtype, 1 / 255.0)
    pixels = (PIXELS.astype(float) * scale).astype(dtype)
    for k in (1001, 1002):
        write(tmp_path / f"shot.{k}.{suffix}", pixels)
    plate = read_plate(tmp_path, decoder)
    assert (plate.first, plate.last, plate.width, plate.height, plate.name) == (1001, 1002, 60, 40, tmp_path.name)
    found = decoder.decode(tmp_path / f"shot.1001.{suffix}").pixels
    assert found.dtype == pixels.dtype
    np.testing.assert_array_equal(found, pixels)


def test_missing_broken_and_odd_frames_are_named_and_left_out(tmp_path, decoder):
    for k in (8, 9, 10, 12, 13):
        cv2.imwrite(str(tmp_path / f"a_{k:04d}.png"), PIXELS)
    (tmp_path / "a_0009.png").write_bytes((tmp_path / "a_0008.png").read_bytes()[:200])
    cv2.imwrite(str(tmp_path / "a_0012.png"), PIXELS[:20])
    before = {p.name: p.read_bytes() for p in tmp_path.iterdir()}
    plate = read_plate(tmp_path / "a_####.png", decoder)
    assert (plate.first, plate.last, plate.missing) == (8, 13, (11,))
    frames = PlateFrames(plate, decoder)
    assert [frames.get(k) is not None for k in plate.frames] == [True, False, True, False, False, True]
    assert set(frames.broken) == {9, 11, 12}
    assert "60 x 20" in frames.broken[12]
    frames.close()
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == before


def test_names_of_every_form_find_the_same_plate(tmp_path, decoder):
    for k in range(3):
        cv2.imwrite(str(tmp_path / f"a.{k:03d}.png"), PIXELS)
    found = [
        read_plate(p, decoder)
        for p in (tmp_path, tmp_path / "a.###.png", tmp_path / "a.%03d.png", tmp_path / "a.001.png")
    ]
    assert {(p.path, p.first, p.last) for p in found} == {((tmp_path / "a.###.png").as_posix(), 0, 2)}
    assert frame_name("a.###.png", -7) == "a.-007.png"


def test_a_movie_gives_its_frames_by_number(tmp_path, decoder):
    path = tmp_path / "film.mp4"
    with av.open(str(path), "w") as out:
        stream = out.add_stream("mpeg4", rate=Fraction(24))
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        for k in range(12):
            picture = np.full((48, 64, 3), 20 * k, np.uint8)
            out.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        out.mux(stream.encode(None))
    plate = read_plate(path, decoder)
    assert (plate.first, plate.last, plate.width, plate.movie) == (1, 12, 64, True)
    for k in (1, 2, 9, 4, 12):
        assert abs(float(decoder.decode(path, k, movie=True).pixels.mean()) - 20 * (k - 1)) < 4
    with pytest.raises(UserError, match="ends before"):
        decoder.decode(path, 13, movie=True)


def test_a_decoder_that_is_killed_or_cancelled_is_begun_anew(tmp_path, decoder):
    picture = tmp_path / "a.png"
    cv2.imwrite(str(picture), PIXELS)
    assert decoder.decode(picture).pixels.shape == PIXELS.shape
    decoder._child.kill()
    decoder._child.wait()
    assert decoder.decode(picture).pixels.shape == PIXELS.shape
    for turns in (0, 1, 2):  # before the answer, and between its parts
        left = iter([False] * turns)
        with pytest.raises(UserError, match="cancelled"):
            decoder.decode(picture, cancel=lambda left=left: next(left, True))
        assert decoder.decode(picture).pixels.shape == PIXELS.shape


def test_what_is_no_plate_is_refused(tmp_path, decoder):
    (tmp_path / "empty").mkdir()
    (tmp_path / "x.png").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(100))
    (tmp_path / "x.mp4").write_bytes(bytes(1000))
    for name in ("empty", "nothing", "x.png", "x.mp4", "b.####.png"):
        with pytest.raises(UserError):
            read_plate(tmp_path / name, decoder)
    shutil.rmtree(tmp_path / "empty")


def test_the_cache_stays_within_its_budget_and_reads_ahead():
    asked = []

    def read(frame):
        asked.append(frame)
        if frame == 5:
            raise UserError("frame 5 is broken")
        return np.full((10, 100), frame, np.uint8)

    cache = FrameCache(read, range(1, 20), budget=4000, ahead=2)
    for frame in (1, 2, 3):
        assert cache.get(frame)[0, 0] == frame
    cache.get(5)
    assert cache.get(5) is None
    assert cache.broken == {5: "frame 5 is broken"}
    for frame in range(1, 20):
        cache.get(frame)
        assert cache.bytes <= 4000
    assert asked.count(5) == 1
    cache.close()


def test_mixes_see_what_they_say():
    grey = mixed(PIXELS, ChannelMix(channels="grey", red=1.0, green=0.0, blue=0.0))
    np.testing.assert_allclose(grey[:, :, 0], PIXELS[:, :, 0] / 255.0, atol=1e-6)
    dark, darker = (mixed(np.float32(PIXELS) * s, ChannelMix(log=True)) for s in (0.5, 0.25))
    bright = PIXELS > 50
    np.testing.assert_allclose((dark - darker)[bright], 0.1, atol=0.002)  # one stop
    flat = mixed((PIXELS // 8 + 20).astype(np.uint8), ChannelMix(contrast=15))
    assert flat.std() > 4 * mixed((PIXELS // 8 + 20).astype(np.uint8), ChannelMix()).std()


@pytest.mark.parametrize(("told", "film"), [((4.2, 26), (5.591, 4.194)), ((4.2, None), None), ((0.0, 26), None)])
def test_focal_length_and_film_back_come_from_exif(tmp_path, decoder, told, film):
    exif = Image.Exif()
    facts = exif.get_ifd(0x8769)
    facts[0x920A] = IFDRational(round(10 * told[0]), 10)
    if told[1] is not None:
        facts[0xA405] = told[1]
    Image.fromarray(np.zeros((30, 40, 3), np.uint8)).save(tmp_path / "phone.0001.jpg", exif=exif)
    plate = read_plate(tmp_path, decoder)
    assert plate.focal_mm == (pytest.approx(told[0]) if told[0] else None)
    # 4.2 mm that is like 26 mm on 36 x 24: a diagonal of 43.267 * 4.2 / 26 mm, four to three
    assert plate.film_back == (None if film is None else pytest.approx(film, abs=2e-3))


def test_who_waits_for_a_frame_may_give_up_and_a_frame_may_be_expected():
    begun, go_on = threading.Event(), threading.Event()

    def read(frame):
        begun.set()
        assert go_on.wait(10)
        return np.full((2, 2, 3), frame, np.uint8)

    cache = FrameCache(read, range(1, 9), budget=1000, ahead=0)
    with pytest.raises(GivenUp):
        cache.get(3, begun.is_set)
    cache.expect(5)
    cache.expect(99)
    go_on.set()
    assert (cache.get(3, lambda: False) == 3).all()
    assert (cache.get(5) == 5).all()
    assert not cache.knows(99)
    full = FrameCache(lambda frame: np.zeros((2, 2, 3), np.uint8), range(1, 9), budget=12, ahead=0)
    full.get(1)
    full.expect(2)
    assert full.get(1) is not None
    assert not full.knows(2)
    full.close()
    cache.close()
    cache.expect(7)
    assert not cache.knows(7)
