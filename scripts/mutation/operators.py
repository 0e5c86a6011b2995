"""The faults that are put into a source text, each a small one that a slip could make."""

import ast
from dataclasses import dataclass
from itertools import pairwise

COMPARISONS: dict[type[ast.cmpop], tuple[str, ...]] = {
    ast.Lt: ("<=", ">"),
    ast.LtE: ("<", ">"),
    ast.Gt: (">=", "<"),
    ast.GtE: (">", "<"),
    ast.Eq: ("!=",),
    ast.NotEq: ("==",),
    ast.Is: ("is not",),
    ast.IsNot: ("is",),
    ast.In: ("not in",),
    ast.NotIn: ("in",),
}
ARITHMETIC: dict[type[ast.operator], str] = {
    ast.Add: "-",
    ast.Sub: "+",
    ast.Mult: "/",
    ast.Div: "*",
    ast.FloorDiv: "*",
    ast.Mod: "*",
    ast.Pow: "*",
    ast.MatMult: "*",
    ast.BitAnd: "|",
    ast.BitOr: "&",
}
NAMES = {
    "any": "all", "all": "any", "min": "max", "max": "min", "minimum": "maximum",
    "maximum": "minimum", "argmin": "argmax", "argmax": "argmin", "zeros": "ones",
    "ones": "zeros", "floor": "ceil", "ceil": "floor", "sin": "cos", "cos": "sin",
}  # fmt: skip
NATIVE = {"kernel", "compiled", "callback", "intrinsic", "njit"}


@dataclass(frozen=True, order=True)
class Mutant:
    """One fault.

    Attributes:
        file: path of the source from the repository's root.
        line, column: where it is, from 1 and 0.
        kind: the operator's name.
        before, after: the text that is replaced, and the one in its place.
        start, end: where in the file's UTF-8 text, in bytes.
        function: dotted name of what encloses it, empty at a module's level.
        native: whether machine code can hold it: kernels, loops, and what they close over.
    """

    file: str
    line: int
    column: int
    kind: str
    before: str
    after: str
    start: int
    end: int
    function: str
    native: bool

    def applied(self, source: bytes) -> bytes:
        """The source with the fault in it."""
        if source[self.start : self.end].decode() != self.before:
            raise ValueError(f"{self.file} is not the file in which this mutant was drawn")
        return source[: self.start] + self.after.encode() + source[self.end :]

    def __str__(self) -> str:
        before, after = (" ".join(text.split()) for text in (self.before, self.after))
        return f"{self.file}:{self.line} {self.kind}: {before} -> {after}"


def mutants(file: str, source: bytes) -> list[Mutant]:
    """All that can be put into one file, in the order of their places."""
    finder = _Finder(file, source)
    finder.visit(ast.parse(source))
    return sorted(set(finder.found))


def differs(mutant: Mutant, source: bytes) -> bool:
    """Whether the mutant is Python, and another program."""
    try:
        return ast.dump(ast.parse(mutant.applied(source))) != ast.dump(ast.parse(source))
    except SyntaxError:
        return False


