"""A real context through EGL for every test of the viewport, and pictures as plain arrays."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import moderngl
import numpy as np
import pytest

from core.camera import Camera
from core.errors import UserError
from viewport.context import end, standalone_context
from viewport.renderer import Renderer
from viewport.scene import Scene


@pytest.fixture
def ctx() -> Iterator[moderngl.Context]:
    try:
        context = standalone_context()
    except UserError as error:
        pytest.skip(str(error))
    yield context
    end(context)


@pytest.fixture
def draw(ctx: moderngl.Context) -> Iterator[Callable[..., np.ndarray]]:
    """draw(scene, camera, width, height) -> (height, width, 4) float samples before the tone curve, top row first."""
    renderer = Renderer(ctx, shadow_side=512)

    def call(scene: Scene, camera: Camera, width: int, height: int) -> np.ndarray:
        color = ctx.renderbuffer((width, height), 3)
        target = ctx.framebuffer([color])
        renderer.draw(scene, camera, target, (width, height))
        target.release()
        color.release()
        assert renderer.tile is not None
        wide, high = renderer.tile.light.size
        raw = np.frombuffer(renderer.tile.light.read(), np.float16).astype(np.float64)
        return raw.reshape(high, wide, 4)[:height, :width][::-1]

    yield call
    renderer.release()
