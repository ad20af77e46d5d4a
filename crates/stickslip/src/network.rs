//! The loop for any number of masses and contacts, and for smooth laws: from Taylor step to Taylor step, from event to event.
//!
//! Order of simultaneous events: the earliest in time wins; among equals the contact of the lowest number, and in it the low
//! end before the high one before the turn. Contacts that reach zero slip speed within rounding of an event join it.
//!
//! Rule for the modes after an event, for all contacts with zero slip velocity at once: all stick, if adhesion can bear it
//! (a contact that has just arrived bears its break-away force at stick time zero, one that stuck before bears what its stick
//! time has made of it). Otherwise the most overloaded one slips in the direction of the force it could not bear, and the rest
//! is asked again; one that would then slip against its direction sticks after all. Should this go round in circles, the first
//! consistent combination is taken, stick before slip forward before slip backward, the first contact changing fastest.
//!
//! Stuck contacts in a closed loop (two between the same bodies, or mass, drive, mass) leave the share of each undetermined.
//! They share such that the sum of squares of their forces is least; one that is overloaded while the others still hold it
//! stays where it is, pinned at its limit, and the others bear the rest until the next event.

use crate::drive::Clock;
use crate::error::{Error, finite, positive};
use crate::event::Work;
use crate::flow::taylor::{Frame, Held, Motion, Rub};
use crate::law::{End, Friction, Hold, Law, Memory, Piece};
use crate::mode::Kind;
use crate::series::{ORDER, Series, at, curvature, derivative, first_root, free_time, slope_at};
use crate::simulate::Stop;
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

/// One event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// Time.
    pub t: f64,
    /// What happened.
    pub kind: Kind,
    /// At which contact.
    pub contact: usize,
    /// Position of its mass.
    pub x: f64,
    /// Velocity of its mass.
    pub v: f64,
    /// Friction force on its mass just before the event.
    pub force: f64,
    /// Time of adhesion before a release; not a number elsewhere.
    pub stick_time: f64,
    /// d|F|/dt at a release; not a number elsewhere.
    pub force_rate: f64,
}

/// The states at some times, each column mass by mass or contact by contact.
#[derive(Clone, Debug, Default)]
pub struct States {
    /// Positions.
    pub x: Vec<f64>,
    /// Velocities.
    pub v: Vec<f64>,
    /// Accelerations.
    pub a: Vec<f64>,
    /// Slip velocities of the contacts.
    pub w: Vec<f64>,
    /// Friction forces of the contacts.
    pub force: Vec<f64>,
    /// Whether they stick.
    pub stuck: Vec<bool>,
}

/// A whole run.
#[derive(Clone, Debug)]
pub struct Orbit {
    /// What moved.
    pub system: System,
    /// From where and how long.
    pub run: Run,
    /// One row a step: time (high, low), positions, velocities, and for each contact direction, offset, slope, branch.
    pub steps: Vec<f64>,
    /// The events, in time.
    pub events: Vec<Event>,
    /// Why it ended.
    pub stop: Stop,
    /// What it cost: events and Taylor steps.
    pub work: Work,
}

impl Orbit {
    /// Numbers in a row of [`Orbit::steps`].
    #[must_use]
    pub fn width(&self) -> usize {
        2 + 2 * self.system.masses() + 4 * self.system.contacts.len()
    }

    /// The time up to which the orbit is known.
    #[must_use]
    pub fn t_last(&self) -> f64 {
        match self.stop {
            Stop::End => self.run.t_end,
            _ => self.steps[self.steps.len() - self.width()],
        }
    }

