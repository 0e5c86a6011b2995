"""Six robots share a budget of energy and keep together: a game of plain expressions."""


def cost(i, y, p):
    """J_i: each wants its own speed, and the price rises with the mean."""
    return 0.5 * p.weight[i] * (y[i] - p.wanted[i]) ** 2 + p.price * y[i] * y.mean()


def constraints(y, p):
    """Shared by all."""
    yield "energy", (y**2).sum() <= p.budget
    for i in range(len(y)):
        yield f"gap {i + 1}", abs(y[i] - y[i - 1]) <= p.gap
