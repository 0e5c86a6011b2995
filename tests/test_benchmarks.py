"""What `scripts/benchmark` keeps and compares; nothing is measured here."""

import importlib
import sys
from dataclasses import replace
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
NAMES = ("comparison", "history", "turns")


@pytest.fixture(scope="module")
def script():
    """The modules of scripts/benchmarks by name."""
    before = {name: sys.modules.pop(name, None) for name in NAMES}
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "scripts" / "benchmarks")
        yield {name: importlib.import_module(name) for name in NAMES}
    for name, module in before.items():
        del sys.modules[name]
        if module is not None:
            sys.modules[name] = module


@pytest.fixture
def measured(script):
    """Makes a measurement of rows (what, ours, other, ratio, target, more)."""

    def make(*rows, machine="Fast CPU, 2 cores"):
        names = ("what", "ours", "other", "ratio", "target")
        found = script["history"].Measured(machine, {"gne-mj": "1.2"}, 20, [])
        return found.with_rows(
            "some", [dict(zip(names, row, strict=False), **row[5]) for row in rows]
        )

    return make


def test_rows_of_turns_say_which_way_is_better_and_how_much_turns_differ(script):
    times = {"ours": [1.0, 2.0, 3.0, 4.0], "other": [1.0] * 4}
    row = script["turns"].row("x", times, "ours", "other", "<= 2")
    assert (row["ratio"], row["better"]) == ("2.5", "lower")
    assert float(row["spread"]) == pytest.approx((3.75 - 1.25) / 2.5)
    assert script["turns"].row("x", times, "ours", "other", "> 2")["better"] == "higher"
    upside = script["turns"].row("x", times, "ours", "other", "", upside_down=True)
    assert (upside["ratio"], upside["better"]) == ("0.4", "higher")


def test_what_became_worse_beyond_noise_is_named(script, measured, capsys):
    tell = script["comparison"].tell
    lower, higher = {"spread": "0.02", "better": "lower"}, {"better": "higher"}
    before = measured(
        ("a", "1", "1", "1.00", "<= 1", lower), ("b", "1", "4", "4.0", "", higher),
        ("c (equal within 1e-05 m/s) / d", "1", "1", "1.00", "", lower), ("e", "2", "", "", "", {}),
    )  # fmt: skip
    assert tell(before, before) == 0
    assert "worse: 0 of 4 rows\nbetter: 0 of 4 rows\n" in capsys.readouterr().out
    within = measured(("a", "1", "1", "1.13", "<= 1", lower), ("b", "1", "4", "3.7", "", higher))
    assert tell(before, within) == 0
    assert "gone: 2 rows" in capsys.readouterr().out
    worse = measured(
        ("a", "1", "1", "1.15", "<= 1", lower), ("b", "1", "4", "5.0", "", higher),
        ("c (equal within 3e-05 m/s) / d", "1", "1", "1.30", "", lower), ("e", "3", "", "", "", {}),
    )  # fmt: skip
    assert tell(before, worse) == 1
    told = capsys.readouterr().out
    assert "worse: 3 of 4 rows\n  a: 1, now 1.15: 15% worse (14% is noise)\n  c / d: 1" in told
    assert "better: 1 of 4 rows\n  b: 4, now 5: 20% better (10% is noise)\n" in told


def test_times_without_ratio_count_on_one_machine_only(script, measured):
    before = measured(("e", "2", "", "", "< 4", {}), machine="Another, 8 cores")
    slower = measured(("e", "3", "", "", "< 4", {}))
    assert script["comparison"].tell(before, slower) == 0
    assert script["comparison"].tell(measured(("e", "2", "", "", "< 4", {})), slower) == 1


def test_a_group_measured_again_takes_its_own_place(script, measured):
    found = measured(("a", "1", "1", "1.0", "", {}))
    found = found.with_rows("more", [{**found.rows[0], "what": "z"}])
    again = found.with_rows("some", [{**found.rows[0], "what": name} for name in "bc"])
    assert [(row["group"], row["what"]) for row in again.rows] == [
        ("some", "b"), ("some", "c"), ("more", "z"),
    ]  # fmt: skip


def test_what_is_kept_is_on_the_page_and_read_again(script, measured, tmp_path):
    history = script["history"]
    page = tmp_path / "benchmarks.md"
    page.write_text("# B\n\nWords.\n\nOld.\n\n" + "\n".join(history.HEAD) + "\n| old |\n\nText.\n")
    found = measured(("a", "1", "2", "0.5", "<= 1", {}))
    history.keep(found, tmp_path)
    history.keep(found.with_rows("some", [{**found.rows[0], "ours": "3"}]), tmp_path)
    (kept,) = (tmp_path / "benchmarks").iterdir()
    assert kept.name == "fast-cpu-2-cores-1.2.json"
    assert [row["ours"] for row in history.read(kept).rows] == ["3"]
    history.keep(replace(found, versions={"gne-mj": "1.2", "peer": "7"}), tmp_path)
    history.keep(found.with_rows("some", [{**found.rows[0], "ours": "3"}]), tmp_path)
    assert history.read(kept).versions == {"gne-mj": "1.2", "peer": "7"}
    lines = page.read_text().split("\n")
    assert lines[:4] == ["# B", "", "Words.", ""]
    assert lines[4].startswith("Medians of 20 turns")
    assert "Fast CPU, 2 cores" in lines[4]
    assert lines[6:] == [*history.HEAD, "| a | 3 | 2 | 0.5 | <= 1 |", "", "Text.", ""]


def test_the_page_shows_a_kept_measurement(script):
    page = (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8")
    kept = sorted((ROOT / "docs" / "benchmarks").glob("*.json"))
    assert any(script["history"].on_page(script["history"].read(path), page) == page
               for path in kept)  # fmt: skip
