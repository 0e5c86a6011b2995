"""The text of kernels as LLVM code: the few words of Python that they are written in.

Numbers are doubles, indices 64-bit integers, and arrays addresses of doubles; a local name has one
type throughout. (:mod:`gne_mj.expressions.source` writes such texts.)
"""

import ast
from functools import reduce
from typing import Any

import numpy as np
from llvmlite import ir

from gne_mj.linked_game import KNOWN, NUMBER, WHOLE, declared

# By NumPy's names: what LLVM knows itself, and what C calls otherwise
_INTRINSIC = {"sqrt": "sqrt", "exp": "exp", "log": "log", "sin": "sin", "cos": "cos", "abs": "fabs"}
_OF_C = {"arcsin": "asin", "arccos": "acos", "arctan": "atan", "arcsinh": "asinh",
         "arccosh": "acosh", "arctanh": "atanh"}  # fmt: skip
_OPERATORS: dict[type, tuple[str, str]] = {
    ast.Add: ("add", "fadd"), ast.Sub: ("sub", "fsub"), ast.Mult: ("mul", "fmul"),
}  # fmt: skip
_COMPARISONS: dict[type, str] = {
    ast.Eq: "==", ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=",
}  # fmt: skip
_MOST_FACTORS = 64  # beyond them a power is the C library's


def llvm(text: str) -> str:
    """The kernels in the text of a module, as LLVM code.

    Raises:
        NotImplementedError: there is something in it that kernels of expressions never have.
    """
    module = ir.Module("game")
    for each in ast.parse(text).body:
        if isinstance(each, ast.FunctionDef) and each.name in KNOWN:
            _Function(module, each).write()
    return str(module)


