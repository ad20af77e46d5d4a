//! Everything that can be wrong with what a user asks for, one sentence each.

use std::fmt;

use crate::scalar::Scalar;

/// A request the core refuses, with the numbers that were refused.
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "the fields are the numbers in the sentence")]
pub enum Error {
    /// A quantity that must be a finite number is not.
    NotFinite { name: &'static str, value: f64 },
    /// A quantity that must be greater than zero is not.
    NotPositive { name: &'static str, value: f64 },
    /// A quantity that must not be negative is.
    Negative { name: &'static str, value: f64 },
    /// Static friction below kinetic friction at rest: adhesion could not hold what slip produces.
    BreakAwayBelowKinetic { break_away: f64, kinetic: f64 },
    /// A table needs at least this many nodes.
    TooFewNodes {
        name: &'static str,
        expected: usize,
        got: usize,
    },
    /// The first node of a friction table must lie at zero slip velocity.
    FirstNodeNotAtZero { got: f64 },
    /// Abscissae of a table must increase.
    NodesNotIncreasing {
        name: &'static str,
        index: usize,
        before: f64,
        after: f64,
    },
    /// A table that must not fall does.
    TableFalls {
        name: &'static str,
        index: usize,
        before: f64,
        after: f64,
    },
    /// An elasto-plastic contact that would slip before it yields.
    ElasticBeyondSlip { elastic: f64, weakest: f64 },
    /// A law with memory where a memoryless one is needed.
    Remembers,
    /// The geometry of the paper's law does not close.
    Geometry { what: &'static str, value: f64 },
    /// Undamped resonance has no bounded forced response.
    Resonance { frequency: f64 },
    /// More harmonics than the core carries in one oscillator.
    TooManyHarmonics { most: usize, got: usize },
    /// The document is not a system at all.
    Document { reason: String },
}

impl fmt::Display for Error {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite { name, value } => {
                write!(out, "{name} must be a finite number, got {value}")
            }
            Self::NotPositive { name, value } => {
                write!(out, "{name} must be greater than 0, got {value}")
            }
            Self::Negative { name, value } => write!(out, "{name} must not be negative, got {value}"),
            Self::BreakAwayBelowKinetic { break_away, kinetic } => write!(
                out,
                "break-away force must be at least the kinetic force at zero slip velocity ({kinetic}), got {break_away}: \
                 raise the break-away force or lower the kinetic one"
            ),
            Self::TooFewNodes { name, expected, got } => {
                write!(out, "{name} needs at least {expected} nodes, got {got}")
            }
            Self::FirstNodeNotAtZero { got } => write!(
                out,
                "the first node must lie at slip velocity 0, got {got}: add the node where the table meets zero slip"
            ),
            Self::NodesNotIncreasing {
                name,
                index,
                before,
                after,
            } => write!(
                out,
                "{name} must have strictly increasing abscissae, got {after} after {before} at node {index} (counted from 0)"
            ),
            Self::TableFalls {
                name,
                index,
                before,
                after,
            } => write!(
                out,
                "{name} must not fall, got {after} after {before} at node {index} (counted from 0): smooth the table first"
            ),
            Self::ElasticBeyondSlip { elastic, weakest } => write!(
                out,
                "elastic must be less than the smallest friction of steady slip ({weakest}), got {elastic}"
            ),
            Self::Remembers => write!(
                out,
                "law must be memoryless, as a smooth sign leaves no events to remember: take the kinetic friction of that law as a table"
            ),
            Self::Geometry { what, value } => write!(out, "{what}, got {value}"),
            Self::Resonance { frequency } => write!(
                out,
                "forcing at the frequency {frequency} meets an undamped resonance: give the oscillator some damping or move the frequency"
            ),
            Self::TooManyHarmonics { most, got } => {
                write!(
                    out,
                    "at most {most} harmonics can act on one oscillator, got {got}"
                )
            }
            Self::Document { reason } => write!(out, "{reason}"),
        }
    }
}

impl std::error::Error for Error {}

/// What a JSON document says.
pub(crate) fn read<T: serde::de::DeserializeOwned>(document: &str) -> Result<T, Error> {
    serde_json::from_str(document).map_err(|error| Error::Document {
        reason: error.to_string(),
    })
}

/// `value` if it is finite.
pub(crate) fn finite(name: &'static str, value: f64) -> Result<f64, Error> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(Error::NotFinite { name, value })
    }
}

/// `value` if it is finite and greater than zero.
pub(crate) fn positive(name: &'static str, value: f64) -> Result<f64, Error> {
    if finite(name, value)? > 0.0 {
        Ok(value)
    } else {
        Err(Error::NotPositive { name, value })
    }
}

/// `value` if it is finite and not below zero.
pub(crate) fn not_negative(name: &'static str, value: f64) -> Result<f64, Error> {
    if finite(name, value)? >= 0.0 {
        Ok(value)
    } else {
        Err(Error::Negative { name, value })
    }
}

/// That a table is finite and its abscissae increase strictly.
pub(crate) fn increasing<N: Scalar>(name: &'static str, nodes: &[[N; 2]]) -> Result<(), Error> {
    let mut before = f64::NEG_INFINITY;
    for (index, node) in nodes.iter().enumerate() {
        let after = finite(name, node[0].value())?;
        finite(name, node[1].value())?;
        if after <= before {
            return Err(Error::NodesNotIncreasing {
                name,
                index,
                before,
                after,
            });
        }
        before = after;
    }
    Ok(())
}

/// A law whose geometry does not close: what is wrong, and the value that was given.
pub(crate) fn misshapen<T>(what: &'static str, value: f64) -> Result<T, Error> {
    Err(Error::Geometry { what, value })
}

/// A request that is refused for this reason.
pub(crate) fn wrong<T>(reason: String) -> Result<T, Error> {
    Err(Error::Document { reason })
}
