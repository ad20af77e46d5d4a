"""The first hour: names that are offered, mistakes that a type checker sees, pictures in a notebook, help, copies."""

import copy
import os
import pickle
import shlex
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

import stickslip as ss
from stickslip.cli.main import _parser, main
from stickslip.files.progress import waiting
from stickslip.files.units import rounded
from stickslip.identification import compare_laws, friction_of_orbit
from stickslip.report.identification import page_of_table
from stickslip.report.report import Report


def test_only_public_names_are_offered():
    assert dir(ss) == sorted(ss.__all__)


@pytest.mark.slow
def test_a_type_checker_sees_a_misspelt_name(tmp_path):
    program = tmp_path / "program.py"
    program.write_text("import stickslip as ss\n\nss.simulate\nss.simulat\n", encoding="utf-8")
    # The configuration of this repository is that of the package, not of its users.
    checked = [sys.executable, "-m", "mypy", "--config-file=", f"--cache-dir={tmp_path}", str(program)]
    found = subprocess.run(checked, capture_output=True, text=True, check=False).stdout
    assert 'program.py:4: error: Module has no attribute "simulat"' in found
    assert "program.py:3" not in found


NOTEBOOK = """
import matplotlib
from matplotlib.backends.backend_agg import *  # noqa: F403

matplotlib.interactive(True)
"""


def test_pictures_after_the_first_are_shown_in_a_notebook(tmp_path):
    # The backend of notebooks makes matplotlib interactive when it is loaded, and shows only what is drawn while it is.
    (tmp_path / "notebook.py").write_text(NOTEBOOK, encoding="utf-8")
    program = "from stickslip import show; import matplotlib; show.new_axes(); assert matplotlib.is_interactive()"
    environment = os.environ | {"MPLBACKEND": "module://notebook", "PYTHONPATH": str(tmp_path)}
    subprocess.run([sys.executable, "-c", program], env=environment, check=True)


CELLS = [
    "import stickslip as ss; system = ss.Oscillator(0.05, 0.2, ss.laws.StaticKinetic(1.0, 0.6))",
    "orbit = ss.simulate(system, 50.0); ax = ss.show.phase_plane(orbit)",
    "ax = ss.show.time_series(orbit)",
    "orbit",
]