    /// The states at `times`, in any order; each step is expanded again when a time lies in it.
    #[must_use]
    pub fn states(&self, times: &[f64]) -> States {
        let frame = Frame::of(&self.system);
        let laws: Vec<&Law> = self.system.contacts.iter().map(|contact| &contact.law).collect();
        let mut motion = Motion::of(&frame);
        let (n, contacts, width) = (frame.masses, laws.len(), self.width());
        let rows: Vec<&[f64]> = self.steps.chunks_exact(width).collect();
        let (mut last, mut rubs) = (usize::MAX, Vec::new());
        let mut states = States::default();
        for &t in times {
            let clock = |row: &[f64]| Clock {
                high: row[0],
                low: row[1],
            };
            let index = rows.partition_point(|row| clock(row).until(t) >= 0.0).max(1) - 1;
            let row = rows[index];
            if index != last {
                last = index;
                rubs = row[2 + 2 * n..]
                    .chunks_exact(4)
                    .map(|rub| Rub {
                        direction: rub[0],
                        offset: rub[1],
                        slope: rub[2],
                    })
                    .collect();
                let held = frame.held((0..contacts).filter(|&c| rubs[c].holds()).collect());
                motion.aim(&frame, clock(row));
                motion.expand(
                    &frame,
                    &laws,
                    &rubs,
                    &held,
                    &row[2..2 + n],
                    &row[2 + n..2 + 2 * n],
                );
            }
            let h = clock(row).until(t);
            for i in 0..n {
                let (v, a) = slope_at(&motion.v[i], h);
                states.x.push(at(&motion.x[i], h));
                states.v.push(v);
                states.a.push(a);
            }
            for (c, rub) in rubs.iter().enumerate() {
                let stuck = rub.direction == 0.0;
                let w = rub.direction * at(&motion.u[c], h);
                states.w.push(w);
                states.force.push(at(&motion.force[c], h));
                states.stuck.push(stuck);
            }
        }
        states
    }
}

/// Simulate and keep the whole orbit.
///
/// # Errors
/// The first value of the system or the run that makes no sense.
pub fn simulate(system: &System, run: Run) -> Result<Orbit, Error> {
    system.validate()?;
    let n = system.masses();
    for (name, values) in [("x0", &run.x0), ("v0", &run.v0)] {
        if let Some(values) = values {
            if values.len() != n {
                return Err(Error::Document {
                    reason: format!("{name} must have one number a mass ({n}), got {}", values.len()),
                });
            }
            for value in values {
                finite(name, *value)?;
            }
        }
    }
    positive("t_end", run.t_end)?;
    let mut state = Loop::new(system, &run);
    let stop = state.go(&run);
    Ok(Orbit {
        system: system.clone(),
        run,
        steps: state.steps,
        events: state.events,
        stop,
        work: state.work,
    })
}

/// So many events in less than a millionth of the shortest natural time are an accumulation.
const ACCUMULATION: u64 = 1000;
/// Slip speeds below this share of the largest speed of the run are zero within rounding.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// What a contact does and remembers.
#[derive(Clone, Copy, Debug)]
struct Contact {
    /// Sign of w, 0 while stuck.
    direction: f64,
    piece: Piece,
    memory: Memory,
    /// When it stuck.
    since: Clock,
    /// The force of a stuck contact that is at its limit while others hold it, else 0.
    pinned: f64,
    /// The slip acceleration is zero at the start of the piece, by what led there.
    turning: bool,
    /// The sign of the slip acceleration in this piece, 0 before it is known.
    sense: f64,
}

impl Contact {
    /// What it does, as far as the flow cares.
    fn rub(&self) -> Rub {
        let stuck = self.direction == 0.0;
        Rub {
            direction: self.direction,
            offset: if stuck { self.pinned } else { self.piece.offset },
            slope: if stuck { 0.0 } else { self.piece.slope },
        }
    }
}

/// What ends a mode.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Cause {
    Release,
    End(End),
}

struct Loop<'a> {
    laws: Vec<&'a Law>,
    mass_of: Vec<usize>,
    frame: Frame,
    motion: Motion,
    clock: Clock,
    x: Vec<f64>,
    v: Vec<f64>,
    contacts: Vec<Contact>,
    rubs: Vec<Rub>,
    held: Held,
    /// The largest speed so far.
    scale: f64,
    steps: Vec<f64>,
    events: Vec<Event>,
    work: Work,
}

impl<'a> Loop<'a> {
    fn new(system: &'a System, run: &Run) -> Self {
        let frame = Frame::of(system);
        let n = system.masses();
        let still = Contact {
            direction: 0.0,
            piece: Piece::constant(0.0),
            memory: Memory::default(),
            since: Clock::default(),
            pinned: 0.0,
            turning: false,
            sense: 0.0,
        };
        Self {
            laws: system.contacts.iter().map(|contact| &contact.law).collect(),
            mass_of: system.contacts.iter().map(|contact| contact.mass).collect(),
            motion: Motion::of(&frame),
            held: frame.held(Vec::new()),
            frame,
            clock: Clock::default(),
            x: run.x0.clone().unwrap_or_else(|| vec![0.0; n]),
            v: run.v0.clone().unwrap_or_else(|| system.driven_velocities()),
            contacts: vec![still; system.contacts.len()],
            rubs: Vec::new(),
            scale: 0.0,
            steps: Vec::new(),
            events: Vec::new(),
            work: Work::default(),
        }
    }

