"""Pages of the shipped experiments: what each is, its file, and what came out."""

from __future__ import annotations

import shutil
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tcrctl.config import shipped, strict_yaml


def write(folder: Path, figures: Path | None) -> None:
    """Write a page for every experiment, and one that lists them.

    Args:
        folder: Where the pages go.
        figures: Folder of figures, which are made if they are missing; None: pages without figures.
    """
    folder.mkdir()
    rows = []
    for name, path in shipped.experiments().items():
        data = strict_yaml.load(path).data
        pictures = [] if figures is None else drawn(name, figures)
        for picture in pictures:
            shutil.copy(picture, folder)
        (folder / f"{name}.md").write_text(page(name, data, pictures), encoding="utf-8")
        rows.append(
            f"| [{name}]({name}.md) | `{data['robot']}` | {data['description']} | {data.get('source', '')} |"
        )
    names = "\n".join(shipped.experiments())
    (folder / "index.md").write_text(
        "# Gallery\n\nThe shipped experiments, one for each figure, table or task of the paper and some more.\n\n"
        "| experiment | robot | what it is | source |\n| --- | --- | --- | --- |\n" + "\n".join(rows) + "\n\n"
        f"```{{toctree}}\n:hidden:\n\n{names}\n```\n",
        encoding="utf-8",
    )


def page(name: str, data: dict[str, Any], pictures: list[Path]) -> str:
    """Return the page of an experiment."""
    shown = "\n".join(f"![{picture.stem.rpartition('_')[2]}]({picture.name})\n" for picture in pictures)
    source = f" ({data['source']})" if data.get("source") else ""
    return (
        f"# {name}\n\n{data['description']}{source}.\n\n```sh\ntcrctl run {name}\n```\n\n{shown}\n"
        f"```{{literalinclude}} ../experiments/{name}.yaml\n:language: yaml\n```\n"
    )


def drawn(name: str, folder: Path) -> list[Path]:
    """Return the figures of an experiment; it is run if there are none."""
    folder.mkdir(parents=True, exist_ok=True)
    found = sorted(folder.glob(f"{name}.*.png"))
    return found or _draw(name, folder)


def _draw(name: str, folder: Path) -> list[Path]:
    from tcrctl.analysis.history import read_histories
    from tcrctl.experiment.prepare import prepare
    from tcrctl.experiment.run import run_experiment
    from tcrctl.experiment.spec import load_spec
    from tcrctl.plots import draw, save, worth_drawing

    with TemporaryDirectory() as runs:
        summary = run_experiment(prepare(load_spec(name)), out=Path(runs))
        if summary.log is None:
            raise RuntimeError(f"{name}: {summary.reason}")
        histories = read_histories([summary.log])
        wanted = [figure for figure in ("task", "overview", "error") if figure in worth_drawing(histories)][
            :2
        ]
        made = [folder / f"{name}.{i}_{figure}.png" for i, figure in enumerate(wanted)]
        for figure, picture in zip(wanted, made, strict=True):
            save(draw(figure, histories), picture)
    return made
