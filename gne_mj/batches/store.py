"""A batch on disk: a manifest, and one labelled Zarr store that xarray alone can read.

``DIR/manifest.json`` has all that decides the results; ``DIR/runs.zarr`` has one array a variable,
each cut along ``run`` as the plan's chunks are. A chunk's runs are there once its statuses are:
they are written last, in one file that appears whole or not at all. Until then the chunk's runs
read as missing, and to resume computes them again. A file that is lost later is noticed, and a
damaged one has no matching checksum (gne_mj/chunks.py).
"""

import fcntl
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gne_mj import chunks
from gne_mj.batch_variables import declared_figures
from gne_mj.batches.engine_check import check_plan, unchecked
from gne_mj.batches.integrity import AGAIN, broken, kept_of_runs, lost_chunks, read_statuses
from gne_mj.batches.plan import FORMAT, Combination, Plan
from gne_mj.batches.summary import columns_of, join, kept, span_of, times
from gne_mj.errors import InvalidInput, StorageError, named
from gne_mj.files import storing, written
from gne_mj.loops import monitor as watch
from gne_mj.loops.batch import Outcome
from gne_mj.loops.recorder import Recorder
from gne_mj.signals import check_names, coordinates_of, declared
from gne_mj.variables import Labelled

if TYPE_CHECKING:
    import xarray

MANIFEST, RUNS = "manifest.json", "runs.zarr"


class Store:
    """A batch's folder.

    Attributes:
        folder: where.
        plan: what it is the result of.
    """

    def __init__(self, folder: Path, plan: Plan) -> None:
        self.folder, self.plan = folder, plan

    @classmethod
    def create(cls, folder: Path, plan: Plan) -> "Store":
        """A new folder with an empty store; it appears when it is complete.

        Raises:
            InvalidInput: the folder exists, or combinations have no common layout.
            StorageError: it cannot be written, as on a full disk.
        """
        check_plan(plan)
        if os.path.lexists(folder):
            raise InvalidInput("folder", str(folder), "it exists already; name one that does not")
        with storing("folder", folder):
            folder.parent.mkdir(parents=True, exist_ok=True)
        with written("folder", folder, replace=False) as new:
            new.mkdir()
            text = json.dumps(plan.manifest(), indent=2)
            (new / MANIFEST).write_text(text + "\n", encoding="utf-8")
            with chunks.every_chunk():
                _create_arrays(new / RUNS, plan)
        return cls(folder, plan)

    @classmethod
    def open(cls, folder: Path) -> "Store":
        """The store of an existing folder.

        Raises:
            InvalidInput: it is not that of a batch.
        """
        return cls(folder, Plan.from_manifest(_manifest(folder)))

    @classmethod
    def resume(cls, folder: Path, plan: Plan) -> "Store":
        """The store of a folder that this very plan has begun.

        Raises:
            InvalidInput: it was another plan, or other versions; the first difference is named.
        """
        before, now = _manifest(folder), json.loads(json.dumps(plan.manifest()))
        difference = next(_differences(before, now), None)
        if difference is not None:
            key, was, value = difference
            raise InvalidInput(
                key, value, f"the batch in {folder} was begun with {was}; go on with that, or"
                " name another folder",
            )  # fmt: skip
        return cls(folder, Plan.from_manifest(before))

    @classmethod
    def continued(cls, folder: Path) -> "Store":
        """The store of a folder, to go on with what its manifest says.

        Raises:
            InvalidInput: versions or files are not those that it was begun with.
        """
        return cls.resume(folder, cls.open(folder).plan)

    @classmethod
    def begun(cls, folder: Path, plan: Plan) -> "Store":
        """The store of a plan that several processes begin at once: the first one makes it.

        Raises:
            InvalidInput, StorageError: as of :meth:`create` and :meth:`resume`.
        """
        if not folder.exists():
            try:
                return cls.create(folder, plan)
            except InvalidInput:
                if not (folder / MANIFEST).exists():  # else another one was first
                    raise
        return cls.resume(folder, plan)

    @contextmanager
    def locked(self, alone: bool = True) -> Iterator[None]:
        """Keep other processes of this machine from writing; ends with the process at the latest.

        What a killed process was just writing is removed, since nothing refers to it.

        Args:
            alone: False lets others write that are not alone either, each its own chunks; what is
                half-written may then be theirs, and stays.

        Raises:
            InvalidInput: another one is writing.
        """
        with (self.folder / MANIFEST).open(encoding="utf-8") as file:
            try:
                fcntl.flock(file, (fcntl.LOCK_EX if alone else fcntl.LOCK_SH) | fcntl.LOCK_NB)
            except BlockingIOError:
                raise InvalidInput(
                    "folder", str(self.folder), "another process is running this batch right now"
                ) from None
            if not alone:
                yield
                return
            self._tidy()
            try:
                yield
            finally:
                self._tidy()

    def _tidy(self) -> None:
        for leftover in (self.folder / RUNS).rglob("*.partial"):
            leftover.unlink(missing_ok=True)

    def check_files(self) -> list[str]:
        """Look whether the user's own files are as they were; returns versions that are not.

        Raises:
            InvalidInput: a file has changed, so that no run could be repeated.
        """
        before, now = _manifest(self.folder), self.plan.manifest()
        for name, _, _ in _differences(before["files"], now["files"]):
            raise InvalidInput(
                "files", name, f"it is not what it was when the batch in {self.folder} was run"
            )
        return [
            f"{name} was {was}, is {value}"
            for name, was, value in _differences(before["versions"], now["versions"])
        ]

    def statuses(self) -> NDArray[np.str_]:
        """(runs,) how each run ended; empty if it has not been run, or a part of it is lost.

        Raises:
            InvalidInput: the store is damaged.
        """
        found = read_statuses(self.folder, self.folder / RUNS)
        for chunk in lost_chunks(self.folder, self.folder / RUNS, found[:: self.plan.chunk] != ""):
            found[chunk * self.plan.chunk : (chunk + 1) * self.plan.chunk] = ""
        return found

    def missing(self) -> list[int]:
        """Chunks that are not there yet, or of which a part is lost."""
        first = self.statuses()[:: self.plan.chunk]
        return np.flatnonzero(first == "").tolist()

    def write(self, chunk: int, variables: Labelled) -> None:
        """Add a chunk; its runs are there when this returns, and otherwise not.

        Raises:
            StorageError: it cannot be written, as on a full disk.
        """
        import xarray

        first, runs = chunk * self.plan.chunk, len(variables["status"][1])
        region = {"run": slice(first, first + runs)}
        others: dict[str, Any] = {
            # what these runs do not have, not being begun or of another mode, is written as well
            name: variables[name][:2]
            if name in variables
            else (dimensions, np.full((runs, *shape[1:]), np.nan))
            for name, (dimensions, shape) in kept_of_runs(self.folder / RUNS).items()
            if name != "status"
        }
        status = {"status": variables["status"][:2]}
        try:
            with chunks.every_chunk():
                for part in (others, status):
                    xarray.Dataset(part).to_zarr(
                        self.folder / RUNS, region=region, zarr_format=2, consolidated=True
                    )
        except OSError as error:
            raise StorageError(
                f"{self.folder}: {error.strerror or error}; the runs stored so far are readable,"
                " and --resume goes on from there"
            ) from None

    def dataset(self) -> "xarray.Dataset":
        """All runs, read when they are used.

        Raises:
            InvalidInput: the store is damaged, or a part of it is lost.
        """
        import xarray

        path = self.folder / RUNS
        ran = read_statuses(self.folder, path)[:: self.plan.chunk] != ""
        for name in lost_chunks(self.folder, path, ran).values():
            raise broken(self.folder, f"{RUNS}/{name} is missing; {AGAIN.format(self.folder)}")
        found: xarray.Dataset = xarray.open_dataset(path, engine="zarr", chunks=None)
        return found


