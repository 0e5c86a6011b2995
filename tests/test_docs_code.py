"""Code in the documents is run by scripts/check-docs; here: that nothing escapes it."""

import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
_SPEC = spec_from_file_location("code_blocks", ROOT / "scripts/site/code_blocks.py")
code_blocks = module_from_spec(_SPEC)
sys.modules["code_blocks"] = code_blocks
_SPEC.loader.exec_module(code_blocks)

BLOCKS = [block for page in code_blocks.pages() for block in code_blocks.blocks_of(page)]


def test_every_block_is_run_or_one_of_the_exceptions():
    """More of these is a decision, to be made here too."""
    skipped = [block for block in BLOCKS if code_blocks.left_out(block) is not None]
    assert len(skipped) == 8
    assert len(BLOCKS) >= 50
    for block in BLOCKS:
        assert block.kind or code_blocks.left_out(block) is not None, block


def test_all_fences_are_seen():
    for page in code_blocks.pages():
        text = (ROOT / page).read_text(encoding="utf-8")
        fences = sum(line.lstrip().startswith("```") for line in text.splitlines())
        assert fences == 2 * len(code_blocks.blocks_of(page)), page


def test_no_exception_is_stale():
    assert list(code_blocks.stale()) == []


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: f"{block.page}")
def test_python_compiles(block):
    if block.language == "python" and block.kind == "run":
        compile(block.text, block.page, "exec")


def test_a_failing_block_fails_its_page(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    page = code_blocks.Page("README.md")
    page.shell("echo one\necho two >&2\n")
    page.compare("two\n")
    with pytest.raises(AssertionError, match="is not among"):
        page.compare("three\n")
    with pytest.raises(AssertionError):
        page.shell("false\ntrue\n")
    page.python("a = 3\nprint(a)\n")
    page.python("print(a + 1)\n")
    page.compare("4\n")
    code_blocks.check_keys("[systems.x.game]\ngap_bound = 2.0\n")
    with pytest.raises(AssertionError, match="no such key"):
        code_blocks.check_keys("[systems.x.game]\ngap_bond = 2.0\n")
