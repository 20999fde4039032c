"""The content of a chunk, within bounds: a few kilobytes may claim, or become, gigabytes."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, field
from typing import Final

import zstandard
from mcap.records import Chunk, McapRecord, Message
from mcap.stream_reader import breakup_chunk

#: Largest chunk, expanded [bytes]; ours end at 1 MiB and a step.
MAX_CHUNK: Final = 8 * 2**20
#: All chunks of a file may expand to this much [bytes], and to this many times the size of the file.
MAX_ALL: Final = 8 * 2**20
MAX_RATIO: Final = 100


class ChunkError(Exception):
    """A chunk cannot be taken; says why."""


class TooLargeError(ChunkError):
    """It costs more than it may."""


@dataclass(slots=True)
class Expansion:
    """Expands the chunks of one file.

    Attributes:
        file_size: Size of the file [bytes].
        expanded: What all chunks have become so far [bytes].
    """

    file_size: int
    expanded: int = field(default=0, init=False)

    def content(self, chunk: Chunk) -> list[McapRecord]:
        """Return the records of a chunk.

        Raises:
            ChunkError: If one bit of it is wrong, or it is too large.
        """
        self.check(chunk)
        data = chunk.data if not chunk.compression else _decompressed(chunk)
        if len(data) != chunk.uncompressed_size:
            raise ChunkError(f"has {len(data)} bytes, not {chunk.uncompressed_size}")
        if chunk.uncompressed_crc not in (0, zlib.crc32(data)):
            raise ChunkError("wrong checksum")
        plain = Chunk("", data, chunk.message_end_time, chunk.message_start_time, 0, len(data))
        try:
            records = breakup_chunk(plain)
        except Exception as error:  # EndOfFile, struct.error, ...: there is no common base
            raise ChunkError("its records cannot be read") from error
        times = [record.log_time for record in records if isinstance(record, Message)]
        if times and (min(times), max(times)) != (chunk.message_start_time, chunk.message_end_time):
            raise ChunkError("its times are not those of its messages")
        return records

    def check(self, chunk: Chunk) -> None:
        """Make sure of what a chunk and all before it expand to, without expanding it.

        Raises:
            ChunkError: If it is too large.
        """
        size = max(chunk.uncompressed_size, _told_size(chunk))
        if size > MAX_CHUNK:
            raise TooLargeError(f"expands to {size} bytes, the limit is {MAX_CHUNK}")
        self.expanded += size
        limit = MAX_ALL + MAX_RATIO * self.file_size
        if self.expanded > limit:
            raise TooLargeError(f"all chunks expand to {self.expanded} bytes or more, the limit is {limit}")


def _told_size(chunk: Chunk) -> int:
    """Return what the compressed data say that they expand to [bytes]; 0 if they do not."""
    try:
        return zstandard.frame_content_size(chunk.data) if chunk.compression == "zstd" else 0
    except zstandard.ZstdError:
        return 0


def _decompressed(chunk: Chunk) -> bytes:
    if chunk.compression != "zstd":
        raise ChunkError(f"compression {chunk.compression!r} is not known")
    try:
        return zstandard.decompress(chunk.data, max_output_size=max(1, chunk.uncompressed_size))
    except zstandard.ZstdError as error:
        raise ChunkError("cannot be decompressed") from error
