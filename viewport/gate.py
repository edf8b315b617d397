"""The film gate over a picture: dark outside, a thin line around, and the areas that every screen shows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from core.camera import Camera
from core.gate import Box, gate_box, safe_boxes
from core.overlay import Fill, Label, Overlay, Overlays, Polyline
from core.workspace import ViewOptions

OUTSIDE = 0.6  # opacity of the dark
MOST = 1e5  # pixels: what is farther off is not seen


def gate_marks(options: ViewOptions, camera: Camera, size: tuple[int, int], ratio: float = 1.0) -> Overlays:
    """Marks of the gate of a view; none when it has none or hides it. ratio : device pixels for a logical one."""
    gate = options.gate
    box = None if gate is None or not options.gate_shown else gate_box(gate, camera, *size)
    if gate is None or box is None:
        return ()
    left, top, right, bottom = (float(np.clip(edge, -MOST, MOST)) for edge in box)
    width, height = size[0] - 0.5, size[1] - 0.5
    marks: list[Overlay] = [
        Fill(x0, y0, x1, y1, OUTSIDE) for x0, y0, x1, y1 in (
            (-0.5, -0.5, width, top), (-0.5, bottom, width, height),
            (-0.5, max(top, -0.5), left, min(bottom, height)), (right, max(top, -0.5), width, min(bottom, height)))
        if x1 > x0 and y1 > y0]
    marks.append(Polyline(_outline(box), "plain", 1.0, closed=True))
    if options.safe_areas:
        marks += [Polyline(_outline(inner), "faint", 1.0, closed=True) for inner in safe_boxes(box)]
    marks.append(Label(left + 6.0 * ratio, bottom - 6.0 * ratio, f"{gate.aspect:.2f} : 1", "faint"))
    return tuple(marks)


def _outline(box: Box) -> NDArray[np.float64]:
    corners = [(box.left, box.top), (box.right, box.top), (box.right, box.bottom), (box.left, box.bottom)]
    return np.clip(corners, -MOST, MOST)
