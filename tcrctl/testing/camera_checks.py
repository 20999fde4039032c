"""One function per promise of cameras; each opens the device, tries one thing and closes it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Final

import numpy as np

from tcrctl.plant.rig.devices import Cameras, CameraStatus, Sighting
from tcrctl.signals import RawFrame
from tcrctl.testing.bench import CameraBench, Hook
from tcrctl.testing.broken import check_findings, check_identity, given, raises_device_error, require

#: How long a stream is watched [s].
WATCHED: Final = 0.5
#: How long the first frame, or the first one after a fault, is waited for [s].
PATIENCE: Final = 2.0
#: Times of arrival are so exact [s].
EXACT: Final = 0.005


@contextmanager
def _opened(bench: CameraBench) -> Iterator[Cameras]:
    cameras = bench.open()
    try:
        yield cameras
    finally:
        cameras.close()


def _first(cameras: Cameras) -> Sighting:
    seen = cameras.next(PATIENCE, fresh=True)
    require(seen is not None, f"a frame comes within {PATIENCE:g} s")
    require(isinstance(seen, Sighting), f"next returns a Sighting, not a {type(seen).__name__}")
    assert seen is not None
    return seen


def _whole(bench: CameraBench, cameras: Cameras) -> Sighting:
    """Return the first frame that shows all markers, or the last one before patience ends."""
    seen, end = _first(cameras), bench.clock() + PATIENCE
    while np.count_nonzero(seen.valid) != bench.markers and bench.clock() < end:
        seen = _first(cameras)
    return seen


def _watched(bench: CameraBench, cameras: Cameras) -> list[tuple[float, Sighting]]:
    """Return the frames of a while, each with the time at which it was returned."""
    found, end = [], bench.clock() + WATCHED
    while bench.clock() < end:
        seen = cameras.next(0.1, fresh=True)
        if seen is not None:
            found.append((bench.clock(), seen))
    require(len(found) > 1, f"frames come: {len(found)} in {WATCHED:g} s")
    return found


def identity(bench: CameraBench) -> None:
    """Check that the cameras say who they are."""
    with _opened(bench) as cameras:
        check_identity(cameras.identity)
        require(isinstance(cameras.clock, str), "clock is a text")


def rate(bench: CameraBench) -> None:
    """Check that so many frames come as the rate says: few are lost on the way."""
    with _opened(bench) as cameras:
        require(0.0 < cameras.rate < np.inf, f"rate is a number of frames per second, not {cameras.rate}")
        _first(cameras)
        count, wanted = len(_watched(bench, cameras)), cameras.rate * WATCHED
        require(
            0.5 * wanted <= count <= 1.5 * wanted + 1, f"{count} frames came in {WATCHED:g} s, not {wanted:g}"
        )


def frames(bench: CameraBench) -> None:
    """Check that a frame has the shapes and types that it must have, and says why markers are not valid."""
    with _opened(bench) as cameras:
        seen = _whole(bench, cameras)
    shape = (bench.size, 3)
    fits = seen.nodes.shape == shape and seen.nodes.dtype == np.float32
    require(fits, f"nodes are float32 {shape}, not {seen.nodes.dtype} {seen.nodes.shape}")
    fits = seen.valid.shape == (bench.size,) and seen.valid.dtype == np.bool_
    require(fits, f"valid is bool ({bench.size},), not {seen.valid.dtype} {seen.valid.shape}")
    require(bool(np.isfinite(seen.nodes[seen.valid]).all()), "nodes that are valid are finite")
    count = int(np.count_nonzero(seen.valid))
    require(
        count == bench.markers or bool(seen.doubts), f"doubts says why {bench.markers - count} are not valid"
    )
    require(count == bench.markers, f"all {bench.markers} markers are valid, not {count}: {seen.doubts}")


def raw_frames(bench: CameraBench) -> None:
    """Check that the raw frame can be written to a log."""
    with _opened(bench) as cameras:
        raw = _first(cameras).raw
    require(isinstance(raw, RawFrame), f"raw is a RawFrame, not a {type(raw).__name__}")
    require(
        raw.positions.dtype == np.float32 and raw.positions.shape[1:] == (3,),
        "raw.positions is float32 (n, 3)",
    )
    whole = all(v.dtype == np.int32 and v.ndim == 1 for v in (raw.ids, raw.flags))
    require(whole, "raw.ids and raw.flags are int32 (n,)")
    require(min(raw.number, raw.session) >= 0, "raw.number and raw.session are counts")
    require(isinstance(raw.names, str | None), "raw.names is a text, a name a line, or None")


def time_of_frames(bench: CameraBench) -> None:
    """Check that frames say when they were taken: in order, in the past, no older than the bench allows."""
    with _opened(bench) as cameras:
        _first(cameras)
        seen = _watched(bench, cameras)
    taken = np.array([frame.taken for _, frame in seen])
    require(bool((np.diff(taken) > 0.0).all()), "every frame is taken after the one before")
    ages = np.array([now for now, _ in seen]) - taken
    require(
        bool((ages > -1e-3).all()), f"no frame is taken in the future, but one in {-1e3 * ages.min():.1f} ms"
    )
    age = float(np.median(ages))
    require(age <= bench.latency, f"frames are {1e3 * age:.1f} ms old, at most {1e3 * bench.latency:g} ms")
    delays = np.array([frame.raw.delay for _, frame in seen])
    require(bool((delays >= 0.0).all()), "raw.delay is not negative")
    require(
        bool(np.all(delays <= ages + EXACT)), "raw.delay is the age on arrival: not more than the age now"
    )


def newest_first(bench: CameraBench) -> None:
    """Check that a loop that was late gets the newest frame, not the oldest that nobody has taken."""
    with _opened(bench) as cameras:
        _first(cameras)
        bench.sleep(max(20.0 / cameras.rate, 4.0 * bench.latency))
        seen = cameras.next(0.0, fresh=False)
        require(seen is not None, "a frame that has come in the meantime is returned at once")
        assert seen is not None
        age, most = bench.clock() - seen.taken, bench.latency + 2.0 / cameras.rate
        require(
            age <= most, f"after a pause the newest frame comes first, not one that is {1e3 * age:.0f} ms old"
        )


def every_frame_once(bench: CameraBench) -> None:
    """Check that no frame is returned twice."""
    with _opened(bench) as cameras:
        before, end = _first(cameras), bench.clock() + WATCHED
        while bench.clock() < end:
            seen = cameras.next(0.0, fresh=False)
            if seen is None:
                bench.sleep(0.2 / cameras.rate)
                continue
            require(seen.taken > before.taken, f"frame {seen.raw.number} is returned once")
            before = seen


def fresh_frames(bench: CameraBench) -> None:
    """Check that with ``fresh`` the frame has arrived after it was asked for, although another one was here."""
    with _opened(bench) as cameras:
        _first(cameras)
        bench.sleep(5.0 / cameras.rate)
        asked = bench.clock()
        seen = cameras.next(PATIENCE, fresh=True)
        require(seen is not None, "a fresh frame comes")
        assert seen is not None
        early = asked - (seen.taken + seen.raw.delay)
        require(
            early <= EXACT, f"a fresh frame arrives after it is asked for, not {1e3 * early:.1f} ms before"
        )


def silence(bench: CameraBench) -> None:
    """Check that if no frame comes there is none, in time; and when they come again they are taken again."""
    with _opened(bench) as cameras, _wrong(given("silence", bench.silence)):
        _first_or_none(bench, cameras)
        begun = bench.clock()
        seen = cameras.next(0.05, fresh=True)
        took = bench.clock() - begun
        require(seen is None, "no frame is made up while none comes")
        require(took <= 0.05 + bench.slack, f"next(0.05) ends after {took:.3f} s while no frame comes")
        given("silence", bench.silence)(False)
        _first(cameras)


def frozen(bench: CameraBench) -> None:
    """Check that a frame that repeats the last one bit for bit is none."""
    with _opened(bench) as cameras, _wrong(given("freeze", bench.freeze)):
        _first_or_none(bench, cameras)
        seen = cameras.next(5.0 / cameras.rate, fresh=True)
        require(seen is None, "a frame that repeats the last one bit for bit is none")
        given("freeze", bench.freeze)(False)
        _first(cameras)


def hidden(bench: CameraBench) -> None:
    """Check that markers that are hidden are not valid, the others are, and it is said why."""
    with _opened(bench) as cameras:
        before = _whole(bench, cameras)
        with _wrong(given("hide", bench.hide)):
            _first_or_none(bench, cameras)
            seen = _first(cameras)
        count = int(np.count_nonzero(seen.valid))
        require(0 < count < bench.markers, f"some markers are not valid while they are hidden: {count} are")
        require(bool(seen.doubts), "doubts says why markers are not valid")
        both = seen.valid & before.valid
        away = np.linalg.norm(seen.nodes[both] - before.nodes[both], axis=1)
        require(bool((away < 0.01).all()), "the other markers are where they were")


def status(bench: CameraBench) -> None:
    """Check that the stream is counted."""
    with _opened(bench) as cameras:
        _first(cameras)
        found = cameras.status()
    require(isinstance(found, CameraStatus), f"status returns a CameraStatus, not a {type(found).__name__}")
    counts = (found.lost, found.malformed, found.impossible, found.markers)
    require(all(isinstance(n, int) and n >= 0 for n in counts), f"status holds counts, not {counts}")


def own_checks(bench: CameraBench) -> None:
    """Check that what only these cameras know to look at is in order."""
    with _opened(bench) as cameras:
        check_findings(cameras.checks([_first(cameras)]))


def closing(bench: CameraBench) -> None:
    """Check that cameras may be closed twice, give no frame any more, and can be opened again."""
    cameras = bench.open()
    _first(cameras)
    bench.sleep(0.1)  # the next frame is here, and nobody has asked for it
    cameras.close()
    cameras.close()
    begun, seen = bench.clock(), []
    ended = raises_device_error(lambda: seen.append(cameras.next(0.05, fresh=True)), "next after close")
    require(ended or seen == [None], "no frame comes after close")
    require(bench.clock() - begun <= 0.05 + bench.slack, "next after close ends in time")
    with _opened(bench) as again:
        _first(again)


@contextmanager
def _wrong(hook: Hook) -> Iterator[None]:
    """Let something be wrong for a while."""
    hook(True)
    try:
        yield
    finally:
        hook(False)


def _first_or_none(bench: CameraBench, cameras: Cameras) -> None:
    """Let pass what was on its way when something went wrong."""
    bench.sleep(bench.latency + 3.0 / cameras.rate)
    cameras.next(0.0, fresh=False)


CAMERA_CHECKS: Final[Mapping[str, Callable[[CameraBench], None]]] = {
    check.__name__: check
    for check in (
        *(identity, rate, frames, raw_frames, time_of_frames, newest_first, every_frame_once, fresh_frames),
        *(silence, frozen, hidden, status, own_checks, closing),
    )
}
"""Every promise of cameras by name."""
