"""What a timeline shows of a document: how far clips reach."""

from __future__ import annotations

from core.document import Document
from core.posed import moves


def clip_range(document: Document) -> tuple[float, float] | None:
    """First and last frame at which the clip of any mesh has a sample; None when nothing moves."""
    clips = [item.rig.clip for item in document.meshes if moves(item) and item.rig is not None]
    found = [(clip.start, clip.end) for clip in clips if clip is not None]
    return (min(a for a, _ in found), max(b for _, b in found)) if found else None
