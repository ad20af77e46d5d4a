"""Sections against the whole orbit they are cut from, and maps from one return to the next."""

import json
from dataclasses import replace

import numpy as np
import pytest

import stickslip as ss
from stickslip.dynamics import diagrams, sign_changes, steady_motion
from stickslip.dynamics.periodic.periodic_orbits import periodic_orbit
from stickslip.dynamics.sections import points_of
from stickslip.dynamics.surface import Surface
from stickslip.dynamics.sweep import NUMBERS, Chunk, Look, period_of
from stickslip.model.parameters import document_of

FORCED = ss.Oscillator(
    damping=0.05, drive_velocity=0.3, law=ss.laws.StaticKinetic(1.0, 0.5), forcing=ss.Harmonic(0.5, 0.7)
)
SYSTEMS = {
    "forced": FORCED,
    "two branches": ss.paper.oscillator(0.2),
    "two branches, forced": ss.paper.oscillator(0.3, ss.Harmonic(0.3, 1.1)),
    "dwell": ss.Oscillator(damping=0.02, drive_velocity=0.1, law=ss.laws.DwellTime(0.6, 1.0, 0.5)),
    "overdamped": ss.Oscillator(
        damping=2.5, drive_velocity=0.1, law=ss.laws.StaticKinetic(1.0, 0.5), forcing=ss.Harmonic(1.5, 0.3)
    ),
    "two tones": ss.Oscillator(
        damping=0.1,
        drive_velocity=0.2,
        law=ss.laws.Coulomb(0.5),
        forcing=[ss.Harmonic(0.8, 0.9), ss.Harmonic(0.3, 2.3, 1.0)],
    ),
}


@pytest.fixture(params=SYSTEMS.values(), ids=list(SYSTEMS))
def system(request):
    return request.param


def test_a_stroboscopic_section_is_the_orbit_at_these_times(system):
    points = ss.section(system, "strobe", period=2.5, start=0.7, t_end=200, transient=0.25)
    times = 0.7 + 2.5 * np.arange(20, 80)
    np.testing.assert_allclose(points["t"], times, rtol=1e-15)
    x, v = ss.simulate(system, 200).at(times)
    np.testing.assert_allclose(points["x"], x, atol=1e-13)
    np.testing.assert_allclose(points["v"], v, atol=1e-13)


@pytest.mark.parametrize("kind", ["release", "capture"])
def test_a_section_at_events_is_the_table_of_events(system, kind):
    if system is SYSTEMS["two tones"]:
        kind = "crossing"  # it never sticks
    points = ss.section(system, kind, t_end=200, transient=0.5)
    table = ss.simulate(system, 200).events.query("kind == @kind and t >= 100")
    assert len(table) > 3
    for name in ("t", "x", "v", "force", "stick_time", "force_rate"):
        np.testing.assert_array_equal(points[name], table[name])


@pytest.mark.parametrize("direction", [-1, 0, 1])
@pytest.mark.parametrize(("normal", "level"), [((0, 1), 0.0), ((1, 0), 0.3), ((0.6, -0.8), 0.2)])
def test_a_line_of_the_phase_plane_is_crossed_where_the_orbit_crosses_it(system, normal, level, direction):
    points = ss.section(system, normal=normal, level=level, direction=direction, t_end=150, transient=0.3)
    np.testing.assert_allclose(normal[0] * points["x"] + normal[1] * points["v"], level, atol=1e-12)
    # The other way of finding them: signs at 200 samples a period of the stored orbit.
    orbit = ss.simulate(system, 150)
    side = lambda t: normal @ np.stack(orbit.at(t)) - level  # noqa: E731
    samples = np.linspace(45.0, 150.0, int(200 * 105 / system.natural_period))
    np.testing.assert_allclose(points["t"], sign_changes(side, samples, direction), atol=1e-8)
    # Of the orbit that is there already they are the same.
    surface = Surface(normal=(*map(float, normal), 0.0), level=level, direction=direction)
    np.testing.assert_array_equal(points_of(orbit, surface, 45.0)[:, 0], points["t"])


