"""Slow, obvious oracles of the mathematics, for the tests to compare the product with.

Everything here is written from the paper alone (labels such as [eq:GNE] are those of `paper.tex`,
its misprints settled as in docs/equations.md) with plain loops, NumPy and SciPy. Nothing is
imported from the package under test, nor numba, nor mujoco: agreement between the two is
evidence only as long as they share no code.

Conventions
- Agents and constraints are numbered from 0. N agents, one scalar action each, p constraints.
- y: (N,) actions. estimates: (N, N); row i is agent i's full vector **y**^i. Its own entry [i, i]
  is never read: the true y_i stands there.
- x: (N, n) agents' states, one row an agent. Flat closed-loop states are laid out as x row by row,
  then z, then the estimates' off-diagonal entries row by row.
- Rates have SciPy's signature rate(time, state).
- Outside the interior (some g_l >= 0, or NaN) the barrier is +inf and its gradient NaN in every
  component. Nothing is clipped.
- Gradients accept complex vectors, so that Jacobians can be taken by the complex step.
"""

import itertools

import numpy as np
from scipy.integrate import solve_ivp

COMPLEX_STEP = 1e-30


def constraints(game, y):
    """All g_l(y) [eq:GNE]: (p,). y: (N,)."""
    return np.array([game.constraint(l, y) for l in range(game.p)])  # noqa: E741


def is_interior(game, y):
    """Whether every g_l(y) < 0 [eq:logbarrier]; NaN counts as outside. y: (N,)."""
    return bool(np.all(constraints(game, np.real(y)) < 0))


def barrier(game, rho, y):
    """phi(y) = -rho sum_l log(-g_l(y)) in the interior, +inf elsewhere [eq:logbarrier]. y: (N,)."""
    if not is_interior(game, y):
        return np.inf
    total = 0.0
    for l in range(game.p):  # noqa: E741
        total -= rho * np.log(-game.constraint(l, y))
    return total


def barrier_gradient(game, rho, y):
    """Gradient sum_l rho/(-g_l) grad g_l of phi [eq:logbarrier]: (N,), NaN outside. y: (N,)."""
    y = np.asarray(y)
    if not is_interior(game, y):
        return np.full(game.N, np.nan)
    total = np.zeros(game.N, dtype=np.result_type(y, float))
    for l in range(game.p):  # noqa: E741
        total = total + rho / -game.constraint(l, y) * game.constraint_gradient(l, y)
    return total


def pseudo_gradient(game, y):
    """F(y) = col(dJ_i/dy_i), the definition below [asmp:cost]: (N,). y: (N,)."""
    return np.array([game.partial_gradient(i, y) for i in range(game.N)])


def extended_pseudo_gradient(game, y, estimates):
    """**F**(**y**) = col(dJ_i/dy_i(y_i, **y**^i_-i)), as below [eq:nonlinearPIFeedback]: (N,).

    y: (N,). estimates: (N, N).
    """
    profiles = with_own_action(y, estimates)
    return np.array([game.partial_gradient(i, profiles[i]) for i in range(game.N)])


def complex_step_jacobian(function, y):
    """Jacobian J[i, j] = d function_i / dy_j by the complex step: (len(function), N).

    Im f(y + i h) / h with h = 1e-30 subtracts nothing, so the truncation error (of order h^2) is
    nil and the entries are as accurate as an analytic formula: some 1e-15 relative.
    """
    y = np.asarray(y, dtype=float)
    columns = []
    for j in range(len(y)):
        shifted = y.astype(complex)
        shifted[j] += 1j * COMPLEX_STEP
        columns.append(np.imag(function(shifted)) / COMPLEX_STEP)
    return np.array(columns).T


def pseudo_gradient_jacobian(game, y):
    """dF/dy by the complex step, accurate to rounding: (N, N). y: (N,)."""
    return complex_step_jacobian(lambda point: pseudo_gradient(game, point), y)


def barrier_hessian(game, rho, y):
    """Hessian of phi by the complex step, accurate to rounding: (N, N), NaN outside. y: (N,)."""
    if not is_interior(game, y):
        return np.full((game.N, game.N), np.nan)
    return complex_step_jacobian(lambda point: barrier_gradient(game, rho, point), y)


def affine_constants(jacobian):
    """(mu, theta_1, theta_2) of [asmp:pseudo] for an affine F with this (N, N) Jacobian A.

    mu: least eigenvalue of (A + A')/2, in the convention (y-y')'(F(y)-F(y')) >= mu |y-y'|^2 (the
    paper writes mu/2). theta_1: spectral norm of A. theta_2: Lipschitz constant of **F**, whose
    component i sees row i of A and a vector of its own, so the greatest row norm.
    """
    mu = np.linalg.eigvalsh((jacobian + jacobian.T) / 2)[0]
    theta_1 = np.linalg.norm(jacobian, 2)
    theta_2 = max(np.linalg.norm(row) for row in jacobian)
    return mu, theta_1, theta_2


