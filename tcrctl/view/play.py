"""A log, played to the Foxglove app at any pace; the app's time bar seeks, pauses and sets the speed."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from tcrctl.errors import InputError
from tcrctl.experiment.run_folder import log_in
from tcrctl.view.server import HOST, PORT, ViewServer, foxglove_sdk
from tcrctl.view.tape import Sent, Tape

#: Longest time that a request of the app waits [s].
_NAP_S: Final = 0.02
#: After a jump, what was last sent before it is sent at once: as many steps back as this, or as long as this [s].
_BACK_STEPS: Final = 3
_BACK_S: Final = 0.25
#: An app subscribes to its topics one after the other; playing begins when it has had this long for it [s].
_GRACE_S: Final = 0.5


@dataclass(frozen=True, slots=True)
class Playback:
    """How a log is played.

    Attributes:
        rate: Speed; 2 is twice as fast as it happened.
        begin: First time played [s]; the log's first if None.
        end: Last time played [s]; the log's last if None.
        loop: Begin again at the end.
        paused: Wait for the app to start it.
        once: End the program after the last message instead of waiting for the app.
        topics: Which topics; all if empty.
    """

    rate: float = 1.0
    begin: float | None = None
    end: float | None = None
    loop: bool = False
    paused: bool = False
    once: bool = False
    topics: Collection[str] = ()


class Player:
    """Sends the messages of a tape when they are due."""

    def __init__(
        self,
        tape: Tape,
        playback: Playback,
        *,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
        check: Callable[[], None] = lambda: None,
    ) -> None:
        """Make a player at the beginning of the tape.

        Args:
            tape: What is played.
            playback: How.
            clock: Never jumps [s].
            sleep: Waits for a time [s].
            check: Raises if the program shall end; called at least every 20 ms.

        Raises:
            InputError: If the rate is not positive, or nothing lies in the span.
        """
        if not 0.0 < playback.rate < float("inf"):
            raise InputError(f"the rate must be a positive number, not {playback.rate:g}")
        begin, end = playback.begin, playback.end
        self.first_ns = tape.first_ns if begin is None else max(tape.first_ns, tape.time_ns(begin))
        self.last_ns = tape.last_ns if end is None else min(tape.last_ns, tape.time_ns(end))
        if self.first_ns > self.last_ns:
            raise InputError(f"{tape.path}: has nothing to play in this span of time")
        self._tape, self._playback = tape, playback
        self._clock = clock
        self._sleep = sleep
        self._check = check
        self._lock = threading.Lock()
        self._rate = playback.rate
        self._playing = not playback.paused
        self._ended = False
        self._now_ns = self.first_ns
        self._seek_ns: int | None = self.first_ns
        self._anchor: tuple[float, int] | None = None

    def control(self, request: Any) -> Any:
        """Do what the app asks for and return the new playback state; called from the server's thread."""
        command = foxglove_sdk().websocket.PlaybackCommand
        with self._lock:
            self._playing = request.playback_command == command.Play
            self._rate = request.playback_speed if request.playback_speed > 0.0 else self._rate
            if request.seek_time is not None:
                self._now_ns = min(max(request.seek_time, self.first_ns), self.last_ns)
                self._seek_ns = self._now_ns
            elif self._playing and self._ended:  # play, at the end, means again
                self._now_ns = self._seek_ns = self.first_ns
            self._ended, self._anchor = False, None
        return self.state(did_seek=request.seek_time is not None, request_id=request.request_id)

    def state(self, *, did_seek: bool = False, request_id: str | None = None) -> Any:
        """Return the playback state for the app."""
        websocket = foxglove_sdk().websocket
        kind = "Ended" if self._ended else "Playing" if self._playing else "Paused"
        status = getattr(websocket.PlaybackStatus, kind)
        return websocket.PlaybackState(status, self._now_ns, self._rate, did_seek, request_id)

    def run(self, server: ViewServer) -> None:
        """Play until the end, or for ever.

        Raises:
            LogError: If the log is damaged inside.
        """
        while True:
            messages = self._jump(server)
            for sent in messages:
                if sent.time_ns > self.last_ns:
                    break
                if not self._wait_until_due(sent.time_ns, server):
                    break  # the app wants to be elsewhere
                server.send(sent.topic, sent.time_ns, sent.data)
                server.tell_time(sent.time_ns)
            if self._seek_ns is None and not self._at_end(server):
                return

    def _jump(self, server: ViewServer) -> Iterator[Sent]:
        """Go where playing shall go on: show at once what was to be seen there, and return what comes then."""
        with self._lock:
            at = self.first_ns if self._seek_ns is None else self._seek_ns
            self._now_ns = at
            self._seek_ns = None
            self._anchor = None
        server.forget()
        back = max(_BACK_S, _BACK_STEPS * self._tape.period)
        begin = at if at == self._tape.first_ns else at - round(1e9 * back)
        for sent in self._tape.static:
            if sent.time_ns < begin:
                server.send(sent.topic, at, sent.data)
        messages = self._tape.messages(begin)
        for sent in messages:
            if sent.time_ns > at or at == self._tape.first_ns:
                server.tell_time(at)
                return self._with_first(sent, messages)
            server.send(sent.topic, sent.time_ns, sent.data)
        return iter(())

    @staticmethod
    def _with_first(first: Sent, others: Iterator[Sent]) -> Iterator[Sent]:
        yield first
        yield from others

    def _wait_until_due(self, time_ns: int, server: ViewServer) -> bool:
        """Wait, also while paused; False if the app asked for another time meanwhile."""
        while True:
            self._check()
            server.refresh()
            with self._lock:
                if self._seek_ns is not None:
                    return False
                left = self._left(time_ns)
                if left <= 0.0:
                    self._now_ns = time_ns
                    return True
            self._sleep(min(left, _NAP_S))

    def _left(self, time_ns: int) -> float:
        """Return the time until a message is due [s]."""
        if not self._playing:
            self._anchor = None
            return _NAP_S
        if self._anchor is None:
            self._anchor = self._clock(), self._now_ns
        begun, from_ns = self._anchor
        return begun + 1e-9 * (time_ns - from_ns) / self._rate - self._clock()

    def _at_end(self, server: ViewServer) -> bool:
        """Begin again, or wait for the app; False if the program shall end."""
        if self._playback.loop:
            self._seek_ns = self.first_ns
            return True
        with self._lock:
            self._ended, self._playing = True, False
        server.tell_state(self.state())
        while not self._playback.once and self._seek_ns is None:
            self._check()
            server.refresh()
            self._sleep(_NAP_S)
        return self._seek_ns is not None


