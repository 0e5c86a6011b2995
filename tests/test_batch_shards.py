"""`gne-mj batch --shard I/N`: processes that share a batch without a scheduler."""

import re
import subprocess
import sys

import pytest
from batch_plans import contents, small
from commands import environment

from gne_mj.batches import Progress, Shard, Store, execute, parse_shard
from gne_mj.errors import InvalidInput


def test_shards_are_the_whole_batch_to_the_same_bits(tmp_path):
    whole = small(tmp_path, "whole")  # 12 runs in 3 chunks
    execute(whole, threads=1)
    parts = Store.begun(tmp_path / "parts", whole.plan)
    first = execute(parts, threads=1, shard=Shard(1, 2))
    assert (first.done, first.total, first.complete) == (7, 7, True)  # chunks 0 and 2: 5 + 2
    assert Progress.of(parts).done == 7
    again = Store.begun(tmp_path / "parts", whole.plan)  # as a second process would
    assert execute(again, threads=1, shard=Shard(2, 2)).done == 5
    assert contents(tmp_path / "parts") == contents(tmp_path / "whole")


def test_shards_run_beside_each_other_and_nothing_else_does(tmp_path):
    store = small(tmp_path)
    with store.locked(alone=False):
        with store.locked(alone=False):
            pass
        with pytest.raises(InvalidInput, match="another process is running"):
            execute(store, threads=1)
    with store.locked(), pytest.raises(InvalidInput, match="another process is running"):
        execute(store, threads=1, shard=Shard(1, 2))


def test_a_shard_of_another_batch_does_not_go_on(tmp_path):
    store = small(tmp_path)
    other = small(tmp_path, "other", seed=9)
    with pytest.raises(InvalidInput, match="begun with"):
        Store.begun(store.folder, other.plan)


@pytest.mark.parametrize("text", ["0/3", "4/3", "3", "1/0", "a/b", "-1/2", "1/2/3", "1/999999"])
def test_what_is_no_shard(text):
    with pytest.raises(InvalidInput, match="third of eight"):
        parse_shard(text)


@pytest.mark.slow
def test_two_commands_at_once(tmp_path):
    """Both begin the batch, one makes the folder; the last one writes the tables."""
    common = [
        *("gne-mj", "batch", "velocity-sync", "--set", "simulation.duration=0.2"),
        *("--set", "plant.engine=ode", "--sweep", "barrier.rho=0.1,1", "--runs", "4"),
        *("--chunk", "2", "--threads", "1", "--out", str(tmp_path / "b")),
    ]
    program = "import sys; from gne_mj.cli import main; sys.argv = sys.argv[1:]; main()"
    both = [
        subprocess.Popen(
            [sys.executable, "-c", program, *common, "--shard", f"{number}/2"],
            env={**environment(), "PYTHONPATH": ":".join(sys.path)},
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )
        for number in (1, 2)
    ]  # fmt: skip
    printed = [each.communicate(timeout=120) for each in both]
    assert [each.returncode for each in both] == [0, 0], printed
    told = "".join(out for out, _ in printed)
    assert re.search(r"shard \d/2: 4 of its 4 runs are stored", told) or told.count("combinations")
    assert Progress.of(Store.open(tmp_path / "b")).complete
    assert (tmp_path / "b/combinations.csv").exists()
