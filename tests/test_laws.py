import re
from dataclasses import MISSING, fields, replace
from pathlib import Path

import numpy as np
import pytest

import stickslip as ss
from stickslip.laws import Law
from stickslip.laws.declarations import FACTS
from stickslip.laws.numbers import maybe, numbers, pointers, put, with_values

DOCS = Path(__file__).parent.parent / "docs"


LAWS = [
    *(kind.example() for kind in Law.ALL.values()),
    ss.laws.Tabulated(0.5, [(0, 1), (0.2, 1.6)]),
    ss.laws.TwoBranch(1, [(0, 0.8), (0.3, 0.7)], 1.1),
    ss.laws.BogaczRyczek(A=(-3, 5), C=(2, 4), D=None, alpha=[(1.0, 0.0), (1.3, 0.1)]),
]


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_every_law_is_a_document_that_comes_back(law):
    assert Law.from_dict(law.to_dict()) == law


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_a_law_with_another_number_is_that_of_its_document(law):
    known = {name: maybe(law, name) for name in numbers(law)}
    for name, number in known.items():
        if number is None:
            continue
        value = 1.001 * number or 1e-6
        document = law.to_dict()
        put(document, pointers(law)[name], value)
        try:
            made = Law.from_dict(document, type(law).__name__)
        except ss.InputError as error:
            with pytest.raises(ss.InputError, match=re.escape(str(error))):
                with_values(law, {name: value})
            continue
        moved = with_values(law, {name: value})
        assert moved == made
        assert moved.to_json() == made.to_json()
        assert np.array_equal(moved.kinetic_force([-0.2, 0.1, 0.3]), made.kinetic_force([-0.2, 0.1, 0.3]))
        assert moved.covariance.empty
        with pytest.raises(ss.InputError):
            with_values(law, {name: np.nan})


@pytest.mark.parametrize("kind", Law.ALL.values(), ids=lambda kind: kind.__name__)
def test_the_signature_of_a_law_is_what_the_core_declares(kind):
    facts, items = FACTS[kind.__name__], fields(kind)
    assert {item.name for item in items} == set(facts.parameters)
    optional = {item.name: item.default for item in items if item.default is not MISSING}
    if any(item.default is item.default_factory for item in items):
        assert optional == facts.defaults
    else:
        # The paper's law: all its parameters together are the default.
        assert kind() == kind.example()


def test_what_a_number_must_be_and_between_what_it_is_searched_go_together():
    for facts in FACTS.values():
        for name, parameter in facts.parameters.items():
            for number in parameter.numbers:
                assert number.low < number.high, name
                assert not number.ratio or number.low >= 0, name


