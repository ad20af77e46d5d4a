//! Smooth laws on Taylor steps: limit cycles known to 11 and 12 digits, met to one less.

use stickslip::law::{Cubic, ExponentialStribeck, Friction, Law, Lorentzian, Memory, Rational};
use stickslip::mode::Kind;
use stickslip::network::{Orbit, Run, simulate};
use stickslip::orbit::Event;
use stickslip::oscillator::Oscillator;
use stickslip::system::System;

fn belt(law: impl Into<Law>, damping: f64, drive_velocity: f64) -> System {
    System::from(&Oscillator::new(damping, drive_velocity, law))
}

fn close(got: f64, expected: f64, digits: i32) {
    let error = (got - expected).abs() / expected.abs();
    assert!(
        error < 10f64.powi(1 - digits),
        "got {got}, expected {expected}: relative error {error:.1e}"
    );
}

/// The last whole cycle: release, capture, next release.
fn cycle(orbit: &Orbit) -> [Event; 3] {
    let n = orbit.events.len();
    let last = if orbit.events[n - 1].kind == Kind::Release {
        n
    } else {
        n - 1
    };
    let cycle = [
        orbit.events[last - 3],
        orbit.events[last - 2],
        orbit.events[last - 1],
    ];
    assert_eq!(
        cycle.map(|event| event.kind),
        [Kind::Release, Kind::Capture, Kind::Release]
    );
    cycle
}

/// The least value of a coordinate within a cycle: the least of many samples, then again of samples around it.
fn least(orbit: &Orbit, [from, _, until]: &[Event; 3], pick: fn(f64, f64) -> f64) -> f64 {
    let (mut low, mut high) = (from.t, until.t);
    let mut least = f64::MAX;
    for _ in 0..3 {
        let step = (high - low) / 1000.0;
        let times: Vec<f64> = (0..=1000).map(|i| low + f64::from(i) * step).collect();
        let states = orbit.states(&times);
        let values = states.x.iter().zip(&states.v).map(|(&x, &v)| pick(x, v));
        let (i, value) = values.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        (low, high) = (times[i] - step, times[i] + step);
        least = value;
    }
    least
}

/// A start whose spring pulls harder than adhesion bears by 1700 roundings, where slip speeds itself up: it leaves as the linear
/// equation says, m ẅ = (k₁ − D) ẇ − k w with m ẇ(0) = k x₀ − μ_s, and the orbit between its steps is the motion of its run.
#[test]
fn a_start_beyond_the_limit_by_roundings_leaves_and_its_orbit_does_too() {
    let (m, k, d) = (
        1.548_752_655_287_615_6,
        0.000_326_629_140_961_169_9,
        0.044_983_007_622_389_735,
    );
    let law = Cubic::new(
        0.374_173_536_047_410_66,
        0.253_521_506_161_751_06,
        0.033_215_308_694_121_53,
    );
    let mut system = belt(law.clone(), d, 0.0);
    (system.mass, system.stiffness) = (vec![vec![m]], vec![vec![k]]);
    let run = Run {
        x0: Some(vec![1_145.560_787_829_365]),
        ..Run::driven(1000.0)
    };
    let orbit = simulate(&system, run).unwrap();
    // Of the two numbers as they are in binary.
    let excess = 9.584_496_679_408_484e-14;
    let (half, per_mass) = (0.5 * (law.linear - d) / m, k / m);
    let root = (half * half - per_mass).sqrt();
    for t in [20.0, 60.0, 100.0] {
        let w = excess / m * ((half + root) * t).exp() * (1.0 - (-2.0 * root * t).exp()) / (2.0 * root);
        let got = -orbit.states(&[t]).v[0];
        assert!((got / w - 1.0).abs() < 0.01, "{got} for {w} at {t}");
    }
    // Far from there friction grows with the cube of the slip speed.
    for t in 0..=1000 {
        assert!(orbit.states(&[f64::from(t)]).v[0].abs() < 4.0, "{t}");
    }
}