    fn go(&mut self, run: &Run) -> Stop {
        self.start();
        let (mut mark, mut counted) = (self.clock, 0);
        let short = 1e-6 / self.frame.rate;
        loop {
            self.expand();
            let step = self.motion.reach(&self.frame, &self.rubs, self.scale);
            self.record_step();
            if step.is_nan()
                || step < f64::EPSILON * (1.0 / self.frame.rate).min(1.0) * 1e-3
                || !self.scale.is_finite()
            {
                return Stop::Diverged;
            }
            let end = self.clock.until(run.t_end);
            let bend = self.frame.drives.iter().map(|drive| drive.bend_after(self.clock));
            let bend = bend.fold(f64::INFINITY, f64::min);
            let horizon = step.min(end).min(bend);
            let Some((h, contact, cause)) = self.next(horizon) else {
                if horizon == end {
                    return Stop::End;
                }
                self.advance(horizon);
                for contact in &mut self.contacts {
                    contact.turning = false;
                }
                if horizon == bend {
                    // The drive changes its acceleration: adhesion may break at once.
                    let rates = self.rates(horizon);
                    self.motion.aim(&self.frame, self.clock);
                    self.settle(&Passage {
                        arrived: Vec::new(),
                        released: None,
                        rates,
                        starting: false,
                    });
                }
                continue;
            };
            self.occur(h, contact, cause);
            if self.work.events >= run.max_events {
                self.expand();
                self.record_step();
                return Stop::MaxEvents;
            }
            if self.work.events >= counted + ACCUMULATION {
                if mark.until(self.clock.high) < short {
                    return Stop::Accumulation;
                }
                (mark, counted) = (self.clock, self.work.events);
            }
        }
    }

    /// Modes in which the motion starts.
    fn start(&mut self) {
        self.motion.aim(&self.frame, self.clock);
        self.measure_scale();
        let mut wants = Vec::new();
        self.motion.wants(&self.frame, &self.x, &self.v, &mut wants);
        let mut at_rest = Vec::new();
        let mut force = vec![0.0; self.contacts.len()];
        for c in 0..self.contacts.len() {
            let w = self.motion.drive(c).0 - self.frame.across(c, |i| self.v[i]);
            if w.abs() <= ROUNDING * self.scale {
                at_rest.push(c);
                continue;
            }
            let direction = w.signum();
            let others: f64 = (0..c)
                .map(|other| self.frame.coupling(c, other) * force[other])
                .sum();
            let balance = direction * (wants[c] - others) / self.frame.coupling(c, c);
            let rate = self.rate_if_stuck(c);
            let contact = &mut self.contacts[c];
            contact.memory.force_rate = rate;
            contact.direction = direction;
            contact.piece = self.laws[c].begin(w.abs(), balance, &mut contact.memory);
            force[c] = direction * self.laws[c].force(&contact.piece, w.abs());
        }
        // Whoever rests there has arrived just now; the start is no event.
        let rates = vec![0.0; self.contacts.len()];
        self.settle(&Passage {
            arrived: at_rest,
            released: None,
            rates,
            starting: true,
        });
        self.events.clear();
        self.work.events = 0;
    }

    fn measure_scale(&mut self) {
        let rate = self.frame.rate;
        let mut scale = self.scale;
        for (x, v) in self.x.iter().zip(&self.v) {
            scale = scale.max(rate * x.abs()).max(v.abs());
        }
        for c in 0..self.contacts.len() {
            scale = scale.max(self.motion.drive(c).0.abs());
        }
        // Nothing moves yet: what is pushed will, and what is not has no size.
        self.scale = if scale > 0.0 { scale } else { f64::MIN_POSITIVE };
    }

