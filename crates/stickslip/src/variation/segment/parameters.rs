//! What parameters change along a phase while the motion is held: numbers of a smooth law by the law itself, others by differences
//! of what the systems beside this one would give.

use super::{Expansion, Mode, VariedMotion, laws};
use crate::clock::Clock;
use crate::flow::taylor::tangent::Given;
use crate::flow::taylor::{Frame, Motion};
use crate::jet::Jet;
use crate::law::{Friction, Law};
use crate::series::{Grown, Series, ZERO, nothing, product};
use crate::variation::varied::{Parameter, difference};

/// The systems around one parameter, and the size of a step.
pub(super) type Around<'a> = ([(Frame, Vec<&'a Law>); 4], f64);

/// What a system beside would give to the motion.
#[derive(Clone)]
pub(super) struct Beside {
    motion: Motion,
    acceleration: Vec<Series>,
}

impl<'a> VariedMotion<'a> {
    /// The parameters that change the motion within a phase, and the systems around each that is no number of a law.
    pub(super) fn acting(&self) -> &[(usize, Option<Around<'a>>)] {
        self.acting.get_or_init(|| {
            // Within a phase the force of a law of linear pieces is that of its line, which is part of the state.
            let smooth = (0..self.layout.contacts)
                .any(|c| self.frame.is_smooth(c, 1.0) || self.frame.is_smooth(c, -1.0));
            (self.varied.parameters.iter().enumerate())
                .filter_map(|(which, parameter)| match parameter {
                    Parameter::Law => smooth.then_some((which, None)),
                    Parameter::System(around, step) => {
                        let around = around.each_ref();
                        let beside = around.map(|system| (Frame::of(system), laws(system)));
                        Some((which, Some((beside, *step))))
                    }
                })
                .collect()
        })
    }

    /// The parameters that change the motion within a phase, the systems around each, and their directions among `directions`.
    pub(super) fn acting_on(&self, directions: usize) -> impl Iterator<Item = (Option<&Around<'a>>, usize)> {
        let first = self.parameters(directions);
        let acting = first.map_or(&[][..], |_| self.acting());
        (acting.iter()).filter_map(move |(which, beside)| Some((beside.as_ref(), first? + which)))
    }

    /// What the parameters change while the motion is held.
    pub(super) fn give(&self, order: usize, mode: &Mode, clock: Clock, expansion: &mut Expansion) {
        expansion
            .acting
            .resize_with(self.acting().len(), || changes(&self.frame));
        let own = &expansion.motion;
        let changes = self.acting().iter().zip(&mode.beside).zip(&mut expansion.acting);
        for (((_, around), helds), (beside, given)) in changes {
            let (Some((systems, step)), Some(helds)) = (around, helds) else {
                given.clear();
                continue;
            };
            for (((frame, laws), held), Beside { motion, acceleration }) in
                systems.iter().zip(helds).zip(beside.iter_mut())
            {
                motion.aim(frame, clock);
                motion.give(order, frame, laws, &mode.force_lines, held, own, acceleration);
            }
            let differ = |rows: &mut [Series], of: fn(&Beside) -> &[Series]| {
                for (row, series) in rows.iter_mut().enumerate() {
                    for (k, term) in series[..=order].iter_mut().enumerate() {
                        *term = difference(beside.each_ref().map(|beside| of(beside)[row][k]), *step);
                    }
                }
            };
            differ(&mut given.acceleration, |beside| &beside.acceleration);
            differ(&mut given.force, |beside| &beside.motion.given);
            differ(&mut given.drive, |beside| beside.motion.drives());
        }
        for c in 0..self.layout.contacts {
            self.give_friction(c, order, mode, expansion);
        }
        for ((_, around), (_, given)) in self.acting().iter().zip(&mut expansion.acting) {
            if around.is_none() {
                given.accelerate(order, &self.frame, &mode.held);
            }
        }
    }

    /// What the numbers of its law change of the friction of a contact that slips at the speeds of the motion.
    fn give_friction(&self, c: usize, order: usize, mode: &Mode, expansion: &mut Expansion) {
        let line = &mode.force_lines[c];
        if !line.slips() || !self.frame.is_smooth(c, line.direction) {
            return;
        }
        let speed = expansion.motion.u.series(c);
        for (law, axes) in self.varied.laws_along(c) {
            let (law, u) = (law.toward(line.direction), speed.map(Jet::from));
            let mut grown = Grown::default();
            let mut friction = nothing::<Jet>();
            for (k, term) in friction.iter_mut().enumerate().take(order) {
                *term = law.extend(&u, k, &mut grown);
            }
            for (axis, which) in axes.iter().enumerate() {
                let mut force = friction.map(|term| line.direction * term.slopes[axis]);
                if self.frame.normals[c].is_some() {
                    let normal = &expansion.motion.normal[c];
                    force = std::array::from_fn(|k| product(normal, &force, k));
                }
                if let Some(at) = self.acting().iter().position(|(acting, _)| acting == which) {
                    expansion.acting[at].1.force[c] = force;
                }
            }
        }
    }
}

/// Room for what a parameter changes.
fn changes(frame: &Frame) -> ([Beside; 4], Given) {
    let motion = Motion::of(frame);
    let (x, u) = (vec![ZERO; frame.masses], vec![ZERO; motion.u.count()]);
    let beside = std::array::from_fn(|_| Beside {
        motion: motion.clone(),
        acceleration: x.clone(),
    });
    let given = Given {
        acceleration: x,
        force: u.clone(),
        drive: u,
    };
    (beside, given)
}
