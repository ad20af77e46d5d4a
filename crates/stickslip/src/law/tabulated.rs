//! Friction as it was measured: a table over slip speed, a table over stick time, or both.

use super::constant_or_nodes::ConstantOrNodes;
use super::piecewise_linear::from_zero;
use super::static_kinetic::at_least_kinetic;
use super::{Adhesion, End, Friction, Memory, Piece, Rest};
use crate::error::Error;
use crate::law::declaration::{Limited, parameters};
use crate::scalar::Scalar;

parameters! {
    /// F(w) linear between nodes (w_i, f_i), f_s(t_s) linear between nodes (t_i, f_i), both constant beyond the last.
    pub struct Tabulated<N> {
        /// Kinetic force, a number or nodes (slip speed, force), the first at slip speed 0.
        pub kinetic: ConstantOrNodes<N> = ConstantOrNodes::Nodes(vec![[0.0, 0.9], [0.1, 0.7], [0.3, 0.6], [0.6, 0.65]]) => [SLIP_VELOCITY, NODE_FORCE.not_negative()],
        /// Break-away force, a number or nodes (stick time, force), the first at stick time 0; it must not fall.
        pub break_away: ConstantOrNodes<N> = ConstantOrNodes::Nodes(vec![[0.0, 0.9], [0.5, 1.0], [2.0, 1.1], [6.0, 1.15]]) => [STICK_TIME, NODE_FORCE.not_negative()],
    }
}

impl<N: Scalar> Friction<N> for Tabulated<N> {
    fn validate(&self) -> Result<(), Error> {
        self.within_limits()?;
        from_zero(self.kinetic.nodes())?;
        from_zero(self.break_away.nodes())?;
        let nodes = self.break_away.nodes();
        for (index, pair) in nodes.windows(2).enumerate() {
            if pair[1][1] < pair[0][1] {
                return Err(Error::TableFalls {
                    name: "break_away",
                    index: index + 1,
                    before: pair[0][1].value(),
                    after: pair[1][1].value(),
                });
            }
        }
        let zero = N::default();
        at_least_kinetic(self.break_away.at(zero), self.kinetic.at(zero))
    }

    fn static_limit(&self, rest: Rest<N>) -> N {
        self.break_away.at(rest.stick_time)
    }

    fn adhesion(&self, rest: Rest<N>) -> Adhesion<N> {
        let [force, growth] = self.break_away.line(rest.stick_time);
        Adhesion {
            force,
            growth,
            curvature: N::default(),
            softening: N::default(),
        }
    }

    fn growth_bound(&self, stick_time: N) -> N {
        let steps = self.break_away.nodes().windows(2);
        steps
            .filter(|step| step[1][0] > stick_time)
            .map(|step| (step[1][1] - step[0][1]) / (step[1][0] - step[0][0]))
            .fold(N::default(), N::max)
    }

    fn leave(&self, _force: N, _memory: &mut Memory<N>) -> Piece<N> {
        self.kinetic.piece(0)
    }

    fn begin(&self, u: N, _balance: N, _memory: &mut Memory<N>) -> Piece<N> {
        let above = self.kinetic.nodes().partition_point(|node| node[0] <= u);
        self.kinetic.piece(above.saturating_sub(1))
    }

    fn next(&self, piece: &Piece<N>, end: End, _u: N, _memory: &mut Memory<N>) -> Piece<N> {
        let index = piece.branch as usize;
        match end {
            End::High => self.kinetic.piece(index + 1),
            End::Low => self.kinetic.piece(index - 1),
            End::Reversal { .. } => *piece,
        }
    }
}
