"""Where caches lie: with the user, with the program, or among temporary files of nobody else."""

from __future__ import annotations

import os
import sys
import tempfile

import pytest

from support.program_copy import ProgramCopy, unwritable
from tcrctl.caches.fonts import FONTS, place_fonts
from tcrctl.caches.places import Place, is_writable, places


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


@pytest.mark.skipif(sys.platform == "win32", reason="XDG")
@pytest.mark.parametrize(
    ("environment", "first"),
    [
        ({"HOME": "/h"}, "/h/.cache/tcrctl"),
        ({"HOME": "/h", "XDG_CACHE_HOME": "/x"}, "/x/tcrctl"),
        ({"HOME": "/h", "XDG_CACHE_HOME": "x"}, "/h/.cache/tcrctl"),
        ({"HOME": "~"}, "/p/__pycache__"),
        ({"HOME": ""}, "/p/__pycache__"),
        ({}, "/p/__pycache__"),
    ],
)
def test_the_users_cache_comes_first_if_there_is_one(tmp_path, environment, first):
    found = places(environment, tmp_path / "p")
    assert str(found[0].path).removeprefix(str(tmp_path)) == first
    assert [place.shared for place in found].count(True) == 1
    assert found[-1].shared


def test_a_place_that_cannot_be_written_has_no_room(tmp_path):
    assert Place(unwritable(tmp_path / "file")).inside("kernels") is None
    assert Place(tmp_path / "folder").inside("kernels") == tmp_path / "folder" / "kernels"
    assert is_writable(tmp_path / "folder" / "kernels")


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="owners of files")
@pytest.mark.parametrize("trap", ["open to all", "a link"])
def test_a_temporary_folder_that_others_could_have_filled_is_not_used(tmp_path, temporary, trap):
    place = places({}, tmp_path)[-1]
    if trap == "a link":
        (tmp_path / "elsewhere").mkdir(mode=0o700)
        place.path.symlink_to(tmp_path / "elsewhere")
    else:
        place.path.mkdir()
        place.path.chmod(0o777)
    assert place.path.parent == temporary
    assert not place.trusted
    assert place.inside("kernels") is None


def test_nothing_is_made_where_nothing_is_kept(tmp_path, temporary):
    assert not any(place.trusted for place in places({}, tmp_path) if place.shared)
    assert list(temporary.iterdir()) == []


def test_matplotlib_goes_where_it_always_does_if_it_can(tmp_path):
    environment = {"HOME": str(tmp_path)}
    place_fonts(environment)
    assert environment == {"HOME": str(tmp_path)}
    environment = {FONTS: str(tmp_path / "mine")}
    place_fonts(environment)
    assert environment == {FONTS: str(tmp_path / "mine")}


@pytest.mark.parametrize("given", [None, "unwritable"])
def test_matplotlib_has_a_folder_where_the_home_cannot_be_written(tmp_path, temporary, given):
    home = unwritable(tmp_path / "home")
    environment = {"HOME": str(home), **({FONTS: str(home / "fonts")} if given else {})}
    place_fonts(environment, tmp_path / "package")
    assert environment[FONTS] == str(tmp_path / "package" / "__pycache__" / "matplotlib")
    unwritable(tmp_path / "other" / "__pycache__")
    place_fonts(environment := {"HOME": str(home)}, tmp_path / "other")
    assert environment[FONTS].startswith(str(temporary))


DRAWING = "import tcrctl, matplotlib; from matplotlib import font_manager; print(matplotlib.get_cachedir())"


@pytest.mark.slow
@pytest.mark.parametrize("home", [None, "~", "a file"])
def test_matplotlib_says_nothing_keeps_its_fonts_and_makes_them_again_if_they_are_damaged(tmp_path, home):
    program = ProgramCopy(tmp_path)
    given = str(unwritable(tmp_path / "file")) if home == "a file" else home
    for _ in range(2):
        done = program.python("-c", DRAWING, HOME=given)
        assert "temporary cache directory" not in done.stderr
        assert "writable" not in done.stderr
        (fonts,) = (program.package / "__pycache__" / "matplotlib").glob("fontlist*.json")
        assert len(fonts.read_text()) > 1000
        fonts.write_text(fonts.read_text()[:500])
    assert not (tmp_path / "work" / "~").exists()
