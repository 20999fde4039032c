"""Frames on their way: late, twice, in the wrong order, damaged, or not at all."""

from __future__ import annotations

import heapq
import itertools
import random
from collections.abc import Callable

from tcr_hardware.emulators.motive_faults import MotiveFaults

Address = tuple[str, int]


class Outbox:
    """Datagrams with the times at which they leave."""

    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)
        self._count = itertools.count()
        self._waiting: list[tuple[float, int, bytes, Address]] = []

    def happens(self, chance: float) -> bool:
        """Tell whether something of this chance happens now."""
        return chance > 0.0 and self._random.random() < chance

    def put(
        self, datagram: bytes, destination: Address, leaves: float, period: float, faults: MotiveFaults
    ) -> None:
        """Send a datagram at ``leaves`` [s], as far as the faults allow; ``period`` is that of the frames [s]."""
        chance = self._random.random
        if chance() < faults.loss:
            return
        for _ in range(1 + (chance() < faults.duplicate)):
            damaged = self._damage(datagram, faults)
            at = leaves + faults.delay_s + period * self._random.randint(0, faults.reorder)
            heapq.heappush(self._waiting, (at, next(self._count), damaged, destination))

    def next_due(self) -> float:
        """Return when the next datagram leaves [s]; infinity if none waits."""
        return self._waiting[0][0] if self._waiting else float("inf")

    def flush(self, now: float, send: Callable[[bytes, Address], None]) -> None:
        """Send what is due."""
        while self._waiting and self._waiting[0][0] <= now:
            _, _, datagram, destination = heapq.heappop(self._waiting)
            send(datagram, destination)

    def _damage(self, datagram: bytes, faults: MotiveFaults) -> bytes:
        chance = self._random.random
        if chance() < faults.corrupt:
            bits = bytearray(datagram)
            for _ in range(3):
                bits[self._random.randrange(len(bits))] ^= 1 << self._random.randrange(8)
            datagram = bytes(bits)
        if chance() < faults.truncate:
            datagram = datagram[: self._random.randrange(len(datagram))]
        if chance() < faults.wrong_size and len(datagram) >= 4:
            size = int.from_bytes(datagram[2:4], "little")
            lie = (size + self._random.choice((-8, -1, 1, 8, 4096))) & 0xFFFF
            datagram = datagram[:2] + lie.to_bytes(2, "little") + datagram[4:]
        return datagram
