//! Friction with one branch while the slip speed rises and another while it falls, which need not meet.

use super::constant_or_nodes::ConstantOrNodes;
use super::piecewise_linear::from_zero;
use super::static_kinetic::at_least_kinetic;
use super::{End, Friction, Memory, Piece, Rest};
use crate::error::Error;
use crate::law::declaration::{Limited, parameters};
use crate::scalar::Scalar;

parameters! {
    /// F = f₊(u) while u = |w| rises, f₋(u) while it falls, |F| ≤ f_s at rest (Hunt, Torbe & Spencer, Wear 8 (1965) 455).
    ///
    /// Where f₋ < f₊, friction between the two holds the slip speed: F is set-valued at u̇ = 0 as it is at w = 0. Where
    /// f₋ > f₊, both branches are consistent for forces between them, and the motion stays on its branch until that ends.
    pub struct TwoBranch<N> {
        /// f₊: a number or nodes (slip speed, force), the first at slip speed 0; constant beyond the last.
        pub rising: ConstantOrNodes<N> = ConstantOrNodes::Nodes(vec![[0.0, 1.0], [0.6, 0.7]]) => [SLIP_VELOCITY, NODE_FORCE.not_negative()],
        /// f₋, likewise.
        pub falling: ConstantOrNodes<N> = ConstantOrNodes::Nodes(vec![[0.0, 0.6], [0.6, 0.7]]) => [SLIP_VELOCITY, NODE_FORCE.not_negative()],
        /// Break-away force f_s.
        pub break_away: N = 1.0 => [FORCE.not_negative()],
    }
}

impl<N: Scalar> TwoBranch<N> {
    fn table(&self, rising: bool) -> &ConstantOrNodes<N> {
        if rising { &self.rising } else { &self.falling }
    }

    /// Piece<N> `index` of a branch; its number tells both.
    fn piece(&self, index: usize, rising: bool) -> Piece<N> {
        #[expect(
            clippy::cast_possible_truncation,
            reason = "a table has fewer than 2^31 nodes"
        )]
        let branch = 2 * index as u32 + u32::from(!rising);
        Piece {
            reverses: true,
            branch,
            ..self.table(rising).piece(index)
        }
    }

    /// The piece on which a slip at speed `u` goes on.
    fn at(&self, u: N, rising: bool) -> Piece<N> {
        let nodes = self.table(rising).nodes();
        // At a node the piece ahead.
        let above = nodes.partition_point(|node| node[0] < u || (rising && node[0] == u));
        self.piece(above.saturating_sub(1), rising)
    }
}

impl<N: Scalar> Friction<N> for TwoBranch<N> {
    fn validate(&self) -> Result<(), Error> {
        self.within_limits()?;
        from_zero(self.rising.nodes())?;
        from_zero(self.falling.nodes())?;
        let zero = N::default();
        at_least_kinetic(self.break_away, self.rising.at(zero).max(self.falling.at(zero)))
    }

    fn static_limit(&self, _rest: Rest<N>) -> N {
        self.break_away
    }

    fn branches(&self, u: N) -> Option<[N; 2]> {
        Some([self.falling.at(u), self.rising.at(u)])
    }

    fn leave(&self, _force: N, _memory: &mut Memory<N>) -> Piece<N> {
        self.piece(0, true)
    }

    fn begin(&self, u: N, balance: N, _memory: &mut Memory<N>) -> Piece<N> {
        self.at(u, balance >= self.rising.at(u))
    }

    fn next(&self, piece: &Piece<N>, end: End, u: N, _memory: &mut Memory<N>) -> Piece<N> {
        let (index, rising) = (piece.branch as usize / 2, piece.branch.is_multiple_of(2));
        match end {
            End::High => self.piece(index + 1, rising),
            End::Low => self.piece(index - 1, rising),
            End::Reversal { rising } => self.at(u, rising),
        }
    }
}
