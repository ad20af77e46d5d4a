"""Sweeps in chunks: each a task of its own, kept in memory or in a Zarr store that a killed run goes on from.

In a store one chunk of every variable is one task, and `done` says which are finished, by a checksum of their results; it is
written after them. What is damaged is computed again. Chunks do not know of each other, so a run that was killed and started
again ends with the same bytes.
"""

from __future__ import annotations

import asyncio
import contextlib
import functools
import json
import math
import os
import warnings
import zlib
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stickslip import _core
from stickslip.dynamics.sweep import COUNTS, MEANINGS, NUMBERS, WORDS, Chunk, Look, Start
from stickslip.errors import InputError, UnfinishedWarning, fits, whole_number
from stickslip.files.arrays import AnyArray
from stickslip.files.disk import draft_of
from stickslip.files.progress import waiting
from stickslip.model.parameters import is_dimensionless
from stickslip.model.system import Oscillator, System
from stickslip.simulation.time_limit import TimeLimit

if TYPE_CHECKING:
    import xarray as xr

Report = Callable[[int, int], Any]
Progress = Report | None
_METADATA = "zarr.json"
#: What a checksum of finished results is greater by, so that it is not 0.
_DONE = 1 << 32
#: How long a Dask scheduler may take to answer.
PATIENCE = "10s"


@dataclass(frozen=True)
class Variable:
    """A variable of the result: its dimensions, the type of its numbers and what it means."""

    dims: tuple[str, ...]
    dtype: Any
    attrs: Mapping[str, Any] = field(default_factory=dict)

    def fill(self) -> Any:
        """What stands where nothing is computed yet."""
        return "" if self.dtype is str else np.dtype(self.dtype).type(np.nan if np.dtype(self.dtype).kind == "f" else 0)


