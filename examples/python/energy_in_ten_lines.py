"""Six robots share a budget of energy and keep together: from two formulas to figures."""

import gne_mj as gm


def cost(i, y, p):
    """J_i: each wants its own speed, and the price rises with the mean."""
    return 0.5 * p.weight[i] * (y[i] - p.wanted[i]) ** 2 + p.price * y[i] * y.mean()


def constraints(y, p):
    """Shared by all."""
    yield "energy", (y**2).sum() <= p.budget
    for i in range(len(y)):
        yield f"gap {i + 1}", abs(y[i] - y[i - 1]) <= p.gap


wanted = [1.0, 1.4, 1.8, 2.2, 2.6, 3.0]
game = gm.game(6, cost, constraints, weight=1.0, wanted=wanted, price=0.2, budget=12.0, gap=2.0)
law = gm.partial_information(gm.ring(6))
run = gm.run(game, agents=gm.flexible_robots(6), law=law, rho=0.02, duration=60.0)
print(run, run.plot("results/energy"), gm.certify(run.system), gm.solve(run), sep="\n\n")
