"""Calls of cameras and drives from elsewhere: whatever they raise ends as an error of a device."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Any

from tcrctl.errors import DeviceError, TcrctlError, UntrustworthyDeviceError
from tcrctl.plant.rig.devices import Identity
from tcrctl.plant.rig.finding import Finding
from tcrctl.plugins.faults import built, refuse_lacking, told
from tcrctl.plugins.origin import Origin
from tcrctl.plugins.plugin import Plugin


class OwnDevice:
    """A device that a plug-in has built; what its members return is checked."""

    def __init__(self, plugin: Plugin, members: tuple[str, ...], *given: Any) -> None:
        """Build it.

        Args:
            plugin: Where it comes from.
            members: What it must have.
            *given: What its builder takes.

        Raises:
            DeviceError: If it cannot be reached.
            InputError: If the builder raises anything else, or what it returns is no such device.
        """
        self._origin = plugin.origin
        self._made = built(plugin.origin, lambda: _opened(plugin, given))
        try:
            refuse_lacking(plugin.origin, self._made, members)
            self.identity: Identity = self.told("identity", Identity)
        except BaseException:
            self.close()
            raise

    def told(self, name: str, *kinds: type) -> Any:
        """Return the value of an attribute, if it is of one of these kinds."""
        value = self.call(name, lambda: getattr(self._made, name))
        return self.checked(name, value, *kinds)

    def called(self, name: str, *given: Any, **named: Any) -> Any:
        """Call a function of the device; see :meth:`call`."""
        return self.call(name, lambda: getattr(self._made, name)(*given, **named))

    def call(self, name: str, action: Callable[[], Any]) -> Any:
        """Do something with the device.

        Args:
            name: What it is called.
            action: Does it.

        Raises:
            DeviceError: If the device cannot be reached: for every OSError.
            UntrustworthyDeviceError: If it raises anything else that is no error of this program.
        """
        try:
            return action()
        except TcrctlError:
            raise
        except OSError as error:
            raise DeviceError(f"{self._origin.what}: {told(error, self._origin.file)}") from error
        except (Exception, SystemExit) as error:
            raised = told(error, self._origin.file)
            raise UntrustworthyDeviceError(f"{self._origin.what}: {name} raised {raised}") from error

    def checked(self, name: str, value: Any, *kinds: type) -> Any:
        """Return a value, if it is of one of these kinds."""
        if not isinstance(value, kinds) or (isinstance(value, bool) and bool not in kinds):
            wanted = " or ".join("None" if kind is type(None) else kind.__name__ for kind in kinds)
            raise self.refused(name, f"a {type(value).__name__}, not a {wanted}")
        return value

    def findings(self, *given: Any) -> Iterable[Finding]:
        """Return what the device's own checks find."""
        found = self.call("checks", lambda: list(self._made.checks(*given)))
        return [self.checked("checks", one, Finding) for one in found]

    def refused(self, name: str, what: str) -> UntrustworthyDeviceError:
        """Return the error that a member returned what cannot be."""
        return UntrustworthyDeviceError(f"{self._origin.what}: {name} returned {what}")

    def close(self) -> None:
        """Close the device; an error in it changes nothing any more."""
        with suppress(Exception, SystemExit):
            self._made.close()


def _opened(plugin: Plugin, given: tuple[Any, ...]) -> Any:
    """Build a device; one that cannot be reached is no mistake in the code."""
    origin: Origin = plugin.origin
    try:
        return plugin.build(*given)
    except OSError as error:
        raise DeviceError(f"{origin.what}: {told(error, origin.file)}") from error
