//! The derivative of a segment: the motion between two events with the derivatives of its numbers, by Taylor steps.

use super::state::{Layout, Moving, Phase};
use super::varied::{Varied, difference};
use crate::drive::Clock;
use crate::dual::Dual;
use crate::flow::taylor::tangent::{Given, Tangent, stiffening};
use crate::flow::taylor::{Frame, Held, Motion, Rub};
use crate::law::Law;
use crate::series::{Series, ZERO, at, derivative, slope_at};
use crate::system::System;

/// An arc of more steps has run away from the motion it was taken from, to where its law grows without bound.
const MOST_STEPS: u32 = 10_000;

/// A system ready to be expanded, and those beside it.
pub(super) struct Course<'a> {
    pub(super) varied: &'a Varied,
    pub(super) frame: Frame,
    pub(super) laws: Vec<&'a Law>,
    pub(super) layout: Layout,
    beside: Vec<(Frame, Vec<&'a Law>)>,
}

/// A Taylor expansion with its derivatives, and the time into it. The last lane is the time along the arc.
pub(super) struct Place {
    motion: Motion,
    tangents: Vec<(usize, Tangent)>,
    lanes: usize,
    /// When the expansion begins, from the start of the arc.
    pub(super) begin: f64,
    pub(super) h: f64,
    /// How far it is good.
    pub(super) reach: f64,
}

fn laws(system: &System) -> Vec<&Law> {
    system.contacts.iter().map(|contact| &contact.law).collect()
}

/// What the flow needs to know of every contact.
pub(super) fn rubs(phases: &[Phase], line: impl Fn(usize) -> [f64; 2]) -> Vec<Rub> {
    let rub = |(c, phase): (usize, &Phase)| match *phase {
        Phase::Stick => Rub {
            direction: 0.0,
            offset: 0.0,
            slope: 0.0,
        },
        Phase::Hold(direction) => Rub {
            direction,
            offset: 0.0,
            slope: f64::INFINITY,
        },
        Phase::Slip(direction) => {
            let [offset, slope] = line(c);
            Rub {
                direction,
                offset,
                slope,
            }
        }
    };
    phases.iter().enumerate().map(rub).collect()
}

impl<'a> Course<'a> {
    pub(super) fn new(varied: &'a Varied) -> Self {
        let base = &varied.base;
        let beside = varied.around.iter().flat_map(|(systems, _)| systems);
        Self {
            varied,
            frame: Frame::of(base),
            laws: laws(base),
            layout: Layout {
                masses: base.masses(),
                contacts: base.contacts.len(),
            },
            beside: beside.map(|system| (Frame::of(system), laws(system))).collect(),
        }
    }

    /// Lanes of a state that carries all derivatives: its numbers, the parameter, the time along the arc.
    pub(super) fn all_lanes(&self) -> usize {
        self.layout.lanes() + 1
    }

    /// The lane of the parameter among `lanes`; none where only time counts.
    pub(super) fn parameter(&self, lanes: usize) -> Option<usize> {
        (lanes > 1).then(|| self.layout.width())
    }

    pub(super) fn held(&self, rubs: &[Rub]) -> Held {
        self.frame
            .held((0..rubs.len()).filter(|&c| rubs[c].holds()).collect())
    }

    /// The motion `tau` from the start of an arc.
    pub(super) fn go(&self, start: &Moving, phases: &[Phase], tau: f64) -> Place {
        self.walk(start, phases, tau, &mut |_| {})
    }

    /// The same; `pass` sees every expansion on the way but the last.
    pub(super) fn walk(
        &self,
        start: &Moving,
        phases: &[Phase],
        tau: f64,
        pass: &mut dyn FnMut(Place),
    ) -> Place {
        let mut here = start.clone();
        let mut gone = 0.0;
        let mut clock = Clock {
            high: start.numbers[0].value,
            low: 0.0,
        };
        self.stop(&mut here, phases);
        for step in 0.. {
            let mut place = self.expand(&here, phases, clock);
            place.begin = gone;
            if tau - gone <= place.reach {
                place.h = tau - gone;
                return place;
            }
            if step == MOST_STEPS || place.reach.is_nan() || place.reach <= 0.0 {
                place.h = f64::NAN;
                return place;
            }
            place.h = place.reach;
            let moment = self.moment(&place, &here);
            gone += place.reach;
            clock = clock.after(place.reach);
            for i in 0..self.layout.masses {
                here.numbers[self.layout.x(i)] = moment.x[i].clone();
                here.numbers[self.layout.v(i)] = moment.v[i].clone();
            }
            // Time along the arc is counted from where it ends.
            for number in &mut here.numbers {
                if let Some(rate) = number.rates.last_mut() {
                    *rate = 0.0;
                }
            }
            pass(place);
        }
        unreachable!("the steps of an arc are counted");
    }

