"""What a user's robot is like before it plays: does its input move its output, and how well?

One robot by itself, in MuJoCo, with an output and an input that are given or proposed: what the
file offers; which input holds it at rest and at the wished output; how outputs rise with inputs
over periods of several lengths and at many states; after how many integrations; what its actuators
let through; the longest stable step; and trials of passivity. From that follows what to use.
"""

from gne_mj.examination.examine import examine
from gne_mj.examination.report import Examination

__all__ = ["Examination", "examine"]
