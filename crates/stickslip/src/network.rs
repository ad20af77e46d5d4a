//! The loop for any number of masses and contacts, and for smooth laws: from Taylor step to Taylor step, from event to event.
//!
//! Order of simultaneous events: the earliest in time wins; among equals the contact of the lowest number, and in it the low
//! end before the high one before the turn. Contacts that reach zero slip speed within rounding of an event join it.
//!
//! A contact whose slip speed is held between two branches of its law is a constraint as adhesion is. Where something happens
//! at another contact it keeps its force while the others are decided; only then it is asked whether it holds on.

mod contact_states;
mod end_of_stick;
mod expansion;
mod guards;
mod one_contact;
pub(crate) mod orbit;
mod who_sticks;

pub mod sequence;
mod transition;

pub(crate) use one_contact::{first_hybrid_state, next_event};
pub use orbit::{Orbit, States, branch_of};

use contact_states::Passage;
use guards::Cause;

use crate::clock::Clock;
use crate::engine::steps::Step;
use crate::error::{Error, finite, positive, wrong};
use crate::event::Work;
use crate::flow::taylor::{ForceLine, Frame, Held, Motion};
use crate::law::{Friction, Law, Memory, Piece};
use crate::mode::Kind;
use crate::observer::Observer;
use crate::orbit::Event;
use crate::series::at;
use crate::simulate::{MOST_BYTES, Stop, lost};
use crate::system::System;

/// Where and how long to run.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Positions at t = 0; none: 0.
    pub x0: Option<Vec<f64>>,
    /// Velocities at t = 0; none: those of the drives.
    pub v0: Option<Vec<f64>>,
    /// Time to run.
    pub t_end: f64,
    /// Most events.
    pub max_events: u64,
}

impl Run {
    /// From x = 0 at the velocities of the drives, for `t_end`.
    #[must_use]
    pub fn driven(t_end: f64) -> Self {
        Self {
            x0: None,
            v0: None,
            t_end,
            max_events: 10_000_000,
        }
    }
}

/// Simulate and keep the whole orbit.
///
/// # Errors
/// The first value of the system or the run that makes no sense.
pub fn simulate(system: &System, run: Run) -> Result<Orbit, Error> {
    simulate_while(system, run, || true)
}

/// The same, as long as `go_on` says so.
///
/// # Errors
/// The first value of the system or the run that makes no sense.
pub fn simulate_while(system: &System, run: Run, go_on: impl FnMut() -> bool) -> Result<Orbit, Error> {
    Ok(Loop::started(system, &run)?.orbit(system, run, go_on))
}

/// Keeps all events.
struct Events<F> {
    events: Vec<Event>,
    go_on: F,
}

impl<F: FnMut() -> bool> Observer for Events<F> {
    const PASSES: bool = false;

    fn event(&mut self, event: &Event) {
        self.events.push(*event);
    }

    fn go_on(&mut self) -> bool {
        (self.go_on)()
    }
}

fn check(system: &System, run: &Run) -> Result<(), Error> {
    system.validate()?;
    let n = system.masses();
    for (name, values) in [("x0", &run.x0), ("v0", &run.v0)] {
        if let Some(values) = values {
            if values.len() != n {
                return wrong(format!(
                    "{name} must have one number a mass ({n}), got {}",
                    values.len()
                ));
            }
            for value in values {
                finite(name, *value)?;
            }
        }
    }
    if system
        .contacts
        .iter()
        .any(|contact| contact.normal_force.is_some())
        && Frame::of(system).loops
    {
        return wrong("contacts that close a loop share their load, which a normal_force that varies does not tell how: take one \
                     of them out, or leave out normal_force"
                .into());
    }
    positive("t_end", run.t_end).map(drop)
}

/// So many events in less than a millionth of the shortest natural time are an accumulation.
const MOST_EVENTS_AT_ONCE: u64 = 1000;
/// So many decisions at one time that make no event are one too.
const MOST_DECISIONS_AT_ONCE: u32 = 1000;
/// So many steps within one natural time, that without damping, are a motion too stiff for steps that are not implicit.
const MOST_STEPS_A_PERIOD: u64 = 100_000;
/// A motion this much faster than at its start grows.
const GROWN_SPEED_RATIO: f64 = 1e6;
/// One this much faster runs away: no start from which it settles is so slow.
const RUNAWAY_SPEED_RATIO: f64 = 1e9;
/// So many steps pass between two questions whether to go on.
const STEPS_BETWEEN_ASKS: u64 = 64;
/// Slip speeds below this share of the largest speed of the run are zero within rounding.
pub(crate) const SPEED_ROUNDING: f64 = 16.0 * f64::EPSILON;
/// A start that is known to have no slope keeps that below this share of the largest acceleration: the error with which its
/// event was found. Adhesion that is beyond its limit by less, and relieved from there, holds.
const ZERO_SLOPE_SHARE: f64 = 1e-12;

