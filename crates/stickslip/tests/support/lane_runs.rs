//! Runs in lanes against runs of the engines of single motions.

use stickslip::harmonic::Harmonic;
use stickslip::lanes::{LaneMotion, OnEvent, Width, forward, goes_in_lanes};
use stickslip::law::{Friction, Law, Memory};
use stickslip::network;
use stickslip::orbit::{Event, Record, Segment};
use stickslip::oscillator::Oscillator;
use stickslip::simulate::{Run, resume, simulate};

use crate::dice::Dice;

/// An oscillator and a run, drawn.
pub(crate) type Draw = fn(&mut Dice) -> (Oscillator, Run);

pub(crate) fn all_forward(
    runs: &[(Oscillator, Run)],
    width: Width,
) -> (Vec<LaneMotion<'_>>, Vec<Vec<Event>>, u64) {
    let mut motions: Vec<LaneMotion> = runs
        .iter()
        .map(|(one, run)| LaneMotion::new(one, *run, None))
        .collect();
    let mut events = vec![Vec::new(); runs.len()];
    let on_event: OnEvent = &mut |index, event, _| events[index].push(*event);
    let tally = forward(&mut motions, width, &mut || true, Some(on_event));
    assert_eq!((tally.lanes, tally.others), (runs.len() as u64, 0));
    assert_eq!(
        tally.events,
        events.iter().map(|each| each.len() as u64).sum::<u64>()
    );
    for (motion, events) in motions.iter().zip(&events) {
        assert_eq!(motion.events, events.len() as u64);
    }
    (motions, events, tally.handed)
}

/// Keeps the events.
struct Events<'a>(&'a mut Vec<Event>);

impl Record for Events<'_> {
    fn segment(&mut self, _: Segment) {}

    fn event(&mut self, event: Event) {
        self.0.push(event);
    }
}

/// The largest difference of the events of two runs; infinite where they are not the same events.
pub(crate) fn apart(one: &[Event], other: &[Event]) -> f64 {
    if one.len() != other.len() {
        return f64::INFINITY;
    }
    let mut most = 0.0f64;
    for (a, b) in one.iter().zip(other) {
        if a.kind != b.kind || a.stick_time.is_nan() != b.stick_time.is_nan() {
            return f64::INFINITY;
        }
        let numbers = |event: &Event| [event.t, event.x, event.v, event.force];
        for (a, b) in numbers(a).iter().zip(numbers(b)) {
            most = most.max((a - b).abs());
        }
        if !a.stick_time.is_nan() {
            most = most.max((a.stick_time - b.stick_time).abs());
            most = most.max((a.force_rate - b.force_rate).abs());
        }
    }
    most
}

/// The same force in two halves, which the engine of single motions follows on its own: a single force goes in a lane there too.
pub(crate) fn halved(oscillator: &Oscillator) -> Oscillator {
    let half = |harmonic: &Harmonic| Harmonic {
        amplitude: 0.5 * harmonic.amplitude,
        ..*harmonic
    };
    Oscillator {
        forcing: oscillator.forcing.iter().flat_map(|one| [half(one); 2]).collect(),
        ..oscillator.clone()
    }
}

/// Whether a forced motion has the bits of a sweep when it goes alone too.
fn is_alone_in_a_lane(oscillator: &Oscillator) -> bool {
    let law = &oscillator.law;
    let turns = law.begin(0.0, f64::INFINITY, &mut Memory::default()).reverses;
    !(oscillator.forcing.is_empty() || law.smooth() || law.feels_force_rate() || turns)
}

/// The events of a motion by the engines of single motions that know no lanes.
fn single_events(oscillator: &Oscillator, run: Run) -> Vec<Event> {
    if is_alone_in_a_lane(oscillator) {
        return simulate(&halved(oscillator), run).unwrap().events;
    }
    if !oscillator.law.smooth() {
        return simulate(oscillator, run).unwrap().events;
    }
    let run = network::Run {
        x0: Some(vec![run.x0]),
        v0: run.v0.map(|v0| vec![v0]),
        t_end: run.t_end,
        max_events: run.max_events,
    };
    network::simulate(&oscillator.into(), run).unwrap().events
}

