"""What keeps the tick undisturbed, and what carries its events."""

from __future__ import annotations

import gc
import os

import pytest

from tcrctl.errors import LogError
from tcrctl.loop.quiet import quiet_interpreter
from tcrctl.plant.rig.journal import Journal


@pytest.mark.slow
def test_the_garbage_collector_rests_inside_and_works_again_after():
    assert gc.isenabled()
    with quiet_interpreter(None, pytest.fail):
        assert not gc.isenabled()
        assert gc.get_freeze_count() > 0
    assert gc.isenabled()
    assert gc.get_freeze_count() == 0
    with pytest.raises(ZeroDivisionError), quiet_interpreter(None, pytest.fail):
        raise ZeroDivisionError
    assert gc.isenabled()


@pytest.mark.skipif(not hasattr(os, "sched_setscheduler"), reason="this system has no SCHED_FIFO")
def test_a_priority_is_granted_or_the_reason_is_told_and_taken_back_in_any_case():
    before, warnings = os.sched_getscheduler(0), []
    with quiet_interpreter(10, warnings.append):
        inside = os.sched_getscheduler(0)
    assert inside == os.SCHED_FIFO or "not granted" in warnings[0]
    assert os.sched_getscheduler(0) == before


def test_a_refused_priority_is_told_and_the_work_goes_on(monkeypatch):
    def refuse(*arguments):
        raise PermissionError(1, "Operation not permitted")

    warnings, done = [], []
    monkeypatch.setattr(os, "sched_setscheduler", refuse, raising=False)
    with quiet_interpreter(10, warnings.append):
        done.append(True)
    assert (len(warnings), done) == (1, [True])
    assert "Operation not permitted" in warnings[0]


def test_events_before_there_is_a_log_are_written_as_soon_as_there_is_one():
    now, told, written = [0.0], [], []
    journal = Journal(lambda: now[0], told.append)
    journal.report("supervisor", "info", "first")
    now[0] = 2.0
    journal.attach(lambda *event: written.append(event))
    journal.report("supervisor", "error", "second")
    assert written == [(0.0, "supervisor", "info", "first"), (2.0, "supervisor", "error", "second")]
    assert told == ["error: second"]


def test_what_repeats_itself_is_told_ever_less_often_and_logged_every_time():
    told, written = [], []
    journal = Journal(lambda: 0.0, told.append)
    journal.attach(lambda *event: written.append(event))
    for k in range(20):
        journal.report("supervisor", "warning", f"held for {50 + k} ms")
    assert len(written) == 20
    assert told == [
        "warning: held for 50 ms",
        "warning: held for 51 ms",
        "warning: held for 53 ms (4 times so far)",
        "warning: held for 57 ms (8 times so far)",
        "warning: held for 65 ms (16 times so far)",
    ]


def test_a_log_that_fails_does_not_keep_anybody_from_reporting():
    def full(*event):
        raise LogError("log.mcap", "disk full")

    told = []
    journal = Journal(lambda: 0.0, told.append)
    journal.attach(full)
    journal.report("supervisor", "error", "stop")
    assert told == ["error: stop"]
