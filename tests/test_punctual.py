"""What fails in real time counts only on a computer that was not late."""

from __future__ import annotations

import pytest

from support import punctual
from support.punctual import TRIES, late_or_not, on_a_punctual_computer


class Late(punctual.Lateness):
    """A computer that is late for good."""

    def __enter__(self):
        self.worst_s = 1.0
        return self

    def __exit__(self, *error):
        pass


@pytest.fixture
def failing():
    """A test that fails, and how often it was tried."""
    tries = []

    @on_a_punctual_computer
    def test():
        tries.append(1)
        raise AssertionError("too late")

    return test, tries


def test_a_failure_in_time_is_a_failure_at_once(failing, monkeypatch):
    monkeypatch.setattr(punctual, "LATE_S", 10.0)
    test, tries = failing
    with pytest.raises(AssertionError, match="too late"):
        test()
    assert len(tries) == 1


def test_a_failure_on_a_late_computer_is_tried_again_and_the_last_one_counts(failing, monkeypatch):
    monkeypatch.setattr(punctual, "Lateness", Late)
    test, tries = failing
    with pytest.raises(AssertionError, match="too late"):
        test()
    assert len(tries) == TRIES


def test_what_has_no_excuse_counts_at_once(monkeypatch):
    monkeypatch.setattr(punctual, "Lateness", Late)
    tries = []

    @on_a_punctual_computer
    def test():
        tries.append(1)
        with late_or_not():
            raise AssertionError("a step of 9 mm")

    with pytest.raises(AssertionError, match="9 mm"):
        test()
    assert len(tries) == 1


def test_what_passes_passes_however_late_the_computer_is(monkeypatch):
    monkeypatch.setattr(punctual, "Lateness", Late)
    tries = []
    on_a_punctual_computer(lambda: tries.append(1))()
    assert len(tries) == 1
