//! The derivative of a segment: the motion between two events with the derivatives of its numbers, by Taylor steps.

mod numbers;
mod parameters;

use std::cell::{OnceCell, RefCell};
use std::rc::Rc;

use super::closed::{Closed, Moved};
use super::state::{ContactMode, Layout, Moving, STICK_TIME};
use super::varied::{Parameter, Varied, difference};
use crate::clock::Clock;
use crate::dual::Dual;
use crate::flow::taylor::tangent::{Along, BLOCK, Block, Given, Linear, Tangent, stiffening};
use crate::flow::taylor::{ForceLine, Frame, Held, Motion, VectorField, holding};
use crate::law::Law;
use crate::series::{Series, ZERO};
use crate::system::System;
use parameters::{Around, Beside};

/// A phase of more steps has run away from the motion it was taken from, to where its law grows without bound.
const MOST_STEPS: u32 = 10_000;

/// The order of an expansion of which numbers and their rates at its start are asked.
const RATES_ORDER: usize = 2;

/// A system ready to be expanded, and those beside it.
pub(super) struct VariedMotion<'a> {
    pub(super) varied: &'a Varied,
    pub(super) frame: Frame,
    pub(super) laws: Vec<&'a Law>,
    pub(super) layout: Layout,
    /// The closed form, where there is one.
    pub(super) closed: Option<Rc<Closed>>,
    /// The parameters that change the motion within a phase: which, and the systems around it. Made when first asked for, as
    /// closed form has no need of them.
    acting: OnceCell<Vec<(usize, Option<Around<'a>>)>>,
    /// Memory for a look at what would be.
    spare: RefCell<Expansion>,
    /// And for the line of friction that a contact leaves.
    pub(super) line: RefCell<Vec<Dual>>,
}

/// What the contacts do along a phase, as the flow needs to know it.
pub(super) struct Mode {
    force_lines: Vec<ForceLine>,
    held: Held,
    beside: Vec<Option<[Held; 4]>>,
}

/// A Taylor expansion with its derivatives, and the time into it; its memory is used again for the next. The last axis is the
/// time along the phase.
#[derive(Clone)]
pub(super) struct Expansion {
    motion: Motion,
    /// The directions along which the motion moves, [`BLOCK`] to a tangent.
    moving: Vec<usize>,
    tangents: Vec<Tangent>,
    /// F′ along the motion, of smooth laws.
    slopes: Vec<Series>,
    /// What each acting parameter changes.
    acting: Vec<([Beside; 4], Given)>,
    x: Vec<f64>,
    v: Vec<f64>,
    /// What closed form gave in place of an expansion.
    leapt: Option<Moved>,
    directions: usize,
    /// When the expansion begins, from the start of the phase.
    pub(super) begin: f64,
    pub(super) h: f64,
    /// How far it is good.
    pub(super) reach: f64,
}

fn laws(system: &System) -> Vec<&Law> {
    system.contacts.iter().map(|contact| &contact.law).collect()
}

/// What the flow needs to know of every contact.
pub(super) fn force_lines(contact_modes: &[ContactMode], line: impl Fn(usize) -> [f64; 2]) -> Vec<ForceLine> {
    let force_line = |(c, contact_mode): (usize, &ContactMode)| {
        let (direction, [offset, slope]) = match *contact_mode {
            ContactMode::Stick => return ForceLine::STUCK,
            ContactMode::Hold(direction) => (direction, [0.0, f64::INFINITY]),
            ContactMode::Slip(direction) => (direction, line(c)),
        };
        ForceLine {
            direction,
            offset,
            slope,
            zero_slope: false,
        }
    };
    contact_modes.iter().enumerate().map(force_line).collect()
}

impl<'a> VariedMotion<'a> {
    pub(super) fn new(varied: &'a Varied) -> Self {
        let base = &varied.base;
        let frame = Frame::of(base);
        Self {
            varied,
            laws: laws(base),
            layout: Layout::of(base),
            closed: Closed::of(varied).map(Rc::new),
            spare: RefCell::new(Expansion::of(&frame)),
            line: RefCell::new(vec![Dual::fixed(0.0, 0); STICK_TIME]),
            frame,
            acting: OnceCell::new(),
        }
    }

