//! What an event costs: `cargo run --release --example cost [CASE] [ROUNDS]`; the best of many rounds counts.

#![expect(clippy::print_stdout, reason = "a table for whoever asks")]

use std::hint::black_box;
use std::sync::LazyLock;
use std::time::Instant;

use serde_json::json;
use stickslip::batch::Batch;
use stickslip::engine::{Closed, Engine, Steps};
use stickslip::event_sequence;
use stickslip::harmonic::Harmonic;
use stickslip::lanes::{LaneMotion, Width, forward};
use stickslip::law::{
    BogaczRyczek, ConstantOrNodes, DwellTime, ExponentialStribeck, ForceRate, Law, PiecewiseLinear, Rational,
    StaticKinetic, TwoBranch,
};
use stickslip::mode::Kind;
use stickslip::model::Start;
use stickslip::network;
use stickslip::observer::Observer;
use stickslip::oscillator::Oscillator;
use stickslip::rows::Rows;
use stickslip::simulate::{Run, simulate};
use stickslip::steady_motion::Look;
use stickslip::sweep::Sweep;
use stickslip::system::{Contact, System};
use stickslip::variation::{self, Varied};

fn oscillator(
    law: impl Into<Law>,
    damping: f64,
    drive_velocity: f64,
    forcing: Option<(f64, f64)>,
) -> Oscillator {
    let forcing = forcing.map(|(amplitude, frequency)| Harmonic::new(amplitude, frequency, 0.0));
    Oscillator {
        forcing: forcing.into_iter().collect(),
        ..Oscillator::new(damping, drive_velocity, law)
    }
}

/// Seconds of the threads of this process on processors, where Linux says so: others may keep the cores busy. Else those that
/// passed.
fn processor() -> f64 {
    static BEGIN: LazyLock<Instant> = LazyLock::new(Instant::now);
    // Linux brings the sum up to date at a tick, which is milliseconds apart, and when a thread offers its core to others.
    std::thread::yield_now();
    let spent = std::fs::read_dir("/proc/self/task").ok().and_then(|threads| {
        threads
            .map(|thread| {
                let line = std::fs::read_to_string(thread.ok()?.path().join("schedstat")).ok()?;
                line.split(' ').next()?.parse::<f64>().ok()
            })
            .sum::<Option<f64>>()
    });
    spent.map_or_else(|| BEGIN.elapsed().as_secs_f64(), |nanoseconds| 1e-9 * nanoseconds)
}

