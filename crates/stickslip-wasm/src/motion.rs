//! Questions about one motion: its orbit as columns, and its states at other times.

use serde::Deserialize;
use serde_json::{Value, json};
use stickslip::hybrid_state::Restart;
use stickslip::lyapunov::spectrum;
use stickslip::model::{self, Model};
use stickslip::network::{self, Run, branch_of};
use stickslip::orbit;
use stickslip::regime::Regime;
use stickslip::rosenbrock::{CREEP_SPEED_RATIO, Integration};
use stickslip::simulate::{Run as OneRun, Stop, simulate_from};
use stickslip::state_law::StateLaw;
use stickslip::state_system::StateSystem;
use stickslip::system::System;

use crate::Desk;
use crate::ask::{read, sentence};

/// The error of a step of an integration: what a picture shows.
pub(crate) const TOLERANCE: f64 = 1e-6;
/// Most hundreds of its steps in one motion, so that the page does not stand still.
const MOST_HUNDREDS: u32 = 120;
const TOO_STIFF: &str = "12000 steps of its integration: the law is too stiff for this page; run the system by stickslip simulate, or shorten its time to run";

#[derive(Deserialize)]
struct Start {
    system: Value,
    t_end: f64,
    /// Position of each mass; one number for all.
    #[serde(default)]
    x0: Option<Vec<f64>>,
    #[serde(default)]
    v0: Option<Vec<f64>>,
    /// What the motion remembers of one that went before.
    #[serde(default)]
    memory: Option<Memory>,
    max_events: u64,
    /// Samples of each segment at least, its start among them.
    per_segment: usize,
    /// Samples, about, of the whole orbit; 0: the events alone.
    samples: usize,
}

/// How a motion goes on: numbers, null where there is none. In closed form those of a [`Restart`], of laws with an internal
/// state the variables that are integrated.
pub(crate) type Memory = Vec<Option<f64>>;

pub(crate) fn numbers(memory: &Memory) -> Vec<f64> {
    memory.iter().map(|value| value.unwrap_or(f64::NAN)).collect()
}

/// What a document describes, but for what has no events.
fn model(system: &Value) -> Result<Model, String> {
    if StateLaw::in_document(system) {
        return Err(
            "expected a law without an internal state, got one that is integrated: its motion has no derivative here"
                .into(),
        );
    }
    Model::read(system).map_err(sentence)
}

/// The right-hand side of masses under laws with an internal state.
pub(crate) fn state_system(system: &Value) -> Result<StateSystem, String> {
    let (system, _) = System::read(system).map_err(sentence)?;
    StateSystem::new(system).map_err(sentence)
}

/// The variables of a start, those of a motion that went before if they fit.
pub(crate) fn variables(
    system: &StateSystem,
    (x0, v0): (Option<&[f64]>, Option<&[f64]>),
    memory: Option<Vec<f64>>,
) -> Vec<f64> {
    let each = |values: &[f64]| match values {
        [one] => vec![*one; system.masses()],
        all => all.to_vec(),
    };
    memory
        .filter(|numbers| numbers.len() == system.width() && numbers.iter().all(|number| number.is_finite()))
        .unwrap_or_else(|| {
            system.variables(&x0.map_or_else(|| vec![0.0; system.masses()], each), v0.map(each))
        })
}

/// A whole motion: in events, with the natural period, or integrated.
#[expect(clippy::large_enum_variant, reason = "there is one at a time")]
pub(crate) enum Orbit {
    Events(model::Orbit, f64),
    Integrated(Integration, Stop),
}

