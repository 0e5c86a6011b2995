"""Mode ``implicit``: each period's input is solved for with the outputs that it leads to.

At a control instant u = law(y+) is solved for the outputs y+ at the next one, as the plant's model
predicts them under u (:mod:`gne_mj.loops.implicit`): by all agents together
(:mod:`gne_mj.loops.joint`) or each by itself (:mod:`gne_mj.loops.local`). What that promises is in
docs/held-inputs.md and :mod:`gne_mj.theory.zero_order_hold`. It needs the law's barrier-free part
with its derivative, and outputs that rise with their inputs over a period.
"""

from collections.abc import Mapping
from types import ModuleType
from typing import Any

import numpy as np

from gne_mj.bounds import MOST_HELD, check_count
from gne_mj.equilibrium import order
from gne_mj.errors import InvalidInput
from gne_mj.faults import sensor_delay
from gne_mj.loops import apart, cells, functions, guard, implicit, joint, link, loads, local
from gne_mj.loops.feedback import Order
from gne_mj.loops.ode import IMPLICIT
from gne_mj.margins import influence
from gne_mj.plants.agent_type import has_ode
from gne_mj.plants.base import Plant
from gne_mj.plants.ode import OdePlant
from gne_mj.system.clock import Clock
from gne_mj.system.data import SystemData
from gne_mj.system.guard import acting, room_for
from gne_mj.system.modes.mode import Array, Figure, Mode, entry, seen_or_none


