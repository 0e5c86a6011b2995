"""The tool that puts faults into the code: which ones, where, and what they leave alone."""

import importlib.util
import sys
from pathlib import Path

import pytest

FILE = Path(__file__).parent.parent / "scripts/mutation/operators.py"


@pytest.fixture(scope="module")
def operators():
    specification = importlib.util.spec_from_file_location("mutation_operators", FILE)
    module = importlib.util.module_from_spec(specification)
    sys.modules[specification.name] = module  # which dataclasses look for
    specification.loader.exec_module(module)
    yield module
    del sys.modules[specification.name]


SOURCE = '''"""Words, 1 + 2 < 3."""
from gne_mj.native import kernel

FAR = 0.5


@kernel
def inner(y, n):
    if not y[0] < 2.0 and n == 1:
        raise ValueError(f"{n + 1} is 1")
    y[0] -= -n
    return min(y[0], n)


def plain(values: list = 3, *, often=True) -> "1 + 1":
    """Words."""
    print("é", 1)
    return any(values) if often else f(values, often)
'''


def test_small_faults_of_every_kind(operators):
    found = operators.mutants("some.py", SOURCE.encode())
    changes = {(m.line, m.kind, m.before, m.after) for m in found}
    assert {
        (4, "constant", "0.5", "1.5"), (4, "constant", "0.5", "1.0"),
        (9, "logic", "not y[0] < 2.0", "(y[0] < 2.0)"), (9, "comparison", "<", "<="),
        (9, "comparison", "<", ">"), (9, "comparison", "==", "!="), (9, "logic", "and", "or"),
        (9, "condition", "not y[0] < 2.0 and n == 1", "(not (not y[0] < 2.0 and n == 1))"),
        (10, "deleted", 'raise ValueError(f"{n + 1} is 1")', "pass"),
        (11, "arithmetic", "-=", "+="), (11, "deleted", "y[0] -= -n", "pass"),
        (11, "arithmetic", "-n", "(n)"), (12, "name", "min", "max"),
        (12, "swapped", "y[0], n", "n, y[0]"), (15, "constant", "3", "4"),
        (15, "constant", "True", "False"), (17, "deleted", 'print("é", 1)', "pass"),
        (17, "swapped", '"é", 1', '1, "é"'), (18, "name", "any", "all"),
        (18, "condition", "often", "(not (often))"),
        (18, "swapped", "values, often", "often, values"),
    } <= changes  # fmt: skip
    assert {m.line for m in found} == {4, 8, 9, 10, 11, 12, 15, 17, 18} - {8}
    for mutant in found:
        text = mutant.applied(SOURCE.encode()).decode()
        assert len(text.splitlines()) == len(SOURCE.splitlines())
        assert operators.differs(mutant, SOURCE.encode())
    native = {m.line: m.native for m in found}
    assert native == {line: line < 15 for line in native}
    assert {m.function for m in found} == {"", "inner", "plain"}


def test_a_mutant_of_another_file_is_refused(operators):
    mutant = operators.mutants("some.py", SOURCE.encode())[0]
    with pytest.raises(ValueError, match="not the file"):
        mutant.applied(b"x" + SOURCE.encode())
