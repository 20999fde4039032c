"""Which of the needed kernels are not in the cache."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from typing import Any

from tcrctl.caches.kernel_cache import KernelCache
from tcrctl.kernels.needed import NeededKernels, dispatcher
from tcrctl.kernels.type_words import TypeWords


def missing(needed: NeededKernels, wanted: Iterable[int]) -> list[int]:
    """Return the numbers of what has to be compiled, callees first; a file of the cache needs nothing else.

    Args:
        needed: All there are.
        wanted: Those that are called.
    """
    words, waiting, found = TypeWords(needed.tuples), list(wanted), set[int]()
    while waiting:
        number = waiting.pop()
        if number not in found and not _is_kept(needed, number, words):
            found.add(number)
            waiting.extend(needed.kernels[number].calls)
    return sorted(found)


def _is_kept(needed: NeededKernels, number: int, words: TypeWords) -> bool:
    """Tell whether a kernel is in the cache, or the list is wrong about it, which comes to the same."""
    one = needed.kernels[number]
    kept = True
    with suppress(ImportError, AttributeError, ValueError):
        cache: Any = dispatcher(one.kernel)._cache
        if isinstance(cache, KernelCache):
            kept = cache.holds(tuple(words.type_of(word) for word in one.arguments))
    return kept
