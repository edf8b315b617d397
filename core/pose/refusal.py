"""What a person is told when poses cannot be told apart, and which."""

from __future__ import annotations

from typing import Any, Literal

from numpy.typing import NDArray

from core.errors import UserError
from core.pose.pose import Pose

Reason = Literal["duplicate", "near-duplicate", "coplanar", "unsymmetric", "singular"]

_SENTENCES: dict[str, str] = {
    "duplicate": "The poses {names} are one and the same to this pose space; "
                 "merge them, delete all but one, or move the controls it reads",
    "near-duplicate": "The poses {names} are nearly the same to this pose space; "
                      "merge them, delete all but one, or move them apart",
    "coplanar": "The poses {names} lie in one plane of this pose space, which its affine part cannot use; "
                "move one out of the plane, delete a control, or choose a Gaussian",
    "unsymmetric": "The falloffs of the poses {names} are too unlike to be solved together; "
                   "bring them closer to each other, or merge, delete or move a pose",
    "singular": "The poses {names} cannot be told apart with falloffs so wide; "
                "narrow the falloffs, or merge, delete or move a pose",
}


class Refusal(UserError):
    """A pose space that cannot be solved.

    poses : the names of the guilty ones, in the order of the space. reason : what they did.
    sculpt : the pose and the surface (V, 3), object space, that were to be added, so that they need not be lost.
    """

    sculpt: tuple[Pose, NDArray[Any]] | None = None

    @property
    def offers(self) -> tuple[str, ...]:
        """What may be done about it with the poses: "merge", "delete", "move"."""
        return ("move",) if self.reason == "coplanar" else ("merge", "delete", "move")

    def __init__(self, reason: Reason, poses: tuple[str, ...], detail: str = "") -> None:
        self.reason, self.poses = reason, tuple(dict.fromkeys(poses))
        quoted = [repr(p) for p in self.poses]
        names = quoted[0] if len(quoted) == 1 else ", ".join(quoted[:-1]) + " and " + quoted[-1]
        sentence = _SENTENCES[reason].format(names=names)
        super().__init__(f"{sentence} ({detail})." if detail else f"{sentence}.")