/// What a contact does and remembers.
#[derive(Clone, Copy, Debug)]
struct ContactState {
    /// Sign of w, 0 while stuck.
    direction: f64,
    piece: Piece,
    memory: Memory,
    /// When it stuck.
    stuck_since: Clock,
    /// The force of a stuck contact that is at its limit while others hold it, else 0.
    pinned: f64,
    /// The slip acceleration is zero at the start of the piece, by what led there.
    at_reversal: bool,
    /// The steeper of the two lines of friction between which a slip at a node is: it makes a slip acceleration of rounding.
    steep: f64,
    /// The sign of the slip acceleration in this piece, 0 before it is known.
    sense: f64,
    /// Friction of the two branches between which the slip speed is held, if it is.
    between: Option<[f64; 2]>,
    /// The slip velocity that is kept then; it is 0 where the contact is stuck.
    kept: f64,
    /// The bodies are separated: their normal force is 0 until it grows again.
    separated: bool,
}

impl ContactState {
    /// Friction on its mass at a slip speed, by the law of its direction.
    fn friction(&self, law: &Law, speed: f64) -> f64 {
        self.direction * law.toward(self.direction).force(&self.piece, speed)
    }

    /// What it does, as far as the flow cares.
    fn force_line(&self) -> ForceLine {
        let (offset, slope) = if self.direction == 0.0 {
            (self.pinned, 0.0)
        } else if self.between.is_some() {
            (0.0, f64::INFINITY)
        } else if self.separated {
            (0.0, f64::NEG_INFINITY)
        } else {
            (self.piece.offset, self.piece.slope)
        };
        ForceLine {
            direction: self.direction,
            offset,
            slope,
            zero_slope: false,
        }
    }
}

/// A run: the state, the modes of all contacts, and the Taylor series from here on.
pub(crate) struct Loop<'a> {
    laws: Vec<&'a Law>,
    mass_of: Vec<usize>,
    frame: Frame,
    motion: Motion,
    clock: Clock,
    x: Vec<f64>,
    v: Vec<f64>,
    contacts: Vec<ContactState>,
    force_lines: Vec<ForceLine>,
    held: Held,
    /// The largest speed so far.
    scale: f64,
    /// That at the begin of the run, where another engine went first.
    pub(crate) began: Option<f64>,
    /// The largest acceleration so far, or that of the largest speed at the rate of the masses.
    acceleration: f64,
    /// A slip acceleration below this share of the largest one is none where a slip begins without one.
    zero_share: f64,
    steps: Vec<f64>,
    events: Vec<Event>,
    pub(crate) work: Work,
}

impl<'a> Loop<'a> {
    /// At the start of a run.
    pub(crate) fn started(system: &'a System, run: &Run) -> Result<Self, Error> {
        check(system, run)?;
        let mut state = Self::new(system, run);
        state.start();
        Ok(state)
    }

    fn new(system: &'a System, run: &Run) -> Self {
        let frame = Frame::of(system);
        let n = system.masses();
        let stuck = ContactState {
            direction: 0.0,
            piece: Piece::constant(0.0),
            memory: Memory::default(),
            stuck_since: Clock::default(),
            pinned: 0.0,
            at_reversal: false,
            steep: 0.0,
            sense: 0.0,
            between: None,
            kept: 0.0,
            separated: false,
        };
        let x = run.x0.clone().unwrap_or_else(|| vec![0.0; n]);
        let mut motion = Motion::of(&frame);
        motion.choose_pieces(&frame, &x);
        Self {
            laws: system.contacts.iter().map(|contact| &contact.law).collect(),
            mass_of: system.contacts.iter().map(|contact| contact.mass).collect(),
            motion,
            held: frame.held_along(Vec::new()),
            frame,
            clock: Clock::default(),
            x,
            v: run.v0.clone().unwrap_or_else(|| system.driven_velocities()),
            contacts: vec![stuck; system.contacts.len()],
            force_lines: Vec::new(),
            scale: 0.0,
            began: None,
            acceleration: 0.0,
            zero_share: ZERO_SLOPE_SHARE,
            steps: Vec::new(),
            events: Vec::new(),
            work: Work::default(),
        }
    }