    /// The Taylor series from here on; laws that follow the sense of the slip acceleration are told where it jumped.
    fn expand(&mut self) {
        self.motion.aim(&self.frame, self.clock);
        self.measure_scale();
        // A jump of the acceleration elsewhere may turn a contact, whose new piece may turn the next one.
        for _ in 0..=self.contacts.len() {
            self.set_rubs();
            self.motion
                .expand(&self.frame, &self.laws, &self.rubs, &self.held, &self.x, &self.v);
            self.work.evaluations += 1;
            self.scale = self
                .scale
                .max(self.motion.size(self.frame.rate, 1) / self.frame.rate);
            let noise = 1e-9 * self.frame.rate * self.scale;
            let mut turned = false;
            for c in 0..self.contacts.len() {
                let contact = &mut self.contacts[c];
                if contact.direction == 0.0 {
                    continue;
                }
                let slope = self.motion.u[c][1];
                contact.turning &= slope.abs() <= noise;
                if !contact.piece.turns {
                    continue;
                }
                let now = if contact.turning {
                    self.motion.u[c][2]
                } else {
                    slope
                }
                .signum();
                if contact.sense == 0.0 {
                    contact.sense = now;
                } else if now != contact.sense && slope.abs() > noise {
                    let speed = self.motion.u[c][0].max(0.0);
                    let rising = now > 0.0;
                    let rate = self.rate_if_stuck(c);
                    let contact = &mut self.contacts[c];
                    contact.memory.force_rate = rate;
                    let force = contact.direction * self.laws[c].force(&contact.piece, speed);
                    contact.piece =
                        self.laws[c].next(&contact.piece, End::Turn { rising }, speed, &mut contact.memory);
                    (contact.sense, contact.turning) = (now, false);
                    self.tell(Kind::Reversal, c, force);
                    turned = true;
                }
            }
            if !turned {
                return;
            }
        }
    }

    fn set_rubs(&mut self) {
        self.rubs.clear();
        self.rubs.extend(self.contacts.iter().map(Contact::rub));
        let stuck = (0..self.contacts.len()).filter(|&c| self.rubs[c].holds());
        if !stuck.clone().eq(self.held.contacts.iter().copied()) {
            self.held = self.frame.held(stuck.collect());
        }
    }

    fn record_step(&mut self) {
        self.steps.extend([self.clock.high, self.clock.low]);
        self.steps.extend(&self.x);
        self.steps.extend(&self.v);
        for (rub, contact) in self.rubs.iter().zip(&self.contacts) {
            let branch = if rub.direction == 0.0 {
                0
            } else {
                contact.piece.branch
            };
            self.steps
                .extend([rub.direction, rub.offset, rub.slope, f64::from(branch)]);
        }
    }

    fn advance(&mut self, h: f64) {
        self.motion.state(h, &mut self.x, &mut self.v);
        self.clock = self.clock.after(h);
    }

    fn rested(&self, c: usize) -> f64 {
        -self.clock.until(self.contacts[c].since.high) + self.contacts[c].since.low
    }

    /// The first event within `horizon`.
    fn next(&self, horizon: f64) -> Option<(f64, usize, Cause)> {
        let rounding = ROUNDING * self.scale;
        let mut found = None;
        let mut reach = horizon;
        for (c, contact) in self.contacts.iter().enumerate() {
            if contact.direction == 0.0 {
                if contact.pinned != 0.0 {
                    continue;
                }
                let rested = self.rested(c);
                if let Some(h) = end_of_adhesion(self.laws[c], &self.motion.force[c], rested, reach)
                    && (h < reach || found.is_none())
                {
                    (found, reach) = (Some((h, c, Cause::Release)), h);
                }
                continue;
            }
            let u = &self.motion.u[c];
            let piece = &contact.piece;
            let mut guard = *u;
            guard[0] -= piece.low;
            if let Some(h) = first_root(&guard, rounding, contact.turning, reach)
                && (h < reach || found.is_none())
            {
                (found, reach) = (Some((h, c, Cause::End(End::Low))), h);
            }
            if piece.high.is_finite() {
                let mut guard = u.map(|term| -term);
                guard[0] += piece.high;
                if let Some(h) = first_root(&guard, rounding, contact.turning, reach)
                    && (h < reach || found.is_none())
                {
                    (found, reach) = (Some((h, c, Cause::End(End::High))), h);
                }
            }
            if piece.turns {
                let mut guard = derivative(u).map(|term| contact.sense * term);
                if contact.turning {
                    guard[0] = 0.0;
                }
                let end = End::Turn {
                    rising: contact.sense < 0.0,
                };
                if let Some(h) = first_root(&guard, self.frame.rate * rounding, false, reach)
                    && (h < reach || found.is_none())
                {
                    (found, reach) = (Some((h, c, Cause::End(end))), h);
                }
            }
        }
        found
    }