    /// Whether phases are followed in closed form, where it does not lose digits.
    pub(super) fn is_closed(&self) -> bool {
        self.closed.is_some() && !self.frame.is_smooth(0, 1.0) && !self.frame.is_smooth(0, -1.0)
    }

    /// Room for expansions.
    pub(super) fn expansion(&self) -> Expansion {
        Expansion::of(&self.frame)
    }

    /// The directions of differentiation, and the time along the phase.
    pub(super) fn all_directions(&self) -> usize {
        self.varied.directions() + 1
    }

    /// The axis of the first parameter among `directions`; none where only time counts.
    pub(super) fn parameters(&self, directions: usize) -> Option<usize> {
        (directions > 1).then(|| self.layout.width())
    }

    /// The parameters and their directions among `directions`.
    pub(super) fn directions_of(&self, directions: usize) -> impl Iterator<Item = (&Parameter, usize)> {
        let directions = self.parameters(directions).into_iter().flat_map(|first| first..);
        self.varied.parameters.iter().zip(directions)
    }

    /// What the contacts do along a phase from a state.
    fn mode(&self, state: &Moving, contact_modes: &[ContactMode]) -> Mode {
        let force_lines = force_lines(contact_modes, |c| {
            let at = self.layout.contact(c);
            [state.numbers[at].value, state.numbers[at + 1].value]
        });
        let held = self.frame.held_along(holding(&force_lines));
        // What systems beside this one would give is asked only where parameters have directions.
        let acting = match state.numbers[0].rates.len() {
            1 => &[],
            _ => self.acting(),
        };
        Mode {
            beside: (acting.iter())
                .map(|(_, around)| {
                    let (beside, _) = around.as_ref()?;
                    let beside = beside.each_ref();
                    Some(beside.map(|(frame, _)| frame.held(held.contacts.clone())))
                })
                .collect(),
            force_lines,
            held,
        }
    }

    /// To the motion `tau` from the start of a phase.
    pub(super) fn go(
        &self,
        start: &Moving,
        contact_modes: &[ContactMode],
        tau: f64,
        expansion: &mut Expansion,
    ) {
        if !self.leap(start, contact_modes, tau, expansion) {
            self.walk(start, contact_modes, tau, expansion, &mut |_| {});
        }
    }

    /// The same in closed form, false where there is none; the expansion is good at that time alone.
    fn leap(
        &self,
        start: &Moving,
        contact_modes: &[ContactMode],
        tau: f64,
        expansion: &mut Expansion,
    ) -> bool {
        let (Some(closed), &[contact_mode]) = (&self.closed, contact_modes) else {
            return false;
        };
        if contact_mode != ContactMode::Stick && self.frame.is_smooth(0, contact_mode.direction()) {
            return false;
        }
        closed.go(start, contact_mode, tau, &mut expansion.leapt);
        (expansion.begin, expansion.h, expansion.reach) = (tau, 0.0, 0.0);
        expansion.leapt.is_some()
    }

    /// The same from an expansion near by.
    pub(super) fn shift(
        &self,
        start: &Moving,
        contact_modes: &[ContactMode],
        tau: f64,
        expansion: &mut Expansion,
    ) {
        let h = tau - expansion.begin;
        if (-0.1 * expansion.reach..=expansion.reach).contains(&h) {
            expansion.h = h;
        } else {
            self.go(start, contact_modes, tau, expansion);
        }
    }

    /// To the motion `tau` from the start of a phase; `pass` sees every expansion on the way but the last.
    pub(super) fn walk(
        &self,
        start: &Moving,
        contact_modes: &[ContactMode],
        tau: f64,
        expansion: &mut Expansion,
        pass: &mut dyn FnMut(&Expansion),
    ) {
        let mut here = start.clone();
        let mut clock = Clock::at(start.numbers[0].value);
        self.stop_stuck_masses(&mut here, contact_modes);
        let mode = self.mode(&here, contact_modes);
        (expansion.begin, expansion.leapt) = (0.0, None);
        for step in 0.. {
            self.expand(self.frame.order, &here, &mode, clock, expansion);
            if tau - expansion.begin <= expansion.reach {
                expansion.h = tau - expansion.begin;
                return;
            }
            if step == MOST_STEPS || expansion.reach.is_nan() || expansion.reach <= 0.0 {
                expansion.h = f64::NAN;
                return;
            }
            expansion.h = expansion.reach;
            pass(expansion);
            clock = clock.after(expansion.reach);
            for i in 0..self.layout.masses {
                here.numbers[self.layout.x(i)] = expansion.x(i);
                here.numbers[self.layout.v(i)] = expansion.v(i);
            }
            // Time along the phase is counted from where it ends.
            for number in &mut here.numbers {
                if let Some(rate) = number.rates.last_mut() {
                    *rate = 0.0;
                }
            }
            expansion.begin += expansion.reach;
        }
    }

