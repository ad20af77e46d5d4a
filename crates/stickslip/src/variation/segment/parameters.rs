//! What parameters change along a phase while the motion is held: differences of what the systems beside it would give.

use super::{Expansion, Mode, VariedMotion, laws};
use crate::clock::Clock;
use crate::flow::taylor::tangent::Given;
use crate::flow::taylor::{Frame, Motion};
use crate::law::Law;
use crate::series::{Series, ZERO};
use crate::variation::varied::{Parameter, difference};

/// The systems around one parameter.
pub(super) type Around<'a> = [(Frame, Vec<&'a Law>); 4];

/// What a system beside would give to the motion.
#[derive(Clone)]
pub(super) struct Beside {
    motion: Motion,
    acceleration: Vec<Series>,
}

impl<'a> VariedMotion<'a> {
    /// The parameters that change the motion within a phase.
    pub(super) fn acting(&self) -> &[(usize, Around<'a>)] {
        self.acting.get_or_init(|| {
            // Within a phase the force of a law of linear pieces is that of its line, which is part of the state.
            let smooth = (0..self.layout.contacts)
                .any(|c| self.frame.is_smooth(c, 1.0) || self.frame.is_smooth(c, -1.0));
            (self.varied.parameters.iter().enumerate())
                .filter(|(_, parameter)| smooth || !parameter.of_law)
                .map(|(which, parameter)| {
                    let beside = parameter.around.each_ref();
                    (which, beside.map(|system| (Frame::of(system), laws(system))))
                })
                .collect()
        })
    }

    /// The parameters that change the motion within a phase, the systems around each, and their directions among `directions`.
    pub(super) fn acting_on(
        &self,
        directions: usize,
    ) -> impl Iterator<Item = (&Parameter, &Around<'a>, usize)> {
        let first = self.parameters(directions);
        let acting = first.map_or(&[][..], |_| self.acting());
        (acting.iter()).filter_map(move |(which, beside)| {
            Some((&self.varied.parameters[*which], beside, first? + which))
        })
    }

    /// What the parameters change while the motion is held.
    pub(super) fn give(&self, order: usize, mode: &Mode, clock: Clock, expansion: &mut Expansion) {
        let own = &expansion.motion;
        expansion
            .acting
            .resize_with(self.acting().len(), || changes(&self.frame));
        for (((which, systems), helds), (beside, given)) in
            self.acting().iter().zip(&mode.beside).zip(&mut expansion.acting)
        {
            for (((frame, laws), held), Beside { motion, acceleration }) in
                systems.iter().zip(helds).zip(beside.iter_mut())
            {
                motion.aim(frame, clock);
                motion.give(order, frame, laws, &mode.force_lines, held, own, acceleration);
            }
            let step = self.varied.parameters[*which].step;
            let differ = |rows: &mut [Series], of: fn(&Beside) -> &[Series]| {
                for (row, series) in rows.iter_mut().enumerate() {
                    for (k, term) in series[..=order].iter_mut().enumerate() {
                        *term = difference(beside.each_ref().map(|beside| of(beside)[row][k]), step);
                    }
                }
            };
            differ(&mut given.acceleration, |beside| &beside.acceleration);
            differ(&mut given.force, |beside| &beside.motion.given);
            differ(&mut given.drive, |beside| beside.motion.drives());
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
