"""The records of an MCAP file as bytes: where each begins, and where the next one is if a length is wrong.

Every record is an opcode (1 byte), a length (8 bytes) and a body. A record is known by its whole: the body must be
used up by its fields, and what has a checksum must agree with it.
"""

from __future__ import annotations

import os
import re
import struct
import zlib
from collections.abc import Iterator
from io import BytesIO
from typing import Any, Final

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from tcrctl.log.seal import unsealed

MAGIC: Final = b"\x89MCAP0\r\n"
HEAD: Final = 9  # bytes of opcode and length
#: Bytes of records that are tried where one might begin again, beside the size of the file.
MOST_TRIED: Final = 2**24

_READERS: Final[dict[int, Any]] = {
    Opcode.HEADER: Header,
    Opcode.FOOTER: Footer,
    Opcode.SCHEMA: Schema,
    Opcode.CHANNEL: Channel,
    Opcode.CHUNK: Chunk,
    Opcode.MESSAGE_INDEX: MessageIndex,
    Opcode.CHUNK_INDEX: ChunkIndex,
    Opcode.ATTACHMENT: Attachment,
    Opcode.ATTACHMENT_INDEX: AttachmentIndex,
    Opcode.STATISTICS: Statistics,
    Opcode.METADATA: Metadata,
    Opcode.METADATA_INDEX: MetadataIndex,
    Opcode.SUMMARY_OFFSET: SummaryOffset,
    Opcode.DATA_END: DataEnd,
}
#: Records that a search may take up again with, and the upper half of a length that no file has.
_AGAIN: Final = re.compile(rb"(?=[\x06\x09\x0c\x0f].{4}\x00\x00\x00\x00)", re.DOTALL)


class Frames:
    """Reads records of a file at given places."""

    def __init__(self, stream: Any) -> None:
        """Read from a file.

        Args:
            stream: Opened for reading bytes.
        """
        self._stream = stream
        self.size = os.fstat(stream.fileno()).st_size
        self._left = MOST_TRIED + self.size

    def bytes_at(self, offset: int, count: int) -> bytes:
        """Return bytes; fewer at the end of the file."""
        self._stream.seek(offset)
        data: bytes = self._stream.read(count)
        return data

    def head(self, offset: int) -> tuple[int, int] | None:
        """Return opcode and length of the record at a place; None if the file ends before its end."""
        data = self.bytes_at(offset, HEAD)
        if len(data) < HEAD:
            return None
        opcode, length = struct.unpack("<BQ", data)
        return (opcode, length) if offset + HEAD + length <= self.size else None

    def again(self, offset: int) -> int | None:
        """Return where the next record begins that is beyond doubt, from a place on; None if there is none."""
        for start in self._candidates(offset):
            found = self.head(start)
            if found is None:
                continue
            self._left -= found[1]
            if self._left < 0:
                return None
            if _is_certain(found[0], self.bytes_at(start + HEAD, found[1])):
                return start
        return None

    def _candidates(self, offset: int) -> Iterator[int]:
        block = 2**20
        while offset < self.size:
            data = self.bytes_at(offset, block + HEAD)
            for found in _AGAIN.finditer(data):
                if found.start() < block:
                    yield offset + found.start()
            offset += block


class _WholeStream(ReadDataStream):
    """Reads what it is asked for, or nothing."""

    def read(self, length: int) -> bytes:
        data: bytes = super().read(length)
        if len(data) != length:
            raise EOFError
        return data


def parsed(opcode: int, body: bytes) -> McapRecord | None:
    """Return the record of a body; None if there is no such opcode, or the body is not exactly one."""
    reader = _READERS.get(opcode)
    if reader is None:
        return None
    stream = _WholeStream(BytesIO(body))
    try:
        record: McapRecord = reader.read(stream)
    except Exception:  # EndOfFile, struct.error, UnicodeDecodeError, ...: there is no common base
        return None
    return record if stream.count == len(body) else None


def attachment_is_whole(body: bytes) -> bool:
    """Tell whether the checksum of an attachment agrees; 0 stands for none."""
    told = int.from_bytes(body[-4:], "little")
    return told in (0, zlib.crc32(body[:-4]))


def _is_certain(opcode: int, body: bytes) -> bool:
    record = parsed(opcode, body)
    if isinstance(record, Attachment):
        return attachment_is_whole(body)
    if isinstance(record, Metadata):
        return unsealed(record.name, record.metadata) is not None and record.name.startswith("tcrctl.")
    if isinstance(record, Chunk):
        return (
            record.compression in ("", "zstd", "lz4") and record.message_start_time <= record.message_end_time
        )
    return isinstance(record, DataEnd)
