"""What a program gets wrong is answered with what would be right; figures say what they show."""

import inspect

import pytest
from expression_games import energy

import gne_mj as gm
from gne_mj.errors import InvalidInput, UserCodeError

SHORT = {"duration": 0.2, "timestep": 0.01}


GAME, _ = energy(6)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: gm.run(GAME, agent=gm.integrators(6)), "agent: .*run.. has no such argument; did"),
        (lambda: gm.solve(GAME, rh=1.0), "did you mean 'rho'?"),
        (lambda: gm.full_information(graph="ring"), "choose from mode, decentralised"),
        (lambda: gm.full_information("ring"), "argument 1: .* takes none without a name"),
        (lambda: gm.batch(GAME, {}, folder="x"), "folder: got 'x', but run_batch"),
        (lambda: gm.run(GAME, law=gm.ring(6)), "law: got <Graph .* it must be a law, such as full"),
        (lambda: gm.run(GAME, agents=6), "agents: got 6, but it must be agents, such as"),
        (lambda: gm.load_scenario("velocity-sync", {"controller.graph": "ring"}),
         "belongs to information = 'custom' or 'distributed' or .*, not to 'full'"),
    ],
)  # fmt: skip
def test_arguments_that_there_are_not_are_answered_with_those_that_there_are(call, words):
    with pytest.raises(InvalidInput, match=words):
        call()


def test_signatures_are_short_enough_to_read():
    for name in gm.__all__:
        thing = getattr(gm, name)
        if inspect.isfunction(thing):
            assert "numpy." not in str(inspect.signature(thing)), name


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (lambda agent: agent.neighbors,
         r"test_answers\.py, line \d+, in <lambda>: AttributeError: 'Agent' object has no attribute"
         " 'neighbors'; did you mean 'neighbours'"),
        (lambda agent: agent.neighbours[0].rho, "'Neighbour' object has no attribute 'rho'$"),
    ],
)  # fmt: skip
def test_what_an_agent_has_not_is_told_with_the_laws_own_line(law, words):
    with pytest.raises(UserCodeError, match=words):
        gm.run(GAME, law=gm.own_law(law), **SHORT)


def test_a_parameter_that_a_law_does_not_take_is_told_with_those_that_it_does():
    def action(agent, gain):
        return -gain * agent.y

    with pytest.raises(
        InvalidInput, match=r"action.agent, gain. has no 'gian'; did you mean 'gain'"
    ):
        gm.setup(GAME, law=gm.own_law(action, gian=2.0)).system_objects()


def test_figures_say_of_what_a_bound_is_and_give_agents_colours_of_their_own():
    figures = gm.run(energy(12)[0], **SHORT).plot()
    for name, words in (("energy-value", "bound of energy"), ("gap-values", "bound of\neach gap")):
        (axes,) = figures[f"players-{name}"].axes
        assert axes.get_legend_handles_labels()[1][-1] == words
    (axes,) = figures["players-actions"].axes
    assert len({line.get_color() for line in axes.get_lines()}) == 12
