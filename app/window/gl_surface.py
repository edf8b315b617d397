"""What is asked of OpenGL, and what is said when it cannot be had."""

from __future__ import annotations

import moderngl
from PySide6.QtGui import QOpenGLContext, QSurfaceFormat

NO_GL = "The view needs OpenGL 3.3, and this computer offers {found}. Install or update its graphics driver."


def surface_format() -> QSurfaceFormat:
    """OpenGL 3.3 core without samples: edges are smoothed at rest, which costs the hand nothing."""
    wanted = QSurfaceFormat()
    wanted.setRenderableType(QSurfaceFormat.RenderableType.OpenGL)
    wanted.setVersion(3, 3)
    wanted.setProfile(QSurfaceFormat.OpenGLContextProfile.CoreProfile)
    wanted.setDepthBufferSize(0)
    wanted.setStencilBufferSize(0)
    wanted.setSamples(0)
    wanted.setSwapInterval(0)
    return wanted


def no_gl(context: QOpenGLContext | None) -> str:
    """The sentence for a context that the view cannot be drawn with."""
    if context is None:
        return NO_GL.format(found="none")
    found = context.format()
    return NO_GL.format(found=f"{found.majorVersion()}.{found.minorVersion()}")


def driver_of(ctx: moderngl.Context) -> str:
    """What draws, shortly, and its version of OpenGL."""
    name = ctx.info["GL_RENDERER"].split(" (", maxsplit=1)[0].split("/", maxsplit=1)[0]
    return f"{name} · GL {ctx.version_code / 100:.1f}"
