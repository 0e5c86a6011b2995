"""The result of a run: labelled arrays, status and certificate.

Kept as an xarray DataTree with one group for each system, stored as Zarr without pickle, so that
xarray alone can read it: ``xarray.open_datatree(folder, engine="zarr")``.
"""

import json
import os
import platform
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj import chunks
from gne_mj.certificate import Certificate
from gne_mj.errors import InvalidInput
from gne_mj.files import written
from gne_mj.loops.base import Samples
from gne_mj.recorded import structure_of
from gne_mj.run_metrics import SUCCESSES
from gne_mj.signals import coordinates_of, declared, variables_of
from gne_mj.summary import summary
from gne_mj.system import System
from gne_mj.variables import Labelled

if TYPE_CHECKING:
    import xarray

# From bad to good: a run's status is the worst of its systems'.
_ORDER = (
    "diverged",
    "forces_left_out",
    "too_near",
    "left_feasible_set",
    "exit_foreseen",
    "bound_moved_past",
    "estimate_left_feasible_set",
    "step_too_small",
    "went_outside",
    "interrupted",
    "completed",
    "converged",
)


@dataclass(frozen=True)
class SystemRecord:
    """What a system recorded while its numbers stayed the same.

    Attributes:
        system: with these numbers.
        time: (samples,) in s.
        samples: at these times.
    """

    system: System
    time: NDArray[np.float64]
    samples: Samples

    def thinned(self, every: int) -> "SystemRecord":
        """Every so many-th sample."""
        return SystemRecord(self.system, self.time[::every], self.samples.thinned(every))


def joined(parts: Sequence[SystemRecord]) -> list[SystemRecord]:
    """Parts of one system that follow each other made one."""
    groups: list[list[SystemRecord]] = []
    for part in parts:
        if groups and groups[-1][-1].system is part.system:
            groups[-1].append(part)
        else:
            groups.append([part])
    return [
        SystemRecord(
            group[0].system,
            np.concatenate([part.time for part in group]),
            Samples.join([part.samples for part in group]),
        )
        for group in groups
    ]


class _Unlabelled(NamedTuple):
    """A tree that is not made yet: that, and xarray with it, takes longer than many a run.

    Attributes:
        attributes: of its root.
        parts: as :meth:`Trajectory.from_parts` has them.
    """

    attributes: dict[str, Any]
    parts: dict[str, tuple[list[SystemRecord], Certificate]]

    def tree(self) -> "xarray.DataTree":
        """The tree."""
        import xarray

        groups = {"/": xarray.Dataset(attrs=self.attributes)}
        for name, part in self.parts.items():
            groups[f"/{name}"] = _dataset(*part)
        return xarray.DataTree.from_dict(groups)


