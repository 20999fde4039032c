"""Rows of the runs that are done, in one file that is only ever added to.

A row is one line, written with one call, so that kill -9 at any moment leaves whole rows and at most one torn line
at the end, which is cut off when the file is opened again. One process writes; a lock keeps a second one out.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from pathlib import Path
from types import TracebackType
from typing import Final, Self

from tcrctl.errors import DeviceError
from tcrctl.experiment.run_folder import make_folder_for
from tcrctl.study.row import Row, loads

ROWS: Final = "rows.jsonl"
LOCK: Final = "lock"


class Store:
    """The rows of one folder.

    Attributes:
        repaired: Lines that were not whole and are left out.
    """

    def __init__(self, folder: Path) -> None:
        """Name the folder; nothing is touched."""
        self._path, self._lock_path = folder / ROWS, folder / LOCK
        self._places: dict[str, tuple[int, int]] = {}
        self._file = self._lock = -1
        self.repaired = 0

    def __enter__(self) -> Self:
        """Open for writing, and mend what a sudden end has left.

        Raises:
            DeviceError: If that cannot be, or another process writes here.
        """
        make_folder_for(self._path)
        try:
            self._lock = os.open(self._lock_path, os.O_CREAT | os.O_RDWR, 0o644)
            _take(self._lock, self._path.parent)
            self._file = os.open(self._path, os.O_CREAT | os.O_RDWR | os.O_APPEND, 0o644)
            self._scan()
        except OSError as error:
            raise DeviceError(f"{self._path}: cannot be used: {error.strerror or error}") from error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close; the lock goes with it."""
        for descriptor in (self._file, self._lock):
            if descriptor >= 0:
                os.close(descriptor)
        self._file = self._lock = -1

    def __contains__(self, address: str) -> bool:
        return address in self._places

    def __len__(self) -> int:
        return len(self._places)

    def get(self, address: str) -> Row | None:
        """Return a row, read from the file; None if there is none."""
        if address not in self._places:
            return None
        start, length = self._places[address]
        return loads(_read(self._file, start, length))

    def add(self, row: Row) -> None:
        """Write a row.

        Raises:
            DeviceError: If the disk does not take it; the file is as it was before.
        """
        line, size = row.dumps(), os.fstat(self._file).st_size
        try:
            written = os.write(self._file, line)
            if written < len(line):
                raise OSError(28, "no space left on device")
        except OSError as error:
            os.ftruncate(self._file, size)
            raise DeviceError(
                f"{self._path}: a row cannot be written: {error.strerror or error}",
                hint="Make room and start again: what is done is kept.",
            ) from error
        self._places[row.address] = size, len(line)

    def forget(self, addresses: Iterable[str]) -> None:
        """Count runs without a result as not done; a later row of the same address counts."""
        for address in addresses:
            row = self.get(address)
            if row is not None and not row.answered:
                del self._places[address]

    def _scan(self) -> None:
        """Find every whole row; cut off what is not whole at the end."""
        start = 0
        with open(self._path, "rb") as file:
            for line in file:
                row = loads(line)
                if row is None:
                    self.repaired += 1
                else:
                    self._places[row.address] = start, len(line)
                if not line.endswith(b"\n"):
                    os.ftruncate(self._file, start)
                start += len(line)


def _read(file: int, start: int, length: int) -> bytes:
    os.lseek(file, start, os.SEEK_SET)
    return os.read(file, length)


def _take(lock: int, folder: Path) -> None:
    """Take the lock, or say who has it; where there are no locks, go on without."""
    try:
        import fcntl  # not on Windows
    except ImportError:
        return
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        holder = _read(lock, 0, 100).decode(errors="replace")
        who = json.loads(holder).get("pid") if holder.startswith("{") else "unknown"
        os.close(lock)
        raise DeviceError(f"{folder}: another process, {who}, is writing to this study") from None
    os.ftruncate(lock, 0)
    os.write(lock, json.dumps({"pid": os.getpid()}).encode())
