"""Commands that documents show, taken apart as a shell would."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from pathlib import Path

from markdown_it import MarkdownIt

_CONNECTORS = frozenset({"&&", "||", "|", ";", "&"})
#: What blocks of commands are called; "" is an indented one.
SHELL = ("sh", "console")
#: How a line begins that holds one, behind a prompt or not; all else is output, or the map of a folder.
STARTS = ("tcrctl ", "python3 -m venv ")


def shown(text: str, kinds: tuple[str, ...] = (*SHELL, "")) -> list[list[str]]:
    """Return the arguments of every ``tcrctl`` command in the blocks of a document, in order."""
    return [
        arguments for block in blocks(text, kinds) for line in _lines(block) for arguments in _commands(line)
    ]


def blocks(text: str, kinds: tuple[str, ...]) -> Iterator[str]:
    """Yield the text of blocks of code, by the name behind their fence."""
    for token in MarkdownIt().parse(text):
        if token.type in ("fence", "code_block") and token.info.strip() in kinds:
            yield token.content


def with_files(arguments: list[str]) -> list[str]:
    """Put the files of the working directory in the place of patterns that match some."""
    found: list[str] = []
    for argument in arguments:
        files = sorted(map(str, Path().glob(argument))) if "*" in argument else []
        found += files or [argument]
    return found


def _lines(block: str) -> list[str]:
    return [line for line in block.replace("\\\n", " ").splitlines() if line.lstrip("$ ").startswith(STARTS)]


def _commands(line: str) -> list[list[str]]:
    lexer = shlex.shlex(line, posix=True, punctuation_chars="|&;>")
    lexer.whitespace_split = True
    commands: list[list[str]] = [[]]
    for token in lexer:
        if token in _CONNECTORS:
            commands.append([])
        else:
            commands[-1].append(token)
    named = [command for command in commands if command and command[0].rpartition("/")[2] == "tcrctl"]
    return [_without_redirection(command[1:]) for command in named]


def _without_redirection(arguments: list[str]) -> list[str]:
    return arguments[: arguments.index(">")] if ">" in arguments else arguments