def test_a_grazing_pair_of_crossings_is_not_missed():
    # x = cos t exactly: no friction acts, for the mass slips without force. The line x = 1 − 1e-10 is crossed twice within
    # 2 arccos(1 − 1e-10) = 2.8e-5 time units, at every turn of 2π.
    free = ss.Oscillator(damping=0.0, drive_velocity=10.0, law=ss.laws.Coulomb(0.0))
    points = ss.section(free, normal=(1, 0), level=1 - 1e-10, t_end=60, transient=0.0, x0=1.0, v0=0.0)
    half = np.arccos(1 - 1e-10)
    turns = 2 * np.pi * np.arange(1, 10)
    expected = np.sort(np.concatenate([[half], turns - half, turns + half]))
    np.testing.assert_allclose(points["t"], expected[expected < 60], atol=1e-9)


def test_the_last_points_are_kept_and_memory_does_not_grow():
    every = ss.section(FORCED, t_end=2000, transient=0.0)
    last = ss.section(FORCED, t_end=2000, transient=0.0, most=7)
    np.testing.assert_array_equal(every["x"][-7:], last["x"])
    assert every["phase"].max() < 1e-9 or every["phase"].max() > 6.28


def test_sections_of_smooth_laws_and_many_masses():
    smooth = ss.Oscillator(damping=0.0, drive_velocity=0.1, law=ss.laws.ExponentialStribeck(1.0, 0.6, 0.1))
    maxima = ss.section(smooth, t_end=200)
    assert np.abs(maxima["v"]).max() < 1e-8
    pair = ss.chain(2, coupling=1.0, law=ss.laws.StaticKinetic(1.0, 0.6), drive_velocity=0.1)
    for contact in (0, 1):
        points = ss.section(pair, "release", t_end=200, contact=contact)
        table = ss.simulate(pair, 200).events.query("kind == 'release' and t >= 100 and contact == @contact")
        np.testing.assert_array_equal(points["t"], table["t"])


SMOOTH = ss.Oscillator(damping=0.05, drive_velocity=0.1, law=ss.laws.ExponentialStribeck(1.0, 0.6, 0.1))


def test_a_grazing_pair_of_crossings_is_not_missed_by_taylor_steps_either():
    # As above: x = cos t, but a drive along a table has no closed form here.
    drive = ss.Drive(10.0, nodes=[(0.0, 0.0), (1.0, 0.0)])
    free = ss.Oscillator(damping=0.0, drive_velocity=drive, law=ss.laws.Coulomb(0.0))
    assert not free.closed_form
    points = ss.section(free, normal=(1, 0), level=1 - 1e-10, t_end=60, transient=0.0, x0=1.0, v0=0.0)
    half = np.arccos(1 - 1e-10)
    turns = 2 * np.pi * np.arange(1, 10)
    expected = np.sort(np.concatenate([[half], turns - half, turns + half]))
    np.testing.assert_allclose(points["t"], expected[expected < 60], atol=1e-8)


def test_the_slip_velocity_of_a_section_is_that_of_its_contact():
    # The upper mass rides on the lower one, which the belt pulls.
    law = ss.laws.StaticKinetic(1.0, 0.6)
    contacts = [ss.Contact(0, law, 0.2), ss.Contact(1, ss.laws.StaticKinetic(0.3, 0.1), other=0)]
    pair = ss.System([1.0, 0.5], [[1.5, 0.0], [0.0, 0.8]], 0.02, contacts)
    points = ss.section(pair, "maximum", t_end=60, contact=1)
    orbit = ss.simulate(pair, 60)
    seen = orbit.to_xarray(points["t"].to_numpy())["slip_velocity"].to_numpy()[:, 1]
    assert len(seen) > 5
    np.testing.assert_allclose(points["slip_velocity"], seen, atol=1e-9)
    np.testing.assert_allclose(points["v"], 0.0, atol=1e-9)


@pytest.mark.parametrize("system", [SMOOTH, SYSTEMS["two branches, forced"]], ids=["steps", "closed"])
def test_what_is_steady_in_a_kept_orbit_is_what_a_run_tells(system):
    look = Look(transient=30, window=10, tolerance=1e-6, points=8)
    row = rows_of(system, "drive_velocity", [system.drive_velocity], look)
    orbit = ss.simulate(system, 40 * period_of(system))
    motion = steady_motion(orbit, 0.25)
    assert motion["regime"] == row["regime"][0]
    for name in ("amplitude", "x_min", "x_max", "w_min", "w_max", "stuck_share"):
        assert motion[name] == pytest.approx(row[name][0], abs=1e-12)
    for name in ("turning_x", "turning_slip_velocity"):
        np.testing.assert_allclose(motion[name][-8:], row[name][0], atol=1e-12)


