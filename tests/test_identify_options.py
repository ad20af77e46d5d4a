"""Every option of ``stickslip identify`` is used or refused: all options on all ways through the command."""

import argparse
import functools
import html
import importlib
import inspect
import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from threadpoolctl import threadpool_info, threadpool_limits

import stickslip as ss
from stickslip.cli import identify as command
from stickslip.cli.main import main
from stickslip.errors import InputError
from stickslip.identification import friction_of_orbit, identify, records
from stickslip.identification.fit_options import Options
from stickslip.laws.numbers import pointers, value
from stickslip.measurement import measure

ROWS = np.linspace(1.0, 9.0, 9)
VALUES = {
    "law": ["RateState"], "free": ["kinetic"], "fixed": ["kinetic=1"], "bounds": ["kinetic=0:1"], "pieces": ["2"],
    "ties": ["kinetic=limit"], "duration": ["5"],
    "shooting": ["records"], "starts": ["1"], "zero_error": ["0.1"], "scale_error": ["0.1"], "compare": [],
    "predict": ["not-there.nc"], "output": ["law.toml"], "plot": ["law.png"], "report": ["law.html"], "table": ["law.csv"],
}  # fmt: skip
"""What follows an option; flags are followed by nothing."""


def options():
    parser = argparse.ArgumentParser()
    command.add(parser.add_subparsers())
    (identify,) = parser._subparsers._group_actions[0].choices.values()
    return {action.dest: action for action in identify._actions if action.dest not in ("help", "friction")}


def flags(name):
    action = options()[name]
    return [action.option_strings[-1], *(VALUES[name] if action.nargs != 0 else [])]


