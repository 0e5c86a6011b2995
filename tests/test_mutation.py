"""The tool that puts faults into the code: which ones, where, and what they leave alone."""

import importlib
import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent.parent / "scripts/mutation"


@pytest.fixture(scope="module")
def operators():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(FOLDER)
        yield importlib.import_module("operators")
        for name in ("operators", "judge", "copies"):
            sys.modules.pop(name, None)


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


def test_functions_are_known_by_their_lines(operators):
    """As the mutants in them are; a default belongs to what is around the function."""
    judge = importlib.import_module("judge")
    found = judge.functions_of_lines(SOURCE.encode())
    assert {line: found.get(line, "") for line in (4, 7, 8, 9, 12, 15, 17, 18)} == {
        4: "", 7: "", 8: "", 9: "inner", 12: "inner", 15: "", 17: "plain", 18: "plain",
    }  # fmt: skip
    named = {m.line: m.function for m in operators.mutants("some.py", SOURCE.encode())}
    assert all(named[line] == found[line] for line in (9, 12, 17, 18))
    nested = (
        b"class A:\n    def f(self):\n        def g():\n            return 1\n        return g\n"
    )
    assert judge.functions_of_lines(nested) == {3: "A.f", 4: "A.f.g", 5: "A.f"}


def test_coverage_is_told_by_tests(operators, tmp_path):
    judge = importlib.import_module("judge")
    (tmp_path / "some.py").write_text("def f():\n    return 1\n\ndef g():\n    return 2\n")
    data = judge.coverage.CoverageData(str(tmp_path / "lines"))
    path = str((tmp_path / "some.py").resolve())
    for context, lines in (("", {1, 4}), ("t.py::one", {2}), ("t.py", {5}), ("u.py::x", {5})):
        data.set_context(context)
        data.add_lines({path: lines})
    data.write()
    passed = {"t.py::one", "t.py::two"}  # the third has failed
    assert judge.executed(tmp_path / "lines", tmp_path, passed) == {
        "some.py": {"f": ["t.py::one"], "g": ["t.py::one", "t.py::two"]}
    }


def test_tests_that_execute_a_mutant_come_first(operators, monkeypatch):
    judge = importlib.import_module("judge")
    tests = {"t.py::a": 9.0, "t.py::b": 1.0, "t.py::c": 0.5, "process.py::d": 3.0, "u.py::e": 0.1}
    known = {
        "plain": judge.Baseline({"t.py::c": 0.1}, {"some.py": {"inner": ["t.py::c"]}}),
        "compiled": judge.Baseline(
            tests, {"some.py": {"plain": ["u.py::e", "t.py::a", "t.py::b"]}}
        ),
    }
    rank = object.__new__(judge._Rank)
    rank._near = {"t.py": 3, "u.py": 1}  # of b's file, but a takes too long to be among the first

    monkeypatch.setattr(judge, "_Rank", lambda mutant, tree: rank)
    monkeypatch.setattr(judge, "_starting_processes", lambda tree: {"process.py"})
    found = {m.function: m for m in operators.mutants("some.py", SOURCE.encode())}
    assert list(judge._stages(found["plain"], None, known)) == [
        (False, ["t.py::b"]), (False, ["t.py::a", "u.py::e"]), (False, ["t.py::c"]),
        (False, ["process.py::d"]),
    ]  # fmt: skip
    assert list(judge._stages(found["inner"], None, known)) == [
        (True, ["t.py::c"]), (False, ["t.py::a", "t.py::b", "u.py::e"]), (False, ["process.py::d"]),
    ]  # fmt: skip
    later = known["compiled"].without({"t.py", "process.py"})
    assert later.seconds == {"u.py::e": 0.1}
    assert later.executing == {"some.py": {"plain": ["u.py::e"]}}


# Keys of loops, and what a translated kernel's cache adds to them
OF_COPY = """
from gne_mj import kernel_cache
from gne_mj.controllers import full_information, partial_information
from gne_mj.native import source_key

def key(module):
    return source_key(module)

for module in (full_information, partial_information):
    cache = kernel_cache.cache_for(module.action, ())
    print(key(module), kernel_cache.mutant_in([cache._py_func.__code__.co_filename]) != "")
"""


@pytest.mark.slow  # compiles, or starts programs, for seconds
def test_a_mutant_changes_the_keys_of_what_it_can_be_in(operators, tmp_path):
    copies = importlib.import_module("copies")
    tree = copies.Tree(FOLDER.parent.parent, tmp_path)
    tree.copy_sources()
    file = "controllers/partial_information.py"
    found = operators.mutants(file, (tree.base / file).read_bytes())
    tree.put(next(mutant for mutant in found if mutant.native), tmp_path / "work")
    (full, _), (partial, _) = _keys(copies, tree.base)
    other_full, other_partial = _keys(copies, tmp_path / "work")
    assert other_full == (full, "False")
    assert other_partial != (partial, "False")
    assert other_partial[1] == "True"


def _keys(copies, folder):
    (folder / "keys.py").write_text(OF_COPY)
    told = subprocess.run(
        [sys.executable, "keys.py"], cwd=folder, env=copies.environment(folder),
        capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    return [tuple(line.split()) for line in told.splitlines()]