    /// Stuck contacts leave no choice of their slip velocity.
    pub(super) fn stop_stuck_masses(&self, state: &mut Moving, contact_modes: &[ContactMode]) {
        if let Some(closed) = &self.closed {
            if contact_modes == [ContactMode::Stick] {
                state.numbers[self.layout.v(0)] = closed.drive(state.numbers[0].rates.len());
            }
            return;
        }
        let stuck: Vec<usize> = (0..contact_modes.len())
            .filter(|&c| contact_modes[c] == ContactMode::Stick)
            .collect();
        if stuck.is_empty() {
            return;
        }
        let held = self.frame.held(stuck);
        let clock = Clock::at(state.numbers[0].value);
        let drives = self.drives(clock, &state.numbers[0]);
        let contacts = &self.varied.base.contacts;
        let slip: Vec<Dual> = held
            .contacts
            .iter()
            .map(|&c| {
                let own = drives[c].clone() - &state.numbers[self.layout.v(contacts[c].mass)];
                match contacts[c].other {
                    Some(other) => own + &state.numbers[self.layout.v(other)],
                    None => own,
                }
            })
            .collect();
        for (row, &c) in held.contacts.iter().enumerate() {
            for &(at, gain) in held.gain(row) {
                let slip = &slip[at];
                for i in 0..self.layout.masses {
                    let share = self.frame.response(c, i) * gain;
                    let number = &mut state.numbers[self.layout.v(i)];
                    number.value += share * slip.value;
                    number.shift(share, slip);
                }
            }
        }
        for &c in &held.contacts {
            if contacts[c].other.is_none() {
                // To the last digit.
                state.numbers[self.layout.v(contacts[c].mass)].clone_from(&drives[c]);
            }
        }
    }

    /// The drive velocities at a time.
    pub(super) fn drives(&self, clock: Clock, t: &Dual) -> Vec<Dual> {
        let directions = t.rates.len();
        if let Some(closed) = &self.closed {
            return vec![closed.drive(directions)];
        }
        let mut series = ZERO;
        (0..self.layout.contacts)
            .map(|c| {
                self.frame.drives[c].expand(clock, &mut series);
                let mut drive = Dual::fixed(series[0], directions);
                drive.shift(series[1], t);
                for (around, axis) in self.acting_on(directions) {
                    let Some((beside, step)) = around else { continue };
                    let drives = beside.each_ref().map(|(frame, _)| {
                        frame.drives[c].expand(clock, &mut series);
                        series[0]
                    });
                    drive.rates[axis] += difference(drives, *step);
                }
                drive
            })
            .collect()
    }

    /// The expansion from a state, with a tangent for every axis along which it moves, up to the `order`.
    fn expand(&self, order: usize, state: &Moving, mode: &Mode, clock: Clock, expansion: &mut Expansion) {
        for i in 0..self.layout.masses {
            expansion.x[i] = state.numbers[self.layout.x(i)].value;
            expansion.v[i] = state.numbers[self.layout.v(i)].value;
        }
        expansion.motion.aim(&self.frame, clock);
        // A motion is followed by its slow part where its tangents have no fast part either; few coefficients do not tell.
        let slow = order == self.frame.order && self.expand_part(true, order, state, mode, clock, expansion);
        if !slow {
            self.expand_part(false, order, state, mode, clock, expansion);
        }
    }

