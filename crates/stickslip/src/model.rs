//! What a document describes, with the engine that its motion needs.

pub mod drive;
pub mod harmonic;
pub mod normal_force;
pub mod oscillator;
pub mod spring;
pub mod state_system;
pub mod system;

use std::f64::consts::TAU;

use serde_json::Value;

use crate::elementary::{exp, ln};
use crate::engine::{Closed, Engine, Reached, Steps};
use crate::error::{Error, wrong};
use crate::event::Work;
use crate::hybrid_state::Restart;
use crate::law::Friction;
use crate::matrix::Matrix;
use crate::network;
use crate::observer::Observer;
use crate::orbit;
use crate::oscillator::Oscillator;
use crate::simulate::{Run, Stop, simulate_while};
use crate::system::System;

/// An oscillator whose motion is in closed form, or whatever else masses may be.
#[derive(Clone, Debug, PartialEq)]
pub enum Model {
    /// One mass on a constant drive, under a law of linear pieces, away from undamped resonance.
    Closed(Oscillator),
    /// Any number of masses, drives that vary, smooth laws.
    Steps(System),
}

/// Where a run begins: positions and velocities, mass by mass. What is not a number is x = 0, or the velocity of the drive.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Start {
    /// Positions; none: x = 0.
    pub x: Vec<f64>,
    /// Velocities; none: those of the drives.
    pub v: Vec<f64>,
    /// How a motion in closed form goes on, instead.
    pub restart: Option<Restart>,
}

impl Start {
    /// Where another motion ended: what sticks on a drive sticks on.
    #[must_use]
    pub fn after(end: &Reached) -> Self {
        let v = end.v.iter().zip(&end.rides);
        Self {
            x: end.x.clone(),
            v: v.map(|(&v, &rides)| if rides { f64::NAN } else { v }).collect(),
            restart: end.restart,
        }
    }

    fn given(values: &[f64], default: &[f64]) -> Vec<f64> {
        let value = |i: usize| values.get(i).copied().filter(|value| !value.is_nan());
        let each = default.iter().enumerate();
        each.map(|(i, &default)| value(i).unwrap_or(default)).collect()
    }
}

impl Model {
    /// The model of the document of an oscillator or of a system of masses.
    ///
    /// # Errors
    /// What the document lacks, what it has too much, or the first value that makes no sense.
    pub fn read(document: &Value) -> Result<Self, Error> {
        let refused = |error: serde_json::Error| Error::Document {
            reason: error.to_string(),
        };
        let (system, oscillator) = System::read(document).map_err(refused)?;
        if let Some(oscillator) = oscillator {
            oscillator.validate()?;
            if oscillator.closed() && System::from(&oscillator) == system {
                return Ok(Self::Closed(oscillator));
            }
        }
        system.validate()?;
        Ok(Self::Steps(system))
    }

    /// How many masses there are.
    pub fn masses(&self) -> usize {
        match self {
            Self::Closed(_) => 1,
            Self::Steps(system) => system.masses(),
        }
    }

    /// How many contacts there are.
    pub fn contacts(&self) -> usize {
        match self {
            Self::Closed(_) => 1,
            Self::Steps(system) => system.contacts.len(),
        }
    }

    /// The frequency of the first force that varies or, without one, of the first harmonic of a drive.
    pub fn forcing_frequency(&self) -> Option<f64> {
        match self {
            Self::Closed(oscillator) => {
                first_positive(oscillator.forcing.iter().map(|force| force.frequency))
            }
            Self::Steps(system) => system.forcing_frequency(),
        }
    }

    /// The period of the first forcing, or the natural period: of several masses that of the highest frequency.
    pub fn period(&self) -> f64 {
        self.forcing_frequency()
            .map_or_else(|| self.natural_period(), |frequency| TAU / frequency)
    }

    /// The natural period: of several masses that of the highest frequency.
    pub fn natural_period(&self) -> f64 {
        match self {
            Self::Closed(oscillator) => TAU * (oscillator.mass / oscillator.stiffness).sqrt(),
            Self::Steps(system) => TAU / system.natural_frequency(),
        }
    }

    /// Simulate and keep the whole orbit, as long as `go_on` says so.
    ///
    /// # Errors
    /// The first value of the run that makes no sense.
    pub fn simulate(&self, run: network::Run, go_on: impl FnMut() -> bool) -> Result<Orbit, Error> {
        match self {
            Self::Closed(oscillator) => {
                simulate_while(oscillator, Run::of_one(&run), go_on).map(Orbit::Closed)
            }
            Self::Steps(system) => network::simulate_while(system, run, go_on).map(Orbit::Steps),
        }
    }

    /// A run from a start, of so many events at the most.
    ///
    /// # Errors
    /// A start that does not fit.
    pub fn run(&self, start: &Start, max_events: u64) -> Result<Running<'_>, Error> {
        if start.x.len().max(start.v.len()) > self.masses() {
            return wrong(format!(
                "the start must have one number a mass ({})",
                self.masses()
            ));
        }
        match self {
            Self::Closed(oscillator) => {
                if let Some(restart) = start.restart {
                    return Ok(Running::Closed(Box::new(Closed::restart(
                        oscillator, restart, max_events,
                    ))));
                }
                let run = Run {
                    x0: Start::given(&start.x, &[0.0])[0],
                    v0: Some(Start::given(&start.v, &[oscillator.drive_velocity])[0]),
                    t_end: f64::INFINITY,
                    max_events,
                };
                Ok(Running::Closed(Box::new(Closed::new(oscillator, run, None))))
            }
            Self::Steps(system) => {
                let driven = system.driven_velocities();
                let run = network::Run {
                    x0: Some(Start::given(&start.x, &vec![0.0; system.masses()])),
                    v0: Some(Start::given(&start.v, &driven)),
                    // That of each call counts.
                    t_end: 1.0,
                    max_events,
                };
                Ok(Running::Steps(Box::new(Steps::new(system, run)?)))
            }
        }
    }
}

