"""The numbers that every law is given, in one array for native code; these are its entries."""

from gne_mj.numbers import Numbers, names_of

RHO = 0  # barrier's penalty parameter rho
GAIN = 1  # k of [eq:CenterFeedback]
EPSILON = 2  # time constant of z in [eq:CenterFeedback], in s
COUPLING = 3  # c, on the Laplacian in the action of [eq:nonlinearPIFeedback]
TIME_CONSTANT = 4  # tau of the estimates under partial information, in s
RATE = 5  # estimates follow d/dt = -RATE times their disagreement, in 1/s
LINKS = 6  # where in the memory what was last heard over each link begins; 0: rows are read
GUARDED = 7  # 1: the whole barrier is at measured outputs, which hence stay inside
FAST_WEIGHT = 8  # omega of W = V + omega V_fast, under the fully distributed law
OBSERVER = 9  # gain of the observer of loads, mode implicit; 0: there is none
OUTSIDE = 10  # what a law does outside the set, one of the following
BESIDES = 11  # entries of each of two rows that agents send besides their estimates
COMPENSATION = 12  # 1: inputs begin at what keeps outputs where they are, mode implicit
COUNT = 13

# It has no action there; it has one, but the run ends; it has one, and the run goes on
NO_ACTION, ENDS, GOES_ON = 0.0, 1.0, 2.0

RELAXED = -2  # what an action returns that cannot keep the bounds which the law is to keep


class Now(Numbers):
    """What holds at an instant: a loop's ``work.now``."""

    penalty: float  # rho at this time
    tightened: float  # the first constraint whose g + t is not negative at what the law sees, or -1
    tightened_value: float  # that value
    faults_step: float  # the step up to which faults were dealt with
    memory_step: float  # the step that the law's memory belongs to, held modes
    next_instant: float  # the step of the next control instant, where periods may end early
    state: float  # address of the agents' flat state, for laws that know the plant


LENGTH_OF_NOW = len(names_of(Now))
