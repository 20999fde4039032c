"""The conversation with a server, without sockets: datagrams in, frames and datagrams out, time from outside.

    CONNECT -> SERVERINFO -> (Bitstream) -> REQUEST_MODELDEF -> MODELDEF -> frames
       ^                                                                      |
       +---------- silence, many malformed packets, DISCONNECTBYTIMEOUT ------+

Beside it run the keep-alive (unicast) and the echo that dates the server's clock (from 3.0).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from tcr_hardware.natnet import protocol
from tcr_hardware.natnet.clock import ServerClock
from tcr_hardware.natnet.errors import MalformedPacketError, NatNetError
from tcr_hardware.natnet.frame import BITSTREAM_CHANGED, MODELS_CHANGED, MocapFrame
from tcr_hardware.natnet.frame_decoder import decode_frame
from tcr_hardware.natnet.marker_frame import MarkerFrame
from tcr_hardware.natnet.model_decoder import decode_models
from tcr_hardware.natnet.models import ModelDefinitions
from tcr_hardware.natnet.order import Arrival, FrameOrder
from tcr_hardware.natnet.protocol import Message, ServerInfo, Version
from tcr_hardware.natnet.settings import NatNetSettings
from tcr_hardware.natnet.timers import Timers
from tcr_hardware.natnet.version_choice import VersionChoice

#: So many packets in a row that cannot be read: ask the server anew who it is.
MALFORMED_IN_A_ROW = 5
RETRY_S = 0.25
#: A frame that claims to be older than this has a wrong time stamp [s].
LONGEST_LATENCY = 10.0
#: Clock requests that may still be answered; older ones are given up.
ECHOES = 4


class Session:
    """One server as seen by one client.

    Attributes:
        server: Who the server says it is; None until it answered.
        models: Names of the markers; None until told, and after the server announced a change.
        order: Frame numbers.
        clock: The server's clock.
        frames: Frames accepted.
        early: Frames that came before the version was known.
        malformed: Packets that could not be read.
        impossible: Frames whose clocks say something impossible; they are dated by their arrival.
        model_updates: Definitions received.
        last_problem: The newest complaint, for a person.
        failure: Why no frame of this server can be used, or None.
    """

    def __init__(self, settings: NatNetSettings, now: float) -> None:
        self.settings = settings
        self.server: ServerInfo | None = None
        self.models: ModelDefinitions | None = None
        self.order, self.clock = FrameOrder(), ServerClock()
        self.choice = VersionChoice(settings)
        self.frames = self.early = self.malformed = self.impossible = self.model_updates = 0
        self.last_problem = ""
        self.failure: NatNetError | None = None
        self.on_response: Callable[[int, bytes], None] = lambda message, payload: None
        self._in_a_row = 0
        self._heard = now
        self._models_changing = self._refresh_models = False
        self._echoes: deque[int] = deque(maxlen=ECHOES)
        self._timers = Timers(
            now,
            connect=RETRY_S,
            bitstream=RETRY_S,
            models=RETRY_S,
            keep_alive=settings.keep_alive_s,
            echo=settings.echo_s,
            silence=settings.silence_s,
        )

    @property
    def version(self) -> Version | None:
        """Version of the frames; None until it is settled."""
        return self.choice.stream

    @property
    def ready(self) -> bool:
        """Whether frames can be decoded and their markers named."""
        return self.version is not None and self.models is not None

    def receive(self, datagram: bytes, now: float) -> MarkerFrame | None:
        """Take a datagram that arrived at ``now`` [s]; return a frame if it holds a new one.

        A packet that cannot be read is counted in ``malformed``; ``failure`` tells of a server that cannot be used.
        """
        try:
            message, payload = protocol.split(datagram)
            frame = self._handle(message, payload, now)
        except MalformedPacketError as error:
            self._complain(error)
            return None
        except NatNetError as error:
            self.failure, self.last_problem = error, str(error)
            return None
        return frame

    def due(self, now: float) -> list[bytes]:
        """Return the datagrams to be sent to the server at ``now`` [s]."""
        wanted: list[bytes] = []
        if self._timers.due("connect" if self.server is None else "silence", now) and self._lacks_frames(now):
            wanted.append(protocol.connect(self.choice.asked))
        if self.server is None:
            return wanted
        if self.choice.pending and self._timers.due("bitstream", now):
            wanted += [protocol.request(text) for text in self.choice.questions()]
        outdated = self.models is None or self._refresh_models
        if self.version is not None and outdated and self._timers.due("models", now):
            wanted.append(protocol.envelope(Message.REQUEST_MODELDEF))
        if not self.settings.multicast and self._timers.due("keep_alive", now):
            wanted.append(protocol.envelope(Message.KEEPALIVE))
        if self.clock.hz and self._timers.due("echo", now):
            client_ns = round(now * 1e9)
            self._echoes.append(client_ns)
            wanted.append(protocol.echo_request(client_ns))
        return wanted

    def begin_anew(self) -> None:
        """Take the next frame for the first of a new server, whose names and clock are not known."""
        self.order.begin_anew()

    def next_due(self, now: float) -> float:
        """Return the seconds until ``due`` may have something to send."""
        return self._timers.until_next(now)

    def _lacks_frames(self, now: float) -> bool:
        return self.server is None or now - self._heard > self.settings.silence_s

    def _handle(self, message: int, payload: bytes, now: float) -> MarkerFrame | None:
        if message == Message.FRAMEOFDATA:
            return self._frame(payload, now)
        if message == Message.SERVERINFO:
            self._server_info(ServerInfo.decode(payload))
        elif message == Message.MODELDEF and self.version is not None:
            self.models, self._refresh_models = decode_models(payload, self.version), False
            self.model_updates += 1
        elif message == Message.ECHORESPONSE:
            self._echo(payload, now)
        elif message in (Message.RESPONSE, Message.UNRECOGNIZED_REQUEST):
            self._response(message, payload)
        elif message in (Message.DISCONNECT, Message.DISCONNECTBYTIMEOUT):
            self.last_problem, self.server = "the server ended the connection", None
        elif message == Message.MESSAGESTRING:
            self.last_problem = "server: " + payload.partition(b"\0")[0][:200].decode("utf-8", "replace")
        return None

    def _server_info(self, info: ServerInfo) -> None:
        """Note that the server introduced itself: for the first time, again, or as another one."""
        same, self.server = info == self.server, info
        if same and (self.choice.pending or self.choice.stream is not None):
            return
        self._in_a_row = 0
        self.choice.server_speaks(info.version)
        self.clock.reset(info.clock_hz)
        self.models = None
        self._timers.now_due("bitstream", "models", "echo")

    def _frame(self, payload: bytes, now: float) -> MarkerFrame | None:
        self._heard = now
        if self.version is None or self.server is None:
            self.early += 1
            return None
        data = decode_frame(payload, self.version)
        self._in_a_row = 0
        arrival = self.order.classify(data.number, now, models_changed=data.has(MODELS_CHANGED))
        if arrival not in (Arrival.NEXT, Arrival.NEW_SESSION):
            return None
        self._notice_models(arrival is Arrival.NEW_SESSION, data.has(MODELS_CHANGED))
        if data.has(BITSTREAM_CHANGED):
            self.choice.ask_again()
        if arrival is Arrival.NEW_SESSION:
            self.clock.reset(self.clock.hz)
            self._timers.now_due("echo")
        self.frames += 1
        return self._on_our_clock(data, now)

    def _notice_models(self, new_session: bool, flagged: bool) -> None:
        """Note a flag that may stay for many frames: its beginning counts, and its end, for changes in between."""
        if new_session or (flagged and not self._models_changing):
            self._forget_models()
        elif self._models_changing and not flagged:
            self._refresh_models = True
            self._timers.now_due("models")
        self._models_changing = flagged

    def _forget_models(self) -> None:
        """Forget names that may have changed: none is better than a wrong one."""
        if self.models is not None:
            self.models = None
            self._timers.now_due("models")

    def _on_our_clock(self, data: MocapFrame, now: float) -> MarkerFrame:
        """Date a frame; before 3.0 servers tell nothing from which its age could be known."""
        suffix, exposure = data.suffix, self.clock.local(data.suffix.mid_exposure)
        latency = None
        if suffix.received and suffix.transmit and self.clock.hz:
            latency = (suffix.transmit - suffix.received) / self.clock.hz
        latest = now + (self.clock.uncertainty(now) or 0.0)
        late = exposure is not None and not now - LONGEST_LATENCY < exposure <= latest
        odd = latency is not None and not 0.0 <= latency < LONGEST_LATENCY
        if late or odd:
            self.impossible += 1
            self.last_problem = "a frame was {} an impossible time".format(
                "exposed at" if late else "at the server for"
            )
        return MarkerFrame(
            self.order.sessions,
            self.frames - 1,
            now,
            None if late else exposure,
            None if odd else latency,
            data,
            self.models,
        )

    def _echo(self, payload: bytes, now: float) -> None:
        client_ns, ticks = protocol.decode_echo(payload)
        if client_ns not in self._echoes:
            raise MalformedPacketError("echo of a request that we did not send", 0, len(payload))
        self._echoes.remove(client_ns)
        if self.clock.add(client_ns * 1e-9, now, ticks):
            self.last_problem = "the server's clock jumped: it was started anew"
            self.order.begin_anew()

    def _response(self, message: int, payload: bytes) -> None:
        if not self.choice.answered(message == Message.RESPONSE, payload):
            self.on_response(message, payload)

    def _complain(self, error: MalformedPacketError) -> None:
        self.malformed += 1
        self._in_a_row += 1
        self.last_problem = str(error)
        if self._in_a_row == MALFORMED_IN_A_ROW:
            self.server = None  # perhaps it was replaced by one of another version
