"""The verbs of ``tcrctl rig``."""

from __future__ import annotations

from collections.abc import Callable

from tcrctl.cli.rig.calibrate import calibrate
from tcrctl.cli.rig.check import check
from tcrctl.cli.rig.excite import excite
from tcrctl.cli.rig.jog import jog
from tcrctl.cli.rig.reset import reset
from tcrctl.cli.rig.status import status
from tcrctl.cli.rig.zero import zero

RIG_VERBS: dict[str, Callable[..., None]] = {
    "check": check,
    "status": status,
    "calibrate": calibrate,
    "zero": zero,
    "excite": excite,
    "jog": jog,
    "reset": reset,
}