def _manifest(folder: Path) -> dict[str, Any]:
    path = folder / MANIFEST
    try:
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        form = found["format"]
    except (OSError, ValueError, KeyError, TypeError):
        raise InvalidInput(
            "folder", str(folder), f"it must be a folder that `batch` wrote, with a {MANIFEST}"
        ) from None
    if form != FORMAT:
        raise InvalidInput("folder", str(folder), f"its format is {form}, not {FORMAT} as here")
    return found


def _differences(
    before: Mapping[str, Any], now: Mapping[str, Any], path: str = ""
) -> Iterator[tuple[str, Any, Any]]:
    """Where two trees of plain data differ: key, value before, value now."""
    for key in dict.fromkeys([*before, *now]):
        was, value, name = before.get(key), now.get(key), f"{path}{key}"
        if isinstance(was, dict) and isinstance(value, dict):
            yield from _differences(was, value, f"{name}.")
        elif was != value:
            yield name, was, value


def _create_arrays(path: Path, plan: Plan) -> None:
    """The store's arrays and coordinates, with no run in it yet."""
    import zarr

    first, schema = _schema(plan)
    group = zarr.open_group(path, mode="w-", zarr_format=2)
    group.attrs.update(_attributes(plan, first))
    sizes = {"run": plan.runs}

    def add(
        name: str,
        dimensions: tuple[str, ...],
        values: NDArray[Any],
        attributes: Mapping[str, Any],
        fill: Any = None,
    ) -> Any:
        pieces = tuple(plan.chunk if d == "run" else sizes[d] for d in dimensions)
        return group.create_array(
            name,
            shape=tuple(sizes[d] for d in dimensions),
            chunks=tuple(max(length, 1) for length in pieces),
            dtype=values.dtype,
            compressors=chunks.compressor(),
            fill_value=fill,
            attributes={"_ARRAY_DIMENSIONS": list(dimensions), **attributes},
        )

    system = first.system
    assert system is not None
    span = span_of(first)
    coordinates: dict[str, Any] = {
        "run": ("run", np.arange(plan.runs), {"long_name": "number of the run"}),
        "start": ("run", np.arange(plan.runs) % plan.each, {"long_name": "number of the start"}),
        "seed": ("run", np.tile(plan.seeds, plan.combinations), {"long_name": "of the start"}),
        **{key: ("run", values, {}) for key, values in plan.labels().items()},
        **coordinates_of(system, times(first, span)[kept(span, max(plan.record, 1))]),
    }
    del coordinates["component"]
    if not plan.record:
        del coordinates["time"]
    for dimension, values, *_ in coordinates.values():
        sizes.setdefault(dimension, len(values))
    for name, (dimensions, like, attributes) in schema.items():
        for dimension, length in zip(dimensions[1:], like.shape[1:], strict=True):
            sizes.setdefault(dimension, length)
        fill = "" if like.dtype.kind == "U" else np.nan
        add(name, dimensions, like, attributes, fill)
    for name, (dimension, values, *rest) in coordinates.items():
        values = np.asarray(values)
        add(name, (dimension,), values, rest[0] if rest else {})[:] = values
    group.attrs["coordinates"] = " ".join(
        name for name, (dimension, *_) in coordinates.items() if name != dimension
    )
    zarr.consolidate_metadata(path, zarr_format=2)


