"""A whole experiment in one run: in parallel, resumable, each failure one line."""

import json
import os
import signal
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import stickslip as ss
from stickslip.cli.main import main
from stickslip.errors import InputError
from stickslip.experiment.experiment import Experiment
from stickslip.experiment.unattended_run import run, watch

LAW = ss.laws.StaticKinetic(break_away=1.2, kinetic=0.7)
RIG = {
    "instrument": "displacement", "column": "x", "unit": "m", "stiffness": 1.0, "mass": 1.0, "damping": 0.05,
    "drive_velocity": 0.1,
}  # fmt: skip


def write(path, seed=0):
    orbit = ss.simulate(ss.Oscillator(damping=0.05, drive_velocity=0.1, law=LAW), 60.0)
    time = np.arange(0, 60, 2 * np.pi / 40)
    x = orbit.at(time)[0] + 3e-3 * np.random.default_rng(seed).standard_normal(len(time))
    np.savetxt(path, np.stack([time, x], axis=1), delimiter=",", header="t,x", comments="")


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "runs").mkdir()
    write(tmp_path / "runs" / "good.csv")
    (tmp_path / "runs" / "bad.csv").write_text("t,x\n0,1\n1,oops\n")
    text = "\n".join(f"{key} = {json.dumps(value)}" for key, value in RIG.items())
    (tmp_path / "experiment.toml").write_text(
        f'records = ["runs/*.csv"]\noutput = "out"\nlaw = "StaticKinetic"\nworkers = 1\n[rig]\n{text}\n'
    )
    return tmp_path


def test_an_experiment_runs_past_a_bad_record_and_is_not_done_twice(folder, capsys):
    assert main(["run", str(folder / "experiment.toml")]) == 2
    seen = capsys.readouterr()
    assert "measured          good" in seen.out
    assert "StaticKinetic from 1 record(s)" in seen.out
    assert "bad.csv" in seen.out
    assert "1 of 2 records could not be measured" in seen.err
    lines = seen.err.splitlines()
    assert sorted(line.partition(": ")[2] for line in lines[:2]) == ["bad failed", "good measured"]
    assert [line.partition(": ")[0] for line in lines[:2]] == ["1 of 2", "2 of 2"]
    out = folder / "out"
    assert {path.name for path in (out / "good").iterdir()} == {
        "friction.nc", "friction.png", "motion.png", "break_away.csv", "finished.json",
    }  # fmt: skip
    law = ss.load_law(out / "law.toml")
    assert law.break_away == pytest.approx(1.2, abs=0.01)
    page = (out / "report.html").read_text()
    assert ">Break-aways</h2>" in page
    assert "<th>main_line [Hz]</th>" in page
    for table in (out / "break_away.csv", out / "good" / "break_away.csv"):
        assert {"t [s]", "force [N]", "force_error [N]"} <= set(pd.read_csv(table).columns)
    assert {"slips", "main_line [Hz]", "main_line_error [Hz]"} <= set(pd.read_csv(out / "records.csv").columns)
    before = (out / "good" / "friction.nc").stat().st_mtime_ns
    looks = []
    watch(folder / "experiment.toml", every=0.01, stop=lambda: len(looks) == 1, on_table=looks.append)
    assert list(looks[0]["state"]) == ["failed", "finished before"]
    assert (out / "good" / "friction.nc").stat().st_mtime_ns == before
    assert looks[0].loc["good", "regime"] == "stick_slip"
    assert looks[0].attrs["units"]["stiffness"] == "N/m"


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"records": []}, "records must be a list of paths"),
        ({"rigg": 1}, r"unknown key 'rigg' \(did you mean 'rig'\?\)"),
        ({"workers": 0}, "workers must be a whole number"),
        ({"records": ["nothing/*.csv"]}, "no record matches"),
        ({"rig": "nothing.toml"}, "no such file"),
        ({"rig": RIG | {"stiffness": -1}}, "stiffness must be a positive number"),
        ({"rig": {"column": "x"}}, "instrument is missing"),
        ({"track": {"masess": 2}}, r"setup: unknown key 'masess' .did you mean 'masses'"),
        ({"law": "Coulom"}, "unknown law 'Coulom' .did you mean 'Coulomb'"),
    ],
)
def test_wrong_experiments_are_one_sentence(tmp_path, change, sentence):
    with pytest.raises(InputError, match=sentence):
        run({"records": [str(tmp_path / "a.csv")], "rig": RIG, "output": str(tmp_path / "out"), **change})


@pytest.mark.slow
def test_a_rig_that_is_whole_for_one_record_only_costs_the_others_alone(folder):
    rig = {key: value for key, value in RIG.items() if key != "drive_velocity"}
    plan = Experiment((str(folder / "runs" / "*.csv"),), rig, each={"good.csv": {"drive_velocity": 0.1}}, law="")
    table = run(Experiment.from_dict(plan.to_dict() | {"output": str(folder / "out"), "workers": 1}))
    assert table["state"].to_dict() == {"bad": "failed", "good": "measured"}
    assert "drive_velocity is missing" in table.loc["bad", "message"]


