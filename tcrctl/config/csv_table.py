"""Tables as CSV, read strictly: comma-separated UTF-8 with one header line; what is wrong is told with its line."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator

from tcrctl.errors import Problem, SpecError
from tcrctl.visible import visible

_OTHER_SEPARATORS = ";\t|"


class CsvTable:
    """A table whose header has been read.

    Attributes:
        header: Names of the columns.
    """

    def __init__(self, content: bytes, name: str) -> None:
        """Take a file's bytes, and its name for messages.

        Raises:
            SpecError: If it is no text, holds characters that act or hide, or has no header that can be read.
        """
        self._name = name
        try:
            self._text = content.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            raise SpecError([Problem(f"{name}:1:1", "", f"not UTF-8 text: {error.reason}")]) from None
        self._check_characters()
        # A quote that is never closed would take the rest of the file for one cell.
        self._reader = csv.reader(io.StringIO(self._text, newline=None), skipinitialspace=True, strict=True)
        self.header: list[str] = next(self._cells(), (1, []))[1]

    @property
    def separator(self) -> str | None:
        """What separates the columns where it is no comma; None if nothing says so."""
        alone = self.header[0] if len(self.header) == 1 else ""
        return next((mark for mark in _OTHER_SEPARATORS if mark in alone), None)

    def rows(self) -> Iterator[tuple[int, list[str]]]:
        """Yield line and cells of every row; empty lines are none.

        Raises:
            SpecError: If the file is no table from some line on.
        """
        return self._cells()

    def _cells(self) -> Iterator[tuple[int, list[str]]]:
        begins = self._reader.line_num + 1
        try:
            for cells in self._reader:
                begins = self._reader.line_num + 1
                if cells:
                    yield self._reader.line_num, cells
        except csv.Error as error:
            where = f"{self._name}:{begins}:1"
            raise SpecError([Problem(where, "", self._message(begins, error))]) from None

    def _message(self, line: int, error: csv.Error) -> str:
        begins = "".join(self._text.splitlines(keepends=True)[line - 1 : line])
        return "a quote that is opened here is not closed" if '"' in begins else f"is no table: {error}"

    def _check_characters(self) -> None:
        text = self._text.replace("\r\n", "\n").replace("\r", "\n")
        shown = visible(text)
        if shown == text:
            return
        at = next(i for i, (a, b) in enumerate(zip(text, shown, strict=False)) if a != b)
        before = text[:at].split("\n")
        where = f"{self._name}:{len(before)}:{len(before[-1]) + 1}"
        raise SpecError([Problem(where, "", f"character U+{ord(text[at]):04X} is not allowed in a table")])


def number_in(cell: str) -> float:
    """Return a cell as a number; NaN if it is no finite one."""
    try:
        # 5_0 and digits of other scripts are numbers of Python only
        value = float(cell) if cell.isascii() and "_" not in cell else math.nan
    except ValueError:
        return math.nan
    return value if math.isfinite(value) else math.nan
