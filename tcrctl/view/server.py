"""A WebSocket server for the Foxglove app that passes encoded messages on."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from types import ModuleType, TracebackType
from typing import Any, Final, Self

from tcrctl.errors import DeviceError, InputError

HOST: Final = "127.0.0.1"
PORT: Final = 8765
#: Messages that wait for a slow client before the oldest is dropped; two minutes of all viewer topics.
_BACKLOG: Final = 20000


@dataclass(frozen=True, slots=True)
class ViewChannel:
    """A topic and how its messages are encoded, as in an MCAP file.

    Attributes:
        topic: Name.
        encoding: Encoding of the messages.
        schema_name: Name of the schema.
        schema_encoding: Encoding of the schema.
        schema: The schema.
        metadata: Anything else.
    """

    topic: str
    encoding: str
    schema_name: str
    schema_encoding: str
    schema: bytes
    metadata: dict[str, str] = field(default_factory=dict)


def foxglove_sdk() -> ModuleType:
    """Return the package that the server is made with.

    Raises:
        InputError: If it is not installed.
    """
    try:
        import foxglove
    except ImportError as error:
        hint = "Install it: pip install 'tcrctl[view]'"
        raise InputError("the live view needs the package foxglove-sdk", hint=hint) from error
    return foxglove


class Listener:
    """What clients ask for; called by the server's own threads."""

    def __init__(self, on_control: Callable[[Any], Any] | None) -> None:
        """Make a listener; ``on_control`` answers a playback request with the new playback state."""
        self._on_control = on_control
        self._lock = threading.Lock()
        self._asked: set[str] = set()
        self.subscribed = threading.Event()

    def on_subscribe(self, client: Any, channel: Any) -> None:
        """Note that somebody wants to see a topic."""
        with self._lock:
            self._asked.add(channel.topic)
        self.subscribed.set()

    def on_unsubscribe(self, client: Any, channel: Any) -> None:
        """Do nothing: the server stops sending."""

    def on_playback_control_request(self, request: Any) -> Any:
        """Play, pause, change speed or seek."""
        return None if self._on_control is None else self._on_control(request)

    def take_asked(self) -> set[str]:
        """Return the topics that were subscribed to since the last call."""
        if not self._asked:
            return set()
        with self._lock:
            asked, self._asked = self._asked, set()
        return asked


class ViewServer:
    """Serves topics until it is closed; a context manager.

    Whoever subscribes late, or while nothing moves, gets the last message of the topic: a scene that is written
    once is seen by everybody. Only one thread may send.
    """

    def __init__(
        self,
        channels: Iterable[ViewChannel],
        *,
        name: str,
        host: str = HOST,
        port: int = PORT,
        span_ns: tuple[int, int] | None = None,
        on_control: Callable[[Any], Any] | None = None,
    ) -> None:
        """Start serving.

        Args:
            channels: What is served.
            name: Shown in the app.
            host: Address to listen at.
            port: Port to listen at; 0 takes a free one.
            span_ns: First and last time of a recording [Unix ns]; the app then shows a time bar.
            on_control: Answers what is done with it.

        Raises:
            InputError: If the package it needs is not installed.
            DeviceError: If the address cannot be used.
        """
        sdk = foxglove_sdk()
        self._listener = Listener(on_control)
        self._context = sdk.Context()  # its channels close without a word when it is collected
        capabilities = [sdk.Capability.Time] if span_ns else []
        try:
            self._server = sdk.start_server(
                name=name,
                host=host,
                port=port,
                context=self._context,
                server_listener=self._listener,
                capabilities=capabilities,
                playback_time_range=span_ns,
                message_backlog_size=_BACKLOG,
            )
        except Exception as error:
            hint = "Is another view being served? Choose another port; 0 takes a free one."
            raise DeviceError(f"cannot serve at {host}:{port}: {error}", hint=hint) from error
        self._channels = {channel.topic: _channel(sdk, self._context, channel) for channel in channels}
        self._latest: dict[str, tuple[int, bytes]] = {}
        self.url = f"ws://{host}:{self._server.port}"

    @property
    def app_url(self) -> str:
        """Address that opens the app and connects it to this server."""
        return self._server.app_url() or ""

    def wait_for_viewer(self, seconds: float) -> bool:
        """Wait until somebody has subscribed to something; False if nobody did within ``seconds``."""
        return self._listener.subscribed.wait(seconds)

    def send(self, topic: str, time_ns: int, data: bytes) -> None:
        """Send a message of a topic to who subscribed to it; never waits for them.

        Args:
            topic: One of the channels; others are ignored.
            time_ns: Log time [Unix ns].
            data: The encoded message.
        """
        self.refresh()
        channel = self._channels.get(topic)
        if channel is None:
            return
        self._latest[topic] = time_ns, data
        if channel.has_sinks():
            channel.log(data, log_time=time_ns)

    def refresh(self) -> None:
        """Send the last message of every topic that was subscribed to since the last time."""
        for topic in self._listener.take_asked():
            if topic in self._latest:
                time_ns, data = self._latest[topic]
                self._channels[topic].log(data, log_time=time_ns)

    def forget(self) -> None:
        """Forget the last messages: what comes next is of another time."""
        self._latest.clear()

    def tell_time(self, time_ns: int) -> None:
        """Tell everybody what time the messages are of [Unix ns]."""
        self._server.broadcast_time(time_ns)

    def tell_state(self, state: Any) -> None:
        """Tell everybody how a recording is played."""
        self._server.broadcast_playback_state(state)

    def close(self) -> None:
        """Stop serving."""
        with suppress(Exception):  # a server that has gone is closed
            self._server.stop()

    def __enter__(self) -> Self:
        """Return the server."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop serving."""
        self.close()


def _channel(sdk: ModuleType, context: Any, channel: ViewChannel) -> Any:
    schema = sdk.Schema(name=channel.schema_name, encoding=channel.schema_encoding, data=channel.schema)
    return sdk.Channel(
        channel.topic,
        schema=schema,
        message_encoding=channel.encoding,
        context=context,
        metadata=channel.metadata,
    )
