//! Springs that are not linear: a force over displacement given as pieces, such as a stop with its gap, or with a cubic part.

use serde::{Deserialize, Serialize};

use crate::error::{Error, finite, increasing, wrong};
use crate::law::Point;

/// A spring between a mass and the ground or another mass: r(ξ) = line through the nodes + cubic · ξ³ pulls the mass back, where ξ
/// is the position of the mass, less that of the other. Beyond the nodes the first and the last piece go on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spring {
    /// The mass.
    #[serde(default)]
    pub mass: usize,
    /// The other mass; none: the ground.
    #[serde(default)]
    pub other: Option<usize>,
    /// Pairs (displacement, force), linear between them.
    #[serde(default)]
    pub nodes: Vec<Point>,
    /// The factor of ξ³.
    #[serde(default)]
    pub cubic: f64,
}

impl Spring {
    pub(crate) fn validate(&self) -> Result<(), Error> {
        finite("the cubic factor of a spring", self.cubic)?;
        if self.nodes.len() == 1 {
            return wrong("a spring needs two nodes or more, or none and a cubic part, got 1".into());
        }
        increasing("nodes of a spring", &self.nodes)
    }

    /// The piece on which a displacement lies.
    pub(crate) fn piece(&self, displacement: f64) -> usize {
        let above = self.nodes.partition_point(|node| node[0] <= displacement);
        above.clamp(1, self.nodes.len().max(2) - 1) - 1
    }

    /// The displacements at which a piece ends; infinite where none follows.
    pub(crate) fn ends(&self, piece: usize) -> [f64; 2] {
        let low = if piece == 0 {
            f64::NEG_INFINITY
        } else {
            self.nodes[piece][0]
        };
        let high = if piece + 2 < self.nodes.len() {
            self.nodes[piece + 1][0]
        } else {
            f64::INFINITY
        };
        [low, high]
    }

    /// Offset and slope of a piece.
    pub(crate) fn line(&self, piece: usize) -> [f64; 2] {
        let Some((from, to)) = self.nodes.get(piece).zip(self.nodes.get(piece + 1)) else {
            return [0.0; 2];
        };
        let slope = (to[1] - from[1]) / (to[0] - from[0]);
        [from[1] - slope * from[0], slope]
    }

    /// The steepest slope of its pieces.
    pub(crate) fn steepest(&self) -> f64 {
        let pieces = 0..self.nodes.len().saturating_sub(1);
        pieces.map(|piece| self.line(piece)[1].abs()).fold(0.0, f64::max)
    }

    /// The slope of its force on a piece.
    pub(crate) fn slope(&self, piece: usize, displacement: f64) -> f64 {
        self.line(piece)[1] + 3.0 * self.cubic * displacement * displacement
    }

    /// Its force on a piece.
    pub(crate) fn force(&self, piece: usize, displacement: f64) -> f64 {
        let [offset, slope] = self.line(piece);
        offset + slope * displacement + self.cubic * displacement * displacement * displacement
    }
}
