"""Names of assets and markers, and the numbers that stand for them in a frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple


class MarkerName(NamedTuple):
    """A marker's name within its asset, and its number in frames (asset << 16 | member) if it is known."""

    name: str
    id: int | None


class Description(NamedTuple):
    """One asset: ``marker_set``, ``rigid_body``, ``skeleton`` or ``asset`` (trained marker set)."""

    kind: str
    name: str
    id: int | None
    markers: tuple[MarkerName, ...]


@dataclass(frozen=True, slots=True)
class ModelDefinitions:
    """What the server tracks.

    Attributes:
        descriptions: Assets in the server's order.
        cameras: Names of the cameras.
        skipped: Types of descriptions that are not known here.
    """

    descriptions: tuple[Description, ...] = ()
    cameras: tuple[str, ...] = ()
    skipped: tuple[int, ...] = ()

    def labels(self) -> dict[str, int]:
        """Return the numbers of all markers by label ``asset.marker``.

        Names come from the asset itself or, before 4.0, from the marker set of the same name: a server lists
        one for every asset. Markers without a name are called by their place: ``asset.1``. A label
        that two markers have says nothing about which is meant, so it is none.
        """
        sets = {each.name: each.markers for each in self.descriptions if each.kind == "marker_set"}
        found: dict[str, set[int]] = {}
        for asset in self.descriptions:
            others = sets.get(asset.name, ())
            markers = asset.markers
            if asset.kind == "rigid_body" and not markers and asset.id is not None:
                markers = tuple(MarkerName("", (asset.id << 16) | (k + 1)) for k in range(len(others)))
            for k, (name, number) in enumerate(markers):
                if number is not None:
                    other = others[k].name if len(others) == len(markers) else ""
                    found.setdefault(f"{asset.name}.{name or other or k + 1}", set()).add(number)
        return {label: numbers.pop() for label, numbers in found.items() if len(numbers) == 1}
