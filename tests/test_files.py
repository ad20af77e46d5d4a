"""What is read is never written over, what is written is whole, and what a killed process left is cleared away."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

import stickslip as ss
from stickslip.cli.main import _commands, _parser, main
from stickslip.files.disk import read_text, write_whole

LAW = '[law]\ntype = "Coulomb"\nkinetic = 0.5\n'
SYSTEM = (
    'mass = 1.0\nstiffness = 1.0\ndamping = 0.1\ndrive_velocity = 0.2\nlaw = "law.toml"\n[simulation]\nt_end = 10.0\n'
)
RIG = 'instrument = "displacement"\ncolumn = "x"\nunit = "1"\nstiffness = 1.0\nmass = 1.0\ndrive_velocity = 0.2\n'
SWEEP = "--over drive_velocity=0.1:0.2:2 --transient 1 --window 1"
STARTS = "--x 0:1:2 --v 0:1:2 --transient 1 --window 1"


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    from stickslip.tracking.video.writing import write_pictures

    folder = tmp_path_factory.mktemp("inputs")
    orbit = ss.simulate(ss.paper.oscillator(0.2), t_end=40)
    (folder / "law.toml").write_text(LAW)
    (folder / "system.toml").write_text(SYSTEM)
    (folder / "rig.toml").write_text(RIG)
    t = np.linspace(0, 40, 400)
    (folder / "record.csv").write_text(
        "t,x\n" + "\n".join(f"{a:.6g},{b:.6g}" for a, b in zip(t, orbit.at(t)[0], strict=True))
    )
    ss.measure(folder / "record.csv", folder / "rig.toml").to_netcdf(folder / "friction.nc", engine="h5netcdf")
    write_pictures(folder / "film.avi", [np.full((48, 64, 3), 90, np.uint8)] * 3, 25.0, lossless=False)
    (folder / "track.toml").write_text('marker = "bright"\n')
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.parametrize("name", ["itself", "symlink", "hard link"])
@pytest.mark.parametrize(
    ("command", "options", "victims"),
    [
        ("simulate system.toml", "-o --plot", "system.toml law.toml"),
        ("film system.toml", "-o", "system.toml law.toml"),
        ("track film.avi --setup track.toml", "-o --plot --check", "film.avi track.toml"),
        ("measure record.csv --rig rig.toml", "-o --plot --motion --plot-motion", "record.csv rig.toml"),
        ("identify friction.nc", "-o --plot --report", "friction.nc"),
        ("identify friction.nc --compare Coulomb", "-o --report", "friction.nc"),
        (f"sweep system.toml {SWEEP}", "-o --plot", "system.toml law.toml"),
        (f"basins system.toml {STARTS}", "-o --plot", "system.toml law.toml"),
        ("continue system.toml --over drive_velocity=0.1:0.2", "-o --plot", "system.toml law.toml"),
    ],
)  # fmt: skip
def test_no_command_writes_over_what_it_reads(command, options, victims, name, inputs, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for file, content in inputs.items():
        (tmp_path / file).write_bytes(content)
    parser = _commands(_parser())[command.split()[0]]
    for option in options.split():
        # A link may have the ending that the option asks for; the file itself seldom has.
        ending = Path(parser._option_string_actions[option].metavar.partition("|")[0]).suffix
        for victim in victims.split():
            target = tmp_path / victim
            if name != "itself":
                target = tmp_path / f"other-{option.strip('-')}-{victim}{ending}"
                target.symlink_to(victim) if name == "symlink" else os.link(victim, target)
            assert main([*command.split(), option, str(target)]) == 2
            said = capsys.readouterr().err
            why = "is read and would be written over; give|the film itself, which"
            assert re.search(why if name != "itself" else f"{why}|expected a name that ends in", said)
            assert said.count("\n") == 1
    assert {file: (tmp_path / file).read_bytes() for file in inputs} == inputs


def test_a_setup_beside_a_film_is_kept_too(inputs, tmp_path, capsys):
    for file in ("system.toml", "law.toml"):
        (tmp_path / file).write_bytes(inputs[file])
    system = tmp_path / "system.track.toml"
    (tmp_path / "system.toml").rename(system)
    assert main(["film", str(system), "-o", str(tmp_path / "system.avi"), "--duration", "0.5", "--start", "0"]) == 2
    assert "would be written over" in capsys.readouterr().err
    assert system.read_bytes() == inputs["system.toml"]


@pytest.mark.parametrize("other", ["out.nc", "./out.nc", "sub/../out.nc"])
def test_two_outputs_have_two_names(other, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sub").mkdir()
    assert main(["measure", "record.csv", "--rig", "rig.toml", "-o", "out.nc", "--motion", other]) == 2
    said = capsys.readouterr().err
    assert "two outputs have this name; give each its own" in said
    assert said.count("\n") == 1


def test_a_program_may_write_what_it_has_read(tmp_path):
    path = tmp_path / "law.toml"
    path.write_text(LAW)
    assert ss.load_law(path).kinetic == 0.5
    write_whole(path, lambda draft: draft.write_text("new"))
    assert path.read_text() == "new"


def test_results_are_saved_under_a_name_of_their_kind_only(tmp_path):
    orbit = ss.simulate(ss.Oscillator(0.1, 0.3, ss.laws.StaticKinetic(1.0, 0.5)), 5.0)
    for name in ("orbit.csv", "orbit"):
        with pytest.raises(ss.InputError, match=r"ends in \.nc, got .*orbit\.nc for example"):
            orbit.save(tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_drafts_of_killed_processes_are_cleared_and_those_of_living_ones_kept(tmp_path):
    script = "import os, signal, sys\nfrom stickslip.files.disk import write_whole\n"
    script += "def write(draft):\n    draft.write_text('half')\n    os.kill(os.getpid(), signal.SIGKILL)\n"
    script += f"write_whole({str(tmp_path / 'out.txt')!r}, write)"
    subprocess.run([sys.executable, "-c", script], check=False)
    (left,) = tmp_path.iterdir()
    assert left.name.endswith(".part")
    living = tmp_path / left.name.replace(left.name.split(".")[-2], str(os.getppid()))
    living.write_text("of another process")
    write_whole(tmp_path / "out.txt", lambda draft: draft.write_text("whole"))
    assert sorted(tmp_path.iterdir()) == sorted([living, tmp_path / "out.txt"])


def test_documents_of_a_wrong_kind_are_refused_before_they_are_read(tmp_path, capsys):
    (tmp_path / "system.toml").write_text(SYSTEM.replace("law.toml", "/dev/zero"))
    assert main(["simulate", str(tmp_path / "system.toml")]) == 2
    assert "/dev/zero: a TOML file was expected, this is a device; name a file" in capsys.readouterr().err
    for name in ("x" * 5000, "nul\0", "none.toml"):
        with pytest.raises(ss.InputError, match="no such file; give the path of a TOML file"):
            read_text(tmp_path / name, "TOML file")
    large = tmp_path / "large.toml"
    with large.open("wb") as file:
        file.truncate(1 << 30)
    with pytest.raises(ss.InputError, match=r"a TOML file of at most 8\.39 MB was expected, got 1\.07e\+03 MB"):
        read_text(large, "TOML file")


def test_names_with_blanks_and_dollars_are_kept_in_commands_and_pictures(inputs, tmp_path):
    path = tmp_path / "run $x_{$ it's; 2.nc"
    path.write_bytes(inputs["friction.nc"])
    result = ss.identify(str(path), law="Coulomb")
    assert shlex.split(result.command)[:3] == ["stickslip", "identify", str(path)]
    axes = result.plot()
    axes.figure.canvas.draw()
    assert axes.get_legend().get_texts()[0].get_text().replace("\\", "") == path.name
    plt.close("all")