/// Every width against one lane, one lane against a single motion, and against the engine of single motions; what differs there by more than 1e-9 is
/// ill-conditioned: this engine differs more from itself at a drive velocity or a force that is off by 1e-12, or an event lies elsewhere on
/// one and the same motion. How many motions, events,
/// phases handed over and ill-conditioned motions there were.
pub(crate) fn compare(count: usize, seed: u64, draw: Draw) -> [u64; 4] {
    let mut dice = Dice(seed);
    let runs: Vec<(Oscillator, Run)> = (0..count).map(|_| draw(&mut dice)).collect();
    assert!(runs.iter().all(|(oscillator, _)| goes_in_lanes(oscillator)));
    let (lanes, mut events, handed) = all_forward(&runs, Width::One);
    for width in Width::ALL.into_iter().filter(|width| width.available()) {
        let (others, theirs, _) = all_forward(&runs, width);
        for (one, other) in lanes.iter().zip(&others) {
            let bits = |motion: &LaneMotion| {
                let clock = motion.hybrid.clock;
                [motion.x, motion.v, clock.high, clock.low].map(f64::to_bits)
            };
            assert_eq!(
                (bits(one), one.hybrid, one.events),
                (bits(other), other.hybrid, other.events),
                "{width:?}"
            );
        }
        for (one, other) in events.iter().zip(&theirs) {
            assert_eq!(apart(one, other), 0.0, "{width:?}");
        }
    }
    let (mut total, mut ill) = (0, 0);
    for ((motion, lane), (oscillator, run)) in lanes.iter().zip(&mut events).zip(&runs) {
        let smooth = oscillator.law.smooth();
        if is_alone_in_a_lane(oscillator) {
            let alone = simulate(oscillator, *run).unwrap().events;
            assert_eq!(apart(lane, &alone[..lane.len()]), 0.0);
        }
        // A slip that lasts for very long is left before its end: the other engine goes on from there.
        let restart = Run {
            x0: motion.x,
            v0: Some(motion.v),
            ..*run
        };
        if !smooth {
            resume(oscillator, restart, motion.hybrid, &mut Events(lane)).unwrap();
        }
        let lane = &lane[..];
        let single = single_events(oscillator, *run);
        total += single.len();
        let difference = apart(lane, &single);
        if difference <= 1e-9 {
            continue;
        }
        let spread = [1e-12, -1e-12].map(|off| {
            let mut beside = oscillator.clone();
            beside.drive_velocity *= 1.0 + off;
            let faster = apart(&single_events(&beside, *run), &single);
            beside.drive_velocity = oscillator.drive_velocity;
            for harmonic in &mut beside.forcing {
                harmonic.amplitude *= 1.0 + off;
            }
            faster.max(apart(&single_events(&beside, *run), &single))
        });
        let first = |least| {
            let mut pairs = lane.iter().zip(&single);
            pairs.find(|(a, b)| apart(&[**a], &[**b]) > least)
        };
        // Or the slip velocity hardly crosses zero there, so that its rounding moves the event along one and the same motion: by
        // little in a hop so short that what is off in the forces hardly counts.
        let along = |least, same| {
            first(least).is_some_and(|(a, b)| {
                let off = a.x - b.x - 0.5 * (a.v + b.v) * (a.t - b.t);
                (a.t - b.t).abs() < 1e-6 && off.abs() < same && (a.v - b.v).abs() < same
            })
        };
        let along = along(1e-11, 1e-12) || along(1e-12, 1e-14);
        let first = first(1e-11);
        assert!(
            spread[0].max(spread[1]) > difference.min(1e-6) || along,
            "{first:?} {} {} {oscillator:?} {run:?}",
            lane.len(),
            single.len()
        );
        ill += 1;
    }
    [count as u64, total as u64, handed, ill]
}

/// Motions have events, few phases are handed over, and few motions are ill-conditioned.
#[expect(clippy::print_stdout, reason = "counts for the page of speed")]
pub(crate) fn usual(counts: [u64; 4]) {
    let [count, total, handed, ill] = counts;
    let seen = format!("{total} events, {handed} handed over, {ill} of {count} ill-conditioned");
    assert!(
        total > 10 * count && handed < total / 100 && ill * 20 < count,
        "{seen}"
    );
    println!("{seen}");
}

/// As many motions as STICKSLIP_MOTIONS says, a thousand of one drawing after a thousand of the other, the first with the seed
/// STICKSLIP_SEED. What fails is named by its seed.
#[expect(clippy::print_stdout, reason = "so far as it came, if it is stopped")]
pub(crate) fn many<const N: usize>(draws: [Draw; N]) -> [[u64; 4]; N] {
    let number = |name, else_this| std::env::var(name).map_or(else_this, |text| text.parse().unwrap());
    let (asked, first): (usize, usize) = (
        number("STICKSLIP_MOTIONS", 100_000),
        number("STICKSLIP_SEED", 1000),
    );
    let mut counts = [[0; 4]; N];
    for seed in first..first + asked / 1000 {
        let kind = seed % N;
        let found = std::panic::catch_unwind(|| compare(1000, seed as u64, draws[kind]))
            .unwrap_or_else(|_| panic!("seed {seed}"));
        for (count, found) in counts[kind].iter_mut().zip(found) {
            *count += found;
        }
        if seed % 100 == 99 {
            println!("to seed {seed}: {counts:?}");
        }
    }
    counts
}

/// An oscillator that is forced three times of four, and a start at rest or in slip.
pub(crate) fn beside(law: Law, dice: &mut Dice) -> (Oscillator, Run) {
    let forced = dice.below(4) > 0;
    let oscillator = Oscillator {
        mass: dice.between(0.3, 3.0),
        stiffness: dice.between(1.0, 3.0),
        damping: dice.between(0.05, 0.2),
        drive_velocity: dice.between(0.02, 1.0),
        law,
        forcing: forced
            .then(|| {
                Harmonic::new(
                    dice.between(-1.5, 1.5),
                    dice.between(0.2, 3.0),
                    dice.between(-10.0, 10.0),
                )
            })
            .into_iter()
            .collect(),
    };
    let free = dice.below(2) == 0;
    let run = Run {
        x0: if free { dice.between(-2.0, 2.0) } else { 0.0 },
        v0: free.then(|| dice.between(-1.0, 1.0)),
        t_end: dice.between(50.0, 150.0),
        max_events: 10_000,
    };
    (oscillator, run)
}
