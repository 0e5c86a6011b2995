"""Runs of a program's functions are shown, and gone on with, where these are not."""

import json
from functools import partial

import numpy as np
import pytest
from expression_games import energy

import gne_mj as gm
from gne_mj import python_objects
from gne_mj.cli.simulating import stored
from gne_mj.errors import InvalidInput
from gne_mj.fingerprint import fingerprint
from gne_mj.games import formation_game, region_of
from gne_mj.viewer import replay_pack
from gne_mj.viewer.pack import unpack
from gne_mj.viewer.shown_system import ShownSystem

SHORT = {"duration": 0.1, "timestep": 0.01}


def own_game():
    return energy(4)[0]


def action(agent):
    return -agent.cost_gradient(agent.completed(np.zeros(4))) - agent.barrier_gradient()


@pytest.fixture
def another_process(monkeypatch):
    """Forgets what this one has made."""
    return partial(monkeypatch.setattr, python_objects, "_kept", {})


@pytest.mark.parametrize(
    "law", [None, gm.partial_information(gm.star(4)), gm.own_law(action, graph="ring")]
)
def test_a_run_of_functions_is_shown_where_they_are_not(law, tmp_path, another_process):
    run = gm.run(own_game(), agents=gm.flexible_robots(4), law=law, **SHORT)
    before = replay_pack(run)
    run.save(tmp_path / "run.zarr")
    another_process()
    again = stored(tmp_path / "run.zarr")
    assert replay_pack(again) == before
    assert set(gm.plot(again)) == set(run.plot())
    with pytest.raises(InvalidInput, match="in a program give it again"):
        gm.load_scenario(run.scenario).system_objects()


def test_a_replay_says_of_a_system_what_the_system_does():
    places = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]
    region = region_of(box=[[-3.0, -3.0], [3.0, 3.0]])
    game = formation_game(places, [(0, 1), (1, 2)], [1.0, 0.0, 0.0], region)
    run = gm.run(game, agents=gm.integrators(3), **SHORT)
    (about,) = unpack(replay_pack(run))[0]["systems"]
    (system,) = run.systems.values()
    assert about["edges"] == [[1, 2], [2, 3]]
    placed = {"run": 0, "shift": [0.0, 0.0], "beside": [0.0, 0.0], "items": [0, 0]}
    assert about == json.loads(json.dumps(ShownSystem(system, run.clock).meta())) | placed


def test_results_that_do_not_say_enough_are_refused():
    old = gm.Trajectory(gm.run(own_game(), **SHORT).tree.copy(deep=True))
    del old.tree["players"].attrs["structure"]
    with pytest.raises(InvalidInput, match="an older version"):
        replay_pack(old)


class _Enough(Exception):
    pass


def _until(done):
    def shown(progress):
        if progress.done >= done:
            raise _Enough

    return shown


def test_a_batch_of_functions_goes_on_where_they_are_given_again(tmp_path, another_process):
    how = {"sweep": {"game.parameters.budget": [8.0, 9.0]}, "runs": 4, "out": tmp_path / "batch",
           "changes": {"simulation.duration": 0.05}, "chunk": 1}  # fmt: skip
    with pytest.raises(_Enough):
        gm.batch(own_game(), progress=_until(3), **how)
    another_process()
    runs = gm.batch(own_game(), resume=True, **how)
    assert runs.sizes["run"] == 8
    assert not np.any(np.isnan(runs["least_margin"]))


def _reading(number, *, more=()):
    def inner(x):
        return np.sin(x) + number + sum(more)

    return inner


def test_functions_are_known_by_their_code_and_what_they_read():
    same = (
        fingerprint(_reading(1.0)),
        fingerprint(_reading(1.0)),
        fingerprint(_reading(1.0, more=())),
    )
    assert len(set(same)) == 1
    others = [
        _reading(2.0), _reading(1), _reading(1.0, more=(0,)), _reading(1.0, more=np.zeros(1)),
        partial(_reading(1.0), 0.0), lambda x: x, gm.ring, gm.ring(3), gm.fixed([(0, 1)]), {1, 2},
    ]  # fmt: skip
    assert len({same[0], *map(fingerprint, others)}) == 1 + len(others)
    assert fingerprint(gm.ring(3)) == fingerprint(gm.ring(3))


mean = object()  # which the function below does not read: it has an attribute of that name
SCALE = 2.0


def _with_names(x):
    return SCALE * x.mean()


def test_attributes_are_no_globals_and_cells_may_be_empty():
    def made():
        def inner(x):
            return x + later

        found = fingerprint(inner)
        later = 1.0
        return found, later

    assert made()[0] == made()[0]
    assert fingerprint(_with_names) == fingerprint(_with_names)


def test_of_what_nothing_is_known_nothing_is_the_same():
    endless = []
    endless.append(endless)
    for thing in (object(), endless):
        assert fingerprint(thing) != fingerprint(thing)
