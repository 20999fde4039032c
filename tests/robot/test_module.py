"""The module of the robot: numbers, names and rows agree, and nobody else counts nodes."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from tcrctl.robot import module

PACKAGE = Path(module.__file__).parents[1]


@pytest.mark.parametrize("n_modules", [1, 3])
def test_every_node_has_a_name_and_the_name_leads_back_to_its_row(n_modules):
    names = module.node_names(n_modules)
    assert len(names) == module.node_count(n_modules)
    assert [module.node_index(name) for name in names] == list(range(len(names)))
    assert module.module_count(len(names)) == n_modules


def test_rings_and_apexes_take_the_nodes_that_their_rows_name():
    nodes = np.arange(36.0).reshape(12, 3)
    for i, (ring, apex) in enumerate(zip(module.rings(nodes), module.apexes(nodes), strict=True)):
        assert np.array_equal(ring, nodes[list(module.ring_nodes(i))])
        assert np.array_equal(apex, nodes[module.apex_row(i)])
        assert {module.module_of(row) for pair in module.rigid_bars(i) for row in pair} == {i}
    assert [name for name in module.node_names(2) if not module.is_ring_node(name)] == [
        "base.apex",
        "m1.apex",
        "m2.apex",
    ]


def test_the_rows_of_all_rings_leave_out_base_and_apexes():
    assert module.ring_rows(2) == [4, 5, 6, 8, 9, 10]


def test_only_the_module_itself_knows_how_many_nodes_it_has():
    counts = re.compile(r"(?<![\w.])(12 \* |4 \* (?:ring|module|i\b)|(?://|%) (?:4|12)\b|range\(12\))")
    offenders = {
        f"{path.relative_to(PACKAGE)}: {line.strip()}"
        for path in PACKAGE.rglob("*.py")
        if path.name not in ("module.py", "ring_frames.py")
        for line in path.read_text().splitlines()
        if counts.search(line) and '"""' not in line and "``" not in line
    }
    assert offenders == set()
