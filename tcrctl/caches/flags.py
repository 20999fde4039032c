"""What libraries read when they are loaded, so that the same kernels are compiled wherever they are used."""

from __future__ import annotations

import os
import sys
from collections.abc import MutableMapping
from typing import Final

#: Threads for the small matrices of a control step would only wait for each other. The kernels gain nothing from
#: the compiler's higher levels, and a cold start is a fifth shorter without them.
FLAGS: Final = {"OPENBLAS_NUM_THREADS": ("1", "numpy"), "NUMBA_OPT": ("1", "numba")}


def set_flags(environment: MutableMapping[str, str] = os.environ) -> None:
    """Set every flag that is not set, and whose library is not loaded yet: then it would say what is not so."""
    for name, (value, library) in FLAGS.items():
        if library not in sys.modules:
            environment.setdefault(name, value)