def play(
    path: Path,
    playback: Playback,
    *,
    host: str = HOST,
    port: int = PORT,
    ready: Callable[[ViewServer], None] = lambda server: None,
    warn: Callable[[str], None] = lambda text: None,
    check: Callable[[], None] = lambda: None,
) -> None:
    """Play a log; begins when the first viewer has connected.

    Args:
        path: The log, finished or not, or the folder of the run.
        playback: How it is played.
        host: Address to listen at.
        port: Port to listen at; 0 takes a free one.
        ready: Takes the server when it can be connected to.
        warn: Takes what the user should know about the log.
        check: Raises if the program shall end.

    Raises:
        InputError: If the log cannot be played so, or the package for it is not installed.
        DeviceError: If the address cannot be used.
        LogError: If the log is damaged inside.
    """
    foxglove_sdk()
    tape = Tape(log_in(path), playback.topics)
    if tape.damages:
        warn(f"the log is damaged, what is whole is played: {'; '.join(tape.damages)}")
    player = Player(tape, playback, check=check)
    with ViewServer(
        tape.channels,
        name=f"tcrctl play {tape.path.parent.name or tape.path.name}",
        host=host,
        port=port,
        span_ns=(player.first_ns, player.last_ns),
        on_control=player.control,
    ) as server:
        ready(server)
        while not server.wait_for_viewer(_NAP_S):
            check()
        time.sleep(_GRACE_S)
        server.tell_state(player.state())
        player.run(server)
        time.sleep(_GRACE_S)  # what is on its way shall arrive
