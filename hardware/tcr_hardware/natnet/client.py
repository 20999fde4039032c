"""The NatNet client: one thread receives, everybody else reads the newest frame.

    with NatNetClient(NatNetSettings(server="192.168.1.10", local="192.168.1.20")) as client:
        frame = client.wait_next(None, timeout_s=1.0)

``newest`` never waits for the network.
"""

from __future__ import annotations

import struct
import threading
import time
from types import TracebackType

from tcr_hardware.natnet import protocol
from tcr_hardware.natnet.errors import RequestRefusedError, ServerSilentError
from tcr_hardware.natnet.inbox import Inbox
from tcr_hardware.natnet.marker_frame import MarkerFrame
from tcr_hardware.natnet.models import ModelDefinitions
from tcr_hardware.natnet.protocol import Message, ServerInfo, Version
from tcr_hardware.natnet.receiver import Receiver
from tcr_hardware.natnet.session import Session
from tcr_hardware.natnet.settings import NatNetSettings
from tcr_hardware.natnet.sockets import Sockets, refuses, resolve
from tcr_hardware.natnet.statistics import Statistics

#: A request is repeated after so long without an answer [s].
REPEAT_S = 0.25


class NatNetClient:
    """Receives markers from one server.

    Attributes:
        settings: Where the server is.
    """

    def __init__(self, settings: NatNetSettings) -> None:
        self.settings = settings
        self._session = Session(settings, time.monotonic())
        self._inbox = Inbox()
        self._receiver: Receiver | None = None
        self._asking = threading.Lock()
        self._answer: tuple[int, bytes] | None = None

    def __enter__(self) -> NatNetClient:
        """Open."""
        self.open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Close."""
        self.close()

    def open(self, timeout_s: float = 2.0) -> ServerInfo:
        """Connect; return when the server has said who it is and what it tracks.

        Raises:
            SocketError: No such host, or no such local address.
            ServerSilentError: No answer within ``timeout_s``.
            UnsupportedVersionError: The server's frames cannot be read.
        """
        if self._receiver is not None:
            raise RuntimeError("the client is open already")
        server = (resolve(self.settings.server), self.settings.command_port)
        self._session, self._inbox = Session(self.settings, time.monotonic()), Inbox()
        self._session.on_response = self._answered
        self._receiver = Receiver(Sockets.open(self.settings), self._session, self._inbox, server)
        try:
            return self._await_server(server, timeout_s)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Disconnect and close the sockets; a closed client may be opened again."""
        if self._receiver is not None:
            self._receiver.stop()
            self._receiver = None

    @property
    def server(self) -> ServerInfo | None:
        """Who the server says it is."""
        return self._session.server

    @property
    def version(self) -> Version | None:
        """Version of the frames; None until it is settled."""
        return self._session.version

    @property
    def models(self) -> ModelDefinitions | None:
        """What the server tracks; None until told, and for a moment after a change."""
        return self._session.models

    def wait_models(self, timeout_s: float = 1.0) -> ModelDefinitions:
        """Return what the server tracks; wait if it is about to tell anew.

        Raises:
            ServerSilentError: It did not tell within ``timeout_s``.
            HardwareError: Receiving has ended, for the reason given.
        """
        end = time.monotonic() + timeout_s
        while (models := self._session.models) is None:
            if not self._inbox.wait(lambda: self._session.models is not None, end - time.monotonic()):
                raise ServerSilentError(self.settings.address, "model definitions", timeout_s)
            self._inbox.check()
        return models

    def newest(self) -> MarkerFrame | None:
        """Return the newest frame without waiting, or None before the first.

        Raises:
            HardwareError: Receiving has ended, for the reason given.
        """
        self._inbox.check()
        return self._inbox.newest

    def wait_next(self, after: MarkerFrame | None, timeout_s: float) -> MarkerFrame | None:
        """Wait for a frame newer than ``after``; None if none came within ``timeout_s``.

        Raises:
            HardwareError: Receiving has ended, for the reason given.
        """
        arrived = self._inbox.wait(lambda: self._inbox.newest is not after, timeout_s)
        return self.newest() if arrived else None

    def drain(self) -> list[MarkerFrame]:
        """Return every frame accepted since the last call, oldest first; at most ``QUEUE_FRAMES`` are kept."""
        return self._inbox.drain()

    def statistics(self) -> Statistics:
        """Count what was received, lost and refused since ``open``."""
        receiver = self._receiver
        foreign, strangers = (0, 0) if receiver is None else (receiver.foreign, receiver.senders.strangers)
        return Statistics.of(self._session, foreign, strangers, self._inbox.dropped, time.monotonic())

    def request(self, text: str, timeout_s: float = 1.0) -> bytes:
        """Ask the server something; return the payload of its answer.

        Raises:
            ServerSilentError: No answer within ``timeout_s``.
            RequestRefusedError: The server does not know the request.
        """
        with self._asking:  # answers carry no number: one question at a time
            deadline = time.monotonic() + timeout_s
            while (left := deadline - time.monotonic()) > 0.0:
                answer = self._ask(text, min(REPEAT_S, left))
                if answer is not None:
                    return self._understood(text, answer)
        raise ServerSilentError(self.settings.address, f"answer to the request {text!r}", timeout_s)

    def frame_rate(self) -> float:
        """Ask for the frame rate [Hz]; raises as ``request``."""
        return self._number("FrameRate")

    def units_to_millimetres(self) -> float:
        """Ask how many millimetres the unit of positions has (1000 for metres); raises as ``request``."""
        return self._number("UnitsToMillimeters")

    def _number(self, text: str) -> float:
        answer = self.request(text)
        if len(answer) != 4:
            raise RequestRefusedError(text, repr(answer[:40]))
        return float(struct.unpack("<f", answer)[0])

    def _ask(self, text: str, wait_s: float) -> tuple[int, bytes] | None:
        if self._receiver is None:
            raise RuntimeError("the client is not open")
        self._inbox.wait(lambda: not self._session.choice.pending, wait_s)
        self._answer = None
        self._receiver.send(protocol.request(text))
        self._inbox.wait(lambda: self._answer is not None, wait_s)
        self._inbox.check()
        return self._answer

    def _answered(self, message: int, payload: bytes) -> None:
        self._answer = (message, payload)

    @staticmethod
    def _understood(text: str, answer: tuple[int, bytes]) -> bytes:
        message, payload = answer
        if message == Message.UNRECOGNIZED_REQUEST:
            raise RequestRefusedError(text, "that it does not know it")
        return payload

    def _await_server(self, address: tuple[str, int], timeout_s: float) -> ServerInfo:
        self._inbox.wait(lambda: self._session.ready, timeout_s)
        self._inbox.check()
        server, problem = self._session.server, self._session.last_problem
        if server is None:
            hint = problem or "Is Motive running and streaming, at the interface of the camera network?"
            if refuses(address):
                hint = "Nobody listens at that port: is Motive running, and the command port right?"
            raise ServerSilentError(self.settings.address, "answer", timeout_s, hint=hint)
        if not self._session.ready:
            raise ServerSilentError(self.settings.address, "model definitions", timeout_s, hint=problem)
        return server
