"""The figures of the house: `python analysis/house.py [CHECKOUT]...` prints each count for every checkout named, this
one by default.

Counted over the package (`ers_mj/` of the checkout), by reading its source; nothing is imported.

- files: Python files; at the root: those that lie in `ers_mj/` itself.
- long files: more than 400 lines. Long lines: more than 120 characters.
- long functions: more than 60 lines from `def` to the last statement, its docstring counted.
- complex functions: complexity above 15. Complexity is one, and one more for each `if`, `elif`, conditional expression,
  `for`, `while`, `except`, `assert`, `match` case, `if` or `for` of a comprehension, and each further operand of an
  `and` or `or`. Functions within a function count as their own.
- wide functions: more than 8 parameters, `self` and `cls` not counted; those that a compiling decorator (`njit`,
  `unit`, `law`) marks are kernels and left out.
- capitals: assignments `NAME = number` at module or class level, NAME in capitals; of several targets each is one.
- moves: imports between files of the package, and those from one folder (or root file) to another.
- descents: definitions of a Levenberg-Marquardt loop, told by a name that ends in `damping` being multiplied and
  divided in one function.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

MOST = {
    "lines of a file": 400,
    "characters of a line": 120,
    "lines of a function": 60,
    "complexity": 15,
    "parameters": 8,
}
COMPILING = {"njit", "unit", "law", "memory", "compiled", "kernel", "inline"}
BRANCHES = (ast.If, ast.IfExp, ast.For, ast.While, ast.ExceptHandler, ast.Assert, ast.match_case, ast.AsyncFor)
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


def own_nodes(function: ast.AST) -> Iterator[ast.AST]:
    """The nodes of a function without those of functions within it."""
    for child in ast.iter_child_nodes(function):
        if not isinstance(child, (*FUNCTIONS, ast.ClassDef)):
            yield child
            yield from own_nodes(child)


def complexity(function: ast.AST) -> int:
    total = 1
    for node in own_nodes(function):
        if isinstance(node, BRANCHES):
            total += 1
        elif isinstance(node, ast.BoolOp):
            total += len(node.values) - 1
        elif isinstance(node, ast.comprehension):
            total += 1 + len(node.ifs)
    return total


def parameters(function: ast.FunctionDef) -> int:
    a = function.args
    named = [p.arg for p in (*a.posonlyargs, *a.args, *a.kwonlyargs)]
    return len([n for n in named if n not in ("self", "cls")]) + (a.vararg is not None) + (a.kwarg is not None)


def is_kernel(function: ast.FunctionDef) -> bool:
    def name(node):
        node = node.func if isinstance(node, ast.Call) else node
        return node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "")

    return any(name(d) in COMPILING for d in function.decorator_list)


def is_number(node: ast.AST) -> bool:
    """Whether a value is a number, of arithmetic with numbers too."""
    if isinstance(node, ast.Constant):
        return isinstance(node.value, (int, float)) and not isinstance(node.value, bool)
    if isinstance(node, ast.UnaryOp):
        return is_number(node.operand)
    return isinstance(node, ast.BinOp) and is_number(node.left) and is_number(node.right)


def capitals(tree: ast.Module) -> list[str]:
    found = []
    for body in (tree.body, *(node.body for node in ast.walk(tree) if isinstance(node, ast.ClassDef))):
        for node in body:
            if isinstance(node, ast.Assign):
                pairs = [(t, node.value) for t in node.targets]
            elif isinstance(node, ast.AnnAssign) and node.value is not None:
                pairs = [(node.target, node.value)]
            else:
                continue
            for target, value in pairs:
                if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
                    ends = list(zip(target.elts, value.elts))
                else:
                    ends = [(target, value)]
                found += [t.id for t, v in ends if isinstance(t, ast.Name) and t.id.isupper() and is_number(v)]
    return found


def imports(path: Path, tree: ast.Module, package: Path) -> set[str]:
    """Files of the package that one imports, as paths without `.py`, relative to it."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == package.name:
            parts = node.module.split(".")[1:]
            for alias in node.names:
                for end in ([*parts, alias.name], parts):
                    if (package.joinpath(*end).with_suffix(".py")).is_file() or (
                        package.joinpath(*end) / "__init__.py"
                    ).is_file():
                        found.add("/".join(end))
                        break
    return {f for f in found if f}


def is_descent(function: ast.AST) -> bool:
    changes = [
        n for n in ast.walk(function) if isinstance(n, (ast.AugAssign, ast.Assign)) and "damping" in ast.unparse(n)
    ]
    grown = any("*" in ast.unparse(n) for n in changes)
    return grown and any("/" in ast.unparse(n) for n in changes)


def figures(checkout: Path) -> tuple[dict[str, int], list[str]]:
    """The counts of a checkout, and a line for everything that is over a limit."""
    package = checkout / "ers_mj"
    files = sorted(package.rglob("*.py"))
    counts = dict.fromkeys(
        [
            "files",
            "files at the root",
            "long files",
            "long lines",
            "functions",
            "long functions",
            "complex functions",
            "wide functions",
            "capitals",
            "moves",
            "moves between rooms",
            "descents",
        ],
        0,
    )
    counts["files"], counts["files at the root"] = len(files), sum(p.parent == package for p in files)
    over = []
    for path in files:
        text, where = path.read_text(), str(path.relative_to(checkout))
        lines, tree = text.splitlines(), ast.parse(text)
        long = sum(len(line) > MOST["characters of a line"] for line in lines)
        counts["long lines"] += long
        if long:
            over.append(f"{where}: {long} long lines")
        if len(lines) > MOST["lines of a file"]:
            counts["long files"] += 1
            over.append(f"{where}: {len(lines)} lines")
        counts["capitals"] += len(capitals(tree))
        room = path.relative_to(package).parts[0].removesuffix(".py")
        for other in imports(path, tree, package):
            counts["moves"] += 1
            counts["moves between rooms"] += other.split("/")[0] != room
        for function in (n for n in ast.walk(tree) if isinstance(n, FUNCTIONS)):
            counts["functions"] += 1
            size, hard, wide = function.end_lineno - function.lineno + 1, complexity(function), parameters(function)
            for name, value, limit in (("long", size, "lines of a function"), ("complex", hard, "complexity")):
                if value > MOST[limit]:
                    counts[f"{name} functions"] += 1
                    over.append(f"{where}:{function.lineno} {function.name}: {limit} {value}")
            if wide > MOST["parameters"] and not is_kernel(function):
                counts["wide functions"] += 1
                over.append(f"{where}:{function.lineno} {function.name}: {wide} parameters")
            counts["descents"] += is_descent(function)
    return counts, over


def main(arguments: list[str]) -> int:
    checkouts = [Path(a) for a in arguments if not a.startswith("-")] or [Path(__file__).resolve().parents[1]]
    told = [figures(c) for c in checkouts]
    for name in told[0][0]:
        print(f"{name:22}" + "".join(f"{counts[name]:8d}" for counts, _ in told))
    if "--over" in arguments:
        print(*(line for _, over in told for line in over), sep="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
