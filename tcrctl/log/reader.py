"""Reading a log back, finished or not."""

from __future__ import annotations

import math
import os
import re
import shlex
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from google.protobuf.message import DecodeError
from mcap.records import Attachment, Channel, Header, Message, Metadata
from numpy.typing import NDArray

from tcrctl.errors import InputError, LogError
from tcrctl.log.codec import decode_event
from tcrctl.log.event import Event
from tcrctl.log.mcap_file import EVENT_TOPIC, START, STEP_TOPIC, STOP
from tcrctl.log.scan import Scan, check_is_mcap
from tcrctl.log.steps import StepDecoder
from tcrctl.signals import StepRecord

_USUAL_PERIOD_S: Final = 0.05


@dataclass(frozen=True, slots=True)
class Log:
    """One log file; the steps stay on disk until asked for.

    Attributes:
        path: The file.
        start: Metadata ``tcrctl.run.start``.
        stop: Metadata ``tcrctl.run.stop``, or None if the run was not finished.
        attachments: Media type and content by name, in file order.
        complete: The file has its stop record and its footer; nothing is missing.
        node_names: Names of the rows of ``q``, ``base.n1, ...``; empty if no step was flushed.
        cable_names: Names of the entries of ``drive``; empty as above.
        marker_names: Names of the rows of ``Measurement.nodes``; empty as above.
        damages: What was found damaged, if that was allowed.
    """

    path: Path
    start: dict[str, str]
    stop: dict[str, str] | None
    attachments: dict[str, tuple[str, bytes]]
    complete: bool
    node_names: tuple[str, ...]
    cable_names: tuple[str, ...]
    marker_names: tuple[str, ...]
    damages: tuple[str, ...] = ()

    @property
    def epoch_ns(self) -> int:
        """Unix time of t = 0 [ns]; 0 if the log does not tell."""
        told = self.start.get("epoch_ns", "")
        return int(told) if re.fullmatch("[0-9]{1,19}", told) else 0

    @property
    def period_s(self) -> float:
        """Control period [s]; that of our experiments if the log does not tell."""
        try:
            told = float(self.start.get("period_s", ""))
        except ValueError:
            return _USUAL_PERIOD_S
        return told if 0.0 < told < math.inf else _USUAL_PERIOD_S

    def steps(self) -> Iterator[StepRecord]:
        """Yield every step that is whole, in the order written, with arrays equal bit for bit.

        A step that builds on one in a damaged chunk is lost with it.

        Raises:
            LogError: If the file is damaged inside, or a step is not one of this schema.
        """
        decoder = StepDecoder()
        for message in self._messages(STEP_TOPIC):
            try:
                step = decoder.decode(message.data)
                if step is not None:
                    yield step
            except (DecodeError, ValueError) as error:
                raise LogError(self.path, f"step {message.sequence} cannot be decoded: {error}") from error

    def events(self) -> Iterator[Event]:
        """Yield every event, in the order written.

        Raises:
            LogError: As :meth:`steps`.
        """
        for message in self._messages(EVENT_TOPIC):
            try:
                yield decode_event(message.data)
            except (DecodeError, ValueError) as error:
                raise LogError(self.path, f"event {message.sequence} cannot be decoded: {error}") from error

    def columns(self, names: Collection[str] | None = None) -> dict[str, NDArray[Any]]:
        """Return one array per quantity, first axis = step; see :mod:`tcrctl.log.columns` for names and units.

        Args:
            names: Which ones; all if None.

        Raises:
            UnknownNameError: If a name does not exist.
            LogError: As :meth:`steps`.
        """
        from tcrctl.log.columns import stack

        return stack(self.steps(), names)

    def _messages(self, topic: str) -> Iterator[Message]:
        scan = Scan(self.path)
        channels: set[int] = set()
        for record in scan:
            if isinstance(record, Channel) and record.topic == topic:
                channels.add(record.id)
            elif isinstance(record, Message) and record.channel_id in channels:
                yield record
        if scan.damages or (self.complete and not scan.reached_end):
            raise _damaged(self.path, scan.damages)


def _damaged(path: Path, damages: list[str]) -> LogError:
    what = "; ".join(damages) or "the end is missing"
    hint = f"Save what is undamaged: tcrctl recover {shlex.quote(str(path))}"
    return LogError(path, f"is damaged: {what}", hint=hint)


def read_log(path: str | os.PathLike[str], *, damaged: bool = False) -> Log:
    """Open a log.

    Args:
        path: An MCAP file written by :class:`tcrctl.log.writer.LogWriter`; it may end anywhere.
        damaged: Also open one that is damaged; what is damaged is left out.

    Returns:
        The log, with ``complete`` False if the file has no footer or no stop record.

    Raises:
        InputError: If the file does not exist, or is not a log of tcrctl.
        LogError: If it is damaged outside its chunks, or anywhere if the run was finished.
    """
    path = Path(path)
    check_is_mcap(path)
    scan = Scan(path, chunks=False)
    records = list(scan)
    if scan.damages and not damaged:
        raise _damaged(path, _named(path, scan.damages))
    if not any(isinstance(record, Channel) for record in records):  # no index: the first chunk has them
        records += [record for record in Scan(path) if isinstance(record, Channel)]
    metadata = {record.name: record.metadata for record in records if isinstance(record, Metadata)}
    header = next((record for record in records if isinstance(record, Header)), None)
    if START not in metadata and not (header and header.library.startswith("tcrctl/")):
        raise InputError(f"{path}: is an MCAP file, but not a log of tcrctl")
    names = next((c.metadata for c in records if isinstance(c, Channel) and c.topic == STEP_TOPIC), {})
    return Log(
        path=path,
        start=metadata.get(START, {}),
        stop=metadata.get(STOP),
        attachments={a.name: (a.media_type, a.data) for a in records if isinstance(a, Attachment)},
        complete=scan.indexed and STOP in metadata,
        damages=tuple(scan.damages),
        node_names=_split(names.get("nodes", "")),
        cable_names=_split(names.get("cables", "")),
        marker_names=_split(names.get("markers", "")),
    )


def _split(names: str) -> tuple[str, ...]:
    return tuple(names.split(",")) if names else ()


def _named(path: Path, damages: list[str]) -> list[str]:
    """Return the damages with the chunks that are meant."""
    closer = Scan(path)
    for _ in closer:
        pass
    return closer.damages or damages
