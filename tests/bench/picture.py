"""The picture of a coat, drawn with the OpenGL there is (Mesa in software on machines without a card)."""

from __future__ import annotations

import time

import numpy as np

from core.camera import frame_points
from tests.bench.bench import Row
from tests.viewport.scenes import ball
from viewport.context import temporary_context
from viewport.picture import render
from viewport.renderer import Renderer
from viewport.scene import Coat, Look, Scene

TITLE = "Picture of a coat"
HAIRS = 120_000


def run() -> list[Row]:
    """Rows of the table: a whole picture, and the parts of a second one with known buffers."""
    skin, straight = ball(HAIRS, length=0.25)
    points = np.repeat(straight.points[:, :, :1], 16, axis=2)  # curved hairs of 16 points from the straight ones of 8
    u = np.linspace(0.0, 1.0, 16, dtype=np.float32)
    points += (straight.points[:, :, -1:] - straight.points[:, :, :1]) * u
    points[:, 1] -= 0.1 * u * u
    coat = Coat(points, straight.ids, straight.normals, Look(root_width=0.004, tip_width=0.0005))
    scene = Scene(surfaces=(skin,), coats=(coat,))
    camera = frame_points(skin.points, aspect=1.6)
    whole = []
    for _ in range(3):
        start = time.perf_counter()
        render(scene, camera, 1600, 1000, 2)
        whole.append(time.perf_counter() - start)
    with temporary_context() as ctx:
        color = ctx.renderbuffer((1600, 1000), 3)
        target = ctx.framebuffer([color])
        renderer = Renderer(ctx)
        again = []
        for _ in range(4):
            start = time.perf_counter()
            renderer.draw(scene, camera, target, (1600, 1000), 1)
            ctx.finish()
            again.append(time.perf_counter() - start)
        driver = str(ctx.info["GL_RENDERER"])
        for thing in (renderer, target, color):
            thing.release()
    return [
        Row(f"{HAIRS:,} hairs x 16, 1600x1000, 4 samples a pixel, context included ({driver})", min(whole), "s", 10.0),
        Row(f"{HAIRS:,} hairs x 16, 1600x1000, 1 sample, buffers known", min(again[1:]), "s"),
    ]