/// Slip begins far up the cube of friction, which changes the speed at once: its acceleration over the natural frequency, which a
/// weak spring makes small, is no speed that any motion has, and not what its digits count against. Unforced slip, crossings
/// and captures from the same equation in 40 digits (Taylor series of order 40).
#[test]
fn steep_friction_at_the_start_takes_no_digits_from_what_follows() {
    let check = |[m, k, s]: [f64; 3], law: Cubic, [x0, v0]: [f64; 2], times: &[f64]| {
        let mut system = belt(law, 0.0, s);
        (system.mass, system.stiffness) = (vec![vec![m]], vec![vec![k]]);
        let run = Run {
            x0: Some(vec![x0]),
            v0: Some(vec![v0]),
            ..Run::driven(60.0)
        };
        let orbit = simulate(&system, run).unwrap();
        for (event, &t) in orbit.events.iter().zip(times) {
            assert!((event.t - t).abs() < 1e-13 * t.max(10.0), "{} for {t}", event.t);
        }
    };
    check(
        [
            0.502_627_286_474_174_5,
            4.450_968_601_046_775e-7,
            -12.622_681_641_085_55,
        ],
        Cubic::new(
            0.851_386_818_005_526,
            0.862_626_305_039_009_7,
            0.798_123_386_850_963,
        ),
        [-1.674_923_287_700_966_3, -1.546_520_330_264_058],
        &[1.184_727_651_847_211_5],
    );
    check(
        [
            2.770_598_350_112_575_5,
            0.000_404_711_861_966_379_9,
            34.577_461_927_788_03,
        ],
        Cubic::new(
            0.268_806_638_197_808_5,
            0.462_624_395_912_226_1,
            2.183_622_576_700_131_4,
        ),
        [-1_834.604_544_650_802_2, -16.837_988_019_719_63],
        &[2.974_516_929_610_86, 50.591_038_669_148_45],
    );
}

/// In a unit of time so short that the last coefficients of a series are too small for a number, the motion is the same.
#[test]
fn a_motion_that_takes_very_long_has_the_digits_of_any_other() {
    let unit = 2.0_f64.powi(43);
    let usual = belt(Cubic::new(30.0, 0.4, 1e-4), 28.0, 2.0);
    let mut long = usual.clone();
    (long.mass[0][0], long.stiffness[0][0]) = (unit, 1.0 / unit);
    let [usual, long] = [(&usual, 1.0), (&long, unit)].map(|(system, unit)| {
        let run = Run {
            x0: Some(vec![0.0]),
            v0: Some(vec![0.0]),
            ..Run::driven(30.0 * unit)
        };
        simulate(system, run).unwrap()
    });
    for t in (1..=300).map(|i| 0.1 * f64::from(i)) {
        let (a, b) = (usual.states(&[t]), long.states(&[t * unit]));
        assert!((a.x[0] - b.x[0] / unit).abs() < 1e-13 * 30.0, "x at {t}");
        assert!((a.v[0] - b.v[0]).abs() < 1e-13 * 2.0, "v at {t}");
    }
}

/// Leine, van Campen, de Kraker & van den Steen, Nonlinear Dynamics 16 (1998) 41, their example; digits of ours (60-digit).
#[test]
fn s5_leine1998() {
    let law = Rational::new(1.0, 3.0);
    let orbit = simulate(&belt(law, 0.0, 0.2), Run::driven(200.0)).unwrap();
    let cycle = cycle(&orbit);
    let [release, capture, next] = &cycle;
    close(capture.t - release.t, 4.295_999_525_480_155, 12);
    close(capture.x, -0.541_006_353_870_085, 12);
    close(next.stick_time, 7.705_031_769_350_42, 12);
    close(next.t - release.t, 12.001_031_294_830_58, 12);
    close(-least(&orbit, &cycle, |x, _| -x), 1.133_944_676_442, 12);
    close(least(&orbit, &cycle, |x, _| x), -0.555_432_690_06, 11);
    close(least(&orbit, &cycle, |_, v| v), -0.839_902_049_281, 12);
}

/// Papangelo, Ciavarella & Hoffmann, Nonlinear Dynamics 90 (2017) 2037: the stick-slip cycle beside stable slip at v = 1.5.
#[test]
fn s7_papangelo_stable_cycle() {
    let law = ExponentialStribeck::new(1.0, 0.5, 0.5, 0.0, 1.0);
    let orbit = simulate(&belt(law, 0.1, 1.5), Run::driven(400.0)).unwrap();
    let cycle = cycle(&orbit);
    let [release, _, next] = &cycle;
    close(next.t - release.t, 6.316_306_357_891, 11);
    close(next.stick_time, 0.505_485_542_354, 11);
    close(-least(&orbit, &cycle, |x, _| -x), 2.206_496_130_15, 11);
    close(least(&orbit, &cycle, |x, _| x), -0.952_825_782_649, 11);
}

