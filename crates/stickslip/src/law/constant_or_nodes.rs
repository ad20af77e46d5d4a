//! A number, or a table of nodes with straight lines between them.

use serde::{Deserialize, Serialize};

use super::{Piece, Point};
use crate::error::{Error, increasing};
use crate::law::declaration::{Kind, Limits, Over, Value};
use crate::scalar::Scalar;

/// A function of one variable: constant, or linear between nodes and constant beyond the first and the last.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged, bound(deserialize = "N: Scalar + serde::de::DeserializeOwned"))]
pub enum ConstantOrNodes<N = f64> {
    /// The same value everywhere.
    Constant(N),
    /// Nodes (abscissa, value).
    Nodes(Vec<Point<N>>),
}

impl<M> Over<M> for ConstantOrNodes {
    type Of = ConstantOrNodes<M>;

    fn over(&self, of: &mut dyn FnMut(f64) -> M) -> ConstantOrNodes<M> {
        match self {
            Self::Constant(value) => ConstantOrNodes::Constant(value.over(of)),
            Self::Nodes(nodes) => ConstantOrNodes::Nodes(nodes.over(of)),
        }
    }
}

impl<N: Scalar> Value for ConstantOrNodes<N> {
    const KIND: Kind = Kind::NumberOrNodes;

    /// There is a node, abscissae increase, and each value is within its limits.
    fn check(&self, name: &'static str, limits: Limits) -> Result<(), Error> {
        match self {
            Self::Constant(value) => limits.check(name, value.value()),
            Self::Nodes(nodes) if nodes.is_empty() => Err(Error::TooFewNodes {
                name,
                expected: 1,
                got: 0,
            }),
            Self::Nodes(nodes) => {
                increasing(name, nodes)?;
                nodes
                    .iter()
                    .try_for_each(|node| limits.check(name, node[1].value()))
            }
        }
    }
}

impl<N: Scalar> ConstantOrNodes<N> {
    /// The value at `at`.
    pub(super) fn at(&self, at: N) -> N {
        self.line(at)[0]
    }

    /// The value at `at` and the slope from there on.
    pub(super) fn line(&self, at: N) -> [N; 2] {
        match self {
            Self::Constant(value) => [*value, N::default()],
            Self::Nodes(nodes) => {
                let above = nodes.partition_point(|node| node[0] <= at);
                if above == 0 {
                    return [nodes[0][1], N::default()];
                }
                if above == nodes.len() {
                    return [nodes[above - 1][1], N::default()];
                }
                let (from, to) = (nodes[above - 1], nodes[above]);
                let (rise, run) = (to[1] - from[1], to[0] - from[0]);
                [from[1] + rise * (at - from[0]) / run, rise / run]
            }
        }
    }

    /// The piece of friction between node `index` and the next one; beyond the last node the force stays.
    pub(super) fn piece(&self, index: usize) -> Piece<N> {
        let nodes = self.nodes();
        let Some(&from) = nodes.get(index) else {
            return Piece::constant(self.at(N::default()));
        };
        let (slope, high) = match nodes.get(index + 1) {
            Some(to) => ((to[1] - from[1]) / (to[0] - from[0]), to[0]),
            None => (N::default(), f64::INFINITY.into()),
        };
        #[expect(
            clippy::cast_possible_truncation,
            reason = "a table has fewer than 2^32 nodes"
        )]
        Piece::line(from, slope, from[0], high, index as u32)
    }

    /// The nodes; none for a constant.
    pub(super) fn nodes(&self) -> &[Point<N>] {
        match self {
            Self::Constant(_) => &[],
            Self::Nodes(nodes) => nodes,
        }
    }
}
