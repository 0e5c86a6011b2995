"""How long, deep and wide functions may be, and which of them have no annotations."""

import ast
from pathlib import Path

ROOT = Path(__file__).parents[1]
FOLDERS = ("gne_mj", "controllers", "models", "examples", "scripts", "tests")
# Lines of a function; blocks within each other; parameters of a kernel
MOST_LINES, MOST_DEEP, MOST_PARAMETERS = 60, 4, 8
BLOCKS = (ast.For, ast.AsyncFor, ast.While, ast.If, ast.With, ast.AsyncWith, ast.Try, ast.TryStar,
          ast.Match)  # fmt: skip


def depth(node, around=0):
    """Blocks within each other; `elif` is no deeper than its `if`."""
    deepest = around
    for child in ast.iter_child_nodes(node):
        chained = isinstance(node, ast.If) and node.orelse == [child]
        inner = around + isinstance(child, BLOCKS)
        if chained and isinstance(child, ast.If):
            inner = around
        deepest = max(deepest, depth(child, inner))
    return deepest


def complaints(source):
    """What is too large in a file, each as a line."""
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        decorators = {ast.unparse(each).partition("(")[0] for each in node.decorator_list}
        given = node.args
        parameters = len(given.posonlyargs) + len(given.args) + len(given.kwonlyargs)
        for what, found, most in (
            ("lines", node.end_lineno - node.lineno + 1, MOST_LINES),
            ("blocks deep", depth(node), MOST_DEEP),
            ("parameters of a kernel", parameters * ("kernel" in decorators), MOST_PARAMETERS),
        ):
            if found > most:
                yield f"{node.name}: {found} {what}, more than {most}"


def test_functions_are_short_shallow_and_narrow():
    found = []
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*.py")):
            name = path.relative_to(ROOT).as_posix()
            found += [f"{name}: {each}" for each in complaints(path.read_text(encoding="utf-8"))]
    assert not found, "\n".join(found)


def nested(blocks):
    lines = [f"{4 * k * ' '}if {k}:" for k in range(1, blocks + 1)]
    return "\n".join(["def f():", *lines, 4 * (blocks + 1) * " " + "x"])


def test_what_is_too_large_is_seen():
    wide = "@kernel\ndef f(a, b, c, d, e, f, g, h, i): pass"
    for source, told in (
        ("def f():\n" + 60 * " x\n", "61 lines"),
        (nested(5), "5 blocks deep"),
        (wide, "9 parameters"),
    ):
        assert [told in each for each in complaints(source)] == [True]
    chain = "def f():\n if a: x\n" + 6 * " elif b: x\n"
    for source in ("def f():\n" + 59 * " x\n", nested(4), wide.replace(", i", ""), chain,
                   wide.replace("@kernel\n", "")):  # fmt: skip
        assert not list(complaints(source))


# The machinery of kernels, which has stand-ins of what only native code can do
UNTYPED = {"gne_mj/native.py"}


def untyped(source):
    """Functions outside of others that lack an annotation and are no kernels."""
    for owner in ast.walk(ast.parse(source)):
        if isinstance(owner, ast.Module | ast.ClassDef):
            for node in owner.body:
                if not isinstance(node, ast.FunctionDef):
                    continue
                decorators = {ast.unparse(each).partition("(")[0] for each in node.decorator_list}
                given = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
                if isinstance(owner, ast.ClassDef) and "staticmethod" not in decorators:
                    given = given[1:]
                missing = node.returns is None or any(each.annotation is None for each in given)
                if missing and not decorators & {"kernel", "compiled", "intrinsic", "overload"}:
                    yield node.name


def test_only_kernels_have_no_annotations():
    """As mypy's settings suppose; within functions there are those that become native code."""
    found = []
    for folder in ("gne_mj", "controllers"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            name = path.relative_to(ROOT).as_posix()
            if name not in UNTYPED:
                found += [f"{name}: {each}" for each in untyped(path.read_text(encoding="utf-8"))]
    assert not found, "\n".join(found)
    assert list(untyped("def f(a: int): pass\n@kernel\ndef g(a): pass")) == ["f"]
    assert not list(untyped("class A:\n def f(self) -> None:\n  def g(a): pass"))
