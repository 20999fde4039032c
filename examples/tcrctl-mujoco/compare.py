"""The shipped controller on two plants that share no mechanics: python compare.py [NAME...] (minutes).

Both plants are the controller's own model, measured without noise or delay; what differs is who integrates it.
"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import tcrctl

EXPERIMENTS: Final = ("letter_t", "fixed_point_rotation", "cone_frustum", "helix", "dynamic_10s")
PLANTS: Final[dict[str, dict[str, Any]]] = {"tcrctl": {"kind": "simulated"}, "MuJoCo": {"kind": "mujoco"}}


def main(names: tuple[str, ...]) -> None:
    """Run everything, and print a table in Markdown."""
    print("| experiment | plant | status | position, max / rms [mm] | angle, max [deg] | tensions [N] |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name in names:
        for plant, keys in PLANTS.items():
            with TemporaryDirectory() as out:
                told = tcrctl.run(name, set={"plant": keys}, out=Path(out)).summary
            print(f"| {name} | {plant} | {told['status']} | {row(told)} |", flush=True)


def row(told: dict[str, Any]) -> str:
    """Return the figures of a run, as cells."""
    position, angle, tension = told["position_error_mm"], told["orientation_error_deg"], told["tension_n"]
    turned = "-" if angle is None else f"{angle['max']:.3f}"
    pulls = f"{tension['min']:.2f} .. {tension['max']:.2f}"
    return f"{position['max']:.3f} / {position['rms']:.3f} | {turned} | {pulls}"


if __name__ == "__main__":
    main(tuple(sys.argv[1:]) or EXPERIMENTS)