@pytest.mark.long
def test_a_law_with_a_state_is_seen_by_the_same_observers():
    law = ss.laws.LuGre(100.0, 2.0, 0.1, kinetic=0.6, break_away=1.0, scale=0.1)
    system = ss.Oscillator(damping=0.1, drive_velocity=0.1, law=law)
    orbit = ss.simulate(system, 120)
    maxima = ss.section(system, "maximum", t_end=120)
    # The other way: signs of ẋ on the dense output of the integrator.
    times = sign_changes(lambda t: orbit.at(t)[1], np.linspace(60.0, 120.0, 4000), -1)
    np.testing.assert_allclose(maxima["t"], times, atol=1e-6)
    np.testing.assert_allclose(maxima["x"], orbit.at(times)[0], atol=1e-9)
    motion = steady_motion(orbit, 0.5)
    assert motion["regime"] == orbit.regime() == "stick_slip"
    assert motion["x_max"] == pytest.approx(orbit.at(times)[0].max(), abs=1e-9)


def test_basins_of_a_smooth_law_cost_what_their_runs_cost():
    import time

    x, v = np.linspace(-1, 2, 6), np.linspace(-0.5, 0.5, 4)
    began = time.thread_time()
    for start in x:
        for speed in v:
            ss.simulate(SMOOTH, 60 * SMOOTH.natural_period, start, speed)
    loop = time.thread_time() - began
    look = Look(transient=40, window=20, tolerance=1e-4)
    starts = np.stack([mesh.ravel() for mesh in np.meshgrid(x, v)], axis=1)
    chunk = Chunk(SMOOTH.to_json(), ("x0", "v0"), starts, look)
    began = time.thread_time()
    rows = chunk.compute()
    assert (rows["regime"] == "stick_slip").all()
    # Processor time of one thread, so that others on the machine do not count; it is 1.33 times the loop.
    assert time.thread_time() - began < 2 * loop


def test_the_release_map_predicts_the_releases_of_an_orbit():
    points = ss.section(FORCED, "release", t_end=600, transient=0.2)
    phase = points["phase"].to_numpy()
    forward = points["force"].to_numpy() > 0
    image = ss.release_map(FORCED, phase[:-1][forward[:-1]])["image"].to_numpy()
    turn = np.exp(1j * (image - phase[1:][forward[:-1]]))
    assert len(image) > 20
    np.testing.assert_allclose(np.abs(turn - 1), 0, atol=1e-9)


def test_a_fixed_point_of_the_release_map_is_a_periodic_motion():
    system = ss.Oscillator(
        damping=0.0, drive_velocity=0.2, law=ss.laws.StaticKinetic(1.0, 0.6), forcing=ss.Harmonic(0.1, 0.75)
    )
    points = ss.section(system, "release", t_end=4000, transient=0.9)
    theta = float(points["phase"][-1])
    near = ss.release_map(system, theta + np.array([-1e-4, 0.0, 1e-4]))
    assert abs(float(near["image"][1]) - theta) < 1e-9
    assert abs(float(near["slope"][1])) < 1


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: ss.section(FORCED, "relase", t_end=10), "did you mean 'release'"),
        (lambda: ss.section(SYSTEMS["dwell"], "strobe", t_end=10), "no forcing; say the period"),
        (lambda: ss.section(FORCED, period=-1.0, t_end=10), "period must be greater than 0"),
        (lambda: ss.section(FORCED, normal=(0, 0), t_end=10), "two numbers"),
        (lambda: ss.section(FORCED, "release", normal=(1, 0), t_end=10), "on be left out"),
        (lambda: ss.section(FORCED, normal=(1, 0), direction=2, t_end=10), "direction must be"),
        (lambda: ss.section(FORCED, t_end=0.0), "t_end"),
        (lambda: ss.section(FORCED, t_end=10, most=0), "most must be"),
        (lambda: ss.return_map(ss.section(FORCED, t_end=100), "speed"), "quantity must be one of t, x, v"),
        (lambda: ss.return_map(ss.section(FORCED, t_end=10)), "simulate longer"),
        (lambda: ss.release_map(SYSTEMS["dwell"], [0.0]), "one harmonic force"),
        (lambda: ss.release_map(SYSTEMS["two branches, forced"], [0.0]), "more than one dimension"),
    ],
)
def test_refusals_are_one_sentence(call, sentence):
    with pytest.raises(ss.InputError, match=sentence) as refusal:
        call()
    assert "\n" not in str(refusal.value)


