"""A cursor over one payload that never reads past its end and never believes a count."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcr_hardware.natnet.errors import MalformedPacketError

#: Things of varying length in one packet. A real one has dozens; the limit bounds what a corrupt packet can cost.
MOST_ITEMS = 1000
LONGEST_NAME = 256
_INTEGER = struct.Struct("<i")


class Reader:
    """Reads numbers, names and arrays one after the other.

    Attributes:
        buffer: The payload; arrays are views of it.
        offset: Next byte to be read.
        end: First byte that must not be read.
    """

    __slots__ = ("_items", "buffer", "end", "offset")

    def __init__(self, buffer: bytes, most_items: int = MOST_ITEMS) -> None:
        self.buffer = buffer
        self.offset = 0
        self.end = len(buffer)
        self._items = most_items

    @property
    def remaining(self) -> int:
        """Bytes not yet read."""
        return self.end - self.offset

    def fail(self, problem: str) -> MalformedPacketError:
        """Make the error that tells where ``problem`` was noticed."""
        return MalformedPacketError(problem, self.offset, len(self.buffer))

    def integer(self) -> int:
        """Read an i32.

        Raises:
            MalformedPacketError: The payload ends.
        """
        start = self.offset
        if start + 4 > self.end:
            raise self.fail("payload ends inside a number")
        self.offset = start + 4
        value: int = _INTEGER.unpack_from(self.buffer, start)[0]
        return value

    def unpack(self, layout: struct.Struct) -> tuple[Any, ...]:
        """Read a fixed group of numbers.

        Raises:
            MalformedPacketError: The payload ends.
        """
        start = self.offset
        if start + layout.size > self.end:
            raise self.fail("payload ends inside a number")
        self.offset = start + layout.size
        return layout.unpack_from(self.buffer, start)

    def count(self, what: str, smallest: int) -> int:
        """Read the number of things that follow, each of at least ``smallest`` bytes.

        Raises:
            MalformedPacketError: Negative, or more than the rest of the payload can hold.
        """
        count = self.integer()
        if not 0 <= count * smallest <= self.end - self.offset:
            raise self.fail(f"{count} {what} do not fit")
        return count

    def items(self, what: str, smallest: int) -> int:
        """Read the number of named things that follow; as ``count``, with a limit for the whole packet.

        Raises:
            MalformedPacketError: As ``count``, or more than any real packet has.
        """
        count = self.count(what, smallest)
        self._items -= count
        if self._items < 0:
            raise self.fail(f"{count} {what} are more than a packet may have")
        return count

    def text(self) -> str:
        """Read a name that ends with a zero byte.

        Raises:
            MalformedPacketError: No zero byte within ``LONGEST_NAME`` bytes.
        """
        stop = self.buffer.find(b"\0", self.offset, min(self.end, self.offset + LONGEST_NAME))
        if stop < 0:
            raise self.fail("name without end")
        start, self.offset = self.offset, stop + 1
        return self.buffer[start:stop].decode("utf-8", "replace")

    def array(self, dtype: np.dtype[Any], count: int, stride: int | None = None) -> NDArray[Any]:
        """Read ``count`` elements as a read-only view, ``stride`` bytes apart if they are longer than known.

        Raises:
            MalformedPacketError: The payload ends, or the elements are shorter than known.
        """
        start, size = self.offset, dtype.itemsize if stride is None else stride
        if start + count * size > self.end or size < dtype.itemsize:
            raise self.fail("payload ends inside an array")
        self.offset = start + count * size
        if stride is None:
            return np.frombuffer(self.buffer, dtype, count, start)
        packed = np.frombuffer(self.buffer, np.uint8, count * size, start).reshape(count, size)
        return packed[:, : dtype.itemsize].copy().view(dtype.base).reshape(count, *dtype.shape)

    def part(self, size: int) -> Reader:
        """Return a reader of the next ``size`` bytes alone; this one stays where it is.

        Raises:
            MalformedPacketError: Negative or more than there are.
        """
        if not 0 <= size <= self.remaining:
            raise self.fail(f"{size} bytes do not fit")
        part = Reader(self.buffer, self._items)
        part.offset, part.end = self.offset, self.offset + size
        return part

    def resume(self, part: Reader) -> None:
        """Go on behind a part that was read."""
        self.offset, self._items = part.end, part._items

    def skip(self, size: int) -> None:
        """Pass over ``size`` bytes.

        Raises:
            MalformedPacketError: Negative or more than there are.
        """
        if not 0 <= size <= self.remaining:
            raise self.fail(f"{size} bytes do not fit")
        self.offset += size
