"""One function per promise of drives; each opens the device, tries one thing, switches it off and closes it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from tcrctl.plant.rig.devices import DeviceLimits
from tcrctl.testing.bench import DriveBench
from tcrctl.testing.broken import Untried, check_findings, check_identity, given, raises_device_error, require
from tcrctl.testing.hand import MOVING, OFF, ON, STOPPING, Hand

#: A watchdog that takes longer is none [s].
LONGEST_WATCHDOG: Final = 5.0
#: How long drives that must not move are watched [s].
WATCHED: Final = 0.3


def identity(bench: DriveBench) -> None:
    """Check that the drives say who they are."""
    with Hand.on(bench) as hand:
        check_identity(hand.drives.identity)


def limits(bench: DriveBench) -> None:
    """Check that the drives say what they allow, and stand inside."""
    with Hand.on(bench) as hand:
        found = hand.drives.limits
        require(isinstance(found, DeviceLimits), f"limits are DeviceLimits, not a {type(found).__name__}")
        shapes = {np.shape(found.low), np.shape(found.high)}
        require(shapes == {(bench.cables,)}, f"low and high are of shape ({bench.cables},), not {shapes}")
        require(bool((np.asarray(found.low) < found.high).all()), "low is less than high")
        require(found.speed > 0 and found.step > 0, "speed and step leave room to move")
        inside = (found.low <= hand.target) & (hand.target <= found.high)
        require(bool(inside.all()), f"the drives stand inside their limits: {hand.target} um")


def watchdog(bench: DriveBench) -> None:
    """Check that the drives have a watchdog that outlasts a period and not much more."""
    with Hand.on(bench) as hand:
        found = hand.drives.watchdog
        require(found is not None, "the drives have a watchdog")
        assert found is not None
        fits = bench.period < found <= LONGEST_WATCHDOG
        require(
            fits, f"the watchdog is longer than a period, and at most {LONGEST_WATCHDOG:g} s, not {found} s"
        )


def load(bench: DriveBench) -> None:
    """Check that an exchange fits into a period."""
    with Hand.on(bench) as hand:
        share = hand.drives.load(bench.period)
        require(0.0 <= share < 1.0, f"an exchange takes less than a period, not {share} of it")


def reading(bench: DriveBench) -> None:
    """Check that reading the status switches nothing on, moves nothing and is answered in time."""
    with Hand.on(bench) as hand:
        for _ in range(10):
            begun = bench.clock()
            found = hand.ask()
            took = bench.clock() - begun
            require(took <= bench.answer, f"status takes at most {bench.answer:g} s, not {took:.3f} s")
            require(not found.enabled, "the drives are off")
            moved = int(np.abs(found.position - hand.target).max())
            require(moved <= bench.still, f"nothing moves, not {moved} um")


def answers_in_time(bench: DriveBench) -> None:
    """Check that exchanges are answered in time, and say how long they took."""
    with Hand.on(bench) as hand:
        hand.arm()
        for _ in range(20):
            begun = bench.clock()
            found = hand.drives.exchange(hand.target, ON)
            took = bench.clock() - begun
            require(took <= bench.answer, f"an exchange takes at most {bench.answer:g} s, not {took:.3f} s")
            fits = 0.0 <= found.round_trip <= took + 1e-3
            require(fits, f"the round trip is the time of the exchange: {found.round_trip} s of {took:.4f} s")


def enabling(bench: DriveBench) -> None:
    """Check that switching on moves nothing."""
    with Hand.on(bench) as hand:
        before = hand.target
        moved = int(np.abs(hand.arm().position - before).max())
        moved = max(moved, hand.keeps(WATCHED, hand.target, ON))
        require(moved <= bench.still, f"switching on moves nothing, not {moved} um")


def following(bench: DriveBench) -> None:
    """Check that every cable goes where it is sent, and only it."""
    with Hand.on(bench) as hand:
        hand.arm()
        for cable in range(bench.cables):
            start, goal = hand.target, hand.goal(cable)
            away = np.abs(hand.arrive(goal).position - goal)
            away[cable] = 0
            require(
                int(away.max()) <= bench.near, f"only cable {cable} moves, not those {np.nonzero(away)[0]}"
            )
            hand.arrive(start)


def needs_follow(bench: DriveBench) -> None:
    """Check that set-points are not followed without ``follow``."""
    with Hand.on(bench) as hand:
        hand.arm()
        moved = hand.keeps(WATCHED, hand.goal(), ON)
        require(moved <= bench.still, f"without follow nothing moves, not {moved} um")


def needs_enable(bench: DriveBench) -> None:
    """Check that set-points are not followed by drives that are off."""
    with Hand.on(bench) as hand:
        hand.arm()
        hand.send(hand.target, OFF)
        moved = hand.keeps(WATCHED, hand.goal(), replace(MOVING, enable=False))
        require(moved <= bench.still, f"without enable nothing moves, not {moved} um")


def stopping(bench: DriveBench) -> None:
    """Check that without ``permit`` the drives stop in time, are off then, and set-points are followed no more."""
    with Hand.on(bench) as hand:
        hand.arm()
        hand.go(hand.goal())
        goal, end = hand.target, bench.clock() + bench.stop
        before, moved, found = hand.ask().position, bench.still + 1, hand.send(goal, STOPPING)
        while found.enabled or moved > bench.still:
            late = f"a stop ends within {bench.stop:g} s: enabled {found.enabled}, moved {moved} um"
            require(bench.clock() < end, late)
            found = hand.send(goal, STOPPING)
            moved, before = int(np.abs(found.position - before).max()), found.position
        moved = hand.keeps(WATCHED, hand.goal(), replace(STOPPING, follow=True))
        require(moved <= bench.still, f"what has stopped does not move again, not {moved} um")


def watchdog_stops(bench: DriveBench) -> None:
    """Check that without an exchange the drives stop by themselves, whatever is read, and stay so until a reset."""
    with Hand.on(bench) as hand:
        hand.arm()
        hand.go(hand.goal())
        wait = bench.clock() + (hand.drives.watchdog or 0.0) + bench.stop
        while bench.clock() < wait:
            found = hand.ask()
            bench.sleep(bench.period)
        require(
            not found.enabled,
            "drives are off when nobody writes for their watchdog and the time of a stop",
        )
        require(found.watchdog or bool(found.fault), "the status says that the watchdog has stopped them")
        moved = hand.keeps(WATCHED, hand.target, MOVING)
        require(moved <= bench.still, f"after the watchdog nothing moves before a reset, not {moved} um")
        require(not hand.ask().enabled, "the watchdog is latched")
        found = hand.reset()
        require(
            not (found.watchdog or found.fault), f"reset clears the watchdog: {found.fault or 'watchdog'}"
        )
        hand.arm()


def outside_limits(bench: DriveBench) -> None:
    """Check that set-points outside the limits never take the drives there, and they say so."""
    if not bench.emulated:
        raise Untried("set-points that must be refused are sent to emulated drives only")
    with Hand.on(bench) as hand:
        hand.arm()
        high = hand.drives.limits.high
        if not np.isfinite(high).all():
            raise Untried("the drives have no limits of their own")
        target, refused = (high + 1000).astype(np.int64), False
        for _ in range(int(WATCHED / bench.period)):
            found = hand.send(target, MOVING)
            refused = refused or bool(found.reject)
            beyond = float((found.position - high).max())
            require(beyond <= bench.still, f"no drive leaves its limits, not by {beyond:g} um")
        require(refused, "reject says why set-points outside the limits are not taken")


def too_far_at_once(bench: DriveBench) -> None:
    """Check that a set-point too far from the last one is refused, or approached no faster than the limit."""
    if not bench.emulated:
        raise Untried("set-points that must be refused are sent to emulated drives only")
    with Hand.on(bench) as hand:
        hand.arm()
        limits, start = hand.drives.limits, hand.target
        far = np.clip(start + 20_000, limits.low, limits.high).astype(np.int64)
        begun, speed = bench.clock(), min(limits.speed, 1e6)
        for _ in range(5):
            position = hand.send(far, MOVING).position
            most = 1.2 * speed * (bench.clock() - begun) + bench.near
            moved = float(np.abs(position - start).max())
            require(
                moved <= most, f"drives move no faster than their limit: {moved:g} um, at most {most:.0f} um"
            )


def zeroing(bench: DriveBench) -> None:
    """Check that the present positions become zero, once, when ``zero`` becomes true."""
    if not bench.emulated:
        raise Untried("zero is set on emulated drives only")
    with Hand.on(bench) as hand:
        hand.arm()
        hand.arrive(hand.goal())
        hand.send(hand.target, OFF)
        hand.keeps(WATCHED, hand.target, OFF)
        for control in (OFF, replace(OFF, permit=True, zero=True), OFF):
            hand.keeps(WATCHED / 3, hand.ask().position, control)
        found = hand.ask()
        require(found.zeroed, "zeroed says that zero is known")
        off = int(np.abs(found.position).max())
        require(off <= bench.still, f"the positions are zero, not {off} um")


def silence(bench: DriveBench) -> None:
    """Check that drives that do not answer are a DeviceError in time; they are heard again when they do."""
    hook = given("silence", bench.silence)
    with Hand.on(bench) as hand:
        hand.arm()
        hook(True)
        try:
            begun = bench.clock()
            lost = raises_device_error(
                lambda: hand.drives.exchange(hand.target, ON), "an exchange without answer"
            )
            took = bench.clock() - begun
        finally:
            hook(False)
        require(lost, "an exchange without an answer is a DeviceError")
        require(took <= bench.answer, f"it is told within {bench.answer:g} s, not {took:.3f} s")
        end = bench.clock() + bench.stop
        while raises_device_error(hand.ask, "status"):
            require(bench.clock() < end, "the drives are heard again when they answer again")
            bench.sleep(bench.period)


def emergency_stop(bench: DriveBench) -> None:
    """Check that the emergency stop is told, the drives are off, and stay so until it is released and reset."""
    hook = given("estop", bench.estop)
    with Hand.on(bench) as hand:
        hand.arm()
        hand.go(hand.goal())
        hook(True)
        try:
            hand.keeps(bench.stop, hand.target, MOVING)
            found, moved = hand.ask(), hand.keeps(WATCHED, hand.goal(), MOVING)
        finally:
            hook(False)
        require(found.estop, "estop says that the emergency stop is pressed")
        require(not found.enabled, "the drives are off while it is pressed")
        require(moved <= bench.still, f"nothing moves while it is pressed, not {moved} um")
        hand.reset()
        hand.arm()


def own_checks(bench: DriveBench) -> None:
    """Check that what only these drives know to look at is in order."""
    with Hand.on(bench) as hand:
        check_findings(hand.drives.checks())


def closing(bench: DriveBench) -> None:
    """Check that closing moves nothing, may be done twice, and drives can be opened again where they were."""
    with Hand.on(bench) as hand:
        hand.arm()
        place = hand.arrive(hand.goal()).position
        hand.send(hand.target, OFF)
    hand.drives.close()
    with Hand.on(bench) as again:
        moved = int(np.abs(again.target - place).max())
        require(moved <= bench.near, f"closing and opening moves nothing, not {moved} um")
        again.arm()


DRIVE_CHECKS: Final[Mapping[str, Callable[[DriveBench], None]]] = {
    check.__name__: check
    for check in (
        *(identity, limits, watchdog, load, reading, answers_in_time, enabling, following, needs_follow),
        *(needs_enable, stopping, watchdog_stops, outside_limits, too_far_at_once, zeroing, silence),
        *(emergency_stop, own_checks, closing),
    )
}
"""Every promise of drives by name."""
