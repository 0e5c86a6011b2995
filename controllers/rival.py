"""What the laws of others have in common (docs/rivals.md): numbers of their own, and no barrier.

A rival is one file: its formula as kernels, and a class that names its numbers. A kernel finds the
first of these at ``problem.settings[COUNT]``, the next one behind it, and k at ``GAIN``.
"""

import sys
from types import ModuleType
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from gne_mj.controllers.law import Law, check_positive


class Rival(Law):
    """A law of others; a subclass is a frozen dataclass in the module of its kernels.

    Attributes:
        own: its numbers besides k, by name and in the order of ``problem.settings``; positive.
    """

    acts_outside: ClassVar[bool] = True
    own: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        check_positive(self, "gain", *self.own)

    @property
    def kernels(self) -> ModuleType:
        """The module that it is defined in."""
        return sys.modules[type(self).__module__]

    def settings(self, rho: float) -> NDArray[np.float64]:
        """See the base class, and its own behind these; rho is not read."""
        own = [getattr(self, name) for name in self.own]
        return np.append(super().settings(rho), own)