@pytest.mark.parametrize("kind", Law.ALL.values(), ids=lambda kind: kind.__name__)
def test_every_law_has_a_section_and_a_picture(kind):
    page = (DOCS / "laws.md").read_text(encoding="utf-8")
    name = kind.__name__
    section = page.split(f"\n## {name}\n")[1].split("\n## ")[0]
    assert f"[`{name}`](#{name.lower()})" in page
    assert "\nSource: " in section
    assert "\nLimits: " in section
    for item in fields(kind):
        assert f"`{item.name}`" in section or "as for `LuGre`" in section
    picture = re.search(r"!\[.+\]\(([^\s)]+)", section)[1]
    assert (DOCS / picture).read_text(encoding="utf-8").startswith("<?xml")


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: ss.laws.StaticKinetic(0.5, 0.6), r"at least the kinetic force .* \(0\.6\), got 0\.5"),
        (lambda: ss.laws.Coulomb(float("nan")), "kinetic must be a finite number, got nan"),
        (lambda: ss.laws.Coulomb("0.5"), "kinetic = '0.5' has no unit; write a number without quotes for SI"),
        (lambda: ss.laws.Coulomb(-1), "kinetic must not be negative, got -1"),
        (lambda: ss.laws.DwellTime(0.5, -0.1, 1), "limit must not be negative, got -0.1"),
        (lambda: ss.laws.DwellTime(0.5, 0.1, 0), "rate must be greater than 0, got 0"),
        (lambda: ss.laws.PiecewiseLinear([(0, 1)], 1), "nodes needs at least 2 nodes, got 1"),
        (lambda: ss.laws.PiecewiseLinear([(0, 1), (0, 2)], 1), "strictly increasing abscissae, got 0 after 0 at node 1"),
        (lambda: ss.laws.PiecewiseLinear([(0.1, 1), (0.2, 2)], 1), "first node must lie at slip velocity 0, got 0.1"),
        (lambda: ss.laws.PiecewiseLinear([(0, 1), (0.2, 2)], 0.5), "at least the kinetic force"),
        (lambda: ss.laws.ForceRate(0.5, 0.5, 0.4, 0), "force_rate_scale must be greater than 0, got 0"),
        (lambda: ss.laws.Tabulated([], 1), "kinetic needs at least 1 nodes, got 0"),
        (lambda: ss.laws.Tabulated([(0.1, 1)], 1), "first node must lie at slip velocity 0, got 0.1"),
        (lambda: ss.laws.Tabulated(0.5, [(0, 1), (1, 0.9)]), "break_away must not fall, got 0.9 after 1 at node 1"),
        (lambda: ss.laws.Tabulated(1.5, [(0, 1), (1, 2)]), r"at least the kinetic force .* \(1\.5\), got 1"),
        (lambda: ss.laws.TwoBranch(1, 1.2, 1.1), r"at least the kinetic force .* \(1\.2\), got 1\.1"),
        (lambda: ss.laws.TwoBranch([(0, 1), (0, 2)], 1, 3), "rising must have strictly increasing abscissae"),
        (lambda: ss.laws.BogaczRyczek(B=(0.1, 2)), "pencil B of the lower lines must lie at w ≤ 0, got 0.1"),
        (lambda: ss.laws.BogaczRyczek(B=(-0.41, 9)), "lower branch must lie below the upper one"),
        (lambda: ss.laws.BogaczRyczek(eta=90), "eta in .*, got 90"),
        (lambda: ss.laws.BogaczRyczek(alpha=5.0), "alpha must not exceed the break-away force"),
        (lambda: ss.laws.BogaczRyczek(beta=50.0), "beta must be smaller, got 50"),
        (lambda: ss.laws.BogaczRyczek(A=[[1], 2]), r"A\[0\] must be a number or a text such as .*, got \[1\]"),
        (lambda: Law.from_dict({"type": [1]}), r"unknown law \[1\]"),
        (lambda: ss.laws.BogaczRyczek(D=3), "D must be a pair of numbers such as .*, got 3"),
        (lambda: Law.from_dict({"type": "Coulom", "kinetic": 1}), "unknown law 'Coulom' .did you mean 'Coulomb'"),
        (lambda: Law.from_dict({"type": "Coulomb", "kinetik": 1}), "unknown key 'kinetik' .did you mean 'kinetic'"),
        (lambda: Law.from_dict({"type": "Coulomb"}), "kinetic is missing"),
        (lambda: Law.from_dict({"kinetic": 1}), "type is missing"),
        (lambda: ss.Oscillator(0.1, 0.2, ss.laws.Coulomb(1), stiffness=-1), "stiffness must be greater than 0, got -1"),
        (lambda: ss.Oscillator(0.1, 0.2, ss.laws.Coulomb(1), mass=0), "mass must be greater than 0, got 0"),
        (lambda: ss.Oscillator(0.1, 0.2, law=0.5), "law must be a friction law"),
        (lambda: ss.Oscillator(0.1, 0.2, ss.laws.Coulomb(1), forcing=[ss.Harmonic(1, 1)] * 5), "at most 4 harmonics"),
        (lambda: ss.Oscillator(0.1, 0.2, ss.laws.Coulomb(1), forcing=ss.Harmonic(1, -1)), "frequency must not be negative"),
        (lambda: ss.simulate(ss.paper.oscillator(0.3), -1), "t_end must be greater than 0, got -1"),
        (lambda: ss.simulate(ss.paper.oscillator(0.3), 10, max_events=0), "max_events must be a whole number"),
        (lambda: ss.simulate(ss.paper.oscillator(0.3), 10).at(11), r"t must lie in \[0, 10\]"),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused_in_one_sentence(refused, make, sentence):
    refused(sentence, make)


def test_geometry_changes_point_by_point():
    law = ss.laws.BogaczRyczek()
    for name, value in {"A": (-2, 4.3), "B": (-0.5, 1.3), "C": (2, 2.1), "D": (0.4, 2.4), "l": (3.3, -0.25)}.items():
        other = replace(law, **{name: value})
        orbit = ss.simulate(ss.Oscillator(0.28, 0.3, other), 200)
        assert orbit.stop == "t_end"
        assert orbit.at(200.0) != ss.simulate(ss.Oscillator(0.28, 0.3, law), 200).at(200.0)