impl Start {
    /// The motion, and how it goes on if that says more than its position and velocity.
    fn orbit(&mut self) -> Result<(Orbit, Vec<f64>), String> {
        let system = self.system.take();
        let memory = self.memory.as_ref().map(numbers);
        if StateLaw::in_document(&system) {
            let system = state_system(&system)?;
            let starts = (self.x0.as_deref(), self.v0.as_deref());
            if let Some(values) = [starts.0, starts.1]
                .into_iter()
                .flatten()
                .find(|values| values.len() != 1 && values.len() != system.masses())
            {
                return Err(format!(
                    "expected a start of {} masses, got {} numbers",
                    system.masses(),
                    values.len()
                ));
            }
            let y = variables(&system, starts, memory);
            let mut left = MOST_HUNDREDS;
            let mut go_on = || {
                left = left.saturating_sub(1);
                left > 0
            };
            let mut orbit = Integration::new(system, y, TOLERANCE).map_err(sentence)?;
            let stop = orbit.advance(self.t_end, 0.0, &mut go_on);
            let end = orbit.last();
            return Ok((Orbit::Integrated(orbit, stop), end));
        }
        let run = Run {
            x0: self.x0.take(),
            v0: self.v0.take(),
            t_end: self.t_end,
            max_events: self.max_events,
        };
        let model = model(&system)?;
        let period = model.natural_period();
        // As the core calls it elsewhere: another closure would be another copy of every loop.
        let go_on: &mut dyn FnMut() -> bool = &mut || true;
        if let Model::Closed(oscillator) = &model {
            let from = memory.as_deref().and_then(Restart::read);
            let (orbit, end) =
                simulate_from(oscillator, OneRun::of_one(&run), from, go_on).map_err(sentence)?;
            let end = end.map_or_else(Vec::new, |end| end.numbers().to_vec());
            return Ok((Orbit::Events(model::Orbit::Closed(orbit), period), end));
        }
        let orbit = model.simulate(run, go_on).map_err(sentence)?;
        Ok((Orbit::Events(orbit, period), Vec::new()))
    }

    /// The start of a segment and as many times in it as its share of the orbit asks for.
    fn times(&self, from: f64, to: f64, times: &mut Vec<f64>) {
        self.times_at_least(self.per_segment, from, to, times);
    }

    fn times_at_least(&self, least: usize, from: f64, to: f64, times: &mut Vec<f64>) {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a share of the samples"
        )]
        let share = ((to - from) / self.t_end * self.samples as f64).ceil() as usize;
        let count = share.clamp(least, self.samples.max(least));
        times.extend((0..count).map(|step| from + (to - from) * step as f64 / count as f64));
    }
}

/// A time within what begins at `t`: times of the core have two parts, and what `t` leaves out may put it before the begin.
fn inside(t: f64) -> f64 {
    if t == 0.0 { t } else { t.next_up() }
}

/// What a path says of each sample: time; of each mass x, v; of each contact w, force and mode (−1 stuck, else the branch).
#[derive(Default)]
struct Path {
    t: Vec<f64>,
    masses: Vec<[Vec<f64>; 2]>,
    contacts: Vec<[Vec<f64>; 3]>,
}

impl Path {
    fn new(masses: usize, contacts: usize) -> Self {
        Self {
            t: Vec::new(),
            masses: vec![Default::default(); masses],
            contacts: vec![Default::default(); contacts],
        }
    }

    fn push(&mut self, t: f64, mass: [f64; 2], contact: [f64; 3]) {
        self.t.push(t);
        for (column, value) in self.masses[0].iter_mut().zip(mass) {
            column.push(value);
        }
        for (column, value) in self.contacts[0].iter_mut().zip(contact) {
            column.push(value);
        }
    }

    /// Every segment with both its ends, so that friction may jump between two of them.
    fn exact(orbit: &orbit::Orbit, ask: &Start) -> Self {
        let s = orbit.oscillator.drive_velocity;
        let mut path = Self::new(1, 1);
        let mut times = Vec::new();
        for (index, segment) in orbit.segments.iter().enumerate() {
            let next = orbit.events.get(index);
            let stuck = segment.direction == 0.0;
            let mode = if stuck { -1.0 } else { f64::from(segment.branch) };
            times.clear();
            let to = next.map_or(orbit.t_last(), |event| event.t);
            // A stick that goes on began before.
            ask.times(inside(segment.clock.high).max(0.0), to, &mut times);
            for (&t, state) in times.iter().zip(orbit.states(&times)) {
                let w = if stuck { 0.0 } else { s - state.v };
                path.push(t, [state.x, state.v], [w, state.force, mode]);
            }
            if let Some(event) = next {
                let w = if stuck { 0.0 } else { s - event.v };
                path.push(event.t, [event.x, event.v], [w, event.force, mode]);
            } else if let Some(last) = orbit.states(&[orbit.t_last()]).first() {
                path.push(orbit.t_last(), [last.x, last.v], [s - last.v, last.force, mode]);
            }
        }
        path
    }

