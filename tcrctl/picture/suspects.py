"""Which markers, rings or frame explain changes that a robot cannot make.

A marker that has moved changes the two sides that meet in it. A ring that has moved, or is tilted by one of its
markers, changes the joints above and below; a frame that has moved changes the first joint only, because the base
does not move with it. So whatever explains the worst change and most of those beside it is left out, and what is
left is looked at again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tcrctl.picture.shares import Shares
from tcrctl.robot.module import RING
from tcrctl.signals import Array

#: What a joint that nobody sees has changed by, as a share of the one beside it that has changed most.
UNSEEN: Final = 0.6
#: One marker has come loose if both sides that meet in it have changed, one by at least this share of the other ...
BOTH: Final = 0.4
#: ... and the third one by no more than this share of them.
ALONE: Final = 0.5
#: The first ring, not the frame, explains a change of the first joint if the second one's is this share of it; or a
#: smaller one, if it is beyond its limit, too.
NOT_THE_FRAME: Final = 0.7
NOR_ELSEWHERE: Final = 0.25
#: So many suspects are named.
NAMED: Final = 3
#: The frame of the cameras among the rings: that of the base.
FRAME: Final = 0


@dataclass(frozen=True, slots=True)
class Suspect:
    """Something that is not believed.

    Attributes:
        name: For people, ``ring 4``, ``marker m4.n2`` or ``the frame of the cameras``.
        why: What has changed by which share of its limit.
        ring: Number of the ring; FRAME for the frame.
    """

    name: str
    why: str
    ring: int

    def said(self, before: str = ": ") -> str:
        """Return what is not believed and why; ``before`` stands before the reason."""
        return f"{self.name} is not believed{before}{self.why}"


def named(suspects: Sequence[Suspect], before: str = ": ") -> list[str]:
    """Return the first suspects as in :meth:`Suspect.said`, and last how many more there are."""
    more = len(suspects) - NAMED
    return [
        *(suspect.said(before) for suspect in suspects[:NAMED]),
        *([f"and {more} more"] if more > 0 else ()),
    ]


@dataclass(slots=True)
class Verdict:
    """What is not believed of one frame.

    Attributes:
        out: Markers (3 n,).
        frame: The frame of the cameras itself.
        strange: Share of the joints that have changed by more than they can, of those that are seen.
        suspects: Why.
    """

    out: NDArray[np.bool_]
    frame: bool = False
    strange: float = 0.0
    suspects: list[Suspect] = field(default_factory=list)


def wrong_markers(verdict: Verdict, shares: Array, joints: Array) -> None:
    """Leave out markers whose ring has changed its size.

    Args:
        verdict: Is added to.
        shares: Changes of sides as shares of their limits (n, 3).
        joints: The largest change of every joint as a share of its limit (n,); 0 where nothing is known.
    """
    for ring in np.flatnonzero((shares > 1.0).any(axis=1)).tolist():
        node = None if _elsewhere(joints, ring, shares[ring].max()) else _loose_marker(shares[ring])
        out = [0, 1, 2] if node is None else [node]
        verdict.out[[RING * ring + i for i in out]] = True
        name = f"ring {ring + 1}" if node is None else f"marker m{ring + 1}.n{node + 1}"
        why = f"sides of ring {ring + 1} have changed by {shares[ring].max():.1f} times their limit"
        verdict.suspects.append(Suspect(name, why, ring + 1))


def _elsewhere(joints: Array, ring: int, size: float) -> bool:
    """Return whether a ring is not where it was, in all its joints, by more than a loose marker of it explains.

    A marker that changes a side by some millimetres moves the centre of its ring by fewer.
    """
    known = [joint for joint in joints[ring : ring + 2] if joint > 0.0]
    return bool(known) and min(known) > 1.0 + size


def _loose_marker(sides: Array) -> int | None:
    """Return which marker of a ring explains the changes of its sides (3,); None if not one of them alone does.

    One side that changes alone may be the fault of either of its ends.
    """
    apart = np.array([sides[1], sides[2], sides[0]])  # the side that does not meet in the marker
    node = int(np.argmin(apart))
    less, more = np.sort(np.delete(apart, node))
    alone = apart[node] < ALONE * less and less > BOTH * more and np.count_nonzero(sides) == RING
    return node if alone else None


def judge_joints(verdict: Verdict, worst: Array) -> None:
    """Say how many joints are strange: if most are, what is left when rings are left out agrees by chance."""
    seen = int(np.count_nonzero(worst > 0.0))
    verdict.strange = float(np.count_nonzero(worst > 1.0)) / max(1, seen)


def wrong_rings(verdict: Verdict, look: Callable[[NDArray[np.bool_]], Shares]) -> None:
    """Leave out rings, or the frame, until no joint has changed by more than it can.

    Args:
        verdict: Is added to.
        look: Returns the shares of all joints without the markers that are out.
    """
    for _ in range(verdict.out.size // RING + 1):
        shares = look(verdict.out)
        worst = shares.worst
        joint = int(np.argmax(worst))
        if worst[joint] <= 1.0:
            return
        ring = _culprit(worst, joint)
        why = f"{ring_name(joint + 1)} {_changed(shares, joint)} against {ring_name(joint)}"
        verdict.suspects.append(Suspect(ring_name(ring), why, ring))
        if ring == FRAME:
            verdict.frame, verdict.out[:] = True, True
            return
        verdict.out[RING * (ring - 1) : RING * ring] = True


def _culprit(worst: Array, joint: int) -> int:
    """Return which ring explains the worst change: the one whose other joint has changed more."""
    if joint == 0:
        second = float(worst[1]) if worst.size > 1 else 0.0
        needed = max(min(1.0, NOT_THE_FRAME * worst[0]), NOR_ELSEWHERE * worst[0])
        return 1 if second > needed else FRAME
    above, below = (_share(worst, j, UNSEEN * float(worst[joint])) for j in (joint - 1, joint + 1))
    return joint if above > below else joint + 1


def _share(worst: Array, joint: int, unseen: float) -> float:
    return float(worst[joint]) if 0 <= joint < worst.size and worst[joint] > 0.0 else unseen


def ring_name(number: int) -> str:
    """Return what a ring is called, FRAME among them."""
    return f"ring {number}" if number else "the frame of the cameras"


def _changed(shares: Shares, joint: int) -> str:
    """Say how a ring has changed against the one above it."""
    moved, turned = float(np.hypot(shares.sideways, shares.along)[joint]), float(shares.twist[joint])
    if turned > moved:
        return f"has turned by {turned:.1f} times its limit"
    way = "sideways" if shares.sideways[joint] > shares.along[joint] else "along the body"
    return f"has moved {way} by {moved:.1f} times its limit"
