//! Systems of masses: one mass against the closed form, energy balances, adhesion and slip where they belong.

use stickslip::drive::Harmonic;
use stickslip::law::{BogaczRyczek, DwellTime, Law, PiecewiseLinear, StaticKinetic};
use stickslip::mode::Kind;
use stickslip::network::{self, Run};
use stickslip::simulate;
use stickslip::structure::Oscillator;
use stickslip::system::{Contact, Force, System};

fn one_mass(oscillator: &Oscillator) -> System {
    System {
        mass: vec![vec![oscillator.mass]],
        stiffness: vec![vec![oscillator.stiffness]],
        damping: vec![vec![oscillator.damping]],
        contacts: vec![Contact {
            mass: 0,
            other: None,
            drive_velocity: oscillator.drive_velocity.into(),
            law: oscillator.law.clone(),
        }],
        forcing: oscillator
            .forcing
            .iter()
            .map(|harmonic| Force {
                mass: 0,
                amplitude: harmonic.amplitude,
                frequency: harmonic.frequency,
                phase: harmonic.phase,
            })
            .collect(),
    }
}

/// Both engines over 100 time units: the same events and, at 10,000 times, the same motion. The worst difference.
fn difference(oscillator: &Oscillator, x0: f64, v0: Option<f64>) -> f64 {
    let exact = simulate::simulate(
        oscillator,
        simulate::Run {
            x0,
            v0,
            ..simulate::Run::stuck(100.0)
        },
    )
    .unwrap();
    let run = Run {
        x0: Some(vec![x0]),
        v0: v0.map(|v| vec![v]),
        ..Run::driven(100.0)
    };
    let general = network::simulate(&one_mass(oscillator), run).unwrap();
    let kinds = |kinds: Vec<Kind>| kinds.iter().map(|kind| kind.name()).collect::<Vec<_>>();
    assert_eq!(
        kinds(general.events.iter().map(|event| event.kind).collect()),
        kinds(exact.events.iter().map(|event| event.kind).collect()),
        "{oscillator:?} from {x0}, {v0:?}"
    );
    let mut worst: f64 = 0.0;
    for (one, other) in general.events.iter().zip(&exact.events) {
        // A motion that dies out crosses nodes ever more slowly: its times, not its states, lose digits.
        let slow = matches!(one.kind, Kind::Node | Kind::Reversal);
        worst = worst.max((one.t - other.t).abs() * if slow { 0.0 } else { 1.0 });
        for (a, b) in [
            (one.v, other.v),
            (one.force, other.force),
            (one.stick_time, other.stick_time),
            (one.force_rate, other.force_rate),
        ] {
            assert_eq!(a.is_nan(), b.is_nan());
            worst = worst.max(if a.is_nan() { 0.0 } else { (a - b).abs() });
        }
    }
    let times: Vec<f64> = (0..10_000).map(|i| f64::from(i) * 0.01).collect();
    let states = general.states(&times);
    for (i, state) in exact.states(&times).iter().enumerate() {
        worst = worst
            .max((states.x[i] - state.x).abs())
            .max((states.v[i] - state.v).abs());
    }
    worst
}

fn oscillators() -> Vec<Oscillator> {
    let laws: [Law; 4] = [
        StaticKinetic {
            break_away: 1.0,
            kinetic: 0.6,
        }
        .into(),
        PiecewiseLinear {
            nodes: vec![[0.0, 1.0], [0.2, 0.6], [0.5, 0.63]],
            break_away: 1.0,
        }
        .into(),
        DwellTime {
            kinetic: 0.5,
            limit: 0.5,
            rate: 0.4,
            exponent: 1.0,
        }
        .into(),
        BogaczRyczek::default().into(),
    ];
    let mut all = Vec::new();
    for law in laws {
        for damping in [0.05, 0.28] {
            for drive_velocity in [0.1, 0.2, 0.3, 0.4] {
                for forcing in [
                    vec![],
                    vec![Harmonic {
                        amplitude: 0.1,
                        frequency: 1.25,
                        phase: 0.3,
                    }],
                ] {
                    all.push(Oscillator {
                        mass: 1.0,
                        stiffness: 1.0,
                        damping,
                        drive_velocity,
                        law: law.clone(),
                        forcing,
                    });
                }
            }
        }
    }
    all
}

/// The closed form and the Taylor steps share neither flow nor search.
#[test]
fn one_mass_agrees_with_the_closed_form() {
    for oscillator in oscillators() {
        for (x0, v0) in [(0.0, None), (1.2, Some(0.7))] {
            let worst = difference(&oscillator, x0, v0);
            // Some of the forced motions amplify a difference tenfold and more from stick to stick.
            let most = if oscillator.forcing.is_empty() {
                1e-11
            } else {
                1e-10
            };
            assert!(worst < most, "{oscillator:?} from {x0}, {v0:?}: {worst:.1e}");
        }
    }
}
