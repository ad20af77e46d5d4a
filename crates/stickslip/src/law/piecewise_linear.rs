//! Kinetic friction by a table of nodes, linear between them.

use super::static_kinetic::at_least_kinetic;
use super::{End, Friction, Memory, Piece, Point, Rest};
use crate::error::{Error, increasing};
use crate::law::declaration::{Kind, Limited, Limits, Value, parameters};
use crate::scalar::Scalar;

parameters! {
    /// F(w) linear between nodes (w_i, f_i), w_0 = 0; the last slope goes on beyond the last node. |F| ≤ f_s at rest.
    pub struct PiecewiseLinear<N> {
        /// Nodes (slip speed, kinetic force), the first at slip speed 0.
        pub nodes: Vec<Point<N>> = vec![[0.0, 0.9], [0.2, 0.6], [0.6, 0.7]] => [SLIP_VELOCITY, NODE_FORCE],
        /// Break-away force f_s.
        pub break_away: N = 1.0 => [FORCE],
    }
}

impl<N: Scalar> PiecewiseLinear<N> {
    /// The piece between node `index` and the next one.
    fn piece(&self, index: usize) -> Piece<N> {
        let from = self.nodes[index];
        let to = self.nodes[index + 1];
        let slope = (to[1] - from[1]) / (to[0] - from[0]);
        let last = index + 2 == self.nodes.len();
        let high = if last { f64::INFINITY.into() } else { to[0] };
        #[expect(
            clippy::cast_possible_truncation,
            reason = "a table has fewer than 2^32 nodes"
        )]
        Piece::line(from, slope, from[0], high, index as u32)
    }
}

impl<N: Scalar> Friction<N> for PiecewiseLinear<N> {
    fn validate(&self) -> Result<(), Error> {
        self.within_limits()?;
        if self.nodes.len() < 2 {
            return Err(Error::TooFewNodes {
                name: "nodes",
                expected: 2,
                got: self.nodes.len(),
            });
        }
        from_zero(&self.nodes)?;
        at_least_kinetic(self.break_away, self.nodes[0][1])
    }

    fn static_limit(&self, _rest: Rest<N>) -> N {
        self.break_away
    }

    fn leave(&self, _force: N, _memory: &mut Memory<N>) -> Piece<N> {
        self.piece(0)
    }

    fn begin(&self, u: N, _balance: N, _memory: &mut Memory<N>) -> Piece<N> {
        let above = self.nodes.partition_point(|node| node[0] <= u);
        self.piece(above.saturating_sub(1).min(self.nodes.len() - 2))
    }

    fn next(&self, piece: &Piece<N>, end: End, _u: N, _memory: &mut Memory<N>) -> Piece<N> {
        let index = piece.branch as usize;
        match end {
            End::High => self.piece(index + 1),
            End::Low => self.piece(index - 1),
            End::Reversal { .. } => *piece,
        }
    }
}

impl<N: Scalar> Value for Vec<Point<N>> {
    const KIND: Kind = Kind::Nodes;

    fn check(&self, name: &'static str, _limits: Limits) -> Result<(), Error> {
        increasing(name, self)
    }
}

/// Check that the first node lies at zero.
pub(super) fn from_zero<N: Scalar>(nodes: &[Point<N>]) -> Result<(), Error> {
    match nodes.first() {
        Some(&[got, _]) if got != 0.0 => Err(Error::FirstNodeNotAtZero { got: got.value() }),
        _ => Ok(()),
    }
}