class Implicit(Mode):
    """See the module."""

    name = "implicit"
    native = IMPLICIT
    promises = True
    keeps_apart = True
    guards = True
    observes = True
    section = "implicit"
    figures = (
        Figure("solutions", entry("solutions")),
        Figure("newton_steps", entry("solver_steps")),
        Figure("not_accurate", entry("unsolved")),
        Figure("prediction_error", entry("prediction")),
        Figure("periods_not_monotone", entry("not_monotone")),
    )

    def equation(self, system: SystemData) -> ModuleType:
        """All together, unless agents keep to their shares or the law's barriers are their own."""
        if system.separation is not None:
            return apart
        return local if system.decentralised or system.law.alone else joint

    def prediction(self, system: SystemData) -> Mapping[int, Any]:
        """The law's barrier-free part, the equation's solver, and what a control instant does."""
        equation = self.equation(system)
        alone = equation.ALONE
        origin = cells.PLANE if system.separation is None else (0.0,) * system.agents.dimension
        find = loads.act if system.observer > 0.0 else implicit.act
        find = guard.act if system.guarded else find
        return {
            **link.of_implicit(system.law.kernels, system.game.kernels, alone, system.feed_forward),
            functions.SOLVE: link.solve(equation, origin),
            functions.ACT: acting(system, find),
        }

    def rows(self, system: SystemData) -> Order:
        """Kept near the diagonal; one agent's at a time if agents solve alone."""
        game = system.game
        if self.equation(system) is local:
            position, half_band = np.arange(game.actions), max(game.sizes) - 1
        elif self.equation(system) is apart:  # which orders rows itself: there is room for any
            position, half_band = np.arange(game.actions), game.actions - 1
        else:
            position, half_band = order(game)
        band = np.array([half_band, int(system.decentralised)])
        start, column = game.actions_in_constraints
        within = np.repeat(np.arange(game.constraints_count), np.diff(start))
        return Order(position, band, start, column, within)

    def solver_length(self, system: SystemData, rows: Order) -> int:
        """Newton's arrays."""
        return room_for(system, rows)

    def shares_slack(self, system: SystemData) -> bool:
        """Under the paper's laws whose barriers are at what is measured."""
        return system.law.theorem is not None and not system.law.alone

    def check_law(self, system: SystemData) -> None:
        """It needs the law's barrier-free part, with its derivative."""
        super().check_law(system)
        if not system.law.implicit:
            raise InvalidInput(
                "mode",
                self.name,
                "this law does not define 'barrier_free' and its derivative, which mode 'implicit'"
                " solves with; use mode 'sampled'",
            )
        if system.game.private:
            name = system.game.constraint_names[system.game.private[0]]
            raise InvalidInput(
                "mode",
                self.name,
                f"constraint '{name}' is private, so that the equation which this mode solves is"
                " not known to have a solution; use mode 'continuous' or 'sampled'",
            )

    def check_faults(self, system: SystemData) -> None:
        """It predicts from the state, which sensors must tell in time."""
        if sensor_delay(system.faults) > 0 and system.decentralised:
            raise InvalidInput(
                "faults",
                "late sensors",
                "looking ahead over a sensor's delay needs the inputs that all others had"
                " meanwhile, which an agent of the decentralised law does not have: use mode"
                " 'sampled', or leave decentralised out",
            )
        if not has_ode(system.agents.kind) and sensor_delay(system.faults) > 0:
            raise InvalidInput(
                "faults",
                "late sensors",
                "mode 'implicit' predicts MJCF robots from where they are now, of which late"
                " sensors do not tell; use mode 'sampled'",
            )

    def check_period(self, system: SystemData, clock: Clock) -> None:
        """Refuse periods over which dy+/du is not positive: exactly, or else from this start."""
        steps = clock.steps(clock.control_period)
        check_count("clock.control_period", steps, MOST_HELD, "its timesteps")
        if not has_ode(system.agents.kind):
            return
        effect = influence(system.agents, clock.timestep, system.integrator, steps)
        if effect.exact:
            _refuse_slopes(system, effect.least_slope, clock)
        elif not np.all(effect.least_slope > 0):
            plant = OdePlant(system.agents, clock.timestep, system.integrator)
            _try_slopes(system, plant, clock)

    def try_plant(self, system: SystemData, plant: Plant, clock: Clock) -> None:
        """The same of robots that only MuJoCo knows."""
        if not has_ode(system.agents.kind):
            _try_slopes(system, plant, clock)

    def explicit_period(self, control_period: float, timestep: float) -> float | None:
        """None: what is solved is stable whatever the barrier's slope is."""
        return None

    def report(self, system: SystemData, monitor: Any) -> dict[str, Any]:
        """How inputs were solved for, and how far outputs were from what was expected."""
        solutions, unsolved = int(monitor.solutions), int(monitor.unsolved)
        return {
            "decentralised": system.decentralised,
            "solutions": solutions,
            "mean_newton_steps": float(monitor.solver_steps) / max(solutions, 1),
            "most_newton_steps": int(monitor.most_steps),
            "not_accurate": unsolved,
            "covered": solutions - unsolved,
            "first_not_accurate": seen_or_none(monitor, "unsolved"),
            "largest_prediction_error": float(monitor.prediction),
            "largest_prediction_error_time": seen_or_none(monitor, "prediction"),
            "largest_load": float(monitor.load) if system.observer > 0.0 else None,
            "largest_load_time": seen_or_none(monitor, "load"),
            "largest_load_change": float(monitor.load_change) if system.observer > 0.0 else None,
            "largest_load_change_time": seen_or_none(monitor, "load_change"),
            "periods_not_monotone": int(monitor.not_monotone),
            "first_not_monotone": seen_or_none(monitor, "not_monotone"),
        }


def _try_slopes(system: SystemData, plant: Plant, clock: Clock) -> None:
    """dy+/du by moving a plant under two inputs from the start; it is reset afterwards."""
    reached = []
    for u in (0.0, 1.0):
        plant.reset(system.state)
        plant.step(np.full(system.game.actions, u), clock.steps(clock.control_period))
        reached.append(plant.output)
    plant.reset(system.state)
    _refuse_slopes(system, reached[1] - reached[0], clock)


def _refuse_slopes(system: SystemData, slope: Array, clock: Clock) -> None:
    worst = int(np.argmin(slope))
    if not slope[worst] > 0:
        agent = int(system.game.agent_of_action[worst]) + 1
        raise InvalidInput(
            "clock.control_period",
            clock.control_period,
            f"over it the output of agent {agent} of '{system.name}' does not rise with its input"
            f" (dy+/du = {slope[worst]:.4g}), which mode 'implicit' needs",
        )
