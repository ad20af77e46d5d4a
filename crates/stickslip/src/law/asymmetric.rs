//! Friction that differs between the two directions of slip: a law for each.

use super::{Friction, Law, Memory, Piece, Rest, StaticKinetic};
use crate::error::{Error, wrong};
use crate::law::declaration::{Limited, parameters};
use crate::scalar::Scalar;

parameters! {
    /// One law where the friction on the mass is positive (w > 0), another where it is negative, at rest and in slip.
    pub struct Asymmetric<N> {
        /// The law for w > 0, and for adhesion that pulls that way.
        pub forward: Box<Law<N>> = Box::new(StaticKinetic::new(1.2, 0.7).into()) => [],
        /// The law for w < 0.
        pub backward: Box<Law<N>> = Box::new(StaticKinetic::new(0.8, 0.5).into()) => [],
    }
}

impl<N: Scalar> Asymmetric<N> {
    /// The law of one direction.
    pub(super) fn toward(&self, direction: f64) -> &Law<N> {
        if direction < 0.0 {
            &self.backward
        } else {
            &self.forward
        }
    }

    fn sides(&self) -> [&Law<N>; 2] {
        [&self.forward, &self.backward]
    }
}

/// What is asked here holds whatever the direction; all else is asked of [`Law::toward`] one.
impl<N: Scalar> Friction<N> for Asymmetric<N> {
    fn validate(&self) -> Result<(), Error> {
        self.within_limits()?;
        if self.sides().iter().any(|law| matches!(law, Law::Asymmetric(_))) {
            return wrong("forward and backward must each be the law of one direction, got one that is asymmetric itself: give \
                         the law it has there"
                    .into());
        }
        Ok(())
    }

    fn static_limit(&self, rest: Rest<N>) -> N {
        self.forward
            .static_limit(rest)
            .min(self.backward.static_limit(rest))
    }

    fn growth_bound(&self, stick_time: N) -> N {
        self.forward
            .growth_bound(stick_time)
            .max(self.backward.growth_bound(stick_time))
    }

    fn feels_force_rate(&self) -> bool {
        self.sides().iter().any(|law| law.feels_force_rate())
    }

    fn resolution(&self, u: N) -> Option<N> {
        self.sides()
            .iter()
            .filter_map(|law| law.resolution(u))
            .reduce(N::min)
    }

    fn begin(&self, u: N, balance: N, memory: &mut Memory<N>) -> Piece<N> {
        self.forward.begin(u, balance, memory)
    }
}
