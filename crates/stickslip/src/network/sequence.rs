//! The event sequence of a run of a system, and runs that go on from a state of it.

use super::orbit::force_lines_of;
use super::{Loop, Orbit, Run, check, simulate_while};
use crate::clock::Clock;
use crate::error::{Error, wrong};
use crate::event_sequence::{EventSequence, ending};
use crate::flow::taylor::Frame;
use crate::law::Friction;
use crate::mode::Kind;
use crate::simulate::Stop;
use crate::system::System;
use crate::variation::{CONTACT, ContactMode, Ending, Layout, Phase, State, contact_of};

/// What has a derivative through its events.
fn admit(system: &System) -> Result<(), Error> {
    system.validate()?;
    if Frame::of(system).loops {
        return wrong(
            "contacts that close a loop share their load by a rule that has no derivative; take one of them out".into(),
        );
    }
    if !system.springs.is_empty() {
        return wrong(
            "no derivative is known through springs that are not linear; put what is linear into stiffness, or look at sections"
                .into(),
        );
    }
    if system
        .contacts
        .iter()
        .any(|contact| !contact.drive_velocity.nodes.is_empty())
    {
        return wrong("a drive along a table has no derivative at its nodes; write it as harmonics".into());
    }
    Ok(())
}

/// The event sequence of a run, as long as `go_on` says so.
///
/// # Errors
/// What makes no sense in the system or the run, and events that a disturbance would part.
pub fn run(system: &System, run: Run, go_on: impl FnMut() -> bool) -> Result<EventSequence, Error> {
    admit(system)?;
    check(system, &run)?;
    let start = start(system, &run);
    let orbit = simulate_while(system, run, go_on)?;
    of_orbit(&orbit, start, 0.0)
}

/// The state in which a run begins: what every contact does follows from its load.
pub fn start(system: &System, run: &Run) -> State {
    let mut state = Loop::new(system, run);
    state.start();
    state_of(&state)
}

/// The event sequence from a state in which the contacts do what `contact_modes` say, for a duration and as long as `go_on` says so.
///
/// # Errors
/// What makes no sense in the system or the state, and events that a disturbance would part.
pub fn from(
    system: &System,
    state: &State,
    contact_modes: &[ContactMode],
    duration: f64,
    max_events: u64,
    go_on: impl FnMut() -> bool,
) -> Result<EventSequence, Error> {
    let orbit = resume(system, state, contact_modes, duration, max_events, go_on)?;
    of_orbit(&orbit, state.clone(), state.numbers[0])
}

/// The motion from a state in which the contacts do what `contact_modes` say, for a duration and as long as `go_on` says so.
///
/// # Errors
/// What makes no sense in the system or the state.
pub fn resume(
    system: &System,
    state: &State,
    contact_modes: &[ContactMode],
    duration: f64,
    max_events: u64,
    go_on: impl FnMut() -> bool,
) -> Result<Orbit, Error> {
    admit(system)?;
    let layout = Layout::of(system);
    let part = |from: fn(Layout, usize) -> usize| {
        (0..layout.masses)
            .map(|i| state.numbers[from(layout, i)])
            .collect::<Vec<_>>()
    };
    let t = state.numbers[0];
    let run = Run {
        x0: Some(part(Layout::x)),
        v0: Some(part(Layout::v)),
        t_end: t + duration,
        max_events,
    };
    check(system, &run)?;
    let mut motion = Loop::new(system, &run);
    motion.clock = Clock::at(t);
    motion.motion.aim(&motion.frame, motion.clock);
    let speeds: Vec<f64> = (0..layout.contacts)
        .map(|c| motion.motion.slip(&motion.frame, c, &motion.v))
        .collect();
    for (c, contact) in motion.contacts.iter_mut().enumerate() {
        let at = layout.contact(c);
        (contact.piece, contact.memory) = state.contact(at, c);
        contact.stuck_since = motion.clock.after(-state.numbers[at + CONTACT - 1]);
        // The expansion forgets it where the slip speed has a slope.
        contact.at_reversal = true;
        match contact_modes[c] {
            ContactMode::Stick => contact.direction = 0.0,
            ContactMode::Slip(direction) => contact.direction = direction,
            ContactMode::Hold(direction) => {
                contact.direction = direction;
                contact.between = motion.laws[c].toward(direction).branches(direction * speeds[c]);
                contact.kept = speeds[c];
            }
        }
    }
    let stuck = (0..contact_modes.len()).filter(|&c| contact_modes[c] == ContactMode::Stick);
    let held = motion.frame.held(stuck.collect());
    motion.motion.stop(&motion.frame, &held, &mut motion.v);
    Ok(motion.orbit(system, run, go_on))
}

