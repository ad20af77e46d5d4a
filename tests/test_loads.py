"""Loads that vary: constant forces, normal forces, springs. The reference is another integrator with events of its own."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from evidence import script
from scipy.integrate import solve_ivp

import stickslip as ss


@dataclass
class Reference:
    """m ẍ + D ẋ + r(x) = n(t, x, ẋ) F + p(t): modes switched by scipy's own events; nothing of the package is used."""

    drive: float
    damping: float
    static: Callable[[float], float]
    kinetic: Callable[[float], float]
    normal: Callable[[float, float, float], float] = lambda _t, _x, _v: 1.0
    push: Callable[[float], float] = lambda _t: 0.0
    spring: Callable[[float], float] = lambda x: x

    def run(self, t_end: float, x: float, v: float) -> tuple[list[tuple[float, str]], float, float]:
        t, events, mode, since = 0.0, [], self._first(0.0, x, v), 0.0
        while True:
            guards, names = self._guards(mode, since)
            rates = self._stick if mode == "stick" else self._slip(mode)
            for guard in guards:
                guard.terminal = True  # type: ignore[attr-defined]
            found = solve_ivp(rates, (t, t_end), (x, v), "DOP853", events=guards, rtol=1e-13, atol=1e-14, max_step=0.05)
            t, (x, v) = float(found.t[-1]), found.y[:, -1]
            if found.status == 0:
                return events, x, v
            name = next(name for name, times in zip(names, found.t_events, strict=True) if len(times))
            mode, kind = self._follow(name, mode, t, x, v)
            if kind == "capture":
                since, v = t, self.drive
            if kind:
                events.append((t, kind))

    def _holding(self, t: float, x: float) -> float:
        return self.spring(x) + self.damping * self.drive - self.push(t)

    def _first(self, t: float, x: float, v: float) -> str | float:
        if self.normal(t, x, v) <= 0:
            return "apart"
        if v != self.drive:
            return math.copysign(1.0, self.drive - v)
        load = self._holding(t, x)
        return "stick" if abs(load) <= self.normal(t, x, v) * self.static(0.0) else math.copysign(1.0, load)

    def _stick(self, _t: float, _y: np.ndarray) -> list[float]:
        return [self.drive, 0.0]

    def _slip(self, mode: str | float) -> Callable[[float, np.ndarray], list[float]]:
        def rates(t: float, y: np.ndarray) -> list[float]:
            x, v = y
            rub = 0.0
            if isinstance(mode, float):
                rub = mode * self.normal(t, x, v) * self.kinetic(mode * (self.drive - v))
            return [v, rub + self.push(t) - self.damping * v - self.spring(x)]

        return rates

    def _guards(self, mode: str | float, since: float) -> tuple[list[Callable[..., float]], list[str]]:
        def normal(t: float, y: np.ndarray) -> float:
            return self.normal(t, *y)

        normal.direction = 1 if mode == "apart" else -1  # type: ignore[attr-defined]
        guards: list[Callable[..., float]] = [normal]
        names = ["normal"]
        if mode == "stick":

            def margin(t: float, y: np.ndarray) -> float:
                return self.normal(t, y[0], self.drive) * self.static(t - since) - abs(self._holding(t, y[0]))

            margin.direction = -1  # type: ignore[attr-defined]
            guards, names = [margin, normal], ["release", "normal"]
        elif isinstance(mode, float):

            def speed(_t: float, y: np.ndarray) -> float:
                return mode * (self.drive - y[1])

            speed.direction = -1  # type: ignore[attr-defined]
            guards, names = [speed, normal], ["zero", "normal"]
        return guards, names

    def _follow(self, name: str, mode: str | float, t: float, x: float, v: float) -> tuple[str | float, str]:
        if name == "release":
            return math.copysign(1.0, self._holding(t, x)), "release"
        if name == "normal":
            return ("apart", "parting") if mode != "apart" else (math.copysign(1.0, self.drive - v), "meeting")
        load = self._holding(t, x)
        if abs(load) <= self.normal(t, x, v) * self.static(0.0):
            return "stick", "capture"
        return math.copysign(1.0, load), "crossing"


