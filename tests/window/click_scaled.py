"""Clicks on single hairs at the scale of the screen: ``python -m tests.window.click_scaled`` ends with 1 when one is
missed. A process of its own, because a scale (QT_SCALE_FACTOR) is for a whole process.
"""

from __future__ import annotations

import sys

import numpy as np

from core.camera import project
from core.demo import demo_document
from core.evaluator import Evaluator
from tests.window.alone import hand_at

SIZE = (860, 560)  # fits the screen of the tests at twice the scale, too
RADIUS = 6.0  # pixels of the framebuffer


def missed() -> list[str]:
    """What went wrong: clicks with a small brush on the tips of guides must select these, at any scale."""
    evaluator = Evaluator()
    document = demo_document(evaluator, hairs=2000, guides=300)
    evaluator.close()
    hand = hand_at(document, SIZE)
    window, view, desk = hand.window, hand.view, hand.window.desk
    window.commands.run("view.right")
    hand.rest()
    window.commands.run("view.frame_all")
    hand.rest()
    ratio = view.devicePixelRatio()
    image = view.grabFramebuffer()
    wrong = [] if view.pixels() == (image.width(), image.height()) else ["size"]
    desk.choose("select", size=RADIUS, through=True)
    guides = desk.document.grooms[0].guides
    camera = desk.workspace.cameras[0]
    pixels = project(camera, guides.points, *view.pixels()).xy
    apart = np.linalg.norm(pixels[:, None, -1] - pixels[None, :, -1], axis=2) + 1e9 * np.eye(len(pixels))
    alone = np.argsort(-apart.min(axis=1))[:5]  # what is under the pointer is then not to be mistaken
    for row in alone:
        window.commands.run("groom.select_none")
        tip = (pixels[row, -1] + 0.5) / view.pixels()
        hand.move((float(tip[0]), float(tip[1])))
        hand.press((float(tip[0]), float(tip[1])))
        hand.painted()
        hand.release((float(tip[0]), float(tip[1])))
        selected = desk.document.grooms[0].guides.selected
        closest = np.linalg.norm(pixels[selected] - pixels[row, -1], axis=2).min(axis=1) if selected.any() else []
        if not selected[row] or not np.all(np.asarray(closest) < RADIUS + 2 * ratio):
            wrong.append(f"guide {row} at {tip}: {np.flatnonzero(selected)}")
    if apart.min(axis=1)[alone].min() < RADIUS:
        wrong.append("too few hairs stand alone")
    window.close_unasked()
    return wrong


if __name__ == "__main__":
    found = missed()
    print("\n".join(found), file=sys.stderr)
    sys.exit(bool(found))