class _Finder(ast.NodeVisitor):
    """Collects the mutants of one file."""

    def __init__(self, file: str, source: bytes) -> None:
        self.file, self.source, self.found = file, source, list[Mutant]()
        self._lines = [0]
        for line in source.splitlines(keepends=True):
            self._lines.append(self._lines[-1] + len(line))
        self._scopes: list[str] = []
        self._native = [True]  # a module's constants are baked into kernels

    def _span(self, node: ast.AST) -> tuple[int, int]:
        lines = self._lines
        start = lines[node.lineno - 1] + node.col_offset  # type: ignore[attr-defined]
        return start, lines[node.end_lineno - 1] + node.end_col_offset  # type: ignore[attr-defined]

    def _text(self, node: ast.AST) -> str:
        start, end = self._span(node)
        return self.source[start:end].decode()

    def _add(self, kind: str, node: ast.AST, after: str) -> None:
        self._replace(kind, *self._span(node), after, node)

    def _replace(self, kind: str, start: int, end: int, after: str, node: ast.AST) -> None:
        self.found.append(
            Mutant(
                self.file, node.lineno, node.col_offset, kind,  # type: ignore[attr-defined]
                self.source[start:end].decode(), after, start, end,
                ".".join(self._scopes), self._native[-1],
            )
        )  # fmt: skip

    def _between(self, left: ast.AST, right: ast.AST) -> tuple[int, int]:
        """Where the operator's sign is, between two operands."""
        start, end = self._span(left)[1], self._span(right)[0]
        text = self.source[start:end]
        while text[:1] in b") \n\\" and text:
            start, text = start + 1, text[1:]
        while text[-1:] in b"( \n\\" and text:
            end, text = end - 1, text[:-1]
        return start, end

    # What is never changed: annotations, and words
    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self.visit(node.value)

    def visit_arg(self, node: ast.arg) -> None:
        return

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:
        return

    def visit_Import(self, node: ast.Import) -> None:
        return

    def visit_ImportFrom(self, node: ast.ImportFrom) -> None:
        return

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        self._scopes.append(node.name)
        for part in node.body:
            self.visit(part)
        self._scopes.pop()

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        self._scopes.append(node.name)
        native = any(_marks_native(each) for each in ast.walk(node)) or (
            self._native[-1] and len(self._native) > 1
        )
        self._native.append(native)
        for value in (*node.args.defaults, *node.args.kw_defaults):
            if value is not None:
                self.visit(value)
        for part in node.body:
            self.visit(part)
        self._native.pop()
        self._scopes.pop()

    def visit_Constant(self, node: ast.Constant) -> None:
        value = node.value
        if value is True or value is False:
            self._add("constant", node, str(not value))
        elif isinstance(value, int):
            self._add("constant", node, str(value + 1))
            self._add("constant", node, f"({value - 1})" if value < 1 else str(value - 1))
        elif isinstance(value, float):
            self._add("constant", node, repr(value + 1.0))
            self._add("constant", node, repr(2.0 * value) if value else "-1.0")

    def visit_Compare(self, node: ast.Compare) -> None:
        for left, sign, right in zip(
            [node.left, *node.comparators], node.ops, node.comparators, strict=False
        ):
            for other in COMPARISONS[type(sign)]:
                self._replace("comparison", *self._between(left, right), other, node)
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        sign = ARITHMETIC.get(type(node.op))
        texts = (node.left, node.right)
        words = any(isinstance(n, ast.Constant) and isinstance(n.value, str) for n in texts)
        if sign is not None and not words:
            self._replace("arithmetic", *self._between(node.left, node.right), sign, node)
        self.generic_visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        sign = ARITHMETIC.get(type(node.op))
        if sign is not None:
            self._replace("arithmetic", *self._between(node.target, node.value), f"{sign}=", node)
        self._add("deleted", node, "pass")
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        other = "or" if isinstance(node.op, ast.And) else "and"
        for left, right in pairwise(node.values):
            self._replace("logic", *self._between(left, right), other, node)
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        if isinstance(node.op, ast.Not | ast.USub):
            kind = "logic" if isinstance(node.op, ast.Not) else "arithmetic"
            self._add(kind, node, f"({self._text(node.operand)})")
        if isinstance(node.op, ast.USub) and isinstance(node.operand, ast.Constant):
            return
        self.generic_visit(node)

    def visit_Name(self, node: ast.Name) -> None:
        if isinstance(node.ctx, ast.Load) and node.id in NAMES:
            self._add("name", node, NAMES[node.id])

    def visit_Attribute(self, node: ast.Attribute) -> None:
        if isinstance(node.ctx, ast.Load) and node.attr in NAMES:
            end = self._span(node)[1]
            start = end - len(node.attr.encode())
            self._replace("name", start, end, NAMES[node.attr], node)
        self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> None:
        plain = [a for a in node.args if not isinstance(a, ast.Starred | ast.GeneratorExp)]
        if len(plain) == len(node.args):
            for one, two in pairwise(plain):
                texts = self._text(one), self._text(two)
                start, middle, then, end = (*self._span(one), *self._span(two))
                between = self.source[middle:then].decode()
                if texts[0] != texts[1]:
                    self._replace("swapped", start, end, texts[1] + between + texts[0], one)
        self.generic_visit(node)

    def _condition(self, test: ast.expr) -> None:
        if not (isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not)):
            self._add("condition", test, f"(not ({self._text(test)}))")

    def visit_If(self, node: ast.If) -> None:
        if self._text(node.test) == "TYPE_CHECKING":
            return
        self._condition(node.test)
        self.generic_visit(node)

    def visit_IfExp(self, node: ast.IfExp) -> None:
        self._condition(node.test)
        self.generic_visit(node)

    def visit_While(self, node: ast.While) -> None:
        self._condition(node.test)
        self.generic_visit(node)

    def visit_Expr(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Constant):
            return  # a docstring
        self._add("deleted", node, "pass")
        self.generic_visit(node)

    def visit_Assign(self, node: ast.Assign) -> None:
        if all(isinstance(target, ast.Attribute | ast.Subscript) for target in node.targets):
            self._add("deleted", node, "pass")
        self.generic_visit(node)

    def visit_Raise(self, node: ast.Raise) -> None:
        self._add("deleted", node, "pass")

    def visit_Continue(self, node: ast.Continue) -> None:
        self._add("deleted", node, "pass")

    def visit_Break(self, node: ast.Break) -> None:
        self._add("deleted", node, "pass")


def _marks_native(node: ast.AST) -> bool:
    """Whether it is a function that is compiled."""
    if not isinstance(node, ast.FunctionDef):
        return False
    for mark in node.decorator_list:
        name = mark.func if isinstance(mark, ast.Call) else mark
        if isinstance(name, ast.Name) and name.id in NATIVE:
            return True
    return any(
        isinstance(part, ast.Call) and isinstance(part.func, ast.Name) and part.func.id in NATIVE
        for part in ast.walk(node)
    )
