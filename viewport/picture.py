"""Pictures without a window."""

from __future__ import annotations

from pathlib import Path

import cv2
import moderngl
import numpy as np
from numpy.typing import NDArray

from core.camera import Camera
from core.errors import UserError
from core.formats.atomic import atomic_write
from viewport.context import temporary_context
from viewport.renderer import Progress, Renderer
from viewport.scene import Scene, thinned

LARGEST_PICTURE = 16384
MOST_HAIRS = 1_000_000  # of one coat in a picture; twenty for every pixel of the animal is enough


def render(
    scene: Scene, camera: Camera, width: int = 1600, height: int = 1000, samples: int = 2,
    progress: Progress | None = None, ctx: moderngl.Context | None = None,
) -> NDArray[np.uint8]:
    """Draw the scene and return it as (height, width, 3) uint8, sRGB, top row first.

    Of coats with more than MOST_HAIRS an even selection is drawn, wider.

    Parameters
    ----------
    samples : samples on a side of every pixel, 1 to 4; hairs are filtered in any case, 2 is a finished picture.
    progress : called with the done part 0 .. 1; an exception raised in it stops the drawing and is passed on.
    ctx : a context to draw in; by default one is made for this picture.

    Raises
    ------
    UserError
        When the size is impossible, or no OpenGL is found.
    """
    if not (1 <= width <= LARGEST_PICTURE and 1 <= height <= LARGEST_PICTURE and 1 <= samples <= 4):
        raise UserError(
            f"A picture of {width}x{height} with {samples} samples cannot be drawn; sides go from 1 to "
            f"{LARGEST_PICTURE}, samples from 1 to 4."
        )
    if ctx is None:
        with temporary_context() as own:
            return render(scene, camera, width, height, samples, progress, own)
    scene = scene._replace(coats=tuple(thinned(coat, MOST_HAIRS) for coat in scene.coats))
    color = ctx.renderbuffer((width, height), 3)
    target = ctx.framebuffer([color])
    renderer = Renderer(ctx)
    try:
        renderer.draw(scene, camera, target, (width, height), samples, progress)
        data = target.read(components=3, alignment=1)
    finally:
        renderer.release()
        target.release()
        color.release()
    return np.ascontiguousarray(np.frombuffer(data, np.uint8).reshape(height, width, 3)[::-1])


def render_png(
    path: str | Path, scene: Scene, camera: Camera, size: tuple[int, int] = (1600, 1000), samples: int = 2,
    progress: Progress | None = None,
) -> None:
    """Draw the scene into a PNG file (see :func:`render`).

    Raises
    ------
    UserError
        When the picture cannot be drawn or the file cannot be written.
    """
    image = render(scene, camera, size[0], size[1], samples, progress)
    write_png(path, image)


def write_png(path: str | Path, image: NDArray[np.uint8]) -> None:
    """Write (height, width, 3) uint8 sRGB as a PNG: beside the file first, then in its place.

    Raises
    ------
    UserError
        When the file cannot be written.
    """
    done, data = cv2.imencode(".png", cv2.cvtColor(image, cv2.COLOR_RGB2BGR))
    if not done:
        raise UserError(f"The picture for {path} could not be encoded; try another size.")
    with atomic_write(path) as beside:
        beside.write_bytes(data.tobytes())