def agrees(
    system: ss.Oscillator, reference: Reference, t_end: float, x0: float, v0: float, tolerance: float
) -> ss.Orbit:
    """The events of both, in kind and time, and the states at the end."""
    orbit = ss.simulate(system, t_end, x0, v0)
    events, x, v = reference.run(t_end, x0, v0)
    table = orbit.events[orbit.events["kind"] != "node"]
    assert [kind for _, kind in events] == list(table["kind"])
    assert np.abs(table["t"].to_numpy() - [t for t, _ in events]).max(initial=0.0) < tolerance
    assert np.allclose(orbit.at(t_end), (x, v), rtol=0, atol=tolerance)
    return orbit


S = 0.2
STATIC = ss.laws.StaticKinetic(1.0, 0.6)
RATIONAL = ss.laws.Rational(1.0, 0.7)


def test_a_constant_force_moves_the_equilibrium():
    """m ẍ + k x = F + G is the motion of y = x − G/k without G; in closed form, and by Taylor steps."""
    for law in (STATIC, RATIONAL):
        plain = ss.simulate(ss.Oscillator(0.05, S, law), 60, -0.7, 0.0)
        pushed = ss.simulate(ss.Oscillator(0.05, S, law, forcing=ss.Harmonic.constant(0.7)), 60, 0.0, 0.0)
        assert len(plain.events) > 10
        assert np.abs(pushed.events["t"] - plain.events["t"]).max() < 1e-12
        assert np.abs(pushed.at(60.0)[0] - plain.at(60.0)[0] - 0.7) < 1e-12


def test_a_constant_force_beside_four_harmonics_stays_in_closed_form():
    waves = tuple(ss.Harmonic(0.05, 0.7 + 0.3 * i, i) for i in range(4))
    both = ss.Oscillator(0.1, S, STATIC, forcing=(*waves, ss.Harmonic.constant(0.3)))
    assert both.closed_form
    reference = Reference(S, 0.1, lambda _t: 1.0, lambda _u: 0.6)
    reference.push = lambda t: 0.3 + sum(w.amplitude * math.cos(w.frequency * t + w.phase) for w in waves)
    assert len(agrees(both, reference, 40, 0.0, 0.0, 1e-10).events) == 10


def test_a_block_on_an_incline_slides_where_its_weight_is_more_than_friction():
    """μ_s cos α against sin α: no spring, no drive. It goes down by g (sin α − μ_k cos α) t²/2."""
    g, steep, flat = 9.81, math.radians(35), math.radians(25)
    law = ss.laws.StaticKinetic(0.6 * g * math.cos(steep), 0.4 * g * math.cos(steep))

    def block(slope: float) -> ss.System:
        return ss.System(1.0, 0.0, 0.0, ss.Contact(0, law), ss.Harmonic.constant(g * math.sin(slope)))

    slid = 2 * g * (math.sin(steep) - 0.4 * math.cos(steep))
    assert ss.simulate(block(steep), 2.0).at(2.0)[0] == pytest.approx(slid, rel=1e-13)
    # Friction is still that of the steep plane: the block holds where its weight along the plane is less.
    assert g * math.sin(flat) < law.break_away
    assert ss.simulate(block(flat), 2.0).at(2.0)[0] == 0.0


NORMALS = {
    "N(t)": ss.NormalForce(harmonics=ss.Harmonic(0.5, 1.3, -math.pi / 2)),
    "N(t), parting": ss.NormalForce(harmonics=(ss.Harmonic(1.1, 1.3), ss.Harmonic(0.3, 2.9, 1.0))),
    "N(x)": ss.NormalForce(position=0.6),
    "N(x), parting": ss.NormalForce(position=-1.4),
    "N(v)": ss.NormalForce(velocity=0.4),
    "N(v), parting": ss.NormalForce(velocity=1.3, harmonics=ss.Harmonic(0.2, 0.9)),
}