@dataclass(frozen=True)
class Plan:
    """What is to be computed: variables over dimensions, parted into chunks.

    Attributes
    ----------
    name : of the command, for messages.
    coords : the values of each dimension that has some, with attributes.
    sizes : the size of every dimension.
    chunks : the size of a chunk along the dimensions that are parted.
    variables : by name.
    task : the work of the chunk at a place; it may look at the arrays of results for where its predecessor ended.
    before : the predecessor of a place, where one must wait for another.
    finish : what follows from all chunks together: further variables, from the arrays of results.
    attrs : of the result; `request` among them is what must agree where a store is gone on with.
    """

    name: str
    coords: Mapping[str, tuple[AnyArray, Mapping[str, Any]]]
    sizes: Mapping[str, int]
    chunks: Mapping[str, int]
    variables: Mapping[str, Variable]
    task: Callable[[tuple[int, ...], Mapping[str, Any]], Chunk]
    before: Callable[[tuple[int, ...]], tuple[int, ...] | None]
    attrs: Mapping[str, Any]
    finish: Callable[[Plan, Mapping[str, Any]], Mapping[str, tuple[tuple[str, ...], AnyArray]]] | None = None

    @property
    def counts(self) -> tuple[int, ...]:
        """How many chunks there are along each dimension that is parted."""
        return tuple(-(-self.sizes[dim] // size) for dim, size in self.chunks.items())

    def position(self, index: int) -> tuple[int, ...]:
        """The place of a chunk among the others."""
        return tuple(int(i) for i in np.unravel_index(index, self.counts))

    def region(self, position: tuple[int, ...]) -> tuple[slice, ...]:
        """The part of the dimensions that are parted that belongs to a chunk."""
        bounds = zip(position, self.chunks.items(), strict=True)
        return tuple(slice(i * size, min((i + 1) * size, self.sizes[dim])) for i, (dim, size) in bounds)


def motion_variables(dims: tuple[str, ...]) -> dict[str, Variable]:
    """What is said of each steady motion: numbers, counts and words, by name."""
    kinds = ((NUMBERS, float), (COUNTS, np.int64), (WORDS, str))
    return {name: Variable(dims, kind, {"long_name": MEANINGS[name]}) for names, kind in kinds for name in names}


def compute(
    plan: Plan,
    *,
    store: str | Path | None,
    workers: int | None,
    cluster: str | None,
    progress: Progress,
    max_seconds: float | None = None,
) -> xr.Dataset:
    """Compute what is not there yet and return all of it.

    Parameters
    ----------
    plan : what.
    store : folder of a Zarr store that is made or gone on with; default memory.
    workers : threads of this machine; default all cores.
    cluster : address of a Dask scheduler whose workers compute instead.
    progress : called as ``progress(done, n)`` with runs; default a line for a person who waits.
    max_seconds : time on the clock after which all runs that are not done end where they are.

    Raises
    ------
    InputError
        for a store of something else, one that cannot be written to, or a cluster that does not answer; what is finished
        stays in the store.
    """
    if workers is not None:
        whole_number("workers", workers, plan.name)
    limit = TimeLimit.after(max_seconds, plan.name)
    # A store is filled chunk by chunk.
    sizes = plan.sizes if store is None else {**plan.sizes, **plan.chunks}
    shapes = [[sizes[dim] for dim in variable.dims] for variable in plan.variables.values()]
    fits(sum(map(math.prod, shapes)), plan.name, "lower points or take fewer values")
    sink = Memory(plan) if store is None else Store(plan, Path(store))
    with _executor(plan.name, workers, cluster) as (executor, width):
        _work(plan, sink, executor, width, waiting(progress, plan.name), limit)
    if plan.finish is not None:
        sink.add(plan.finish(plan, sink.arrays))
    if max_seconds is not None:
        _warn(plan.name, np.asarray(sink.arrays["stop"]) == "max_seconds", store is not None)
    return sink.dataset()


def _warn(name: str, ended: NDArray[np.bool_], kept: bool) -> None:
    """Say how many runs have no result."""
    if ended.any():
        more = "call it again with the same store to go on" if kept else "raise max_seconds for the others"
        sentence = f"{name}: {int(ended.sum())} of {ended.size} runs ended after max_seconds and are unfinished; {more}"
        # At the line that called the function of that name.
        warnings.warn(sentence, UnfinishedWarning, stacklevel=4)


@contextlib.contextmanager
def _executor(name: str, workers: int | None, cluster: str | None) -> Iterator[tuple[Executor, int]]:
    """What runs the tasks, and how many it should have in hand."""
    if cluster is None:
        count = workers or os.cpu_count() or 1
        halt = _core.Halt()
        executor: Executor = ThreadPoolExecutor(count, initializer=halt.heed)
        try:
            yield executor, 2 * count
        finally:
            # After an error or Ctrl-C nobody waits for what still runs.
            halt.set()
            executor.shutdown(wait=False, cancel_futures=True)
        return
    try:
        from distributed import Client

        connect: Any = Client
    except ImportError:
        raise InputError(f"{name}: a cluster needs Dask; install it with: pip install 'stickslip[cluster]'") from None
    try:
        # In a loop of its own: where this one runs already, as in a notebook, another cannot be started.
        with ThreadPoolExecutor(1) as probe:
            probe.submit(asyncio.run, _greeted(cluster)).result()
        client = connect(cluster, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(
            f"{name}: no Dask scheduler answers at {cluster!r} ({reason}); start one with `dask scheduler`, or leave the "
            "cluster out to use the cores of this machine"
        ) from None
    with client:
        threads = sum(client.nthreads().values())
        if threads == 0:
            raise InputError(
                f"{name}: the Dask cluster at {cluster} has no workers; start some with `dask worker {cluster}`"
            )
        yield client.get_executor(pure=False, retries=2), 2 * threads


async def _greeted(cluster: str) -> None:
    """Wait for the first word of a scheduler: the client waits for ever where something listens and says nothing."""
    from dask.utils import parse_timedelta
    from distributed.comm.core import connect

    greet: Any = connect
    async with asyncio.timeout(parse_timedelta(PATIENCE)):
        comm = await greet(cluster, timeout=PATIENCE)
    await comm.close()


def _work(plan: Plan, sink: Memory, executor: Executor, width: int, progress: Report, limit: TimeLimit) -> None:
    """Hand out tasks, no more than `width` at once, and keep their results as they come."""
    done = sink.done()
    runs = int(np.prod([plan.sizes[dim] for dim in plan.chunks]))
    finished: int = sum(_size(plan.region(plan.position(index))) for index in np.flatnonzero(done).tolist())
    if finished:
        progress(finished, runs)
    followers: dict[int, int] = {}
    ready: deque[int] = deque()
    for index in np.flatnonzero(~done).tolist():
        before = plan.before(plan.position(index))
        previous = None if before is None else int(np.ravel_multi_index(before, plan.counts))
        if previous is None or done[previous]:
            ready.append(index)
        else:
            followers[previous] = index
    running: dict[Future[Any], int] = {}
    try:
        while ready or running:
            while ready and len(running) < width:
                index = ready.popleft()
                task = replace(plan.task(plan.position(index), sink.arrays), limit=limit)
                running[executor.submit(task.compute)] = index
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                index = running.pop(future)
                sink.write(index, _result(plan, future))
                if index in followers:
                    ready.append(followers.pop(index))
                finished += _size(plan.region(plan.position(index)))
                progress(finished, runs)
    finally:
        for future in running:
            future.cancel()


def _result(plan: Plan, future: Future[Any]) -> dict[str, AnyArray]:
    try:
        result: dict[str, AnyArray] = future.result()
    except InputError as error:
        raise InputError(f"{plan.name}: {error}") from None
    except (ImportError, OSError, RuntimeError) as error:
        # What Dask says when workers die again and again, or know nothing of this package.
        raise InputError(
            f"{plan.name}: a worker could not compute its part ({type(error).__name__}: {error}); what is finished is kept: "
            "mend the cluster and run the same again"
        ) from None
    return result


def _size(region: tuple[slice, ...]) -> int:
    return int(np.prod([part.stop - part.start for part in region]))


class Memory:
    """Results in memory."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.more: Mapping[str, Any] = {}
        self.arrays: Any = {
            name: np.full(self._shape(variable), variable.fill(), "<U16" if variable.dtype is str else variable.dtype)
            for name, variable in plan.variables.items()
        }

    def _shape(self, variable: Variable) -> tuple[int, ...]:
        return tuple(self.plan.sizes[dim] for dim in variable.dims)

    def done(self) -> NDArray[np.bool_]:
        """Which chunks are finished."""
        return np.zeros(int(np.prod(self.plan.counts)), bool)

    def write(self, index: int, rows: Mapping[str, AnyArray]) -> None:
        """Keep the rows of a chunk."""
        region = self.plan.region(self.plan.position(index))
        shape = tuple(part.stop - part.start for part in region)
        for name, array in self.arrays.items():
            array[region] = rows[name].reshape(*shape, *rows[name].shape[1:])

    def add(self, variables: Mapping[str, tuple[tuple[str, ...], AnyArray]]) -> None:
        """Keep what follows from all chunks together."""
        self.more = variables

    def dataset(self) -> xr.Dataset:
        """All of it."""
        import xarray as xr

        data = {name: (item.dims, self.arrays[name], item.attrs) for name, item in self.plan.variables.items()}
        coords = {name: (name, values, attrs) for name, (values, attrs) in self.plan.coords.items()}
        return xr.Dataset(data | dict(self.more), coords=coords, attrs=self.plan.attrs)


class Store(Memory):
    """Results in a Zarr store, made whole with its coordinates and then filled chunk by chunk."""

    def __init__(self, plan: Plan, path: Path) -> None:
        import zarr

        self.plan, self.path = plan, path.resolve()
        if not self.path.parent.is_dir():
            raise InputError(f"{self.path}: the folder {self.path.parent} does not exist; make it first")
        with self._refusing():
            if self.path.exists() and not self.path.is_dir():
                self._not_ours()
            with draft_of(self.path) as draft:
                self._lay_out(draft)
                if self.path.exists():
                    self._mend(draft)
                else:
                    draft.rename(self.path)
            self.group = zarr.open_group(self.path, mode="r+", use_consolidated=False)
            self.arrays = {name: self.group[name] for name in plan.variables}
            self._said: Any = self.group["done"]
            self._sums = self._verified()

    @contextlib.contextmanager
    def _refusing(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            kept = np.count_nonzero(self._sums) if hasattr(self, "_sums") else 0
            finished = f"; {kept} of {self._sums.size} parts are finished and kept, run the same again" if kept else ""
            reason = error.strerror or str(error)
            raise InputError(
                f"{self.path}: cannot be written ({reason}); make room or choose another place{finished}"
            ) from None

    def _lay_out(self, draft: Path) -> None:
        """A store with everything that says what it is, and nothing computed: only so does one appear under its name."""
        import zarr
        from zarr.codecs import ZstdCodec

        plan = self.plan
        packed: dict[str, Any] = {"compressors": ZstdCodec(checksum=True)}
        group = zarr.create_group(store=draft, attributes=dict(plan.attrs))
        for name, (values, attrs) in plan.coords.items():
            kind = str if values.dtype.kind == "U" else values.dtype
            array = group.create_array(
                name,
                shape=values.shape,
                dtype=kind,
                chunks=values.shape,
                dimension_names=(name,),
                attributes=dict(attrs),
                **packed,
            )
            array[:] = values
        for name, variable in plan.variables.items():
            group.create_array(
                name,
                shape=self._shape(variable),
                chunks=tuple(plan.chunks.get(dim, plan.sizes[dim]) for dim in variable.dims),
                dtype=variable.dtype,
                fill_value=variable.fill(),
                dimension_names=variable.dims,
                attributes=dict(variable.attrs),
                **packed,
            )
        count = int(np.prod(plan.counts))
        meaning: dict[str, Any] = {"long_name": "checksum of the results of each part; 0 where they are not computed"}
        group.create_array(
            "done", shape=(count,), chunks=(count,), dtype="u8", dimension_names=("part",), attributes=meaning, **packed
        )
        _consolidate(draft)

    def _mend(self, draft: Path) -> None:
        """Put back what says what the store is, where it is not as it was laid out; the results are looked at apart."""
        wanted = json.loads((draft / _METADATA).read_text(encoding="utf-8"))
        try:
            there = json.loads((self.path / _METADATA).read_text(encoding="utf-8"))
            attributes = dict(there["attributes"])
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            self._not_ours()
        self._check(attributes)
        if {**there, "consolidated_metadata": None} != {**wanted, "consolidated_metadata": None}:
            (draft / _METADATA).replace(self.path / _METADATA)
        for file in draft.glob("*/**/*"):
            position = self.path / file.relative_to(draft)
            if file.is_file() and not (position.is_file() and position.read_bytes() == file.read_bytes()):
                position.parent.mkdir(parents=True, exist_ok=True)
                file.replace(position)

    def _verified(self) -> NDArray[np.uint64]:
        """The checksums of the parts that are as they were written; 0 for all others, which are computed again."""
        try:
            sums = np.array(self._said, np.uint64)
        except Exception:  # noqa: BLE001 damaged, which the layers of Zarr say in many ways
            return np.zeros(self._said.shape, np.uint64)
        checks = dict.fromkeys(np.flatnonzero(sums).tolist(), 0)
        for _, array in sorted(self.arrays.items()):
            try:
                values: Any = np.asarray(array[...])
            except Exception:  # noqa: BLE001 as above: then part by part
                values = array
            for index, check in list(checks.items()):
                try:
                    checks[index] = _checksum(values[self.plan.region(self.plan.position(index))], check)
                except Exception:  # noqa: BLE001 as above
                    del checks[index]
        return np.array(
            [said if checks.get(index) == said - _DONE else 0 for index, said in enumerate(sums.tolist())], np.uint64
        )

    def _not_ours(self) -> None:
        raise InputError(
            f"{self.path}: holds something else than a sweep of stickslip, or a damaged one; choose another name or "
            "remove it"
        ) from None

    def _check(self, attrs: Mapping[str, Any]) -> None:
        """Refuse to go on with a store of another question."""
        if "request" not in attrs:
            self._not_ours()
        there, asked = json.loads(str(attrs["request"])), json.loads(str(self.plan.attrs["request"]))
        differ = [name for name in sorted({*there, *asked}) if there.get(name) != asked.get(name)]
        if differ:
            name = differ[0]
            raise InputError(
                f"{self.path}: holds the answer to another question: {name} is {_short(there.get(name))} there, "
                f"{_short(asked.get(name))} was asked; choose another name, or remove it"
            )

    def done(self) -> NDArray[np.bool_]:
        """Which chunks are finished."""
        return np.asarray(self._sums != 0)

    def write(self, index: int, rows: Mapping[str, AnyArray]) -> None:
        """Keep the rows of a chunk, then say so; what ran out of time is computed again."""
        with self._refusing():
            super().write(index, rows)
            if (rows["stop"] == "max_seconds").any():
                return
            sums = self._sums.copy()
            sums[index] = (
                functools.reduce(lambda check, name: _checksum(rows[name], check), sorted(self.arrays), 0) + _DONE
            )
            self._said[:] = sums
            self._sums = sums

    def add(self, variables: Mapping[str, tuple[tuple[str, ...], AnyArray]]) -> None:
        """Keep what follows from all chunks together."""
        with self._refusing():
            for name, (dims, values) in variables.items():
                sizes = zip(dims, values.shape, strict=True)
                array = self.group.create_array(
                    name,
                    shape=values.shape,
                    dtype=str if values.dtype.kind == "U" else values.dtype,
                    chunks=tuple(self.plan.chunks.get(dim, max(1, size)) for dim, size in sizes),
                    dimension_names=dims,
                    overwrite=True,
                )
                array[...] = values

    def dataset(self) -> xr.Dataset:
        """All of it, read when it is asked for."""
        import xarray as xr

        with self._refusing():
            _consolidate(self.path)
        stored: xr.Dataset = xr.open_zarr(self.path, chunks=None)
        return stored.drop_vars("done")


def _consolidate(path: Path) -> None:
    """Write the metadata of all arrays in one place: xarray warns where it is missing, Zarr where it is."""
    import zarr

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        zarr.consolidate_metadata(path)


def _checksum(values: AnyArray, before: int) -> int:
    """Of numbers or words, whatever their shape and however they are kept, and of what came before."""
    values = np.asarray(values)
    if values.dtype.kind == "f":
        values = np.where(np.isnan(values), np.nan, values)  # of the many NaN one
    elif values.dtype.kind not in "iub":
        values = values.astype("<U16")
    return zlib.crc32(np.ascontiguousarray(values).tobytes(), before)


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def words_for(document: Mapping[str, Any]) -> str:
    """What must agree between runs that go on with each other, as text."""
    return json.dumps({"stickslip": _core.__version__, **document}, sort_keys=True)


def provenance(
    command: str,
    system: Oscillator | System,
    varied: Iterable[str],
    look: Look,
    start: Start,
    settings: Mapping[str, Any],
    **asked: Any,
) -> dict[str, Any]:
    """Attributes of a result: what moved, what was asked for, and the request by which an interrupted run is known again."""
    request = {
        "command": command,
        "system": system.to_dict(),
        "section": look.surface and look.surface.to_dict(),
        "start": start and [np.asarray(item).tolist() for item in start],
        **asked,
        **settings,
    }
    return {
        "title": f"stickslip {command.replace('_', ' ')}",
        "units": "dimensionless" if is_dimensionless(system, varied) else "SI",
        "system": json.dumps(system.to_dict()),
        "request": words_for(request),
        **settings,
    }


def fingerprint(values: AnyArray) -> str:
    """The values of an axis in a few words that differ where a bit does.

    >>> fingerprint(np.array([0.0, 1.0]))
    '2 values from 0 to 1 (4e6187d5)'
    """
    data = np.ascontiguousarray(values, "<f8")
    return f"{data.size} values from {data[0]:g} to {data[-1]:g} ({zlib.crc32(data.tobytes()):08x})"