    /// The same by what damping leaves, where that is all there is, or by the whole; whether the tangents are slow as well.
    fn expand_part(
        &self,
        slow: bool,
        order: usize,
        state: &Moving,
        mode: &Mode,
        clock: Clock,
        expansion: &mut Expansion,
    ) -> bool {
        let layout = self.layout;
        let number = |axis: usize| &state.numbers[axis];
        let Mode {
            force_lines, held, ..
        } = mode;
        let (x, v, motion) = (&expansion.x, &expansion.v, &mut expansion.motion);
        let field = VectorField {
            frame: &self.frame,
            laws: &self.laws,
            force_lines,
            held,
        };
        if slow {
            motion.expand(&field, x, v);
        } else {
            motion.expand_whole(&field, x, v);
        }
        expansion.reach = if order < self.frame.order {
            0.0
        } else {
            // A motion that damping leaves slow has no speed of its position times the fastest rate.
            let frame = &self.frame;
            let sizes = (0..layout.masses).map(|i| {
                if motion.is_slow() {
                    frame.sprung(i, x)
                } else {
                    frame.rate * x[i].abs()
                }
            });
            let scale = sizes
                .chain(v.iter().map(|v| v.abs()))
                .fold(self.frame.push, f64::max)
                .max(motion.speed(&self.frame, force_lines))
                .max(f64::MIN_POSITIVE);
            let step = motion.reach(&self.frame, force_lines, scale);
            // The series of a motion that stands still is good for ever.
            if step.is_finite() {
                motion.agreed(&self.frame, &self.laws, force_lines, scale, step)
            } else {
                f64::INFINITY
            }
        };
        expansion.directions = number(0).rates.len();
        expansion.moving.clear();
        // Without other directions time needs no tangent: it is the slope of the series.
        if expansion.directions == 1 {
            return true;
        }
        let smooth = |c: usize| self.frame.is_smooth(c, force_lines[c].direction);
        for (c, slope) in expansion.slopes.iter_mut().enumerate() {
            if smooth(c) && !force_lines[c].holds() {
                *slope = stiffening(
                    self.laws[c].toward(force_lines[c].direction),
                    &expansion.motion.u.series(c),
                );
            }
        }
        if cfg!(feature = "continuation") {
            self.give(order, mode, clock, expansion);
        }
        let acting: Vec<usize> = self
            .acting_on(expansion.directions)
            .map(|(_, axis)| axis)
            .collect();
        let line = |c: usize| {
            let counts = !force_lines[c].holds() && !smooth(c);
            let at = layout.contact(c);
            counts.then(|| [number(at), number(at + 1)])
        };
        let lines = (0..layout.contacts).filter_map(line).flatten();
        let counts: Vec<&Dual> = state.numbers[..layout.contact(0)].iter().chain(lines).collect();
        let moves =
            |axis: usize| acting.contains(&axis) || counts.iter().any(|number| number.rates[axis] != 0.0);
        expansion
            .moving
            .extend((0..expansion.directions).filter(|&axis| moves(axis)));
        let blocks = expansion.moving.len().div_ceil(BLOCK);
        if expansion.tangents.len() < blocks {
            expansion.tangents.resize(blocks, Tangent::new(&self.frame));
        }
        for (tangent, moving) in expansion.tangents.iter_mut().zip(expansion.moving.chunks(BLOCK)) {
            let along = |number: &Dual| -> Block {
                let rates = &*number.rates;
                std::array::from_fn(|axis| moving.get(axis).map_or(0.0, |&axis| rates[axis]))
            };
            tangent.clock = along(number(0));
            for i in 0..layout.masses {
                tangent.x[i][0] = along(number(layout.x(i)));
                tangent.v[i][0] = along(number(layout.v(i)));
            }
            for (c, own) in tangent.line.iter_mut().enumerate() {
                *own = line(c).map_or([Block::NOTHING; 2], |line| line.map(along));
            }
            let given = acting
                .iter()
                .zip(&expansion.acting)
                .filter_map(|(axis, (_, given))| {
                    let along = moving.iter().position(|moving| moving == axis)?;
                    Some((along, given))
                });
            let along = Along {
                order,
                frame: &self.frame,
                motion: &expansion.motion,
                force_lines,
                held,
                slopes: &expansion.slopes,
                given: &given.collect::<Vec<_>>(),
            };
            if !expansion.motion.is_slow() {
                tangent.expand(&along);
            } else if !tangent.expand_slow(&along) {
                return false;
            }
            // Those of its tangents need not be.
            if expansion.reach.is_infinite() && !tangent.ended(order) {
                expansion.reach = 1.0 / expansion.motion.rate(&self.frame);
            }
        }
        true
    }

