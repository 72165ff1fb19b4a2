"""From the Python that the scheme and the laws of effects are written in to C99: numbers are double, `c` and `x` point
to the servo and its state, what is subscripted is an array of double.
"""

from __future__ import annotations

import ast
import inspect
import math
import textwrap
from collections.abc import Callable, Mapping

from ers_mj.errors import InputError

POINTERS = {
    "c": "const Servo *c",
    "x": "State *x",
    "p": "const double *p",
    "at": "const double *at",
    "to": "const double *to",
    "past": "double *past",
}
CALLS = {"abs": "fabs", "math.fabs": "fabs", "min": "fmin", "max": "fmax"}
OPERATORS = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=",
    ast.Eq: "==", ast.NotEq: "!=", ast.And: "&&", ast.Or: "||",
}  # fmt: skip
CONSTANTS = {"math.pi": "3.14159265358979323846", "math.inf": "INFINITY"}


def functions_of(text: str) -> list[ast.FunctionDef]:
    """The functions of a text of Python, without decorators and docstrings."""
    found = [node for node in ast.parse(textwrap.dedent(text)).body if isinstance(node, ast.FunctionDef)]
    for function in found:
        function.decorator_list = []
    return found


def renamed(law: Callable, name: str, part: int | None = None) -> str:
    """The text of a law of an effect under another name, the numbers of its module written out; of a law that returns
    several numbers one ``part``.
    """
    function = functions_of(inspect.getsource(law))[0]
    function.name = name
    if isinstance(function.body[0], ast.Expr):
        del function.body[0]
    numbers = {key: x for key, x in law.__globals__.items() if isinstance(x, int | float)}
    for node in ast.walk(function):
        if isinstance(node, ast.Return) and isinstance(node.value, ast.Tuple) and part is not None:
            node.value = node.value.elts[part]
    return ast.unparse(ast.fix_missing_locations(_Written(numbers).visit(function)))


class _Written(ast.NodeTransformer):
    """Numbers in the place of names."""

    def __init__(self, numbers: Mapping[str, float]):
        self.numbers = numbers

    def visit_Name(self, node: ast.Name) -> ast.expr:
        return ast.Constant(self.numbers[node.id]) if node.id in self.numbers else node


def translated(text: str) -> str:
    """C of a text of functions: their prototypes, then their bodies.

    Raises:
        InputError: a law says what C has no words for here.
    """
    functions = functions_of(text)
    heads = [_head(function) for function in functions]
    return "\n".join([*(f"{head};" for head in heads), "", *map(_function, functions)])


def _head(function: ast.FunctionDef) -> str:
    returns = any(isinstance(node, ast.Return) and node.value is not None for node in ast.walk(function))
    names = [argument.arg for argument in function.args.args]
    given = [POINTERS.get(name, f"double {name}") for name in names]
    return f"static {'double' if returns else 'void'} {function.name}({', '.join(given)})"


def _function(function: ast.FunctionDef) -> str:
    own = {argument.arg for argument in function.args.args}
    assigned = [
        target.id
        for node in ast.walk(function)
        if isinstance(node, ast.Assign | ast.AugAssign)
        for target in (node.targets if isinstance(node, ast.Assign) else [node.target])
        if isinstance(target, ast.Name)
    ]
    local = [name for name in dict.fromkeys(assigned) if name not in own]
    lines = [f"    double {', '.join(local)};"] if local else []
    said, body = _docstring(function)
    unused = [f"    (void)({name});" for name in own if not _uses(function, name)]
    return "\n".join([*said, _head(function), "{", *lines, *unused, *_block(body, 1), "}", ""])


def _docstring(function: ast.FunctionDef) -> tuple[list[str], list[ast.stmt]]:
    told = ast.get_docstring(function)
    return ([f"/* {told} */"], function.body[1:]) if told else ([], function.body)


def _uses(function: ast.FunctionDef, name: str) -> bool:
    return any(isinstance(node, ast.Name) and node.id == name for node in ast.walk(function))


def _block(statements: list[ast.stmt], depth: int) -> list[str]:
    return [line for statement in statements for line in _statement(statement, depth)]