    /// Stuck contacts leave no choice of their slip velocity.
    pub(super) fn stop(&self, state: &mut Moving, phases: &[Phase]) {
        let stuck: Vec<usize> = (0..phases.len()).filter(|&c| phases[c] == Phase::Stick).collect();
        if stuck.is_empty() {
            return;
        }
        let held = self.frame.held(stuck);
        let clock = Clock {
            high: state.numbers[0].value,
            low: 0.0,
        };
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
        for lane in 0..=slip[0].rates.len() {
            let of = |number: &Dual| number.rates.get(lane).copied().unwrap_or(number.value);
            let pulls = held.forces(|row| of(&slip[row]));
            for i in 0..self.layout.masses {
                let change: f64 = held
                    .contacts
                    .iter()
                    .zip(&pulls)
                    .map(|(&c, pull)| self.frame.response(c, i) * pull)
                    .sum();
                let number = &mut state.numbers[self.layout.v(i)];
                match number.rates.get_mut(lane) {
                    Some(rate) => *rate += change,
                    None => number.value += change,
                }
            }
        }
        for &c in &held.contacts {
            if contacts[c].other.is_none() {
                // To the last digit.
                state.numbers[self.layout.v(contacts[c].mass)] = drives[c].clone();
            }
        }
    }

    /// The drive velocities at a time.
    pub(super) fn drives(&self, clock: Clock, t: &Dual) -> Vec<Dual> {
        let lanes = t.rates.len();
        let mut series = ZERO;
        (0..self.layout.contacts)
            .map(|c| {
                self.frame.drives[c].expand(clock, &mut series);
                let mut drive = Dual::fixed(series[0], lanes).shifted(series[1], t);
                if let (Some(lane), Some((_, step))) = (self.parameter(lanes), &self.varied.around) {
                    let around = std::array::from_fn(|i| {
                        self.beside[i].0.drives[c].expand(clock, &mut series);
                        series[0]
                    });
                    drive.rates[lane] += difference(around, *step);
                }
                drive
            })
            .collect()
    }

    /// The expansion from a state, with a tangent for every lane along which it moves.
    pub(super) fn expand(&self, state: &Moving, phases: &[Phase], clock: Clock) -> Place {
        let layout = self.layout;
        let number = |lane: usize| &state.numbers[lane];
        let lanes = number(0).rates.len();
        let smooth = |c: usize| self.frame.is_smooth(c);
        let rubs = rubs(phases, |c| {
            let at = layout.contact(c);
            [number(at).value, number(at + 1).value]
        });
        let held = self.held(&rubs);
        let x: Vec<f64> = (0..layout.masses).map(|i| number(layout.x(i)).value).collect();
        let v: Vec<f64> = (0..layout.masses).map(|i| number(layout.v(i)).value).collect();
        let mut motion = Motion::of(&self.frame);
        motion.aim(&self.frame, clock);
        motion.expand(&self.frame, &self.laws, &rubs, &held, &x, &v);
        let rate = self.frame.rate;
        let sizes = x.iter().map(|x| rate * x.abs()).chain(v.iter().map(|v| v.abs()));
        let scale = sizes
            .fold(self.frame.push, f64::max)
            .max(motion.size(rate, 1) / rate)
            .max(f64::MIN_POSITIVE);
        let step = motion.reach(&self.frame, &rubs, scale);
        // The series of a motion that stands still never ends; those of its tangents do.
        let step = if step.is_finite() { step } else { 1.0 / rate };
        let reach = motion.agreed(&self.frame, &self.laws, &rubs, scale, step);
        let slopes: Vec<Series> = rubs
            .iter()
            .enumerate()
            .map(|(c, rub)| {
                if lanes == 1 || rub.holds() || !smooth(c) {
                    ZERO
                } else {
                    stiffening(self.laws[c], &motion.u[c])
                }
            })
            .collect();
        let given = (lanes > 1 && !self.beside.is_empty()).then(|| self.given(&motion, &rubs, &held, clock));
        let mut tangents = Vec::new();
        // Without other lanes time needs no tangent: it is the slope of the series.
        for lane in (0..lanes).filter(|_| lanes > 1) {
            let mut tangent = Tangent::new(&self.frame);
            tangent.clock = number(0).rates[lane];
            tangent.parameter = given.is_some() && self.parameter(lanes) == Some(lane);
            for i in 0..layout.masses {
                tangent.x[i][0] = number(layout.x(i)).rates[lane];
                tangent.v[i][0] = number(layout.v(i)).rates[lane];
            }
            for (c, line) in tangent.line.iter_mut().enumerate() {
                if matches!(phases[c], Phase::Slip(_)) && !smooth(c) {
                    let at = layout.contact(c);
                    *line = [number(at).rates[lane], number(at + 1).rates[lane]];
                }
            }
            if tangent.moves() {
                tangent.expand(&self.frame, &motion, &rubs, &held, &slopes, given.as_ref());
                tangents.push((lane, tangent));
            }
        }
        Place {
            motion,
            tangents,
            lanes,
            begin: 0.0,
            h: 0.0,
            reach,
        }
    }

