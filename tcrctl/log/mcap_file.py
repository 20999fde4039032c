"""Layout of one log file: what is written, in which order. Owned by one thread at a time."""

from __future__ import annotations

import errno
import math
import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Final

from foxglove_schemas_protobuf.Log_pb2 import Log as FoxgloveLog
from mcap.data_stream import RecordBuilder
from mcap.records import DataEnd, Footer, Metadata
from mcap.writer import LIBRARY_IDENTIFIER, MCAP0_MAGIC, CompressionType, Writer

from tcrctl import __version__
from tcrctl.log.codec import encode
from tcrctl.log.event import LEVELS, Event
from tcrctl.log.geometry import LogGeometry
from tcrctl.log.schema import VERSION, descriptor_set, public_descriptor, units
from tcrctl.log.seal import sealed
from tcrctl.log.steps import StepEncoder
from tcrctl.log.viewer_topics import TOPICS, ViewerTopics, stamp
from tcrctl.signals import StepRecord

START: Final = "tcrctl.run.start"
STOP: Final = "tcrctl.run.stop"
STEP_TOPIC: Final = "/tcrctl/step"
EVENT_TOPIC: Final = "/tcrctl/event"
LOG_TOPIC: Final = "/log"
#: Entry of a stop record that was written after steps were lost.
TRUNCATED: Final = "truncated"
LIBRARY: Final = f"tcrctl/{__version__} {LIBRARY_IDENTIFIER}"

Attachments = Mapping[str, tuple[str, bytes]]
Tap = Callable[[str, int, bytes], None]
"""Takes topic, log time [Unix ns] and content of every message that is written; must neither wait nor raise."""


_CHUNK_BYTES: Final = 2**20


def new_mcap(stream: IO[bytes], chunk_size: int = _CHUNK_BYTES) -> Writer:
    """Start a writer with the header of our logs, which ends a zstd chunk that is longer than ``chunk_size``."""
    # Offsets into the summary are optional, and mcap writes wrong ones for groups without entries.
    writer = Writer(
        stream, chunk_size, CompressionType.ZSTD, use_summary_offsets=False, enable_data_crcs=True
    )
    writer.start(profile="", library=LIBRARY)
    return writer


def _end_of_file(stop: Mapping[str, str]) -> bytes:
    """Stop record and the end of a file without index."""
    builder: Any = RecordBuilder()
    Metadata(name=STOP, metadata=sealed(STOP, stop)).write(builder)
    DataEnd(data_section_crc=0).write(builder)
    Footer(summary_start=0, summary_offset_start=0, summary_crc=0).write(builder)
    return bytes(builder.end()) + MCAP0_MAGIC


@dataclass(frozen=True, slots=True)
class Opening:
    """What a log is told before the first step.

    Attributes:
        attachments: Media type and content by file name, in the order in which they are written.
        start: Metadata ``tcrctl.run.start``; schema version, epoch and period are added.
        geometry: Names and topology of the robot.
        epoch_ns: Unix time of t = 0 [ns].
        period_s: Control period [s].
        full_state_s: Time between two steps that are written in full [s]; 0: every step. See
            :mod:`tcrctl.log.schema`.
    """

    attachments: Attachments
    start: Mapping[str, str]
    geometry: LogGeometry
    epoch_ns: int
    period_s: float
    full_state_s: float = 0.0