@pytest.mark.parametrize("name", NORMALS)
@pytest.mark.parametrize("smooth", [False, True], ids=["pieces", "smooth"])
def test_a_normal_force_that_varies_agrees_with_another_integrator(name: str, smooth: bool):
    n = NORMALS[name]

    def normal(t: float, x: float, v: float) -> float:
        swing = sum(h.amplitude * math.cos(h.frequency * t + h.phase) for h in n.harmonics)
        return 1.0 + swing + n.position * x + n.velocity * v

    if smooth:
        law, kinetic = RATIONAL, lambda u: 1.0 / (1.0 + 0.7 * u)
    else:
        law, kinetic = (
            ss.laws.PiecewiseLinear(((0.0, 0.8), (0.4, 0.5), (1.5, 0.7)), 1.0),
            lambda u: float(np.interp(u, (0.0, 0.4, 1.5), (0.8, 0.5, 0.7)) + max(u - 1.5, 0.0) * 0.2 / 1.1),
        )
    system = ss.Oscillator(0.05, S, law, forcing=ss.Harmonic(0.4, 0.8), normal_force=n)
    reference = Reference(S, 0.05, lambda _t: 1.0, kinetic, normal)
    reference.push = lambda t: 0.4 * math.cos(0.8 * t)
    orbit = agrees(system, reference, 25, 1.2, -0.4, 1e-9)
    kinds = set(orbit.events["kind"])
    assert "capture" in kinds
    assert bool(kinds & {"parting", "meeting"}) == ("parting" in name)


def test_static_friction_that_grows_with_rest_is_scaled_too():
    law = ss.laws.DwellTime(0.5, limit=0.6, rate=0.8)
    n = ss.NormalForce(harmonics=ss.Harmonic(0.6, 2.1))
    system = ss.Oscillator(0.05, S, law, normal_force=n)

    def static(rest: float) -> float:
        return 0.5 + 0.6 * (1 - math.exp(-0.8 * rest))

    reference = Reference(S, 0.05, static, lambda _u: 0.5, lambda t, _x, _v: 1 + 0.6 * math.cos(2.1 * t))
    orbit = agrees(system, reference, 25, 0.0, 0.0, 1e-8)
    assert (orbit.events["kind"] == "release").sum() == 4


def test_a_constant_normal_force_is_that_of_a_scaled_law():
    """Also of several masses, and of an internal state, whose force at a given state is scaled."""
    twice = ss.NormalForce(2.0)
    chain = ss.chain(3, STATIC, 0.1, coupling=2.0)
    heavy = ss.chain(3, ss.laws.StaticKinetic(2.0, 1.2), 0.1, coupling=2.0)
    pressed = ss.System(
        chain.mass, chain.stiffness, chain.damping, [ss.Contact(i, STATIC, 0.1, normal_force=twice) for i in range(3)]
    )
    x0 = (0.1, -0.2, 0.3)
    one, two = ss.simulate(pressed, 40, x0), ss.simulate(heavy, 40, x0)
    assert len(one.events) > 10
    assert np.abs(one.events["t"] - two.events["t"]).max() < 1e-11
    bristles = ss.laws.LuGre(100.0, 1.0, 0.4, kinetic=1.0, break_away=1.5, scale=0.1)
    lugre = ss.Oscillator(0.05, S, bristles, normal_force=ss.NormalForce(0.5))
    half = ss.Oscillator(0.05, S, ss.laws.LuGre(50.0, 0.5, 0.2, kinetic=0.5, break_away=0.75, scale=0.1))
    assert np.allclose(ss.simulate(lugre, 10).at(10.0), ss.simulate(half, 10).at(10.0), rtol=1e-6, atol=1e-8)


PRESSED = ss.Oscillator(
    0.1, S, STATIC, normal_force=ss.NormalForce(1.0, ss.Harmonic(0.3, 1.3), position=0.2, velocity=-0.1)
)


def test_multipliers_under_a_varying_normal_force_are_those_of_differences():
    """Of a motion that never sticks, so that both multipliers count, and of one that does."""
    sliding = ss.Oscillator(0.3, 1.5, ss.laws.Rational(1.0, 0.4), normal_force=PRESSED.normal_force)
    for system in (sliding, PRESSED):
        cycle = ss.periodic_orbit(system)
        assert np.allclose(sorted(cycle.multipliers, key=abs), _differences(cycle), atol=1e-6), system