    /// Move to the end of the run and keep all of it.
    fn orbit(mut self, system: &System, run: Run, go_on: impl FnMut() -> bool) -> Orbit {
        let mut kept = Events {
            events: Vec::new(),
            go_on,
        };
        let stop = self.follow(&run, true, f64::NEG_INFINITY, &mut kept);
        Orbit {
            system: system.clone(),
            run,
            steps: self.steps,
            events: kept.events,
            stop,
            work: self.work,
        }
    }

    /// Move to the end of the run and show what happens from the time `after` on; without `keep` no step is kept.
    pub(crate) fn follow<O: Observer>(
        &mut self,
        run: &Run,
        keep: bool,
        after: f64,
        observer: &mut O,
    ) -> Stop {
        let mut asked = None;
        let (mut mark, mut counted) = (self.clock, 0);
        let (mut stage, mut stepped) = (self.clock, 0);
        let mut standing = 0;
        let short = 1e-6 / self.frame.rate;
        loop {
            self.expand();
            self.tell_events(after, observer);
            if self.work.evaluations >= stepped + MOST_STEPS_A_PERIOD {
                let passed = stage.until(self.clock.high);
                if passed < 1.0 / self.frame.undamped {
                    self.record_step();
                    return if passed < short {
                        Stop::Accumulation
                    } else {
                        Stop::Stiff
                    };
                }
                (stage, stepped) = (self.clock, self.work.evaluations);
            }
            if !keep {
                self.steps.clear();
            }
            // The series of a motion that grows leaves the numbers before the motion does.
            let growth = self.scale / *self.began.get_or_insert(self.scale);
            if growth > RUNAWAY_SPEED_RATIO {
                self.record_step();
                return Stop::Diverged;
            }
            let grown = growth > GROWN_SPEED_RATIO;
            let overflow = if grown { Stop::Diverged } else { Stop::NotANumber };
            if let Some(stop) = lost(&self.x)
                .or_else(|| lost(&self.v))
                .or_else(|| (!self.motion.is_finite(&self.frame)).then_some(overflow))
            {
                self.record_step();
                return stop;
            }
            if asked.is_none_or(|asked| self.work.evaluations >= asked + STEPS_BETWEEN_ASKS) {
                if !observer.go_on() {
                    self.record_step();
                    return Stop::MaxSeconds;
                }
                if size_of_val(&*self.steps) > MOST_BYTES || observer.full() {
                    return Stop::Memory;
                }
                asked = Some(self.work.evaluations);
            }
            let step = self.motion.reach(&self.frame, &self.force_lines, self.scale);
            self.record_step();
            let end = self.clock.until(run.t_end);
            let nodes = self.frame.drives.iter().map(|drive| drive.node_after(self.clock));
            let node = nodes.fold(f64::INFINITY, f64::min);
            let corner = self.clock.until(node);
            let whole = step.min(end).min(corner);
            let mut horizon =
                self.motion
                    .agreed(&self.frame, &self.laws, &self.force_lines, self.scale, whole);
            let step = if horizon < whole { horizon } else { step };
            if step.is_nan()
                || step < f64::EPSILON * (1.0 / self.frame.rate).min(1.0) * 1e-3
                || !self.scale.is_finite()
            {
                return if horizon < whole {
                    Stop::Stiff
                } else {
                    Stop::Diverged
                };
            }
            let Some((h, contact, cause)) = self.next(&mut horizon) else {
                if horizon == end {
                    let parts = [&self.motion.x, &self.motion.v].into_iter();
                    let all = parts.flat_map(|of| (0..of.count()).map(|i| at(&of.series(i), end)));
                    let last: Vec<f64> = all.collect();
                    let stop = lost(&last).unwrap_or(Stop::End);
                    self.show(after, end, stop == Stop::End, observer);
                    return stop;
                }
                self.show(after, horizon, false, observer);
                self.advance(horizon);
                for contact in &mut self.contacts {
                    contact.at_reversal = false;
                }
                if horizon == corner {
                    // The drive changes its acceleration, at its time and not a rounding beside it: adhesion may break at once.
                    self.clock = Clock::at(node);
                    let rates = self.motion.force.slopes(horizon);
                    self.motion.aim(&self.frame, self.clock);
                    self.set_contact_states(&Passage {
                        arrived: Vec::new(),
                        released: None,
                        returned: None,
                        rates,
                        starting: false,
                    });
                }
                continue;
            };
            self.show(after, h, false, observer);
            let before = self.work.events;
            if let Cause::Spring(piece) = cause {
                self.change_spring(h, contact, piece);
            } else {
                self.occur(h, contact, cause);
            }
            standing = if h > 0.0 || self.work.events > before {
                0
            } else {
                standing + 1
            };
            if standing == MOST_DECISIONS_AT_ONCE {
                self.record_step();
                return Stop::Accumulation;
            }
            if self.work.events >= run.max_events {
                self.expand();
                self.tell_events(after, observer);
                self.record_step();
                return Stop::MaxEvents;
            }
            if self.work.events >= counted + MOST_EVENTS_AT_ONCE {
                if mark.until(self.clock.high) < short {
                    return Stop::Accumulation;
                }
                (mark, counted) = (self.clock, self.work.events);
            }
        }
    }

