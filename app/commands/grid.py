"""``filoplume grid``: a lens from photographs of a chessboard."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
import typer

from app.report import Report, peak_megabytes
from core.errors import UserError
from core.formats.atomic import atomic_write
from core.formats.frame_decoder import FrameDecoder
from core.formats.lens_file import WRITTEN, write_lens
from core.image.mix import to_float
from core.match.lens import MODELS, coefficients
from core.match.solve.grid import calibrate, chessboard_corners

LENSES = tuple(model.name for model in MODELS)


def command(
    photographs: Annotated[list[Path], typer.Argument(help="Photographs of a chessboard, taken with the lens.", show_default=False)],
    grid: Annotated[str, typer.Option(help="Inner corners of the board across and down, as 9x6.")],
    lens: Annotated[str, typer.Option(help="Which lens is found: brown, brown5, fisheye, or of 3DEqualizer radial4 and anamorphic4.")] = "brown",
    output: Annotated[list[Path] | None, typer.Option("-o", "--output", help="Where the lens goes: .json, or .txt of 3DEqualizer; more than one may be given.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Find how a lens bends from photographs of a chessboard, for solve --lens-file and stmap."""
    from app.commands.solve import plate_size

    if lens not in LENSES:
        raise typer.BadParameter(f"choose one of {', '.join(LENSES)}", param_hint="--lens")
    board = plate_size(grid) or (0, 0)
    if min(board) < 3:
        raise UserError("--grid counts the inner corners, three or more each way, as 9x6")
    for path in output or ():
        if path.suffix.lower() not in WRITTEN:
            raise UserError(f"{path.name}: a lens is written as {', '.join(WRITTEN)}")
    telling, decoder = Report(as_json), FrameDecoder()
    seen, names, missing = [], [], []
    size: tuple[int, int] | None = None
    try:
        with telling.working(total=3):
            with telling.stage("corners", "finding the board"):
                for path in photographs:
                    grey = _grey(decoder, path)
                    if size is not None and grey.shape[::-1] != size:
                        raise UserError(f"{path.name} has another size than the photographs before it.")
                    size = (grey.shape[1], grey.shape[0])
                    corners = chessboard_corners(grey, board)
                    if corners is None:
                        missing.append(path.name)
                    else:
                        seen.append(corners)
                        names.append(path.name)
            assert size is not None
            with telling.stage("solve", "finding the lens"):
                found = calibrate(seen, board, size, lens)
            with telling.stage("write", "writing"):
                for path in output or ():
                    with atomic_write(path) as beside:
                        write_lens(beside, found.lens, size, path.suffix)
    finally:
        decoder.close()
    warnings = [f"{name}: the board was not found" for name in missing]
    for words in warnings:
        telling.note(words)
    focal = float(np.exp(found.lens[0]))
    telling.done({
        "size": list(size), "photographs": len(seen), "lens": {"model": lens, **coefficients(found.lens)},
        "focal_px": focal, "focal_sigma_px": found.focal_sigma, "centre": found.lens[4:6].tolist(),
        "centre_sigma_px": found.centre_sigma, "rms_px": found.rms,
        "errors": dict(zip(names, found.errors.tolist(), strict=True)), "warnings": warnings,
        "outputs": [str(path) for path in output or ()], "seconds": telling.seconds, "peak_mb": peak_megabytes(),
    }, [
        f"{lens} of {len(seen)} photographs: RMS {found.rms:.3f} px, focal length {focal:.1f} +- {found.focal_sigma:.1f} "
        f"px, centre {found.lens[4]:.1f}, {found.lens[5]:.1f} +- {found.centre_sigma:.1f} px",
        *(str(path) for path in output or ()),
    ])


def _grey(decoder: FrameDecoder, path: Path) -> np.ndarray:
    """(H, W) uint8 of a photograph."""
    pixels = to_float(decoder.decode(path)[0])
    if pixels.ndim == 3:
        pixels = pixels[:, :, 0] if pixels.shape[2] < 3 else cv2.cvtColor(
            np.ascontiguousarray(pixels[:, :, :3], np.float32), cv2.COLOR_RGB2GRAY)
    return np.ascontiguousarray(np.rint(np.clip(pixels, 0.0, 1.0) * 255.0), np.uint8)
