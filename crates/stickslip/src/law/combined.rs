//! Static friction of one law with the kinetic friction of another: how a curve is given a memory.

use super::static_kinetic::at_least_kinetic;
use super::{Adhesion, DwellTime, End, ExponentialStribeck, Friction, Law, Memory, Piece, Rest};
use crate::error::{Error, wrong};
use crate::law::declaration::{Limited, parameters};
use crate::series::{Grown, Series};

parameters! {
    /// |F| ≤ f_s(t_s, δ) of the one law at rest, F of the other in motion.
    pub struct Combined {
        /// The law that says the static limit.
        pub at_rest: Box<Law> as "static" = Box::new(DwellTime { kinetic: 1.0, ..DwellTime::example() }.into()) => [],
        /// The law that says what slip produces.
        pub kinetic: Box<Law> = Box::new(ExponentialStribeck::example().into()) => [],
    }
}

impl Friction for Combined {
    fn validate(&self) -> Result<(), Error> {
        self.within_limits()?;
        if [&self.at_rest, &self.kinetic]
            .iter()
            .any(|law| matches!(***law, Law::Asymmetric(_)))
        {
            return wrong("static and kinetic must be laws that are alike in both directions: combine the laws of each direction, and \
                         make the law asymmetric of those"
                    .into());
        }
        if matches!(*self.kinetic, Law::BogaczRyczek(_)) {
            return wrong("kinetic must be a law whose slip does not follow from its own break-away force, got BogaczRyczek: change \
                         its static_friction instead"
                    .into());
        }
        let static_limit = self.static_limit(Rest::default());
        let first = self.leave(static_limit, &mut Memory::default());
        let kinetic = self.force(&first, 0.0);
        // A curve that is a sum begins within rounding of its own break-away force.
        if static_limit >= kinetic - 4.0 * f64::EPSILON * kinetic {
            return Ok(());
        }
        at_least_kinetic(static_limit, kinetic)
    }

    fn static_limit(&self, rest: Rest) -> f64 {
        self.at_rest.static_limit(rest)
    }

    fn growth_bound(&self, stick_time: f64) -> f64 {
        self.at_rest.growth_bound(stick_time)
    }

    fn exponential_growth(&self) -> Option<[f64; 2]> {
        self.at_rest.exponential_growth()
    }

    fn adhesion(&self, rest: Rest) -> Adhesion {
        self.at_rest.adhesion(rest)
    }

    fn softening_bound(&self, rates: [f64; 2]) -> f64 {
        self.at_rest.softening_bound(rates)
    }

    fn feels_force_rate(&self) -> bool {
        self.at_rest.feels_force_rate() || self.kinetic.feels_force_rate()
    }

    fn resolution(&self, u: f64) -> Option<f64> {
        self.kinetic.resolution(u)
    }

    fn force(&self, piece: &Piece, u: f64) -> f64 {
        self.kinetic.force(piece, u)
    }

    fn extend(&self, u: &Series, k: usize, grown: &mut Grown) -> f64 {
        self.kinetic.extend(u, k, grown)
    }

    fn branches(&self, u: f64) -> Option<[f64; 2]> {
        self.kinetic.branches(u)
    }

    fn leave(&self, force: f64, memory: &mut Memory) -> Piece {
        self.kinetic.leave(force, memory)
    }

    fn begin(&self, u: f64, balance: f64, memory: &mut Memory) -> Piece {
        self.kinetic.begin(u, balance, memory)
    }

    fn next(&self, piece: &Piece, end: End, u: f64, memory: &mut Memory) -> Piece {
        self.kinetic.next(piece, end, u, memory)
    }
}
