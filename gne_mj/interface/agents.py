"""Agents as objects: one function a type that scenario files know.

Numbers are one for all agents or a list with one each. ``input_limit`` is the greatest absolute
value that the actuators deliver (for actions of several entries lists of lists); None for no limit.
All raise InvalidInput, which names the key, the value and what would be right.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from tempfile import gettempdir
from typing import Any

from numpy.typing import ArrayLike

from gne_mj.arguments import answering
from gne_mj.files import written
from gne_mj.interface.tables import made
from gne_mj.plants.integrator import IntegratorAgents
from gne_mj.plants.mixed import MixedAgents
from gne_mj.plants.mjcf_robot import MjcfAgents
from gne_mj.plants.mjcf_source import is_named
from gne_mj.plants.pi_cascade import PiCascadeAgents
from gne_mj.plants.robot_tables import PlanarRobotAgents, RobotAgents
from gne_mj.plants.table import AgentsTable
from gne_mj.toml_table import Table
from gne_mj.user_files import CustomAgents


@answering
def flexible_robots(
    count: int,
    *,
    main_mass: ArrayLike = 1.0,
    appendage_mass: ArrayLike = 1.0,
    stiffness: ArrayLike = 1.0,
    atan_coefficient: ArrayLike = 1.0,
    damping: ArrayLike = 1.0,
    output: str = "velocity",
    lookahead: float | None = None,
    local_damping: ArrayLike | None = None,
    reference_velocity: ArrayLike | None = None,
    contacts: bool = False,
    input_limit: ArrayLike | None = None,
) -> AgentsTable:
    """Robots on a lane: two masses, a spring and a damper [eq:MobileRobot].

    Args:
        count: N.
        main_mass: M in kg, positive.
        appendage_mass: m in kg, positive.
        stiffness: linear part of psi in N/m.
        atan_coefficient: atan part of psi in N.
        damping: gamma in N s/m.
        output: "velocity", or "position" for y = q + tau v.
        lookahead: tau in s of such outputs, one for all.
        local_damping: d in N s/m, the force being u - d v; 1.2 times the least that is proven
            (docs/positions.md) if left out.
        reference_velocity: v_0 in m/s, to which q and v are relative; 0 if left out.
        contacts: whether main masses collide in MuJoCo; contacts are counted then.
        input_limit: in N.
    """
    return made(RobotAgents, type="flexible-robot", **locals())


@answering
def planar_robots(
    count: int,
    *,
    main_mass: ArrayLike = 1.0,
    appendage_mass: ArrayLike = 1.0,
    stiffness: ArrayLike = 1.0,
    atan_coefficient: ArrayLike = 1.0,
    damping: ArrayLike = 1.0,
    output: str = "velocity",
    lookahead: float | None = None,
    local_damping: ArrayLike | None = None,
    reference_velocity: ArrayLike | None = None,
    contacts: bool = False,
    input_limit: ArrayLike | None = None,
) -> AgentsTable:
    """The same robots in the plane, for games with ``dimension=2``.

    Args:
        count: N.
        main_mass: M in kg, positive.
        appendage_mass: m in kg, positive.
        stiffness: linear part of psi in N/m.
        atan_coefficient: atan part of psi in N.
        damping: gamma in N s/m.
        output: "velocity", or "position" for y = q + tau v.
        lookahead: tau in s of such outputs, one for all.
        local_damping: d in N s/m, the force being u - d v; 1.2 times the least that is proven
            (docs/positions.md) if left out.
        reference_velocity: v_0 in m/s, to which q and v are relative, two numbers or one for
            both; 0 if left out.
        contacts: whether main masses collide in MuJoCo; contacts are counted then.
        input_limit: in N.
    """
    return made(PlanarRobotAgents, type="planar-flexible-robot", **locals())


@answering
def integrators(count: int, *, input_limit: ArrayLike | None = None) -> AgentsTable:
    """Agents with y' = u [eq:int].

    Args:
        count: N.
        input_limit: in the action's unit per second.
    """
    return made(IntegratorAgents, type="integrator", **locals())


@answering
def pi_cascades(
    count: int,
    *,
    decay_rate: ArrayLike = 1.0,
    integral_gain: ArrayLike = 0.5,
    input_limit: ArrayLike | None = None,
) -> AgentsTable:
    """First-order systems behind a PI controller [eq:cascadePI].

    Args:
        count: N.
        decay_rate: v in 1/s.
        integral_gain: k in 1/s, 0 < k < v.
        input_limit: in the action's unit per second.
    """
    return made(PiCascadeAgents, type="pi-cascade", **locals())


@answering
def mjcf_robots(
    count: int,
    file: str | Path | Sequence[str | Path],
    *,
    output: Any,
    input: Any,
    lookahead: float | None = None,
    local_damping: ArrayLike | None = None,
    reference_velocity: ArrayLike | None = None,
    spacing: float | None = None,
    poses: Sequence[Any] | None = None,
    terrain: str | Path | None = None,
    keyframe: str | Sequence[str] | None = None,
    settle: float | None = None,
    contacts: str = "all",
    input_limit: ArrayLike | None = None,
) -> AgentsTable:
    """Robots of your own, which MuJoCo moves.

    Args:
        count: N.
        file: an MJCF file, or its text, which begins with ``<``, or the name of a package's
            (``"dm_control:walker"``, docs/robots.md); one for all or one each.
        output: the joint or velocity sensor that is y_i, likewise, or a table that says what
            (docs/robots.md), as ``{"body": "hull", "axes": ["x", "y"]}``; of vectors a list.
        input: the actuator that u_i drives, likewise, or a table of several, or of a force.
        lookahead: tau in s; with it y_i is the joint's position with a look-ahead, q + tau v.
        local_damping: d in N s/m, then: the force is u - d v.
        reference_velocity: v_0 in m/s, to which q and v are relative; 0 if left out.
        spacing: in m along y from one robot to the next; 2 if left out.
        poses: of each agent's robot, in place of a spacing: x, y, z in m, or a table with
            ``position``, and ``yaw`` in rad or ``quaternion`` (w first).
        terrain: an MJCF file, or its text, of what they stand on, in place of their own floors.
        keyframe: the name of their files' keyframe that they start in, or one each.
        settle: in s, how long they come to rest before they start, under inputs of zero.
        contacts: "all" as files say, or but those with the "floor", of "agents", or "none".
        input_limit: in N or N m.
    """
    each = [file] if isinstance(file, str | Path) else list(file)
    paths = [path_of(one) for one in each]
    return made(
        MjcfAgents,
        type="mjcf-robot",
        count=count,
        file=paths[0] if isinstance(file, str | Path) else paths,
        output=output,
        input=input,
        lookahead=lookahead,
        local_damping=local_damping,
        reference_velocity=reference_velocity,
        spacing=spacing,
        poses=poses,
        terrain=None if terrain is None else path_of(terrain),
        keyframe=keyframe,
        settle=settle,
        contacts=contacts,
        input_limit=input_limit,
    )


def path_of(file: str | Path) -> str:
    """A file's path; that of a text, which is kept among the user's temporary files."""
    text = str(file).lstrip()
    if not text.startswith("<"):
        return text if is_named(text) else str(Path(file).resolve())
    path = Path(gettempdir()) / f"gne-mj-{sha256(text.encode()).hexdigest()[:16]}.xml"
    with written("file", path, replace=True) as new:
        new.write_text(text, encoding="utf-8")
    return str(path)


@answering
def custom_agents(
    count: int,
    file: str | Path,
    *,
    parameters: Mapping[str, ArrayLike] | None = None,
    input_limit: ArrayLike | None = None,
) -> AgentsTable:
    """Agents that a differential equation in a Python file describes (docs/your-own.md).

    Args:
        count: N.
        file: with the kernels of an agent type.
        parameters: each of its PARAMETERS.
        input_limit: in the type's INPUT_UNIT.
    """
    path = str(Path(file).resolve())
    return made(
        CustomAgents, type="custom", count=count, file=path, parameters=parameters,
        input_limit=input_limit,
    )  # fmt: skip


def mixed_agents(*groups: Table) -> Table:
    """Agents of several types, one group behind the other.

    Args:
        groups: made by the functions above, but those of files.
    """
    tables: list[Any] = list(groups)
    return made(MixedAgents, type="mixed", groups=tables)
