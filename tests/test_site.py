"""The documentation site: pages made from the program tell all of it, and all pages are built without a warning."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tcrctl.cli.app import VERBS
from tcrctl.cli.rig.verbs import RIG_VERBS
from tcrctl.config import shipped
from tcrctl.log.columns import COLUMNS
from tcrctl.log.viewer_topics import TOPICS

ROOT = Path(__file__).parents[1]
SITE = ROOT / "docs" / "site"


def part(name):
    """A module of the site's builder, which is no package."""
    spec = importlib.util.spec_from_file_location(f"site_{name}", SITE / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def properties(schema):
    """Every key that a schema knows, with its description."""
    for definition in (schema, *schema.get("$defs", {}).values()):
        for key, value in definition.get("properties", {}).items():
            yield key, value.get("description", "")


@pytest.mark.parametrize("name", part("keys").files())
def test_the_reference_of_a_file_has_every_key_with_what_it_means(name):
    keys = part("keys")
    title, command, model = keys.files()[name]
    schema = model.model_json_schema()
    page = keys.page(name, title, command, schema)
    rows = [line for line in page.splitlines() if line.startswith("| `")]
    told = list(properties(schema))
    assert len(rows) == len(told)
    for key, meaning in told:
        one_line = meaning.replace("|", "\\|").replace("\n", " ")
        ending = f"| {one_line} |" if meaning else " |"
        assert any(row.startswith(f"| `{key}` |") and row.endswith(ending) for row in rows), key


@pytest.mark.parametrize(
    ("schema", "words"),
    [
        ({"type": "number", "exclusiveMinimum": 0, "maximum": 5}, "number, > 0, <= 5"),
        ({"enum": ["a", "b"]}, "`a` or `b`"),
        ({"type": "array", "items": {"type": "integer"}, "minItems": 1}, "list of integer, at least 1"),
        ({"anyOf": [{"type": "string"}, {"type": "null"}, {"const": "off"}]}, "text or `off`"),
        ({"type": "object", "additionalProperties": {"type": "boolean"}}, "map to true or false"),
        ({"type": "array", "prefixItems": [{"type": "number"}] * 2}, "list of 2: number, number"),
    ],
)
def test_types_of_a_schema_are_told_in_words(schema, words):
    page = part("keys").page("x", "X", "c", {"properties": {"key": {**schema, "description": "it"}}})
    assert page.splitlines()[-1] == f"| `key` | {words} | as below | it |"


def test_the_page_of_the_log_has_every_field_of_a_step():
    rows = [line for line in part("fields").page().splitlines() if line.startswith("| `")]
    cells = {cell.strip(" `*") for row in rows for cell in row.split("|")}
    assert {column.path for column in COLUMNS.values()} <= cells
    assert set(COLUMNS) | set(TOPICS) <= cells
    assert "| `estimate.q`* |" in "\n".join(rows)


@pytest.mark.slow
def test_the_site_is_built_without_a_warning_and_has_all_verbs_and_experiments(tmp_path):
    pytest.importorskip("myst_nb", reason="needs pip install 'tcrctl[docs]'")
    environment = {**os.environ, "PYTHONPATH": f"{ROOT}:{ROOT / 'hardware'}"}
    command = [sys.executable, str(SITE / "build.py"), str(tmp_path / "site")]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    pages = {str(path.relative_to(tmp_path / "site")) for path in (tmp_path / "site").rglob("*.html")}
    verbs = [*VERBS, *(f"rig-{name}" for name in RIG_VERBS)]
    wanted = [f"commands/{verb}.html" for verb in verbs] + [
        f"gallery/{name}.html" for name in shipped.experiments()
    ]
    assert set(wanted) <= pages
    documents = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "hardware").rglob("*.md")]
    written = {str(path.relative_to(ROOT).with_suffix(".html")) for path in documents if path.parent != SITE}
    assert written <= pages
