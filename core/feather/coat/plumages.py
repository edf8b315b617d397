"""The coats of a document as they lie, shared by who shows them and by a hand that picks a feather."""

from __future__ import annotations

from collections.abc import Collection
from threading import Lock
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from core.evaluator import Evaluator
from core.feather.coat.coat import FeatherCoat
from core.groom.groom import Groom
from core.mesh.mesh import Mesh
from core.mesh.skin import Skin

if TYPE_CHECKING:  # its kernels load with the first coat, a window starts without them
    from core.feather.coat.layering import Crossings
    from core.feather.coat.plumage import Plumage
    from core.feather.coat.winged import Laid


class Lying(NamedTuple):
    """A coat as it lies, and what it was laid for.

    rest : without what is animated; laid : on `skin` at `frame`. rest_frames, frames : (N, 3, 3) float32, of the roots,
    rows right, along, out, at rest and there: what proxies are kept in. left : what crosses still in `laid`.
    """

    coat: FeatherCoat
    keys: Groom | None
    mesh: Mesh
    points: NDArray[np.float32]
    frame: float
    rest: Laid
    laid: Laid
    rest_frames: NDArray[np.float32]
    frames: NDArray[np.float32]
    left: Crossings


class Plumages:
    """One :class:`Plumage` for every coat, used by one thread at a time, and how it lay last.

    evaluator : whose threads and memory are used.
    """

    def __init__(self, evaluator: Evaluator) -> None:
        self._evaluator = evaluator
        self._kept: dict[int, tuple[Lock, Plumage]] = {}
        self._last: dict[int, Lying] = {}
        self._lock = Lock()

    def follow(self, ids: Collection[int]) -> None:
        """Forget all coats but those of these ids."""
        with self._lock:
            self._kept = {k: kept for k, kept in self._kept.items() if k in ids}
            self._last = {k: lying for k, lying in self._last.items() if k in ids}

    def lay(
        self, coat: FeatherCoat, keys: Groom | None, mesh: Mesh, skin: Skin, frame: float, rest_frame: float
    ) -> Lying:
        """The coat on `skin`, the mesh as posed at `frame`; see :meth:`Plumage.at_frame`. Called on any thread."""
        from core.feather.coat.layering import crossings
        from core.feather.coat.plumage import Plumage
        from core.feather.coat.wing import WING_IDS

        with self._lock:
            lock, plumage = self._kept.setdefault(coat.id, (Lock(), Plumage(self._evaluator)))
        with lock:
            rest = plumage.at_rest(coat, keys, mesh, rest_frame)
            laid = plumage.at_frame(coat, keys, mesh, skin, frame, rest_frame)
            frames = plumage.root_frames(coat, keys, mesh)
            posed = frames if skin.points is mesh.points else plumage.root_frames(coat, keys, mesh, skin)
            left = crossings(laid.layered, skin.bvh, self._evaluator.workers)
            left = left._replace(skin=left.skin[laid.ids[left.skin] < WING_IDS])  # quills of wings stand in the skin
        lying = Lying(coat, keys, mesh, skin.points, frame, rest, laid, frames, posed, left)
        with self._lock:
            if coat.id in self._kept:
                self._last[coat.id] = lying
        return lying

    def last(self, coat_id: int) -> Lying | None:
        """How a coat lay when it was last laid, be it on another skin or with other keys; None before that."""
        return self._last.get(coat_id)

    def known(
        self, coat: FeatherCoat, keys: Groom | None, mesh: Mesh, points: NDArray[np.float32], frame: float
    ) -> Lying | None:
        """How this very coat lies on a skin of these points (V, 3); None while it was not laid so."""
        lying = self._last.get(coat.id)
        if lying is None or lying.coat is not coat or lying.keys is not keys or lying.mesh is not mesh:
            return None
        from core.feather.coat.plumage import moving

        by_itself = bool(coat.proxies) or moving(coat)
        same = lying.points is points or np.array_equal(lying.points, points)
        return lying if same and (lying.frame == frame or not by_itself) else None
