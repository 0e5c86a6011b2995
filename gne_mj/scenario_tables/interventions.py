"""What is done to a run while it goes on: numbers changed, robots pushed, links lost."""

from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from gne_mj.errors import InvalidInput, nearest, part_of
from gne_mj.simulation import Simulation, check_link
from gne_mj.system import System
from gne_mj.toml_table import Table, Unit

Act = Callable[[Simulation], None]


class PushTable(Table):
    """A push of one robot in MuJoCo, besides its input."""

    system: str | None = Field(None, description="whose; may be left out if there is only one")
    agent: int = Field(ge=1, description="which")
    axis: str = Field("", description="where actions have several entries, as `x`")
    force: Annotated[float, Unit("N, or N m where it turns")] = Field(description="along the axis")
    duration: Annotated[float, Unit("s")] = Field(gt=0, description="at least one timestep")

    def build(self, system: System) -> Act:
        """What pushes an agent of a system.

        Raises:
            InvalidInput: there is no such agent or axis, or nothing that can be pushed.
        """
        game = system.game
        if system.engine != "mujoco":
            raise InvalidInput("system", system.name, "only robots in MuJoCo can be pushed")
        if self.agent > game.agents:
            raise InvalidInput("agent", self.agent, f"agents are numbered 1 to {game.agents}")
        of_agent = [k for k, i in enumerate(game.agent_of_action) if i + 1 == self.agent]
        axes = {game.axis_of_action[k]: k for k in of_agent}
        if self.axis not in axes and (self.axis or len(axes) > 1):
            raise InvalidInput("axis", self.axis, nearest(self.axis, axes))
        channel = axes.get(self.axis, of_agent[0])

        def act(simulation: Simulation) -> None:
            run = simulation.runs[system.name]
            if run.inside and run.is_there(channel):  # one that has left is not pushed
                simulation.push(system.name, channel, self.force, self.duration)

        return act


class LinkTable(Table):
    """A link of the communication graph that is lost, or there again."""

    system: str | None = Field(None, description="whose; may be left out if there is only one")
    agents: tuple[int, int] = Field(description="the two that it is between")
    lost: bool = Field(True, description="whether it is lost from then on; else it is there again")

    def build(self, system: System) -> Act:
        """What takes a link of a system away, or gives it back.

        Raises:
            InvalidInput: there is no such link, or this law's links stay.
        """
        first, second = (agent - 1 for agent in self.agents)
        check_link(system, (first, second))

        def act(simulation: Simulation) -> None:
            if simulation.runs[system.name].inside:
                simulation.link(system.name, (first, second), lost=self.lost)

        return act


class InterventionTable(Table):
    """Something that is done while it runs: ``changes``, a ``push`` or a ``link``."""

    time: Annotated[float, Unit("s")] = Field(ge=0, description="as of the step that begins there")
    changes: dict[str, Any] = Field(
        {}, description="dotted keys of games, barriers and controllers, and their new values"
    )
    push: PushTable | None = Field(None, description="a robot in MuJoCo is pushed")
    link: LinkTable | None = Field(None, description="two agents lose their link, or have it again")

    @model_validator(mode="after")
    def _one(self) -> "InterventionTable":
        given = bool(self.changes), self.push is not None, self.link is not None
        if sum(given) != 1:
            raise PydanticCustomError("one", "it must have either changes, a push or a link")
        return self

    def change(self, key: str) -> Act:
        """What makes the changes; refused ones are named as parts of a key."""

        def act(simulation: Simulation) -> None:
            with part_of(f"{key}.changes"):
                simulation.change(self.changes)

        return act


def tables_of(done: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Tables of interventions that do again what was done.

    Args:
        done: as :attr:`gne_mj.simulation.Simulation.interventions` has it.

    Raises:
        InvalidInput: a system was changed by hand, which no keys of a scenario say.
    """
    found: list[dict[str, Any]] = []
    for each in done:
        table: dict[str, Any] = {"time": each["time"]}
        if "channel" in each:
            keys = ("system", "agent", "axis", "force", "duration")
            table["push"] = {key: each[key] for key in keys if key in each}
        elif "link" in each:
            table["link"] = {key: each[key] for key in ("system", "lost")}
            table["link"]["agents"] = each["link"]
        elif "keys" in each:
            table["changes"] = each["keys"]
            if table in found[-1:]:  # it is noted for each of several systems
                continue
        else:
            raise InvalidInput("interventions", each["what"], "no keys of the scenario say it")
        found.append(table)
    return found