def test_branches_of_the_paper_law():
    # Along a full cycle: upper line while w rises, common line beyond the corner, lower line while w falls, climb along D.
    law = ss.paper.calibration.CALIBRATIONS["one f_s(0)"].law
    up, down = np.linspace(0, 0.5, 501), np.linspace(0.5, 0.1, 401)
    w = np.concatenate([up, down, np.linspace(0.1, 0.5, 401)])
    stuck = np.arange(w.size) == 0
    force = ss.force_along(law, np.arange(w.size) * 0.0, w, stuck)
    slope = np.tan(np.radians(-58))
    assert force[100] == pytest.approx(1.084 + slope * (0.1 - 0.01))
    corner = (1.084 - slope * 0.01 + 0.28) / (3.41 - slope)
    top = 3.41 * corner - 0.28
    assert force[500] == pytest.approx(top + np.tan(np.radians(39)) * (0.5 - corner))
    lower = top + (1.33 - top) / (-0.41 - corner) * (0.1 - corner)
    assert force[901] == pytest.approx(lower)
    climbed = lower + (2.40 - lower) / (0.33 - 0.1) * (w[906] - 0.1)
    assert force[906] == pytest.approx(climbed)
    assert force[902:].max() == pytest.approx(1.084, abs=0.01)


def test_dwell_surface():
    surface = ss.laws.StaticFriction(
        initial=1.0, limit=0.5, rate=2.0, exponent=0.5, force_rate_scale=0.3, force_rate_exponent=2
    )
    law = ss.laws.BogaczRyczek(static_friction=surface, B=(-0.41, 1.2))
    t, rate = np.array([0.0, 1.0, 4.0]), np.array([0.5, 0.0, 0.3])
    expected = 1.0 + 0.5 * (1 - np.exp(-2.0 * np.sqrt(t))) / (1 + (rate / 0.3) ** 2)
    assert law.break_away_force(t, rate) == pytest.approx(expected)
    falling = replace(law, static_friction=replace(surface, drop=0.4, drop_scale=0.6, drop_exponent=3))
    expected += 0.4 / (1 + (rate / 0.6) ** 3)
    assert falling.break_away_force(t, rate) == pytest.approx(expected)
    second = {"second_drop": 0.2, "second_drop_scale": 0.4, "second_drop_exponent": 6}
    falling = replace(law, static_friction=replace(falling.static_friction, **second))
    assert falling.break_away_force(t, rate) == pytest.approx(expected + 0.2 / (1 + (rate / 0.4) ** 6))


def test_a_turn_on_the_upper_branch_goes_down_or_back():
    # From w = s on the upper line, with less force than that needs: w falls at once, then turns.
    law = ss.laws.BogaczRyczek()
    follows = {}
    for upper_turn in ("down", "back"):
        oscillator = ss.Oscillator(0.35, 0.2, replace(law, upper_turn=upper_turn))
        orbit = ss.simulate(oscillator, 3.0, x0=1.45, v0=0.0)
        follows[upper_turn] = orbit.segments["branch"].to_numpy()[0]
        assert orbit.at(3.0)[1] == pytest.approx(0.0, abs=1e-3) or upper_turn == "back"
    # Steep between the branches, where it rests, and the upper line itself, which repels it.
    assert follows == {"down": 5, "back": 1}
    with pytest.raises(ss.InputError, match="upper_turn must be one of down, back, got 'up'"):
        ss.laws.BogaczRyczek(upper_turn="up")


def test_a_climb_ends_at_static_friction_of_the_force_rate_at_its_turn():
    # Eq. (7): f_s(0, δ), where δ is what adhesion would feel at the turn, d/dt (x + d s − u₀ cos ηt) with ẋ = s.
    surface = ss.laws.StaticFriction(initial=0.8, drop=1.2, drop_scale=0.35, drop_exponent=8)
    law, s, u0, eta = ss.laws.BogaczRyczek(static_friction=surface), 0.35, 0.05, 1.25
    orbit = ss.simulate(ss.Oscillator(0.25, s, law, forcing=ss.Harmonic(u0, eta)), 300)
    start, branch = (orbit.segments[name].to_numpy() for name in ("t", "branch"))
    # Those without a turn on the climb itself, which would go back along it.
    climbs = 1 + np.flatnonzero((branch[:-2] != 4) & (branch[1:-1] == 4) & (branch[2:] == 1))
    assert climbs.size > 5
    force = orbit.events.set_index("t")["force"]
    delta = s + u0 * eta * np.sin(eta * start[climbs])
    expected = 0.8 + 1.2 / (1 + (delta / 0.35) ** 8)
    assert force[start[climbs + 1]].to_numpy() == pytest.approx(expected, abs=1e-12)
    assert np.ptp(expected) > 0.1