    /// Show the step that begins here, up to `until`.
    fn show<O: Observer>(&self, after: f64, until: f64, last: bool, observer: &mut O) {
        let from = self.clock.until(after).max(0.0);
        if O::PASSES && (from < until || last) {
            observer.pass(&self.step(), (from, until), last);
        }
    }

    fn tell_events(&mut self, after: f64, observer: &mut impl Observer) {
        for event in self.events.drain(..) {
            if event.t >= after {
                observer.event(&event);
            }
        }
    }

    /// The step that begins here.
    pub(crate) fn step(&self) -> Step<'_> {
        Step {
            clock: self.clock,
            frame: &self.frame,
            motion: &self.motion,
            force_lines: &self.force_lines,
            rounding: SPEED_ROUNDING * self.scale,
        }
    }

    fn record_step(&mut self) {
        self.steps.extend([self.clock.high, self.clock.low]);
        self.steps.extend(&self.x);
        self.steps.extend(&self.v);
        for (force_line, contact) in self.force_lines.iter().zip(&self.contacts) {
            let branch = if force_line.direction == 0.0 {
                0
            } else {
                contact.piece.branch
            };
            self.steps.extend(orbit::contact_numbers(force_line, branch));
        }
        self.steps
            .extend(self.motion.pieces.iter().map(|&piece| piece as f64));
    }

    /// Spring `s` goes on to a piece.
    fn change_spring(&mut self, h: f64, s: usize, piece: usize) {
        let (spring, displacement) = (&self.frame.springs[s], at(&self.motion.displacement[s], h));
        // The series of the force would keep the rounding of where the step began, which may lie far up a cubic part.
        let force = spring.force(self.motion.pieces[s], displacement);
        self.advance(h);
        if h > 0.0 {
            for contact in &mut self.contacts {
                contact.at_reversal = false;
            }
        }
        self.motion.pieces[s] = piece;
        self.tell_of(Kind::Spring, s, self.frame.springs[s].mass, -force);
    }

    fn advance(&mut self, h: f64) {
        self.motion.advance(h, &mut self.x, &mut self.v);
        self.clock = self.clock.after(h);
        self.zero_share = ZERO_SLOPE_SHARE;
    }

    /// The normal force of a contact over that of its law.
    fn normal(&self, c: usize) -> f64 {
        self.frame.normals[c].as_ref().map_or(1.0, |normal| {
            let across = |of: &[f64]| self.frame.across(c, |i| of[i]);
            normal.at(self.clock, across(&self.x), across(&self.v))
        })
    }

    /// A normal force below this is zero within rounding.
    fn faint(&self, c: usize) -> f64 {
        let size = self.frame.normals[c].as_ref().map_or(0.0, |normal| {
            let position = self.frame.across(c, |i| self.x[i]).abs() + self.scale / self.frame.rate;
            normal.size(position, self.scale)
        });
        SPEED_ROUNDING * size
    }

    /// Friction of a contact in slip at a speed.
    fn friction(&self, c: usize, speed: f64) -> f64 {
        let contact = &self.contacts[c];
        if contact.separated {
            0.0
        } else {
            self.normal(c).max(0.0) * contact.friction(self.laws[c], speed)
        }
    }

    fn stick_time(&self, c: usize) -> f64 {
        -self.clock.until(self.contacts[c].stuck_since.high) + self.contacts[c].stuck_since.low
    }

    fn tell(&mut self, kind: Kind, contact: usize, force: f64) {
        self.tell_of(kind, contact, self.mass_of[contact], force);
    }

    #[expect(clippy::cast_possible_truncation, reason = "the number of a contact")]
    fn tell_of(&mut self, kind: Kind, contact: usize, mass: usize, force: f64) {
        self.work.events += 1;
        self.events.push(Event {
            t: self.clock.high,
            kind,
            contact: contact as u32,
            x: self.x[mass],
            v: self.v[mass],
            force,
            stick_time: f64::NAN,
            force_rate: f64::NAN,
        });
    }
}
