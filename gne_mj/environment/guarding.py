"""The barrier as a filter of any policy, in every kind of environment."""

from typing import Any, Literal, Protocol, TypeVar

from gne_mj.environment.setting import Guard, Setting
from gne_mj.errors import InvalidInput


class HasSetting(Protocol):
    """An environment of ours."""

    setting: Setting

    def of(self, setting: Setting) -> Any:
        """The same of another setting."""


Environment = TypeVar("Environment", bound=HasSetting)


def guarded(
    environment: Environment,
    *,
    pull: float | None = None,
    between: Literal["watched", "guarded"] = "watched",
    decentralised: bool = False,
) -> Environment:
    """The same environment, kept inside its constraint set whatever the policy asks for.

    An action is then a *pull*: what acts is pull - dphi/dy at the outputs of the period's end, as
    in mode ``implicit``. docs/learning.md has the theorem.

    Args:
        environment: of dm_env, Gymnasium (single or a vector of them) or PettingZoo; a new one is
            made, and this one left as it is.
        pull: the greatest entry of an action, in the input's unit; that of the actuators if left
            out. Staying inside asks for no bound, but an actuator that cannot deliver does.
        between: "guarded" cuts periods that would lead outside between two control instants.
        decentralised: each agent finds its input alone, in its share of what is left of each bound.

    Raises:
        InvalidInput: an environment that is wrapped, a pull that is not positive, or what mode
            ``implicit`` refuses.

    >>> environment = load_environment("velocity-sync", {"agents.input_limit": 40.0})
    >>> environment = guarded(environment, pull=10.0)
    """
    if not hasattr(type(environment), "of"):  # Gymnasium's wrappers pass on some attributes
        raise InvalidInput(
            "environment", type(environment).__name__,
            "it must be one of this package's; of a wrapped one give environment.unwrapped",
        )  # fmt: skip
    guard = Guard(pull, between, decentralised)
    found: Environment = environment.of(environment.setting.guarded(guard))
    return found