    /// Go to the event and into the modes that follow it.
    fn occur(&mut self, h: f64, c: usize, cause: Cause) {
        let tolerance = ROUNDING * self.scale;
        let arrived: Vec<usize> = (0..self.contacts.len())
            .filter(|&other| {
                let contact = &self.contacts[other];
                if contact.direction == 0.0 || contact.piece.low > 0.0 {
                    return false;
                }
                if other == c {
                    return cause == Cause::End(End::Low);
                }
                let (speed, slope) = slope_at(&self.motion.u[other], h);
                // One that has just left zero with no slope has no sign of it yet.
                speed <= tolerance && slope < 0.0 && !(h == 0.0 && contact.turning)
            })
            .collect();
        let speed = at(&self.motion.u[c], h).max(0.0);
        let passage = Passage {
            released: (cause == Cause::Release).then(|| (c, at(&self.motion.force[c], h).signum())),
            rates: self.rates(h),
            starting: false,
            arrived,
        };
        self.advance(h);
        self.motion.aim(&self.frame, self.clock);
        if h > 0.0 {
            // An event at once, at another contact, leaves what is known of the start as it was.
            for contact in &mut self.contacts {
                contact.turning = false;
            }
        }
        if let Cause::End(end) = cause
            && !passage.arrived.contains(&c)
        {
            let rate = self.rate_if_stuck(c);
            let contact = &mut self.contacts[c];
            contact.memory.force_rate = rate;
            let turn = matches!(end, End::Turn { .. });
            let speed = match end {
                End::Low => contact.piece.low,
                End::High => contact.piece.high,
                End::Turn { .. } => speed,
            };
            let force = contact.direction * self.laws[c].force(&contact.piece, speed);
            contact.piece = self.laws[c].next(&contact.piece, end, speed, &mut contact.memory);
            contact.sense = 0.0;
            contact.turning = turn;
            self.tell(if turn { Kind::Reversal } else { Kind::Node }, c, force);
        }
        self.settle(&passage);
    }

    /// The rates of the friction forces at `h`.
    fn rates(&self, h: f64) -> Vec<f64> {
        self.motion
            .force
            .iter()
            .map(|force| slope_at(force, h).1)
            .collect()
    }

    /// |dF/dt| that adhesion would feel if the contact stuck now; 0 where its law does not ask.
    fn rate_if_stuck(&self, c: usize) -> f64 {
        if !self.laws[c].feels_force_rate() {
            return 0.0;
        }
        let mut rubs: Vec<Rub> = self.contacts.iter().map(Contact::rub).collect();
        rubs[c] = Rub {
            direction: 0.0,
            offset: 0.0,
            slope: 0.0,
        };
        let held = self
            .frame
            .held((0..rubs.len()).filter(|&c| rubs[c].holds()).collect());
        let (mut motion, mut v) = (self.motion.clone(), self.v.clone());
        self.frame.stop(&held, self.clock, &mut v);
        motion.expand(&self.frame, &self.laws, &rubs, &held, &self.x, &v);
        motion.force[c][1].abs()
    }

