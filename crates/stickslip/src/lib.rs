#![doc = include_str!("../README.md")]
//!
//! # Map
//!
//! ## What is simulated: `model/`
//!
//! | module | one sentence |
//! |---|---|
//! | [`model`] | an oscillator or a system of masses, with the engine that its motion needs |
//! | [`oscillator`] | one mass: mass, stiffness, damping, drive, law, forcing |
//! | [`system`] | masses, matrices, contacts, drives |
//! | [`drive`] | the drive velocity of a contact over time |
//! | [`harmonic`] | a harmonic of the drive velocity or of a force |
//! | [`normal_force`] | the normal force of a contact that varies |
//! | [`spring`] | springs that are not linear |
//! | [`state_system`] | the right-hand side of masses under laws with an internal state |
//!
//! ## Friction: `law/`, `state_law/`
//!
//! | module | one sentence |
//! |---|---|
//! | [`law`] | friction laws, one file a law: its parameters with their units and limits, its `static_limit` f_s(t_s, δ), its force during slip |
//! | [`law::declaration`] | the words in which a law declares its parameters |
//! | [`state_law`] | friction laws with an internal state, one file a law |
//!
//! ## Motion between events, and the next event
//!
//! | module | one sentence |
//! |---|---|
//! | [`flow`] | motion between events: closed form, Taylor series, enclosures |
//! | [`event`] | the certified next event of one mass; the first root of a guard along a step of many |
//! | [`rosenbrock`] | the motion under laws with an internal state, by a Rosenbrock method; for the browser, as Python uses scipy |
//!
//! ## Runs: `simulate/`, `network/`, `engine/`
//!
//! | module | one sentence |
//! |---|---|
//! | [`simulate`] | the loop of one mass in closed form, and why a run stopped |
//! | [`watch`] | whether a run goes on, asked within every loop whose length nobody knows |
//! | [`network`] | the loop for systems and smooth laws: Taylor steps, the modes of all contacts at once |
//! | [`engine`] | a motion that is followed further and further: closed form, Taylor steps, samples, a kept orbit |
//! | [`mode`] | the automaton: stick, slip, and what follows an event |
//! | [`hybrid_state`] | from what a motion goes on: mode and memory |
//! | [`event_sequence`] | the event sequence of a run, to be followed |
//! | [`orbit`] | what a run returns, evaluable at any time |
//!
//! ## What a run is asked for: `observer/`
//!
//! | module | one sentence |
//! |---|---|
//! | [`observer`] | what a run is asked for while it runs: write one, and it works for every engine |
//! | [`surface`] | what makes a section: times, events of a kind, a plane; a new one goes there |
//! | [`section`] | the states in which a motion meets a surface |
//! | [`steady_motion`] | the motion after a transient: regime, period, extremes, points |
//! | [`regime`] | the kind of a steady motion, in one word |
//! | [`zero_one`] | the 0–1 test for chaos |
//! | [`lyapunov`] | the Lyapunov exponents of a motion |
//!
//! ## Many runs: `ensemble/`
//!
//! | module | one sentence |
//! |---|---|
//! | [`ensemble`] | many runs of one document |
//! | [`rows`] | many runs of one document, a row of values for each |
//! | [`batch`] | many runs over parameters and starts, on all cores |
//! | [`sweep`] | steady motions over parameters and starts |
//! | [`lanes`] | many oscillators at once, one in each lane of the registers of a processor |
//!
//! ## Derivatives: `variation/`
//!
//! | module | one sentence |
//! |---|---|
//! | [`variation`] | derivatives of a motion through its events (saltation matrices); test functions of sliding bifurcations |
//!
//! ## Along a measured motion
//!
//! | module | one sentence |
//! |---|---|
//! | [`replay`] | the friction that a law predicts along a measured motion |
//! | [`displacement_error`] | the motion nearest to a measured one that obeys a law |
//!
//! ## Numbers: `arithmetic/`
//!
//! | module | one sentence |
//! |---|---|
//! | [`arithmetic`] | numbers that the rest is computed with |
//! | [`clock`] | time that adds up without losing its last digit |
//! | [`dual`] | numbers that carry their derivatives along any number of directions |
//! | [`scalar`] | what a law computes with: any number type |
//! | [`jet`] | numbers that carry their derivatives along a few axes: of these a law gives its exact derivatives |
//! | [`series`] | Taylor coefficients and their recursions |
//! | [`elementary`] | exponential, logarithm, sine and their kin with the same bits on every machine |
//!
//! ## Errors
//!
//! | module | one sentence |
//! |---|---|
//! | [`error`] | everything a user can get wrong, one sentence each |
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod arithmetic;
pub mod displacement_error;
pub mod engine;
pub mod ensemble;
pub mod error;
pub mod event;
pub mod flow;
#[expect(
    clippy::inline_always,
    reason = "what is not inlined is not compiled for the width"
)]
pub mod lanes;
pub mod law;
pub mod model;
mod named;
pub mod network;
pub mod observer;
pub mod orbit;
pub mod replay;
pub mod rosenbrock;
pub mod simulate;
pub mod state_law;
pub mod variation;

pub use arithmetic::{clock, dual, elementary, jet, scalar, series};
pub use engine::{event_sequence, hybrid_state, mode};
pub use ensemble::{batch, rows, sweep};
pub use model::{drive, harmonic, normal_force, oscillator, spring, state_system, system};
pub use observer::{lyapunov, regime, section, steady_motion, surface, zero_one};
pub use simulate::watch;

pub(crate) use arithmetic::matrix;
