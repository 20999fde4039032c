"""Sequential reading of an MCAP file that may end anywhere or be damaged inside; every byte is checked.

=======================  ==========================================================================================
chunks                   their own CRC; their times are those of their messages
attachments              their own CRC
metadata                 the checksum in them (:mod:`tcrctl.log.seal`)
everything before the    the CRC at the end of the data section, if the run was finished
index
index                    its CRC, if the run was finished
=======================  ==========================================================================================

A record whose length or kind is wrong is left out, and reading goes on with the next one that is beyond doubt.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from mcap.exceptions import InvalidMagic
from mcap.records import (
    Attachment,
    Channel,
    Chunk,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Message,
    Metadata,
    Schema,
)

from tcrctl.errors import InputError, LogError
from tcrctl.log.chunks import ChunkError, Expansion, TooLargeError
from tcrctl.log.frames import HEAD, MAGIC, Frames, attachment_is_whole, parsed
from tcrctl.log.seal import unsealed
from tcrctl.regular_file import open_file

_WANTED: Final = (Header, Schema, Channel, Message, Attachment, Metadata)
#: No file has more findings than are worth telling.
_MOST_DAMAGES: Final = 20


@dataclass(slots=True)
class Scan:
    """One pass over a file; iterate it once, then look at the attributes.

    Attributes:
        path: The file.
        chunks: Look into chunks; else they are passed over.
        reached_end: Footer and closing magic were read.
        indexed: There is an index.
        damaged_chunks: Chunks that were skipped because something in them is wrong.
        damages: What is wrong, each with the record; a file that only ends too early has none.
    """

    path: Path
    chunks: bool = True
    reached_end: bool = field(default=False, init=False)
    indexed: bool = field(default=False, init=False)
    damaged_chunks: int = field(default=0, init=False)
    damages: list[str] = field(default_factory=list, init=False)
    _crc: int = field(default=0, init=False)
    _summary: int = field(default=0, init=False)
    _number: int = field(default=-1, init=False)

    def __iter__(self) -> Iterator[McapRecord]:
        """Yield the records in file order; a chunk is yielded whole or not at all.

        Raises:
            LogError: If chunks expand to more than they may.
        """
        with open_file(self.path) as stream:
            frames = Frames(stream)
            expansion = Expansion(frames.size)
            opening = frames.bytes_at(0, len(MAGIC))
            if opening != MAGIC:
                self._damaged("the first bytes")
            self._crc = zlib.crc32(opening)
            for record in self._records(frames):
                if isinstance(record, Chunk):
                    yield from self._content(record, expansion)
                elif isinstance(record, _WANTED):
                    yield record

    def _damaged(self, what: str) -> None:
        if len(self.damages) < _MOST_DAMAGES:
            self.damages.append(what)

    def _records(self, frames: Frames) -> Iterator[McapRecord]:
        offset: int | None = len(MAGIC)
        while offset is not None:
            head = frames.head(offset)
            body = b"" if head is None else frames.bytes_at(offset + HEAD, head[1])
            record = None if head is None else parsed(head[0], body)
            if head is None or record is None:
                offset = self._skipped(frames, offset, cut=head is None)
                continue
            whole = self._checked(record, body)
            if isinstance(record, Footer):
                self._end(frames, record, body, offset)
                return
            self._crc = zlib.crc32(body, zlib.crc32(frames.bytes_at(offset, HEAD), self._crc))
            if isinstance(record, DataEnd):  # the index has a checksum of its own
                self._crc, self._summary = 0, offset + HEAD + len(body)
            offset += HEAD + len(body)
            if whole is not None:
                yield whole

    def _skipped(self, frames: Frames, offset: int, *, cut: bool) -> int | None:
        """Return where reading goes on after a record that is none; a file that just ends is not damaged."""
        following = frames.again(offset + 1)
        ends = frames.bytes_at(frames.size - len(MAGIC), len(MAGIC)) == MAGIC
        blank = not any(frames.bytes_at(offset, HEAD))  # room that a power cut left empty
        if following is not None or ends or not (cut or blank):
            self._damaged(f"the record at byte {offset}")
        return following

    def _checked(self, record: McapRecord, body: bytes) -> McapRecord | None:
        """Return a record if its own checksum agrees."""
        if isinstance(record, Attachment) and not attachment_is_whole(body):
            self._damaged(f"attachment {record.name}")
            return None
        if isinstance(record, Metadata):
            entries = unsealed(record.name, record.metadata)
            if entries is None:
                self._damaged(f"metadata {record.name}")
                return None
            return Metadata(record.name, entries)
        wrong = isinstance(record, DataEnd) and record.data_section_crc not in (0, self._crc)
        if wrong and not self.damages:
            inside = "the header, or an index between chunks"
            self._damaged(inside if self.chunks else "a chunk, or what lies beside it")
        return record

    def _content(self, chunk: Chunk, expansion: Expansion) -> list[McapRecord]:
        self._number += 1
        try:
            if self.chunks:
                return expansion.content(chunk)
            expansion.check(chunk)
        except TooLargeError as error:
            raise LogError(self.path, f"cannot be read: chunk {self._number}: {error}") from error
        except ChunkError as error:
            self.damaged_chunks += 1
            self._damaged(f"chunk {self._number}: {error}")
        return []

    def _end(self, frames: Frames, footer: Footer, body: bytes, offset: int) -> None:
        """Check footer, index and closing magic."""
        crc = zlib.crc32(body[:-4], zlib.crc32(frames.bytes_at(offset, HEAD), self._crc))
        if footer.summary_crc not in (0, crc) or footer.summary_start not in (0, self._summary):
            self._damaged("the index at the end")
        end = offset + HEAD + len(body)
        closing = frames.bytes_at(end, len(MAGIC) + 1)
        if closing == MAGIC:
            self.reached_end, self.indexed = True, footer.summary_start != 0
        elif len(closing) >= len(MAGIC):
            self._damaged("the last bytes")


def check_is_mcap(path: Path) -> None:
    """Make sure that ``path`` is a readable file that begins, or at least ends, like an MCAP file.

    Raises:
        InputError: If it is not.
    """
    try:
        with open_file(path) as stream:
            magic = stream.read(len(MAGIC))
            end = magic
            if len(magic) == len(MAGIC) and stream.seek(0, 2) > 2 * len(MAGIC):
                stream.seek(-len(MAGIC), 2)
                end = stream.read()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error
    if not magic:
        raise InputError(f"{path}: is empty")
    if MAGIC not in (magic, end):
        raise InputError(f"{path}: is not an MCAP file") from InvalidMagic(tuple(magic))
