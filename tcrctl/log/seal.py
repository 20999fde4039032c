"""Metadata records carry a checksum of their own: MCAP gives them none, and a killed run's log has no other."""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping
from typing import Final

#: Entry with the CRC-32 of the name and all other entries.
SEAL: Final = "crc32"


def sealed(name: str, entries: Mapping[str, str]) -> dict[str, str]:
    """Return the entries of a metadata record with its checksum."""
    plain = {key: value for key, value in entries.items() if key != SEAL}
    return {**plain, SEAL: _digest(name, plain)}


def unsealed(name: str, entries: Mapping[str, str]) -> dict[str, str] | None:
    """Return the entries without the checksum; None if it is another one. Older logs have none."""
    plain = {key: value for key, value in entries.items() if key != SEAL}
    return plain if entries.get(SEAL, _digest(name, plain)) == _digest(name, plain) else None


def _digest(name: str, plain: Mapping[str, str]) -> str:
    return f"{zlib.crc32(json.dumps([name, sorted(plain.items())]).encode()):08x}"
