"""What a timeline shows of a document: which frames are keyed, and how far clips reach."""

from __future__ import annotations

from core.curve import Curve
from core.document import Document
from core.groom.groom import COAT_VALUES
from core.posed import moves


def keyed_frames(document: Document) -> tuple[float, ...]:
    """Frames at which a number of any coat has a key, ascending, each once."""
    frames = {
        key.frame
        for groom in document.grooms for name in COAT_VALUES
        if isinstance(base := getattr(groom.coat, name).base, Curve) for key in base.keys
    }
    return tuple(sorted(frames))


def clip_range(document: Document) -> tuple[float, float] | None:
    """First and last frame at which the clip of any mesh has a sample; None when nothing moves."""
    clips = [item.rig.clip for item in document.meshes if moves(item) and item.rig is not None]
    found = [(clip.start, clip.end) for clip in clips if clip is not None]
    return (min(a for a, _ in found), max(b for _, b in found)) if found else None
