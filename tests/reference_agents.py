"""Slow, obvious oracles of agents: see :mod:`reference`, whose conventions are these too."""

import numpy as np


class Integrator:
    """y' = u [eq:int]; state [y]."""

    n = 1

    def rate(self, x, u):
        """x' [eq:int]: (N, 1). x: (N, 1). u: (N,)."""
        return np.array([[u[i]] for i in range(len(x))], dtype=float)

    def output(self, x):
        """y [eq:int]: (N,). x: (N, 1)."""
        return np.array([row[0] for row in x])

    def equilibrium(self, y_star):
        """pi(y*) of [asmp:nonlinearPlant], at rest with u = 0: (N, 1). y_star: (N,)."""
        return np.array([[value] for value in y_star], dtype=float)

    def storage(self, x, x_star):
        """V^{x*}(x) = sum |y - y*|^2 / 2, the remark below [asmp:nonlinearPlant]; a scalar."""
        return sum(0.5 * (row[0] - star[0]) ** 2 for row, star in zip(x, x_star, strict=True))


class PiCascade:
    """y' = -v y + k s + u, s' = u, 0 < k < v [eq:cascadePI]; state [y, s].

    With q = k/(v-k) and P = [[1+q, -q], [-q, q]], V = x'Px/2 has G'Px = y, as [eq:Plant] needs,
    and V' = y u - (v y - k s)^2 / (v - k) along solutions.

    v, k: (N,).
    """

    n = 2

    def __init__(self, v, k):
        self.v = np.array(v, dtype=float)
        self.k = np.array(k, dtype=float)

    def rate(self, x, u):
        """x' [eq:cascadePI]: (N, 2). x: (N, 2). u: (N,)."""
        rates = np.zeros((len(x), 2))
        for i, (y, s) in enumerate(x):
            rates[i] = [-self.v[i] * y + self.k[i] * s + u[i], u[i]]
        return rates

    def output(self, x):
        """y [eq:cascadePI]: (N,). x: (N, 2)."""
        return np.array([row[0] for row in x])

    def equilibrium(self, y_star):
        """pi(y*) = (y*, v y*/k) of [asmp:nonlinearPlant], u = 0: (N, 2). y_star: (N,)."""
        return np.array([[y, v * y / k] for y, v, k in zip(y_star, self.v, self.k, strict=True)])

    def storage(self, x, x_star):
        """V^{x*}(x) = sum (x-x*)'P(x-x*)/2, the remark below [asmp:nonlinearPlant]; a scalar."""
        total = 0.0
        for i in range(len(x)):
            q = self.k[i] / (self.v[i] - self.k[i])
            weight = np.array([[1 + q, -q], [-q, q]])
            error = np.asarray(x[i], dtype=float) - x_star[i]
            total += 0.5 * error @ weight @ error
        return total


class FlexibleRobot:
    """Two masses joined by a spring and a damper [eq:MobileRobot]; state [x1, x2, x3].

    x1: extension, main mass' position minus appendage's, m; x2, x3: their velocities, m/s.
    psi(x1) = stiffness x1 + atan_coefficient atan(x1), with plus signs: strongly monotone.

    main_mass M, appendage_mass m, stiffness, atan_coefficient, damping gamma: (N,) each.
    """

    n = 3

    def __init__(self, main_mass, appendage_mass, stiffness, atan_coefficient, damping):
        self.main_mass = np.array(main_mass, dtype=float)
        self.appendage_mass = np.array(appendage_mass, dtype=float)
        self.stiffness = np.array(stiffness, dtype=float)
        self.atan_coefficient = np.array(atan_coefficient, dtype=float)
        self.damping = np.array(damping, dtype=float)

    def psi(self, x):
        """Spring force psi_i at the extensions [eq:MobileRobot]: (N,), N. x: (N,), m."""
        return self.stiffness * x + self.atan_coefficient * np.arctan(x)

    def spring_energy(self, x):
        """int_0^{x_i} psi_i, as below [eq:MobileRobot]: (N,), J. x: (N,), m."""
        x = np.asarray(x, dtype=float)
        atan_integral = x * np.arctan(x) - 0.5 * np.log1p(x**2)
        return 0.5 * self.stiffness * x**2 + self.atan_coefficient * atan_integral

    def rate(self, x, u):
        """x' [eq:MobileRobot]: (N, 3). x: (N, 3). u: (N,), N, on the main mass."""
        spring = self.psi(np.array([row[0] for row in x]))
        rates = np.zeros((len(x), 3))
        for i, (_, x2, x3) in enumerate(x):
            link = spring[i] + self.damping[i] * (x2 - x3)
            rates[i, 0] = x2 - x3
            rates[i, 1] = (-link + u[i]) / self.main_mass[i]
            rates[i, 2] = link / self.appendage_mass[i]
        return rates

    def output(self, x):
        """y = x2 [eq:MobileRobot]: (N,). x: (N, 3)."""
        return np.array([row[1] for row in x])

    def equilibrium(self, y_star):
        """pi(y*) = (0, y*, y*) of [asmp:nonlinearPlant], u = 0: (N, 3). y_star: (N,)."""
        return np.array([[0.0, value, value] for value in y_star])

    def storage(self, x, x_star):
        """V^{x*}(x), the Bregman divergence of V below [eq:MobileRobot]; a scalar sum over robots.

        int psi is expanded about x1* (0 in every equilibrium with u = 0, where it is exact);
        with x1* != 0 small values lose digits to subtraction. x, x_star: (N, 3).
        """
        x, x_star = np.asarray(x, dtype=float), np.asarray(x_star, dtype=float)
        bregman = self.spring_energy(x[:, 0]) - self.spring_energy(x_star[:, 0])
        bregman = bregman - self.psi(x_star[:, 0]) * (x[:, 0] - x_star[:, 0])
        total = 0.0
        for i in range(len(x)):
            total += bregman[i]
            total += 0.5 * self.main_mass[i] * (x[i, 1] - x_star[i, 1]) ** 2
            total += 0.5 * self.appendage_mass[i] * (x[i, 2] - x_star[i, 2]) ** 2
        return total


