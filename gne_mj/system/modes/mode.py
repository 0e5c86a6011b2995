"""What a mode is: how the law's inputs are found and how long each of them acts.

A mode is one file: a class with what differs from :class:`Mode`, registered. Nothing else asks
which mode a system is in.
"""

from collections.abc import Callable, Mapping
from types import ModuleType
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput
from gne_mj.faults import sensor_delay, strikes_messages
from gne_mj.loops.feedback import NO_ORDER, Order
from gne_mj.plants.base import Plant
from gne_mj.registry import MODES
from gne_mj.system.clock import Clock
from gne_mj.system.data import SystemData

Array = NDArray[np.float64]


class Figure(NamedTuple):
    """A figure that batches keep of each run.

    Attributes:
        name: of the variable.
        of: (runs,) its values, from the monitors (runs,), see :func:`gne_mj.loops.monitor.fresh`.
        unit, long_name: for readers; None for none.
    """

    name: str
    of: Callable[[Any], Array]
    unit: str | None = None
    long_name: str | None = None


class Mode:
    """A mode, as others see it; what is here is what holds of most.

    Attributes:
        name: in scenario files and reports.
        native: what a loop does, one of CONTINUOUS, SAMPLED and IMPLICIT of
            :mod:`gne_mj.loops.ode`: evaluate the law at every stage, evaluate it at control
            instants, or call what :meth:`prediction` gives at control instants.
        held: whether an input acts for a whole control period.
        promises: whether inputs are solved for such that the outputs which they lead to are inside
            (:mod:`gne_mj.theory.zero_order_hold` says when that is certain).
        keeps_apart: whether agents can keep apart in it (:mod:`gne_mj.loops.separation`).
        guards: whether it can cut periods before they lead outside (:mod:`gne_mj.loops.guard`).
        observes: whether agents can observe their loads in it (:mod:`gne_mj.loops.loads`).
        section: of a run's report, for :meth:`report`; empty for none.
        figures: that batches keep of each run.
    """

    name: ClassVar[str]
    native: ClassVar[int]
    held: ClassVar[bool] = True
    promises: ClassVar[bool] = False
    keeps_apart: ClassVar[bool] = False
    guards: ClassVar[bool] = False
    observes: ClassVar[bool] = False
    section: ClassVar[str] = ""
    figures: ClassVar[tuple[Figure, ...]] = ()

    def native_of(self, system: SystemData) -> int:
        """What this system's loop does."""
        return self.native

    # ------------------------------------------------------------------------- what it solves

    def equation(self, system: SystemData) -> ModuleType | None:
        """The module that says who solves together; None where nothing is solved."""
        return None

    def prediction(self, system: SystemData) -> Mapping[int, Any]:
        """C functions that its loops call, by their entry in :mod:`gne_mj.loops.functions`."""
        return {}

    def rows(self, system: SystemData) -> Order:
        """Rows of the matrices of what is solved."""
        return NO_ORDER

    def solver_length(self, system: SystemData, rows: Order) -> int:
        """Numbers that solving needs in a loop's workspace."""
        return 0

    # ----------------------------------------------------------------- what it needs and checks

    def shares_slack(self, system: SystemData) -> bool:
        """Whether ``decentralised`` has a meaning for this system."""
        return False

    def check_law(self, system: SystemData) -> None:
        """Refuse a law that it cannot run.

        Raises:
            InvalidInput: names ``mode``.
        """
        if self.held and not system.law.propagates:
            raise InvalidInput(
                "mode", self.name, "a plain law with a memory runs in mode 'continuous'"
            )

    def check_faults(self, system: SystemData) -> None:
        """Refuse faults that it does not know.

        Raises:
            InvalidInput: names ``faults``.
        """
        late = sensor_delay(system.faults) > 0
        if not self.held and (strikes_messages(system.faults) or late):
            raise InvalidInput(
                "faults",
                "messages or late sensors",
                "they go by control periods: use mode 'sampled' or 'implicit'",
            )

    def check_period(self, system: SystemData, clock: Clock) -> None:
        """Refuse a control period that it cannot have.

        Raises:
            InvalidInput: names the period.
        """

    def measures_stages(self, system: SystemData) -> bool:
        """Whether outputs are read at later stages of an integration step too."""
        return False

    def try_plant(self, system: SystemData, plant: Plant, clock: Clock) -> None:
        """Refuse what only moving a fleet in MuJoCo shows; it is reset afterwards.

        Raises:
            InvalidInput: names the period.
        """

    # --------------------------------------------------------------------- what theory asks of it

    def departure(self, system: SystemData) -> str:
        """Why a run does not follow the law in continuous time, in words; empty if it does."""
        return f"mode '{self.name}'"

    def explicit_period(self, control_period: float, timestep: float) -> float | None:
        """How long in s an explicit law's input acts; None where stability sets it no limit."""
        return control_period

    def divides(self, system: SystemData) -> bool:
        """Whether integration steps are divided near the boundary."""
        return False

    # ------------------------------------------------------------------------- what it reports

    def reports(self, system: SystemData) -> bool:
        """Whether a run of the system has the section and the figures."""
        return True

    def report(self, system: SystemData, monitor: Any) -> dict[str, Any]:
        """The section of a run's report, from what was seen at every step."""
        return {}


def entry(name: str) -> Callable[[Any], Array]:
    """A :class:`Figure`'s values: a number of the monitors."""
    return lambda monitors: monitors[name].copy()


def seen_or_none(monitor: Any, name: str) -> float | None:
    """When something was seen first, in s; None if its amount says that it never was."""
    return float(monitor[f"{name}_time"]) if monitor[name] > 0 else None


def mode_of(system: SystemData) -> Mode:
    """The mode of a system.

    Raises:
        InvalidInput: there is none of its name.
    """
    found: Mode = MODES[system.mode]
    return found