def _differences(cycle: Any) -> list[complex]:
    x, v = (float(value) for value in cycle.orbit.at(0.0))

    def image(dx: float, dv: float) -> np.ndarray:
        end = ss.simulate(cycle.orbit.system, cycle.period, x + dx, v + dv).at(cycle.period)
        return np.array(end, float)

    h = 1e-5
    assert np.allclose(image(0, 0), (x, v), rtol=0, atol=1e-10)
    columns = [(image(h, 0) - image(-h, 0)) / (2 * h), (image(0, h) - image(0, -h)) / (2 * h)]
    return sorted(np.linalg.eigvals(np.column_stack(columns)), key=abs)


@pytest.mark.long
def test_the_amplitude_of_a_normal_force_is_a_parameter_like_any_other():
    amplitudes = [0.1, 0.2, 0.3]
    name = "normal_force.harmonics.0.amplitude"
    diagram = ss.orbit_diagram(PRESSED, name, amplitudes, periods=40)
    assert diagram.sizes[name] == 3
    many = ss.simulate_many(PRESSED, {name: amplitudes}, 30, transient=0)
    alone = [len(ss.simulate(system, 30).events) for system in map(_with_amplitude, amplitudes)]
    assert list(many["events"].sum("kind").values) == alone
    branch = ss.continuation(PRESSED, name, (0.2, 0.3))
    assert len(branch.branches) > 0


def _with_amplitude(amplitude: float) -> ss.Oscillator:
    n = ss.NormalForce(1.0, ss.Harmonic(amplitude, 1.3), position=0.2, velocity=-0.1)
    return ss.Oscillator(0.1, S, STATIC, normal_force=n)


def test_what_a_normal_force_cannot_go_with_is_refused_in_one_sentence():
    n = ss.NormalForce(harmonics=ss.Harmonic(0.5, 1.0))
    with pytest.raises(ss.InputError, match="normal_force that varies needs a law"):
        ss.Oscillator(0.1, S, ss.laws.BogaczRyczek(), normal_force=n)
    loop = ss.System(1.0, 1.0, 0.1, [ss.Contact(0, STATIC, S, normal_force=n), ss.Contact(0, STATIC, S)])
    with pytest.raises(ss.InputError, match="close a loop"):
        ss.simulate(loop, 1.0)
    parting = ss.Oscillator(0.1, S, STATIC, normal_force=ss.NormalForce(harmonics=ss.Harmonic(1.5, 1.0)))
    with pytest.raises(ss.InputError, match="no derivative is known"):
        ss.lyapunov(parting, 50)
    with pytest.raises(ss.InputError, match=r"release_map: expected .* constant normal force"):
        ss.release_map(ss.Oscillator(0.1, S, STATIC, forcing=ss.Harmonic(0.1, 1.0), normal_force=n), [0.1])
    with pytest.raises(ss.InputError, match=r"unknown key 'positon'.*'position'|did you mean"):
        ss.NormalForce.from_dict({"positon": 1.0})


def test_a_normal_force_is_a_table_of_a_system_file_with_units(tmp_path):
    path = tmp_path / "brake.toml"
    path.write_text(
        """
        mass = 1.0
        stiffness = 1000.0
        damping = 1.0
        drive_velocity = "50 mm/s"
        law = { type = "StaticKinetic", break_away = 6.0, kinetic = 3.0 }
        normal_force = { position = "0.02 1/mm", velocity = "0.5 s/m", harmonics = [{ amplitude = 0.3, frequency = "5 Hz" }] }
        """
    )
    system = ss.load_system(path)
    assert system.normal_force.position == pytest.approx(20.0)
    assert ss.Oscillator.from_dict(system.to_dict()) == system
    small, scale = ss.dimensionless(system)
    assert small.normal_force.position == pytest.approx(20.0 * scale.length)
    slow, fast = ss.simulate(system, 1.0).events["t"], ss.simulate(small, 1.0 / scale.time).events["t"] * scale.time
    assert len(slow) > 4
    assert np.abs(slow - fast).max() < 1e-11
    assert scale.restore(small).normal_force.velocity == pytest.approx(0.5)


