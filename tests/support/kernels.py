"""Which compiled kernels this process has loaded."""

from __future__ import annotations

import sys

from numba.core.dispatcher import Dispatcher


def loaded_kernels():
    modules = [module for name, module in list(sys.modules.items()) if name.startswith("tcrctl.")]
    kernels = {id(k): k for m in modules for k in vars(m).values() if isinstance(k, Dispatcher)}
    return {k.py_func.__qualname__: len(k.signatures) for k in kernels.values()}
