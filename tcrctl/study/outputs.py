"""What a study leaves in its folder beside the rows: tables for people and programs, written anew every time."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from tcrctl.experiment.run_folder import replace_file
from tcrctl.experiment.summary import finite
from tcrctl.study.groups import Difference, Group, differences, done, groups
from tcrctl.study.settings import StudySpec
from tcrctl.study.sweep import Done
from tcrctl.study.table import Table, tidy, times
from tcrctl.study.text import Format, TextTable, difference_table, group_table

TABLE: Final = "table.csv"
PARQUET: Final = "table.parquet"
TIMES: Final = "times.csv"
SUMMARY: Final = "summary.md"


@dataclass(frozen=True, slots=True)
class Findings:
    """What a study says so far.

    Attributes:
        spec: The study.
        table: One row per run.
        times: What is of one run.
        groups: Runs that differ in nothing but the seed.
        differences: Pairs, if the study compares.
    """

    spec: StudySpec
    table: Table
    times: Table
    groups: tuple[Group, ...]
    differences: tuple[Difference, ...]

    def tables(self, *, brief: bool = False) -> list[TextTable]:
        """Return groups, and differences if there are any, as text; brief: as in :func:`group_table`."""
        found = [group_table(self.groups, brief=brief)]
        if self.spec.compare is not None and self.differences:
            found.append(
                difference_table(self.differences, self.spec.compare.factor, self.spec.compare.against)
            )
        return found

    def text(self, form: Format) -> str:
        """Return all tables in one of the formats."""
        return "\n".join(table.formatted(form) for table in self.tables())

    def as_json(self) -> dict[str, Any]:
        """Return groups and differences for programs; infinite and unknown numbers become null."""
        return {
            "groups": [finite(dataclasses.asdict(group)) for group in self.groups],
            "differences": [finite(dataclasses.asdict(item)) for item in self.differences],
        }


def findings(spec: StudySpec, result: Done) -> Findings:
    """Work out what a study says, from the runs that are done."""
    runs = done(result.runs, result.rows)
    return Findings(
        spec,
        tidy(result.runs, result.rows),
        times(result.runs, result.rows),
        tuple(groups(spec, runs)),
        tuple(differences(spec, runs)),
    )


def write(found: Findings, folder: Path, *, parquet: bool = False) -> None:
    """Write all tables of a study into its folder, each whole or not at all.

    Raises:
        InputError: If Parquet is wanted and pyarrow not installed.
        DeviceError: If a file cannot be written.
    """
    title = f"# {found.spec.name}\n\n" + (f"{found.spec.description}\n\n" if found.spec.description else "")
    replace_file(folder / TABLE, found.table.csv())
    replace_file(folder / TIMES, found.times.csv())
    replace_file(folder / SUMMARY, title + found.text("markdown"))
    if parquet:
        found.table.write_parquet(folder / PARQUET)
