"""The code of a kind from elsewhere: found, run once per process, and known by its digest."""

from __future__ import annotations

import hashlib
import importlib
import importlib.metadata
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

from tcrctl.config import strict_yaml
from tcrctl.errors import InputError
from tcrctl.plugins.faults import told
from tcrctl.plugins.origin import Origin


def from_file(section: str, kind: str, path: Path, name: str) -> tuple[Any, Origin]:
    """Run a file and return what it calls ``name``.

    What runs is what was read, so the digest is that of the code; nothing is written beside the file.

    Args:
        section: Section of the experiment.
        kind: As the section names it.
        path: The file.
        name: What it defines.

    Raises:
        InputError: If the file is missing, cannot be run, or does not define the name.
    """
    text, place = strict_yaml.read(path), str(path.absolute())
    digest = hashlib.sha256(text).hexdigest()
    key = hashlib.sha256(place.encode() + text).hexdigest()
    module = sys.modules.get(f"tcrctl_plugin_{key}") or _run(
        section, kind, f"tcrctl_plugin_{key}", place, text
    )
    return _member(section, kind, module, name), Origin(section, kind, "", place, "", "", digest, text)


def _run(section: str, kind: str, name: str, place: str, text: bytes) -> ModuleType:
    module = ModuleType(name)
    module.__file__ = place
    sys.modules[name] = module  # dataclasses and annotations are looked up there
    try:
        exec(compile(text, place, "exec", dont_inherit=True), module.__dict__)
    except (Exception, SystemExit) as error:
        del sys.modules[name]
        raise _not_loaded(section, kind, error, place) from error
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
    try:
        found = importlib.import_module(module)
    except (Exception, SystemExit) as error:
        raise _not_loaded(section, kind, error, "") from error
    file = getattr(found, "__file__", None) or ""
    package, version = _distribution(module.partition(".")[0])
    digest = _digest(module.partition(".")[0])
    return _member(section, kind, found, name), Origin(section, kind, module, file, package, version, digest)


def _not_loaded(section: str, kind: str, error: BaseException, file: str) -> InputError:
    if isinstance(error, ModuleNotFoundError):
        hint = f"Install what brings the module {error.name}, into the environment of tcrctl."
        return InputError(f"{section}.kind: {kind}: {told(error, file)}", hint=hint)
    return InputError(f"{section}.kind: {kind}: loading it raised {told(error, file)}")


def _member(section: str, kind: str, module: ModuleType, name: str) -> Any:
    found = getattr(module, name, None)
    if found is None:
        known = sorted(key for key in vars(module) if isinstance(vars(module)[key], tuple)) or ["none"]
        raise InputError(f"{section}.kind: {kind}: it defines no {name}; kinds in it: {', '.join(known)}")
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
