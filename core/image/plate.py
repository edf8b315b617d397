"""Plates: what a camera filmed, named by a document and never changed by it."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from core.field import field
from core.record import Record, number, text

FRAMES = (-(2**31), 2**31 - 1)
MOST_SIDE = 1 << 16


class FilmBack(NamedTuple):
    """Width and height in millimetres of what the light fell on."""

    width: float
    height: float


class ChannelMix(Record):
    """What tracking and flow see of a plate. The plate itself stays as it is."""

    channels: Annotated[
        str,
        field(
            "Channels",
            "All three colours each with its own gain and bias, or one grey made of them.",
            choices=("rgb", "grey"),
        ),
    ] = "rgb"
    red: Annotated[float, field("Red", "Part of red in the grey.", soft=(0.0, 1.0), hard=(-4.0, 4.0), step=0.05)] = (
        0.2126
    )
    green: Annotated[
        float, field("Green", "Part of green in the grey.", soft=(0.0, 1.0), hard=(-4.0, 4.0), step=0.05)
    ] = 0.7152
    blue: Annotated[float, field("Blue", "Part of blue in the grey.", soft=(0.0, 1.0), hard=(-4.0, 4.0), step=0.05)] = (
        0.0722
    )
    log: Annotated[
        bool, field("Logarithmic", "Looks at stops of light instead of light; for linear and dark plates.")
    ] = False
    denoise: Annotated[
        float,
        field(
            "Denoise",
            "Standard deviation of the Gauss that takes out grain before looking.",
            "px",
            soft=(0.0, 3.0),
            hard=(0.0, 10.0),
            step=0.1,
        ),
    ] = 0.0
    contrast: Annotated[
        float,
        field(
            "Local contrast",
            "Side of the neighbourhood whose mean and spread are evened out, for dark plates; 0 leaves them.",
            "px",
            soft=(0.0, 200.0),
            hard=(0.0, 2000.0),
            step=1.0,
        ),
    ] = 0.0

    def __post_init__(self) -> None:
        if self.channels not in ("rgb", "grey"):
            raise ValueError(f"ChannelMix.channels must be rgb or grey, not {self.channels!r}")
        number(self, "red", "green", "blue", least=-4.0, most=4.0)
        number(self, "denoise", least=0.0, most=10.0)
        number(self, "contrast", least=0.0, most=2000.0)


class Plate(Record):
    """A numbered sequence of pictures, one still, or a movie.

    id : stable, unique among the plates of a document.
    path : relative to the document where it can be, with forward slashes; #### stands for the number of the frame.
    digest : SHA-256 of the first frame's file (of a movie's first megabyte and its length), to find it again.
    first, last : as the files count; a movie begins at 1.
    offset : added to the number of a file to give the frame of the document, so plates are brought in step.
    missing : numbers between first and last that have no file.
    width, height : of every frame, before the crop. crop : left, top, right, bottom pixels that are left out.
    pixel_aspect : width of a pixel over its height.
    film_back : of the whole frame, or None while nobody knows; focal_mm alike.
    color_space : name in the configuration of OpenColorIO, empty for that of the file's kind.
    """

    id: int
    name: str
    path: str
    first: int
    last: int
    width: int
    height: int
    digest: str = ""
    offset: int = 0
    fps: float = 24.0
    missing: tuple[int, ...] = ()
    crop: tuple[int, int, int, int] = (0, 0, 0, 0)
    pixel_aspect: float = 1.0
    film_back: FilmBack | None = None
    focal_mm: float | None = None
    color_space: str = ""
    mix: ChannelMix = ChannelMix()
    movie: bool = False
    hidden: bool = False
    locked: bool = False

    def __post_init__(self) -> None:
        text(self, "name")
        text(self, "path", longest=4096)
        number(self, "id", least=0, most=2**31 - 1)
        number(self, "first", "last", "offset", least=FRAMES[0], most=FRAMES[1])
        number(self, "width", "height", least=1, most=MOST_SIDE)
        number(self, "fps", least=0.001, most=100_000.0)
        number(self, "pixel_aspect", least=0.01, most=100.0)
        number(self, "crop", least=0, most=MOST_SIDE)
        if self.first > self.last:
            raise ValueError("Plate.first comes after last")
        left, top, right, bottom = self.crop
        if left + right >= self.width or top + bottom >= self.height:
            raise ValueError("Plate.crop leaves nothing of the frame")
        if self.film_back is not None and not all(0.01 <= side <= 10_000.0 for side in self.film_back):
            raise ValueError("Plate.film_back must be two lengths of 0.01 to 10000 mm")
        if self.focal_mm is not None:
            number(self, "focal_mm", least=0.01, most=100_000.0)

    @property
    def frames(self) -> range:
        """Numbers of the files, first to last, missing ones among them."""
        return range(self.first, self.last + 1)


def frame_name(pattern: str, frame: int) -> str:
    """The path with the #s replaced by the number of the frame; a minus stands before the digits."""
    start = pattern.find("#")
    if start < 0:
        return pattern
    digits = len(pattern[start:]) - len(pattern[start:].lstrip("#"))
    return f"{pattern[:start]}{'-' if frame < 0 else ''}{abs(frame):0{digits}d}{pattern[start + digits :]}"