    /// Decide for all contacts with zero slip velocity at once.
    fn settle(&mut self, passage: &Passage) {
        let is_new = |c: usize| passage.arrived.contains(&c);
        let zero: Vec<usize> = (0..self.contacts.len())
            .filter(|&c| self.contacts[c].direction == 0.0 && !passage.starting || is_new(c))
            .collect();
        if zero.is_empty() {
            return;
        }
        let all = self.frame.held(zero.clone());
        self.frame.stop(&all, self.clock, &mut self.v);
        // What adhesion bears, and what slip would start with.
        let limit: Vec<f64> = zero
            .iter()
            .map(|&c| {
                self.laws[c].break_away(if is_new(c) {
                    Hold {
                        stick_time: 0.0,
                        force_rate: self.rate_if_stuck(c),
                    }
                } else {
                    Hold {
                        stick_time: self.rested(c),
                        force_rate: passage.rates[c].abs(),
                    }
                })
            })
            .collect();
        let kinetic: Vec<f64> = (0..zero.len())
            .map(|row| {
                let law = self.laws[zero[row]];
                let piece = law.leave(limit[row], &mut self.contacts[zero[row]].memory.clone());
                law.force(&piece, 0.0)
            })
            .collect();
        let mut wants = Vec::new();
        self.motion.wants(&self.frame, &self.x, &self.v, &mut wants);
        for (c, contact) in self.contacts.iter().enumerate() {
            if zero.contains(&c) {
                continue;
            }
            let speed = contact.direction * (self.motion.drive(c).0 - self.frame.across(c, |i| self.v[i]));
            let force = contact.direction * self.laws[c].force(&contact.piece, speed.max(0.0));
            for (to, want) in wants.iter_mut().enumerate() {
                *want -= self.frame.coupling(to, c) * force;
            }
        }
        let row_of = |c: usize| zero.iter().position(|&other| other == c).unwrap_or(0);
        let question = Question {
            frame: &self.frame,
            zero: &zero,
            limit: &limit,
            kinetic: &kinetic,
            wants: zero.iter().map(|&c| wants[c]).collect(),
            drives: self.motion.drives(),
            released: passage.released.map(|(c, direction)| (row_of(c), direction)),
        };
        let answer = question.answer();
        let idle: Vec<bool> = (0..zero.len()).map(|row| question.idle(&answer, row)).collect();
        for (row, &c) in zero.iter().enumerate() {
            let idle = idle[row];
            let direction = if idle { 0.0 } else { answer[row] };
            self.contacts[c].pinned = if idle { answer[row] * limit[row] } else { 0.0 };
            if !is_new(c) && direction == 0.0 {
                continue;
            }
            let stick_time = self.rested(c);
            let contact = &mut self.contacts[c];
            let was = contact.direction * self.laws[c].force(&contact.piece, 0.0);
            contact.direction = direction;
            contact.sense = 0.0;
            contact.turning = false;
            if direction == 0.0 {
                contact.since = self.clock;
                self.tell(Kind::Capture, c, was);
                continue;
            }
            contact.piece = self.laws[c].leave(limit[row], &mut contact.memory);
            // Adhesion that broke at the force slip starts with: the slip velocity leaves zero with no slope.
            contact.turning = kinetic[row] >= limit[row];
            if is_new(c) {
                self.tell(Kind::Crossing, c, was);
            } else {
                self.tell(Kind::Release, c, limit[row] * direction);
                if let Some(event) = self.events.last_mut() {
                    (event.stick_time, event.force_rate) = (stick_time, passage.rates[c] * direction);
                }
            }
        }
    }

    fn tell(&mut self, kind: Kind, contact: usize, force: f64) {
        let mass = self.mass_of[contact];
        self.work.events += 1;
        self.events.push(Event {
            t: self.clock.high,
            kind,
            contact,
            x: self.x[mass],
            v: self.v[mass],
            force,
            stick_time: f64::NAN,
            force_rate: f64::NAN,
        });
    }
}

/// What led to a new combination of modes.
struct Passage {
    /// Contacts whose slip speed reached zero just now.
    arrived: Vec<usize>,
    /// The contact whose adhesion broke, and the sign of the force that broke it.
    released: Option<(usize, f64)>,
    /// The rates of the friction forces just before.
    rates: Vec<f64>,
    /// At the start nothing stuck before.
    starting: bool,
}

/// Who of the contacts with zero slip velocity sticks, and where the others go.
struct Question<'a> {
    frame: &'a Frame,
    zero: &'a [usize],
    /// What adhesion bears.
    limit: &'a [f64],
    /// Friction slip would start with.
    kinetic: &'a [f64],
    /// The relative accelerations that the contacts must make up for to hold.
    wants: Vec<f64>,
    /// The drive velocities of all contacts.
    drives: &'a [Series],
    /// The contact that cannot stick, by its place in `zero`.
    released: Option<(usize, f64)>,
}

