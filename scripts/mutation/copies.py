"""Copies of the repository: one that stays as it is, and one for each mutant that is tried.

Machine code is kept where it was made, in ``__pycache__``. The product's key of a loop or of a
translated kernel changes with every file that can hold kernels; in a copy it changes with a mutant
only where the mutant can be in it: in native code of a file which its modules import, directly or
through others. So the machine code of everything else is used again, and that of the mutant is made
anew.
"""

import ast
import json
import os
import shutil
import subprocess
import sys
from functools import cached_property
from pathlib import Path

from operators import Mutant

FOLDERS = ("gne_mj", "controllers", "tests")
NOTE = "mutant.json"  # in a copy: what its source_key needs to know

# Added to a copy's files: the product's keys, but that a mutant changes only those it can be in
KEYS = {
    "gne_mj/native.py": """

def source_key(*modules):
    import sys
    from pathlib import Path

    from gne_mj.kernel_cache import mutant_in, note

    frame = sys._getframe(1)
    given = [value for value in frame.f_locals.values() if isinstance(value, ModuleType)]
    files = [frame.f_globals["__file__"], *(module.__file__ for module in (*modules, *given))]
    digest = hashlib.sha256(note["digest"].encode())
    for module in modules:
        name = str(Path(module.__file__).resolve()).removeprefix(f"{note['root']}/")
        text = note["original"] if name == note["file"] else inspect.getsource(module)
        digest.update(text.encode())
    digest.update(mutant_in(files).encode())
    return digest.hexdigest()[:16]
""",
    "gne_mj/kernel_cache.py": """

import json

_root = Path(__file__).resolve().parent.parent
note = {**json.loads((_root / "mutant.json").read_text()), "root": str(_root)}


def package_digest():
    return note["digest"]


def mutant_in(files):
    names = [str(Path(file).resolve()).removeprefix(f"{_root}/") for file in files]
    reached = any(name.startswith("/") or name in note["reached"] for name in names)
    return note["native"] if reached else ""


_index_key = KernelCache._index_key


def _index_key_in_copy(self, signature, codegen):
    modules = [each.pymod.__file__ for each in signature if isinstance(each, types.Module)]
    key = _index_key(self, signature, codegen)
    return (*key, mutant_in([self._py_func.__code__.co_filename, *modules]))


KernelCache._index_key = _index_key_in_copy
""",
}


class Tree:
    """The untouched copy, from which those with mutants are made."""

    def __init__(self, root: Path, folder: Path) -> None:
        self.root, self.base = root, folder / "base"

    def prepare(self) -> None:
        """Copy what git knows or would add, with the machine code that is there."""
        if (self.base / NOTE).exists():
            return
        self.copy_sources()
        for cache in self.root.glob("**/__pycache__"):
            own = self.base / cache.relative_to(self.root)
            if cache.relative_to(self.root).parts[0] in FOLDERS and own.parent.exists():
                shutil.copytree(cache, own, dirs_exist_ok=True)

    def copy_sources(self) -> None:
        """Copy what git knows or would add, and give it its own keys."""
        shutil.rmtree(self.base, ignore_errors=True)
        command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
        listed = subprocess.run(command, cwd=self.root, capture_output=True, check=True).stdout
        for name in listed.decode().split("\0"):
            source, target = self.root / name, self.base / name
            if name and (source.exists() or source.is_symlink()):
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(source, target, follow_symlinks=False)
        code = "from gne_mj.kernel_cache import package_digest; print(package_digest())"
        digest = subprocess.run(
            [sys.executable, "-c", code], cwd=self.base, env=environment(self.base),
            capture_output=True, text=True, check=True,
        ).stdout.strip()  # fmt: skip
        for name, text in KEYS.items():
            with (self.base / name).open("a", encoding="utf-8") as file:
                file.write(text)
        note = {"digest": digest, "file": "", "original": "", "native": "", "reached": []}
        (self.base / NOTE).write_text(json.dumps(note))

    def discard(self) -> None:
        """Let the next :meth:`prepare` copy again what is there then."""
        shutil.rmtree(self.base, ignore_errors=True)

    def put(self, mutant: Mutant, work: Path) -> None:
        """Make ``work`` a copy with this fault; files are links to those of the base."""
        shutil.rmtree(work, ignore_errors=True)
        shutil.copytree(self.base, work, symlinks=True, copy_function=os.link)
        path = work / mutant.file
        original, stamp = path.read_bytes(), path.stat()
        text = mutant.applied(original)
        path.unlink()
        if not mutant.native:
            # of the same size and age: numba then keeps this file's own machine code
            text = _of_size(text, len(original))
        path.write_bytes(text)
        if len(text) == len(original) and not mutant.native:
            os.utime(path, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
        for stale in (path.parent / "__pycache__").glob(f"{path.stem}.cpython-*.pyc"):
            stale.unlink()
        note = json.loads((self.base / NOTE).read_text())
        note |= {"file": mutant.file, "original": original.decode()}
        if mutant.native:
            note |= {"native": str(mutant), "reached": self.importing(mutant.file)}
        (work / NOTE).unlink()
        (work / NOTE).write_text(json.dumps(note))

    def importing(self, file: str, steps: int | None = None) -> list[str]:
        """The files that import this one, directly or through at most ``steps`` - 1 others."""
        found, last = {file}, {file}
        while last and steps != 0:
            last = {other for other, used in self.imports.items() if used & last} - found
            found |= last
            steps = None if steps is None else steps - 1
        return sorted(found)

    @cached_property
    def imports(self) -> dict[str, set[str]]:
        """For each file the files whose names it imports."""
        files = {
            str(path.relative_to(self.base)): path
            for folder in FOLDERS
            for path in sorted((self.base / folder).glob("**/*.py"))
            if not path.is_relative_to(self.base / "gne_mj/controllers")
        }
        return {name: _imports(path, set(files)) for name, path in files.items()}


def environment(tree: Path) -> dict[str, str]:
    """Of processes that shall use the package in this folder, each on one core."""
    single = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    return {**os.environ, "PYTHONPATH": str(tree), **dict.fromkeys(single, "1")}


def _imports(path: Path, files: set[str]) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Import):
            found |= {_file_of(alias.name, files) for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            for alias in node.names:
                inner = _file_of(f"{node.module}.{alias.name}", files)
                found.add(inner or _file_of(node.module, files))
    return found - {""}


def _file_of(module: str, files: set[str]) -> str:
    """The file of a module by its dotted name, empty if it is none of ours."""
    path = module.replace(".", "/").removeprefix("gne_mj/controllers")
    path = f"controllers{path}" if module.startswith("gne_mj.controllers") else path
    for name in (f"{path}.py", f"{path}/__init__.py", f"tests/{path}.py"):
        if name in files:
            return name
    return ""


def _of_size(text: bytes, size: int) -> bytes:
    """The text made as long as that: by a comment, or by less of its docstring's first line."""
    if len(text) <= size:
        return text + b"#" * (size - len(text))
    spare, at = len(text) - size, text.find(b'"""') + 3
    end = text.find(b"\n", at)
    return text[:at] + text[min(at + spare, end) :] if text.startswith(b'"""') else text