# ------------------------------------------------------------------------------------- graphs


def line(N):
    """Edges (i, i + 1) of the path on N vertices."""
    return [(i, i + 1) for i in range(N - 1)]


def ring(N):
    """Edges of the cycle on N >= 3 vertices; for fewer, of the path."""
    return line(N) + ([(N - 1, 0)] if N >= 3 else [])


def complete(N):
    """Edges of the complete graph on N vertices."""
    return [(i, j) for i in range(N) for j in range(i + 1, N)]


def laplacian(N, edges):
    """L = D - A of the undirected graph [Graph Theory]: (N, N). edges: pairs, each edge once."""
    matrix = np.zeros((N, N))
    for i, j in edges:
        matrix[i, i] += 1
        matrix[j, j] += 1
        matrix[i, j] -= 1
        matrix[j, i] -= 1
    return matrix


def algebraic_connectivity(matrix):
    """lambda_2 of a (N, N) Laplacian."""
    return np.linalg.eigvalsh(matrix)[1]


# --------------------------------------------------------------------------- laws at an instant


def with_own_action(y, estimates):
    """The vectors **y**^i as rows [eq:nonlinearPIFeedback]: a copy with y_i at [i, i]: (N, N).

    y: (N,). estimates: (N, N).
    """
    profiles = np.array(estimates, dtype=float)
    for i in range(len(y)):
        profiles[i, i] = y[i]
    return profiles


def disagreement(laplacian, profiles):
    """Row i is sum_{j in N_i} (**y**^i - **y**^j) [eq:nonlinearPIFeedback]: (N, N).

    laplacian: (N, N), of which -L_ij is the edge's weight. profiles: (N, N).
    """
    N = len(profiles)
    total = np.zeros((N, N))
    for i in range(N):
        for j in range(N):
            if j != i:
                total[i] += -laplacian[i, j] * (profiles[i] - profiles[j])
    return total


def without_own_entries(matrix):
    """S_i applied to every row i [eq:RS], keeping the shape: the diagonal becomes zero: (N, N)."""
    rest = np.array(matrix, dtype=float)
    for i in range(len(rest)):
        rest[i, i] = 0.0
    return rest


def full_information(game, rho, y):
    """u_i = -dJ_i/dy_i(y) - dphi/dy_i(y) [eq:nonlinFIfeedback]: (N,). y: (N,)."""
    return -pseudo_gradient(game, y) - barrier_gradient(game, rho, y)


def partial_information(game, rho, laplacian, c, tau, y, estimates):
    """Partial information with true constraints [eq:nonlinearPIFeedback]: (u, estimates_rate).

    tau d/dt **y**^i_-i = -c S_i sum_j (**y**^i - **y**^j) and
    u_i = -dJ_i/dy_i(y_i, **y**^i_-i) - dphi/dy_i(y) - c R_i sum_j (**y**^i - **y**^j);
    c and tau are 1 in the paper, and tau does not enter u.

    y: (N,). laplacian, estimates: (N, N). Returns (N,) and (N, N) with a zero diagonal.
    """
    coupling = disagreement(laplacian, with_own_action(y, estimates))
    cost_part = extended_pseudo_gradient(game, y, estimates)
    barrier_part = barrier_gradient(game, rho, y)
    u = np.zeros(game.N)
    for i in range(game.N):
        u[i] = -cost_part[i] - barrier_part[i] - c * coupling[i, i]
    return u, without_own_entries(-c / tau * coupling)


def barrier_profiles(z, estimates):
    """Rows (z_i, **y**^i_-i), where the distributed law takes phi [eq:CenterFeedback]: (N, N).

    z: (N,). estimates: (N, N).
    """
    return with_own_action(z, estimates)


def estimate_margins(game, z, estimates):
    """M[i, l] = g_l(z_i, **y**^i_-i): all negative in the set Omega_y of [lemma:centreInv].

    z: (N,). estimates: (N, N). Returns (N, p).
    """
    return np.array([constraints(game, profile) for profile in barrier_profiles(z, estimates)])


