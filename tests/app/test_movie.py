"""Sequences and movies, read back by independent readers; what is there after a fault or a cancel is whole."""

from __future__ import annotations

from pathlib import Path

import av
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from app.movie import write_movie, write_sequence
from core.errors import UserError
from core.formats.frame_file import frame_path


class Enough(Exception):
    """What a cancel raises."""


def picture(frame: float, width: int = 64, height: int = 48) -> NDArray[np.uint8]:
    """A colour that says which frame it is."""
    pixels = np.empty((height, width, 3), np.uint8)
    pixels[:] = [int(20 * (frame % 10)), 60, 200]
    pixels[: height // 2, : width // 2] = [200, 40, 40]
    return pixels


def quiet(done: int) -> None:
    pass


def stop_at(number: int, error: type[Exception]) -> object:
    def progress(done: int) -> None:
        if done == number:
            raise error

    return progress


@pytest.mark.parametrize(("pattern", "frame", "name"), [
    ("cat.####.png", 7, "cat.0007.png"), ("cat.png", 1001, "cat.1001.png"), ("cat.##.png", 12345, "cat.12345.png"),
    ("cat.####.png", -3, "cat.-0003.png"), ("a#b.v2.png", 5, "a5b.v2.png"), ("Katze 猫.png", 0, "Katze 猫.0000.png")])
def test_names_of_frames(pattern: str, frame: int, name: str) -> None:
    assert frame_path(Path("/shots") / pattern, frame) == Path("/shots") / name


def test_a_sequence_holds_the_pictures(tmp_path: Path) -> None:
    seen: list[int] = []
    written = write_sequence(tmp_path / "cat.####.png", range(1001, 1004), picture, seen.append)
    assert [path.name for path in written] == ["cat.1001.png", "cat.1002.png", "cat.1003.png"]
    assert seen == [0, 1, 2]
    for frame, path in zip(range(1001, 1004), written, strict=True):
        assert np.array_equal(np.asarray(Image.open(path)), picture(frame))
    with pytest.raises(UserError, match="PNG"):
        write_sequence(tmp_path / "cat.jpg", [1], picture, quiet)


def test_what_was_drawn_of_a_sequence_stays(tmp_path: Path) -> None:
    with pytest.raises(Enough):
        write_sequence(tmp_path / "cat.png", range(10), picture, stop_at(3, Enough))  # type: ignore[arg-type]
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"cat.000{i}.png" for i in range(3)]


@pytest.mark.parametrize("suffix", [".mp4", ".mov", ".mkv"])
@pytest.mark.parametrize("size", [(64, 48), (63, 47)])
def test_a_movie_shows_the_frames_in_order_and_colour(tmp_path: Path, suffix: str, size: tuple[int, int]) -> None:
    path = tmp_path / f"Katze 猫{suffix}"
    count = write_movie(path, range(1001, 1013), 24.0, lambda frame: picture(frame, *size), quiet)
    assert count == 12
    assert list(tmp_path.iterdir()) == [path]
    with av.open(str(path)) as movie:
        stream = movie.streams.video[0]
        assert float(stream.average_rate) == pytest.approx(24.0)
        assert (stream.width, stream.height) == (64, 48)
        shown = [frame.to_ndarray(format="rgb24").astype(int) for frame in movie.decode(stream)]
    assert len(shown) == 12
    for frame, pixels in zip(range(1001, 1013), shown, strict=True):
        wanted = picture(frame).astype(int)
        assert np.abs(pixels[10:14, 10:14] - wanted[10:14, 10:14]).max() <= 6
        assert np.abs(pixels[-8:-4, -8:-4] - wanted[-8:-4, -8:-4]).max() <= 6


def test_a_movie_that_is_stopped_is_a_shorter_one(tmp_path: Path) -> None:
    path = tmp_path / "cat.mp4"
    with pytest.raises(Enough):
        write_movie(path, range(100), 30.0, picture, stop_at(5, Enough), Enough)  # type: ignore[arg-type]
    with av.open(str(path)) as movie:
        assert len(list(movie.decode(video=0))) == 5
    assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(Enough):
        write_movie(tmp_path / "none.mp4", range(9), 30.0, picture, stop_at(0, Enough), Enough)  # type: ignore[arg-type]
    assert list(tmp_path.iterdir()) == [path]


def test_a_fault_leaves_the_earlier_file(tmp_path: Path) -> None:
    path = tmp_path / "cat.mp4"
    path.write_bytes(b"the earlier one")
    with pytest.raises(ZeroDivisionError):
        write_movie(path, range(9), 30.0, picture, stop_at(4, ZeroDivisionError), Enough)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="was given a picture"):
        write_movie(path, range(9), 30.0, lambda frame: picture(frame, 64 + int(frame)), quiet)
    assert path.read_bytes() == b"the earlier one"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("fps", [23.976, 25.0, 29.97, 59.94, 12.5, 120.0])
def test_rates_are_kept(tmp_path: Path, fps: float) -> None:
    write_movie(tmp_path / "a.mp4", range(4), fps, picture, quiet)
    with av.open(str(tmp_path / "a.mp4")) as movie:
        assert float(movie.streams.video[0].average_rate) == pytest.approx(fps, rel=1e-4)


def test_what_cannot_be_written_is_said(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"written as \.mp4"):
        write_movie(tmp_path / "cat.gif", [1], 24.0, picture, quiet)
    with pytest.raises(UserError, match="no frames"):
        write_movie(tmp_path / "cat.mp4", [], 24.0, picture, quiet)
    with pytest.raises(UserError, match="does not exist"):
        write_movie(tmp_path / "nowhere" / "cat.mp4", [1], 24.0, picture, quiet)