class _Function:
    """One kernel.

    Args:
        module: where to.
        tree: the kernel.
    """

    def __init__(self, module: ir.Module, tree: ast.FunctionDef) -> None:
        self.module, self.tree = module, tree
        self.function = declared(module, tree.name)
        self.function.attributes.add("alwaysinline")
        self.builder = ir.IRBuilder(self.function.append_basic_block("entry"))
        arguments = [each.arg for each in tree.args.args]
        self.given = dict(zip(arguments, self.function.args, strict=True))
        self.local: dict[str, Any] = {}

    def write(self) -> None:
        """Write it."""
        self.block(self.tree.body)
        if not self.builder.block.is_terminated:
            self._return(None)

    def block(self, statements: list[ast.stmt]) -> None:
        """Statements, up to a return."""
        for each in statements:
            if self.builder.block.is_terminated:
                return
            kind = type(each).__name__
            getattr(self, f"_{kind.lower()}", self._unknown)(each)

    def _unknown(self, tree: ast.AST) -> Any:
        raise NotImplementedError(f"{type(tree).__name__} in a kernel of expressions")

    # Statements

    def _expr(self, tree: ast.Expr) -> None:
        if not isinstance(tree.value, ast.Constant):  # a docstring
            self._unknown(tree.value)

    def _pass(self, _: ast.Pass) -> None:
        pass

    def _return(self, tree: ast.Return | None) -> None:
        if "out" in self.given:
            self.builder.ret_void()
        elif tree is None or tree.value is None:
            self.builder.ret(ir.Constant(NUMBER, float("nan")))
        else:
            self.builder.ret(self.number(tree.value))

    def _assign(self, tree: ast.Assign) -> None:
        self._store(tree.targets[0], self.value(tree.value))

    def _augassign(self, tree: ast.AugAssign) -> None:
        place = self._place(tree.target)
        self.builder.store(
            self._combined(tree.op, self.builder.load(place), self.value(tree.value)), place
        )

    def _store(self, target: ast.expr, value: Any) -> None:
        if isinstance(target, ast.Subscript):
            self.builder.store(self._as(value, NUMBER), self._place(target))
            return
        assert isinstance(target, ast.Name)
        if target.id not in self.local:
            with self.builder.goto_entry_block():
                self.local[target.id] = self.builder.alloca(value.type)
        self.builder.store(self._as(value, self.local[target.id].type.pointee), self._place(target))

    def _place(self, target: ast.expr) -> Any:
        """The address of a local number, or of an entry of an array."""
        if isinstance(target, ast.Name):
            return self.local[target.id]
        assert isinstance(target, ast.Subscript)
        assert isinstance(target.value, ast.Name)
        return self.builder.gep(self.given[target.value.id], [self.value(target.slice)])

    def _if(self, tree: ast.If) -> None:
        if tree.orelse:
            self._unknown(tree)
        with self.builder.if_then(self.value(tree.test)):
            self.block(tree.body)

    def _for(self, tree: ast.For) -> None:
        assert isinstance(tree.iter, ast.Call)
        end = self.value(tree.iter.args[0])
        head, body, behind = (self.builder.append_basic_block() for _ in range(3))
        self._store(tree.target, ir.Constant(WHOLE, 0))
        place = self._place(tree.target)
        self.builder.branch(head)
        self.builder.position_at_end(head)
        at = self.builder.load(place)
        self.builder.cbranch(self.builder.icmp_signed("<", at, end), body, behind)
        self.builder.position_at_end(body)
        self.block(tree.body)
        self.builder.store(self.builder.add(at, ir.Constant(WHOLE, 1)), place)
        self.builder.branch(head)
        self.builder.position_at_end(behind)

    # Expressions

    def number(self, tree: ast.expr) -> Any:
        """A double."""
        return self._as(self.value(tree), NUMBER)

    def value(self, tree: ast.expr) -> Any:
        """A double, a whole number or a truth."""
        kind = type(tree).__name__
        return getattr(self, f"_{kind.lower()}", self._unknown)(tree)

    def _as(self, value: Any, kind: Any) -> Any:
        if value.type == kind:
            return value
        if kind != NUMBER:
            raise NotImplementedError("a number where a whole one is needed")
        return self.builder.sitofp(value, NUMBER)

    def _constant(self, tree: ast.Constant) -> Any:
        whole = isinstance(tree.value, int)
        assert isinstance(tree.value, int | float)
        return ir.Constant(WHOLE if whole else NUMBER, tree.value)

    def _name(self, tree: ast.Name) -> Any:
        if tree.id in self.local:
            return self.builder.load(self.local[tree.id])
        return self.given[tree.id]

    def _attribute(self, tree: ast.Attribute) -> Any:
        return ir.Constant(NUMBER, float(getattr(np, tree.attr)))  # np.e, np.nan

    def _subscript(self, tree: ast.Subscript) -> Any:
        return self.builder.load(self._place(tree))

    def _unaryop(self, tree: ast.UnaryOp) -> Any:
        if not isinstance(tree.op, ast.USub):
            self._unknown(tree.op)
        value = self.value(tree.operand)
        return self.builder.fneg(value) if value.type == NUMBER else self.builder.neg(value)

    def _binop(self, tree: ast.BinOp) -> Any:
        if isinstance(tree.op, ast.Pow):
            return self._power(self.number(tree.left), tree.right)
        return self._combined(tree.op, self.value(tree.left), self.value(tree.right))

    def _combined(self, op: ast.operator, left: Any, right: Any) -> Any:
        real = NUMBER in (left.type, right.type) or isinstance(op, ast.Div)
        if real:
            left, right = self._as(left, NUMBER), self._as(right, NUMBER)
        if isinstance(op, ast.Div):
            return self.builder.fdiv(left, right)
        if type(op) not in _OPERATORS:
            self._unknown(op)
        return getattr(self.builder, _OPERATORS[type(op)][real])(left, right)

    def _power(self, base: Any, exponent: ast.expr) -> Any:
        whole = isinstance(exponent, ast.Constant) and isinstance(exponent.value, int)
        if not whole or not 0 < exponent.value <= _MOST_FACTORS:  # type: ignore[attr-defined]
            return self._called("llvm.pow.f64", base, self.number(exponent))
        factors, left = [], int(exponent.value)  # type: ignore[attr-defined]
        while left:
            factors += [base] * (left % 2)
            left //= 2
            base = self.builder.fmul(base, base) if left else base
        return reduce(self.builder.fmul, factors)

    def _ifexp(self, tree: ast.IfExp) -> Any:
        with self.builder.if_else(self.value(tree.test)) as (then, otherwise):
            with then:
                one, at_one = self.number(tree.body), self.builder.block
            with otherwise:
                other, at_other = self.number(tree.orelse), self.builder.block
        found = self.builder.phi(NUMBER)
        found.add_incoming(one, at_one)
        found.add_incoming(other, at_other)
        return found

    def _compare(self, tree: ast.Compare) -> Any:
        values = [self.value(each) for each in (tree.left, *tree.comparators)]
        found = []
        for op, left, right in zip(tree.ops, values, values[1:], strict=False):
            real = NUMBER in (left.type, right.type)
            compare = self.builder.fcmp_ordered if real else self.builder.icmp_signed
            kind = NUMBER if real else WHOLE
            found.append(
                compare(_COMPARISONS[type(op)], self._as(left, kind), self._as(right, kind))
            )
        return reduce(self.builder.and_, found)

    def _boolop(self, tree: ast.BoolOp) -> Any:
        if not isinstance(tree.op, ast.And):
            self._unknown(tree.op)
        return reduce(self.builder.and_, map(self.value, tree.values))

    def _call(self, tree: ast.Call) -> Any:
        called, (argument,) = tree.func, tree.args
        name = called.attr if isinstance(called, ast.Attribute) else ast.unparse(called)
        if name == "int":
            return self.builder.fptosi(self.number(argument), WHOLE)
        value = self.number(argument)
        if name == "sign":
            return self._sign(value)
        if name in _INTRINSIC:
            return self._called(f"llvm.{_INTRINSIC[name]}.f64", value)
        return self._called(_OF_C.get(name, name), value)

    def _called(self, name: str, *values: Any) -> Any:
        kind = ir.FunctionType(NUMBER, [NUMBER] * len(values))
        function = self.module.globals.get(name) or ir.Function(self.module, kind, name)
        return self.builder.call(function, values)

    def _sign(self, value: Any) -> Any:
        """1, -1, or the number itself if it is neither above nor below 0."""
        found = value
        for op, one in (("<", -1.0), (">", 1.0)):
            beyond = self.builder.fcmp_ordered(op, value, ir.Constant(NUMBER, 0.0))
            found = self.builder.select(beyond, ir.Constant(NUMBER, one), found)
        return found
