"""What a file from anywhere may cost, and characters in it that act or hide."""

from __future__ import annotations

from pathlib import Path

import pytest

from tcrctl.config import strict_yaml
from tcrctl.config.budget import MAX_BYTES, MAX_PROBLEMS, MAX_VALUES
from tcrctl.config.settings import Settings
from tcrctl.errors import InputError, SpecError
from tcrctl.experiment.spec import load_spec
from tcrctl.visible import cell, visible

CASES = Path(__file__).parents[1] / "cases" / "yaml"


def message(text):
    with pytest.raises(SpecError) as caught:
        strict_yaml.loads(text, "f.yaml")
    return str(caught.value)


class Numbers(Settings):
    values: tuple[float, ...]


@pytest.mark.parametrize("name", ["alias_bomb_5.yaml", "alias_bomb_7.yaml"])
def test_aliases_are_measured_before_they_are_written_out(name):
    assert f"more than {MAX_VALUES} values with every alias" in message((CASES / name).read_bytes())
    with pytest.raises(SpecError, match=f"{MAX_VALUES} values"):
        load_spec(str(CASES / name))


def test_so_are_long_texts_deep_nests_and_values_given_on_the_command_line():
    assert "characters with every alias" in message(f"a: &a {'x' * 10_000}\nb: [{'*a, ' * 500}1]")
    deep = "".join(f"a{i}: &a{i} {'[' * 60}{f'*a{i - 1}' if i else 'x'}{']' * 60}\n" for i in range(20))
    assert "levels deep" in message(deep)
    assert f"more than {MAX_VALUES} values" in message(f"[{'1,' * (MAX_VALUES + 1)}]")
    document = strict_yaml.loads("a: 1")
    bomb = "{a: &a [x,x,x,x,x,x,x,x,x,x], b: &b [*a,*a,*a,*a,*a,*a,*a,*a,*a,*a], "
    bomb += "c: &c [*b,*b,*b,*b,*b,*b,*b,*b,*b,*b], d: &d [*c,*c,*c,*c,*c,*c,*c,*c,*c,*c], e: [*d,*d]}"
    for assignment in (f"b={bomb}", f"b=[{'1,' * (MAX_VALUES + 1)}]", "a." * 10_000 + "b=1"):
        with pytest.raises(SpecError, match="more than"):
            strict_yaml.override(document, assignment)


def test_an_alias_used_now_and_then_is_welcome():
    assert strict_yaml.loads("a: &a [1, 2]\nb: [*a, *a]").data["b"] == [[1, 2], [1, 2]]


def test_a_file_that_is_too_large_is_not_read_whole(tmp_path):
    path = tmp_path / "large.yaml"
    with path.open("wb") as file:
        file.truncate(2**40)  # all holes
    with pytest.raises(InputError, match=f"larger than {MAX_BYTES} bytes"):
        strict_yaml.load(path)


@pytest.mark.slow
@pytest.mark.parametrize("values", ["x", ".nan", "[1]"])
def test_the_first_problems_of_thousands_are_listed(values):
    document = strict_yaml.loads(f"values: [{f'{values}, ' * 4000}1]")
    with pytest.raises(SpecError) as caught:
        strict_yaml.validate(document, Numbers)
    assert len(caught.value.problems) == MAX_PROBLEMS + 1
    assert "further problems" in str(caught.value.problems[-1])


def test_names_are_as_long_as_files_can_be():
    with pytest.raises(SpecError, match="at most 100 characters"):
        load_spec("letter_t", ["name=" + "a" * 250])
    with pytest.raises(SpecError, match="at most 100 characters"):
        load_spec(str(CASES / "long_name.yaml"))


def test_a_character_that_looks_like_a_space_is_found_where_it_stands():
    with pytest.raises(SpecError, match=r"no_break_space.yaml:4:6: not YAML: no-break space \(U\+00A0\)"):
        load_spec(str(CASES / "no_break_space.yaml"))
    assert message("a: 1\n\u3000b: 2\nc: [").startswith("f.yaml:2:1: not YAML: ideographic space")
    document = strict_yaml.loads("values: \u00a01")
    assert "no-break space" in str(document.broken[0][1])
    assert strict_yaml.loads("a: 5\u00a0mm").data == {"a": "5\u00a0mm"}  # within a text it is one


def test_text_that_acts_or_hides_is_spelt_out():
    assert visible("a\x1b[2Jb\u202ec\x7f\x9b") == "a\\x1b[2Jb\\u202ec\\x7f\\x9b"
    assert visible("\x1b[1mbold\x1b[0m\x1b[2J", keep_styles=True) == "\x1b[1mbold\x1b[0m\\x1b[2J"
    assert visible("line\n\ttab \u03b1") == "line\n\ttab \u03b1"
    assert "\x1b" not in str(InputError("f\x1b]0;title\x07.yaml: no such file"))


@pytest.mark.parametrize("text", ["=1+1", "+cmd|' /C calc'!A0", "-2+3", "@SUM(A1)", " =1", "\uff1d1"])
def test_no_cell_is_a_formula(text):
    assert cell(text) == f"'{text}"


@pytest.mark.parametrize("text", ["-1.5", "+2e-3", "-", "letter_t", "a=b", ""])
def test_numbers_and_words_stay_as_they_are(text):
    assert cell(text) == text