fn state_of(motion: &Loop) -> State {
    let contacts = motion
        .contacts
        .iter()
        .map(|contact| contact_of(&contact.piece, &contact.memory));
    let (lines, flags): (Vec<_>, Vec<_>) = contacts.unzip();
    let numbers = [motion.clock.high].into_iter().chain(motion.x.iter().copied());
    State {
        numbers: numbers
            .chain(motion.v.iter().copied())
            .chain(lines.into_iter().flatten())
            .collect(),
        flags,
    }
}

/// Rows of the steps of an orbit.
struct Rows<'a> {
    orbit: &'a Orbit,
    rows: Vec<&'a [f64]>,
}

impl Rows<'_> {
    /// The last row at or before a time, in which what happened then has happened.
    fn at(&self, t: f64) -> &[f64] {
        self.rows[self.rows.partition_point(|row| row[0] <= t).max(1) - 1]
    }

    fn contact_modes(&self, t: f64) -> Vec<ContactMode> {
        let system = &self.orbit.system;
        force_lines_of(self.at(t), system.masses(), system.contacts.len())
            .map(|line| ContactMode::of(line.direction, line.slope))
            .collect()
    }

    /// Whether the slip speed of a contact grows just before a time.
    fn grows(&self, c: usize, from: f64, t: f64) -> bool {
        let contacts = self.orbit.system.contacts.len();
        let w = self.orbit.states(&[t - 1e-6 * (t - from), t]).w;
        w[contacts + c].abs() > w[c].abs()
    }
}

fn of_orbit(orbit: &Orbit, start: State, begin: f64) -> Result<EventSequence, Error> {
    let rows = Rows {
        orbit,
        rows: orbit.steps.chunks_exact(orbit.width()).collect(),
    };
    let frame = Frame::of(&orbit.system);
    let (mut phases, mut kinds) = (Vec::new(), Vec::new());
    let mut from = begin;
    for at_once in orbit.events.chunk_by(|one, other| one.t == other.t) {
        // Adhesion that breaks may break others'; what arrives may too.
        let main = at_once
            .iter()
            .find(|event| event.kind == Kind::Release)
            .unwrap_or(&at_once[0]);
        let (c, t) = (main.contact as usize, main.t);
        for other in at_once.iter().filter(|event| !std::ptr::eq(*event, main)) {
            let follows = matches!(other.kind, Kind::Release | Kind::Capture | Kind::Crossing);
            if !follows || frame.coupling(other.contact as usize, c) == 0.0 {
                return wrong(format!(
                    "contacts {c} and {} have events at one time, {t}, which a disturbance would part: start from \
                     another state",
                    other.contact
                ));
            }
        }
        if matches!(main.kind, Kind::Parting | Kind::Meeting | Kind::Spring) {
            return wrong(format!(
                "the bodies of contact {c} part at t = {t}, for which no derivative is known: follow a motion along which \
                 the normal force stays positive"
            ));
        }
        let contact_modes = rows.contact_modes(from);
        let law = &orbit.system.contacts[c].law;
        let held = || orbit.states(&[from]).w[c].abs();
        let ending = ending(main, contact_modes[c], law, || rows.grows(c, from, t), held);
        let (one, other) = (rows.at(from), rows.at(t));
        phases.push(Phase {
            contact_modes,
            contact: c,
            ending,
            duration: (other[0] - one[0]) + (other[1] - one[1]),
        });
        kinds.push(main.kind);
        from = t;
    }
    if orbit.stop == Stop::End {
        phases.push(Phase {
            contact_modes: rows.contact_modes(from),
            contact: 0,
            ending: Ending::Time,
            duration: orbit.run.t_end - from,
        });
    }
    Ok(EventSequence {
        start,
        phases,
        kinds,
        stop: orbit.stop,
    })
}
