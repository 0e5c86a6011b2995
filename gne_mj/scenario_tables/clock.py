"""The clock that all systems of a scenario share, and what is kept."""

from typing import Annotated, Literal

from pydantic import Field

from gne_mj.system.checks import RTOL
from gne_mj.toml_table import ACTION, Fills, Table, Unit


class SimulationTable(Table):
    """The clock that all systems share."""

    duration: Annotated[float, Unit("s")] = Field(30.0, gt=0, description="of the run")
    timestep: Annotated[float, Unit("s")] = Field(0.002, gt=0, description="of the integration")
    control_period: Annotated[float | None, Unit("s")] = Field(
        None, gt=0, description="how long held modes hold inputs; the timestep if left out"
    )
    integrator: Literal["rk4", "euler", "tsit5"] = Field(
        "rk4",
        description="Runge and Kutta's of order four, MuJoCo's semi-implicit Euler, or Tsitouras's"
        " pair with adaptive steps (ODE agents, mode 'continuous')",
    )
    rtol: float = Field(
        1e-6, ge=RTOL[0], le=RTOL[1],
        description="error allowed in a step of integrators 'tsit5' and 'rosenbrock', of each state"
        " relative to its greatest magnitude so far",
    )  # fmt: skip
    tolerance: Annotated[float, Unit(ACTION)] = Field(
        1e-3, gt=0, description="on max |y - y*|, for status converged"
    )
    on_exit: Literal["stop", "continue"] = Field(
        "stop",
        description="what runs do where they leave the set: they end, or, under laws that have an"
        " action outside, go on; others end all the same",
    )
    seed: int = Field(0, ge=0, le=2**53, description="of what is random in faults")


class RecordingTable(Table):
    """What is kept."""

    period: Annotated[float, Fills("sample_period"), Unit("s")] = Field(
        0.05, gt=0, description="between samples"
    )
