"""Tables of measurements as other programs write them."""

from __future__ import annotations

from pathlib import Path

import pytest

from tcrctl.errors import SpecError
from tcrctl.identify.table_data import read_table

CASES = Path(__file__).parents[1] / "cases" / "tables"
CABLES = [f"c{i}" for i in range(1, 7)]


def plain():
    return (CASES / "semicolons.csv").read_text().replace(";", ",")


def problem(tmp_path, text):
    path = tmp_path / "t.csv"
    path.write_bytes(text.encode())
    with pytest.raises(SpecError) as caught:
        read_table(path, CABLES)
    (found,) = caught.value.problems
    return str(found).removeprefix(f"{path}:")


def names(path):
    return [entry["name"] for entry in read_table(path, CABLES).data["configurations"]]


def test_every_kind_of_line_end_is_one(tmp_path):
    expected = ["initial", "bending", "contraction", "s_shape"]
    assert names(CASES / "carriage_returns.csv") == expected
    for end in ("\n", "\r\n"):
        path = tmp_path / "t.csv"
        path.write_bytes(plain().replace("\n", end).encode())
        assert names(path) == expected


@pytest.mark.parametrize(("mark", "said"), [(";", ";"), ("\t", "a tab"), ("|", "|")])
def test_another_separator_is_one_line(tmp_path, mark, said):
    assert problem(tmp_path, plain().replace(",", mark)) == f"1:1: separated by {said} where , is needed"


@pytest.mark.parametrize("rows", [0, 20_000])
def test_a_quote_that_is_not_closed_is_told_with_its_line(tmp_path, rows):
    text = plain().replace("contraction", '"contraction') + "x,0,0,0,0,0,0,p,1,1,1\n" * rows
    assert problem(tmp_path, text) == "4:1: a quote that is opened here is not closed"


@pytest.mark.parametrize("number", ["6_0", "0x10", "inf", "1e999", "\u0661\u0662"])
def test_numbers_are_those_of_tables(tmp_path, number):
    text = plain().replace("s_shape,60", f"s_shape,{number}")
    assert problem(tmp_path, text) == f"5:1: drive_c1_mm: must be a finite number or empty, not '{number}'"


@pytest.mark.parametrize("character", ["\0", "\x1b", "\u202e"])
def test_characters_that_act_or_hide_are_refused(tmp_path, character):
    for before, column in (("ben", 4), ("", 1)):
        text = plain().replace("bending", f"{before}{character}ding")
        said = f"3:{column}: character U+{ord(character):04X} is not allowed in a table"
        assert problem(tmp_path, text) == said
        assert problem(tmp_path, text.replace("\n", "\r\n")) == said
