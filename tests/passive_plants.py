"""Plants that are passive, and some that are not, for the empirical test of passivity."""

from types import SimpleNamespace

import numpy as np
from builders import EQUAL, UNEQUAL, integrators, pi_cascades, robots
from scipy.linalg import expm

from gne_mj.passivity import plants_of
from gne_mj.plants.base import Plant
from gne_mj.plants.ode import OdePlant

PASSIVE = {
    "integrators": integrators(2),
    "PI cascades": pi_cascades(3, 1.3, 1.2),
    "robots": robots(EQUAL),
    "unequal robots": robots(UNEQUAL),
    "robots without dampers": robots({**UNEQUAL, "damping": [0.0] * 5}),
}

PRINTED = {**EQUAL, "stiffness": [1, 1, -1, 1, 1], "atan_coefficient": [1, 1, -1, 1, 1]}
NEGATIVE_DAMPING = {**EQUAL, "damping": [1, 1, -0.02, 1, 1]}


def ode(agents, integrator="rk4"):
    return plants_of(agents, "ode", integrator)


class Appendage(OdePlant):
    """Robots that are driven at the main mass and measured at the appendage."""

    @property
    def output(self):
        return self.state[:, 2]


def agents_of(channels, **more):
    """Agents without a storage function, whose states have no names."""
    kind = SimpleNamespace(STATES=())
    return SimpleNamespace(channels=channels, kind=kind, knows_storage=False, **more)


class Linear(Plant):
    """Channels x' = A x + B u, y = x_0, stepped exactly; at rest at (y, ..., y) unless told."""

    def __init__(self, channels, timestep, a, b):
        n = len(b)
        self.agents = agents_of(channels, equilibrium=lambda y: np.outer(y, np.eye(n)[0]))
        self.timestep, self.x = timestep, np.zeros((channels, n))
        block = np.zeros((n + 1, n + 1))
        block[:n, :n], block[:n, n] = a, b
        self.map = expm(timestep * block)[:n]

    @property
    def state(self):
        return self.x.copy()

    @property
    def output(self):
        return self.x[:, 0].copy()

    def reset(self, state):
        self.x = np.array(state)

    def step(self, u, steps=1):
        for _ in range(steps):
            self.x = np.column_stack([self.x, u]) @ self.map.T


class Scalar(Plant):
    """y' = f(y) + u by RK4; the input -f(y) keeps it at any y."""

    def __init__(self, channels, timestep, f):
        self.agents, self.timestep, self.f = agents_of(channels), timestep, f
        self.y = np.zeros(channels)

    @property
    def state(self):
        return self.y[:, None].copy()

    @property
    def output(self):
        return self.y.copy()

    def reset(self, state):
        self.y = np.array(state)[:, 0]

    def step(self, u, steps=1):
        h = self.timestep
        for _ in range(steps):
            k1 = self.f(self.y) + u
            k2 = self.f(self.y + 0.5 * h * k1) + u
            k3 = self.f(self.y + 0.5 * h * k2) + u
            k4 = self.f(self.y + h * k3) + u
            self.y = self.y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


class Delayed(OdePlant):
    """A plant whose inputs arrive late, by a tenth of a second."""

    def reset(self, state):
        super().reset(state)
        self.queue = [np.zeros(self.agents.channels)] * round(0.1 / self.timestep)

    def step(self, u, steps=1):
        for _ in range(steps):
            self.queue.append(np.array(u))
            super().step(self.queue.pop(0))


def lagging_integrator(lag):
    """y' = v, lag v' = u - v: an actuator that follows its command late."""
    return lambda copies, h: Linear(2 * copies, h, [[0, 1], [0, -1 / lag]], [0, 1 / lag])


def scalars(f):
    return lambda copies, h: Scalar(2 * copies, h, f)


def kept_by(f):
    return lambda y: (y[:, None], -f(y))


def violators():
    return {
        "printed psi": (ode(robots(PRINTED)), {3}),
        "negative damping": (ode(robots(NEGATIVE_DAMPING)), {3}),
        "non-collocated": (
            lambda copies, h: Appendage(robots(EQUAL).repeated(copies), h), {1, 2, 3, 4, 5}
        ),
        "delay": (lambda copies, h: Delayed(integrators(2).repeated(copies), h), {1, 2}),
        "delayed robots": (
            lambda copies, h: Delayed(robots(EQUAL).repeated(copies), h), {1, 2, 3, 4, 5}
        ),
    }  # fmt: skip