def _statement(node: ast.stmt, depth: int) -> list[str]:
    pad = "    " * depth
    if isinstance(node, ast.Assign):
        return [f"{pad}{_c(node.targets[0])} = {_bare(node.value)};"]
    if isinstance(node, ast.AugAssign):
        return [f"{pad}{_c(node.target)} {OPERATORS[type(node.op)]}= {_bare(node.value)};"]
    if isinstance(node, ast.Return):
        return [f"{pad}return {_bare(node.value)};" if node.value is not None else f"{pad}return;"]
    if isinstance(node, ast.Expr):
        return [f"{pad}{_c(node.value)};"]
    if isinstance(node, ast.If | ast.While):
        word = "if" if isinstance(node, ast.If) else "while"
        lines = [f"{pad}{word} ({_bare(node.test)}) {{", *_block(node.body, depth + 1), f"{pad}}}"]
        return lines + ([f"{pad}else {{", *_block(node.orelse, depth + 1), f"{pad}}}"] if node.orelse else [])
    raise _untold(node)


def _untold(node: ast.AST) -> InputError:
    told = ast.unparse(node).splitlines()[0][:80]
    return InputError(f"fmu: a law says {told!r}, which is not put into C: --to control takes it as it is")


def _bare(node: ast.expr) -> str:
    """The same without the outermost brackets of an operation."""
    text = _c(node)
    return text[1:-1] if isinstance(node, ast.BinOp | ast.Compare | ast.BoolOp) and text[0] == "(" else text


def _c(node: ast.expr) -> str:
    """An expression in C, every operation in brackets."""
    for kind, write in _WRITERS.items():
        if isinstance(node, kind):
            return write(node)
    raise _untold(node)


def _attribute(node: ast.Attribute) -> str:
    text = ast.unparse(node)
    return CONSTANTS.get(text) or text.replace(".", "->")


def _constant(node: ast.Constant) -> str:
    assert isinstance(node.value, int | float)
    return "INFINITY" if node.value == math.inf else repr(float(node.value))


def _index(node: ast.expr) -> str:
    return str(node.value) if isinstance(node, ast.Constant) else f"(int){_bracketed(_c(node))}"


def _bracketed(text: str) -> str:
    return text if text.startswith("(") else f"({text})"


def _binary(node: ast.BinOp) -> str:
    left, right = _c(node.left), _c(node.right)
    if isinstance(node.op, ast.Pow):
        return f"({left} * {left})" if right == "2.0" and left.isidentifier() else f"pow({left}, {right})"
    if isinstance(node.op, ast.Mod):  # Python's has the divisor's sign, C's fmod the dividend's
        return f"({left} - {right} * floor({left} / {right}))"
    return f"({left} {OPERATORS[type(node.op)]} {right})"


def _compare(node: ast.Compare) -> str:
    sides = [node.left, *node.comparators]
    parts = [f"{_c(a)} {OPERATORS[type(op)]} {_c(b)}" for a, op, b in zip(sides[:-1], node.ops, sides[1:], strict=True)]
    return f"({' && '.join(parts)})"


def _call(node: ast.Call) -> str:
    name, given = ast.unparse(node.func), [_c(argument) for argument in node.args]
    name = CALLS.get(name, name.removeprefix("math."))
    if name == "int":  # a subscript, which is cast where it stands
        return given[0]
    if name in ("fmin", "fmax"):
        text = given[0]
        for other in given[1:]:
            text = f"{name}({text}, {other})"
        return text
    return f"{name}({', '.join(given)})"


_WRITERS: Mapping[type, Callable] = {
    ast.Name: lambda node: node.id,
    ast.Constant: _constant,
    ast.Attribute: _attribute,
    ast.Subscript: lambda node: f"{_c(node.value)}[{_index(node.slice)}]",
    ast.UnaryOp: lambda node: f"({'-' if isinstance(node.op, ast.USub) else '!'}{_c(node.operand)})",
    ast.BinOp: _binary,
    ast.BoolOp: lambda node: f"({f' {OPERATORS[type(node.op)]} '.join(_c(v) for v in node.values)})",
    ast.Compare: _compare,
    ast.IfExp: lambda node: f"({_c(node.test)} ? {_c(node.body)} : {_c(node.orelse)})",
    ast.Call: _call,
}
