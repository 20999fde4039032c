"""The receiving thread: sockets on one side, the conversation in the middle, the inbox on the other."""

from __future__ import annotations

import selectors
import socket
import threading
import time
from dataclasses import replace

from tcr_hardware.errors import HardwareError, SocketError
from tcr_hardware.natnet import protocol
from tcr_hardware.natnet.inbox import Inbox
from tcr_hardware.natnet.protocol import LARGEST_DATAGRAM, Message
from tcr_hardware.natnet.senders import Address, Senders
from tcr_hardware.natnet.session import Session
from tcr_hardware.natnet.sockets import Sockets

#: Datagrams taken from one socket before the others get their turn.
BURST = 64
LONGEST_WAIT_S = 0.25


class Receiver:
    """Runs the conversation until stopped.

    Attributes:
        foreign: Packets that came from another computer than the server.
        senders: Where frames come from.
    """

    def __init__(self, sockets: Sockets, session: Session, inbox: Inbox, server: tuple[str, int]) -> None:
        self._sockets = sockets
        self._session = session
        self._inbox = inbox
        self._server = server
        self.foreign, self.senders = 0, Senders()
        self._answering: Address | None = None  # some servers answer from another port than they are asked at
        session.last_problem = sockets.note
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="natnet", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Say goodbye to the server, close the sockets, and end the thread."""
        self._stopping.set()
        self._thread.join()

    def send(self, datagram: bytes) -> None:
        """Send to the server; a network that is down for a moment is noted, the timers try again."""
        try:
            self._sockets.command.sendto(datagram, self._server)
        except OSError as error:
            self._unreachable(error)

    def _run(self) -> None:
        """Tell readers whatever ends the thread: a silent end would look like still markers."""
        try:
            with selectors.DefaultSelector() as selector:
                self._loop(selector)
        except OSError as error:
            self._inbox.fail(SocketError("{}:{}".format(*self._server), error.strerror or str(error)))
        except HardwareError as error:
            self._inbox.fail(error)
        except BaseException as error:
            self._inbox.fail(HardwareError(f"the receiving thread ended: {error!r}"))
            raise
        finally:
            self._sockets.close()

    def _loop(self, selector: selectors.BaseSelector) -> None:
        for each in self._sockets.all():
            selector.register(each, selectors.EVENT_READ)
        while not self._stopping.is_set():
            now = time.monotonic()
            for datagram in self._session.due(now):
                self.send(datagram)
            for key, _ in selector.select(min(self._session.next_due(now), LONGEST_WAIT_S)):
                assert isinstance(key.fileobj, socket.socket)
                self._receive(key.fileobj)
            if self._session.failure is not None:
                raise self._session.failure
            if self._session.server is not None and self._sockets.follow(self._session.server):
                selector.register(self._sockets.all()[-1], selectors.EVENT_READ)
        self.send(protocol.envelope(Message.DISCONNECT))

    def _receive(self, source: socket.socket) -> None:
        """Take what has arrived at one socket."""
        for _ in range(BURST):
            try:
                datagram, sender = source.recvfrom(LARGEST_DATAGRAM)
            except BlockingIOError:
                return
            except ConnectionError as error:  # an earlier request found nobody
                self._unreachable(error)
                continue
            now = time.monotonic()
            frame = self._session.receive(datagram, now) if self._admitted(datagram, sender, now) else None
            if frame is None:
                self._inbox.notify()
            else:
                self._inbox.put(replace(frame, doubt=self.senders.doubt(now)))

    def _admitted(self, datagram: bytes, sender: Address, now: float) -> bool:
        """Tell whether a packet comes from the server and, if it is a frame, from where the others came from."""
        is_frame = protocol.message_of(datagram) == Message.FRAMEOFDATA
        if sender[0] != self._server[0]:
            self.foreign += 1
            self._session.last_problem = f"packets from {sender[0]}, the server is {self._server[0]}"
            if is_frame:
                self.senders.object_to(sender, now)
            return False
        if not is_frame:
            return self._answers(sender, now)
        before = self.senders.first
        if not self.senders.admit(sender, now):
            self._session.last_problem = "a second source of frames, {}:{}".format(*sender)
            return False
        if before not in (None, sender):
            self._session.begin_anew()
        return True

    def _answers(self, sender: Address, now: float) -> bool:
        """Tell whether the server itself says what is no frame: names from elsewhere mix up markers."""
        self._answering = self._answering or sender
        if sender in (self._server, self._answering, self.senders.first):
            return True
        self.senders.object_to(sender, now)
        self._session.last_problem = "a second server, {}:{}".format(*sender)
        return False

    def _unreachable(self, error: OSError) -> None:
        self._session.last_problem = "{}:{}: {}".format(*self._server, error.strerror or error)
