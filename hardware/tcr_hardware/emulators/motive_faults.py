"""What can be wrong with an emulated camera system, as data that may change while it runs."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class MotiveFaults:
    """Faults of the emulated Motive server; assign to the attributes at any time, from any thread.

    Attributes:
        loss: Share of frames that are never sent.
        duplicate: Share of frames that are sent twice.
        reorder: Frames are delayed by up to so many periods at random; 0 keeps the order.
        corrupt: Share of frames with three flipped bits.
        truncate: Share of frames that are cut off at a random place.
        wrong_size: Share of frames whose header lies about their size.
        delay_s: Additional delay of every frame [s].
        freeze: The same frame again and again.
        silent: No frames; requests are answered.
        mute: Requests are not answered; frames go on.
        untracked: No rigid body is tracked.
        unlabelled: No marker is recognised: all are unlabelled points.
        occluded: Markers that are not seen, listed with the flag and with a position.
        missing: Markers that are not seen and not listed.
        nan: Markers at no position at all.
        swap: Pairs of markers whose labels are exchanged.
        second_source: Share of frames that come from another port of the same computer too.
        offset_m: All markers jump by this [m].
        turned_deg: The frame is turned by this rotation vector, in the axes of the cameras [deg].
        turning_deg_s: The frame turns at this rate from now on [deg/s].
        mirrored: The frame is mirrored across the plane with this normal; zeros for not at all.
        pivot: Body about whose centre the frame is turned and mirrored; empty for the origin.
        moved_labels: Bodies whose labels have moved on by one marker.
        exchanged: Pairs of bodies, of as many markers each, whose labels are exchanged.
        drifting: Markers and bodies that drift from now on.
        drift_mm_s: Their velocity, in the axes of the cameras [mm/s].
    """

    loss: float = 0.0
    duplicate: float = 0.0
    reorder: int = 0
    corrupt: float = 0.0
    truncate: float = 0.0
    wrong_size: float = 0.0
    delay_s: float = 0.0
    freeze: bool = False
    silent: bool = False
    mute: bool = False
    untracked: bool = False
    unlabelled: bool = False
    occluded: frozenset[str] = frozenset()
    missing: frozenset[str] = frozenset()
    nan: frozenset[str] = frozenset()
    swap: tuple[tuple[str, str], ...] = ()
    second_source: float = 0.0
    offset_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turned_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turning_deg_s: tuple[float, float, float] = (0.0, 0.0, 0.0)
    mirrored: tuple[float, float, float] = (0.0, 0.0, 0.0)
    pivot: str = ""
    moved_labels: frozenset[str] = frozenset()
    exchanged: tuple[tuple[str, str], ...] = ()
    drifting: frozenset[str] = frozenset()
    drift_mm_s: tuple[float, float, float] = (0.0, 0.0, 0.0)