def test_steady_slip_under_a_load_that_varies():
    """k x = (1 + κ x) f(s) + G. Small disturbances feel D + n f′ + f γ and the stiffness k − κ f."""
    from stickslip.dynamics.equilibria.steady_slip import steady_slip

    law, s, kappa, gamma = ss.laws.Rational(1.0, 0.4), 1.5, 0.3, 0.2
    n = ss.NormalForce(position=kappa, velocity=gamma)
    state = steady_slip(ss.Oscillator(0.6, s, law, forcing=ss.Harmonic.constant(0.1), normal_force=n))
    f, slope = 1 / (1 + 0.4 * s), -0.4 / (1 + 0.4 * s) ** 2
    x = (f + 0.1) / (1 - kappa * f)
    assert state.x == pytest.approx(x, rel=1e-14)
    damping = 0.6 + (1 + kappa * x) * slope - f * gamma
    assert state.damping == pytest.approx(damping, rel=1e-8)
    assert state.growth == pytest.approx(-damping / 2, rel=1e-8)
    stuck = ss.simulate(ss.Oscillator(0.6, s, law, forcing=ss.Harmonic.constant(0.1), normal_force=n), 5.0, x, 0.0)
    assert abs(stuck.at(5.0)[0] - x) < 1e-12


@pytest.mark.long
def test_pieces_of_a_spring_agree_with_another_integrator():
    """A stop with its gap, backlash and a cubic spring, under friction; every piece that is entered is an event."""
    stop = ss.Spring.stop(0.5, stiffness=40.0)
    play = ss.Spring.backlash(0.3, stiffness=3.0)
    duffing = ss.Spring(cubic=0.8)
    cases = {
        (stop,): (lambda x: x + 40 * max(x - 0.5, 0.0), (0.5,)),
        (play,): (lambda x: x + 3 * (x - min(max(x, -0.3), 0.3)), (-0.3, 0.3)),
        (duffing,): (lambda x: x + 0.8 * x**3, ()),
        (stop, duffing): (lambda x: x + 40 * max(x - 0.5, 0.0) + 0.8 * x**3, (0.5,)),
    }
    for springs, (spring, corners) in cases.items():
        for law, kinetic in ((STATIC, lambda _u: 0.6), (RATIONAL, lambda u: 1 / (1 + 0.7 * u))):
            system = ss.Oscillator(0.05, S, law, forcing=ss.Harmonic(1.2, 0.8), springs=springs)
            reference = Reference(S, 0.05, lambda _t: 1.0, kinetic, spring=spring)
            reference.push = lambda t: 1.2 * math.cos(0.8 * t)
            orbit = ss.simulate(system, 20, 0.1, -0.4)
            events, x, v = reference.run(20, 0.1, -0.4)
            table = orbit.events[~orbit.events["kind"].isin(["node", "spring"])]
            assert [kind for _, kind in events] == list(table["kind"])
            assert np.abs(table["t"].to_numpy() - [t for t, _ in events]).max() < 1e-8
            assert np.allclose(orbit.at(20.0), (x, v), rtol=0, atol=1e-8)
            passed = orbit.events[orbit.events["kind"] == "spring"]
            assert (len(passed) > 3) == bool(corners)
            assert all(min(abs(x - corner) for corner in corners) < 1e-12 for x in passed["x"])


def test_the_force_of_a_spring_is_that_at_its_node_however_far_up_its_cubic_part_the_motion_began() -> None:
    nodes = [(-0.56, -13.8), (-0.42, -5.5), (-0.37, -5.3), (-0.23, 3.1)]
    spring = ss.Spring(cubic=9.5, nodes=nodes)
    slider = ss.Oscillator(0.0, 1.0, STATIC, springs=spring)
    events = ss.simulate(slider, 1e-4, x0=-1e5, v0=0.0, max_events=6).events
    events = events[events["kind"] == "spring"]
    assert len(events) == 4
    pull = np.interp(events["x"], *np.array(nodes).T) + 9.5 * events["x"] ** 3
    np.testing.assert_allclose(events["force"], -pull, rtol=1e-9)


