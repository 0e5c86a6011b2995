"""Laws beside each other: who takes part, how gains are chosen, what is put together."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import gne_mj as gm
from gne_mj.cli import app
from gne_mj.comparison import report
from gne_mj.comparison.entrants import entrants
from gne_mj.comparison.tuning import grid, score
from gne_mj.errors import InvalidInput

sys.path.insert(0, str(Path(__file__).parents[1] / "scripts" / "arenas"))
import arena
import cases

import page

SHORT = {"plant.engine": "ode", "simulation.duration": 0.5, "plant.integrator": "rk4"}
LAW = """
import numpy as np

ACTS_OUTSIDE = True
TUNED = {"weight": (1.0, 5.0, 25.0)}


def action(game, rho, y, memory, weight):
    outside = np.maximum(game.constraints(y), 0.0)
    return -game.pseudo_gradient(y) - weight * game.constraint_jacobian(y).T @ outside
"""


def names(source, laws, changes=None):
    found, refused = entrants(gm.load_scenario(source, {**SHORT, **(changes or {})}), laws)
    return {each.name: each for each in found}, refused


def test_laws_say_which_scenarios_they_are_for():
    found, refused = names("desired-velocity", ["all"])
    assert {"full", "partial", "distributed", "primal-dual"} <= set(found)
    assert "acts once a control period" in refused["feedback-seeking"]
    assert not {"custom", "python"} & {*found, *refused}


def test_each_law_has_a_mode_that_it_knows_and_faults_that_can_strike_it():
    rough = cases.rough(cases.PROBLEMS["desired"])
    held, _ = names("desired-velocity", ["full", "partial", "primal-dual"], rough)
    modes = {name: each.tables["systems"]["robots"]["controller"]["mode"]
             for name, each in held.items()}  # fmt: skip
    assert modes == {"full": "implicit", "partial": "implicit", "primal-dual": "sampled"}
    kinds = {name: [fault["type"] for fault in each.tables["systems"]["robots"]["faults"]]
             for name, each in held.items()}  # fmt: skip
    assert kinds["partial"] == ["push", "noise", "message-loss"]
    assert kinds["full"] == kinds["primal-dual"] == ["push", "noise"]


def test_names_with_modes_tables_and_files(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(LAW, encoding="utf-8")
    laws = ["full", "full:sampled", gm.partial_information("complete", coupling=4.0), file]
    found, _ = names("desired-velocity", laws)
    assert [*found] == ["full", "full-sampled", "partial", "mine"]
    assert found["mine"].law.acts_outside
    assert found["mine"].tuned == {"controller.parameters.weight": (1.0, 5.0, 25.0)}
    assert found["full"].tuned["barrier.rho"]
    controller = found["partial"].tables["systems"]["robots"]["controller"]
    assert (controller["coupling"], controller["graph"]) == (4.0, "complete")


@pytest.mark.parametrize(
    ("laws", "words"),
    [
        (["ful"], "did you mean 'full'?"),
        (["full", "full"], "each law may be there once"),
        ([], "a list of laws, of one at least"),
        (["feedback-seeking"], "one at least must be for this scenario"),
    ],
)
def test_mistakes_are_one_sentence(laws, words):
    with pytest.raises(InvalidInput, match="laws: got") as caught:
        names("desired-velocity", laws)
    assert words in str(caught.value)


def test_grids_are_thinned_to_the_budget():
    tuned = {"a": (1.0, 2.0, 3.0, 4.0), "b": (1.0, 10.0, 100.0)}
    assert grid(tuned, 12) == {"a": [1.0, 2.0, 3.0, 4.0], "b": [1.0, 10.0, 100.0]}
    assert grid(tuned, 6) == {"a": [1.0, 4.0], "b": [1.0, 10.0, 100.0]}
    assert grid(tuned, 1) == {"a": [2.0], "b": [10.0]}


def test_what_is_made_least():
    nan = np.nan
    best = score(np.array([1.0, 2.0, 3.0]), np.array([1e-3] * 3), 1e-2)
    assert best == (0.0, 2.0, 1e-3)
    assert best < score(np.array([1.0, 1.0, nan]), np.array([1e-3] * 3), 1e-2)
    assert best < score(np.array([1.0, 1.0, 1.0]), np.array([1e-3, 1e-3, 0.1]), 1e-2)
    assert score(np.array([nan] * 3), np.array([nan, 1.0, 2.0]), 1e-2) == (3.0, np.inf, 2.0)


@pytest.mark.slow
def test_a_comparison_and_that_it_goes_on(tmp_path):
    """The same starts for all; what is put together is what the laws' own batches have."""
    out = tmp_path / "found"
    laws = ["full", "primal-dual"]
    found = gm.compare("desired-velocity", laws, SHORT, out=out, runs=3, budget=2, threads=1)
    assert found["law"].values.tolist() == laws
    assert dict(found.sizes) == {"law": 2, "run": 3, "time": 11}
    batches = [gm.open_batch(out / "laws" / law) for law in laws]
    starts = [batch["action"][:, 0].values for batch in batches]
    np.testing.assert_array_equal(*starts)
    np.testing.assert_array_equal(
        found["violation"].sel(law="primal-dual"),
        np.maximum(batches[1]["constraint"].max("constraint"), 0.0),
    )
    assert float(found["largest_violation"].sel(law="full").max()) == 0.0
    assert found["certified"].values.tolist() == ["certified", "not certified"]
    again = gm.compare("desired-velocity", laws, SHORT, out=out, runs=3, budget=2, threads=1,
                       resume=True)  # fmt: skip
    assert again.identical(found)
    more = gm.compare("desired-velocity", [*laws, "quadratic-penalty"], SHORT, out=out, runs=3,
                      budget=2, threads=1, resume=True)  # fmt: skip
    assert more.sel(law=laws)["violation"].identical(found["violation"])
    paths = report.write(found, out)
    assert [path.name for path in paths] == [*report.NAMES, "comparison.png"]
    kept = json.loads((out / "comparison.json").read_text(encoding="utf-8"))
    assert [law["inside"] for law in kept["laws"]] == [
        3,
        int((found["largest_violation"][1] < 1e-9).sum()),
    ]
    assert "| full | continuous | certified | 3 | 3 | 3 |" in paths[0].read_text(encoding="utf-8")
    with pytest.raises(InvalidInput, match="it exists already"):
        gm.compare("desired-velocity", laws, SHORT, out=out)
    # the arena's page is made of such results
    results = {"cases": {"desired/ideal": kept}}
    made = page.tables(results)
    assert "| **full** | continuous | certified | 3/3 | 3/3 | 0 |" in made
    assert made.count("not run.") == len(cases.PROBLEMS) * len(cases.CONDITIONS) - 1


