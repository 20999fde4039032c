"""Strict YAML: what scalars mean, where problems are reported, what --set does."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field

from tcrctl.config import strict_yaml
from tcrctl.config.settings import OrOff, Settings, refuse
from tcrctl.errors import InputError, SpecError

numbers = st.floats(allow_nan=False, allow_infinity=False) | st.integers(-(10**30), 10**30)
words = st.text(
    st.characters(codec="utf-8", exclude_categories=("Cc", "Cs"), exclude_characters="\ufeff\ufffe\uffff")
)
tricky = st.sampled_from(
    ["off", "true", "1e3", ".5", "null", "~", "", "12:30", "2001-01-01", "<<", "0x1F", "- a", "a: b"]
)
texts = words | tricky
trees = st.recursive(
    numbers | texts | st.booleans() | st.none(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(texts, inner, max_size=4),
    max_leaves=12,
)


class Dog(Settings):
    kind: Literal["dog"]
    dog: int = 1
    length_m: float = Field(1.0, gt=0)


class Cat(Settings):
    kind: Literal["cat"]
    lives: int = 9


class Lead(Settings):
    low: float = 0.0
    high: float = 1.0

    def model_post_init(self, _: object) -> None:
        refuse([(("high",), "must be above low")] if self.high <= self.low else [])


class Kennel(Settings):
    pet: Annotated[Dog | Cat, Field(discriminator="kind")]
    pair: tuple[float, float] = (0.0, 1.0)
    pets: tuple[Annotated[Dog | Cat, Field(discriminator="kind")], ...] = ()
    lead: OrOff[Lead] = None


def problems_of(text: str, model: type[Settings] = Kennel) -> list[str]:
    with pytest.raises(SpecError) as caught:
        strict_yaml.validate(strict_yaml.loads(text, "f.yaml"), model)
    return [str(problem) for problem in caught.value.problems]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-3", 1e-3), ("1e3", 1000.0), (".5", 0.5), ("5.", 5.0), ("-.5E+2", -50.0), ("+7", 7), ("012", 12),
        ("0o17", 15), ("0x1F", 31), ("off", "off"), ("on", "on"), ("yes", "yes"), ("n", "n"),
        ("12:30:00", "12:30:00"), ("2001-12-14", "2001-12-14"), ("1_000", "1_000"), ("=", "="),
        ("'1e3'", "1e3"), ('"true"', "true"),
        ("true", True), ("False", False), ("~", None), ("null", None), ("inf", "inf"), ("e3", "e3"),
    ],
)  # fmt: skip
def test_plain_scalars_follow_the_yaml_1_2_core_schema(text: str, value: object) -> None:
    found = strict_yaml.loads(f"a: {text}").data["a"]
    assert (type(found), found) == (type(value), value)


@pytest.mark.slow
@given(trees)
def test_whatever_is_dumped_is_read_back_unchanged(data: object) -> None:
    found = strict_yaml.loads(strict_yaml.dumps(data)).data
    assert repr(found) == repr(data)  # repr also tells 1 from 1.0 from True


@pytest.mark.slow
@given(st.dictionaries(st.from_regex("[a-z]{1,5}", fullmatch=True), trees, min_size=1, max_size=6))
def test_every_key_is_reported_in_the_line_where_it_stands(data: dict[str, object]) -> None:
    text = strict_yaml.dumps(data)
    document = strict_yaml.loads(text, "f.yaml")
    lines = text.splitlines()
    for key in data:
        name, line, column = document.where((key, "not there")).split(":")
        start = lines[int(line) - 1][int(column) - 1 :]
        assert name == "f.yaml"
        assert start.lstrip("'{\"").startswith(key)


@pytest.mark.parametrize(
    "bad", [".nan", ".inf", "-.Inf", "1e999", "!!float x", "!!set {a}", "!mine 3", "9" * 200]
)
def test_values_without_a_finite_meaning_are_refused_at_their_place(bad: str) -> None:
    document = strict_yaml.loads(f"a: 1\nb: [2, {bad}]\n", "f.yaml")
    ((path, problem),) = document.broken
    assert path == ("b", 1)
    assert problem.where == "f.yaml:2:8"


@pytest.mark.parametrize(
    ("text", "where", "words"),
    [
        ("a: 1\nb:\n  a: 2\n  a: 3\n", "f.yaml:4:3", "duplicate key, first given in line 3"),
        ("a: &x {b: 1}\nc:\n  <<: *x\n", "f.yaml:3:3", "merge keys"),
        ("a: 1\n2: 3\n", "f.yaml:2:1", "'2' in quotes"),
        ("a: 1\ntrue: 3\n", "f.yaml:2:1", "'true' in quotes"),
        ("a: 1\n? [b]\n: 3\n", "f.yaml:2:3", "map or list"),
        ("a: &x [1, *x]\n", "f.yaml:1:4", "alias inside"),
    ],
)
def test_forbidden_structures_are_refused_at_their_place(text: str, where: str, words: str) -> None:
    ((_, problem),) = strict_yaml.loads(text, "f.yaml").broken
    assert problem.where == where
    assert words in problem.message


@pytest.mark.parametrize(
    ("text", "where", "words"),
    [
        ("", "f.yaml:1:1", "empty"),
        ("# only a comment\n", "f.yaml:1:1", "empty"),
        ("a: 1\n---\nb: 2\n", "f.yaml:2:1", "more than one document"),
        ("a:\n\tb: 1\n", "f.yaml:2:1", "indent with spaces"),
        ("a: [1, 2\nb: 3\n", "f.yaml:2", "not YAML"),
        ("a: 1\nb: \x07\n", "f.yaml:2:4", "U+0007"),
        ("a: " + "[" * 100000, "f.yaml:1:", "nested more than"),
        ("a: *x\n", "f.yaml:1:4", "undefined alias"),
    ],
)
def test_broken_syntax_is_refused_at_its_place(text: str, where: str, words: str) -> None:
    with pytest.raises(SpecError) as caught:
        strict_yaml.loads(text, "f.yaml")
    assert caught.value.problems[0].where.startswith(where)
    assert words in caught.value.problems[0].message


def test_bytes_that_are_not_utf8_are_refused_at_their_place() -> None:
    with pytest.raises(SpecError, match=r"f.yaml:2:4: byte 0xff is not UTF-8"):
        strict_yaml.loads(b"a: 1\nb: \xff\n", "f.yaml")


def test_a_byte_order_mark_is_no_part_of_the_first_key() -> None:
    assert strict_yaml.loads("\ufeffa: 1".encode()).data == {"a": 1}


def test_files_that_cannot_be_read_are_input_errors(tmp_path: object) -> None:
    for path in (tmp_path, f"{tmp_path}/nothing.yaml"):
        with pytest.raises(InputError, match="cannot be read"):
            strict_yaml.load(str(path))


def test_aliases_stand_for_their_value_each_built_once() -> None:
    lines = ["l0: &l0 [x]"] + [f"l{i}: &l{i} [*l{i - 1}, *l{i - 1}]" for i in range(1, 10)]
    data = strict_yaml.loads("\n".join(lines)).data
    assert data["l2"] == [[["x"], ["x"]], [["x"], ["x"]]]
    assert data["l9"][0] is data["l9"][1] is data["l8"]


def test_every_problem_of_yaml_and_values_is_listed_in_file_order() -> None:
    lines = ["pet: {kind: dog, length_m: -1, lenght_m: 2}", "pair: [x, .nan]"]
    found = problems_of("\n".join([*lines, "pets: [{kind: cow}, {lives: 3}]", "pair: 1"]))
    assert [line.split(": ")[0] for line in found] == [
        "f.yaml:1:18",
        "f.yaml:1:32",
        "f.yaml:2:8",
        "f.yaml:2:11",
        "f.yaml:3:9",
        "f.yaml:3:21",
        "f.yaml:4:1",
    ]
    assert "must be > 0" in found[0]
    assert "not -1" in found[0]
    assert "did you mean length_m?; allowed: kind, dog, length_m" in found[1]
    assert 'pair.0: must be a number, not "x"' in found[2]
    assert "pets.0.kind: must be one of 'dog', 'cat', not \"cow\"" in found[4]
    assert "pets.1.kind: required key is missing; must be 'dog' or 'cat'" in found[5]


def test_a_key_named_like_its_kind_is_not_mistaken_for_the_tag_of_the_union() -> None:
    assert problems_of("pet: {kind: dog, dog: x}") == [
        'f.yaml:1:18: pet.dog: must be a whole number, not "x"'
    ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("pet: {kind: cat, lives: true}", "f.yaml:1:18: pet.lives: must be a whole number, not true"),
        ("pet: {kind: cat, lives: 9.0}", "f.yaml:1:18: pet.lives: must be a whole number, not 9.0"),
        ('pet: {kind: dog, length_m: "1"}', 'f.yaml:1:18: pet.length_m: must be a number, not "1"'),
        ("pet: [1]", "f.yaml:1:1: pet: must be a map of keys and values, not a list"),
        ("pair: [1, 2]", "f.yaml:1:1: pet: required key is missing"),
        ("[1, 2]", "f.yaml:1:1: must be a map of keys and values, not a list"),
        ("pet: {kind: cat}\npair: [1]", "f.yaml:2:1: pair.1: the list is too short: entry 2 is missing"),
        ("pet: {kind: cat}\nlead: on", 'f.yaml:2:1: lead: must be off or a map of keys and values, not "on"'),
        ("pet: {kind: cat}\nlead: {high: 0}", "f.yaml:2:8: lead.high: must be above low"),
    ],
)
def test_problems_name_place_key_value_and_what_was_allowed(text: str, message: str) -> None:
    assert problems_of(text) == [message]


def test_a_section_may_be_off_and_a_whole_number_is_a_number() -> None:
    settings = strict_yaml.validate(strict_yaml.loads("pet: {kind: cat}\npair: [1, 2]\nlead: off"), Kennel)
    assert settings.lead is None
    assert settings.pair == (1.0, 2.0)
    assert Kennel.model_validate_json(settings.model_dump_json()) == settings
    assert settings.model_dump(mode="json")["lead"] == "off"


@pytest.mark.slow
@given(st.data())
def test_an_override_changes_its_value_and_nothing_else(data: st.DataObject) -> None:
    before = {"a": {"b": [1, {"c": 2}], "d": 3}, "e": 4}
    key = data.draw(st.sampled_from(["a", "a.b", "a.b.0", "a.b.1.c", "a.b.1.new", "a.d", "e", "x.y.z"]))
    value = data.draw(trees)
    document = strict_yaml.loads(strict_yaml.dumps(before), "f.yaml")
    after = strict_yaml.override(document, f"{key}={strict_yaml.dumps(value)}")

    def flat(tree: object, path: tuple[str, ...] = ()) -> dict[tuple[str, ...], object]:
        items = (
            tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else None
        )
        if items is None or path == tuple(key.split(".")):
            return {path: tree}
        return {k: v for name, below in items for k, v in flat(below, (*path, str(name))).items()}

    path = tuple(key.split("."))
    untouched = {k: v for k, v in flat(before).items() if k[: len(path)] != path}
    found = flat(after.data)
    assert repr(found.pop(path)) == repr(value)
    assert found == untouched
    assert document.data == before
    keys = tuple(int(k) if k.isdigit() else k for k in path)
    assert after.where(keys) == after.where((*keys, "below")) == f"--set {key}"
    assert document.where(keys).startswith("f.yaml:")


@pytest.mark.parametrize(
    ("assignment", "words"),
    [
        ("a", "key=value"),
        ("=1", "key=value"),
        ("a=", "key=value"),
        ("a..b=1", "key=value"),
        ("e.f=1", "e is 4, neither a map nor a list"),
        ("b.2=1", "list of 2"),
        ("b.x=1", "list of 2"),
        ("b.-1=1", "list of 2"),
        ("e=.nan", "finite"),
        ("e=[1", "not YAML"),
        ("e={a: 1, a: 2}", "duplicate key"),
    ],
)
def test_overrides_that_lead_nowhere_are_refused(assignment: str, words: str) -> None:
    document = strict_yaml.loads("b: [1, 2]\ne: 4")
    with pytest.raises(SpecError, match=r"--set") as caught:
        strict_yaml.override(document, assignment)
    assert words in str(caught.value)


def test_an_override_mends_a_broken_value_and_the_last_one_wins() -> None:
    document = strict_yaml.loads("pet: {kind: dog, length_m: .nan}")
    for assignment in ("pet.length_m=2", "pet.length_m=3e0", "pet.dog=7"):
        document = strict_yaml.override(document, assignment)
    pet = strict_yaml.validate(document, Kennel).pet
    assert isinstance(pet, Dog)
    assert math.isclose(pet.length_m, 3)
    assert pet.dog == 7


def test_a_problem_in_an_overridden_value_points_at_the_option() -> None:
    document = strict_yaml.override(strict_yaml.loads("pet: {kind: dog}"), "pet.length_m=-2")
    with pytest.raises(SpecError) as caught:
        strict_yaml.validate(document, Kennel)
    assert str(caught.value) == "--set pet.length_m: must be > 0.0, not -2"


@pytest.mark.parametrize("text", ["\u00a0", "a\u2003", "\ufeffb: c", "\u200b- d"])
def test_blanks_that_are_no_spaces_are_written_so_that_they_can_be_read(text: str) -> None:
    assert strict_yaml.loads(strict_yaml.dumps({"a": [text]})).data == {"a": [text]}
