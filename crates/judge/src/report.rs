//! What the engine says of a run: the only place that knows its types.

use serde_json::Value;
use stickslip::lanes::{LaneMotion, OnEvent, Width, forward, goes_in_lanes};
use stickslip::mode::Kind;
use stickslip::orbit::{Orbit, Record};
use stickslip::oscillator::Oscillator;
use stickslip::system::System;
use stickslip::{network, simulate};

use crate::problem::Problem;

/// An event, as it was reported.
#[derive(Clone, Copy, Debug)]
pub struct Event {
    /// Its kind.
    pub kind: Kind,
    /// At which contact; of [`Kind::Spring`] at which spring.
    pub contact: usize,
    /// Friction just before.
    pub force: f64,
    /// Time of adhesion before a release.
    pub stick_time: f64,
    /// d|F|/dt at a release.
    pub force_rate: f64,
}

/// Everything that happened at one time, and the state after it.
#[derive(Clone, Debug)]
pub struct Mark {
    /// When, as a sum.
    pub time: [f64; 2],
    /// x and ẋ.
    pub state: Vec<f64>,
    /// What happened.
    pub events: Vec<Event>,
    /// The signs of w after it, 0 where contacts stick.
    pub directions: Vec<f64>,
    /// Whether the bodies of each contact are apart after it.
    pub apart: Vec<bool>,
}

/// A state asked for at a time.
pub type Dense = Box<dyn Fn(&[f64]) -> Vec<Vec<f64>>>;

/// A run.
pub struct Report {
    /// The start, and every event.
    pub marks: Vec<Mark>,
    /// Why it ended.
    pub stop: &'static str,
    /// How often what looked like the last step to a root was not, so that its search went on.
    pub fallbacks: u64,
    /// Until when it is known.
    pub t_last: f64,
    /// x and ẋ at any times, as reported.
    pub dense: Dense,
}

/// Whether one mass on one constant drive can be asked of the closed form, and of which document.
fn oscillator(case: &Value) -> Option<Oscillator> {
    let mut document = case["sys"].clone();
    if document["forcing"].is_object() {
        document["forcing"] = Value::Array(vec![document["forcing"].clone()]);
    } else if document["forcing"].is_null() {
        document["forcing"] = Value::Array(Vec::new());
    }
    Oscillator::from_json(&document.to_string()).ok()
}

/// The same document as a system of one mass.
fn system(case: &Value) -> Result<System, String> {
    let document = &case["sys"];
    if document["contacts"].is_array() {
        return System::from_json(&document.to_string()).map_err(|error| error.to_string());
    }
    let forcing = match &document["forcing"] {
        Value::Null => Value::Array(Vec::new()),
        Value::Array(_) => document["forcing"].clone(),
        one => Value::Array(vec![one.clone()]),
    };
    let one = |name: &str| serde_json::json!([[document[name]]]);
    let mut document = serde_json::json!({
        "mass": one("mass"), "stiffness": one("stiffness"), "damping": one("damping"), "forcing": forcing,
        "contacts": [{"mass": 0, "drive_velocity": document["drive_velocity"], "law": document["law"]}],
    });
    for name in ["normal_force", "springs"] {
        if !case["sys"][name].is_null() {
            let to = if name == "springs" {
                &mut document
            } else {
                &mut document["contacts"][0]
            };
            to[name] = case["sys"][name].clone();
        }
    }
    System::from_json(&document.to_string()).map_err(|error| error.to_string())
}

/// How many events a run may have.
const MOST_EVENTS: u64 = 400;
/// How often a run may ask whether to go on.
const MOST_ASKS: u32 = 20_000;

/// Yes, so many times.
fn patience() -> impl FnMut() -> bool {
    let mut asks = 0;
    move || {
        asks += 1;
        asks <= MOST_ASKS
    }
}

/// The same run in lanes, and from where it leaves them by the engine of single motions.
fn in_lanes(mut orbit: Orbit) -> Result<Orbit, String> {
    let (oscillator, run) = (orbit.oscillator.clone(), orbit.run);
    orbit.segments.truncate(1);
    orbit.events.clear();
    let mut motions = [LaneMotion::new(&oscillator, run, None)];
    let on_event: OnEvent = &mut |_, event, segment| {
        orbit.event(*event);
        orbit.segment(*segment);
    };
    forward(&mut motions, Width::widest(), &mut || true, Some(on_event));
    let [motion] = motions;
    // Where it goes on, the mode it is in is told again.
    orbit.segments.pop();
    let rest = simulate::Run {
        x0: motion.x,
        v0: Some(motion.v),
        max_events: run.max_events - motion.events,
        ..run
    };
    (orbit.stop, orbit.work) =
        simulate::resume(&oscillator, rest, motion.hybrid, &mut orbit).map_err(|error| error.to_string())?;
    Ok(orbit)
}

