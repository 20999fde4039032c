"""Build the documentation site: python docs/site/build.py OUT [--figures DIR]; needs the extra ``docs``.

The links and pictures of the tree's documents hold as they stand. So they are copied as they are to a folder, pages
made from the program are written beside them, and Sphinx turns the folder into HTML; a warning is an error.
With ``--figures`` every shipped experiment is run once, which takes some minutes, and its figures are kept in that
folder; figures that are there already are taken as they are.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

os.environ.setdefault("NUMBA_OPT", "1")  # as the command line does

SITE = Path(__file__).parent
ROOT = SITE.parents[1]
sys.path.insert(0, str(SITE))

import commands  # noqa: E402
import fields  # noqa: E402
import gallery  # noqa: E402
import keys  # noqa: E402

#: Folders of which every file may be linked to.
FOLDERS = ("docs", "examples", "experiments", "hardware", "tcrctl/robot/models")
_LEFT_OUT = shutil.ignore_patterns("__pycache__", "site", "logs", "*.mcap")


def main() -> int:
    """Build the site; return what Sphinx says."""
    parser = argparse.ArgumentParser(description="Build the documentation site.")
    parser.add_argument("out", type=Path, metavar="OUT", help="folder of the site")
    parser.add_argument("--figures", type=Path, metavar="DIR", help="run all experiments, keep figures here")
    given = parser.parse_args()
    with TemporaryDirectory() as folder:
        source = Path(folder) / "source"
        stage(source, given.figures)
        return build(source, given.out)


def stage(source: Path, figures: Path | None) -> None:
    """Fill a folder with what Sphinx reads."""
    source.mkdir()
    for document in ROOT.glob("*.md"):
        shutil.copy(document, source)
    for name in FOLDERS:
        shutil.copytree(ROOT / name, source / name, ignore=_LEFT_OUT)
    for page in SITE.glob("*.md"):
        shutil.copy(page, source)
    commands.write(source / "commands")
    keys.write(source / "files")
    fields.write(source / "files" / "fields.md")
    gallery.write(source / "gallery", figures)


def build(source: Path, out: Path) -> int:
    """Run Sphinx in this process, whose settings of the compiler it shares."""
    from sphinx.cmd.build import main as sphinx

    doctrees = str(source.parent / "doctrees")
    return sphinx(["-W", "--keep-going", "-q", "-c", str(SITE), "-d", doctrees, str(source), str(out)])


if __name__ == "__main__":
    sys.exit(main())
