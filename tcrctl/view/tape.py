"""The messages of a log, as they lie in the file, from any time on."""

from __future__ import annotations

import shlex
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Final, NamedTuple

from mcap.reader import SeekingReader
from mcap.records import Channel, Message, Schema

from tcrctl.errors import InputError, LogError, UnknownNameError
from tcrctl.log.reader import read_log
from tcrctl.log.scan import Scan
from tcrctl.regular_file import open_file
from tcrctl.view.server import ViewChannel

STATIC: Final = "/scene/static"
"""Topic that is written once and holds for the whole log."""


class Sent(NamedTuple):
    """One message: log time [Unix ns], topic, encoded content."""

    time_ns: int
    topic: str
    data: bytes


class Tape:
    """A log, finished or not.

    Attributes:
        path: The file.
        period: Control period [s].
        channels: The topics that are played.
        static: Messages that hold for the whole log.
        first_ns: Log time of the first message [Unix ns].
        last_ns: Log time of the last one.
        damages: What is damaged and left out.
    """

    def __init__(self, path: Path, topics: Collection[str] = ()) -> None:
        """Open a log.

        Args:
            path: The log.
            topics: Which topics; all if empty.

        Raises:
            InputError: If it is not a log, or has no messages.
            UnknownNameError: If it has no such topic.
            LogError: If it would cost more than a log may.
        """
        log = read_log(path, damaged=True)
        self.path, self._complete = path, log.complete and not log.damages
        self.damages = log.damages
        self._epoch_ns, self.period = log.epoch_ns, log.period_s
        self.static: list[Sent] = []
        found = self._read_index() if self._complete else self._read_all()
        for topic in topics:
            if topic not in found:
                raise UnknownNameError("topic", topic, list(found))
        self._topics = list(topics or found)
        self.channels = [found[topic] for topic in self._topics]

    def time_ns(self, t: float) -> int:
        """Log time [Unix ns] of time ``t`` [s] of the run."""
        return self._epoch_ns + round(1e9 * t)

    def messages(self, begin_ns: int) -> Iterator[Sent]:
        """Yield every message from a time on, in the order of time, or of the file if it is cut.

        Args:
            begin_ns: First log time [Unix ns].

        Raises:
            LogError: If the log is damaged inside.
        """
        return self._indexed(begin_ns, self._topics) if self._complete else self._scanned(begin_ns)

    def _read_index(self) -> dict[str, ViewChannel]:
        with open_file(self.path) as stream:
            summary = SeekingReader(stream).get_summary()
        statistics = None if summary is None else summary.statistics
        if summary is None or statistics is None or not statistics.message_count:
            return self._read_all()
        self.first_ns, self.last_ns = statistics.message_start_time, statistics.message_end_time
        self.static = list(self._indexed(0, [STATIC]))
        return {c.topic: _view_channel(c, summary.schemas[c.schema_id]) for c in summary.channels.values()}

    def _read_all(self) -> dict[str, ViewChannel]:
        found: dict[str, ViewChannel] = {}
        schemas: dict[int, Schema] = {}
        names: dict[int, str] = {}
        times: list[int] = []
        for record in Scan(self.path):
            if isinstance(record, Schema):
                schemas[record.id] = record
            elif isinstance(record, Channel):
                names[record.id] = record.topic
                if record.schema_id in schemas:  # else it was in a damaged chunk
                    found[record.topic] = _view_channel(record, schemas[record.schema_id])
            elif isinstance(record, Message):
                times.append(record.log_time)
                if names.get(record.channel_id) == STATIC:
                    self.static.append(Sent(record.log_time, STATIC, record.data))
        if not times:
            raise InputError(f"{self.path}: has nothing to play")
        self.first_ns, self.last_ns = min(times), max(times)
        return found

    def _indexed(self, begin_ns: int, topics: list[str]) -> Iterator[Sent]:
        with open_file(self.path) as stream:
            try:
                for _, channel, message in SeekingReader(stream).iter_messages(topics, starting_at=begin_ns):
                    yield Sent(message.log_time, channel.topic, message.data)
            except Exception as error:  # what damage makes the reader raise has no common base
                hint = f"Save the undamaged steps: tcrctl recover {shlex.quote(str(self.path))}"
                raise LogError(self.path, f"is damaged: {error}", hint=hint) from error

    def _scanned(self, begin_ns: int) -> Iterator[Sent]:
        names: dict[int, str] = {}
        for record in Scan(self.path):
            if isinstance(record, Channel):
                names[record.id] = record.topic
            elif isinstance(record, Message):
                sent = Sent(record.log_time, names.get(record.channel_id, ""), record.data)
                if sent.time_ns >= begin_ns and sent.topic in self._topics:
                    yield sent


def _view_channel(channel: Channel, schema: Schema) -> ViewChannel:
    own = dict(channel.metadata)
    return ViewChannel(
        channel.topic, channel.message_encoding, schema.name, schema.encoding, schema.data, own
    )
