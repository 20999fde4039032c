"""What compilers of IEC 61131-3 structured text have in common, as a check of types; strict ones stop at the rest.

Numbers have one type, bit strings another; nothing is converted by itself. Arithmetic and order are for numbers,
AND, OR, NOT and shifts for bit strings. Arrays in an interface have a name. A literal takes the type that is
wanted, a decimal one only of numbers.
"""

from __future__ import annotations

from lark import Token, Tree

NUMBERS, BITS = {"INT", "UINT", "DINT", "LREAL"}, {"BOOL", "WORD", "DWORD"}
WHOLE, HEX, REAL = NUMBERS - {"LREAL"}, BITS - {"BOOL"}, {"LREAL"}
#: Conversions that every edition of the standard defines, with the same meaning.
CONVERSIONS = {
    "WORD": {"DWORD", "UINT"},
    "DWORD": {"WORD", "DINT"},
    "UINT": {"WORD", "LREAL"},
    "INT": {"UINT"},
    "DINT": {"DWORD", "LREAL"},
    "LREAL": {"UINT", "DINT"},
}


class TypeProblems:
    """Everything in a function block that a strict compiler would not take.

    Attributes:
        found: One line each.
    """

    def __init__(self, tree):
        self.found, self.types, self.anonymous = [], {}, []
        self.named = {}
        for types in tree.find_data("types"):
            self.named |= dict(zip(map(str, types.children[::2]), types.children[1::2], strict=True))
        for section in tree.find_data("declarations"):
            for declaration in section.children[1:]:
                self._declare(str(section.children[0]), *declaration.children)
        for child in tree.children:
            if isinstance(child, Tree) and child.data not in ("declarations", "types"):
                self._statement(child)

    def _declare(self, section, name, kind, initial):
        if kind.data == "array" and section in ("VAR_INPUT", "VAR_OUTPUT", "VAR_IN_OUT"):
            self.found.append(f"{name}: array of no named type in {section}")
        array = kind if kind.data == "array" else self.named.get(str(kind.children[0]))
        self.types[str(name)] = str(array.children[2] if array is not None else kind.children[0])
        if initial is not None:
            self._wanted({self.types[str(name)]}, initial, f"{name} in its declaration")

    def _statement(self, node):
        if node.data == "assign":
            target, value = node.children
            self._wanted(self._of(target), value, f"{target.children[0]} :=")
        elif node.data == "for_":
            name, first, last, body = node.children
            for bound in (first, last):
                self._wanted({self.types[str(name)]}, bound, f"FOR {name}")
            self._block(body)
        elif node.data == "if_":
            *branches, otherwise = node.children
            for k in range(0, len(branches), 2):
                self._wanted({"BOOL"}, branches[k], "IF")
                self._block(branches[k + 1])
            if otherwise is not None:
                self._block(otherwise)

    def _block(self, block):
        for statement in block.children:
            self._statement(statement)

    def _wanted(self, wanted, node, where):
        found = self._of(node)
        if not found & wanted:
            self.found.append(
                f"{where}: {'/'.join(sorted(found)) or 'nothing'}, not {'/'.join(sorted(wanted))}"
            )

    def _common(self, nodes, allowed, where):
        """The types that all operands may have."""
        common = set(allowed)
        for node in nodes:
            common &= self._of(node)
        if not common:
            self.found.append(f"{where}: {' and '.join('/'.join(sorted(self._of(node))) for node in nodes)}")
        return common

    def _of(self, node):
        """The types that an expression may have."""
        operands = [child for child in node.children if isinstance(child, Tree)]
        operators = {str(child) for child in node.children if isinstance(child, Token)}
        if node.data == "number":
            return {"REAL": REAL, "HEX": HEX, "WHOLE": WHOLE}[node.children[0].type]
        if node.data in ("true", "false"):
            return {"BOOL"}
        if node.data == "variable":
            for index in operands:
                self._wanted({"INT"}, index, f"index of {node.children[0]}")
            return {self.types[str(node.children[0])]}
        if node.data == "call":
            return self._call(str(node.children[0]), operands)
        if node.data in ("or_", "and_", "not_"):
            return self._common(operands, BITS, " ".join(sorted(operators)) or str(node.data))
        if node.data in ("sum", "product", "minus"):
            return self._common(operands, NUMBERS, "/".join(sorted(operators)) or str(node.data))
        self._common(
            operands, NUMBERS | (BITS if node.data == "equality" else set()), "/".join(sorted(operators))
        )
        return {"BOOL"}

    def _call(self, name, operands):
        if name in ("ABS", "MIN", "MAX"):
            return self._common(operands, NUMBERS, name)
        if name in ("SHL", "SHR"):
            self._wanted({"INT"}, operands[1], name)
            return self._common(operands[:1], BITS - {"BOOL"}, name)
        source, _, target = name.partition("_TO_")
        if target not in CONVERSIONS.get(source, ()):
            self.found.append(f"{name}: not in every edition of the standard")
        self._wanted({source}, operands[0], name)
        return {target}
