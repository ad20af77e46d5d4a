//! Long runs: event times that keep their digits, work that stays what it is, touches that are no events.

mod support;

use stickslip::harmonic::Harmonic;
use stickslip::law::{
    BogaczRyczek, Coulomb, ExponentialStribeck, Friction, Law, PiecewiseLinear, StaticKinetic,
};
use stickslip::mode::Kind;
use stickslip::model::{Model, Start};
use stickslip::orbit::Orbit;
use stickslip::oscillator::Oscillator;
use stickslip::regime::Regime;
use stickslip::simulate::{Run, Stop, simulate, simulate_while};
use stickslip::steady_motion::{Look, steady};
use stickslip::surface::Surface;
use stickslip::system::System;
use support::close;

fn forced(
    law: impl Into<Law>,
    damping: f64,
    drive_velocity: f64,
    amplitude: f64,
    frequency: f64,
) -> Oscillator {
    Oscillator {
        forcing: vec![Harmonic::new(amplitude, frequency, 0.0)],
        ..Oscillator::new(damping, drive_velocity, law)
    }
}

fn times(orbit: &Orbit, kind: Kind) -> Vec<f64> {
    let events = orbit.events.iter().filter(|event| event.kind == kind);
    events.map(|event| event.t).collect()
}

/// f_s = 1, f_k = 1/2, s = 1/4 without damping: releases at 4 + n (4 + 2π − 2 atan 2), exact in binary but for the period.
#[test]
fn event_times_keep_their_digits_over_a_thousand_units() {
    // 4 + 2π − 2 atan 2 in two doubles (computed with 50 digits).
    const PERIOD: (f64, f64) = (8.068_887_871_591_405, 5.683_993_235_814_304e-17);
    let law = StaticKinetic::new(1.0, 0.5);
    let orbit = simulate(&Oscillator::new(0.0, 0.25, law), Run::stuck(1000.0)).unwrap();
    let releases = times(&orbit, Kind::Release);
    assert_eq!(releases.len(), 124);
    close(releases[1] - releases[0], PERIOD.0);
    for (n, t) in releases.iter().enumerate() {
        let n = n as f64;
        let error = t - n.mul_add(PERIOD.0, 4.0) - n * PERIOD.1;
        assert!(error.abs() < 2e-13, "release {n}: {error:e}");
    }
}

/// Once its transient has died out, a forced motion repeats itself with the period of the forcing, 2π/0.75.
#[test]
fn forced_event_times_keep_their_digits_over_a_thousand_units() {
    let system = forced(Coulomb::new(0.3), 0.5, 0.0, 1.0, 0.75);
    let orbit = simulate(&system, Run::stuck(1200.0)).unwrap();
    let crossings = times(&orbit, Kind::Crossing);
    let late: Vec<f64> = crossings.into_iter().filter(|t| *t > 180.0).collect();
    assert!(late.len() > 200, "{}", late.len());
    for (n, t) in late.iter().step_by(2).enumerate() {
        let error = t - (n as f64).mul_add(std::f64::consts::TAU / 0.75, late[0]);
        assert!(error.abs() < 4e-13, "crossing {n}: {error:e}");
    }
}

/// What an event costs, in evaluations of the motion: it does not depend on the machine.
#[test]
fn work_of_an_event() {
    let friction = StaticKinetic::new(1.0, 0.5);
    let stribeck = PiecewiseLinear::new(vec![[0.0, 1.0], [0.2, 0.6], [0.3, 0.61]], 1.0);
    let cases = [
        (Oscillator::new(0.05, 0.3, friction.clone()), 1.6),
        (Oscillator::new(0.05, 0.3, stribeck.clone()), 2.4),
        (forced(friction, 0.05, 0.3, 0.5, 0.7), 3.1),
        (forced(stribeck, 0.05, 0.3, 0.5, 0.7), 2.4),
    ];
    for (system, most) in cases {
        let work = simulate(&system, Run::stuck(2000.0)).unwrap().work;
        let evaluations = work.evaluations as f64 / work.events as f64;
        assert!(work.events > 200 && evaluations < most, "{evaluations}");
    }
}