fn best(rounds: u32, mut run: impl FnMut() -> (u64, u64)) -> (f64, u64, u64) {
    let mut best = f64::INFINITY;
    let mut counts = (0, 0);
    for _ in 0..rounds {
        let begin = processor();
        counts = run();
        best = best.min(processor() - begin);
    }
    (best * 1e9 / counts.0 as f64, counts.0, counts.1)
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let only = arguments.next().unwrap_or_default();
    let rounds: u32 = arguments
        .next()
        .map_or(200, |text| text.parse().expect("ROUNDS is a number"));
    let static_kinetic = |kinetic| StaticKinetic::new(1.0, kinetic);
    let stribeck = || PiecewiseLinear::new(vec![[0.0, 1.0], [0.2, 0.6], [0.3, 0.61]], 1.0);
    let dwell = DwellTime::new(0.5, 0.5, 0.4, 1.0);
    let paper = BogaczRyczek::default;
    let period = std::f64::consts::TAU / 0.7;
    let cases = [
        ("S3", oscillator(static_kinetic(0.6), 0.0, 0.2, None), 4000.0),
        ("P1", oscillator(static_kinetic(0.5), 0.05, 0.3, None), 4000.0),
        ("S16", oscillator(stribeck(), 0.05, 0.3, None), 4000.0),
        ("S15", oscillator(dwell.clone(), 0.0, 0.3, None), 4000.0),
        ("paper 0.2", oscillator(paper(), 0.28, 0.2, None), 4000.0),
        ("paper 0.3", oscillator(paper(), 0.28, 0.3, None), 4000.0),
        (
            "P3",
            oscillator(static_kinetic(0.5), 0.05, 0.3, Some((0.5, 0.7))),
            1000.0 * period,
        ),
        (
            "S16 forced",
            oscillator(stribeck(), 0.05, 0.3, Some((0.5, 0.7))),
            1000.0 * period,
        ),
        (
            "S15 forced",
            oscillator(dwell.clone(), 0.0, 0.3, Some((0.5, 0.7))),
            1000.0 * period,
        ),
        (
            "paper 0.2 forced",
            oscillator(paper(), 0.28, 0.2, Some((0.1, 1.25))),
            4000.0,
        ),
        (
            "paper 0.3 forced",
            oscillator(paper(), 0.28, 0.3, Some((0.1, 1.25))),
            4000.0,
        ),
    ];
    println!(
        "{:18}{:>10}{:>10}{:>14}",
        "case", "ns/event", "events", "evaluations"
    );
    for (name, oscillator, t_end) in cases {
        if !only.is_empty() && only != name {
            continue;
        }
        let run = || {
            simulate(black_box(&oscillator), Run::stuck(t_end))
                .expect("a good system")
                .work
        };
        let (time, events, evaluations) = best(rounds, || {
            let work = run();
            (work.events, work.evaluations)
        });
        println!(
            "{name:18}{time:10.1}{events:10}{:14.2}",
            evaluations as f64 / events as f64
        );
    }
    for (name, law) in [
        ("P4", static_kinetic(0.5).into()),
        ("P4 of lines", Law::from(stribeck())),
        ("P4 of dwell", dwell.into()),
        ("P4 of 1/(1 + 3w)", Rational::new(1.0, 3.0).into()),
        (
            "P4 of Stribeck",
            ExponentialStribeck::new(1.0, 0.5, 0.1, 0.2, 1.0).into(),
        ),
        ("P4 of branches", held_branches()),
        ("P4 across branches", crossed_branches()),
        ("P4 of rates", loaded()),
        ("P4 of paper", paper().into()),
    ] {
        if only.is_empty() || only == name {
            sweep(name, &frequencies(&law), rounds.div_ceil(50));
        }
        let free = format!("{name} free");
        if only.is_empty() || only == free {
            sweep(&free, &drives(&law), rounds.div_ceil(50));
        }
    }
    for (name, run) in [("batch", batch as fn(u32)), ("map", map)] {
        if only.is_empty() {
            run(rounds.div_ceil(50));
        } else if only == name {
            run(rounds);
        }
    }
    if only.is_empty() || only == "S5" {
        let falling = Rational::new(1.0, 3.0);
        let system = System::from(&oscillator(falling, 0.0, 0.2, None));
        steps("S5", &system, 1000.0, rounds);
    }
    let forcing = Some((0.5, 0.7));
    for (name, law) in [
        ("follow P3", static_kinetic(0.5).into()),
        ("follow paper", Law::from(paper())),
    ] {
        if only.is_empty() || only == name {
            let rounds = if only.is_empty() {
                rounds.div_ceil(10)
            } else {
                rounds
            };
            followed(name, &oscillator(law, 0.28, 0.3, forcing), rounds);
        }
    }
    for blocks in [10, 20, 50, 100] {
        if only.is_empty() || only == "chains" {
            chain(blocks, rounds.div_ceil(50));
        } else if only == format!("chain of {blocks}") {
            chain(blocks, rounds);
        }
    }
}

/// The derivatives of 100 periods of the forcing by the start and seven numbers.
fn followed(name: &str, oscillator: &Oscillator, rounds: u32) {
    let t_end = 100.0 * std::f64::consts::TAU / 0.7;
    let sequence = event_sequence::run(oscillator, Run::stuck(t_end), || true).expect("a good system");
    let system = System::from(oscillator);
    let document = serde_json::to_value(oscillator).expect("an oscillator is a document");
    let law = match &oscillator.law {
        Law::BogaczRyczek(_) => ["/law/B/1", "/law/static_friction/limit"],
        _ => ["/law/break_away", "/law/kinetic"],
    };
    let numbers = [
        "/mass",
        "/stiffness",
        "/damping",
        "/drive_velocity",
        "/forcing/0/amplitude",
    ];
    let paths: Vec<String> = numbers.into_iter().chain(law).map(String::from).collect();
    let last = sequence.phases.last().expect("a phase").contact_modes.clone();
    let (time, phases, _) = best(rounds, || {
        let varied = Varied::new(&system, &document, &paths).expect("good numbers");
        let followed = variation::follow(
            &varied,
            &sequence.start,
            &sequence.phases,
            &last,
            variation::Keep::All,
            false,
            &mut || true,
        );
        (black_box(followed).expect("a good run").states.len() as u64, 0)
    });
    println!("{name:18}{time:10.1}{phases:10}");
}