/// Let the engine run a case; `series`: on Taylor series also where there is a closed form; `lanes`: in lanes.
///
/// # Errors
/// The engine's sentence.
pub fn run(case: &Value, problem: &Problem) -> Result<Report, String> {
    let series = case["engine"] == "series";
    let most = case["max_events"].as_u64().unwrap_or(MOST_EVENTS);
    let varies = !problem.springs.is_empty() || problem.contacts[0].normal.is_some();
    if let Some(oscillator) = oscillator(case).filter(|o| !series && !varies && o.closed()) {
        let run = simulate::Run {
            x0: problem.x0[0],
            v0: problem.v0.as_ref().map(|v0| v0[0]),
            t_end: problem.t_end,
            max_events: most,
        };
        let mut orbit =
            simulate::simulate_while(&oscillator, run, patience()).map_err(|error| error.to_string())?;
        if case["engine"] == "lanes" && goes_in_lanes(&oscillator) {
            orbit = in_lanes(orbit)?;
        }
        let mut marks = Vec::new();
        for (index, segment) in orbit.segments.iter().enumerate() {
            let event = index.checked_sub(1).map(|index| orbit.events.get(index));
            if matches!(event, Some(None)) {
                // Where the run was told to end.
                break;
            }
            let events = event.flatten().map(|event| Event {
                kind: event.kind,
                contact: 0,
                force: event.force,
                stick_time: event.stick_time,
                force_rate: event.force_rate,
            });
            marks.push(Mark {
                time: [segment.clock.high, segment.clock.low],
                state: vec![segment.x, segment.v],
                events: events.into_iter().collect(),
                directions: vec![segment.direction],
                apart: vec![false],
            });
        }
        let t_last = orbit.t_last();
        return Ok(Report {
            marks,
            stop: orbit.stop.name(),
            fallbacks: orbit.work.fallbacks,
            t_last,
            dense: Box::new(move |times| {
                orbit
                    .states(times)
                    .iter()
                    .map(|state| vec![state.x, state.v])
                    .collect()
            }),
        });
    }
    let run = network::Run {
        x0: Some(problem.x0.clone()),
        v0: problem.v0.clone(),
        t_end: problem.t_end,
        max_events: most,
    };
    let orbit =
        network::simulate_while(&system(case)?, run, patience()).map_err(|error| error.to_string())?;
    let (n, width) = (problem.n, orbit.width());
    let rows: Vec<&[f64]> = orbit.steps.chunks_exact(width).collect();
    let mark = |row: &[f64]| {
        let rubs = row[2 + 2 * n..].chunks_exact(4).take(problem.contacts.len());
        Mark {
            time: [row[0], row[1]],
            state: row[2..2 + 2 * n].to_vec(),
            events: Vec::new(),
            directions: rubs.clone().map(|rub| rub[0]).collect(),
            apart: rubs.map(|rub| rub[2] == f64::NEG_INFINITY).collect(),
        }
    };
    let mut marks: Vec<Mark> = rows.iter().take(1).map(|row| mark(row)).collect();
    if let Some(first) = marks.first_mut() {
        // What the orbit says of t = 0; its first step may begin on a drive from which that differs by rounding.
        let start = orbit.states(&[0.0]);
        first.state = [start.x, start.v].concat();
    }
    let mut events = orbit.events.iter().peekable();
    while let Some(first) = events.peek().copied() {
        // The last row of that time: the state after all that happened then.
        let after = rows.partition_point(|row| row[0] <= first.t);
        let mut group = match rows[..after].last() {
            Some(row) if row[0] == first.t => mark(row),
            _ => break,
        };
        while let Some(event) = events.next_if(|event| event.t == first.t) {
            group.events.push(Event {
                kind: event.kind,
                contact: event.contact as usize,
                force: event.force,
                stick_time: event.stick_time,
                force_rate: event.force_rate,
            });
        }
        marks.push(group);
    }
    Ok(Report {
        marks,
        stop: orbit.stop.name(),
        fallbacks: orbit.work.fallbacks,
        t_last: orbit.t_last(),
        dense: Box::new(move |times| {
            let states = orbit.states(times);
            let rows = states.x.chunks_exact(n).zip(states.v.chunks_exact(n));
            rows.map(|(x, v)| [x, v].concat()).collect()
        }),
    })
}
