"""What laws know of the plant that know it: kernels that ask its own equations.

Agents are channels whose rates are affine in their inputs, x' = f(x) + B u, and whose outputs are
states: under u, y' = drift + push u with push the same for all states. A run whose law asks for it
has the addresses of two C functions in ``problem.model`` (:mod:`gne_mj.loops.plant_model`), and its
loop tells the law where the state is.
"""

from gne_mj.native import address_in, call_integer, kernel

RATES, KNOTS, COUNT = range(3)  # entries of ``problem.model``


@kernel
def output_rates(problem, work, y, drift, push):
    """Fill drift and push (m,) at the state as it is, but for the outputs y (m,) as they are seen.

    Agents' other states are taken as they are, whatever sensors do.
    """
    call_integer(
        problem.model[RATES],
        (
            problem.parameter_block, int(work.now.state), address_in(y), address_in(drift),
            address_in(push),
        ),
    )  # fmt: skip


@kernel
def outputs_at_knots(problem, work, y, knots, periods, u, out):
    """Fill out with the outputs at the end of each of so many knots under the inputs u, both m
    entries for each knot.

    A knot is so many control periods in which an input is held; the plant's own discrete map is
    what moves the state.
    """
    call_integer(
        problem.model[KNOTS],
        (
            problem.parameter_block, int(work.now.state), address_in(y), knots, periods,
            address_in(u), address_in(out),
        ),
    )  # fmt: skip
