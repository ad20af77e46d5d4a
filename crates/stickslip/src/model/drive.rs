//! The drive velocity of a contact over time.

use serde::{Deserialize, Serialize};

use crate::clock::Clock;
use crate::error::{Error, finite, increasing};
use crate::harmonic::{Harmonic, add_wave};
use crate::law::Point;
use crate::series::Series;

/// A drive velocity s(t) = velocity + Σ A cos(Ω t + φ) + table(t); the table is linear between its nodes (t, s) and constant
/// beyond them. As a document a number is enough for a constant.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "Document")]
pub struct Drive {
    /// The constant part.
    pub velocity: f64,
    /// The harmonics.
    pub harmonics: Vec<Harmonic>,
    /// The table.
    pub nodes: Vec<Point>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Document {
    Number(f64),
    Table {
        #[serde(default)]
        velocity: f64,
        #[serde(default)]
        harmonics: Vec<Harmonic>,
        #[serde(default)]
        nodes: Vec<Point>,
    },
}

impl From<Document> for Drive {
    fn from(document: Document) -> Self {
        match document {
            Document::Number(velocity) => velocity.into(),
            Document::Table {
                velocity,
                harmonics,
                nodes,
            } => Self {
                velocity,
                harmonics,
                nodes,
            },
        }
    }
}

impl From<f64> for Drive {
    fn from(velocity: f64) -> Self {
        Self {
            velocity,
            ..Self::default()
        }
    }
}

impl Drive {
    pub(crate) fn validate(&self) -> Result<(), Error> {
        finite("drive_velocity", self.velocity)?;
        for harmonic in &self.harmonics {
            harmonic.validate()?;
        }
        increasing("nodes of the drive velocity", &self.nodes)
    }

    pub(crate) fn is_constant(&self) -> bool {
        self.harmonics.is_empty() && self.nodes.is_empty()
    }

    /// The coefficients of s(clock + h), good until [`Drive::node_after`].
    pub(crate) fn expand(&self, clock: Clock, series: &mut Series) {
        series.fill(0.0);
        series[0] = self.velocity;
        for harmonic in &self.harmonics {
            add_wave(harmonic, clock, 1.0, series);
        }
        let Some((first, last)) = self.nodes.first().zip(self.nodes.last()) else {
            return;
        };
        // At a node the piece that begins there counts.
        let above = self.nodes.partition_point(|node| clock.until(node[0]) <= 0.0);
        if above == 0 {
            series[0] += first[1];
        } else if above == self.nodes.len() {
            series[0] += last[1];
        } else {
            let (from, to) = (self.nodes[above - 1], self.nodes[above]);
            let slope = (to[1] - from[1]) / (to[0] - from[0]);
            series[0] += from[1] - slope * clock.until(from[0]);
            series[1] += slope;
        }
    }

    /// The time of the next node after `clock`.
    pub(crate) fn node_after(&self, clock: Clock) -> f64 {
        let times = self.nodes.iter().map(|node| node[0]);
        times
            .filter(|&time| clock.until(time) > 0.0)
            .fold(f64::INFINITY, f64::min)
    }

    /// A bound of its size.
    pub(crate) fn size(&self) -> f64 {
        let waves = self.harmonics.iter().map(|harmonic| harmonic.amplitude.abs());
        let table = self.nodes.iter().map(|node| node[1].abs()).fold(0.0, f64::max);
        self.velocity.abs() + waves.sum::<f64>() + table
    }

    pub(crate) fn fastest(&self) -> f64 {
        self.harmonics
            .iter()
            .map(|harmonic| harmonic.frequency)
            .fold(0.0, f64::max)
    }
}
