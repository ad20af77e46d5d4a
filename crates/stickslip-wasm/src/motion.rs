//! Questions about one motion: its orbit as columns, and its states at other times.

use serde::Deserialize;
use serde_json::{Value, json};
use stickslip::lyapunov::largest;
use stickslip::mode::Kind;
use stickslip::model::{Model, Orbit};
use stickslip::network::{self, Run, branch_of};
use stickslip::orbit;
use stickslip::regime::Regime;

use crate::Desk;
use crate::ask::{has_state, read, sentence};

#[derive(Deserialize)]
struct Start {
    system: Value,
    t_end: f64,
    /// Position of each mass; one number for all.
    #[serde(default)]
    x0: Option<Vec<f64>>,
    #[serde(default)]
    v0: Option<Vec<f64>>,
    max_events: u64,
    /// Samples of each segment at least, its start among them.
    per_segment: usize,
    /// Samples, about, of the whole orbit; 0: the events alone.
    samples: usize,
}

/// What a document describes, but for what has no events.
fn model(system: Value) -> Result<Model, String> {
    let laws = system["contacts"].as_array();
    if has_state(&system["law"]) || laws.is_some_and(|all| all.iter().any(|one| has_state(&one["law"]))) {
        return Err(
            "a law with an internal state is integrated, not solved from event to event: \
                    the page shows the law alone; run the system by `stickslip simulate`"
                .into(),
        );
    }
    Model::read(system).map_err(sentence)
}

impl Start {
    fn orbit(&mut self) -> Result<Orbit, String> {
        let run = Run {
            x0: self.x0.take(),
            v0: self.v0.take(),
            t_end: self.t_end,
            max_events: self.max_events,
        };
        model(self.system.take())?
            .simulate(run, || true)
            .map_err(sentence)
    }

    /// The start of a segment and as many times in it as its share of the orbit asks for.
    fn times(&self, from: f64, to: f64, times: &mut Vec<f64>) {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a share of the samples"
        )]
        let share = ((to - from) / self.t_end * self.samples as f64).ceil() as usize;
        let count = share.clamp(self.per_segment, self.samples.max(self.per_segment));
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
            ask.times(inside(segment.clock.high), to, &mut times);
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

    /// The kind of motion of the first contact in the second half.
    fn regime(&self) -> Regime {
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

fn kind(kind: Kind) -> f64 {
    f64::from(kind as u8)
}

/// The columns of a path, then the events: t, kind, contact, x, v, force, stick_time, force_rate of each.
pub(crate) fn orbit(desk: &mut Desk) -> Result<Value, String> {
    let mut ask: Start = read(&desk.question)?;
    let orbit = ask.orbit()?;
    let out = &mut desk.numbers;
    let path = match &orbit {
        Orbit::Closed(orbit) => Path::exact(orbit, &ask),
        Orbit::Steps(orbit) => Path::taylor(orbit, &ask),
    };
    path.lay(out);
    for event in orbit.events() {
        let contact = f64::from(event.contact);
        out.extend([event.t, kind(event.kind), contact, event.x, event.v, event.force]);
        out.extend([event.stick_time, event.force_rate]);
    }
    let words = json!({
        "samples": path.t.len(), "masses": path.masses.len(), "contacts": path.contacts.len(),
        "events": orbit.work().events, "exact": matches!(orbit, Orbit::Closed(_)), "regime": path.regime().name(),
        "stop": orbit.stop().name(), "sentence": orbit.stop().sentence(), "t_last": orbit.t_last(),
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
    let found = largest(&model(ask.system)?, run, ask.transient, &mut || true).map_err(sentence)?;
    desk.numbers.extend([found.exponent, found.error]);
    Ok(json!({}))
}