@pytest.mark.slow
def test_logs_of_a_loaded_joint_at_several_speeds_have_one_curve_with_gravity_and_a_report(tmp_path):
    t = np.arange(0, 10, 0.02)
    for number, speed in enumerate((0.2, -0.2, 0.5, -0.5, 1.0, -1.0)):
        noise = 0.02 * np.random.default_rng(number).standard_normal(t.size)
        torque = np.sign(speed) * 1.2 + 0.8 * speed + 2.0 * np.sin(speed * t + 0.3) + noise
        table = np.column_stack([t, speed * t, np.full(t.size, speed), torque])
        np.savetxt(tmp_path / f"joint{number}.csv", table, delimiter=",", header="t,q,dq,tau", comments="")
    channels = {
        "time": "t",
        "displacement": {"column": "q", "unit": "rad"},
        "velocity": {"column": "dq", "unit": "rad/s"},
        "force": {"column": "tau", "unit": "N m"},
    }
    rig = {"instrument": "direct_force", "columns": channels}
    run(Experiment(records=[tmp_path / "joint*.csv"], rig=rig, output=tmp_path / "out", workers=1))
    law = ss.load_law(tmp_path / "out" / "law.toml")
    assert law.kinetic_force([0.2, 1.0]) == pytest.approx([1.36, 2.0], abs=0.02)
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "gravity_cosine" in page
    assert "follows sine and cosine of the angle" in page


def test_records_of_one_name_lie_in_folders_of_their_own(tmp_path):
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "a.csv").write_text("")
    plan = Experiment((str(tmp_path / "*" / "a.csv"),), RIG)
    assert set(plan.sources()) == {"one-a.csv", "two-a.csv"}


def test_what_differs_from_record_to_record_stands_in_each(tmp_path):
    for name in ("pull-2.csv", "pull-8a.csv", "pull-8b.csv"):
        (tmp_path / name).write_text("t,x\n")
    (tmp_path / "rig.toml").write_text("\n".join(f"{key} = {json.dumps(value)}" for key, value in RIG.items()))
    (tmp_path / "experiment.toml").write_text(
        'records = ["pull-*.csv"]\nrig = "rig.toml"\n[each."pull-8*.csv"]\ndrive_velocity = 0.8\n'
    )
    plan = Experiment.of(tmp_path / "experiment.toml")
    assert plan.rig_of(tmp_path / "pull-2.csv") == str(tmp_path / "rig.toml")
    assert [plan.rig_of(tmp_path / f"pull-8{k}.csv") for k in "ab"] == [RIG | {"drive_velocity": 0.8}] * 2
    assert Experiment.from_dict(plan.to_dict()).each == plan.each
    by_stem = Experiment(plan.records, plan.rig, each={"pull-2": {"drive_velocity": 0.8}}, folder=plan.folder)
    assert len(by_stem.sources()) == len(plan.sources())
    with pytest.raises(InputError, match=r"each names 'pull-9\.csv', and no record has such a name"):
        run(Experiment((str(tmp_path / "pull-*.csv"),), RIG, each={"pull-9.csv": {"mass": 2.0}}))
    with pytest.raises(InputError, match="each must be tables of rig keys"):
        Experiment(("a.csv",), RIG, each={"a.csv": 2.0})


@pytest.mark.slow
def test_a_record_that_still_grows_does_not_keep_the_others_waiting(folder):
    runs, tables, looks = folder / "runs", [], []
    (runs / "bad.csv").unlink()
    plan = Experiment.of(
        {**Experiment.of(folder / "experiment.toml").to_dict(), "each": {"late.csv": {"damping": 0.05}}}
    )
    plan = replace(plan, folder=folder, law="")
    whole = (runs / "good.csv").read_text()

    def stop():
        looks.append(len(tables))
        if len(looks) <= 5:
            (runs / "late.csv").write_text(whole if len(looks) == 5 else whole[: 200 * len(looks)])
        if len(looks) == 3:  # one comes and goes
            (runs / "gone.csv").write_text(whole)
        if len(looks) == 4:
            (runs / "gone.csv").unlink()
        return len(looks) == 8

    watch(plan, every=0.001, stop=stop, on_table=tables.append)
    assert [dict(table["state"]) for table in tables] == [
        {"good": "measured"},
        {"good": "finished before", "late": "measured"},
    ]


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize("how", ["SIGKILL", "SIGINT"])
def test_a_run_that_is_stopped_leaves_no_process_and_goes_on_later(tmp_path, how):
    for number in range(5):
        write(tmp_path / f"{number:02d}.csv", number)
    rig = "\n".join(f"{key} = {json.dumps(value)}" for key, value in RIG.items())
    document = tmp_path / "experiment.toml"
    document.write_text(f'records = ["*.csv"]\nlaw = ""\nworkers = 1\n[rig]\n{rig}\n')
    command = [sys.executable, "-m", "stickslip", "run", str(document)]

    def attend():
        # what runs behind a shell's & is deaf to Ctrl-C, and so would be what it starts
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    child = subprocess.Popen(command, stderr=subprocess.PIPE, start_new_session=True, preexec_fn=attend)
    with child as process:
        process.stderr.readline()  # the first is finished
        process.send_signal(getattr(signal, how))
        process.wait()
        # the pipe of messages closes when the last process that has it ends: workers would keep it open
        said = process.stderr.read().decode()
    assert (process.returncode, "interrupted" in said) == ((130, True) if how == "SIGINT" else (-9, False))
    done = len(list((tmp_path / "results").glob("*/finished.json")))
    assert 1 <= done < 5
    states = list(run(document)["state"])
    assert (states.count("finished before"), states.count("measured")) == (done, 5 - done)
