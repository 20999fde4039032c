"""The folder of one run: ``<out>/<utc>_<name>_<4 hex>/``, made once and never written to again."""

from __future__ import annotations

import datetime
import os
import secrets
import shutil
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tcrctl.errors import DeviceError

LOG: Final = "log.mcap"
SUMMARY: Final = "summary.json"
LATEST: Final = "latest"
_TRIES: Final = 20


def log_in(path: Path) -> Path:
    """Return the path of a log that is given itself or by the folder of its run."""
    return path / LOG if path.is_dir() else path


def check_writable(out: Path) -> None:
    """Find out, before any work is done, whether run folders can be made in ``out``; changes nothing.

    Raises:
        DeviceError: If they cannot.
    """
    ancestor = next(path for path in (out.absolute(), *out.absolute().parents) if path.exists())
    if not ancestor.is_dir():
        raise DeviceError(f"{out}: cannot hold runs: {ancestor} is a file")
    if not os.access(ancestor, os.W_OK | os.X_OK):
        raise DeviceError(f"{out}: cannot hold runs: no permission to write to {ancestor}", hint=_HINT)


_HINT: Final = "Choose another folder with --out DIR."


@dataclass(frozen=True, slots=True)
class RunFolder:
    """The folder of one run.

    Attributes:
        path: The folder; its name is the run's id.
        made: Every folder that had to be made for it, outermost first.
    """

    path: Path
    made: tuple[Path, ...]

    @property
    def run_id(self) -> str:
        """Name of the run, unique."""
        return self.path.name

    def write(self, name: str, content: bytes) -> None:
        """Write a file that must not exist yet.

        Raises:
            DeviceError: If it cannot be written.
        """
        try:
            with (self.path / name).open("xb") as file:
                file.write(content)
        except OSError as error:
            raise DeviceError(
                f"{self.path / name}: cannot be written: {error.strerror}", hint=_HINT
            ) from error

    def discard(self) -> None:
        """Remove everything that was made, as if the run had never been asked for."""
        shutil.rmtree(self.path, ignore_errors=True)
        for folder in reversed(self.made[:-1]):
            try:
                folder.rmdir()
            except OSError:  # something else has been put there meanwhile
                return


def make_folder_for(path: Path) -> None:
    """Make the folder that a file is to go to, if it is not there.

    Raises:
        DeviceError: If that cannot be.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except FileExistsError as error:
        raise DeviceError(f"{path}: cannot be written: {path.parent} is a file, not a folder") from error
    except OSError as error:
        raise DeviceError(f"{path}: cannot be written: {error.strerror or error}") from error


def replace_file(path: Path, text: str) -> None:
    """Write a file that is there whole or not at all, its folder too; two processes may write the same one.

    A device stays what it is and is written to.

    Raises:
        DeviceError: If it cannot be written.
    """
    make_folder_for(path)
    is_device = path.exists() and not path.is_file()
    beside = path if is_device else path.with_name(f"{path.name}.{os.getpid()}.part")
    try:
        beside.write_text(text, encoding="utf-8")
        if not is_device:
            os.replace(beside, path)
    except OSError as error:
        raise DeviceError(f"{path}: cannot be written: {error.strerror or error}") from error


def link_latest(folder: Path) -> None:
    """Let ``latest`` beside a run's folder lead to it, where links can be made and nothing else has that name."""
    link = folder.with_name(LATEST)
    beside = folder.with_name(f".{LATEST}.{os.getpid()}")
    if link.exists() and not link.is_symlink():
        return
    with suppress(OSError):
        beside.symlink_to(folder.name, target_is_directory=True)
        os.replace(beside, link)


def make_run_folder(out: Path, name: str) -> RunFolder:
    """Make the folder of a new run.

    Args:
        out: Where; made if it does not exist.
        name: Name of the experiment.

    Raises:
        DeviceError: If it cannot be made; nothing is left behind.
    """
    missing = [path for path in (out, *out.parents) if not path.exists()]
    now = datetime.datetime.now(datetime.UTC).strftime("%Y%m%d-%H%M%SZ")
    made: list[Path] = []
    try:
        for folder in reversed(missing):
            folder.mkdir(exist_ok=True)
            made.append(folder)
        path = _unused(out, f"{now}_{name}")
    except OSError as error:
        for folder in reversed(made):
            folder.rmdir()
        raise DeviceError(f"{out}: cannot hold runs: {error.strerror}", hint=_HINT) from error
    return RunFolder(path, (*made, path))


def _unused(out: Path, stem: str) -> Path:
    for _ in range(_TRIES):
        path = out / f"{stem}_{secrets.token_hex(2)}"
        try:
            path.mkdir()
        except FileExistsError:
            continue
        return path
    raise FileExistsError(0, f"no free name for {stem}")
