"""Draws the views that are compared with kept ones: ``python -m tests.window.take_pictures FOLDER``.

Every view is one of the real window on the demo animal, taken at the scale of the screen (QT_SCALE_FACTOR) and reduced
to half of the window's logical size, so that a kept picture is small and no driver's rounding matters.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PySide6.QtGui import QImage

from app.window.main import fresh_workspace
from app.window.screenshot import view_image, window_image
from core.demo import demo_document
from core.document import Document
from core.evaluator import Evaluator
from core.workspace import ViewOptions
from tests.window.alone import hand_at
from tests.window.hand import Hand

SIZE = (860, 560)  # fits the screen of the tests at twice the scale, too
HAIRS, GUIDES = 12_000, 500
BARE = {"hair": False, "hud": False, "axes": False, "grid": False}
COATED = BARE | {"hair": True}
FIGURES = (57, 92)  # rows of the view in which milliseconds and the name of the driver stand

# what ViewOptions differ in, by the name of the view
OPTIONS: dict[str, dict[str, Any]] = {
    "shaded": BARE,
    "wire": BARE | {"shading": "wire"},
    "clay": BARE | {"shading": "matcap"},
    "lines": BARE | {"shading": "lines"},
    "map": BARE | {"map": "density"},
    "ghost": BARE | {"guides": True, "ghosted": (1,)},
    "coat": COATED,
    "guides": COATED | {"guides": True},
    "overlays": COATED | {"hud": True, "axes": True, "grid": True},
}


def take(save: Callable[[str, QImage], object]) -> None:
    """Draw every view and hand it over by its name."""
    evaluator = Evaluator()
    document = with_states(demo_document(evaluator, hairs=HAIRS, guides=GUIDES))
    evaluator.close()
    hand = hand_at(document, SIZE, managed=False)
    desk = hand.window.desk
    desk.set_workspace(view=ViewOptions(guides=False).replace(**BARE))  # nothing is drawn that no picture shows
    for command in ("view.three_quarter", "view.frame_all"):
        hand.window.commands.run(command)
        hand.rest()
    start = desk.workspace.cameras
    for name, options in OPTIONS.items():
        desk.set_workspace(view=ViewOptions(guides=False).replace(**options))
        if name == "overlays":
            hand.move((0.5, 0.5))
        hand.finish()
        save(name, view_image(hand.view))
    desk.set_workspace(view=ViewOptions(guides=False).replace(**COATED | {"grid": True}))
    hand.window.commands.run("view.right")
    hand.window.commands.run("view.projection")
    _settled(hand, "ortho", save)
    desk.set_workspace(cameras=start, frame=1024.0)
    _settled(hand, "posed", save)
    desk.set_workspace(frame=1001.0, view=fresh_workspace().view.replace(hud=False))
    hand.finish()
    for theme in ("light", "dark"):
        hand.window.change_settings(theme=theme)
        hand.finish()
        save(f"window-{theme}", window_image(hand.window))
    hand.window.close_unasked()


def with_states(document: Document) -> Document:
    """The document with some guides selected, some frozen, some sprayed: along the animal from nose to tail."""
    groom = document.grooms[0]
    along = groom.guides.points[:, 0, 2].argsort().argsort() / len(groom.guides)
    hold = np.where(((along > 0.5) & (along < 0.6))[:, None], np.float32(1.0), np.float32(0.0))
    guides = groom.guides.replace(
        frozen=(along > 0.2) & (along < 0.3), hold=np.broadcast_to(hold, groom.guides.hold.shape).astype(np.float32))
    return document.replace(grooms=(groom.replace(guides=guides),))


def reduced(image: QImage, side: float = 0.5) -> NDArray[np.uint8]:
    """(H, W, 3) uint8 BGR at a share of the logical size."""
    image = image.convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.bytesPerLine())
    pixels = rows[:, : 3 * image.width()].reshape(image.height(), image.width(), 3)[:, :, ::-1]
    ratio = side / image.devicePixelRatio()
    size = round(image.width() * ratio), round(image.height() * ratio)
    return np.asarray(cv2.resize(pixels, size, interpolation=cv2.INTER_AREA), np.uint8)


def _settled(hand: Hand, name: str, save: Callable[[str, QImage], object]) -> None:
    hand.finish()
    save(name, view_image(hand.view))


def main(folder: Path) -> None:
    """Write the views as PNG."""
    folder.mkdir(parents=True, exist_ok=True)

    def save(name: str, image: QImage) -> None:
        pixels = reduced(image)
        if name == "overlays":
            pixels[FIGURES[0] // 2 : FIGURES[1] // 2, :120] = 0
        pixels &= 0xFC  # a quarter smaller files, and a difference of three is none
        cv2.imwrite(str(folder / f"{name}.png"), pixels, [cv2.IMWRITE_PNG_COMPRESSION, 9])

    take(save)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
