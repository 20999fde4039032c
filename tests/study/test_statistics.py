"""What is said of samples holds: against scipy, against their own definition, and with runs that were stopped."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pyarrow.parquet
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from tcrctl.study.design import Cell
from tcrctl.study.groups import differences, groups
from tcrctl.study.plan import PlannedRun
from tcrctl.study.row import Row
from tcrctl.study.settings import StudySpec
from tcrctl.study.statistics import median_interval, share, spread
from tcrctl.study.table import tidy
from tcrctl.study.text import group_table
from tcrctl.study.values import value_of

SAMPLES = st.lists(st.floats(-1e6, 1e6), min_size=3, max_size=40)


@given(SAMPLES)
def test_quartiles_median_and_interval_are_in_order(values):
    found = spread(values, large_is_good=False)
    assert found.lower_quartile <= found.median <= found.upper_quartile <= found.worst == max(values)
    assert min(values) <= found.low <= found.median <= found.high <= max(values)


@given(SAMPLES, st.integers(1, 40))
def test_a_stopped_run_never_makes_anything_look_better(values, stopped):
    stopped = min(stopped, len(values))
    before = spread(values, large_is_good=False)
    after = spread([*values[stopped:], *[math.inf] * stopped], large_is_good=False)
    for name in ("median", "low", "high", "lower_quartile", "upper_quartile", "worst"):
        assert getattr(after, name) >= getattr(before, name)
    assert after.worst == math.inf


def test_the_interval_is_that_of_scipys_bootstrap():
    sample = np.sort(np.random.default_rng(3).gamma(2.0, size=40))
    expected = stats.bootstrap(
        (sample,), np.median, n_resamples=20000, method="percentile", rng=np.random.default_rng(1)
    ).confidence_interval
    assert median_interval(sample) == pytest.approx((expected.low, expected.high), rel=0.05)


@pytest.mark.slow
def test_the_interval_covers_the_true_median_as_often_as_it_says():
    random = np.random.default_rng(7)
    covered = [
        low <= 0.0 <= high for low, high in (median_interval(s) for s in random.standard_normal((200, 20)))
    ]
    assert stats.binomtest(sum(covered), 200, 0.95).pvalue > 1e-3


def test_too_few_runs_have_no_interval_and_a_share_of_all_is_no_certainty():
    assert all(map(math.isnan, median_interval(np.array([1.0, 2.0]))))
    found = share(20, 20)
    assert (found.count, found.n) == (20, 20)
    assert 0.8 < found.low < 0.9 < found.high <= 1.0  # Wilson: 0.839


def spec(**given):
    base = {
        "kind": "study",
        "name": "s",
        "experiments": ("letter_t",),
        "measures": ("position_error_mm.max",),
    }
    return StudySpec.model_validate({**base, **given}, strict=False)


def run(seed, value, case="a", status="success", **result):
    """A run of a case, with what its row says."""
    address = f"{case}{seed}".ljust(64, "0")
    levels = {"experiment": "letter_t", "case": case}
    result = {"position_error_mm": {"max": value}, **result} if status in ("success", "failed") else {}
    reason = "" if status == "success" else "why"
    return PlannedRun(address, levels, seed, Cell("letter_t", case, {})), Row(address, status, reason, result)


CASES = spec(cases={"a": {}, "b": {}}, compare={"factor": "case", "against": "a"})


def test_a_group_counts_who_met_the_criteria_and_who_was_stopped():
    runs = [run(0, 1.0), run(1, 2.0), run(2, 9.0, status="failed"), run(3, None, status="aborted")]
    (group,) = groups(CASES, runs)
    assert (group.met.count, group.stopped.count, group.met.n) == (2, 1, 4)
    found = group.measures["position_error_mm.max"]
    assert (found.n, found.median, found.worst) == (4, 5.5, math.inf)
    assert "stopped" in group_table([group]).markdown()


def test_a_measure_that_runs_do_not_have_is_left_out():
    lacking = spec(measures=("orientation_error_deg.max", "position_error_mm.max"))
    (group,) = groups(lacking, [run(0, 1.0, orientation_error_deg=None), run(1, None, status="aborted")])
    assert group.measures["orientation_error_deg.max"] is None
    assert not any("orientation" in title for title in group_table([group]).head)


def test_pairs_show_what_the_spread_of_seeds_hides():
    random = np.random.default_rng(0)
    plants = random.uniform(1.0, 100.0, 12)
    runs = [run(k, plant) for k, plant in enumerate(plants)]
    runs += [run(k, plant - 0.5, "b") for k, plant in enumerate(plants)]
    (found,) = differences(CASES, runs)
    assert (found.level, found.spread.n, found.better.count) == ("b", 12, 12)
    assert found.spread.median == pytest.approx(-0.5)
    assert found.spread.high < 0.0


def test_pairs_need_both_and_two_that_were_stopped_are_a_tie():
    runs = [run(0, 1.0), run(1, None, status="aborted"), run(2, 1.0), run(4, 1.0)]
    runs += [run(0, None, "b", "aborted"), run(1, None, "b", "aborted"), run(2, 0.5, "b"), run(3, 1.0, "b")]
    (found,) = differences(CASES, runs)
    assert (found.spread.n, found.better.count) == (3, 1)
    assert (found.spread.median, found.spread.worst) == (0.0, math.inf)


def test_the_worst_entry_of_a_list_counts_whichever_way_is_worse():
    _, row = run(
        0, 1.0, task={"targets": [{"e": 1.0, "beam_passes": True}, {"e": 3.0, "beam_passes": False}]}
    )
    assert value_of(row, "task.targets.e") == 3.0
    assert value_of(row, "task.targets.beam_passes") == 0.0
    assert value_of(row, "task.detected") is None
    assert value_of(replace(row, status="timeout"), "tension_n.min") == -math.inf


def test_the_tidy_table_has_a_value_for_every_column_and_all_digits():
    runs = [
        run(0, 0.1 + 0.2, task={"found": 2, "seen": [{"name": "x", "ok": True}]}),
        run(1, None, "b", "crashed"),
    ]
    planned, rows = zip(*runs, strict=True)
    table = tidy(planned, rows)
    assert {len(row) for row in table.rows} == {len(table.columns)}
    first, second = (dict(zip(table.columns, row, strict=True)) for row in table.rows)
    assert (first["task.found"], first["task.seen.0.ok"], second["task.found"]) == (2, True, None)
    assert "0.30000000000000004" in table.csv()
    assert second["reason"] == "why"
    assert "control_ms.p50" not in table.columns


def test_parquet_holds_the_table(tmp_path):
    runs = [run(0, 0.5, task={"found": 2}), run(1, 1.0, task={"found": 2.5}), run(2, None, "b", "crashed")]
    table = tidy(*zip(*runs, strict=True))
    table.write_parquet(tmp_path / "t.parquet")
    read = pyarrow.parquet.read_table(tmp_path / "t.parquet").to_pydict()
    assert tuple(read) == table.columns
    assert read["task.found"] == [2.0, 2.5, None]
    assert read["position_error_mm.max"] == [0.5, 1.0, None]


@pytest.mark.parametrize("form", ["csv", "latex", "markdown"])
def test_every_format_has_every_cell(form):
    table = group_table(groups(CASES, [run(0, 1.0, "50 % & more_"), run(0, 2.0, "b|c")]))
    lines = table.formatted(form).splitlines()
    split = {"csv": ",", "latex": " & ", "markdown": " | "}[form]
    body = [line for line in lines if split in line]
    assert len(body) == len(table.rows) + 1 + (form == "markdown")
    if form == "latex":
        assert r"50 \% \& more\_" in table.latex()
    if form == "markdown":
        assert r"b\|c" in table.markdown()
