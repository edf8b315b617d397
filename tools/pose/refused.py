"""What becomes of a sculpt that a pose space refused: it joins the sculpt it cannot be told from, or replaces it, or
goes to a pose of its own. Pure functions for ``Session.edit`` and for scripts.
"""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from core.document import Document
from core.pose.pose import Pose
from core.pose.synthesis import evaluate
from tools.pose_edits import Twins, add_sculpt, rigged, sculpt_name


def keep_refused(document: Document, mesh_id: int, pose: Pose, surface: NDArray[Any], twins: Twins) -> Document:
    """The document with a sculpt that was refused at a pose; its twins are averaged with it, or deleted for it.

    Parameters
    ----------
    surface : (V, 3), object space, as it was sculpted.
    """
    return add_sculpt(document, mesh_id, pose, surface, twins=twins)


def move_refused(document: Document, mesh_id: int, pose: Pose, surface: NDArray[Any], to: Pose) -> Document:
    """The document with a sculpt that was refused at `pose` made at the pose `to` instead, lifted off the skin alike.

    Raises
    ------
    Refusal
        There it cannot be told apart either.
    """
    item, rig = rigged(document, mesh_id)
    points = item.mesh.points
    moved = surface - evaluate(points, rig, None, pose) + evaluate(points, rig, None, to)
    return add_sculpt(document, mesh_id, to.replace(name=sculpt_name(item.correctives, to.replace(name=pose.name))),
                      moved)
