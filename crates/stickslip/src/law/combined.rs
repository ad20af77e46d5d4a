//! Static friction of one law with the kinetic friction of another: how a curve is given a memory.

use super::static_kinetic::at_least_kinetic;
use super::{Adhesion, Curve, DwellTime, End, ExponentialStribeck, Friction, Law, Memory, Piece, Rest};
use crate::error::{Error, wrong};
use crate::law::declaration::{Limited, parameters};
use crate::scalar::Scalar;
use crate::series::{Grown, Series};

parameters! {
    /// |F| ≤ f_s(t_s, δ) of the one law at rest, F of the other in motion.
    pub struct Combined<N> {
        /// The law that says the static limit.
        pub at_rest: Box<Law<N>> as "static" = Box::new(DwellTime { kinetic: 1.0, ..DwellTime::example() }.into()) => [],
        /// The law that says what slip produces.
        pub kinetic: Box<Law<N>> = Box::new(ExponentialStribeck::example().into()) => [],
    }
}

impl<N: Scalar> Friction<N> for Combined<N> {
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
        let kinetic = self.force(&first, N::default());
        // A curve that is a sum begins within rounding of its own break-away force.
        if static_limit >= kinetic - kinetic * (4.0 * f64::EPSILON) {
            return Ok(());
        }
        at_least_kinetic(static_limit, kinetic)
    }

    fn static_limit(&self, rest: Rest<N>) -> N {
        self.at_rest.static_limit(rest)
    }

    fn growth_bound(&self, stick_time: N) -> N {
        self.at_rest.growth_bound(stick_time)
    }

    fn exponential_growth(&self, force_rate: Option<N>) -> Option<[N; 2]> {
        self.at_rest.exponential_growth(force_rate)
    }

    fn adhesion(&self, rest: Rest<N>) -> Adhesion<N> {
        self.at_rest.adhesion(rest)
    }

    fn softening_bound(&self, rates: [N; 2]) -> N {
        self.at_rest.softening_bound(rates)
    }

    fn feels_force_rate(&self) -> bool {
        self.at_rest.feels_force_rate() || self.kinetic.feels_force_rate()
    }

    fn resolution(&self, u: N) -> Option<N> {
        self.kinetic.resolution(u)
    }

    fn curve(&self) -> Option<Curve<N>> {
        self.kinetic.curve()
    }

    fn force(&self, piece: &Piece<N>, u: N) -> N {
        self.kinetic.force(piece, u)
    }

    fn extend(&self, u: &Series<N>, k: usize, grown: &mut Grown<N>) -> N {
        self.kinetic.extend(u, k, grown)
    }

    fn branches(&self, u: N) -> Option<[N; 2]> {
        self.kinetic.branches(u)
    }

    fn leave(&self, force: N, memory: &mut Memory<N>) -> Piece<N> {
        self.kinetic.leave(force, memory)
    }

    fn begin(&self, u: N, balance: N, memory: &mut Memory<N>) -> Piece<N> {
        self.kinetic.begin(u, balance, memory)
    }

    fn next(&self, piece: &Piece<N>, end: End, u: N, memory: &mut Memory<N>) -> Piece<N> {
        self.kinetic.next(piece, end, u, memory)
    }
}
