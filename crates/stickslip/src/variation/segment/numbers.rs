//! What an expansion says of the motion: numbers with their derivatives along the directions that move.

use super::Expansion;
use crate::dual::Dual;
use crate::flow::taylor::tangent::{BLOCK, Block, Tangent, Wide, wide_at};
use crate::flow::taylor::{Coefficients, Frame, Motion};
use crate::series::{Series, derivative, slope_at};

impl Expansion {
    /// How fast the motion is: under heavy damping as slow as what that leaves.
    pub(in crate::variation) fn pace(&self, frame: &Frame) -> f64 {
        if self.leapt.is_some() {
            frame.rate
        } else {
            self.motion.rate(frame)
        }
    }

    /// The derivative of a coefficient at the start of the expansion.
    pub(super) fn coefficient(
        &self,
        k: usize,
        c: usize,
        of: impl Fn(&Motion) -> &Coefficients,
        along: impl Fn(&Tangent) -> &Wide,
    ) -> Dual {
        self.gather(of(&self.motion).of(k)[c], |tangent| along(tangent)[k])
    }

    /// A number and its rates along the directions that move.
    fn gather(&self, value: f64, along: impl Fn(&Tangent) -> Block) -> Dual {
        let mut number = Dual::fixed(value, self.directions);
        for (tangent, moving) in self.tangents.iter().zip(self.moving.chunks(BLOCK)) {
            for (&axis, rate) in moving.iter().zip(along(tangent)) {
                number.rates[axis] = rate;
            }
        }
        number
    }

    fn number(&self, of: &Series, along: impl Fn(&Tangent) -> &Wide) -> Dual {
        let (value, slope) = if self.h == 0.0 {
            (of[0], of[1])
        } else {
            slope_at(of, self.h)
        };
        let mut number = self.gather(value, |tangent| wide_at(along(tangent), self.h)[0]);
        number.rates[self.directions - 1] += slope;
        number
    }

    fn rate(&self, of: &Series, along: impl Fn(&Tangent) -> &Wide) -> Dual {
        let (value, slope) = if self.h == 0.0 {
            (of[1], 2.0 * of[2])
        } else {
            slope_at(&derivative(of), self.h)
        };
        let mut number = self.gather(value, |tangent| wide_at(along(tangent), self.h)[1]);
        number.rates[self.directions - 1] += slope;
        number
    }

    /// Position of a mass.
    pub(in crate::variation) fn x(&self, mass: usize) -> Dual {
        match &self.leapt {
            Some(moved) => moved.x.clone(),
            None => self.number(&self.motion.x.series(mass), |tangent| &tangent.x[mass]),
        }
    }

    /// Velocity of a mass.
    pub(in crate::variation) fn v(&self, mass: usize) -> Dual {
        match &self.leapt {
            Some(moved) => moved.v.clone(),
            None => self.number(&self.motion.v.series(mass), |tangent| &tangent.v[mass]),
        }
    }

    /// Slip speed of a contact.
    pub(in crate::variation) fn u(&self, contact: usize) -> Dual {
        match &self.leapt {
            Some(moved) => moved.u(),
            None => self.number(&self.motion.u.series(contact), |tangent| &tangent.u[contact]),
        }
    }

    /// Its rate.
    pub(in crate::variation) fn slip_acceleration(&self, contact: usize) -> Dual {
        match &self.leapt {
            Some(moved) => moved.slip_acceleration(),
            None => self.rate(&self.motion.u.series(contact), |tangent| &tangent.u[contact]),
        }
    }

    /// Friction force of a contact.
    pub(in crate::variation) fn force(&self, contact: usize) -> Dual {
        match &self.leapt {
            Some(moved) => moved.force(),
            None => self.number(&self.motion.force.series(contact), |tangent| {
                &tangent.force[contact]
            }),
        }
    }

    /// Its rate.
    pub(in crate::variation) fn force_rate(&self, contact: usize) -> Dual {
        match &self.leapt {
            Some(moved) => moved.force_rate(),
            None => self.rate(&self.motion.force.series(contact), |tangent| {
                &tangent.force[contact]
            }),
        }
    }
}