def test_pieces_on_one_line_are_the_linear_spring():
    law, x = STATIC, (0.4, -0.2)
    pieces = ss.Spring(((-1.0, -1.0), (0.0, 0.0), (0.1, 0.1), (2.0, 2.0)))
    between = ss.Spring(((-1.0, -2.0), (1.0, 2.0)), mass=0, other=1)
    contacts = [ss.Contact(i, law, 0.2) for i in range(2)]
    linear = ss.System([1, 1], [[3, -2], [-2, 3]], 0.1, contacts)
    pieced = ss.System([1, 1], [[0, 0], [0, 1]], 0.1, contacts, springs=[pieces, between])
    one, two = ss.simulate(linear, 40, x), ss.simulate(pieced, 40, x)
    table = two.events[two.events["kind"] != "spring"]
    assert len(one.events) > 10
    assert np.abs(one.events["t"].to_numpy() - table["t"].to_numpy()).max() < 1e-11


def test_springs_are_tables_of_a_system_file_with_units(tmp_path):
    path = tmp_path / "stop.toml"
    path.write_text(
        """
        mass = 1.0
        stiffness = 100.0
        damping = 1.0
        drive_velocity = 0.1
        law = { type = "StaticKinetic", break_away = 6.0, kinetic = 3.0 }
        springs = [{ nodes = [[0.0, 0.0], ["40 mm", 0.0], [0.05, "0.1 kN"]] }, { cubic = 2000.0 }]
        """
    )
    system = ss.load_system(path)
    assert system.springs[0].nodes == ((0.0, 0.0), (0.04, 0.0), (0.05, 100.0))
    assert ss.Oscillator.from_dict(system.to_dict()) == system
    small, scale = ss.dimensionless(system)
    slow, fast = ss.simulate(system, 5.0).events["t"], ss.simulate(small, 5.0 / scale.time).events["t"] * scale.time
    assert len(slow) > 4
    assert np.abs(slow - fast).max() < 1e-10
    diagram = ss.orbit_diagram(system, "springs.0.nodes.1.0", [0.03, 0.04], periods=40)
    assert "stick_slip" in diagram["regime"].values


def test_what_a_spring_cannot_be_is_refused_in_one_sentence():
    with pytest.raises(ss.InputError, match="two nodes or more"):
        ss.Oscillator(0.1, S, STATIC, springs=ss.Spring(((0.0, 0.0),)))
    with pytest.raises(ss.InputError, match="nodes of a spring"):
        ss.Oscillator(0.1, S, STATIC, springs=ss.Spring(((1.0, 0.0), (0.0, 1.0))))
    with pytest.raises(ss.InputError, match="spring 0 must join"):
        ss.Oscillator(0.1, S, STATIC, springs=ss.Spring(cubic=1.0, mass=1))
    with pytest.raises(ss.InputError, match="no derivative is known through springs"):
        ss.periodic_orbit(ss.Oscillator(0.1, S, STATIC, springs=ss.Spring(cubic=1.0)))


def test_the_map_of_feeny_and_moon_has_one_dimension_and_one_turning_point():
    """In the chaotic motion every period has a phase at which the mass sticks: from one such place follows the next."""
    motion = script("known.others").feeny_moon(0.5, 700)
    places, v = motion.at(np.arange(100, 700) * 2 * np.pi / 1.25)
    assert np.abs(v).max() == 0.0
    order = np.argsort(places[:-1])
    x, image = places[:-1][order], places[1:][order]
    apart = np.diff(x) > 1e-6
    slopes = np.diff(image)[apart] / np.diff(x)[apart]
    # Neighbours have neighbours: the map is a curve. It falls, turns once, and rises.
    assert np.abs(np.diff(image)).max() < 0.05
    assert np.count_nonzero(np.diff(np.sign(slopes[np.abs(slopes) > 0.05]))) == 1
    assert 0.7 < x[image.argmin()] < 0.85
    # It stretches: chaos. No period of up to eight.
    assert np.mean(np.log(np.abs(slopes))) > 0.3
    assert all(np.abs(places[n:] - places[:-n]).max() > 0.1 for n in range(1, 9))
    assert set(motion.events["kind"]) == {"release", "capture", "crossing", "parting", "meeting"}


