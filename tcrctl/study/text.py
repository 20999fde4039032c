"""Groups and differences as tables of text: for people, Markdown, LaTeX, CSV."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

from tcrctl.experiment.summary import unit_of
from tcrctl.study.groups import Difference, Group
from tcrctl.study.statistics import Share, Spread
from tcrctl.visible import cell

Format: TypeAlias = Literal["text", "csv", "latex", "markdown"]
FORMATS: Final[tuple[Format, ...]] = ("text", "csv", "latex", "markdown")
_LATEX: Final = {
    "\\": r"\textbackslash{}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_", "{": r"\{",
    "}": r"\}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": r"\textless{}", ">": r"\textgreater{}",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class TextTable:
    """A table of text.

    Attributes:
        head: Titles of the columns.
        rows: As many cells each.
    """

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def markdown(self) -> str:
        """Return the table in Markdown."""
        lines = (self.head, ("---",) * len(self.head), *self.rows)
        return "".join("| " + " | ".join(map(_for_markdown, line)) + " |\n" for line in lines)

    def latex(self) -> str:
        """Return the table for LaTeX with the package booktabs."""
        lines = [" & ".join(_for_latex(cell) for cell in row) + r" \\" for row in (self.head, *self.rows)]
        begin = rf"\begin{{tabular}}{{{'l' * len(self.head)}}}"
        ruled = [r"\toprule", lines[0], r"\midrule", *lines[1:], r"\bottomrule"]
        return "\n".join([begin, *ruled, r"\end{tabular}", ""])

    def csv(self) -> str:
        """Return the table as comma-separated values."""
        stream = io.StringIO()
        csv.writer(stream, lineterminator="\n").writerows(map(cell, row) for row in (self.head, *self.rows))
        return stream.getvalue()

    def formatted(self, form: Format) -> str:
        """Return the table in one of the formats; Markdown for people."""
        return {"csv": self.csv, "latex": self.latex}.get(form, self.markdown)()


def _for_markdown(text: str) -> str:
    return " ".join(text.splitlines()).replace("|", "\\|")


def _for_latex(text: str) -> str:
    return "".join(_LATEX.get(letter, letter) for letter in text)


def group_table(found: Sequence[Group], *, brief: bool = False) -> TextTable:
    """Return groups, one per row; per measure the median with its interval, the quartiles, the worst.

    Args:
        found: The groups of one study.
        brief: Leave out the quartiles and the interval of the share, for narrow places.
    """
    if not found:
        return TextTable(("runs",), ())
    factors = list(found[0].levels)
    measures = [n for n in found[0].measures if any(g.measures[n] for g in found)]
    head = (
        *factors,
        "runs",
        *(t for name in measures for t in _titles(name)[:: 2 if brief else 1]),
        "met all criteria",
        "stopped",
    )
    rows = tuple(
        (
            *group.levels.values(),
            str(group.met.n),
            *(
                text
                for name in measures
                for text in _spread_cells(group.measures[name])[:: 2 if brief else 1]
            ),
            f"{group.met.count} of {group.met.n}" if brief else _share_cell(group.met),
            f"{group.stopped.count} of {group.stopped.n}",
        )
        for group in found
    )
    return TextTable(head, rows)


def difference_table(found: Sequence[Difference], factor: str, against: str) -> TextTable:
    """Return differences, one per row.

    Args:
        found: The differences.
        factor: What differs.
        against: The level that all others are compared with.
    """
    levels = list(found[0].levels) if found else []
    head = (
        *levels,
        factor,
        "measure",
        "pairs",
        f"minus {against}, median [95 %]",
        f"better than {against} [95 %]",
    )
    rows = tuple(
        (
            *item.levels.values(),
            item.level,
            _named(item.measure),
            str(item.spread.n),
            _median(item.spread, signed=True),
            _share_cell(item.better),
        )
        for item in found
    )
    return TextTable(head, rows)


def _named(measure: str) -> str:
    unit = unit_of(measure)
    return f"{measure} [{unit}]" if unit else measure


def _titles(measure: str) -> tuple[str, str, str]:
    return f"{_named(measure)}, median [95 %]", "quartiles", "worst"


def _spread_cells(found: Spread | None) -> tuple[str, str, str]:
    if found is None:
        return "-", "-", "-"
    quartiles = f"{number(found.lower_quartile)} .. {number(found.upper_quartile)}"
    return _median(found), quartiles, number(found.worst)


def _median(found: Spread, *, signed: bool = False) -> str:
    sign = "+" if signed else ""
    interval = "" if math.isnan(found.low) else f" [{number(found.low, sign)}, {number(found.high, sign)}]"
    return number(found.median, sign) + interval


def _share_cell(found: Share) -> str:
    return f"{found.count} of {found.n} [{100 * found.low:.0f}, {100 * found.high:.0f}] %"


def number(value: float, sign: str = "") -> str:
    """Return three digits; infinite is what was stopped."""
    if math.isinf(value):
        return "stopped" if not sign else ("+stopped" if value > 0 else "-stopped")
    return f"{value:{sign}.3g}"