/// The same of either engine's.
macro_rules! either {
    ($of:expr, $one:ident => $what:expr) => {
        match $of {
            Self::Closed($one) => $what,
            Self::Steps($one) => $what,
        }
    };
}

/// A whole run of a model.
#[derive(Clone, Debug)]
#[expect(missing_docs, reason = "as of the model")]
pub enum Orbit {
    Closed(orbit::Orbit),
    Steps(network::Orbit),
}

impl Orbit {
    /// The events, in time.
    pub fn events(&self) -> &[orbit::Event] {
        either!(self, orbit => &orbit.events)
    }

    /// Why it ended.
    pub fn stop(&self) -> Stop {
        either!(self, orbit => orbit.stop)
    }

    /// What it cost.
    pub fn work(&self) -> Work {
        either!(self, orbit => orbit.work)
    }

    /// The time up to which it is known.
    pub fn t_last(&self) -> f64 {
        either!(self, orbit => orbit.t_last())
    }

    /// From where and how long.
    pub fn run(&self) -> network::Run {
        match self {
            Self::Closed(orbit) => network::Run {
                x0: Some(vec![orbit.run.x0]),
                v0: orbit.run.v0.map(|v0| vec![v0]),
                t_end: orbit.run.t_end,
                max_events: orbit.run.max_events,
            },
            Self::Steps(orbit) => orbit.run.clone(),
        }
    }

    /// The states at `times`, in any order.
    pub fn states(&self, times: &[f64]) -> network::States {
        match self {
            Self::Closed(orbit) => {
                let s = orbit.oscillator.drive_velocity;
                let room = times.len();
                let mut columns = network::States {
                    x: Vec::with_capacity(room),
                    v: Vec::with_capacity(room),
                    a: Vec::with_capacity(room),
                    w: Vec::with_capacity(room),
                    force: Vec::with_capacity(room),
                    stuck: Vec::with_capacity(room),
                };
                orbit.each_state(times, |state| {
                    columns.x.push(state.x);
                    columns.v.push(state.v);
                    columns.a.push(state.a);
                    columns.w.push(if state.stuck { 0.0 } else { s - state.v });
                    columns.force.push(state.force);
                    columns.stuck.push(state.stuck);
                });
                columns
            }
            Self::Steps(orbit) => orbit.states(times),
        }
    }
}

/// A run of a model.
#[expect(missing_docs, reason = "as of the model")]
pub enum Running<'a> {
    Closed(Box<Closed<'a>>),
    Steps(Box<Steps<'a>>),
}

impl Running<'_> {
    /// The oscillator, where it is one under a smooth law. Near a resonance linear pieces have no closed form, in lanes either.
    pub(crate) fn smooth_oscillator(&self) -> Option<Oscillator> {
        match self {
            Self::Closed(_) => None,
            Self::Steps(engine) => engine.one_mass().filter(|oscillator| oscillator.law.smooth()),
        }
    }
}

impl Engine for Running<'_> {
    fn go(&mut self, t_end: f64, after: f64, observer: &mut impl Observer) -> Result<Stop, Error> {
        either!(self, engine => engine.go(t_end, after, observer))
    }

    fn events(&self) -> u64 {
        either!(self, engine => engine.events())
    }

    fn end(&self) -> &Reached {
        either!(self, engine => engine.end())
    }

    fn must_break(&self, contact: usize) -> bool {
        either!(self, engine => engine.must_break(contact))
    }
}

/// The first frequency of what varies at all.
fn first_positive(mut frequencies: impl Iterator<Item = f64>) -> Option<f64> {
    frequencies.find(|&frequency| frequency > 0.0)
}

impl<L> System<L> {
    /// Whether nothing here has a mass, so that friction and the load are in balance at every time.
    pub fn is_massless(&self) -> bool {
        self.mass.iter().flatten().all(|&mass| mass == 0.0)
    }

    /// As [`Model::forcing_frequency`].
    pub(crate) fn forcing_frequency(&self) -> Option<f64> {
        let forces = self.forcing.iter().map(|force| force.frequency);
        let drives = self.contacts.iter().flat_map(|c| &c.drive_velocity.harmonics);
        let normals = self.contacts.iter().flat_map(|c| &c.normal_force);
        let others = drives.chain(normals.flat_map(|normal| &normal.harmonics));
        first_positive(forces.chain(others.map(|harmonic| harmonic.frequency)))
    }

    /// The highest natural frequency of the masses without damping and friction; 1 where nothing is sprung.
    ///
    /// The spectral radius of M⁻¹ K is the limit of |(M⁻¹ K)^n|^(1/n) (Gelfand), taken by squaring.
    ///
    /// # Panics
    /// Never for a validated system.
    pub fn natural_frequency(&self) -> f64 {
        let inverse = Matrix::from_rows(&self.mass)
            .inverse()
            .expect("a validated mass matrix");
        let mut power = inverse.times(&Matrix::from_rows(&self.stiffness));
        let (mut radius, mut share) = (0.0, 1.0);
        // Of what is left the logarithm of the norm is divided by 2⁶⁰.
        for _ in 0..60 {
            let norm = power.norm();
            if norm == 0.0 {
                return 1.0;
            }
            radius += share * ln(norm);
            share *= 0.5;
            power.scale(1.0 / norm);
            power = power.times(&power);
        }
        exp(0.5 * radius)
    }
}