def _attributes(plan: Plan, first: Combination) -> dict[str, Any]:
    system = first.system
    assert system is not None
    return {
        "system": plan.name,
        "game": system.game.name,
        "agent_name": system.game.agent_name,
        "engine": system.engine,
        "swept": [sweep.key for sweep in plan.sweeps],
        "manifest": json.dumps(plan.manifest()),
    }


def _schema(plan: Plan) -> tuple[Combination, Labelled]:
    """A combination that can run, and the variables that the combinations have, of one run each.

    Raises:
        InvalidInput: they differ in agents or constraints, which one dataset cannot hold.
    """
    first: Combination | None = None
    known: dict[Any, Labelled] = {}
    for number in range(plan.combinations):
        combination = plan.combination(number)
        system = combination.system
        if system is None:
            continue
        if first is None:
            first = combination
        _check_layout(first, combination)
        rows = [each for each in declared(system) if each.batch] if plan.record else []
        shown = [*declared_figures(system), *rows]
        with named(system=f"systems.{system.name}"):
            check_names(system, shown, ("run", "start", "seed", *plan.labels()))
        kind = (len(system.loop_memory), *((each.name, each.dims(system)) for each in shown))
        if kind not in known:
            known[kind] = _one_run(combination, plan.record)
    if first is None:
        raise plan.nowhere_inside()
    shapes: dict[str, Any] = {}
    for variables in known.values():
        for name, (dimensions, like, _) in variables.items():
            if shapes.setdefault(name, (dimensions, like.shape)) != (dimensions, like.shape):
                raise InvalidInput(
                    "plan.sweeps",
                    ", ".join(sweep.key for sweep in plan.sweeps),
                    f"'{name}' must have the same shape in all combinations",
                )
    return first, join(list(known.values())) | (unchecked(1) if plan.check_in_mujoco else {})


def _check_layout(first: Combination, other: Combination) -> None:
    one, two = first.system, other.system
    assert one is not None
    assert two is not None
    for what, here, there in (
        ("agents", one.game.sizes, two.game.sizes),
        ("constraints", one.game.constraint_names, two.game.constraint_names),
        ("duration", first.clock.duration, other.clock.duration),
        ("recording period", first.clock.sample_period, other.clock.sample_period),
        ("seed", first.scenario.simulation.seed, other.scenario.simulation.seed),
    ):
        if here != there:
            raise InvalidInput(
                "plan.sweeps",
                ", ".join(other.changes),
                f"all combinations must have the same {what}",
            )


def _one_run(combination: Combination, record: int) -> Labelled:
    """What one run of a combination would have, nothing of it being a number."""
    system, span = combination.system, span_of(combination)
    assert system is not None
    m = system.game.actions
    rows = Recorder(
        1, span.rows, (m, system.agents.states), len(system.loop_memory), bool(system.faults)
    )
    monitor = watch.fresh(m, system.game.constraints_count, 1)
    return columns_of(combination, span, Outcome(rows.all(), monitor), record)