def test_the_command(tmp_path):
    out = tmp_path / "found"
    line = ["compare", "desired-velocity", "--laws", "full,primal-dual", "--runs", "2", "--budget",
            "1", "--threads", "1", "--out", str(out)]  # fmt: skip
    for key, value in SHORT.items():
        line += ["--set", f"{key}={value}"]
    ended = CliRunner().invoke(app, line)
    assert ended.exit_code == 0, ended.output
    assert "primal-dual" in ended.output
    assert (out / "replay.zarr").is_dir()


def test_a_small_arena(tmp_path):
    """One case, as scripts/arena runs them all."""
    words = arena.run_case("cournot", "rough", tmp_path, 1, 1, "full,primal-dual")
    assert words == "2 laws"
    assert arena.run_case("cournot", "rough", tmp_path, 1, 1, "full") == "done before"
    results = page.collect(tmp_path)
    assert [*results["cases"]] == ["cournot/rough"]
    (case,) = results["cases"].values()
    assert [law["inside"] for law in case["laws"]] == [1, 1]
    curves = json.loads((tmp_path / "cournot" / "rough" / page.CURVE).read_text(encoding="utf-8"))
    case["laws"][1] |= {"inside": 0, "of the bound, worst": 0.02}
    page.draw(curves, case, tmp_path / "drawn.png")
