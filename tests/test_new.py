"""`gne-mj new`: what it writes runs, and nothing is replaced."""

import pytest
from commands import gne_here

import gne_mj
from gne_mj.cli.templates import TEMPLATES


@pytest.mark.parametrize("kind", TEMPLATES)
def test_a_starting_point_runs_and_is_not_replaced(tmp_path, monkeypatch, kind):
    monkeypatch.chdir(tmp_path)
    done = gne_here("new", kind, "mine")
    assert (done.returncode, done.stderr) == (0, "")
    files = sorted(path.name for path in tmp_path.iterdir())
    assert files == sorted(f"mine{end}" for end in TEMPLATES[kind])
    assert done.stdout.splitlines()[-1] == "gne-mj run mine.toml"
    assert not any("NAME" in path.read_text() for path in tmp_path.iterdir())
    run = gne_mj.run("mine.toml", duration=0.1)
    assert run.status in ("completed", "converged")
    before = (tmp_path / "mine.toml").read_bytes()
    again = gne_here("new", kind, "mine")
    assert again.returncode == 2
    assert again.stderr.count("\n") == 1
    assert "exists already" in again.stderr
    assert (tmp_path / "mine.toml").read_bytes() == before
    assert gne_mj.check("mine.toml").holds


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("gmae", "mine"), "KIND: got 'gmae', but did you mean 'game'?"),
        (("game", "../mine"), "NAME: got '../mine', but it must begin with a letter"),
    ],
)
def test_mistakes(tmp_path, monkeypatch, arguments, words):
    monkeypatch.chdir(tmp_path)
    done = gne_here("new", *arguments)
    assert done.returncode == 2
    assert words in done.stderr
    assert list(tmp_path.iterdir()) == []
