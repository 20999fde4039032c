"""Runs the part of IEC 61131-3 structured text that our PLC program uses, so that tests can compare behaviour."""

from __future__ import annotations

import copy

from lark import Lark, Token, Tree

GRAMMAR = r"""
start: types* "FUNCTION_BLOCK" NAME declarations* statement* "END_FUNCTION_BLOCK"
types: "TYPE" (NAME ":" type ";")* "END_TYPE"
declarations: SECTION ("CONSTANT" | "RETAIN")? declaration* "END_VAR"
declaration: NAME ":" type [":=" expression] ";"
type: NAME | "ARRAY" "[" WHOLE ".." WHOLE "]" "OF" NAME -> array

?statement: variable ":=" expression ";" -> assign
    | "IF" expression "THEN" block ("ELSIF" expression "THEN" block)* ["ELSE" else_block] "END_IF" ";" -> if_
    | "FOR" NAME ":=" expression "TO" expression "DO" block "END_FOR" ";" -> for_
    | "EXIT" ";" -> exit_
block: statement*
else_block: statement*

?expression: or_
?or_: and_ (OR and_)*
?and_: equality (AND equality)*
?equality: comparison (EQUAL comparison)*
?comparison: sum (COMPARE sum)*
?sum: product (PLUS product)*
?product: unary (TIMES unary)*
?unary: NOT unary -> not_ | "-" unary -> minus | atom
?atom: number | "TRUE" -> true | "FALSE" -> false | call | variable | "(" expression ")"
number: REAL | HEX | WHOLE
call: NAME "(" expression ("," expression)* ")"
variable: NAME ["[" expression "]"]

SECTION.3: /VAR(_INPUT|_OUTPUT|_IN_OUT)?\b/
OR.2: /OR\b/
AND.2: /AND\b/
NOT.2: /NOT\b/
EQUAL.2: "<>" | "="
COMPARE: "<=" | ">=" | "<" | ">"
PLUS: "+" | "-"
TIMES: "*" | "/"
REAL: /\d+\.\d+/
HEX: /16#[0-9A-Fa-f]+/
WHOLE: /\d+/
NAME: /[A-Za-z_]\w*/
COMMENT: /\(\*(.|\n)*?\*\)/
%ignore COMMENT
%import common.WS
%ignore WS
"""


def signed(bits):
    return (bits & 0xFFFFFFFF ^ 0x80000000) - 0x80000000


def inverted(value):
    return not value if isinstance(value, bool) else ~value & 0xFFFF


FUNCTIONS = {
    "ABS": abs,
    "MIN": min,
    "MAX": max,
    "SHL": lambda bits, by: bits << by,
    "SHR": lambda bits, by: bits >> by,
    "WORD_TO_DWORD": int,
    "WORD_TO_UINT": int,
    "UINT_TO_WORD": int,
    "UINT_TO_LREAL": float,
    "INT_TO_UINT": int,
    "DWORD_TO_DINT": signed,
    "DWORD_TO_WORD": lambda bits: bits & 0xFFFF,
    "DINT_TO_DWORD": lambda value: value & 0xFFFFFFFF,
    "DINT_TO_LREAL": float,
    "LREAL_TO_DINT": round,  # to the nearest, as the standard says
    "LREAL_TO_UINT": round,
}
ZEROS = {"BOOL": False, "LREAL": 0.0}
PYTHON = {"OR": "|", "AND": "&", "=": "==", "<>": "!="}


class FunctionBlock:
    """A function block, translated to Python once."""

    def __init__(self, source):
        tree = Lark(GRAMMAR, parser="lalr").parse(source)
        self.tree, self.types, self._initial, self._named = tree, {}, {}, {}
        for types in tree.find_data("types"):
            self._named |= dict(zip(map(str, types.children[::2]), types.children[1::2], strict=True))
        for section in tree.find_data("declarations"):
            for declaration in section.children[1:]:
                self._declare(*declaration.children)
        body = [
            child
            for child in tree.children
            if isinstance(child, Tree) and child.data not in ("declarations", "types")
        ]
        lines = ["def scan(v):", *(line for statement in body for line in self._statement(statement, 1))]
        scope = {**FUNCTIONS, "inverted": inverted}
        exec("\n".join(lines), scope)
        self._scan = scope["scan"]

    def variables(self):
        """Variables of a new instance by name; arrays are dicts from index to value."""
        return copy.deepcopy(self._initial)

    def scan(self, variables):
        """Run an instance once."""
        self._scan(variables)

    def _declare(self, name, kind, initial):
        kind = self._named.get(str(kind.children[0]), kind)
        if kind.data == "array":
            first, last, of = kind.children
            self.types[str(name)] = str(of)
            self._initial[str(name)] = dict.fromkeys(range(int(first), int(last) + 1), ZEROS.get(str(of), 0))
        else:
            self.types[str(name)] = str(kind.children[0])
            self._initial[str(name)] = (
                eval(self._value(initial)) if initial else ZEROS.get(self.types[str(name)], 0)
            )

    def _statement(self, node, depth):
        indent = "    " * depth
        if node.data == "assign":
            target, value = node.children
            mask = " & 0xFFFF" if self.types[str(target.children[0])] == "WORD" else ""
            yield f"{indent}{self._value(target)} = ({self._value(value)}){mask}"
        elif node.data == "for_":
            name, first, last, body = node.children
            yield f'{indent}for v["{name}"] in range({self._value(first)}, {self._value(last)} + 1):'
            yield from self._block(body, depth + 1)
        elif node.data == "exit_":
            yield f"{indent}break"
        else:
            *branches, otherwise = node.children
            for k in range(0, len(branches), 2):
                yield f"{indent}{'elif' if k else 'if'} {self._value(branches[k])}:"
                yield from self._block(branches[k + 1], depth + 1)
            if otherwise is not None:
                yield f"{indent}else:"
                yield from self._block(otherwise, depth + 1)

    def _block(self, node, depth):
        for statement in node.children:
            yield from self._statement(statement, depth)

    def _value(self, node):
        if isinstance(node, Token):
            return PYTHON.get(str(node), str(node))
        children = [child for child in node.children if child is not None]
        if node.data == "variable":
            index = f"[{self._value(children[1])}]" if len(children) > 1 else ""
            return f'v["{children[0]}"]{index}'
        if node.data == "number":
            return str(children[0]).replace("16#", "0x")
        if node.data in ("true", "false"):
            return str(node.data).capitalize()
        if node.data == "call":
            return f"{children[0]}({', '.join(map(self._value, children[1:]))})"
        if node.data in ("not_", "minus"):
            return f"{'inverted' if node.data == 'not_' else '-'}({self._value(children[-1])})"
        assert isinstance(node, Tree)
        return f"({' '.join(map(self._value, children))})"
