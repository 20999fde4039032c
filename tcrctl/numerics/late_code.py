"""Machine code of a kernel is made when somebody asks for a pointer into it, and not before.

numba optimises every kernel together with all that it calls, and translates that into machine code. Of a kernel
that only kernels call nobody ever runs it: callers link its bitcode, optimise and translate it again. Without that
a cold start takes three quarters of the time; what Python calls is made as ever, to the bit.

Of a kernel that is kept with its machine code the bitcode is read when a kernel that calls it is compiled: a run
that compiles nothing needs none of it.

The names of numba used here are not public. Where one of them is missing, numba works as it always does.
"""

from __future__ import annotations

from functools import cache
from typing import Any, Final

from llvmlite import binding as llvm
from numba.core.codegen import JITCodeLibrary
from numba.core.registry import cpu_target

_NEEDED: Final = (
    "_optimize_final_module", "_finalize_final_module", "_finalize_dynamic_globals", "_unserialize",
    "get_pointer_to_function", "serialize_using_object_code", "serialize_using_bitcode",
    "_get_module_for_linking", "_set_compiled_object",
)  # fmt: skip


@cache
def make_code_late() -> bool:
    """Begin, for everything that this process compiles from now on; returns whether this numba can."""
    codegen = cpu_target.target_context.codegen()
    known = all(hasattr(JITCodeLibrary, name) for name in _NEEDED)
    if not known or getattr(codegen, "_library_class", None) is not JITCodeLibrary:
        return False
    codegen._library_class = _LateLibrary
    codegen.set_env = _environments(codegen).set
    return True


class _LateLibrary(JITCodeLibrary):  # type: ignore[misc,unused-ignore]
    """What one kernel became, with all that it calls."""

    _made = False
    #: Machine code and bitcode of a kernel that was kept, as long as nobody has read the bitcode.
    _kept: tuple[bytes, bytes] | None = None

    def get_pointer_to_function(self, name: str) -> int:
        """Return the address of a function, 0 if it is not defined here."""
        self._ensure_finalized()
        if self._kept is not None:
            if f"{name}\0".encode() in self._kept[0]:  # one of its symbols, all of which could be linked
                known: int = self._codegen._engine.get_function_address(name)
                return known
            self._get_module_for_linking()
        if not self._made:
            if not _defines(self._final_module, name):
                return 0
            super()._optimize_final_module()
            self._make()
        address: int = super().get_pointer_to_function(name)
        return address

    def serialize_using_object_code(self) -> Any:
        """Return what is kept: machine code if there is any, else bitcode for callers."""
        self._ensure_finalized()
        return super().serialize_using_object_code() if self._made else self.serialize_using_bitcode()

    def _optimize_final_module(self) -> None:
        """Wait."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()  # they forbid to keep a kernel, with machine code or without
        self._finalized = True

    def _make(self) -> None:
        self._made = True
        super()._finalize_final_module()
        _environments(self._codegen).set_late(self._final_module)

    def _get_module_for_linking(self) -> Any:
        if self._kept is not None:
            self._shared_module = llvm.parse_bitcode(self._kept[1])
            self._codegen._engine._load_defined_symbols(self._shared_module)
            self._kept = None
        return super()._get_module_for_linking()

    @classmethod
    def _unserialize(cls, codegen: Any, state: Any) -> Any:
        name, kind, kept = state
        if kind != "object":
            return super()._unserialize(codegen, state)
        library = codegen.create_library(name)
        library.enable_object_caching()
        library._set_compiled_object(kept[0])
        library._kept = kept
        library._make()
        return library


class _Environments:
    """Where kernels find their constants in Python: a variable in machine code, which may not be there yet."""

    def __init__(self, codegen: Any):
        """Take numba's code generator."""
        self._engine = codegen._engine
        self._set = codegen.set_env
        self._waiting: dict[str, Any] = {}

    def set(self, name: str, environment: Any) -> None:
        """Set a variable, now or as soon as it is there."""
        if self._engine.get_global_value_address(name):
            self._set(name, environment)
        else:
            self._waiting[name] = environment

    def set_late(self, module: Any) -> None:
        """Set the variables of a module that was made now."""
        if not self._waiting:
            return
        for variable in module.global_variables:
            if variable.name in self._waiting and self._engine.get_global_value_address(variable.name):
                self._set(variable.name, self._waiting.pop(variable.name))


@cache
def _environments(codegen: Any) -> _Environments:
    return _Environments(codegen)


def _defines(module: Any, name: str) -> bool:
    try:
        return not module.get_function(name).is_declaration
    except NameError:
        return False