@pytest.mark.slow
def test_the_least_bow_force_falls_about_with_the_square_of_the_distance_from_the_bridge():
    """Raman and Schelleng: f_min ∝ 1/β². Below it a second slip comes in, or the bow holds no longer."""
    bowed = script("known.others").bowed_string

    def least(at: int) -> float:
        low, high = 0.5, 30.0
        for _ in range(8):
            force = math.sqrt(low * high)
            slips, share = bowed(at, force)
            low, high = (low, force) if slips == 1.0 and share > 0.5 else (force, high)
        return high

    places = np.array([3, 4, 5, 6, 8])
    forces = [least(int(at)) for at in places]
    assert (np.diff(forces) < 0).all()
    assert -2.3 < np.polyfit(np.log(places), np.log(forces), 1)[0] < -1.5


@pytest.mark.parametrize(
    ("name", "ask"),
    [
        ("periodic_orbit", ss.periodic_orbit),
        ("continuation", lambda system: ss.continuation(system, "contacts.0.drive_velocity", (0.2, 0.4))),
        ("lyapunov", lambda system: ss.lyapunov(system, 100.0)),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_needs_derivatives_says_that_springs_in_pieces_have_none(name, ask):
    # No other guess helps, so none is asked for.
    chain = ss.chain(2, ss.laws.StaticKinetic(1.0, 0.6), 0.3)
    stop = ss.Spring(((0.0, 0.0), (0.5, 0.0), (1.5, 40.0)))
    with pytest.raises(
        ss.InputError, match=f"^{name}: no derivative is known through springs that are not linear"
    ) as said:
        ask(replace(chain, springs=stop))
    assert "guess" not in str(said.value)


def test_a_stop_keeps_the_sign_of_its_stiffness_and_may_stand_at_rest() -> None:
    assert ss.Spring.stop(0.3, -10.0).nodes[-1] == (1.3, -10.0)
    assert ss.Spring.stop(-0.3, 10.0).nodes[0] == (-1.3, -10.0)
    assert ss.Spring.stop(0.0, 10.0).nodes == ((-1.0, 0.0), (0.0, 0.0), (1.0, 10.0))
    assert ss.Spring.stop(-0.0, 10.0).nodes == ((-1.0, -10.0), (0.0, 0.0), (1.0, 0.0))
    assert ss.Spring.backlash(0.0, 4.0).nodes == ((-1.0, -4.0), (1.0, 4.0))
    with pytest.raises(ss.InputError, match=r"expected a gap of at least 0, got -0\.3"):
        ss.Spring.backlash(-0.3, 1.0)
    assert ss.simulate(
        ss.Oscillator(0.1, 0.0, ss.laws.Coulomb(0.1), springs=ss.Spring.stop(0.0, 9.0)), 20.0, x0=2.0
    ).stop


def test_the_first_force_needs_no_number_in_its_name() -> None:
    oscillator = ss.Oscillator(0.1, 0.2, ss.laws.Coulomb(0.5), forcing=ss.Harmonic(0.3, 1.1))
    assert oscillator.with_number("forcing.frequency", 1.2) == oscillator.with_number("forcing.0.frequency", 1.2)


def test_a_stick_under_a_load_that_follows_the_motion_does_not_grow_what_slip_left_in_a_derivative():
    def pair(kinetic: float) -> ss.System:
        law = ss.laws.ExponentialStribeck(0.85, kinetic, 0.3, 0.1)
        load = ss.NormalForce(1.2, position=-0.15)
        return ss.System(
            [1.0, 1.3], [[1.5, -0.5], [-0.5, 1.2]], 0.1, (ss.Contact(1, law, 0.43, other=0, normal_force=load),)
        )

    found = ss.sensitivities(ss.simulate(pair(0.5), 14.0), ["contacts.0.law.kinetic"])["t"].to_numpy().ravel()
    more, less = (ss.simulate(pair(0.5 + step), 14.0).events.t.to_numpy() for step in (1e-6, -1e-6))
    assert found.size == 6
    np.testing.assert_allclose(found, (more - less) / 2e-6, rtol=1e-6)