@pytest.mark.slow
@pytest.mark.filterwarnings("default")  # those of the kernel are not ours
def test_every_picture_of_a_notebook_is_shown_and_an_orbit_is_a_table(tmp_path):
    import nbformat
    from nbclient import NotebookClient

    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in CELLS])
    environment = {name: value for name, value in os.environ.items() if name != "MPLBACKEND"}
    # Generous: the kernel starts while other work may hold the machine.
    client = NotebookClient(notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": tmp_path}})
    client.execute(env=environment)
    shown = [{kind for output in cell.outputs for kind in output.get("data", ())} for cell in notebook.cells]
    assert [("image/png" in kinds) for kinds in shown] == [False, True, True, False]
    assert "text/html" in shown[3]


LONG = {
    "a law of many pieces": ss.laws.PiecewiseLinear([(0.1 * i, 1.0 + 0.01 * i) for i in range(200)], 1.5),
    "a chain": ss.chain(40, ss.laws.Coulomb(0.5), 0.2),
    "an orbit": ss.simulate(ss.Oscillator(0.05, 0.2, ss.laws.StaticKinetic(1.0, 0.6)), 50.0),
    "a cycle": ss.periodic_orbit(ss.Oscillator(0.05, 0.2, ss.laws.StaticKinetic(1.0, 0.6))),
}


@pytest.mark.parametrize("value", LONG.values(), ids=LONG)
def test_a_value_is_short_at_a_prompt_and_a_table_in_a_notebook(value):
    assert len(repr(value)) < 800
    assert value._repr_html_().count("<tr>") > 1


def test_a_person_who_waits_sees_how_far_it_is(monkeypatch, capsys):
    now = iter([0.0, 1.0, 3.0, 3.1, 4.0])
    monkeypatch.setattr(time, "monotonic", lambda: next(now))
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    say = waiting(None, "basins")
    for done in (1, 2, 3, 4):
        say(done, 4)
    assert capsys.readouterr().err == "\rbasins: 2 of 4, 3 s\rbasins: 4 of 4, 4 s\n"


SYSTEMS = {
    "closed form": ss.Oscillator(0.05, 0.2, ss.laws.StaticKinetic(1.0, 0.6)),
    "Taylor series": ss.Oscillator(0.05, 0.2, ss.laws.ExponentialStribeck(1.0, 0.6, 0.2)),
    "two masses": ss.chain(2, ss.laws.Coulomb(0.5), drive_velocity=0.2, coupling=0.8),
}


@pytest.mark.parametrize("system", SYSTEMS.values(), ids=SYSTEMS)
def test_an_orbit_is_copied_and_pickled_to_the_bit(system):
    orbit = ss.simulate(system, 20.0)
    for again in (pickle.loads(pickle.dumps(orbit)), copy.deepcopy(orbit)):
        assert again == orbit
        assert again.events.equals(orbit.events)
        assert (again.at([1.0, 19.5])[0] == orbit.at([1.0, 19.5])[0]).all()
    assert orbit != ss.simulate(system, 21.0)


SMOOTH = ss.Oscillator(0.05, 0.2, ss.laws.ExponentialStribeck(1.0, 0.5, 0.3, viscous=0.1))
BRISTLES = ss.Oscillator(0.05, 0.2, ss.laws.LuGre.example())
COMPARED = ("StaticKinetic", "Coulomb")
RESULTS = {
    "a cycle": lambda: ss.periodic_orbit(SYSTEMS["closed form"]),
    "branches": lambda: ss.continuation(SMOOTH, "drive_velocity", (0.4, 0.6), seeds=0),
    "exponents": lambda: ss.lyapunov(SYSTEMS["closed form"], t_end=100),
    "critical velocities": lambda: ss.critical_velocities(SMOOTH),
    "a law with a state": lambda: ss.simulate(BRISTLES, 10.0),
    "a comparison": lambda: compare_laws(
        friction_of_orbit(LONG["an orbit"], np.arange(10, 50, 0.05), force_noise=0.01), COMPARED
    ),
}


LONGER = {"critical velocities"}


@pytest.mark.parametrize(
    "make",
    [pytest.param(make, marks=[pytest.mark.slow] if name in LONGER else [], id=name) for name, make in RESULTS.items()],
)
def test_a_result_is_equal_to_its_copies(make):
    result = make()
    for again in (pickle.loads(pickle.dumps(result)), copy.deepcopy(result)):
        assert again == result
    assert result != 1


def test_orbits_of_laws_with_a_state_differ_where_their_runs_do():
    assert ss.simulate(BRISTLES, 10.0) == ss.simulate(BRISTLES, 10.0)
    assert ss.simulate(BRISTLES, 10.0) != ss.simulate(BRISTLES, 10.0, x0=0.1)


def test_the_help_of_every_command_ends_with_an_example_that_parses():
    commands = next(action for action in _parser()._actions if action.dest == "command").choices
    for name, command in commands.items():
        assert f"stickslip {name}" in (command.epilog or ""), name
        arguments = shlex.split(command.epilog.removeprefix("example: stickslip ").partition(" >>")[0])
        assert _parser().parse_args(arguments).command == name


def test_the_shell_completes_commands_and_options(capsys):
    assert main(["completion", "bash"]) == 0
    script = capsys.readouterr().out
    for words, wanted in ((["stickslip", "sim"], "simulate"), (["stickslip", "simulate", "--t-"], "--t-end")):
        typed = f"COMP_WORDS=({' '.join(words)}); COMP_CWORD={len(words) - 1}; _stickslip; echo ${{COMPREPLY[@]}}"
        found = subprocess.run(["bash", "-c", script + typed], capture_output=True, text=True, check=True).stdout
        assert found.split() == [wanted]


def test_a_report_begins_with_its_summary_and_folds_long_lists():
    report = Report("A law")
    report.heading("Notes")
    report.items([f"note {number}" for number in range(6)])
    report.summary("It fits.", {"kinetic": rounded(3.0004, 0.0012)})
    page = report.html()
    parts = ["It fits.", "3.0004 ± 0.0012", '<a href="#s1">Notes</a>', '<h2 id="s1">', "note 3", "<details>", "note 4"]
    assert [page.index(part) for part in parts] == sorted(page.index(part) for part in parts)
    assert "prefers-color-scheme: dark" in page


@pytest.mark.long
def test_a_report_names_units_and_gives_numbers_in_the_digits_of_their_errors(tmp_path):
    from stickslip.examples import copy_example
    from stickslip.identification import compare_motion
    from stickslip.report.identification import page

    record, rig, *_ = copy_example(tmp_path)
    found = ss.identify(ss.measure(record, rig), law="StaticKinetic")
    text = page(found, simulate=False).html()
    row = found.parameters.loc["break_away"]
    assert f'<td class="number">{rounded(row["value"], row["error"]).partition(" ")[0]}</td>' in text
    assert "one force rate (30 N/s" in text
    agreement = compare_motion(found.records[0], found)
    share = agreement.table.loc["slips per time", "measured"] * agreement.table.loc["mean stick time", "error"]
    assert agreement.shown().loc["stuck share", "error"] == f"{share:.2g}"
    unknown = replace(agreement, table=agreement.table.assign(error=np.nan)).shown()
    assert (unknown["error"] == "–").all()
    assert (
        agreement.shown().loc["main line of velocity", "error"]
        == f"{agreement.table.loc['main line of velocity', 'error']:.2g}"
    )
    # All break-aways come after rests of 0.19 s: on a logarithmic axis no tick is a whole power.
    axes = found.static.plot()
    assert (axes.get_xscale(), axes.get_xlabel()) == ("linear", "stick time (s)")
    assert [panel.get_xlabel() for panel in found.static.plot_residuals()][1] == "force rate (N/s)"


def test_a_curve_over_speed_has_the_units_of_its_record():
    w = 0.3 * np.sin(np.arange(0, 40, 0.02))
    force = np.sign(w) * (2.0 + np.exp(-np.abs(w) / 0.05)) + 0.5 * w
    columns = {"time": "t", "velocity": {"column": "w", "unit": "rad/s"}, "force": {"column": "f", "unit": "N m"}}
    noise = 0.01 * np.random.default_rng(1).standard_normal(w.size)
    record = {"t": np.arange(0, 40, 0.02), "w": w, "f": force + noise}
    found = ss.identify(ss.measure(record, {"instrument": "direct_force", "columns": columns}))
    units = {"kinetic": "N m", "weakening": "N m", "scale": "rad/s", "viscous": "N m s/rad"}
    assert found.units == units
    page = page_of_table(found).html()
    row = found.parameters.loc["scale"]
    assert rounded(row["value"], row["error"]) + " rad/s" in page
    assert "N m s/rad" in found.report()


def test_two_records_of_one_name_are_told_apart():
    from stickslip.identification.result import short_names

    names = [type("Record", (), {"name": name}) for name in ("a/friction.nc", "b/friction.nc", "c/other.nc")]
    assert short_names(names) == ["a/friction.nc", "b/friction.nc", "c/other.nc"]
    assert short_names(names[1:]) == ["friction.nc", "other.nc"]