def fully_distributed(game, rho, laplacian, k, epsilon, y, z, estimates):
    """Fully distributed law [eq:CenterFeedback]: (u, z_rate, estimates_rate).

    epsilon z_i' = y_i - z_i; epsilon d/dt **y**^i_-i = -S_i sum_j (**y**^i - **y**^j);
    u_i = -k [dJ_i/dy_i(y_i, **y**^i_-i) + dphi/dy_i(z_i, **y**^i_-i)].
    Messages carry the true y_i, not z_i. u_i is NaN as soon as agent i's profile violates any
    constraint, even one without y_i: the profile is then outside Omega_y [lemma:centreInv].

    y, z: (N,). laplacian, estimates: (N, N). Returns (N,), (N,) and (N, N) with a zero diagonal.
    """
    cost_part = extended_pseudo_gradient(game, y, estimates)
    profiles = barrier_profiles(z, estimates)
    u = np.zeros(game.N)
    for i in range(game.N):
        u[i] = -k * (cost_part[i] + barrier_gradient(game, rho, profiles[i])[i])
    z_rate = (np.asarray(y, dtype=float) - z) / epsilon
    coupling = disagreement(laplacian, with_own_action(y, estimates))
    return u, z_rate, without_own_entries(-coupling / epsilon)


# -------------------------------------------------------------------------------- closed loops


def pack(x, z=None, estimates=None):
    """Flat state: x row by row, then z, then the estimates' off-diagonal entries row by row.

    x: (N, n). z: (N,) or None. estimates: (N, N) or None.
    """
    values = [value for row in x for value in row]
    if z is not None:
        values += list(z)
    if estimates is not None:
        N = len(estimates)
        values += [estimates[i][j] for i in range(N) for j in range(N) if j != i]
    return np.array(values, dtype=float)


def unpack(flat, N, n, has_z=False, has_estimates=False):
    """Inverse of `pack`: (x, z, estimates), None for what is absent, NaN on the diagonal.

    flat: 1-D. N agents with n states each. Returns (N, n), (N,) and (N, N).
    """
    values = list(flat)
    x = np.array([[values.pop(0) for _ in range(n)] for _ in range(N)])
    z = np.array([values.pop(0) for _ in range(N)]) if has_z else None
    estimates = None
    if has_estimates:
        estimates = np.full((N, N), np.nan)
        for i in range(N):
            for j in range(N):
                if j != i:
                    estimates[i, j] = values.pop(0)
    if values:
        raise ValueError(f"the flat state has {len(values)} entries too many")
    return x, z, estimates


def consensus_start(y, with_z):
    """The default start: z and every row of the estimates equal to y.

    y: (N,). Returns (z or None, estimates (N, N)), for `pack`.
    """
    y = np.array(y, dtype=float)
    return (y.copy() if with_z else None), np.array([y for _ in y])


def closed_loop_rate(agent, law, game, rho, **parameters):
    """rate(time, flat state) of agents under a law evaluated continuously.

    law "full_information" [eq:FIdynamics]: state x, no further parameters.
    law "partial_information" [eq:PIDynamics]: state x, estimates; laplacian, c, tau.
    law "fully_distributed" [eq:CentreDynamics2]: state x, z, estimates; laplacian, k, epsilon.
    The layout of the flat state is that of `pack`.
    """
    N, n = game.N, agent.n

    def full_rate(_time, flat):
        x, _, _ = unpack(flat, N, n)
        return pack(agent.rate(x, full_information(game, rho, agent.output(x))))

    def partial_rate(_time, flat):
        x, _, estimates = unpack(flat, N, n, has_estimates=True)
        y = agent.output(x)
        u, estimates_rate = partial_information(game, rho, y=y, estimates=estimates, **parameters)
        return pack(agent.rate(x, u), estimates=estimates_rate)

    def distributed_rate(_time, flat):
        x, z, estimates = unpack(flat, N, n, has_z=True, has_estimates=True)
        y = agent.output(x)
        u, z_rate, estimates_rate = fully_distributed(
            game, rho, y=y, z=z, estimates=estimates, **parameters
        )
        return pack(agent.rate(x, u), z_rate, estimates_rate)

    rates = {
        "full_information": full_rate,
        "partial_information": partial_rate,
        "fully_distributed": distributed_rate,
    }
    return rates[law]


def held_input_rate(agent, N):
    """rate(time, flat x, u) of the agents alone [eq:PlantStacked], for `rk4_sampled`."""

    def rate(_time, flat, u):
        x, _, _ = unpack(flat, N, agent.n)
        return pack(agent.rate(x, u))

    return rate


def full_information_of_state(agent, game, rho):
    """law(time, flat x) -> u (N,) [eq:nonlinFIfeedback], for `rk4_sampled`."""

    def law(_time, flat):
        x, _, _ = unpack(flat, game.N, agent.n)
        return full_information(game, rho, agent.output(x))

    return law


def rk4_step(rate, time, x, h):
    """One step of the classical fourth-order Runge-Kutta method. x: any flat state."""
    k1 = rate(time, x)
    k2 = rate(time + h / 2, x + h / 2 * k1)
    k3 = rate(time + h / 2, x + h / 2 * k2)
    k4 = rate(time + h, x + h * k3)
    return x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


