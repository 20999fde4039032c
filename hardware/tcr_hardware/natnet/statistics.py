"""What a client received, lost and refused."""

from __future__ import annotations

from dataclasses import dataclass

from tcr_hardware.natnet.session import Session


@dataclass(frozen=True, slots=True)
class Statistics:
    """Counts since the client was opened.

    Attributes:
        frames: Frames accepted.
        lost: Frames that never came.
        late: Frames that came after a newer one; not used.
        duplicates: Frames that came twice.
        undecided: Frames with an implausible number; not used.
        early: Frames that came before the version was known.
        malformed: Packets that could not be read.
        impossible: Frames whose clocks say something impossible; dated by their arrival.
        foreign: Packets from another computer.
        strangers: Frames of a second source; not used.
        sessions: How often the server began to count.
        model_updates: Definitions received.
        queue_dropped: Frames that nobody drained in time.
        clock_offset_s: Our clock minus the server's [s], or None.
        clock_uncertainty_s: Bound of its error [s], or None.
        clock_steps: How often the server's clock jumped.
        round_trip_s: Of the last echo [s], or None.
        last_problem: The newest complaint, for a person.
    """

    frames: int
    lost: int
    late: int
    duplicates: int
    undecided: int
    early: int
    malformed: int
    impossible: int
    foreign: int
    strangers: int
    sessions: int
    model_updates: int
    queue_dropped: int
    clock_offset_s: float | None
    clock_uncertainty_s: float | None
    clock_steps: int
    round_trip_s: float | None
    last_problem: str

    @classmethod
    def of(cls, session: Session, foreign: int, strangers: int, queue_dropped: int, now: float) -> Statistics:
        """Read the counters of a session at ``now`` [s]."""
        order, clock = session.order, session.clock
        best = clock.best
        return cls(
            frames=session.frames,
            lost=order.lost,
            late=order.late,
            duplicates=order.duplicates,
            undecided=order.undecided,
            early=session.early,
            malformed=session.malformed,
            impossible=session.impossible,
            foreign=foreign,
            strangers=strangers,
            sessions=order.sessions,
            model_updates=session.model_updates,
            queue_dropped=queue_dropped,
            clock_offset_s=None if best is None else best.offset,
            clock_uncertainty_s=None if best is None else best.uncertainty_at(now),
            clock_steps=clock.steps,
            round_trip_s=clock.round_trip,
            last_problem=session.last_problem,
        )