impl Question<'_> {
    /// Whether a contact that does not stick is held in place all the same, by others that do.
    fn idle(&self, grip: &[f64], row: usize) -> bool {
        grip[row] != 0.0 && self.follows(grip, row) == Some(true)
    }

    /// Whether the motion across a contact is given by the other stuck ones, and if so whether its drive goes along.
    fn follows(&self, grip: &[f64], row: usize) -> Option<bool> {
        if !self.frame.loops {
            return None;
        }
        let place = |row: usize| self.zero[row];
        let stuck: Vec<usize> = (0..grip.len())
            .filter(|&other| other != row && grip[other] == 0.0)
            .collect();
        if stuck.is_empty() {
            return None;
        }
        // b_row as a sum of those of the stuck ones, and what of its own response to a force is then left.
        let held = self.frame.held(stuck.iter().map(|&row| place(row)).collect());
        let own = self.frame.coupling(place(row), place(row));
        let share = held.forces(|i| self.frame.coupling(place(stuck[i]), place(row)));
        let sum = |term: &dyn Fn(usize) -> f64| -> f64 {
            stuck
                .iter()
                .zip(&share)
                .map(|(&from, share)| share * term(place(from)))
                .sum()
        };
        if own - sum(&|from| self.frame.coupling(place(row), from)) > 1e-9 * own {
            return None;
        }
        let size = self
            .drives
            .iter()
            .flatten()
            .fold(0.0, |most: f64, term| most.max(term.abs()));
        Some(
            (0..=ORDER).all(|k| {
                (self.drives[place(row)][k] - sum(&|from| self.drives[from][k])).abs() <= 1e-9 * size
            }),
        )
    }

    /// For each contact the force with which it sticks, or the slip acceleration along its direction; and for one that
    /// cannot be held (redundant contacts that want different accelerations) the acceleration that is left.
    fn loads(&self, grip: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut wants = self.wants.clone();
        let place = |row: usize| self.zero[row];
        for from in (0..grip.len()).filter(|&row| grip[row] != 0.0) {
            let size = if self.idle(grip, from) {
                self.limit[from]
            } else {
                self.kinetic[from]
            };
            let force = grip[from] * size;
            for (to, want) in wants.iter_mut().enumerate() {
                *want -= self.frame.coupling(place(to), place(from)) * force;
            }
        }
        let stuck: Vec<usize> = (0..grip.len()).filter(|&row| grip[row] == 0.0).collect();
        let mut load = vec![0.0; grip.len()];
        if !stuck.is_empty() {
            let held = self.frame.held(stuck.iter().map(|&row| place(row)).collect());
            for (row, force) in stuck.iter().zip(held.forces(|i| wants[stuck[i]])) {
                load[*row] = force;
            }
            for &from in &stuck {
                for (to, want) in wants.iter_mut().enumerate() {
                    *want -= self.frame.coupling(place(to), place(from)) * load[from];
                }
            }
        }
        (load, wants)
    }

    /// The most overloaded of the stuck contacts, with its direction; or a slipping one that would go backwards, with 0.
    fn objection(&self, grip: &[f64]) -> Option<(usize, f64)> {
        const ROOM: f64 = 16.0 * f64::EPSILON;
        let (load, left) = self.loads(grip);
        let size = self
            .wants
            .iter()
            .fold(0.0, |most: f64, want| most.max(want.abs()));
        let mut worst = None;
        let mut most = 1.0 + ROOM;
        for row in (0..grip.len()).filter(|&row| grip[row] == 0.0) {
            let unheld = left[row].abs() > 1e-9 * size || self.follows(grip, row) == Some(false);
            // A contact at its limit beside one that breaks breaks too.
            let room = if self.released.is_some() {
                1.0 - ROOM
            } else {
                1.0 + ROOM
            };
            let share = if unheld {
                f64::INFINITY
            } else if load[row] == 0.0 {
                0.0
            } else {
                load[row].abs() / self.limit[row] / room
            };
            if share * (1.0 + ROOM) > most {
                most = share * (1.0 + ROOM);
                worst = Some((row, if unheld { left[row] } else { load[row] }.signum()));
            }
        }
        worst.or_else(|| {
            let backwards = |&row: &usize| grip[row] * left[row] < -1e-10 * size;
            let slips = (0..grip.len()).filter(|&row| grip[row] != 0.0 && !self.idle(grip, row));
            slips.clone().find(backwards).map(|row| (row, 0.0))
        })
    }

    /// The direction of every contact, 0 for those that stick.
    fn answer(&self) -> Vec<f64> {
        let count = self.zero.len();
        let mut grip = vec![0.0; count];
        if let Some((row, direction)) = self.released {
            grip[row] = direction;
        }
        for _ in 0..4 * count + 4 {
            match self.objection(&grip) {
                None => return grip,
                Some((row, direction)) => grip[row] = direction,
            }
        }
        // In circles: the first consistent combination. Beyond a few contacts there are too many to try.
        if count <= 8 {
            for code in 0..3_usize.pow(u32::try_from(count).unwrap_or(0)) {
                let mut rest = code;
                let trial: Vec<f64> = (0..count)
                    .map(|_| {
                        let digit = [0.0, 1.0, -1.0][rest % 3];
                        rest /= 3;
                        digit
                    })
                    .collect();
                if self.released.is_none_or(|(row, _)| trial[row] != 0.0) && self.objection(&trial).is_none()
                {
                    return trial;
                }
            }
        }
        grip
    }
}

