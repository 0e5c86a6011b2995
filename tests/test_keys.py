"""The page of all keys is what the tables say."""

import re
import sys
from pathlib import Path

import pytest
from pydantic import Field

from gne_mj.plants.low_level.table import ControllerTable
from gne_mj.scenario_tables import Scenario
from gne_mj.toml_table import Table, all_tables

sys.path.insert(0, str(Path(__file__).parents[1] / "scripts" / "reference"))
import keys

CHOOSING = ("type", "information")


def _shipped():
    return [table for table in all_tables() if table.__module__.startswith("gne_mj.")]


def test_the_page_is_what_scripts_keys_writes():
    assert keys.PAGE.read_text(encoding="utf-8") == keys.page()


@pytest.mark.parametrize("table", _shipped(), ids=lambda table: table.__name__)
def test_every_key_says_what_it_is(table):
    silent = [key for key, field in table.model_fields.items()
              if key not in CHOOSING and not field.description
              and not (issubclass(table, ControllerTable) and key == "controller")]  # fmt: skip
    assert not silent


def test_every_key_that_can_be_given_is_on_the_page():
    text = keys.page()
    chosen = [table for table in _shipped() if set(CHOOSING) & set(table.model_fields)]
    assert len(chosen) > 25  # games, agents, laws and faults
    for table in [Scenario, *chosen]:
        for key in set(table.model_fields) - set(CHOOSING):
            assert f"| `{key}` | " in text


def test_a_type_is_told_in_words():
    class Made(Table):
        """One of each."""

        one: list[list[float]] | None = None
        pairs: list[tuple[int, int]] = Field([(1, 2)])
        names: dict[str, str] = Field({})

    rows = keys._rows(Made).splitlines()[2:]
    assert rows == [
        "| `one` | list of lists of numbers | 1 | left out | any |  |",
        "| `pairs` | list of pairs of whole numbers | 1 | `[[1, 2]]` | any |  |",
        "| `names` | table |  | left out |  |  |",
    ]


def test_every_key_has_a_default_and_every_number_a_unit_and_a_range():
    rows = re.findall(r"(?m)^\| `\w+` \| .*\|$", keys.page())
    assert len(rows) > 150
    for row in rows:
        _, _, kind, unit, default, within, *_ = (
            each.strip() for each in re.split(r"(?<!\\)\|", row)
        )
        assert default, row
        if "number" in kind and not kind.startswith("`"):
            assert "" not in (unit, within), row
