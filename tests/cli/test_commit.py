"""The commit of a checkout is what git says it is, in every way that git keeps it."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from tcrctl.cli.commit import commit

IDENTITY = ("-c", "user.name=a", "-c", "user.email=a@b")


def git(folder: Path, *arguments: str) -> str:
    done = subprocess.run(
        ["git", *IDENTITY, *arguments], cwd=folder, check=True, capture_output=True, text=True
    )
    return done.stdout.strip()


@pytest.mark.slow
def test_branches_packed_references_worktrees_and_detached_heads_are_read(tmp_path: Path) -> None:
    main, other = tmp_path / "main", tmp_path / "other"
    main.mkdir()
    git(main, "init", "-q")
    assert commit(main) == ""
    git(main, "commit", "-q", "--allow-empty", "-m", "one")
    assert commit(main) == git(main, "rev-parse", "HEAD") != ""
    git(main, "worktree", "add", "-q", "-b", "a/b", str(other))
    git(other, "commit", "-q", "--allow-empty", "-m", "two")
    assert commit(other) == git(other, "rev-parse", "HEAD") != commit(main)
    git(main, "pack-refs", "--all")
    assert [commit(main), commit(other)] == [git(place, "rev-parse", "HEAD") for place in (main, other)]
    git(other, "checkout", "-q", "--detach")
    assert commit(other) == git(other, "rev-parse", "HEAD")


@pytest.mark.parametrize("text", ["", "gitdir: nowhere", "ref: refs/heads/none", "\udcff"])
def test_no_checkout_has_no_commit(tmp_path: Path, text: str) -> None:
    assert commit(tmp_path) == ""
    (tmp_path / ".git").write_bytes(text.encode("utf-8", "surrogateescape"))
    assert commit(tmp_path) == ""
