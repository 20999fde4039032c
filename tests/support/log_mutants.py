"""Changes of single bytes and bits of a log, and whether anybody falls for one."""

from __future__ import annotations

import struct
from contextlib import suppress

from tcrctl.errors import TcrctlError
from tcrctl.log.reader import read_log


def starts(data):
    """Offset and opcode of every record."""
    offset = 8
    while offset + 9 <= len(data) - 8:
        code, length = struct.unpack_from("<BQ", data, offset)
        yield offset, code
        offset += 9 + length


def chunk_starts(data):
    return [offset for offset, code in starts(data) if code == 6]


def mutants(data, count, random):
    """As many changes of a byte as of a bit: place and content, half of them outside chunks."""
    inside = [range(a, a + 9 + struct.unpack_from("<Q", data, a + 1)[0]) for a in chunk_starts(data)]
    outside = [i for i in range(len(data)) if not any(i in span for span in inside)]
    for i in range(2 * count):
        place = int(random.choice(outside) if i % 2 else random.integers(len(data)))
        mutant = bytearray(data)
        mutant[place] ^= int(random.integers(1, 256)) if i < count else 1 << int(random.integers(8))
        yield place, bytes(mutant)


def accepted(path):
    """The log if it is read to its end without a word, else None."""
    with suppress(TcrctlError):
        log = read_log(path)
        list(log.steps())
        list(log.events())
        return log if log.complete else None
    return None
