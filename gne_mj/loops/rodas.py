"""Rodas5P: coefficients of a stiffly accurate Rosenbrock method of order 5, with dense output.

G. Steinebach, Construction of Rosenbrock-Wanner method Rodas5P and numerical benchmarks within the
Julia Differential Equations package, BIT Numerical Mathematics 63, 27 (2023), in the form that is
free of products with the Jacobian (E. Hairer and G. Wanner, Solving Ordinary Differential
Equations II, 2nd edition, section IV.7). For x' = f(x) with the Jacobian J at the step's start,
stage i of STAGES solves

(I / (GAMMA h) - J) k_i = f(x + sum_j STAGE_ij k_j) + sum_j RATE_ij k_j / h;

the last row of STAGE gives the new state. Its difference from the embedded solution of order 4 is
the last k. The method is L-stable: what decays at once is gone after a step, however long.
"""

from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

STAGES = 8
ORDER = 5
GAMMA = 0.21193756319429014
# From here on each stage's argument is the one before plus the last k (see the rows of STAGE).
ADDING = 6
_SIXTH = (
    -7.502846399306121,
    2.561846144803919,
    -11.627539656261098,
    -0.18268767659942256,
    0.030198172008377946,
)
_STAGE: tuple[tuple[float, ...], ...] = (
    (),
    (3.0,),
    (2.849394379747939, 0.45842242204463923),
    (-6.954028509809101, 2.489845061869568, -10.358996098473584),
    (2.8029986275628964, 0.5072464736228206, -0.3988312541770524, -0.04721187230404641),
    _SIXTH,
    (*_SIXTH, 1.0),
    (*_SIXTH, 1.0, 1.0),
    (*_SIXTH, 1.0, 1.0, 1.0),
)
_RATE: tuple[tuple[float, ...], ...] = (
    (),
    (-14.155112264123755,),
    (-17.97296035885952, -2.859693295451294),
    (147.12150275711716, -1.41221402718213, 71.68940251302358),
    (165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306),
    (
        24.854864614690072,
        -3.0009227002832186,
        47.4931110020768,
        5.5814197821558125,
        -0.6610691825249471,
    ),
    (
        30.91273214028599,
        -3.1208243349937974,
        77.79954646070892,
        34.28646028294783,
        -19.097331116725623,
        -28.087943162872662,
    ),
    (
        37.80277123390563,
        -3.2571969029072276,
        112.26918849496327,
        66.9347231244047,
        -40.06618937091002,
        -54.66780262877968,
        -9.48861652309627,
    ),
)
# Dense output of order 4 at x0 + theta h, with theta' = 1 - theta and d_l = sum_j DENSE_lj k_j:
# theta' x0 + theta (x1 + theta' (d_0 + theta (d_1 + theta d_2))).
_DENSE: tuple[tuple[float, ...], ...] = (
    (
        25.948786856663858,
        -2.5579724845846235,
        10.433815404888879,
        -2.3679251022685204,
        0.524948541321073,
        1.1241088310450404,
        0.4272876194431874,
        -0.17202221070155493,
    ),
    (
        -9.91568850695171,
        -0.9689944594115154,
        3.0438037242978453,
        -24.495224566215796,
        20.176138334709044,
        15.98066361424651,
        -6.789040303419874,
        -6.710236069923372,
    ),
    (
        11.419903575922262,
        2.8879645146136994,
        72.92137995996029,
        80.12511834622643,
        -52.072871366152654,
        -59.78993625266729,
        -0.15582684282751913,
        4.883087185713722,
    ),
)


class Method(NamedTuple):
    """The coefficients as arrays, and what accuracy is asked for."""

    stage: Annotated[np.ndarray, "stages + 1, stages"]
    rate: Annotated[np.ndarray, "stages, stages"]
    dense: Annotated[np.ndarray, "3, stages"]
    tolerance: Annotated[np.ndarray, "2"]  # relative, absolute


def method(rtol: float, atol: float) -> Method:
    """The method for native code, with these tolerances."""
    return Method(_table(_STAGE), _table(_RATE), _table(_DENSE), np.array([rtol, atol]))


def _table(rows: tuple[tuple[float, ...], ...]) -> NDArray[np.float64]:
    table = np.array([[*row, *[0.0] * (STAGES - len(row))] for row in rows])
    table.flags.writeable = False
    return table