fn thomsen_fidlin() -> Cubic {
    let (at_rest, least, at) = (0.4, 0.25, 0.5);
    Cubic::new(
        at_rest,
        1.5 * (at_rest - least) / at,
        0.5 * (at_rest - least) / (at * at * at),
    )
}

/// Thomsen & Fidlin, Int. J. Non-Linear Mech. 38 (2003) 389, β = 0.05.
#[test]
fn s8_thomsen_fidlin() {
    let orbit = simulate(&belt(thomsen_fidlin(), 0.1, 0.1), Run::driven(200.0)).unwrap();
    let cycle = cycle(&orbit);
    let [release, _, next] = &cycle;
    close(next.t - release.t, 7.209_296_758_701, 11);
    close(next.stick_time, 2.148_884_511_447, 11);
    close(-least(&orbit, &cycle, |x, _| -x), 0.483_161_521_397, 11);
    close(least(&orbit, &cycle, |x, _| x), 0.151_840_125_188, 11);
}

/// The same above the end of stick-slip: slip alone, with the amplitude of the pure-slip cycle.
#[test]
fn s8_pure_slip_cycle() {
    let orbit = simulate(&belt(thomsen_fidlin(), 0.1, 0.43), Run::driven(6000.0)).unwrap();
    assert!(orbit.events.last().unwrap().t < 500.0);
    let times: Vec<f64> = (0..=200_000).map(|i| 5990.0 + f64::from(i) * 5e-5).collect();
    let x = orbit.states(&times).x;
    let most = x.iter().copied().fold(f64::MIN, f64::max);
    let least = x.iter().copied().fold(f64::MAX, f64::min);
    let amplitude = 0.5 * (most - least);
    assert!((amplitude - 0.196_716_470_765).abs() < 1e-9, "{amplitude}");
}

/// A fast mass that is braked through w = 0: friction with a peak of a small width there has died out on the way, and a Taylor
/// step that starts where it has must still see it come back. The law itself is the reference, along the whole motion.
#[test]
fn friction_that_had_died_out_comes_back() {
    for scale in [0.3, 0.1, 0.03, 0.01] {
        let gaussian = ExponentialStribeck::new(1.0, 0.3, scale, 0.2, 2.0);
        let lorentzian = Lorentzian::new(1.0, 0.3, scale, 0.2);
        for law in [Law::from(gaussian), lorentzian.into()] {
            for (x0, v0) in [(2.0, 1.5), (-3.0, 0.4), (0.5, -4.0)] {
                let run = Run {
                    x0: Some(vec![x0]),
                    v0: Some(vec![v0]),
                    ..Run::driven(20.0)
                };
                let orbit = simulate(&belt(law.clone(), 0.0, 0.5), run).unwrap();
                assert!(orbit.events.len() > 2, "{law:?} {x0} {v0}");
                follows(&law, &orbit);
            }
        }
    }
}

/// Friction is what the law says wherever the mass slips.
fn follows(law: &Law, orbit: &Orbit) {
    let times: Vec<f64> = (0..=20_000).map(|i| 0.001 * f64::from(i)).collect();
    let states = orbit.states(&times);
    for (i, t) in times.iter().enumerate().filter(|&(i, _)| !states.stuck[i]) {
        let w = states.w[i];
        let says = w.signum() * law.force(&law.begin(0.0, 0.0, &mut Memory::default()), w.abs());
        let got = states.force[i];
        assert!(
            (got - says).abs() < 1e-11,
            "{law:?} t {t} w {w}: {got} and {says}"
        );
    }
}

/// The numbers of a curve say what its law says, at every slip speed.
#[test]
fn curves_are_their_laws() {
    let mut seen = 0;
    for facts in Law::facts() {
        let mut document = facts.example.clone();
        document["type"] = facts.name.into();
        let mut laws: Vec<Law> = vec![serde_json::from_value(document.clone()).unwrap()];
        if facts.name == "ExponentialStribeck" {
            document["exponent"] = 2.0.into();
            laws.push(serde_json::from_value(document).unwrap());
        }
        for law in laws {
            let Some(curve) = law.curve() else { continue };
            let piece = law.begin(0.0, f64::INFINITY, &mut Memory::default());
            for i in 0..200 {
                let u = 0.01 * f64::from(i);
                assert!(
                    (curve.force(u) - law.force(&piece, u)).abs() < 1e-15,
                    "{law:?} at {u}"
                );
            }
            seen += 1;
        }
    }
    assert_eq!(seen, 7);
}