ENGINES = ("closed form", "Taylor steps")


def rows_of(system, path, values, look, engine="closed form"):
    """Rows of one oscillator, in closed form or as a system of one mass by Taylor steps."""
    if engine == "Taylor steps":
        system, path = system.to_system(), path if path.startswith("forcing") else f"contacts.0.{path}"
    return Chunk(system.to_json(), (path,), np.reshape(values, (-1, 1)), look).compute()


def test_both_engines_give_the_same_rows(system):
    look = Look(transient=40, window=20, tolerance=1e-6, points=12)
    closed, steps = (rows_of(system, "drive_velocity", np.linspace(0.05, 0.6, 8), look, engine) for engine in ENGINES)
    assert closed.keys() == steps.keys()
    for name in ("regime", "period", "loops", "stop"):
        np.testing.assert_array_equal(closed[name], steps[name], err_msg=name)
    # What has come to rest turns by its rounding.
    moves = closed["regime"] != "stable_slip"
    np.testing.assert_array_equal(closed["events"][moves], steps["events"][moves])
    steps["x_end"], steps["v_end"] = steps["x_end"][:, 0], steps["v_end"][:, 0]
    # Where x touches an extreme it is flat: the time is less exact than the position.
    numbers = (*NUMBERS, "x_end", "v_end")
    for name in numbers:
        atol = 1e-6 if name == "period_time" else 1e-8
        np.testing.assert_allclose(closed[name], steps[name], atol=atol, err_msg=name)
    # A point at either end of the window is there or not by rounding.
    for name in ("turning_x", "turning_slip_velocity", "section_x"):
        for extreme in (np.nanmin, np.nanmax):
            spread = [extreme(rows[name][moves], axis=1) for rows in (closed, steps)]
            np.testing.assert_allclose(*spread, atol=1e-8, err_msg=name)


@pytest.mark.parametrize("engine", ENGINES)
def test_chaos_is_told_from_a_torus_and_from_a_period(engine):
    # Without friction or damping x = a cos t + b cos(t/√2) never repeats: a torus.
    free = ss.Oscillator(damping=0.0, drive_velocity=9.0, law=ss.laws.Coulomb(0.0), forcing=ss.Harmonic(1.0, 2**-0.5))
    look = Look(transient=20, window=32, tolerance=1e-5, decide=500)

    def rows(system, frequency):
        return rows_of(system, "forcing.0.frequency", [frequency], look, engine)

    torus = rows(free, 2**-0.5)
    assert torus["period"][0] == 0
    assert abs(torus["chaos"][0]) < 0.1
    # Neighbours part, see the test below.
    wild = rows(FORCED, 1.3)
    assert wild["period"][0] == 0
    assert wild["chaos"][0] > 0.9
    # Slow, but in the end it repeats after two periods.
    slow = rows(FORCED, 1.75)
    assert slow["period"][0] == 2
    assert np.isnan(slow["chaos"][0])


@pytest.mark.slow
def test_long_periods_and_weak_chaos_are_told_apart():
    # Known otherwise: periods from the returns of longer runs, chaos from exponents of +0.0093 and +0.0074.
    law = ss.laws.smooth_from_function(
        lambda w: 0.3 + 0.2 / (1 + 5 * w) ** 2 + 0.05 * w,
        w_max=3.0,
        derivative=lambda w: -2.0 / (1 + 5 * w) ** 3 + 0.05,
        break_away=0.55,
    )
    system = ss.Oscillator(0.08, 0.35, law, forcing=ss.Harmonic(0.1, 1.0))
    look = Look(transient=130, window=20, tolerance=1e-5, decide=500)
    rows = rows_of(system, "forcing.0.frequency", [0.83, 1.17, 1.2, 1.27, 0.78, 1.61], look, "closed form")
    assert rows["period"].tolist() == [13, 13, 11, 40, 0, 0]
    assert rows["recurrence"].tolist() == ["periodic"] * 4 + ["chaotic"] * 2
    # The 0-1 test calls both regular.
    assert (rows["chaos"][4:] < 0.2).all()


