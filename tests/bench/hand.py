"""The hand: what a preview of a stroke costs beyond the comb itself, and what moving the pointer costs at rest."""

from __future__ import annotations

import time

import numpy as np

import tools.groom.comb as comb_tool
from app.window.memory import keep_freed_memory
from core.camera import frame_points
from core.demo import demo_document
from core.evaluator import Evaluator
from tests.bench.bench import Row
from tools.ground import Pointer, Sight
from tools.session import Session

TITLE = "Hand"
GUIDES = 20_000
WAY = tuple(Pointer(600.0 + 8.0 * i, 450.0 + 3.0 * i, time=0.01 * i) for i in range(40))


def run() -> list[Row]:
    keep_freed_memory()  # as the window does
    evaluator = Evaluator()
    document = demo_document(evaluator, hairs=1000, guides=GUIDES)
    sight = Sight(frame_points(document.meshes[0].mesh.points, aspect=1.6), 1600, 1000)
    session = Session(document, evaluator=evaluator)
    rows = []
    kernel, spent = comb_tool.comb, [0.0]

    def timed(*args, **more):  # type: ignore[no-untyped-def]
        start = time.perf_counter()
        out = kernel(*args, **more)
        spent[0] = time.perf_counter() - start
        return out

    comb_tool.comb = timed
    try:
        for frame, words in ((1001.0, "at rest"), (1013.0, "in a pose")):
            session.set_workspace(frame=frame)
            session.hand.press(sight, WAY[0])
            beyond = []
            for pointer in WAY[1:]:
                start = time.perf_counter()
                session.hand.move((pointer,))
                beyond.append(time.perf_counter() - start - spent[0])
            session.hand.cancel()
            what = f"preview beyond the comb's kernel, {GUIDES:,} guides, {words}"
            rows.append(Row(what, 1e3 * float(np.median(beyond)), "ms", 1.0))
            session.hand.hover(sight, WAY[0])
            start = time.perf_counter()
            for pointer in WAY:
                session.hand.hover(sight, pointer)
            each = 1e3 * (time.perf_counter() - start) / len(WAY)
            rows.append(Row(f"moving the pointer, {GUIDES:,} guides, {words}", each, "ms", 1.0))
    finally:
        comb_tool.comb = kernel
        session.close(discard=True)
        evaluator.close()
    return rows