def rk4_fixed(rate, x0, h, steps):
    """Mode `continuous`: RK4 at step h, the law inside rate(time, x).

    Returns all states: (steps + 1, len(x0)).
    """
    states = [np.array(x0, dtype=float)]
    for step in range(steps):
        states.append(rk4_step(rate, step * h, states[-1], h))
    return np.array(states)


def rk4_sampled(agent_rate, law, x0, h, steps, steps_per_period):
    """Mode `sampled`: u = law(time, x) once every steps_per_period steps, held in between.

    agent_rate(time, x, u) is integrated by RK4 at step h with u constant. Whatever belongs to the
    state x besides the agents (estimates) is integrated by agent_rate too.
    Returns (states (steps + 1, len(x0)), the inputs of each step (steps, N)).
    """
    states = [np.array(x0, dtype=float)]
    inputs = []
    u = None
    for step in range(steps):
        if step % steps_per_period == 0:
            u = np.array(law(step * h, states[-1]), dtype=float)
        inputs.append(u)
        states.append(rk4_step(lambda t, x, u=u: agent_rate(t, x, u), step * h, states[-1], h))
    return np.array(states), np.array(inputs)


def semi_implicit_euler_robot(robot, law, x0, h, steps, steps_per_period=1):
    """MuJoCo's Euler method for FlexibleRobot: velocities first, then the extension with them.

    x2+ = x2 + h x2', x3+ = x3 + h x3', x1+ = x1 + h (x2+ - x3+); spring, damper and law are all
    explicit. law(time, x (N, 3)) -> u (N,) is evaluated at the start of each period of
    steps_per_period steps (1: mode `continuous` under Euler) and held.
    Returns (states (steps + 1, N, 3), the inputs of each step (steps, N)).
    """
    states = [np.array(x0, dtype=float)]
    inputs = []
    u = None
    for step in range(steps):
        x = states[-1]
        if step % steps_per_period == 0:
            u = np.array(law(step * h, x), dtype=float)
        inputs.append(u)
        rates = robot.rate(x, u)
        new = np.zeros_like(x)
        for i in range(len(x)):
            new[i, 1] = x[i, 1] + h * rates[i, 1]
            new[i, 2] = x[i, 2] + h * rates[i, 2]
            new[i, 0] = x[i, 0] + h * (new[i, 1] - new[i, 2])
        states.append(new)
    return np.array(states), np.array(inputs)


def dop853(rate, x0, times, rtol=1e-12, atol=1e-13):
    """SciPy's DOP853 from times[0] through all times: (len(times), len(x0)).

    Restarted at each time, so that every returned state is the end of a step and none is
    interpolated (the dense output is of lower order). A trial step out of the interior yields NaN
    and is rejected. Explicit: stiff loops (small epsilon) need many steps.
    """
    states = [np.array(x0, dtype=float)]
    for start, end in itertools.pairwise(times):
        solution = solve_ivp(rate, (start, end), states[-1], method="DOP853", rtol=rtol, atol=atol)
        if not solution.success:
            raise ArithmeticError(f"DOP853 stopped at t = {solution.t[-1]}: {solution.message}")
        states.append(solution.y[:, -1])
    return np.array(states)


# --------------------------------------------------------------------------------- equilibrium


def penalised_equilibrium(game, rho, y0, tolerance=1e-12, iterations=500):
    """y* with F(y*) + grad phi(y*) = 0 [eq:NEcondition] by damped Newton from y0 inside: (N,).

    Steps are halved until the point is interior and the residual's norm falls; iteration goes on
    until rounding stops the fall. Raises ArithmeticError unless max |residual| < tolerance: with
    a rho so small that -g_l is lost in the rounding of y, 1e-12 cannot be met.
    """

    def residual(y):
        return pseudo_gradient(game, y) + barrier_gradient(game, rho, y)

    y = np.array(y0, dtype=float)
    if not is_interior(game, y):
        raise ValueError(f"y0 is not strictly inside: constraints {constraints(game, y)}")
    for _ in range(iterations):
        value = residual(y)
        jacobian = pseudo_gradient_jacobian(game, y) + barrier_hessian(game, rho, y)
        direction = np.linalg.solve(jacobian, -value)
        length, improved = 1.0, False
        while length > 1e-12 and not improved:
            trial = y + length * direction
            improved = is_interior(game, trial) and bool(
                np.linalg.norm(residual(trial)) < np.linalg.norm(value)
            )
            length /= 2
        if not improved:
            break
        y = trial
    worst = np.max(np.abs(residual(y)))
    if not worst < tolerance:
        raise ArithmeticError(f"residual {worst} of the penalised equilibrium >= {tolerance}")
    return y
