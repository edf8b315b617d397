"""``filoplume flow``: where the pixels of one frame went in another, and how sure that is."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from app.report import Report, peak_megabytes
from core.errors import UserError
from core.formats.atomic import atomic_write
from core.formats.flow_file import SUFFIXES, write_flow
from core.formats.frame_decoder import FrameDecoder
from core.image.mix import mixed
from core.image.plate import ChannelMix
from core.match.flow import LEAST_SIDE, flow_between
from core.workers import Workers


def command(
    first: Annotated[Path, typer.Argument(help="The frame that is moved.", show_default=False)],
    second: Annotated[Path, typer.Argument(help="The frame its pixels went to.", show_default=False)],
    output: Annotated[Path, typer.Option("--output", "-o", help="Where it goes: .flo or .exr.", show_default=False)],
    spacing: Annotated[int, typer.Option(min=4, max=64, help="Pixels between the vertices of the finest grid.")] = 8,
    log: Annotated[bool, typer.Option("--log", help="Look at stops of light; for linear frames.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Measure the optical flow between two frames of one size."""
    if output.suffix.lower() not in SUFFIXES:
        raise UserError(f"{output.name}: flow is written as {' or '.join(SUFFIXES)}; choose one of these suffixes")
    if not output.resolve().parent.is_dir():
        raise UserError(f"the folder {output.resolve().parent} does not exist; make it first")
    report = Report(as_json)
    workers, decoder = Workers(), FrameDecoder()
    try:
        with report.working(total=3):
            with report.stage("read", "reading"):
                mix = ChannelMix(log=log)
                a, b = (mixed(decoder.decode(path).pixels, mix) for path in (first, second))
            if a.shape != b.shape:
                sizes = " and ".join(f"{image.shape[1]} x {image.shape[0]} x {image.shape[2]}" for image in (a, b))
                raise UserError(f"the frames differ in size or channels: {sizes}; flow needs two alike")
            if min(a.shape[:2]) < LEAST_SIDE:
                raise UserError(f"the frames are smaller than {LEAST_SIDE} pixels; there is no flow to measure")
            with report.stage("flow", "measuring"):
                flow = flow_between(a, b, spacing=spacing, ranges=workers.ranges)
            with report.stage("write", "writing"), atomic_write(output) as beside:
                write_flow(beside, flow, output.suffix)
    finally:
        decoder.close()
        workers.close()
    length = np.linalg.norm(flow.vectors, axis=2)
    sigma = np.sqrt(np.maximum(flow.covariance[:, :, 0] + flow.covariance[:, :, 2], 0.0) / 2.0)
    result = {
        "size": [a.shape[1], a.shape[0]], "median_px": round(float(np.median(length)), 4),
        "largest_px": round(float(length.max()), 4), "median_sigma_px": round(float(np.median(sigma)), 4),
        "seconds": report.seconds, "outputs": [str(output)], "warnings": [], "peak_mb": peak_megabytes(),
    }
    report.done(result, [f"median {result['median_px']} px, largest {result['largest_px']} px", str(output)])
