"""How an emulated bench differs from a perfect one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from tcrctl.plant.reality_settings import Level
from tcrctl.plant.settings import Mismatch

#: That of the shipped experiments.
SHIPPED_MISMATCH: Final = Mismatch(springs_youngs_modulus=0.7, density=1.2)


@dataclass(frozen=True, slots=True)
class EmulationSettings:
    """How the emulated bench differs from a perfect one.

    Attributes:
        mismatch: By what the robots differ from the controller's model; None for not at all.
        realistic: Size of everything else that real robots, drives and cameras have; ``off`` for nothing.
        noise: Standard deviation of every marker coordinate [m].
        rate: Camera frames per second [Hz].
        version: Newest NatNet version of the server.
        watchdog_ms: Watchdog of the PLCs [ms].
        seed: Seed of everything random.
        unicast_to: Where frames go in unicast: ``sender`` of the request or the ``data_port``.
    """

    mismatch: Mismatch | None = SHIPPED_MISMATCH
    realistic: Level = "off"
    noise: float = 50e-6
    rate: float = 240.0
    version: str = "4.1"
    watchdog_ms: int = 200
    seed: int = 0
    unicast_to: str = "sender"
