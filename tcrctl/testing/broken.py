"""What a check ends with if it does not end well."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from tcrctl.errors import DeviceError
from tcrctl.plant.rig.devices import Identity
from tcrctl.plant.rig.finding import Finding


class BrokenPromiseError(AssertionError):
    """A device does not do what its protocol says."""


class Untried(Exception):  # noqa: N818  # no error: there is nothing to try it with
    """A bench has nothing with which this could be tried."""


def require(kept: bool, promise: str) -> None:
    """Do nothing if a promise is kept.

    Raises:
        BrokenPromiseError: If it is not; says what was promised and what is.
    """
    if not kept:
        raise BrokenPromiseError(promise)


def given(name: str, hook: Callable[[bool], None] | None) -> Callable[[bool], None]:
    """Return a hook of the bench.

    Raises:
        Untried: If the bench has none.
    """
    if hook is None:
        raise Untried(f"the bench has no {name}")
    return hook


def raises_device_error(action: Callable[[], Any], what: str) -> bool:
    """Tell whether an action ends with a DeviceError; any other error is a broken promise.

    Raises:
        BrokenPromiseError: If it raises anything else.
    """
    try:
        action()
    except DeviceError:
        return True
    except Exception as error:
        raise BrokenPromiseError(f"{what}: raises {type(error).__name__}, not a DeviceError") from error
    return False


def check_identity(identity: Any) -> None:
    """Check what a device says about itself."""
    require(isinstance(identity, Identity), f"identity is an Identity, not a {type(identity).__name__}")
    texts = (identity.name, identity.where, identity.text, *identity.details, *identity.details.values())
    require(all(isinstance(text, str) for text in texts), "everything in identity is text")
    require(
        bool(identity.name and identity.where), "identity says what the device is called, and where it is"
    )


def check_findings(found: Any) -> None:
    """Check what the device's own checks found on a bench that is in order."""
    findings = list(found)
    require(all(isinstance(one, Finding) for one in findings), "checks yields Findings and nothing else")
    bad = "; ".join(f"{one.what}: {one.text}" for one in findings if one.exit_code)
    require(not bad, f"checks finds nothing wrong on a bench that is in order, but {bad}")
