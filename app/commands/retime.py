"""``filoplume retime``: a plate slower or faster, the frames in between made by optical flow."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray

from app.report import Report, peak_megabytes
from core.errors import UserError
from core.formats.atomic import atomic_write
from core.formats.frame_decoder import FrameDecoder
from core.formats.frame_file import check_frame_suffix, frame_path, write_frame
from core.formats.plate_file import PlateFrames, read_plate
from core.image.mix import mixed
from core.image.plate import ChannelMix
from core.match.retime import FlowPair, flow_pair, frame_between, frames_at_speed
from core.workers import Workers

MOST_FRAMES = 100_000


def command(
    plate: Annotated[str, typer.Argument(help="A folder of frames, a pattern like plate.####.exr, or a movie.", show_default=False)],
    output: Annotated[Path, typer.Option("--output", "-o", help="Where the frames go, as slow.####.png, .tif or .exr.", show_default=False)],
    speed: Annotated[float, typer.Option(min=0.01, max=100.0, help="0.5 is half as fast, twice as many frames.")] = 0.5,
    first: Annotated[int, typer.Option(help="Number of the first frame that is written.")] = 1,
    log: Annotated[bool, typer.Option("--log", help="Flow looks at stops of light; for linear frames.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Write a plate at another speed; frames that fall between two are made by the optical flow of both."""
    if not output.resolve().parent.is_dir():
        raise UserError(f"the folder {output.resolve().parent} does not exist; make it first")
    report = Report(as_json)
    workers, decoder = Workers(), FrameDecoder()
    written, warnings = [], []
    source: PlateFrames | None = None
    try:
        with report.working(total=2):
            with report.stage("read", "looking at the plate"):
                film = read_plate(plate, decoder)
                places = frames_at_speed(film.first, film.last, speed)
                if len(places) > MOST_FRAMES:
                    raise UserError(f"that makes {len(places)} frames; choose a higher speed, for at most {MOST_FRAMES}")
                source, mix = PlateFrames(film, decoder), ChannelMix(log=log)
            with report.stage("write", "making frames"):
                pair: tuple[int, FlowPair] | None = None
                for number, place in enumerate(places):
                    report.words(f"frame {first + number}, {place:.2f} of the plate")
                    at = int(np.floor(place))
                    here, there = source.get(at), source.get(at + 1) if place > at else None
                    if here is None or (place > at and there is None):
                        warnings.append(f"frame {first + number} is left out: frame {at if here is None else at + 1} "
                                        "of the plate is missing or broken")
                        continue
                    pixels: NDArray[Any] = here
                    if there is not None:
                        if here.shape != there.shape:
                            raise UserError(f"frames {at} and {at + 1} differ in size; there is nothing between them")
                        if pair is None or pair[0] != at:
                            pair = at, flow_pair(mixed(here, mix), mixed(there, mix), workers.ranges)
                        pixels = frame_between(here, there, pair[1], place - at)
                    check_frame_suffix(output.suffix, pixels.dtype)
                    target = frame_path(output, first + number)
                    with atomic_write(target) as beside:
                        write_frame(beside, pixels.reshape(*pixels.shape[:2], -1), output.suffix)
                    written.append(str(target))
    finally:
        if source is not None:
            source.close()
        decoder.close()
        workers.close()
    if not written:
        raise UserError("no frame was written: " + (warnings[0] if warnings else "the plate has none"))
    for words in warnings:
        report.note(words)
    result = {
        "frames": len(written), "of": len(film.frames), "speed": speed, "seconds": report.seconds, "outputs": written,
        "warnings": warnings, "peak_mb": peak_megabytes(),
    }
    report.done(result, [f"{len(written)} frames of {len(film.frames)}", written[0]])
