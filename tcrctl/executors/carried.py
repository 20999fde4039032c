"""Something large that many pieces of work need: packed once, and unpacked once in every worker process."""

from __future__ import annotations

import hashlib
import pickle
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Generic, TypeVar

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Carried(Generic[T]):
    """A value on its way.

    Attributes:
        packed: The value, pickled.
        key: Digest of that.
    """

    packed: bytes
    key: str

    @property
    def value(self) -> T:
        """The value; the same object every time within a process, so nobody may change it."""
        found: T = _unpacked(self)
        return found


def carried(value: T) -> Carried[T]:
    """Pack a value."""
    packed = pickle.dumps(value)
    return Carried(packed, hashlib.sha256(packed).hexdigest())


@lru_cache(maxsize=4)
def _unpacked(parcel: Carried[Any]) -> Any:
    return pickle.loads(parcel.packed)
