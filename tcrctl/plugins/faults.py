"""What goes wrong inside the code of others, in one sentence that names the line."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tcrctl.errors import InputError, PluginStoppedError, TcrctlError
from tcrctl.plugins.origin import Origin


def told(error: BaseException, file: str) -> str:
    """Return kind and text of an error, and the last line of a file that it went through.

    Args:
        error: What was raised.
        file: The plug-in's file, or any of its package.
    """
    text = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    if isinstance(error, SyntaxError):
        return f"{type(error).__name__}: {error.msg} (line {error.lineno})"
    folder = Path(file).parent
    frames = [
        frame for frame in traceback.extract_tb(error.__traceback__) if _belongs(frame.filename, file, folder)
    ]
    return f"{text} ({Path(frames[-1].filename).name}:{frames[-1].lineno})" if frames else text


def _belongs(name: str, file: str, folder: Path) -> bool:
    return name == file or (Path(file).name == "__init__.py" and folder in Path(name).parents)


def built(origin: Origin, build: Callable[..., Any], *given: Any) -> Any:
    """Call a builder.

    Args:
        origin: Where it comes from.
        build: The builder.
        *given: What it takes.

    Raises:
        InputError: If it raises anything that is no error of this program.
    """
    return _guarded(
        lambda error: InputError(f"{origin.what}: building it raised {told(error, origin.file)}"),
        build,
        *given,
    )


def called(origin: Origin, name: str, function: Callable[..., Any], *given: Any) -> Any:
    """Call a function of a plug-in while the loop runs.

    Args:
        origin: Where it comes from.
        name: What the function is called.
        function: The function.
        *given: What it takes.

    Raises:
        PluginStoppedError: If it raises anything that is no error of this program.
    """
    return _guarded(
        lambda error: PluginStoppedError(origin.what, f"{name} raised {told(error, origin.file)}"),
        function,
        *given,
    )


def _guarded(meant: Callable[[BaseException], TcrctlError], function: Callable[..., Any], *given: Any) -> Any:
    """Call code of others; what it raises becomes the error that is meant, unless it is one of this program."""
    try:
        return function(*given)
    except TcrctlError:
        raise
    except (Exception, SystemExit) as error:
        raise meant(error) from error


def refuse_lacking(origin: Origin, made: Any, names: tuple[str, ...]) -> None:
    """Refuse an object that lacks something it is asked for.

    Args:
        origin: Where it comes from.
        made: What the builder returned.
        names: Members that it must have.

    Raises:
        InputError: If one is missing.
    """
    missing = [name for name in names if not hasattr(made, name)]
    if missing:
        what = f"the builder returned {_shown(made)}, which has no {' and no '.join(missing)}"
        raise InputError(f"{origin.what}: {what}")


def _shown(made: Any) -> str:
    return "None" if made is None else f"a {type(made).__name__}"