def test_a_torus_is_not_called_more_than_not_repeating():
    free = ss.Oscillator(damping=0.0, drive_velocity=9.0, law=ss.laws.Coulomb(0.0), forcing=ss.Harmonic(1.0, 2**-0.5))
    look = Look(transient=20, window=32, tolerance=1e-5)
    assert rows_of(free, "damping", [0.0], look, "closed form")["recurrence"] == ["undecided"]
    rows = rows_of(free, "damping", [0.0], replace(look, decide=500), "closed form")
    assert rows["recurrence"] == ["not_repeating"]
    assert rows["parting"][0] < 10


@pytest.mark.long
def test_a_motion_that_still_settles_is_undecided():
    # By Runge and Kutta's method with fixed steps the period doubles below 1.8414, and positions one forcing period apart
    # differ by 0.150 at 1.80, by 2.4e-4 at 1.845 and 2.8e-7 at 1.85 after 1500 periods, less and less.
    law = ss.laws.smooth_from_function(
        lambda w: 0.45 + 0.5 / (1 + 3 * w * w) + 0.08 * w + 0.05 * np.exp(-(((w - 1) / 0.3) ** 2)),
        w_max=6.0,
        break_away=1.05,
    )
    system = ss.Oscillator(0.03, 0.12, law, forcing=ss.Harmonic(0.5, 1.0))
    look = Look(transient=240, window=60, tolerance=1e-6, decide=500)
    # At 1.855 points two periods apart come to the tolerance before those one apart do.
    rows = rows_of(system, "forcing.0.frequency", [1.8, 1.84, 1.845, 1.85, 1.855, 1.9], look, "closed form")
    assert rows["recurrence"].tolist() == ["periodic", *["undecided"] * 4, "periodic"]
    assert rows["period"].tolist() == [2, 0, 0, 0, 0, 1]
    assert (rows["parting"][1:5] < 1).all()
    # Above the first Hopf speed, 0.06138, free oscillations come slowly to a small cycle: without forcing there is no torus.
    free = ss.Oscillator(0.1, 0.0615, law)
    start = (np.array(float(law.kinetic_force(0.0615)) + 0.005), np.array(0.0), ())
    rows = Chunk(free.to_json(), ("drive_velocity",), np.array([[0.0615], [0.0617]]), look, start=start).compute()
    assert rows["recurrence"].tolist() == ["undecided"] * 2


def test_a_heavily_damped_motion_on_its_way_is_undecided():
    # D/k = 1e4: the slip speed rises monotonically to that of the drive over some 1e4 time units, and meets no section.
    heavy = ss.Oscillator(1e4, 1e-4, ss.laws.Coulomb(0.5))
    look = Look(transient=300, window=32, tolerance=1e-6, decide=500)
    assert rows_of(heavy, "drive_velocity", [1e-4], look, "closed form")["recurrence"].tolist() == ["undecided"]


@pytest.mark.parametrize(
    ("damping", "speed", "law", "amplitude", "frequency"),
    [
        pytest.param(0.08, 1.22, ss.laws.ExponentialStribeck(1.0, 0.743, 0.43), 0.248, 2.166, marks=pytest.mark.long),
        (0.08, 1.22, ss.laws.ExponentialStribeck(1.0, 0.743, 0.43), 0.248, 2.32),
        pytest.param(
            0.186, 1.27, ss.laws.ExponentialStribeck(1.0, 0.431, 0.5245), 0.541, 1.3876, marks=pytest.mark.long
        ),
    ],
)
def test_a_spiral_to_a_motion_of_the_forcing_period_is_not_called_a_longer_period(
    damping, speed, law, amplitude, frequency
):
    # The multipliers lie near roots of 1 of orders 2, 7 and 4; all slip without sticks and have the period of the forcing.
    system = ss.Oscillator(damping, speed, law, forcing=ss.Harmonic(amplitude, frequency))
    assert periodic_orbit(system).forcing_periods == 1
    lengths = range(100, 600, 10)
    found = {int(rows_of(system, "drive_velocity", [speed], Look(length, 40, 1e-6))["period"][0]) for length in lengths}
    assert found == {0, 1}


@pytest.mark.parametrize(("amplitude", "frequency"), [(0.3, 1.96), (0.1, 1.4125)])
def test_weak_chaos_is_not_told_before_it_shows(amplitude, frequency):
    system = ss.Oscillator(0.05, 0.3, ss.laws.StaticKinetic(1.0, 0.5), forcing=ss.Harmonic(amplitude, frequency))
    look = Look(130.0, 20.0, 1e-6, decide=500)
    words = [
        rows_of(system, "drive_velocity", [0.3], replace(look, decide=decide))["recurrence"].item()
        for decide in (500, 5000)
    ]
    assert words == ["undecided", "chaotic"]