def steps(count):
    """Friction coefficient over steps of the speed between two values, as measured with a rig."""
    time = np.arange(0, 20.0 * (count + 1), 0.05)
    speed = 1e-6 * np.where((time // 20) % 2 == 0, 1.0, 3.0)
    friction = 0.6 + 0.001 * np.log(speed / 1e-6) + 1e-4 * np.random.default_rng(1).standard_normal(time.size)
    rig = {
        "instrument": "velocity_steps",
        "columns": {"time": "t", "displacement": "x", "force": {"column": "f", "unit": "1"}},
    }
    return measure({"t": time, "x": np.cumsum(speed) * 0.05, "f": friction}, rig)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A friction file for each way through the command, and the options that choose that way."""
    folder = tmp_path_factory.mktemp("friction")
    law = ss.laws.StaticKinetic(break_away=1.0, kinetic=0.6)
    orbit = ss.simulate(ss.Oscillator(damping=0.1, drive_velocity=0.2, law=law), 60.0)
    motion = friction_of_orbit(orbit, np.arange(0, 60.0, 0.1), 0.01, seed=1)
    events = {
        "t": ROWS,
        "stick_time": ROWS,
        "force_rate": 1 / ROWS,
        "force": 1 + 0.1 * np.log(ROWS),
        "drop": 0.1 * ROWS,
    }
    table = {"slip_velocity": ROWS, "force": 1 + 0.1 * ROWS, "force_error": 0.01 * np.ones(9)}
    trees = {
        "motion": motion,
        "curve": xr.DataTree.from_dict({"/steady": xr.Dataset({k: ("row", v) for k, v in table.items()})}),
        "static": xr.DataTree.from_dict({"/break_away": xr.Dataset({k: ("event", v) for k, v in events.items()})}),
        "step": steps(1),
        "steps": steps(5),
    }
    for name, tree in trees.items():
        tree.to_netcdf(folder / f"{name}.nc", engine="h5netcdf")
    return {
        "laws": (folder / "motion.nc", ["--compare"]),
        "branches": (folder / "motion.nc", []),
        "trajectories": (folder / "motion.nc", ["--trajectories"]),
        "curve": (folder / "curve.nc", []),
        "static": (folder / "static.nc", []),
        "step": (folder / "step.nc", []),
        "steps": (folder / "steps.nc", ["--law", "RateState"]),
    }


LONGER = {"step", "steps", "trajectories"}


@pytest.mark.parametrize(
    "path", [pytest.param(path, marks=[pytest.mark.slow] if path in LONGER else []) for path in command.PATHS]
)
def test_every_option_is_used_or_refused_on_every_path(path, files, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    name, chosen_by = files[path]
    monkeypatch.setattr(records, "opened", functools.cache(records.opened))
    taken = []

    def note(found, **used):
        taken.append(used)
        return found

    # in place of the work, steps that say which options they were given
    for one, way in command.PATHS.items():
        quiet = []
        for step in way.steps:
            fake = lambda found, _note=note, **used: _note(found, **used)  # noqa: E731
            fake.__signature__ = inspect.signature(step)
            quiet.append(fake)
        monkeypatch.setitem(command.PATHS, one, replace(way, steps=tuple(quiet)))
    way = command.PATHS[path]
    for option in options():
        if option in ("compare", "trajectories", "steady") or any(flag in chosen_by for flag in flags(option)):
            continue
        taken.clear()
        done = main(["identify", str(name), *chosen_by, *flags(option)])
        said = capsys.readouterr().err
        if option in way.options and option not in way.chosen_by:
            assert (done, said) == (0, "")
            assert any(option in used for used in taken)
        elif done == 2:
            assert said.count("\n") == 1
            assert f"{flags(option)[0]} " in said
            assert not taken
        else:  # --law leads elsewhere, and is used there
            assert option == "law"
    assert not list(tmp_path.iterdir())


def test_no_option_is_unknown_to_all_paths():
    used = frozenset().union(*(path.options for path in command.PATHS.values()))
    assert used == set(options())


@pytest.mark.parametrize(
    ("path", "asked", "words"),
    [
        (
            "curve",
            ["--predict", "not-there.nc"],
            "--predict does not go with the fit of friction over slip velocity alone",
        ),
        ("curve", ["--trajectories"], "or name a law of the motion with --law"),
        ("static", ["--steady"], "holds no friction over slip velocity"),
        (
            "static",
            ["--table", "r.csv"],
            "--table does not go with the fit of static friction to tables of break-aways",
        ),
        ("steps", ["--offset"], "--offset does not go with the fit of rate-and-state friction to steps of the speed"),
        ("laws", ["--free", "kinetic"], "--free does not go with --compare: compare first"),
        (
            "branches",
            ["--starts", "8"],
            "--starts belongs to --trajectories: add --trajectories, or leave --starts out",
        ),
        ("branches", ["--law", "Coulomb", "--pieces", "2"], "Coulomb has no linear pieces to count: leave pieces out"),
    ],
)
def test_what_is_not_used_is_refused_with_what_to_do(path, asked, words, files, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    name, chosen_by = files[path]
    assert main(["identify", str(name), *chosen_by, *asked]) == 2
    assert words in capsys.readouterr().err


def test_a_command_without_a_simulation_serves_records_of_all_kinds(files, capsys):
    assert main(["identify", str(files["curve"][0])]) == 0
    plain = capsys.readouterr()
    assert main(["identify", str(files["curve"][0]), "--no-simulation"]) == 0
    assert capsys.readouterr() == plain


@pytest.mark.parametrize(
    "path", ["curve", pytest.param("static", marks=pytest.mark.slow), pytest.param("step", marks=pytest.mark.slow)]
)
def test_a_fit_to_tables_has_a_page_too(path, files, tmp_path):
    name, chosen_by = files[path]
    assert main(["identify", str(name), *chosen_by, "--report", str(tmp_path / "page.html")]) == 0
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    found = ss.identify(str(name))
    assert page.count("data:image/png;base64,") == 1
    assert all(f"<th>{number}</th>" in page for number in found.estimates().index)
    assert all(html.escape(note)[:60] in page for note in found.notes)


@pytest.mark.slow
def test_the_parts_of_a_combined_law_are_named(tmp_path, capsys):
    law = ss.laws.Combined(ss.laws.LogarithmicDwell(1.0, 0.08, 0.3), ss.laws.ExponentialStribeck(1.0, 0.7, 0.1))
    files = []
    for number, drive in enumerate((0.05, 0.15, 0.4)):
        orbit = ss.simulate(ss.Oscillator(damping=0.05, drive_velocity=drive, law=law), 200)
        friction = friction_of_orbit(orbit, np.arange(60, 200, 0.05), force_noise=0.005, seed=number)
        friction.to_netcdf(tmp_path / f"{number}.nc", engine="h5netcdf")
        files.append(str(tmp_path / f"{number}.nc"))
    for static in ("DwellTime", "LogarithmicDwell"):
        out = tmp_path / f"{static}.toml"
        given = [
            "identify",
            *files,
            "--law",
            f"Combined:{static}:ExponentialStribeck",
            "--no-simulation",
            "-o",
            str(out),
        ]
        assert main(given) == 0
        assert type(ss.load_law(out).static).__name__ == static
        assert f"--law Combined:{static}:ExponentialStribeck" in out.read_text()
    assert ss.load_law(out).static.growth == pytest.approx(0.08, abs=0.02)
    capsys.readouterr()
    assert main(["identify", *files, "--law", "Combined:DwelTime"]) == 2
    assert "unknown law 'DwelTime' (did you mean 'DwellTime'?)" in capsys.readouterr().err
    assert main(["identify", *files, "--law", "Combined:DwellTime:Coulomb:Coulomb"]) == 2
    assert "expected a static and a kinetic part after Combined, got 3 parts" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"free": "kinetic"}, r"expected free as a list of names such as \['scale'\], got 'kinetic'"),
        ({"fixed": ["kinetic"]}, r"expected fixed as a dictionary by the names of numbers, got \['kinetic'\]"),
        ({"fixed": {"kinetic": "a"}}, r"expected fixed\['kinetic'\] as a number, got 'a'"),
        ({"bounds": {"kinetic": 1}}, r"expected bounds\['kinetic'\] as a pair \(low, high\) of numbers"),
        ({"bounds": {"kinetic": (None, 1)}}, r"expected bounds\['kinetic'\] as a pair \(low, high\) of numbers"),
        ({"ties": "kinetic"}, "expected ties as a dictionary by the names of numbers, got 'kinetic'"),
    ],
)
def test_options_of_another_kind_are_refused(given, sentence):
    with pytest.raises(InputError, match=sentence):
        Options(**{"fixed": {}, "bounds": {}} | given)


def test_bounds_may_be_an_array():
    assert Options(bounds={"kinetic": np.array([0.0, np.inf])}).bounds["kinetic"][1] == np.inf


def test_a_fit_runs_on_one_thread_of_the_linear_algebra(monkeypatch):
    # The function of this name hides its module.
    module = importlib.import_module("stickslip.identification.selection.identify")
    seen = []

    def records(_):
        seen.extend(pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas")
        raise ss.InputError("seen")

    monkeypatch.setattr(module, "read_records", records)
    with threadpool_limits(2, user_api="blas"), pytest.raises(ss.InputError, match="seen"):
        module.identify([], "Coulomb")
    assert set(seen) == {1}


@pytest.mark.long
def test_a_library_that_is_loaded_after_the_first_fit_runs_on_one_thread_too():
    # opencv brings linear algebra of its own
    script = (
        "from stickslip.identification.estimator.threads import one_thread; from threadpoolctl import threadpool_info;"
        "one_thread(len)(''); import cv2;"
        "print({pool['num_threads'] for pool in one_thread(threadpool_info)() if pool['user_api'] == 'blas'})"
    )
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "2"}
    found = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "{1}"


@pytest.fixture(scope="module")
def stick_slip_at_three_speeds():
    law = ss.laws.Combined(ss.laws.DwellTime(0.6, 0.3, 0.3), ss.laws.ExponentialStribeck(0.6, 0.45, 0.2, 0.02))
    orbits = [ss.simulate(ss.Oscillator(0.1, drive, law), 100) for drive in (0.08, 0.12, 0.16)]
    return [friction_of_orbit(orbit, np.arange(0, 100, 0.1), 0.005, seed=number) for number, orbit in enumerate(orbits)]


@pytest.mark.parametrize(
    ("options", "level"),
    [
        ({"fixed": {"kinetic.break_away": 0.6}}, 0.6),
        ({"free": ["static.limit"]}, None),
        ({"fixed": {"kinetic.break_away": 0.6}, "ties": {"static.kinetic": "kinetic.break_away"}}, 0.6),
    ],
)
def test_a_number_that_follows_one_that_is_held_is_held_with_it(stick_slip_at_three_speeds, options, level):
    found = identify(stick_slip_at_three_speeds, "Combined:DwellTime", **options)
    assert found.law.static.kinetic == found.law.kinetic.break_away == (level or found.law.kinetic.break_away)
    assert found.ties == {}
    assert found.law.static.limit == pytest.approx(0.3, abs=0.1)


def test_a_number_that_is_held_follows_no_other(stick_slip_at_three_speeds):
    found = identify(stick_slip_at_three_speeds, "Combined:DwellTime", fixed={"static.kinetic": 0.65})
    assert found.law.static.kinetic == 0.65
    assert found.law.kinetic.break_away == pytest.approx(0.6, abs=0.01)
    assert not any("follows" in note for note in found.notes)
    with pytest.raises(
        InputError, match=r"static.kinetic is to be held and to follow kinetic.break_away: leave it out"
    ):
        identify(
            stick_slip_at_three_speeds,
            "Combined",
            fixed={"static.kinetic": 0.65},
            ties={"static.kinetic": "kinetic.break_away"},
        )


@pytest.mark.long
@pytest.mark.parametrize("law", ["Combined:LogarithmicDwell", "Tabulated"])
def test_any_number_of_a_law_with_ties_can_be_held_or_fitted_alone(stick_slip_at_three_speeds, law):
    whole = identify(stick_slip_at_three_speeds, law)
    assert whole.ties
    for name in pointers(whole.law):
        for options in ({"fixed": {name: value(whole.law, name)}}, {"free": [name]}):
            try:
                found = identify(stick_slip_at_three_speeds, law, **options).law
            except InputError:  # no law with that value, or nothing known of that number
                continue
            for tied, source in whole.ties.items():
                assert tied == name or value(found, tied) == value(found, source), options
