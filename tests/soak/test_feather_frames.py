"""240 frames of a bird that flaps: no frame reads another, shuffled is serial, and memory stays flat."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import numpy as np
import pytest

from app.deliver import posed_document
from app.feather_frames import export_frame
from core.document import Document
from core.evaluator import Evaluator
from core.feather.coat.dress import Dressed, dress_feathers
from core.feather.coat.export import added_at_rest
from core.feather.coat.plumage import Plumage
from core.formats.rig_file import document_of, read_rig

FRAMES, COUNT = 240, 1000
PARROT = Path(os.environ.get("FILOPLUME_DATA", "")) / "animation/bird_morph_parrot/Parrot.glb"


class Baker:
    """What one process of a farm holds."""

    def __init__(self, document: Document, dressed: Dressed, evaluator: Evaluator) -> None:
        self.document, self.dressed, self.evaluator = document, dressed, evaluator
        self.item, self.plumage = document.meshes[0], Plumage(evaluator)
        self.start = float(document.first_frame)
        rest = self.plumage.at_rest(dressed.coat, dressed.keys, self.item.mesh, self.start)
        self.added = added_at_rest(rest, evaluator.workers)

    def frame(self, frame: float) -> str:
        """A digest of all that is written of a frame."""
        skin = posed_document(self.document, frame, self.evaluator)[self.item.id]
        laid = self.plumage.at_frame(
            self.dressed.coat, self.dressed.keys, self.item.mesh, skin, frame, self.start)
        written, _ = export_frame(laid, self.dressed.coat, frame, "instances", self.evaluator, self.added)
        assert written.instances is not None
        return hashlib.sha256(written.instances.vanes.tobytes() + written.instances.turns.tobytes()).hexdigest()


def resident_megabytes() -> float:
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


@pytest.mark.skipif(not PARROT.is_file(), reason="FILOPLUME_DATA names no folder with the parrot")
@pytest.mark.timeout(900)
def test_frames_do_not_know_of_each_other() -> None:
    document, evaluator = document_of(read_rig(PARROT)), Evaluator()
    dressed = dress_feathers(document.meshes[0].mesh, evaluator, COUNT)
    # quarters of frames about a smooth motion, then on over the end of the clip
    frames = np.linspace(document.first_frame, document.last_frame + 4.0, FRAMES).tolist()
    one = Baker(document, dressed, evaluator)
    serial, memory = [], []
    for frame in frames:
        serial.append(one.frame(frame))
        memory.append(resident_megabytes())
    assert len(set(serial)) > 0.8 * FRAMES  # it does move
    assert max(memory[FRAMES // 4:]) - memory[FRAMES // 4] < 40.0, f"memory grows: {memory[::20]}"
    other = Baker(document, dressed, Evaluator())
    for k in np.random.default_rng(5).permutation(FRAMES):
        assert other.frame(frames[k]) == serial[k], f"frame {frames[k]} depends on those before it"
    other.evaluator.close()
    evaluator.close()
