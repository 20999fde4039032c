"""What a newcomer reads is true: links lead somewhere, commands and versions are those of the package."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]
FOLDERS = ("docs", "examples", "hardware")
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(path for name in FOLDERS for path in (ROOT / name).rglob("*.md"))])
#: Where the links of a page of the site start, which is not its folder in the tree.
SITE = ROOT / "docs" / "site"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def pinned():
    """Versions of ``constraints.txt`` by the normal form of the package's name."""
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    pins = (line.split("==") for line in lines if not line.startswith("#"))
    return {normal(name): version for name, version in pins}


def normal(name):
    return re.sub(r"[-_.]+", "-", name).lower()


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_link_within_the_tree_leads_to_a_file(document):
    targets = re.findall(r"\]\(([^)#\s]+)[^)]*\)", document.read_text())
    folder = ROOT if document.parent == SITE else document.parent
    missing = [t for t in targets if "://" not in t and not (folder / t).exists()]
    assert missing == []


def test_every_decision_is_in_the_index():
    folder = ROOT / "docs" / "decisions"
    listed = set(re.findall(r"\((\d\d-[\w-]+\.md)\)", (folder / "README.md").read_text()))
    assert listed == {path.name for path in folder.glob("[0-9]*.md")}


def test_every_dependency_has_an_exact_version_within_its_bounds():
    asked = PROJECT["dependencies"] + [
        r for extra in PROJECT["optional-dependencies"].values() for r in extra
    ]
    pins = pinned()
    for requirement in map(Requirement, asked):
        if requirement.name != PROJECT["name"]:
            assert requirement.specifier.contains(pins[normal(requirement.name)]), requirement


def test_the_commands_of_the_readme_install_exact_versions():
    installs = re.findall(r"^python3 -m venv.*pip install.*$", (ROOT / "README.md").read_text(), re.MULTILINE)
    assert len(installs) == 2
    assert all("pip install -c constraints.txt " in command for command in installs)


def test_the_citation_is_of_this_version_and_licence():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert citation["version"] == PROJECT["version"]
    assert citation["license"] == PROJECT["license"]
    assert "Apache License" in (ROOT / "LICENSE").read_text()