    /// What the parameter changes while the motion is held.
    fn given(&self, motion: &Motion, rubs: &[Rub], held: &Held, clock: Clock) -> Given {
        let beside: Vec<Given> = self
            .beside
            .iter()
            .map(|(frame, laws)| {
                let mut other = Motion::of(frame);
                other.aim(frame, clock);
                let held = frame.held(held.contacts.clone());
                other.given(frame, laws, rubs, &held, (&motion.x, &motion.v))
            })
            .collect();
        let step = self.varied.around.as_ref().map_or(1.0, |(_, step)| *step);
        let differences = |of: fn(&Given) -> &Vec<Series>| {
            (0..of(&beside[0]).len())
                .map(|row| {
                    std::array::from_fn(|k| difference(std::array::from_fn(|i| of(&beside[i])[row][k]), step))
                })
                .collect()
        };
        Given {
            acceleration: differences(|given| &given.acceleration),
            force: differences(|given| &given.force),
            drive: differences(|given| &given.drive),
        }
    }

    /// Everything an event may depend on, at a place.
    pub(super) fn moment(&self, place: &Place, start: &Moving) -> Moment {
        let each = |count: usize, of: &dyn Fn(usize) -> Dual| (0..count).map(of).collect::<Vec<_>>();
        let (n, c) = (self.layout.masses, self.layout.contacts);
        let mut t = start.numbers[0].clone();
        if let Some(rate) = t.rates.last_mut() {
            *rate = 1.0;
        }
        Moment {
            x: each(n, &|i| {
                place.number(|motion| &motion.x[i], |tangent| &tangent.x[i])
            }),
            v: each(n, &|i| {
                place.number(|motion| &motion.v[i], |tangent| &tangent.v[i])
            }),
            u: each(c, &|c| {
                place.number(|motion| &motion.u[c], |tangent| &tangent.u[c])
            }),
            turn: each(c, &|c| place.rate(|motion| &motion.u[c], |tangent| &tangent.u[c])),
            force: each(c, &|c| {
                place.number(|motion| &motion.force[c], |tangent| &tangent.force[c])
            }),
            force_rate: each(c, &|c| {
                place.rate(|motion| &motion.force[c], |tangent| &tangent.force[c])
            }),
            t,
        }
    }
}

impl Place {
    /// The derivative of a coefficient at the start of the expansion.
    pub(super) fn coefficient(
        &self,
        k: usize,
        of: impl Fn(&Motion) -> &Series,
        along: impl Fn(&Tangent) -> &Series,
    ) -> Dual {
        let mut number = Dual::fixed(of(&self.motion)[k], self.lanes);
        for (lane, tangent) in &self.tangents {
            number.rates[*lane] = along(tangent)[k];
        }
        number
    }

    /// The slip acceleration of a contact along its direction.
    pub(super) fn turn(&self, c: usize) -> f64 {
        slope_at(&self.motion.u[c], self.h).1
    }

    /// The friction force of a contact and its rate.
    pub(super) fn force(&self, c: usize) -> [Dual; 2] {
        [
            self.number(|motion| &motion.force[c], |tangent| &tangent.force[c]),
            self.rate(|motion| &motion.force[c], |tangent| &tangent.force[c]),
        ]
    }

    fn number(&self, of: impl Fn(&Motion) -> &Series, along: impl Fn(&Tangent) -> &Series) -> Dual {
        let (value, slope) = slope_at(of(&self.motion), self.h);
        let mut number = Dual::fixed(value, self.lanes);
        for (lane, tangent) in &self.tangents {
            number.rates[*lane] = at(along(tangent), self.h);
        }
        number.rates[self.lanes - 1] += slope;
        number
    }

    fn rate(&self, of: impl Fn(&Motion) -> &Series, along: impl Fn(&Tangent) -> &Series) -> Dual {
        let (value, slope) = slope_at(&derivative(of(&self.motion)), self.h);
        let mut number = Dual::fixed(value, self.lanes);
        for (lane, tangent) in &self.tangents {
            number.rates[*lane] = slope_at(along(tangent), self.h).1;
        }
        number.rates[self.lanes - 1] += slope;
        number
    }
}

/// Everything an event may depend on. The last lane is the time along the arc.
pub(super) struct Moment {
    /// The clock; its value is that of the start of the arc.
    pub(super) t: Dual,
    pub(super) x: Vec<Dual>,
    pub(super) v: Vec<Dual>,
    /// Slip speeds and their rates.
    pub(super) u: Vec<Dual>,
    pub(super) turn: Vec<Dual>,
    /// Friction forces and their rates.
    pub(super) force: Vec<Dual>,
    pub(super) force_rate: Vec<Dual>,
}
