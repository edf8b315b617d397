"""What is built on a model of photographs as a file: a mesh with UVs, and where wanted the photographs on it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from core.errors import UserError
from core.formats.atomic import atomic_write
from core.formats.frame_decoder import FrameDecoder
from core.formats.mesh_file import write_mesh
from core.formats.obj_material import add_material
from core.image.mix import to_float
from core.image.plate import Plate, frame_name
from core.match.photomodel.build import built
from core.match.photomodel.records import Photo, Photomodel
from core.match.photomodel.texture import textured


def write_model(
    output: Path, model: Photomodel, plates: Sequence[Plate], folder: Path, texture: int, decoder: FrameDecoder,
) -> list[str]:
    """Write the parts of a model as a mesh; the files that were written.

    folder : of the project, to which paths of plates are relative. texture : texels of a side, 0 for none.

    Raises
    ------
    UserError
        Nothing is built, a photograph cannot be read, or the suffix is of no mesh.
    """
    mesh = built(model)
    written = [str(output)]
    if texture:
        pictures = [_picture(photo, plates, folder, decoder) for photo in model.photos]
        done = textured(mesh, model.photos, pictures, texture)
        mesh = done.mesh
        image = output.with_suffix(".png")
        with atomic_write(image) as beside:
            coded = cv2.imencode(".png", np.rint(np.clip(done.picture[:, :, ::-1], 0, 1) * 255).astype(np.uint8))[1]
            beside.write_bytes(coded.tobytes())
        written.append(str(image))
    write_mesh(output, mesh)
    if texture and output.suffix.lower() == ".obj":
        written.append(str(add_material(output, output.with_suffix(".png").name)))
    return written


def _picture(photo: Photo, plates: Sequence[Plate], folder: Path, decoder: FrameDecoder) -> NDArray[np.float32]:
    plate = next((one for one in plates if one.id == photo.plate_id), None)
    if plate is None:
        raise UserError(f"The photograph {photo.name} names no file, so it cannot be projected.")
    pixels = to_float(decoder.decode(folder / frame_name(plate.path, photo.frame))[0])
    if pixels.ndim == 2:
        pixels = pixels[:, :, None]
    return np.ascontiguousarray(np.repeat(pixels, 3, axis=2) if pixels.shape[2] == 1 else pixels[:, :, :3])