class Trajectory:
    """What a run recorded and showed.

    Args:
        tree: the DataTree.

    Attributes:
        reports: for each system its certificate as plain data.
    """

    def __init__(self, tree: "xarray.DataTree | _Unlabelled") -> None:
        self._given = tree
        if isinstance(tree, _Unlabelled):
            self._attributes: dict[Any, Any] = tree.attributes
            reports = {name: _report(certificate) for name, (_, certificate) in tree.parts.items()}
        else:
            self._attributes = tree.attrs
            reports = {str(name): group.attrs["certificate"]
                       for name, group in tree.children.items()}  # fmt: skip
        self.reports: dict[str, dict[str, Any]] = {
            name: json.loads(report) for name, report in reports.items()
        }

    @cached_property
    def tree(self) -> "xarray.DataTree":
        """The DataTree, made when it is first asked for.

        ``tree["robots"].dataset`` is one system's dataset on dimensions time, agent, constraint and
        component (of the state); agents whose actions have several entries add a dimension action,
        with coordinates owner and axis.
        """
        return self._given.tree() if isinstance(self._given, _Unlabelled) else self._given

    @classmethod
    def from_parts(
        cls,
        parts: dict[str, tuple[list[SystemRecord], Certificate]],
        *,
        seed: int,
        source: str,
        wall_time: float,
        interventions: Sequence[dict[str, Any]] = (),
    ) -> "Trajectory":
        """Label what the systems of one run recorded.

        Args:
            parts: by the systems' names.
            seed: of the run.
            source: its scenario, as JSON.
            wall_time: real time in s that it took.
            interventions: what the user did meanwhile, each with its time in s.
        """
        attributes = {
            "scenario": source,
            "seed": seed,
            "versions": json.dumps(versions()),
            "wall_time": wall_time,
            "interventions": json.dumps(list(interventions)),
            "status": _worst(certificate.status for _, certificate in parts.values()),
            "message": "; ".join(
                f"{name}: {certificate.message}" for name, (_, certificate) in parts.items()
            ),
        }
        return cls(_Unlabelled(attributes, parts))

    def __repr__(self) -> str:
        words = ", ".join(f"{name}: {report['status']}" for name, report in self.reports.items())
        return f"<Trajectory of {words}>"

    def __str__(self) -> str:
        """What commands print of it: each system's figures, and what was done while it ran."""
        lines = []
        for name, report in self.reports.items():
            lines += ["", name, *(f"  {key:20} {value}" for key, value in summary(report).items())]
        if self.interventions:
            lines += ["", "while it ran"]
            for done in self.interventions:
                when = f"at {done['time']:.4g} s"
                lines.append(f"  {when:20} {done['what']}")
        return "\n".join(lines[1:])

    @property
    def status(self) -> str:
        """The worst of the systems' statuses."""
        return str(self._attributes["status"])

    @property
    def holds(self) -> bool:
        """Whether every system ran to its end inside its set."""
        return self.status in SUCCESSES

    @property
    def source(self) -> str:
        """What was run, as JSON; empty if no scenario was."""
        return str(self._attributes["scenario"])

    @property
    def interventions(self) -> list[dict[str, Any]]:
        """What the user did while it ran: "time" in s, and "what" in words."""
        done: list[dict[str, Any]] = json.loads(self._attributes.get("interventions", "[]"))
        return done

    def __getitem__(self, system: str) -> "xarray.Dataset":
        """One system's dataset."""
        group: xarray.Dataset = self.tree[system].to_dataset()
        return group

    def report(self) -> dict[str, Any]:
        """The whole report as plain data, for JSON."""
        attributes = self._attributes
        return {
            "status": self.status,
            "systems": self.reports,
            "seed": int(attributes["seed"]),
            "versions": json.loads(attributes["versions"]),
            "wall_time": float(attributes["wall_time"]),
            "interventions": self.interventions,
        }

    def save(self, folder: str | Path) -> Path:
        """Write the tree as a Zarr folder that must not exist yet; returns its path.

        The folder appears when all is written.

        Raises:
            InvalidInput: the folder exists, or is in no place that can be written to.
            StorageError: the disk is full, or fails; nothing is left.
        """
        path = Path(folder)
        if os.path.lexists(path):
            raise InvalidInput("folder", str(path), "it exists already; name one that does not")
        encoding = {node.path: chunks.encodings(node.to_dataset()) for node in self.tree.subtree}
        with written("folder", path, replace=False) as new, chunks.every_chunk():
            # The second Zarr format: the third has no settled way to store names yet.
            self.tree.to_zarr(new, mode="w-", zarr_format=2, encoding=encoding)
        return path

    @classmethod
    def load(cls, folder: str | Path) -> "Trajectory":
        """Read a saved trajectory into memory.

        Raises:
            InvalidInput: it is none, or something of it is missing or damaged.
        """
        import xarray

        path = Path(folder)
        try:
            lost = chunks.disagreement(path) or next(chunks.missing(path), None)
            if lost is None:
                with xarray.open_datatree(path, engine="zarr", consolidated=True) as tree:
                    return cls(tree.load())
        except chunks.UNREADABLE:
            lost = next(_damaged(path), None)
            if lost is None:
                raise InvalidInput(
                    "folder", str(path), "it must be one that a run or `save` wrote"
                ) from None
        raise InvalidInput("folder", str(path), f"it must be whole: {lost} is missing or damaged")


def _damaged(path: Path) -> Iterator[str]:
    with suppress(*chunks.UNREADABLE):  # of a folder that is no store at all nothing can be told
        yield from chunks.damaged(path)


def _worst(statuses: Iterable[str]) -> str:
    return min(statuses, key=_ORDER.index)


def variables_of_parts(parts: Sequence[SystemRecord]) -> Labelled:
    """The same of parts one after the other; what has no time is that of the last numbers."""
    found = [variables_of(part.system, part.time, part.samples) for part in parts]
    variables = found[-1]
    for name, (dimensions, _, attributes) in list(variables.items()):
        if dimensions[:1] == ("time",):
            values = np.concatenate([each[name][1] for each in found])
            variables[name] = (dimensions, values, attributes)
    return variables


def _report(certificate: Certificate) -> str:
    return json.dumps(certificate.to_dict())


def _dataset(parts: list[SystemRecord], certificate: Certificate) -> "xarray.Dataset":
    """The dataset of a system."""
    import xarray

    system = parts[-1].system
    game = system.game
    drawn = [variable for variable in declared(system) if variable.figure]
    time = np.concatenate([part.time for part in parts])
    return xarray.Dataset(
        variables_of_parts(parts),
        coordinates_of(system, time),
        attrs={
            "game": game.name,
            "agent_name": game.agent_name,
            "quantities": json.dumps([each.name for each in drawn if each.name != "action"]),
            "structure": structure_of(system),
            "information": system.law.information,
            "mode": system.mode,
            "decentralised": int(system.decentralised),
            "between": system.between,
            "engine": system.engine,
            "integrator": system.integrator,
            "rho": system.rho,
            "status": certificate.status,
            "message": certificate.message,
            "certificate": _report(certificate),
        },
    )


def versions() -> dict[str, str]:
    """Of what results may depend on, to the last bit."""
    names = ("gne-mj", "mujoco", "numba", "numpy", "scipy")
    return {"python": platform.python_version(), **{name: version(name) for name in names}}
