"""The list of needed kernels tells the truth about kernels, types and calls; and about runs."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tcrctl.config import shipped
from tcrctl.experiment.kernel_words import kernel_words
from tcrctl.experiment.spec import load_spec
from tcrctl.kernels.needed import dispatcher, read_needed, write_needed
from tcrctl.kernels.type_words import TypeWords
from tcrctl.numerics.kernel import Part

RECORDER = Path(__file__).parents[2] / "benchmarks" / "needed_kernels.py"
AGAIN = "nox -s kernels writes the list anew"


@pytest.fixture(scope="module")
def needed():
    return read_needed()


@pytest.mark.slow
def test_every_kernel_of_the_list_is_there_and_its_words_stand_for_types(needed):
    words = TypeWords(needed.tuples)
    for one in needed.kernels:
        assert one.when is None or not isinstance(dispatcher(one.kernel), Part), one.kernel
        for word in one.arguments:
            assert words.word_of(words.type_of(word)) == word
    assert words.tuples == {name: tuple(of) for name, of in needed.tuples.items()}


def test_callees_stand_before_their_callers_and_no_kernel_twice(needed):
    assert all(callee < number for number, one in enumerate(needed.kernels) for callee in one.calls)
    assert len({(one.kernel, one.arguments) for one in needed.kernels}) == len(needed.kernels)


def test_the_list_is_read_as_it_was_written(needed, tmp_path):
    write_needed(needed, tmp_path / "needed.json")
    assert (tmp_path / "needed.json").read_bytes() == Path(
        sys.modules[read_needed.__module__].FILE
    ).read_bytes()


def words_of(name, *overrides):
    loaded = load_spec(name, overrides)
    return kernel_words(loaded.spec, loaded.robot)


def test_every_shipped_experiment_finds_what_its_plant_needs_and_not_everything(needed):
    everything = sum(one.when is not None for one in needed.kernels)
    for name in shipped.experiments():
        called = needed.called_with(words_of(name))
        assert "robot.dynamics.advance" in {needed.kernels[i].kernel for i in called}
        assert len(called) < everything


def recorded(*case, **variables):
    """What a run in a process of its own has compiled, or loaded if all is in the cache."""
    command = [sys.executable, str(RECORDER), "--one", *case]
    done = subprocess.run(command, capture_output=True, text=True, check=True, **variables)
    return json.loads(done.stdout.splitlines()[-1])


def named(told):
    """Kernels and words of arguments as a run tells them, with its own table of tuples."""
    words = TypeWords(told["tuples"])
    loaded = told["loaded"] or [one for one, _, _ in told["compiled"]]
    return {(kernel, tuple(words.type_of(word) for word in arguments)) for kernel, arguments in loaded}


def listed(needed, numbers):
    words = TypeWords(needed.tuples)
    return {
        (needed.kernels[i].kernel, tuple(map(words.type_of, needed.kernels[i].arguments))) for i in numbers
    }


def with_callees(needed, numbers):
    found, waiting = set(), list(numbers)
    while waiting:
        number = waiting.pop()
        if number not in found:
            found.add(number)
            waiting.extend(needed.kernels[number].calls)
    return found


@pytest.mark.slow
def test_a_run_loads_what_the_list_says(needed):
    told = recorded("letter_t")
    while told["compiled"]:
        told = recorded("letter_t")
    missing = {kernel for kernel, _ in named(told) - listed(needed, needed.called_with(told["words"]))}
    assert missing == set(), AGAIN


@pytest.mark.slow
@pytest.mark.thorough
def test_a_fresh_run_compiles_what_the_list_says_and_little_else(needed, tmp_path, monkeypatch):
    """A part may be needed for other types of literals; words of settings may ask for a small kernel too many."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    told = recorded("letter_t")
    numbers = with_callees(needed, needed.called_with(told["words"]))
    assert len({kernel for kernel, _ in named(told) - listed(needed, numbers)}) <= 2, AGAIN
    idle = [i for i in numbers if not listed(needed, [i]) <= named(told)]
    seconds = [sum(needed.kernels[i].seconds for i in which) for which in (idle, numbers)]
    assert seconds[0] < 0.05 * seconds[1], AGAIN