class McapFile:
    """Writes header, attachments and start metadata when made; then steps and events; last the stop."""

    def __init__(self, stream: IO[bytes], opening: Opening) -> None:
        """Write everything that is known before the first step."""
        epoch_ns, period_s = opening.epoch_ns, opening.period_s
        self._stream, self._epoch_ns = stream, epoch_ns
        self._viewer = ViewerTopics(opening.geometry, period_s)
        self._encoder = StepEncoder(max(1, round(opening.full_state_s / period_s)))
        # Chunks end in flush() only, which lets the encoder begin anew.
        self._writer: Any = new_mcap(stream, chunk_size=2**62)
        self._chunk = 0
        self._whole: list[int] = []  # where the file ended after each of the last two flushes
        for name, (media_type, data) in opening.attachments.items():
            self._writer.add_attachment(epoch_ns, epoch_ns, name, media_type, data)
        own = {"log_schema": VERSION, "epoch_ns": str(epoch_ns), "period_s": repr(period_s)}
        self._writer.add_metadata(START, sealed(START, {**opening.start, **own}))
        self._schemas: dict[str, int] = {}
        self._channels = self._register(opening.geometry)
        self._events = 0
        self.tap: Tap | None = None
        self.steps = 0
        self.unflushed = 0
        # Schemas and channels live in the first chunk, and a chunk needs a message: now all of it is on file.
        self.event(Event(0.0, "log", "info", "log opened"))
        self.flush()

    def _register(self, geometry: LogGeometry) -> dict[str, int]:
        names = {
            "nodes": ",".join(geometry.node_names),
            "cables": ",".join(geometry.cable_names),
            "markers": ",".join(geometry.marker_names),
        }
        step_units = {f"unit.{path}": unit for path, unit in units().items()}
        channels = {
            STEP_TOPIC: self._channel(STEP_TOPIC, public_descriptor("Step"), {**names, **step_units}),
            EVENT_TOPIC: self._channel(EVENT_TOPIC, public_descriptor("Event"), {"unit.t": "s"}),
            LOG_TOPIC: self._channel(LOG_TOPIC, FoxgloveLog.DESCRIPTOR, {"derived": "true"}),
        }
        for topic, message in TOPICS.items():
            shared = {"derived": "true", "shape": "truth if simulated, else estimate", "unit": "m"}
            channels[topic] = self._channel(topic, message.DESCRIPTOR, shared)
        return channels

    def _channel(self, topic: str, descriptor: Any, metadata: dict[str, str]) -> int:
        name = descriptor.full_name
        if name not in self._schemas:
            self._schemas[name] = self._writer.register_schema(name, "protobuf", descriptor_set(descriptor))
        number: int = self._writer.register_channel(topic, "protobuf", self._schemas[name], metadata)
        return number

    def time_ns(self, t: float) -> int:
        """Return the Unix nanoseconds of time ``t`` [s] of the run.

        Raises:
            ValueError: If ``t`` is not finite or outside what the file can hold.
        """
        nanoseconds = t * 1e9  # infinite for a huge t
        if not math.isfinite(nanoseconds) or not 0 <= (time := self._epoch_ns + round(nanoseconds)) < 2**64:
            raise ValueError(f"t = {t} s is not a time the log can hold")
        return time

    def step(self, record: StepRecord) -> None:
        """Write a step and the viewer topics due at it."""
        if self._chunk >= _CHUNK_BYTES:
            self.flush()
        now = self.time_ns(record.t)
        try:
            measured = self.time_ns(record.measurement.t)
        except ValueError:  # nothing measured yet: the field keeps the value, the index needs a number
            measured = now
        self._add(STEP_TOPIC, now, self._encoder.encode(record), record.k, measured)
        for topic, data in self._viewer.messages(record, now):
            self._add(topic, now, data, record.k, now)
        self.steps += 1
        self.unflushed += 1

    def event(self, event: Event) -> None:
        """Write an event for machines and for the log panel of viewers."""
        now = self.time_ns(event.t)
        self._add(EVENT_TOPIC, now, encode("Event", event), self._events, now)
        level: Any = LEVELS[event.level]
        line = FoxgloveLog(timestamp=stamp(now), level=level, message=event.message, name=event.kind)
        self._add(LOG_TOPIC, now, line.SerializeToString(), self._events, now)
        self._events += 1
        self.unflushed += 1

    def _add(self, topic: str, log_time: int, data: bytes, sequence: int, publish_time: int) -> None:
        self._chunk += len(data)
        self._writer.add_message(self._channels[topic], log_time, data, publish_time, sequence % 2**32)
        if self.tap is not None:
            self.tap(topic, log_time, data)

    def flush(self, *, to_disk: bool = False) -> None:
        """End the chunk and hand it to the operating system, and to the disk if ``to_disk``."""
        self._writer.flush()
        self._encoder.restart()
        self._chunk = 0
        if to_disk:
            getattr(os, "fdatasync", os.fsync)(self._stream.fileno())
        self._whole = [*self._whole[-1:], self._stream.tell()]
        self.unflushed = 0

    def cut_short(self, path: Path, stop: Mapping[str, str]) -> None:
        """Cut off what a failed write has left, and write the stop record in its place.

        If the room is not enough, the last whole chunk has to give way. There is no index; ``tcrctl recover`` makes
        one.

        Args:
            path: The file.
            stop: Content of the stop record; a mark is added that steps are missing.

        Raises:
            OSError: If the file system does not even take that.
        """
        # What the stream has not written yet must not come after the end.
        getattr(self._stream, "raw", self._stream).close()
        end = _end_of_file({**stop, TRUNCATED: "true"})
        for whole in reversed(self._whole):
            with suppress(OSError), open(path, "r+b", buffering=0) as file:
                file.truncate(whole)
                file.seek(whole)
                if file.write(end) == len(end):
                    return
                file.truncate(whole)
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def finish(self, stop: Mapping[str, str]) -> None:
        """Write the stop record, index and footer; ``steps`` is added to the record."""
        self.flush()
        self._writer.add_metadata(STOP, sealed(STOP, {"steps": str(self.steps), **stop}))
        self._writer.finish()
        self._stream.flush()
