"""Where a kind comes from, as a log tells it."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Origin:
    """Source of one kind from elsewhere.

    Attributes:
        section: Section of the experiment that names it.
        kind: Its name there.
        module: Module that defines it; empty for a file.
        file: The file itself, or that of the module.
        package: Distribution that brings it; empty if it is none of an installed one.
        version: Version of that.
        sha256: Of the file's bytes, or of all Python files of the package.
        text: The bytes of a file; empty for a module.
    """

    section: str
    kind: str
    module: str
    file: str
    package: str
    version: str
    sha256: str
    text: bytes = field(default=b"", repr=False)

    @property
    def what(self) -> str:
        """The value as messages name it."""
        return f"{self.section}.kind: {self.kind}"

    def as_json(self) -> dict[str, str]:
        """Return everything but the text."""
        names = ("section", "kind", "module", "file", "package", "version", "sha256")
        return {name: getattr(self, name) for name in names}
