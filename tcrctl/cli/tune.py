"""``tcrctl tune STUDY``: settings that make the worst runs better."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tcrctl.cli.options import LOGS, AsJson, Quiet, SideBySide, to_make, unfolded
from tcrctl.cli.progress import runs_bar

if TYPE_CHECKING:
    from tcrctl.study.loading import LoadedStudy
    from tcrctl.tune.tuning import Tuned

#: What is said if nothing better was found.
STAND = "the shipped settings stand"


@dataclass(frozen=True)
class How:
    """How is searched."""

    generations: Annotated[int, typer.Option("--generations", metavar="N", min=1, help="How many.")] = 10
    population: Annotated[
        int, typer.Option("--population", metavar="N", min=3, help="Candidates of each.")
    ] = 8
    seed: Annotated[int, typer.Option("--seed", metavar="N", min=0, max=2**31, help="Of the search.")] = 0
    held_out: Annotated[
        str | None,
        typer.Option(
            "--held-out", metavar="A..B", help="Plants that judge; default: as many after the study's."
        ),
    ] = None


@unfolded
def tune(
    name: Annotated[str, typer.Argument(metavar="STUDY", help="A study that varies ranges of numbers.")],
    how: How = How(),
    side: SideBySide = SideBySide(),
    out: Annotated[
        Path,
        typer.Option(
            "--out", metavar="DIR", parser=to_make, envvar=LOGS, help="Where the study's folder is."
        ),
    ] = Path("logs"),
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> None:
    """Lower the worst decile of a study's first measure over its seeds, by CMA-ES within its ranges.

    What is found is judged on plants that were not tuned on. If it is better there, experiment files
    NAME_tuned.yaml are written into the study's folder; if not, the shipped settings stand and nothing is written.
    Exit code 3: a run that is compared crashed, timed out or ended in an error.
    Every run is kept: started again, the search goes on where it was ended. Needs the extra tune.

    Examples:
      tcrctl tune tune_cone_frustum --generations 12
      tcrctl tune my_study.yaml --held-out 100..119 --dask local
    """
    from tcrctl.loop.interruption import signals_exit

    with signals_exit():
        from tcrctl.study.loading import load_study
        from tcrctl.study.row import WITHOUT_RESULT
        from tcrctl.tune.tuning import Search
        from tcrctl.tune.tuning import tune as search

        study = load_study(name)
        wanted = Search(how.generations, how.population, how.seed, _held_out(study, how.held_out))
    total = wanted.runs(len(study.spec.seeds or ()), len(study.spec.experiments))
    with runs_bar(study.spec.name, total, quiet=quiet) as told:
        found = search(study, wanted, engine=side.engine, out=out, told=told)
    files = _write(study, found, out)
    if as_json:
        print(json.dumps(_as_json(study, found, files)))
    elif not quiet:
        _print(found, files)
    if found.unanswered:
        print(f"error: {found.unanswered}; started again, tune tries them again", file=sys.stderr)
        raise typer.Exit(WITHOUT_RESULT)


def _held_out(study: LoadedStudy, text: str | None) -> tuple[int, ...]:
    from pydantic import TypeAdapter, ValidationError

    from tcrctl.errors import InputError
    from tcrctl.study.axes import Seeds

    seeds = study.spec.seeds or ()
    if text is None:
        first = max(seeds, default=0) + 1
        return tuple(range(first, first + max(1, len(seeds))))
    try:
        return TypeAdapter(Seeds).validate_python(text)
    except ValidationError as error:
        raise InputError(f"--held-out: {error.errors()[0]['msg']}") from None


def _write(study: LoadedStudy, found: Tuned, out: Path) -> list[Path]:
    from tcrctl.study.sweep import folder_of
    from tcrctl.tune.tuning import experiment_text

    files = []
    for name in study.spec.experiments if found.better else ():
        path = folder_of(study, out) / f"{Path(name).stem}_tuned.yaml"
        path.write_bytes(experiment_text(study, name, found))
        files.append(path)
    return files


def _as_json(study: LoadedStudy, found: Tuned, files: list[Path]) -> dict[str, Any]:
    return {
        "status": "failed" if found.unanswered else "success",
        "reason": found.unanswered or ("" if found.better else STAND),
        "study": study.spec.name,
        "better": found.better,
        "settings": dict(found.settings),
        "worst_decile": {"before": found.before, "after": found.after},
        "held_out_worst_decile": {"before": found.held_out_before, "after": found.held_out_after},
        "best": list(found.best),
        "files": [str(path) for path in files],
    }


def _print(found: Tuned, files: list[Path]) -> None:
    from tcrctl.cli.table import print_facts, print_table
    from tcrctl.study.groups import differences, groups
    from tcrctl.study.text import difference_table, group_table

    facts = [(key, str(value), "") for key, value in found.settings.items()]
    facts += [
        ("worst decile", f"{found.before:.3g} -> {found.after:.3g} on the plants tuned on", ""),
        (
            "",
            f"{found.held_out_before:.3g} -> {found.held_out_after:.3g} on others; 1 is the usual error",
            "",
        ),
    ]
    print_facts(facts)
    tables = [group_table(groups(found.judging, found.runs))]
    pairs = differences(found.judging, found.runs)
    tables += [difference_table(pairs, "case", "shipped")] if pairs else []
    for table in tables:
        print()
        print_table(table.head, table.rows)
    if files:
        print("\n".join(map(str, files)))
    elif not found.unanswered:
        print(f"{STAND}: nothing better on plants not seen")
