"""Looking at robots before they play."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from gne_mj.arguments import answering
from gne_mj.errors import InvalidInput, named
from gne_mj.interface.agents import path_of
from gne_mj.interface.tables import in_one_sentence
from gne_mj.plants.mjcf_robot import MjcfAgents, MjcfRobots
from gne_mj.plants.mjcf_source import is_named, located
from gne_mj.progress import Tell, if_asked, nothing
from gne_mj.scenario import Source, load_scenario, parse_value
from gne_mj.system import System

if TYPE_CHECKING:
    from gne_mj.examination import Examination


@answering
def examine(
    source: str | Path | Source,
    *,
    output: Any = None,
    input: Any = None,
    keyframe: str | None = None,
    at: ArrayLike | None = None,
    system: str | None = None,
    agent: int = 1,
    passivity: bool = True,
    progress: bool = False,
) -> Examination:
    """What a robot of one's own is like before it plays, and what to use (docs/robots.md).

    >>> print(gne_mj.examine("crane.xml"))
    >>> gne_mj.examine("crane.xml", output="travel", input="winch", at=2.0).rest.input

    Args:
        source: an MJCF file, or its text, which begins with ``<``; or a scenario with such robots.
        output: of a file, as :func:`gne_mj.mjcf_robots` has it; proposed if left out.
        input: likewise; given together with the output, or not at all.
        keyframe: of a file, the one that it begins in; its own pose if left out.
        at: wished outputs, one or one an entry of the action, in the output's unit; 0.5 if left
            out, of a scenario's robots y*.
        system: of a scenario, which; may be left out if there is only one.
        agent: of a scenario, which, from 1.
        passivity: whether to try that too, which takes longest.
        progress: tell on stderr how far it is, as the command does.

    Raises:
        InvalidInput: names what cannot be used, and what would be right.
    """
    from gne_mj.examination import examine as examine_file  # late: it knows MuJoCo

    wished = None if at is None else tuple(np.atleast_1d(np.asarray(at, dtype=np.float64)).tolist())
    with named(wished="at", path="source", file="source"), if_asked(progress) as tell:
        if is_robot(source):
            path = path_of(source)  # type: ignore[arg-type]
            with in_one_sentence():
                return examine_file(
                    located(path), path, output, input, _array(wished),
                    keyframe=keyframe, passivity=passivity, progress=tell,
                )  # fmt: skip
        _unused(output=output, input=input, keyframe=keyframe)
        scenario = load_scenario(source)
        name = scenario.name_of(system)
        built = scenario.systems[name].build_inside(name, scenario.simulation)[0]
        return _of_system(built, scenario.systems[name].agents, agent, wished, passivity, tell)


def is_robot(source: Any) -> bool:
    """Whether a source is an MJCF file, or its text."""
    text = str(source).lstrip() if isinstance(source, str | Path) else ""
    return text.startswith("<") or is_named(text) or text.endswith(".xml")


def of_source(
    source: str,
    output: str | None,
    input: str | None,
    wished: Sequence[float] | None,
    *,
    keyframe: str | None = None,
    changes: Mapping[str, Any],
    system: str | None,
    passivity: bool,
    scenario: Path | None,
    progress: Tell = nothing,
) -> dict[str, Examination]:
    """What the command tells, by robots' names: of a file one, of a scenario each that differs.

    Args:
        source: a file or a scenario.
        output, input: TOML values, or plain names.
        keyframe: of a file.
        wished, system, passivity: as :func:`examine` has them.
        changes: of a scenario; a robot's file has none.
        scenario: where the recommended one is to be written.
    """
    from gne_mj.examination import examine as examine_file

    with named(wished="at", path="source", file="source"):
        if is_robot(source):
            for key, value in (("changes", next(iter(changes), None)), ("system", system)):
                if value is not None:
                    raise InvalidInput(
                        key, value, "it is for a scenario, and this is a robot's file"
                    )
            y, u = (None if each is None else parse_value(each) for each in (output, input))
            path = located(source)
            with in_one_sentence():
                found = examine_file(
                    path, _beside(source, path, scenario), y, u, _array(wished),
                    keyframe=keyframe, passivity=passivity, progress=progress,
                )  # fmt: skip
            return {source: found}
        _unused(output=output, input=input, keyframe=keyframe)
        if scenario is not None:
            raise InvalidInput("scenario", str(scenario), "it is for a robot's file")
        loaded = load_scenario(source, changes)
        every: dict[str, Examination] = {}
        for name in loaded.systems if system is None else (loaded.name_of(system),):
            built = loaded.systems[name].build_inside(name, loaded.simulation)[0]
            if not isinstance(built.agents, MjcfRobots):
                continue
            for agent in _kinds(built.agents):
                every[f"{name}, agent {agent}"] = _of_system(
                    built, loaded.systems[name].agents, agent, wished, passivity, progress
                )
        if not every:
            raise InvalidInput("source", source, "no system of it has agents of type 'mjcf-robot'")
        return every


def _kinds(agents: MjcfRobots) -> list[int]:
    """The first agent, from 1, of each kind of robot."""
    d = agents.dimension
    first: dict[Any, int] = {}
    for i in range(agents.count):
        first.setdefault(agents.robots[i * d : (i + 1) * d], i + 1)
    return list(first.values())


def _of_system(
    system: System,
    table: Any,
    agent: int,
    wished: Sequence[float] | None,
    passivity: bool,
    progress: Tell,
) -> Examination:
    from gne_mj.examination.examine import TIMESTEP, Subject, examine_robot

    agents = system.agents
    if not isinstance(agents, MjcfRobots) or not isinstance(table, MjcfAgents):
        raise InvalidInput("source", system.name, "its agents are to be of type 'mjcf-robot'")
    if not 1 <= agent <= agents.count:
        raise InvalidInput("agent", agent, f"agents are numbered 1 to {agents.count}")
    d = agents.dimension
    own, robot = slice((agent - 1) * d, agent * d), agents.one(agent - 1)
    known = system.known_equilibrium
    target = known.action[own] if wished is None and known is not None else _array(wished)
    given = [_of_agent(each, agent, agents.count) for each in (table.output, table.input)]
    subject = Subject(
        str(robot.robots[0].path), robot, given[0], given[1], next(iter(robot.keyframes), None)
    )
    return examine_robot(subject, target, timestep=TIMESTEP, passivity=passivity, progress=progress)


def _of_agent(given: Any, agent: int, count: int) -> Any:
    """What one agent has of a key that may be a list with one each."""
    if isinstance(given, list) and len(given) == count:
        given = given[agent - 1]
    return _plain(given)


def _plain(given: Any) -> Any:
    if isinstance(given, list):
        return [_plain(each) for each in given]
    return given if isinstance(given, str) else given.model_dump(exclude_none=True)


def _beside(source: str, path: Path, scenario: Path | None) -> str:
    """How a scenario there names a robot's file."""
    if is_named(source):
        return source
    folder = Path.cwd() if scenario is None else scenario.resolve().parent
    return os.path.relpath(path.resolve(), folder)


def _array(wished: Sequence[float] | None) -> Any:
    return None if wished is None else np.array(wished, dtype=np.float64)


def _unused(**given: Any) -> None:
    for key, value in given.items():
        if value is not None:
            raise InvalidInput(key, value, "a scenario has its own")
