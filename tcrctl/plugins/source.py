"""The code of a kind from elsewhere: found, run once per process, and known by its digest."""

from __future__ import annotations

import hashlib
import importlib
import importlib.metadata
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

from tcrctl.config import strict_yaml
from tcrctl.errors import InputError
from tcrctl.plugins.faults import told
from tcrctl.plugins.origin import Origin


def from_file(section: str, kind: str, path: Path, name: str) -> tuple[Any, Origin]:
    """Run a file and return the kind that it calls ``name``.

    What runs is what was read, so the digest is that of the code; nothing is written beside the file.

    Args:
        section: Section of the experiment.
        kind: As the section names it.
        path: The file.
        name: What it defines.

    Raises:
        InputError: If the file is missing, cannot be run, or does not define the name.
    """
    what = f"{section}.kind: {kind}"
    text, place = strict_yaml.read(path), str(path.absolute())
    digest = hashlib.sha256(text).hexdigest()
    found = _member(what, _module_of(what, place, text), name)
    return found, Origin(section, kind, name, "", place, "", "", digest, text)


def again(origin: Origin) -> Any:
    """Return the kind that an origin tells of, in another process: a file as it was read, not as it is now.

    Args:
        origin: Where the kind comes from.

    Raises:
        InputError: If it is a module that cannot be imported here, or does not define it any more.
    """
    if not origin.text:
        module = _imported(origin.what, origin.module)
    else:
        module = _module_of(origin.what, origin.file, origin.text)
    return _member(origin.what, module, origin.name)


def function_in(what: str, place: str, name: str, find: Callable[[str], Path]) -> tuple[Any, str]:
    """Return a function that a file names, and the file or module that defines it.

    Args:
        what: How messages begin.
        place: A file's path or a module's name.
        name: Of the function.
        find: Returns the file that a path means.

    Raises:
        InputError: If it cannot be loaded, or is no function.
    """
    if is_file(place):
        path = find(place)
        module = _module_of(what, str(path.absolute()), strict_yaml.read(path))
    else:
        module = _imported(what, place)
    found = getattr(module, name, None)
    if not callable(found):
        raise InputError(f"{what}: it defines no function {name}")
    return found, getattr(module, "__file__", None) or ""


def is_file(place: str) -> bool:
    """Tell whether what stands before a colon is a file, not a module."""
    return place.endswith(".py") or "/" in place or "\\" in place


def _module_of(what: str, place: str, text: bytes) -> ModuleType:
    """Run a file, once per process and content."""
    name = f"tcrctl_plugin_{hashlib.sha256(place.encode() + text).hexdigest()}"
    return sys.modules.get(name) or _run(what, name, place, text)


def _run(what: str, name: str, place: str, text: bytes) -> ModuleType:
    module = ModuleType(name)
    module.__file__ = place
    sys.modules[name] = module  # dataclasses and annotations are looked up there
    try:
        exec(compile(text, place, "exec", dont_inherit=True), module.__dict__)
    except (Exception, SystemExit) as error:
        del sys.modules[name]
        raise _not_loaded(what, error, place) from error
    return module


def from_module(section: str, kind: str, module: str, name: str) -> tuple[Any, Origin]:
    """Import a module and return what it calls ``name``.

    Args:
        section: Section of the experiment.
        kind: As the section names it.
        module: Dotted name of the module.
        name: What it defines.

    Raises:
        InputError: If it cannot be imported, or does not define the name.
    """
    what = f"{section}.kind: {kind}"
    found = _imported(what, module)
    file = getattr(found, "__file__", None) or ""
    package, version = _distribution(module.partition(".")[0])
    digest = _digest(module.partition(".")[0])
    return _member(what, found, name), Origin(section, kind, name, module, file, package, version, digest)


def _imported(what: str, module: str) -> ModuleType:
    try:
        return importlib.import_module(module)
    except (Exception, SystemExit) as error:
        raise _not_loaded(what, error, "") from error


def _not_loaded(what: str, error: BaseException, file: str) -> InputError:
    if isinstance(error, ModuleNotFoundError):
        hint = f"Install what brings the module {error.name}, into the environment of tcrctl."
        return InputError(f"{what}: {told(error, file)}", hint=hint)
    return InputError(f"{what}: loading it raised {told(error, file)}")


def _member(what: str, module: ModuleType, name: str) -> Any:
    found = getattr(module, name, None)
    if found is None:
        known = sorted(key for key in vars(module) if isinstance(vars(module)[key], tuple)) or ["none"]
        raise InputError(f"{what}: it defines no {name}; kinds in it: {', '.join(known)}")
    return found


def _distribution(top: str) -> tuple[str, str]:
    """Return name and version of the distribution that brings a top-level module; empty if none does."""
    names = importlib.metadata.packages_distributions().get(top, [])
    try:
        return (names[0], importlib.metadata.version(names[0])) if names else ("", "")
    except importlib.metadata.PackageNotFoundError:  # its description is broken
        return names[0], ""


def _digest(top: str) -> str:
    """Return the digest of an imported package, or of a module that is none; empty if it has no file."""
    file = getattr(sys.modules.get(top), "__file__", None)
    if not file or not Path(file).is_file():
        return ""
    root = Path(file)
    if root.name != "__init__.py":
        return hashlib.sha256(root.read_bytes()).hexdigest()
    return package_digest(root.parent)


def package_digest(folder: Path) -> str:
    """Return the SHA-256 over names and contents of all Python files of a package."""
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        digest.update(str(path.relative_to(folder)).encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()