/// Such a touch once held the search in steps too short to advance.
#[test]
fn a_forcing_of_hardly_any_force_ends_too() {
    let law = StaticKinetic::new(0.641_520_821_099_082_9, 0.641_520_821_099_082_9);
    let system = forced(law, 4.6e-80, 0.641_520_821_099_082_9, 4.6e-80, 0.2);
    let run = Run {
        x0: -2.479_770_228_019_108_7,
        ..Run::stuck(60.0)
    };
    let orbit = simulate(&system, run).unwrap();
    assert!(
        orbit.work.evaluations < 500 && orbit.work.grazes > 0,
        "{:?}",
        orbit.work
    );
}

/// With f_s = f_k and no damping every slip ends by touching zero slip velocity: a graze, counted and no event.
#[test]
fn a_touch_is_no_event() {
    let system = forced(Coulomb::new(1.125), 0.0, 1.0, 0.25, 2.0);
    let orbit = simulate(&system, Run::stuck(200.0)).unwrap();
    let last = orbit.events.last().unwrap();
    assert_eq!(last.kind, Kind::Release, "{last:?}");
    assert!(orbit.events.len() < 20, "{}", orbit.events.len());
    assert!(orbit.work.grazes > 0);
}

/// The paper's law climbs between its branches and is left amid the next one: every mode begins where the one before ended.
#[test]
fn modes_join_without_a_jump() {
    for amplitude in [0.1, 0.2, 0.3] {
        let oscillator = forced(BogaczRyczek::default(), 0.35, 0.3, amplitude, 0.35);
        let orbit = simulate(&oscillator, Run::stuck(12_000.0)).unwrap();
        assert_eq!(orbit.stop, Stop::End);
        let begins = &orbit.segments[1..];
        let before: Vec<f64> = begins
            .iter()
            .map(|segment| segment.clock.high.next_down())
            .collect();
        for (state, segment) in orbit.states(&before).iter().zip(begins) {
            assert!((state.x - segment.x).abs() < 1e-10, "{segment:?}");
            assert!((state.v - segment.v).abs() < 1e-10, "{segment:?}");
        }
    }
}

/// A steady slip whose swing has died out to denormal numbers once took 10¹⁵ steps to look at.
#[test]
fn a_motion_that_has_died_out_is_looked_at_in_no_time() {
    let paper = Model::Closed(Oscillator::new(0.35, 0.6, BogaczRyczek::default()));
    // Of a smooth law the slope of what has died out is rounding.
    let stribeck = ExponentialStribeck::new(1.0, 0.4, 0.2, 0.2, 1.0);
    let smooth = Model::Steps(System::from(&Oscillator::new(0.05, 1.0, stribeck)));
    for (model, periods) in [
        (&paper, [225.0, 230.0, 234.0, 1000.0]),
        (&smooth, [75.0, 100.0, 150.0, 200.0]),
    ]
    .into_iter()
    .flat_map(|(model, lengths)| lengths.map(|periods| (model, periods)))
    {
        let look = Look {
            points: 16,
            max_events: 10_000,
            ..Look::new(periods - 30.0, 30.0)
        };
        let mut asked = 0;
        let mut go_on = || {
            asked += 1;
            asked < 100
        };
        let mut engine = model.run(&Start::default(), look.max_events).unwrap();
        let surface = Surface::usual(model);
        let row = steady(&mut engine, model.period(), &surface, &look, &mut go_on).unwrap();
        assert_eq!(
            (row.stop, row.regime),
            (Stop::End, Regime::StableSlip),
            "{periods}"
        );
    }
}