    fn taylor(orbit: &network::Orbit, ask: &Start) -> Self {
        let (masses, contacts, width) = (orbit.system.masses(), orbit.system.contacts.len(), orbit.width());
        let rows: Vec<&[f64]> = orbit.steps.chunks_exact(width).collect();
        let mut path = Self::new(masses, contacts);
        let mut branches = Vec::new();
        for (index, row) in rows.iter().enumerate() {
            let to = rows.get(index + 1).map_or(orbit.t_last(), |next| next[0]);
            let (from, to) = (inside(row[0]), to.next_down());
            if from < to {
                ask.times(from, to, &mut path.t);
                path.t.push(to);
            }
            branches.resize(path.t.len(), index);
        }
        let states = orbit.states(&path.t);
        for (i, columns) in path.masses.iter_mut().enumerate() {
            for (column, values) in columns.iter_mut().zip([&states.x, &states.v]) {
                column.extend(values.iter().skip(i).step_by(masses));
            }
        }
        for (c, [w, force, mode]) in path.contacts.iter_mut().enumerate() {
            w.extend(states.w.iter().skip(c).step_by(contacts));
            force.extend(states.force.iter().skip(c).step_by(contacts));
            let branch = 2 + 2 * masses + 4 * c + 3;
            let stuck = states.stuck.iter().skip(c).step_by(contacts);
            mode.extend(branches.iter().zip(stuck).map(|(&row, &stuck)| {
                if stuck { -1.0 } else { branch_of(rows[row][branch]) }
            }));
        }
        path
    }

    /// Every step, with states between two of them.
    fn integrated(orbit: &Integration, ask: &Start) -> Self {
        let system = orbit.system();
        let mut path = Self::new(system.masses(), system.contacts());
        for step in orbit.times().windows(2) {
            // Steps are short: of most their start is enough.
            ask.times_at_least(1, step[0], step[1], &mut path.t);
        }
        path.t.push(orbit.t_last());
        for &t in &path.t {
            let y = orbit.variables(t);
            let motion = system.motion(t, &y);
            for (i, [x, v]) in path.masses.iter_mut().enumerate() {
                x.push(y[i]);
                v.push(motion.v[i]);
            }
            for (c, [w, force, _]) in path.contacts.iter_mut().enumerate() {
                w.push(motion.w[c]);
                force.push(motion.force[c]);
            }
        }
        for [w, _, mode] in &mut path.contacts {
            let most = w.iter().fold(0.0, |most: f64, w| most.max(w.abs()));
            mode.extend(w.iter().map(|w| {
                if w.abs() <= CREEP_SPEED_RATIO * most {
                    -1.0
                } else {
                    0.0
                }
            }));
        }
        path
    }

    /// The kind of motion of the first contact in the second half of a run that ended so, `enough` of it or not.
    fn regime(&self, stop: Stop, enough: bool) -> Regime {
        if let Some(regime) = Regime::of_stop(stop, enough) {
            return regime;
        }
        let last = self.t.last().copied().unwrap_or(0.0);
        let first = self.t.partition_point(|&t| t < 0.5 * last);
        let [w, _, mode] = &self.contacts[0];
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        let (mut stuck, mut total) = (0.0, 0.0);
        for i in first..self.t.len() {
            range = [range[0].min(w[i]), range[1].max(w[i])];
            if i > first {
                let time = self.t[i] - self.t[i - 1];
                total += time;
                stuck += if mode[i - 1] < 0.0 { time } else { 0.0 };
            }
        }
        Regime::of(stuck / total, stuck > 0.0, range)
    }

    fn lay(&self, numbers: &mut Vec<f64>) {
        numbers.extend(&self.t);
        numbers.extend(self.masses.iter().flatten().flatten());
        numbers.extend(self.contacts.iter().flatten().flatten());
    }
}