class PositionRobot(FlexibleRobot):
    """The same robot with y = q + tau v as output and a damping of its own; state [s, y, w, q].

    s: extension, m; w: the appendage's velocity, m/s; q: the main mass' position, m; all relative
    to a reference that moves at a constant velocity. The main mass' own velocity v is (y - q)/tau,
    and the force on it is u - d v.

    lookahead tau, s, and local_damping d, N s/m: (N,) each; the others as of FlexibleRobot.
    """

    n = 4

    def __init__(self, *numbers, lookahead, local_damping):
        super().__init__(*numbers)
        self.tau = np.array(lookahead, dtype=float)
        self.d = np.array(local_damping, dtype=float)

    def velocities(self, x):
        """v: (N,). x: (N, 4)."""
        return np.array([(row[1] - row[3]) / tau for row, tau in zip(x, self.tau, strict=True)])

    def states(self, s, v, w, q):
        """x of extensions, velocities and positions: (N, 4)."""
        v, q = np.asarray(v, dtype=float), np.asarray(q, dtype=float)
        return np.column_stack([np.broadcast_to(s, v.shape), q + self.tau * v, w, q])

    def rate(self, x, u):
        """x': (N, 4). x: (N, 4). u: (N,), N."""
        v = self.velocities(x)
        as_robot = np.column_stack([[row[0] for row in x], v, [row[2] for row in x]])
        moved = super().rate(as_robot, np.asarray(u) - self.d * v)
        return np.column_stack([moved[:, 0], v + self.tau * moved[:, 1], moved[:, 2], v])

    def equilibrium(self, y_star):
        """(0, y*, 0, y*): (N, 4). y_star: (N,)."""
        return np.array([[0.0, value, 0.0, value] for value in y_star])

    def stored(self, x):
        """V(x), of each robot: (N,). x: (N, 4)."""
        x, v = np.asarray(x, dtype=float), self.velocities(x)
        w, q = x[:, 2], x[:, 3]
        kinetic = 0.5 * self.main_mass * v**2 + 0.5 * self.appendage_mass * w**2
        momentum = self.main_mass * v + self.appendage_mass * w
        energy = kinetic + self.spring_energy(x[:, 0])
        return self.tau * energy + q * momentum + 0.5 * self.d * q**2

    def stored_gradient(self, x):
        """dV/d(s, v, w, q), of each robot: (N, 4). x: (N, 4)."""
        x, v = np.asarray(x, dtype=float), self.velocities(x)
        w, q, big, small = x[:, 2], x[:, 3], self.main_mass, self.appendage_mass
        parts = (
            self.tau * self.psi(x[:, 0]), big * (self.tau * v + q), small * (self.tau * w + q),
            big * v + small * w + self.d * q,
        )  # fmt: skip
        return np.column_stack(parts)

    def storage(self, x, x_star):
        """V^{x*}(x), the Bregman divergence, a scalar sum over robots. x, x_star: (N, 4)."""
        x, x_star = np.asarray(x, dtype=float), np.asarray(x_star, dtype=float)
        away = np.column_stack([
            x[:, 0] - x_star[:, 0], self.velocities(x) - self.velocities(x_star),
            x[:, 2] - x_star[:, 2], x[:, 3] - x_star[:, 3],
        ])  # fmt: skip
        linear = np.sum(self.stored_gradient(x_star) * away, axis=1)
        return np.sum(self.stored(x) - self.stored(x_star) - linear)

    def euler(self, x, u, h):
        """MuJoCo's Euler step: velocities first, then extension and position with them: (N, 4)."""
        rates, v = self.rate(x, u), self.velocities(x)
        v = v + h * (rates[:, 1] - rates[:, 3]) / self.tau
        w, q = x[:, 2] + h * rates[:, 2], x[:, 3] + h * v
        return self.states(x[:, 0] + h * (v - w), v, w, q)