/// When adhesion under `force` breaks within `reach`, for a contact that has rested for `rested`.
fn end_of_adhesion(law: &Law, force: &Series, rested: f64, reach: f64) -> Option<f64> {
    let limit = |t: f64, rate: f64| {
        law.break_away(Hold {
            stick_time: rested + t,
            force_rate: rate.abs(),
        })
    };
    let feels_rate = law.feels_force_rate();
    let bears = limit(0.0, force[1]);
    let rounding = 4.0 * f64::EPSILON * bears;
    if !feels_rate && law.growth_bound(rested) == 0.0 {
        let mut upper = force.map(|term| -term);
        let mut lower = *force;
        upper[0] += bears;
        lower[0] += bears;
        let first = first_root(&upper, rounding, false, reach);
        let second = first_root(&lower, rounding, false, first.unwrap_or(reach));
        return second.or(first);
    }
    let bend = curvature(force, reach);
    let flat = bend * reach * reach <= rounding;
    let tiny = f64::EPSILON * reach;
    let mut t = 0.0;
    loop {
        let (value, rate) = slope_at(force, t);
        let bears = limit(t, rate);
        let outward = rate * value.signum();
        if bears - value.abs() <= rounding {
            if t > 0.0 || outward > 0.0 {
                return Some(t);
            }
            // Adhesion that starts at its limit and is relieved from there.
            t += f64::EPSILON.sqrt() * reach;
            continue;
        }
        let mut step = free_time(bears - value, -rate, bend)
            .min(free_time(bears + value, rate, bend))
            .min(reach - t);
        if feels_rate && !flat {
            // The limit falls with the force rate: at the worst rate ahead it must still bear.
            while limit(t, rate.abs() + bend * step)
                - value.abs()
                - rate.abs() * step
                - 0.5 * bend * step * step
                <= 0.0
            {
                step *= 0.5;
                if step < tiny {
                    return Some(t);
                }
            }
        }
        if (!feels_rate || flat) && law.growth_bound(rested + t) < outward - 2.0 * bend * step {
            // The margin falls from here on: one root, close it.
            let margin = |t: f64| {
                let (value, rate) = slope_at(force, t);
                limit(t, rate) - value.abs()
            };
            let until = (t + 2.0 * step).min(reach);
            if margin(until) <= 0.0 {
                return Some(close(margin, t, until));
            }
            step = until - t;
        }
        if step <= tiny && t + step < reach {
            return Some(t);
        }
        t += step;
        if t >= reach {
            return None;
        }
    }
}

/// The root of a falling margin, positive at `low` and not at `high`: secant steps inside a bracket (Illinois).
fn close(margin: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let (mut above, mut below) = (margin(low), margin(high));
    let mut moved = 0;
    for _ in 0..200 {
        if below == 0.0 || high - low <= 2.0 * f64::EPSILON * high {
            break;
        }
        let mut t = high - below * (high - low) / (below - above);
        if !(t > low && t < high) {
            t = 0.5 * (low + high);
            if t <= low || t >= high {
                break;
            }
        }
        let value = margin(t);
        if value > 0.0 {
            (low, above) = (t, value);
            below *= if moved == 1 { 0.5 } else { 1.0 };
            moved = 1;
        } else {
            (high, below) = (t, value);
            above *= if moved == 2 { 0.5 } else { 1.0 };
            moved = 2;
        }
    }
    high
}
