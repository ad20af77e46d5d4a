//! An independent judge of orbits: it shares no equation, no law and no integrator with the engine it judges.
//!
//! | module | one sentence |
//! |---|---|
//! | [`problem`] | the document, read anew |
//! | [`law`], [`paper`] | friction from the formulas of `docs/laws.md` and `docs/paper-law.md` |
//! | [`flow`] | the motion of one phase: exp(A h) from sample to sample, or the extrapolated midpoint rule |
//! | [`matrix`], [`number`] | matrices, their exponential, and pairs of doubles |
//! | [`report`] | what the engine says |
//! | [`verdict`] | phase by phase, event by event |
//! | [`states`] | runs under laws with an internal state, step by step |
//! | [`draw`] | random documents that provoke |

#![allow(
    clippy::neg_cmp_op_on_partial_ord,
    reason = "what is no number must fail a check"
)]
#![allow(clippy::needless_range_loop, reason = "formulas run over two arrays at once")]

pub mod draw;
pub mod flow;
pub mod law;
pub mod matrix;
pub mod number;
pub mod paper;
pub mod problem;
pub mod report;
pub mod states;
pub mod verdict;
