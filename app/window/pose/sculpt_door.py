"""Sculpts of other programs into the window: read and fitted on another thread."""

from __future__ import annotations

from pathlib import Path

from app.window.desk import Desk
from core.document import Document
from tools.pose.actions import ACTIONS, scene_of


def import_sculpt(desk: Desk, path: Path) -> None:
    """Take the sculpt of a file for the pose that is shown; a job, for a large file takes seconds to read.

    Raises
    ------
    UserError
        There is no rig, or it is at rest; what is wrong with the file is said later.
    """
    session, action = desk.session, ACTIONS["import_sculpt"]
    told = {"file": str(path)}
    if session.recording is not None:  # a macro writes the action down
        session.act(action.name, **told)
        return
    document = session.history.current
    scene = scene_of(document, session.mesh.id, session.workspace.frame)
    arguments = action.arguments(scene, action.make(told))

    def done(made: Document) -> None:
        if desk.session is not session:
            return
        if session.history.current is document and not session.stroking:
            session.commit(action.step, made)
        else:  # something was done meanwhile: it is made again upon that
            desk.edit(action.step, action.edit, scene.item.id, *arguments)

    desk.jobs.start(
        f"Read {path.name}", lambda progress, cancelled: action.edit(document, scene.item.id, *arguments), done)
