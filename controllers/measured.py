"""What laws share whose barrier is at the outputs as they are measured: kernels."""

from gne_mj.native import copy, kernel


@kernel
def own_profile(problem, i, y, memory, profile):
    """Fill profile (m,) with the others' actions as agent i's barrier reads them: measured.

    Returns by how much its own block moves with its own action: fully.
    """
    copy(y, profile)
    return 1.0


@kernel
def memory_outputs(prediction, held):
    """In mode implicit too the memory moves with the outputs of the period's start."""