/// The columns of a path, then the rows of the events.
pub(crate) fn orbit(desk: &mut Desk) -> Result<Value, String> {
    let mut ask: Start = read(&desk.question)?;
    let (orbit, end) = ask.orbit()?;
    let out = &mut desk.numbers;
    let (path, engine, stop, t_last) = match &orbit {
        Orbit::Events(model::Orbit::Closed(orbit), _) => {
            (Path::exact(orbit, &ask), "exact", orbit.stop, orbit.t_last())
        }
        Orbit::Events(model::Orbit::Steps(orbit), _) => {
            (Path::taylor(orbit, &ask), "taylor", orbit.stop, orbit.t_last())
        }
        Orbit::Integrated(orbit, stop) => {
            (Path::integrated(orbit, &ask), "integrated", *stop, orbit.t_last())
        }
    };
    let enough = matches!(&orbit, Orbit::Events(_, period) if t_last >= *period);
    path.lay(out);
    let mut count = 0;
    if let Orbit::Events(orbit, _) = &orbit {
        count = orbit.work().events;
        for event in orbit.events() {
            out.extend(event.row());
        }
    }
    let sentence = if engine == "integrated" && stop == Stop::MaxSeconds {
        format!("the run stopped at t = {t_last:.4} after {TOO_STIFF}")
    } else {
        stop.sentence().into()
    };
    let words = json!({
        "samples": path.t.len(), "masses": path.masses.len(), "contacts": path.contacts.len(),
        "events": count, "engine": engine, "regime": path.regime(stop, enough).name(),
        "stop": stop.name(), "sentence": sentence, "t_last": t_last, "end": end,
    });
    desk.orbit = Some(orbit);
    Ok(words)
}

#[derive(Deserialize)]
struct Times {
    from: f64,
    to: f64,
    count: usize,
}

/// The states of the last orbit at regular times, of its first mass and contact: x, v, a, force.
pub(crate) fn states(desk: &mut Desk) -> Result<Value, String> {
    let ask: Times = read(&desk.question)?;
    let step = (ask.to - ask.from) / (ask.count.max(2) - 1) as f64;
    let times: Vec<f64> = (0..ask.count)
        .map(|index| ask.from + step * index as f64)
        .collect();
    let orbit = desk
        .orbit
        .as_ref()
        .ok_or("there is no orbit yet: simulate first")?;
    let orbit = match orbit {
        Orbit::Events(orbit, _) => orbit,
        Orbit::Integrated(orbit, _) => {
            let motions: Vec<_> = times
                .iter()
                .map(|&t| {
                    let y = orbit.variables(t);
                    let motion = orbit.system().motion(t, &y);
                    [y[0], motion.v[0], motion.a[0], motion.force[0]]
                })
                .collect();
            for column in 0..4 {
                desk.numbers.extend(motions.iter().map(|motion| motion[column]));
            }
            return Ok(json!({}));
        }
    };
    let states = orbit.states(&times);
    let (masses, contacts) = (
        states.x.len() / times.len().max(1),
        states.force.len() / times.len().max(1),
    );
    for column in [&states.x, &states.v, &states.a] {
        desk.numbers.extend(column.iter().step_by(masses.max(1)));
    }
    desk.numbers.extend(states.force.iter().step_by(contacts.max(1)));
    Ok(json!({}))
}

#[derive(Deserialize)]
struct Exponent {
    system: Value,
    t_end: f64,
    #[serde(default)]
    x0: Option<Vec<f64>>,
    #[serde(default)]
    v0: Option<Vec<f64>>,
    max_events: u64,
    /// The share of the run that is left out.
    transient: f64,
}

/// The largest Lyapunov exponent of a run, and its standard error.
pub(crate) fn lyapunov(desk: &mut Desk) -> Result<Value, String> {
    let ask: Exponent = read(&desk.question)?;
    let run = Run {
        x0: ask.x0,
        v0: ask.v0,
        t_end: ask.t_end,
        max_events: ask.max_events,
    };
    // The direction that grows most: of a motion without forcing beside the shift in time.
    let found = spectrum(&model(&ask.system)?, run, ask.transient, 1, 0, &mut || true).map_err(sentence)?;
    desk.numbers.extend(found.average(0));
    Ok(json!({}))
}
