"""Sequential reading of an MCAP file that may end anywhere or be damaged inside."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from mcap.exceptions import InvalidMagic
from mcap.records import Attachment, Channel, Chunk, Header, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk

from tcrctl.errors import InputError

_MAGIC: Final = b"\x89MCAP0\r\n"
_WANTED: Final = (Header, Schema, Channel, Message, Attachment, Metadata)


@dataclass(slots=True)
class Scan:
    """One pass over a file; iterate it once, then look at the attributes.

    Attributes:
        path: The file.
        reached_end: Footer and closing magic were read.
        damaged_chunks: Chunks whose checksum or content was wrong and that were skipped.
    """

    path: Path
    reached_end: bool = False
    damaged_chunks: int = 0

    def __iter__(self) -> Iterator[McapRecord]:
        """Yield the records in file order; a chunk is yielded whole or not at all."""
        with open(self.path, "rb") as stream:
            # A garbage length must not make the reader allocate more than the file can hold.
            limit = os.fstat(stream.fileno()).st_size
            records = iter(StreamReader(stream, emit_chunks=True, record_size_limit=limit).records)
            while True:
                try:
                    record = next(records)
                except StopIteration:
                    self.reached_end = True
                    return
                # What a cut file makes the reader raise has no common base: EndOfFile, struct.error, ...
                except Exception:
                    return
                if isinstance(record, Chunk):
                    yield from self._content(record)
                elif isinstance(record, _WANTED):
                    yield record

    def _content(self, chunk: Chunk) -> list[McapRecord]:
        try:
            return breakup_chunk(chunk, validate_crc=True)
        except Exception:  # zstd errors, checksum, struct.error, ...: as above
            self.damaged_chunks += 1
            return []


def check_is_mcap(path: Path) -> None:
    """Make sure that ``path`` is a readable file that begins like an MCAP file.

    Raises:
        InputError: If it is not.
    """
    try:
        with open(path, "rb") as stream:
            magic = stream.read(len(_MAGIC))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error
    if not magic:
        raise InputError(f"{path}: is empty")
    if magic != _MAGIC:
        raise InputError(f"{path}: is not an MCAP file") from InvalidMagic(tuple(magic))