    /// The force of a contact and its rate at the start of a phase on which it would stick.
    pub(super) fn holding(&self, state: &Moving, contact_modes: &[ContactMode], c: usize) -> [Dual; 2] {
        if let Some(closed) = &self.closed {
            return closed.holding(&state.numbers[self.layout.x(0)], &state.numbers[0]);
        }
        let clock = Clock::at(state.numbers[0].value);
        let expansion = &mut *self.spare.borrow_mut();
        self.expand(
            RATES_ORDER,
            state,
            &self.mode(state, contact_modes),
            clock,
            expansion,
        );
        [0, 1].map(|k| expansion.coefficient(k, c, |motion| &motion.force, |tangent| &tangent.force[c]))
    }
}

impl Expansion {
    fn of(frame: &Frame) -> Self {
        let motion = Motion::of(frame);
        let (x, u) = (vec![ZERO; frame.masses], vec![ZERO; motion.u.count()]);
        Self {
            acting: Vec::new(),
            motion,
            moving: Vec::new(),
            tangents: Vec::new(),
            slopes: u,
            x: vec![0.0; x.len()],
            v: vec![0.0; x.len()],
            leapt: None,
            directions: 0,
            begin: 0.0,
            h: 0.0,
            reach: 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::{ContactMode, VariedMotion};
    use crate::system::System;
    use crate::variation::state::State;
    use crate::variation::varied::Varied;

    #[test]
    fn the_closed_form_moves_as_the_variational_equation_does() {
        // Damping of the phase is 0.3 − slope: it oscillates, hardly or not at all, dies or grows.
        for slope in [0.0, -0.5, -0.3, 1.69, 1.7, 1.71, 2.2] {
            for (tau, forces) in [(4.0, 2), (1e-3, 1), (0.4, 0), (9.0, 1)] {
                let harmonics = [
                    json!({"amplitude": 0.4, "frequency": 0.7, "phase": 0.2}),
                    json!({"amplitude": 0.2, "frequency": 2.3, "phase": -1.0}),
                ];
                let document = json!({
                    "mass": 1.3, "stiffness": 0.9, "damping": 0.3, "drive_velocity": 0.4,
                    "law": {"type": "StaticKinetic", "break_away": 1.0, "kinetic": 0.6},
                    "forcing": harmonics[..forces],
                });
                let named = [
                    "/mass",
                    "/stiffness",
                    "/damping",
                    "/drive_velocity",
                    "/law/kinetic",
                ];
                let of_forces = ["/forcing/0/amplitude", "/forcing/0/frequency", "/forcing/0/phase"];
                let paths: Vec<String> = named
                    .iter()
                    .chain(if forces > 0 { &of_forces[..] } else { &[] })
                    .map(ToString::to_string)
                    .collect();
                let (system, _) = System::read(&document).expect("a good system");
                let varied = Varied::new(&system, &document, &paths).expect("good numbers");
                let motion = VariedMotion::new(&varied);
                let mut numbers = vec![7.0, 0.5, -0.2, 0.6, slope, 0.0, f64::INFINITY];
                numbers.resize(motion.layout.width(), 0.0);
                let start = State {
                    numbers,
                    flags: vec![crate::variation::Flags::default()],
                }
                .seeded(motion.all_directions());
                let (mut stepped, mut leapt) = (motion.expansion(), motion.expansion());
                for contact_mode in [
                    ContactMode::Slip(1.0),
                    ContactMode::Slip(-1.0),
                    ContactMode::Stick,
                ] {
                    motion.walk(&start, &[contact_mode], tau, &mut stepped, &mut |_| {});
                    assert!(motion.leap(&start, &[contact_mode], tau, &mut leapt));
                    let pairs = [
                        (stepped.x(0), leapt.x(0)),
                        (stepped.v(0), leapt.v(0)),
                        (stepped.force(0), leapt.force(0)),
                        (stepped.force_rate(0), leapt.force_rate(0)),
                    ];
                    for (stepped, leapt) in pairs {
                        let size = stepped
                            .rates
                            .iter()
                            .fold(stepped.value.abs(), |most, rate| most.max(rate.abs()));
                        let both = stepped.rates.iter().zip(leapt.rates.iter());
                        for (one, other) in both.chain([(&stepped.value, &leapt.value)]) {
                            // The other one takes differences of the fourth order by the frequency.
                            assert!(
                                (one - other).abs() < 1e-8 * size.max(1.0),
                                "{one} {other} of {contact_mode:?} with the slope {slope} at {tau}"
                            );
                        }
                    }
                }
            }
        }
    }
}