struct Nobody;

impl Observer for Nobody {
    const PASSES: bool = false;
}

/// So many blocks on one drive, each on a spring to the ground and to its neighbours.
fn chain(blocks: usize, rounds: u32) {
    let mut system = System {
        mass: vec![vec![0.0; blocks]; blocks],
        stiffness: vec![vec![0.0; blocks]; blocks],
        damping: vec![vec![0.0; blocks]; blocks],
        contacts: Vec::new(),
        forcing: Vec::new(),
        springs: Vec::new(),
    };
    for i in 0..blocks {
        system.mass[i][i] = 1.0;
        system.damping[i][i] = 0.05;
        system.stiffness[i][i] += 1.0;
        if i > 0 {
            for (a, b, k) in [
                (i, i, 1.0),
                (i - 1, i - 1, 1.0),
                (i, i - 1, -1.0),
                (i - 1, i, -1.0),
            ] {
                system.stiffness[a][b] += k;
            }
        }
        system.contacts.push(Contact {
            mass: i,
            other: None,
            drive_velocity: 0.3.into(),
            law: StaticKinetic::new(1.0 + 0.3 * (1.7 * i as f64).sin(), 0.5).into(),
            normal_force: None,
        });
    }
    steps(&format!("chain of {blocks}"), &system, 40.0, rounds);
}

/// A system by Taylor steps.
fn steps(name: &str, system: &System, t_end: f64, rounds: u32) {
    let run = network::Run::driven(t_end);
    let (time, events, _) = best(rounds, || {
        let mut engine = Steps::new(system, run.clone()).expect("a good system");
        engine.go(t_end, 0.0, &mut Nobody).expect("a good run");
        (engine.events(), 0)
    });
    println!("{name:18}{time:10.1}{events:10}");
}

/// Slip is held between branches of which the falling one lies below.
fn held_branches() -> Law {
    TwoBranch {
        rising: ConstantOrNodes::Nodes(vec![[0.0, 1.0], [0.6, 0.7]]),
        falling: ConstantOrNodes::Nodes(vec![[0.0, 0.5], [0.6, 0.6]]),
        break_away: 1.0,
    }
    .into()
}

/// Friction jumps between branches of which the falling one lies above.
fn crossed_branches() -> Law {
    TwoBranch {
        rising: ConstantOrNodes::Nodes(vec![[0.0, 1.0], [0.2, 0.5], [0.6, 0.6]]),
        falling: ConstantOrNodes::Nodes(vec![[0.0, 0.9], [0.6, 0.8]]),
        break_away: 1.0,
    }
    .into()
}

/// Static friction that feels the force rate.
fn loaded() -> Law {
    ForceRate {
        kinetic: 0.5,
        limit: 0.5,
        rate: 0.4,
        force_rate_scale: 0.3,
        exponent: 1.0,
        force_rate_exponent: 1.0,
    }
    .into()
}

/// P3 under a law over a thousand frequencies, 400 periods of each.
fn frequencies(law: &Law) -> Vec<(Oscillator, Run)> {
    let runs = (0..1000).map(|i| {
        let frequency = 0.2 + 1.8 * f64::from(i) / 999.0;
        (
            oscillator(law.clone(), 0.05, 0.3, Some((0.5, frequency))),
            Run::stuck(400.0 * std::f64::consts::TAU / frequency),
        )
    });
    runs.collect()
}

