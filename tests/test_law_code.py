"""The text of a law for a simulator gives the force of the law, in every language, or is refused."""

import shutil
import subprocess

import numpy as np
import pytest

import stickslip as ss
from stickslip.laws import Law, law_code

W = np.concatenate([[0.0], np.random.default_rng(0).uniform(-2.0, 2.0, 200), [1e-9, -1e-9, 2.0, -2.0, 2.5]])
LAWS = [
    ss.laws.Coulomb(0.5),
    ss.laws.ExponentialStribeck(1.0, 0.6, 0.2, 0.1),
    ss.laws.PiecewiseLinear([(0.0, 0.8), (0.3, 0.5), (1.0, 0.9)], 1.1),
    ss.laws.Asymmetric(forward=ss.laws.StaticKinetic(1.2, 0.7), backward=ss.laws.ExponentialStribeck(0.9, 0.4, 0.1)),
]


def in_python(text, w, load):
    names = {}
    exec(text, names)
    return [names["friction"](one, load) for one in w.tolist()]


def in_c(text, w, load, folder):
    rows = ", ".join(f"{one!r}" for one in w.tolist())
    main = f"#include <stdio.h>\nint main(void) {{ const double w[] = {{{rows}}}; unsigned i;\n"
    main += f'for (i = 0; i < {w.size}; i++) printf("%.17g\\n", friction(w[i], {load!r}));\nreturn 0; }}\n'
    (folder / "friction.c").write_text(text + main)
    command = ["cc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-o", folder / "friction", folder / "friction.c"]
    subprocess.run(command, check=True)
    done = subprocess.run([folder / "friction"], check=True, capture_output=True, text=True)
    return [float(line) for line in done.stdout.split()]


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_the_function_gives_the_force_of_the_law(law):
    found = np.array(in_python(law_code(law, "python", w_max=2.0, error=1e-5), W, 0.2))
    assert found[0] == 0.2  # held
    inside = np.abs(W) <= 2.0
    np.testing.assert_allclose(found[inside][1:], law.kinetic_force(W[inside][1:]), atol=1.01e-5)
    text = law_code(law, "python", w_max=2.0)
    assert in_python(text, W[:1], 9.0) == [law.break_away_force(0.0, 1e-300)]
    assert in_python(text, W[:1], -9.0) == [-law.break_away_force(0.0, -1e-300)]


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here")
def test_c_gives_what_python_gives(tmp_path):
    for number, law in enumerate(LAWS):
        folder = tmp_path / str(number)
        folder.mkdir()
        for load in (0.2, -9.0):
            expected = in_python(law_code(law, "python", w_max=2.0), W, load)
            np.testing.assert_allclose(in_c(law_code(law, "c", w_max=2.0), W, load, folder), expected, rtol=1e-14)


BESIDE = {
    "offset": -0.2,
    "restoring": 3.0,
    "position": 0.1,
    "gravity_sine": 0.5,
    "gravity_cosine": -0.25,
    "inertia": 0.01,
}


def test_what_a_force_holds_beside_friction_is_a_second_function():
    law, x, a = ss.laws.Coulomb(0.5), 0.7, 3.0
    expected = -0.2 + 3.0 * (x - 0.1) + 0.5 * np.sin(x) - 0.25 * np.cos(x) + 0.01 * a
    names = {}
    exec(law_code(law, "python", 2.0, beside=BESIDE), names)
    assert names["beside_friction"](x, a) == pytest.approx(expected)
    with pytest.raises(ss.InputError, match=r"unknown force beside friction 'ofset'.*did you mean 'offset'"):
        law_code(law, "c", 2.0, beside={"ofset": 1.0})
    assert "beside_friction" not in law_code(law, "python", 2.0)


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here")
def test_c_has_that_function_too(tmp_path):
    for beside in (BESIDE, {"offset": 0.5}):
        text = law_code(ss.laws.Coulomb(0.5), "c", 2.0, beside=beside)
        main = '#include <stdio.h>\nint main(void) { printf("%.17g\\n", beside_friction(0.7, 3.0) + 0 * friction(1, 0)); }\n'
        (tmp_path / "f.c").write_text(text + main)
        command = ["cc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-o", tmp_path / "f", tmp_path / "f.c", "-lm"]
        subprocess.run(command, check=True)
        names = {}
        exec(law_code(ss.laws.Coulomb(0.5), "python", 2.0, beside=beside), names)
        done = subprocess.run([tmp_path / "f"], check=True, capture_output=True, text=True)
        assert float(done.stdout) == pytest.approx(names["beside_friction"](0.7, 3.0))


def test_the_static_friction_of_a_rest_is_asked_for():
    law = ss.laws.DwellTime(kinetic=0.5, limit=0.5, rate=0.4)
    with pytest.raises(
        ss.InputError, match="static friction of DwellTime grows with rest; give the stick_time \\(--stick-time\\)"
    ):
        law_code(law, "python", w_max=1.0)
    text = law_code(law, "python", w_max=1.0, stick_time=2.0)
    assert in_python(text, W[:1], 9.0) == [law.break_away_force(2.0)]


@pytest.mark.parametrize(
    ("name", "language", "said"),
    [
        ("TwoBranch", "c", "TwoBranch has a memory while slipping"),
        ("BogaczRyczek", "c", "BogaczRyczek has a memory while slipping"),
        ("LuGre", "c", "LuGre has an internal state"),
        ("Coulomb", "pyhton", "language must be one of python, c, got 'pyhton'.*did you mean 'python'"),
    ],
)
def test_what_no_function_holds_is_refused(name, language, said):
    with pytest.raises(ss.InputError, match=said):
        law_code(Law.ALL[name].example(), language, w_max=1.0)