def test_the_motion_that_is_called_chaotic_parts_from_its_neighbours():
    system = ss.Oscillator(
        damping=0.05, drive_velocity=0.3, law=ss.laws.StaticKinetic(1.0, 0.5), forcing=ss.Harmonic(0.5, 1.3)
    )
    period = 2 * np.pi / 1.3
    one, other = (ss.section(system, t_end=600 * period, transient=0.0, x0=x0) for x0 in (0.1, 0.1 + 1e-9))
    apart = np.abs(one["x"] - other["x"]).to_numpy()
    assert apart[:5].max() < 1e-7
    assert apart[400:].max() > 0.1


@pytest.mark.parametrize("name", [name for name in SYSTEMS if name != "two tones"])
def test_a_chain_under_the_same_drive_is_one_run(name):
    system = SYSTEMS[name]
    # In the middle of a stick or a slip; where there is forcing after whole periods, as it begins anew.
    look = Look(40.0, 1.0 if system.forcing else 1.3, 1e-6, points=30)
    paths, value = ("drive_velocity",), system.drive_velocity
    chain = Chunk(json.dumps(document_of(system)), paths, np.full((3, 1), value), look, chain=True).compute()
    whole = ss.simulate(system, 3 * (look.transient + look.window) * period_of(system))
    assert chain["events"].sum() == whole.work.events
    x, v = whole.at(whole.t_end)
    np.testing.assert_allclose(chain["x_end"][-1], x, atol=1e-9)
    np.testing.assert_allclose(np.nan_to_num(chain["v_end"][-1], nan=value), v, atol=1e-9)


def test_a_motion_is_handed_on_with_what_its_contact_remembers():
    """Without its memory it would come to rest on a steep line of the paper's law at single values between the branches."""
    diagram = ss.orbit_diagram(
        ss.paper.oscillator(0.3), "drive_velocity", np.linspace(0.23, 0.41, 91), direction="up", periods=120
    )
    regime = diagram["regime"].to_numpy()
    changes = regime[np.flatnonzero(regime[1:] != regime[:-1]) + 1].tolist()
    assert [regime[0], *changes] == ["stick_slip", "almost_harmonic", "stable_slip"]


@pytest.mark.parametrize(
    ("law", "damping", "first", "ends"),
    [
        # Where stick-slip ends, by `critical_velocities`; a long plain run from rest agrees on either side of it.
        (ss.laws.ExponentialStribeck(1.0, 0.6, 0.1), 0.05, 1.46, 1.57246026),
        (ss.laws.StaticKinetic(1.0, 0.5), 0.1, 0.47, 0.54904631),
        (ss.laws.PiecewiseLinear(nodes=[(0.0, 1.0), (1.0, 0.6), (2.0, 0.8)], break_away=1.0), 0.0, 1.30, 1.35497010),
    ],
)
@pytest.mark.parametrize("periods", [150, 170])
def test_a_motion_that_is_swept_up_is_followed_to_where_it_ends(law, damping, first, ends, periods):
    system = ss.Oscillator(damping, first, law)
    for velocity, regime in ((ends - 1e-3, "stick_slip"), (ends + 1e-3, "stable_slip")):
        beside = Look(2000.0, 20.0, 1e-6)
        assert rows_of(system, "drive_velocity", [velocity], beside, "closed form")["regime"] == [regime]
    values = np.arange(first, ends + 0.03, 0.01)
    diagram = ss.orbit_diagram(system, "drive_velocity", values, direction="up", periods=periods)
    sticks = values[diagram["regime"].to_numpy() == "stick_slip"]
    assert ends - 0.01 < sticks[-1] < ends


def test_a_sweep_does_not_depend_on_how_it_is_cut_into_tasks(monkeypatch):
    system = ss.Oscillator(0.1, 0.5, ss.laws.StaticKinetic(1.0, 0.5))
    values = np.arange(0.5, 0.56, 0.01)

    def swept():
        return ss.orbit_diagram(system, "drive_velocity", values, direction=("up", "down"), periods=150)

    whole = swept()
    monkeypatch.setattr(diagrams, "CHUNK", 1)
    assert swept().equals(whole)
