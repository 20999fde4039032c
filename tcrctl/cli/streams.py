"""Standard streams that never end a program: what cannot be delivered is dropped, and remembered.

A run must not care who reads its messages. Any of the three streams may be missing, closed, full, a pipe whose
reader has gone or does not read, or have an encoding that lacks a letter. While a verb works they are therefore
replaced by ones that raise nothing::

    print -> Output -> file descriptor       (or the stream that was there, if it has none: tests, notebooks)
"""

from __future__ import annotations

import codecs
import io
import os
import select
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Final, TextIO

from tcrctl.cli.layout import message, width
from tcrctl.visible import unstyled, visible

#: A message waits this long for a reader that is busy [s]. The control loop waits with it.
PATIENCE_S: Final = 0.02

_PIECE: Final = 4096  # so much a pipe takes at once if it takes anything (PIPE_BUF)
_BUFFER: Final = 8192


class Output(io.TextIOBase):
    """Text stream that writes what can be written."""

    def __init__(self, inner: TextIO | None, patience: float | None = None) -> None:
        """Take the place of a stream.

        Args:
            inner: The stream; None or closed: everything is dropped.
            patience: How long a write may wait for the reader [s]; None: until it reads.
        """
        self._inner, self._patience = inner, patience
        self._fd = _descriptor(inner)
        self._encoder = codecs.getincrementalencoder(self.encoding)("backslashreplace")
        self._waiting = ""
        self._lock = threading.RLock()  # a signal handler may write in the middle of a write
        self._blocked = False
        self.failure: OSError | None = None

    @property
    def encoding(self) -> str:  # type: ignore[override]
        """Encoding of the stream."""
        return getattr(self._inner, "encoding", None) or "utf-8"

    @property
    def errors(self) -> str:  # type: ignore[override]
        """What happens to letters that the encoding lacks."""
        return "backslashreplace"

    def writable(self) -> bool:
        """Return True."""
        return True

    def isatty(self) -> bool:
        """Tell whether it is a terminal."""
        return _is_terminal(self._inner)

    def fileno(self) -> int:
        """Return the file descriptor.

        Raises:
            io.UnsupportedOperation: If it has none.
        """
        if self._fd is None:
            raise io.UnsupportedOperation("fileno")
        return self._fd

    def write(self, text: str) -> int:
        """Write text, or drop it; characters that act on a terminal are spelt out, styles excepted."""
        if not isinstance(text, str):
            raise TypeError(f"a text stream takes str, not {type(text).__name__}")
        if os.environ.get("NO_COLOR"):  # what libraries make of it still has weights
            text = unstyled(text)
        keep = self.isatty() or bool(os.environ.get("FORCE_COLOR"))
        return self._take(visible(text, keep_styles=keep))

    @property
    def styled(self) -> TextIO:
        """The same stream for who has made sure that nothing in the text acts on a terminal but on purpose."""
        return _Styled(self)  # type: ignore[return-value]

    def _take(self, text: str) -> int:
        with self._lock:
            self._waiting += text
            at_once = self._patience is not None or self.isatty()
            if len(self._waiting) >= _BUFFER or (at_once and "\n" in text):
                self.flush()
        return len(text)

    def flush(self) -> None:
        """Hand over what was written."""
        with self._lock:
            text, self._waiting = self._waiting, ""
            if text and self.failure is None:
                with suppress(ValueError):  # closed in the meantime
                    self._hand_over(text)

    def _hand_over(self, text: str) -> None:
        try:
            if self._fd is not None:
                self._write_all(memoryview(self._encoder.encode(text)), self._fd)
            elif self._inner is not None:
                self._inner.write(text.encode(self.encoding, "backslashreplace").decode(self.encoding))
                self._inner.flush()
        except OSError as error:
            self.failure = error

    def _write_all(self, data: memoryview, fd: int) -> None:
        while data and self._takes(fd):
            with suppress(BlockingIOError):  # shared with a program that has made it so
                data = data[os.write(fd, data[:_PIECE]) :]

    def _takes(self, fd: int) -> bool:
        """Wait until the reader has room; False if it takes too long, then at once while nothing has changed."""
        if not hasattr(select, "poll"):
            return True
        poll = select.poll()
        poll.register(fd, select.POLLOUT)
        patience = 0.0 if self._blocked else self._patience
        self._blocked = not poll.poll(None if patience is None else 1e3 * patience)
        return not self._blocked


class Messages(Output):
    """Text for people: on a terminal its lines break between words, not where the terminal ends."""

    def write(self, text: str) -> int:
        """Write a message, or drop it."""
        super().write(message(text, width(self)) if self.isatty() else text)  # type: ignore[arg-type]
        return len(text)


class _Styled(io.TextIOBase):
    """Writes to an output as it is."""

    def __init__(self, output: Output) -> None:
        self._output = output

    @property
    def encoding(self) -> str:  # type: ignore[override]
        return self._output.encoding

    def isatty(self) -> bool:
        return self._output.isatty()

    def fileno(self) -> int:
        return self._output.fileno()

    def write(self, text: str) -> int:
        return self._output._take(text)

    def flush(self) -> None:
        self._output.flush()


@contextmanager
def robust_streams() -> Iterator[Output]:
    """Put streams that raise nothing in place of stdin, stdout and stderr.

    Data on stdout waits for its reader; messages on stderr do not.

    Yields:
        Stdout; its ``failure`` tells why data was lost.
    """
    _fill_descriptors()
    before = sys.stdin, sys.stdout, sys.stderr
    output, messages = Output(sys.stdout), Messages(sys.stderr, PATIENCE_S)
    sys.stdin = before[0] if _is_open(before[0]) else io.StringIO()
    sys.stdout, sys.stderr = output, messages
    try:
        yield output
    finally:
        output.flush()
        messages.flush()
        sys.stdin, sys.stdout, sys.stderr = before


def _fill_descriptors() -> None:
    """Open nothing at 0, 1 and 2 where they are closed: the log would be opened there, and messages go into it."""
    for number in (0, 1, 2):
        try:
            os.fstat(number)
        except OSError:
            with suppress(OSError):
                os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)


def _descriptor(stream: TextIO | None) -> int | None:
    """Return the file descriptor of a stream after what it still holds was written; None if there is none.

    A console of Windows takes no bytes.
    """
    if stream is None or not _is_open(stream) or sys.platform == "win32":
        return None
    with suppress(OSError, ValueError):
        stream.flush()
    try:
        return stream.fileno()
    except (OSError, ValueError, AttributeError):
        return None


def _is_open(stream: TextIO | None) -> bool:
    return stream is not None and not getattr(stream, "closed", False)


def _is_terminal(stream: TextIO | None) -> bool:
    try:
        return stream is not None and stream.isatty()
    except (OSError, ValueError, AttributeError):
        return False
