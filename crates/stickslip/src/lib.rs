#![doc = include_str!("../README.md")]
//!
//! # Map
//!
//! | module | one sentence |
//! |---|---|
//! | [`lanes`] | many oscillators at once, one in each lane of the registers of a processor |
//! | [`oscillator`] | one mass: mass, stiffness, damping, drive, law, forcing |
//! | [`drive`] | the drive velocity of a contact over time |
//! | [`harmonic`] | a harmonic of the drive velocity or of a force |
//! | [`clock`] | time that adds up without losing its last digit |
//! | [`law`] | friction laws: two questions, one file a law |
//! | [`parameters`] | what is known of the parameters of a law: limits, dimensions, an example |
//! | [`mode`] | the automaton: stick, slip, and what follows an event |
//! | [`flow`] | motion between events: closed form, Taylor series, enclosures |
//! | [`event`] | the certified next event |
//! | [`simulate`] | the loop, and why it stopped |
//! | [`hybrid_state`] | from what a motion goes on: mode and memory |
//! | [`orbit`] | what a run returns, evaluable at any time |
//! | [`model`] | an oscillator or a system of masses, with the engine that its motion needs |
//! | [`engine`] | a motion that is followed further and further: closed form, Taylor steps, samples, a kept orbit |
//! | [`observer`] | what a run is asked for while it runs: write one, and it works for every engine |
//! | [`rows`] | many runs of one document, a row of values for each |
//! | [`batch`] | many runs over parameters and starts, on all cores |
//! | [`section`] | the states in which a motion meets a surface |
//! | [`regime`] | the kind of a steady motion, in one word |
//! | [`sweep`] | steady motions over parameters and starts: regime, period, extremes, points |
//! | [`event_sequence`] | the event sequence of a run, to be followed |
//! | [`variation`] | derivatives of a motion through its events; test functions of sliding bifurcations |
//! | [`dual`] | numbers that carry their derivatives |
//! | [`watch`] | whether a run goes on, asked within every loop whose length nobody knows |
//! | [`lyapunov`] | the largest Lyapunov exponent of a motion |
//! | [`zero_one`] | the 0–1 test for chaos |
//! | [`replay`] | a law along a measured motion |
//! | [`displacement_error`] | the motion nearest to a measured one that obeys a law |
//! | [`system`] | masses, matrices, contacts, drives |
//! | [`spring`] | springs that are not linear |
//! | [`normal_force`] | the normal force of a contact that varies |
//! | [`network`] | the loop for systems and smooth laws: Taylor steps, the modes of all contacts at once |
//! | [`series`] | Taylor coefficients, their recursions, the certified first root |
//! | [`state_law`] | friction laws with an internal state, one file a law |
//! | [`integration`] | the motion under such laws, by the steps of a Rosenbrock method |
//! | [`state_system`] | the right-hand side of masses under such laws |
//! | [`elementary`] | exponential, logarithm, sine and their kin with the same bits on every machine |
//! | [`error`] | everything a user can get wrong, one sentence each |
#![forbid(unsafe_code)]
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

pub mod batch;
pub mod clock;
pub mod displacement_error;
pub mod drive;
pub mod dual;
pub mod elementary;
pub mod engine;
pub mod error;
pub mod event;
pub mod event_sequence;
pub mod flow;
pub mod harmonic;
pub mod hybrid_state;
pub mod integration;
#[expect(
    clippy::inline_always,
    reason = "what is not inlined is not compiled for the width"
)]
pub mod lanes;
pub mod law;
pub mod lyapunov;
mod matrix;
pub mod mode;
pub mod model;
mod named;
pub mod network;
pub mod normal_force;
pub mod observer;
pub mod orbit;
pub mod oscillator;
pub mod parameters;
pub mod regime;
pub mod replay;
pub mod rows;
pub mod section;
pub mod series;
pub mod simulate;
pub mod spring;
pub mod state_law;
pub mod state_system;
pub mod sweep;
pub mod system;
pub mod variation;
pub mod watch;
pub mod zero_one;
