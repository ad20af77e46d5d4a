"""Sweeps in Zarr stores: killed, interrupted, out of room, elsewhere; nothing finished is lost and no byte differs."""

import errno
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import zarr
from evidence import script

import stickslip as ss
from stickslip.dynamics import tasks

damaged = script("stores")

FORCED = ss.Oscillator(
    damping=0.05, drive_velocity=0.3, law=ss.laws.StaticKinetic(1.0, 0.5), forcing=ss.Harmonic(0.5, 0.7)
)
OVER = {"forcing.amplitude": np.linspace(0.1, 1.0, 75), "forcing.frequency": np.linspace(0.5, 1.5, 100)}
SHORT = {"transient": 4, "window": 4}


def chart(path, **options):
    return ss.regime_map(FORCED, OVER, store=path, **SHORT, **options)


def contents(path):
    return {str(file.relative_to(path)): file.read_bytes() for file in sorted(path.rglob("*")) if file.is_file()}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    path = tmp_path_factory.mktemp("store") / "undisturbed.zarr"
    chart(path, workers=1)
    return contents(path)


@pytest.mark.slow
def test_a_killed_run_goes_on_to_the_same_bytes(tmp_path, undisturbed):
    path = tmp_path / "map.zarr"
    program = f"import pathlib, sys, time\nsys.path.insert(0, {str(Path(__file__).parent)!r})\n"
    program += "import test_dynamics_tasks as t\n"
    slow = "workers=1, progress=lambda done, n: time.sleep(0.2)"
    program += f"t.chart(pathlib.Path({str(path)!r}), {slow})"
    child = subprocess.Popen([sys.executable, "-c", program])
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and not (
        path.exists() and np.count_nonzero(zarr.open_group(path, mode="r")["done"][:]) >= 2
    ):
        time.sleep(0.02)
    child.send_signal(signal.SIGKILL)
    assert child.wait() == -signal.SIGKILL
    half = zarr.open_group(path, mode="r")["done"][:] != 0
    assert 2 <= half.sum() < half.size
    told = []
    chart(path, progress=lambda done, n: told.append((done, n)))
    assert told[0][0] >= 2 * 2500
    assert told[-1] == (7500, 7500)
    assert contents(path) == undisturbed