/// One phase that never ends, one that ends after ages, and one whose forcing no step resolves: whoever watches can end each.
#[test]
fn a_search_without_an_event_can_be_ended() {
    let systems = [
        forced(Coulomb::new(0.1), 0.1, 5.0, 0.01, 1.3),
        forced(Coulomb::new(1.0), 0.1, 0.0, 0.9, 1.0),
        forced(BogaczRyczek::default(), 0.35, 0.3, 0.1, 1e9),
    ];
    for system in systems {
        let run = Run {
            v0: Some(0.0),
            ..Run::stuck(1e9)
        };
        let mut asked = 0;
        let orbit = simulate_while(&system, run, || {
            asked += 1;
            asked < 10
        })
        .unwrap();
        assert_eq!(orbit.stop, Stop::MaxSeconds);
        assert!(orbit.work.evaluations < 40_000, "{:?}", orbit.work);
        // As far as it came it is the run itself.
        let last = orbit.t_last();
        assert!(last > 0.0 && last < 1e9, "{last}");
        let whole = simulate(&system, Run { t_end: last, ..run }).unwrap();
        assert_eq!(orbit.states(&[0.9 * last]), whole.states(&[0.9 * last]));
    }
}

/// A forced motion that runs away along a falling line is told so at once, however long it was to run.
#[test]
fn a_forced_motion_that_runs_away_along_a_line_is_told_so() {
    let law = PiecewiseLinear::new(vec![[0.0, 1.0], [0.3, 0.0]], 1.0);
    let oscillator = forced(law, 0.0, 0.3, 0.5, 0.8);
    for t_end in [200.0, 236.0, 3000.0, 1e5] {
        let mut asked = 0;
        let orbit = simulate_while(
            &oscillator,
            Run {
                x0: 1.0,
                ..Run::stuck(t_end)
            },
            || {
                asked += 1;
                asked < 100
            },
        )
        .unwrap();
        assert_eq!(orbit.stop, Stop::Diverged, "{t_end}");
        assert!(orbit.work.evaluations < 10_000, "{:?}", orbit.work);
    }
}

/// A stick on a drive that moves on is no rest, however slow the drive: it breaks where k s t = f_s.
#[test]
fn slow_stick_slip_is_no_rest() {
    let line: Law = StaticKinetic::new(1.0, 0.5).into();
    let smooth: Law = ExponentialStribeck::new(1.0, 0.5, 0.1, 0.1, 1.0).into();
    for (law, drives) in [(&line, &[1e-5, 1e-4, 1e-3, 3e-3][..]), (&smooth, &[1e-3, 3e-3])] {
        for &drive in drives {
            let oscillator = Oscillator::new(0.05, drive, law.clone());
            let model = if law.smooth() {
                Model::Steps(System::from(&oscillator))
            } else {
                Model::Closed(oscillator)
            };
            let look = Look::new(300.0, 32.0);
            let mut engine = model.run(&Start::default(), look.max_events).unwrap();
            let surface = Surface::usual(&model);
            let row = steady(&mut engine, model.period(), &surface, &look, &mut || true).unwrap();
            assert_eq!(
                (row.stop, row.regime, row.period),
                (Stop::End, Regime::StickSlip, 1),
                "{drive}"
            );
            // Undamped slip would take 2 (f_s − f_k) of the force; the stick builds it up again.
            let slow = row.period_time * drive;
            assert!(slow > 0.8 && slow < 1.2, "{slow}");
        }
    }
    // What is driven to and fro, or not at all, may rest; heavy damping slips steadily once it slips.
    let still = Model::Closed(Oscillator::new(0.05, 0.0, line.clone()));
    let heavy = Model::Closed(Oscillator::new(100.0, 1e-4, line));
    for (model, regime) in [(still, Regime::AtRest), (heavy, Regime::StableSlip)] {
        let look = Look::new(300.0, 32.0);
        let mut engine = model.run(&Start::default(), look.max_events).unwrap();
        let surface = Surface::usual(&model);
        let row = steady(&mut engine, model.period(), &surface, &look, &mut || true).unwrap();
        assert_eq!((row.stop, row.regime), (Stop::End, regime));
    }
}
