"""Mending an unfinished or damaged log: everything that is whole, in a new finished file."""

from __future__ import annotations

import itertools
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mcap.records import Attachment, Channel, McapRecord, Message, Metadata, Schema

from tcrctl.errors import InputError, LogError
from tcrctl.log.mcap_file import STEP_TOPIC, STOP, TRUNCATED, new_mcap
from tcrctl.log.reader import read_log
from tcrctl.log.scan import Scan
from tcrctl.log.seal import sealed
from tcrctl.log.writer import open_new


@dataclass(frozen=True, slots=True)
class Recovery:
    """What a recovery saved.

    Attributes:
        path: The new file.
        steps: Steps saved.
        messages: Messages saved on all topics.
        attachments: Attachments saved.
        damaged_chunks: Chunks that had to be left out.
        lossy: True if something may be missing: the input had no stop record, the disk was full before it, or
            something in it was damaged.
        damages: What was damaged, each with the record.
    """

    path: Path
    steps: int
    messages: int
    attachments: int
    damaged_chunks: int
    lossy: bool
    damages: tuple[str, ...] = ()


class _Copy:
    """Copies records into a new file, giving schemas and channels new numbers."""

    def __init__(self, writer: Any) -> None:
        self._writer = writer
        self._schemas = {0: 0}
        self._channels: dict[int, int] = {}
        self._step_channels: set[int] = set()
        self.stop: dict[str, str] | None = None
        self.steps = self.messages = self.attachments = 0

    def add(self, record: McapRecord) -> None:
        if isinstance(record, Message):
            self._message(record)
        elif isinstance(record, Schema):
            if record.id not in self._schemas:
                self._schemas[record.id] = self._writer.register_schema(
                    record.name, record.encoding, record.data
                )
        elif isinstance(record, Channel):
            self._channel(record)
        elif isinstance(record, Attachment):
            times = record.create_time, record.log_time
            self._writer.add_attachment(*times, record.name, record.media_type, record.data)
            self.attachments += 1
        elif isinstance(record, Metadata) and record.name == STOP:
            self.stop = record.metadata
        elif isinstance(record, Metadata):
            self._writer.add_metadata(record.name, sealed(record.name, record.metadata))

    def _channel(self, record: Channel) -> None:
        if record.id in self._channels or record.schema_id not in self._schemas:
            return
        self._channels[record.id] = self._writer.register_channel(
            record.topic, record.message_encoding, self._schemas[record.schema_id], record.metadata
        )
        if record.topic == STEP_TOPIC:
            self._step_channels.add(record.id)

    def _message(self, record: Message) -> None:
        channel = self._channels.get(record.channel_id)
        if channel is None:  # its channel was in a damaged chunk: the message has no meaning any more
            return
        self._writer.add_message(channel, record.log_time, record.data, record.publish_time, record.sequence)
        self.messages += 1
        self.steps += record.channel_id in self._step_channels


def recover(path: str | os.PathLike[str], out: str | os.PathLike[str]) -> Recovery:
    """Copy every whole record of a log into a finished, indexed file.

    Messages are copied as bytes. A stop record is copied if there is one, else one is made with status
    ``error`` and ``recovered = true``.

    Args:
        path: The log; it is not changed.
        out: The file to create; it must not exist.

    Raises:
        InputError: If ``path`` is not a log of tcrctl, or ``out`` exists.
        LogError: If ``out`` cannot be written; nothing is left behind.
    """
    source, target = read_log(path, damaged=True).path, Path(out)
    try:
        stream = open_new(target)
    except FileExistsError as error:
        raise InputError(f"{target}: exists already; a log is never overwritten") from error
    except OSError as error:
        raise LogError(target, f"cannot be created: {error.strerror or error}") from error
    try:
        with stream:
            return _recover_into(new_mcap(stream), source, target)
    except LogError:
        target.unlink(missing_ok=True)
        raise
    except OSError as error:
        target.unlink(missing_ok=True)
        raise LogError(target, f"cannot be written: {error.strerror or error}") from error


def _recover_into(writer: Any, source: Path, target: Path) -> Recovery:
    copy = _Copy(writer)
    # The index repeats schemas and channels: with them, messages survive the loss of the first chunk.
    definitions = [record for record in Scan(source) if isinstance(record, Schema | Channel)]
    scan = Scan(source)
    for record in itertools.chain(definitions, scan):
        copy.add(record)
    lossy = copy.stop is None or TRUNCATED in copy.stop or bool(scan.damages)
    stop = copy.stop or {
        "status": "error",
        "reason": "not finished; recovered up to the last flush",
    }
    mark = {"recovered": "true", "steps": str(copy.steps)} if lossy else {}
    writer.flush()
    writer.add_metadata(STOP, sealed(STOP, {**stop, **mark}))
    writer.finish()
    damages = tuple(scan.damages)
    return Recovery(target, copy.steps, copy.messages, copy.attachments, scan.damaged_chunks, lossy, damages)