/// P1 under a law over a thousand drive velocities, 400 natural periods of each.
fn drives(law: &Law) -> Vec<(Oscillator, Run)> {
    let runs = (0..1000).map(|i| {
        (
            oscillator(law.clone(), 0.05, 0.1 + 0.4 * f64::from(i) / 999.0, None),
            Run::stuck(400.0 * std::f64::consts::TAU),
        )
    });
    runs.collect()
}

/// Many runs on one thread: one after the other, and in lanes of every width, in turns.
fn sweep(name: &str, runs: &[(Oscillator, Run)], rounds: u32) {
    let single = || {
        let events = runs.iter().map(|(one, run)| {
            if !one.closed() {
                let system = System::from(one);
                let mut engine = Steps::new(&system, network::Run::driven(run.t_end)).expect("a good system");
                engine.go(run.t_end, 0.0, &mut Nobody).expect("a good run");
                return engine.events();
            }
            let mut engine = Closed::new(one, *run, None);
            engine.go(run.t_end, 0.0, &mut Nobody).expect("a good run");
            engine.events()
        });
        (events.sum(), 0)
    };
    let lanes = |width| {
        let mut motions: Vec<LaneMotion> = runs
            .iter()
            .map(|(one, run)| LaneMotion::new(one, *run, None))
            .collect();
        let tally = forward(&mut motions, width, &mut || true, None);
        (tally.events, tally.handed)
    };
    let widths: Vec<Width> = Width::ALL.into_iter().filter(|width| width.available()).collect();
    let mut rows = vec![(f64::INFINITY, 0, 0); widths.len() + 1];
    for _ in 0..rounds {
        let (one, others) = rows.split_first_mut().expect("a row");
        let faster = |row: &mut (f64, u64, u64), now: (f64, u64, u64)| {
            if now.0 < row.0 {
                *row = now;
            }
        };
        faster(one, best(1, single));
        for (row, width) in others.iter_mut().zip(&widths) {
            faster(row, best(1, || lanes(*width)));
        }
    }
    let names =
        std::iter::once(name.to_owned()).chain(widths.iter().map(|width| format!("{name} {width:?}")));
    for ((time, events, handed), name) in rows.into_iter().zip(names) {
        println!("{name:26}{time:10.1}{events:10}{handed:14}");
    }
}

/// P3 as a document, with a row for each pair of an amplitude and a frequency.
fn rows(values: Vec<f64>) -> Rows {
    let document = json!({
        "mass": 1.0, "stiffness": 1.0, "damping": 0.05, "drive_velocity": 0.3,
        "law": {"type": "StaticKinetic", "break_away": 1.0, "kinetic": 0.5},
        "forcing": [{"amplitude": 0.5, "frequency": 0.7, "phase": 0.0}],
    });
    Rows {
        document,
        names: vec!["forcing.0.amplitude".into(), "forcing.0.frequency".into()],
        values,
    }
}

/// P3 over a thousand frequencies, as many events as 400 periods of each have, from their documents, with the last release of
/// each.
fn batch(rounds: u32) {
    let values = (0..1000).flat_map(|i| [0.5, 0.2 + 1.8 * f64::from(i) / 999.0]);
    let batch = Batch {
        rows: rows(values.collect()),
        t_end: 2910.0,
        max_events: 10_000_000,
        after: 0.0,
        section: Some(Kind::Release),
        keep: 1,
    };
    let (time, events, _) = best(rounds, || {
        let rows = batch.rows(0..1000, &|| true).expect("good rows");
        (rows.iter().flat_map(|row| row.counts).sum(), 0)
    });
    println!("{:18}{time:10.1}{events:10}", "batch");
}

/// A regime map: 300 periods of each point are left out, 32 looked at.
fn map(rounds: u32) {
    let share = |i: i32| f64::from(i) / 15.0;
    let points = (0..256).flat_map(|i| [0.02 + 1.58 * share(i / 16), 0.3 + 2.0 * share(i % 16)]);
    let sweep = Sweep {
        rows: rows(points.collect()),
        look: Look::new(300.0, 32.0),
    };
    let (time, events, _) = best(rounds, || {
        let rows = sweep.rows(0..256, &Start::default(), &mut || true);
        (rows.expect("good rows").iter().map(|row| row.events).sum(), 0)
    });
    println!("{:18}{time:10.1}{events:10}", "map");
}
