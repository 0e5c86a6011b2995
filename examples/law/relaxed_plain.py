"""A law to enter into a comparison: gradient play with a relaxed log barrier.

The barrier's weight rho / s is kept down to a slack of s = width and goes on there along its
tangent, rho / width (2 - s / width), so that the law has an action outside the set too, and no
input is infinite (Feller and Ebenbauer, Relaxed logarithmic barrier function based model predictive
control of linear systems, IEEE Transactions on Automatic Control 62, 2017). Nothing then keeps it
inside.

    gne-mj compare desired-velocity --laws full,primal-dual --law examples/law/relaxed_plain.py
"""

import numpy as np

ACTS_OUTSIDE = True  # its runs go on where they leave the set
TUNED = {"gain": [1.0, 0.5, 2.0], "width": [0.1, 0.01, 1.0]}  # each begins with its default


def action(game, rho, y, memory, gain, width):
    """u, shape (m,)."""
    slack = -game.constraints(y)
    weights = np.where(slack > width, rho / np.maximum(slack, width),
                       rho / width * (2.0 - slack / width))  # fmt: skip
    return -gain * (game.pseudo_gradient(y) + weights @ game.constraint_jacobian(y))