def test_an_interrupted_run_keeps_what_is_finished(tmp_path, undisturbed):
    def interrupt(*_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        chart(tmp_path / "map.zarr", progress=interrupt)
    assert np.count_nonzero(zarr.open_group(tmp_path / "map.zarr", mode="r")["done"][:]) == 1
    chart(tmp_path / "map.zarr", workers=2)
    assert contents(tmp_path / "map.zarr") == undisturbed


@pytest.mark.slow
def test_a_full_disk_is_one_sentence_and_loses_nothing(tmp_path, undisturbed, monkeypatch):
    written, put = [], zarr.storage._local._put

    def full(path, value, exclusive=False):
        written.append(path)
        if len(written) > 90:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return put(path, value, exclusive)

    with monkeypatch.context() as patch:
        patch.setattr(zarr.storage._local, "_put", full)
        with pytest.raises(ss.InputError, match=r"No space left on device.*parts are finished and kept"):
            chart(tmp_path / "map.zarr")
    chart(tmp_path / "map.zarr")
    assert contents(tmp_path / "map.zarr") == undisturbed


def test_a_store_is_the_same_as_memory_and_opens_anywhere(tmp_path):
    stored, held = chart(tmp_path / "map.zarr"), chart(None, workers=2)
    for name in held:
        np.testing.assert_array_equal(stored[name].to_numpy().astype(held[name].dtype), held[name].to_numpy(), name)
    with xr.open_zarr(tmp_path / "map.zarr", chunks=None) as opened:
        assert opened.attrs["title"] == "stickslip regime map"
        assert bool(opened["done"].all())


def test_a_store_of_another_question_is_refused(tmp_path, undisturbed):
    path = tmp_path / "map.zarr"
    chart(path)
    other = ss.Oscillator(damping=0.06, drive_velocity=0.3, law=FORCED.law, forcing=FORCED.forcing)
    for system, over, differs in (
        (other, OVER, "system is"),
        (FORCED, OVER | {"forcing.amplitude": OVER["forcing.amplitude"] + 1e-15}, "forcing.amplitude is"),
        (FORCED, {"drive_velocity": [0.1]}, "drive_velocity is null there"),
    ):
        with pytest.raises(ss.InputError, match=f"another question: {differs}") as refusal:
            ss.regime_map(system, over, store=path, **SHORT)
        assert "\n" not in str(refusal.value)
    assert contents(path) == undisturbed


def test_a_place_that_cannot_hold_a_store_is_refused(tmp_path):
    file = tmp_path / "file"
    file.write_text("mine")
    (tmp_path / "folder").mkdir()
    for path, sentence in (
        (file, "holds something else"),
        (tmp_path / "folder", "holds something else"),
        (file / "map.zarr", "does not exist|cannot be written"),
        (tmp_path / "none" / "map.zarr", "does not exist; make it first"),
    ):
        with pytest.raises(ss.InputError, match=sentence) as refusal:
            chart(path)
        assert "\n" not in str(refusal.value)
    assert file.read_text() == "mine"
    assert sorted(item.name for item in tmp_path.iterdir()) == ["file", "folder"]


@pytest.mark.long
def test_swept_diagrams_go_on_where_they_were_killed(tmp_path):
    def diagram(path, **options):
        values = np.linspace(0.05, 0.6, 200)
        return ss.orbit_diagram(
            FORCED, "drive_velocity", values, direction=("up", "down"), periods=24, store=path, **options
        )

    def interrupt(done, _):
        if done > 200:
            raise KeyboardInterrupt

    diagram(tmp_path / "whole.zarr", workers=1)
    with pytest.raises(KeyboardInterrupt):
        diagram(tmp_path / "parts.zarr", progress=interrupt)
    diagram(tmp_path / "parts.zarr")
    assert contents(tmp_path / "parts.zarr") == contents(tmp_path / "whole.zarr")


def test_a_cluster_that_does_not_answer_is_one_sentence(tmp_path, monkeypatch):
    monkeypatch.setattr(tasks, "PATIENCE", "300ms")
    with socket.create_server(("127.0.0.1", 0)) as silent:
        for address in ("tcp://127.0.0.1:9", "nonsense://here", f"tcp://127.0.0.1:{silent.getsockname()[1]}"):
            with pytest.raises(ss.InputError, match=r"no Dask scheduler answers at .*; start one with") as refusal:
                chart(tmp_path / "map.zarr", cluster=address)
            assert "\n" not in str(refusal.value)


@pytest.mark.slow
def test_a_worker_that_is_killed_in_the_middle_changes_no_byte(tmp_path, undisturbed):
    from distributed import LocalCluster

    killed = []
    with LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    ) as cluster:
        workers = [worker.pid for worker in cluster.workers.values()]

        def kill(done, _):
            if not killed:
                os.kill(workers[0], signal.SIGKILL)
                killed.append(done)

        chart(tmp_path / "map.zarr", cluster=cluster.scheduler_address, progress=kill)
    assert killed
    assert killed[0] < 7500
    assert contents(tmp_path / "map.zarr") == undisturbed


@pytest.mark.slow
def test_a_damaged_store_is_repaired_or_refused_and_never_different(tmp_path):
    counts, wrong = damaged.outcomes(tmp_path, range(12), 1)
    assert wrong == []
    assert sum(counts[kind, "repaired"] for kind in damaged.DAMAGES) > 9


def test_a_store_that_is_another_one_counts_as_different(tmp_path, monkeypatch):
    whole = damaged.regime_map(tmp_path / "whole.zarr").load()
    monkeypatch.setattr(damaged, "regime_map", lambda path: whole if path.name == "whole.zarr" else whole * 2)
    _, wrong = damaged.outcomes(tmp_path, range(2), 1)
    assert len(wrong) == 2


@pytest.mark.slow
def test_a_store_that_was_killed_before_it_had_its_name_leaves_nothing(tmp_path):
    program = f"import pathlib, sys, os, signal\nsys.path.insert(0, {str(Path(__file__).parent)!r})\n"
    program += (
        "import test_dynamics_tasks as t\nt.tasks._consolidate = lambda draft: os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    program += f"t.damaged.regime_map(pathlib.Path({str(tmp_path / 'map.zarr')!r}))"
    subprocess.run([sys.executable, "-c", program], check=False)
    (left,) = tmp_path.iterdir()
    assert left.name.endswith(".part")
    damaged.regime_map(tmp_path / "map.zarr")
    assert [path.name for path in tmp_path.iterdir()] == ["map.zarr"]
