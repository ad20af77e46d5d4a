//! What an engine says of a run under laws with an internal state.

use serde_json::Value;
use stickslip::rosenbrock::Integration;
use stickslip::simulate::Stop;
use stickslip::state_law::StateLaw;
use stickslip::state_system::StateSystem;
use stickslip::system::System;

/// So many steps a run are enough to judge.
const MOST_STEPS: usize = 3000;
/// Between every so many steps the interpolant is asked.
const STEPS_BETWEEN_LOOKS: usize = 4;

/// Everything at one time.
#[derive(Clone, Debug, Default)]
pub struct Row {
    /// The time.
    pub t: f64,
    /// Positions, velocities and accelerations of masses.
    pub x: Vec<f64>,
    /// Velocities.
    pub v: Vec<f64>,
    /// Accelerations.
    pub a: Vec<f64>,
    /// Slip velocities and friction forces of contacts.
    pub w: Vec<f64>,
    /// Friction forces.
    pub force: Vec<f64>,
    /// The states of all contacts, one after the other.
    pub z: Vec<f64>,
}

impl Row {
    fn read(value: &Value) -> Option<Self> {
        let list = |index: usize| -> Option<Vec<f64>> {
            value[index].as_array()?.iter().map(Value::as_f64).collect()
        };
        Some(Self {
            t: value[0].as_f64()?,
            x: list(1)?,
            v: list(2)?,
            a: list(3)?,
            w: list(4)?,
            force: list(5)?,
            z: list(6)?,
        })
    }
}

/// Where a velocity changes its sign, as it was reported.
#[derive(Clone, Copy, Debug)]
pub struct Change {
    /// Of the slip velocity of a contact; else of the velocity of its mass.
    pub slip: bool,
    /// The contact.
    pub contact: usize,
    /// When.
    pub t: f64,
}

/// A run.
#[derive(Clone, Debug, Default)]
pub struct StateReport {
    /// Changes of sign; none: the engine reports none.
    pub changes: Option<Vec<Change>>,
    /// The steps.
    pub rows: Vec<Row>,
    /// Between a step and the next, where asked.
    pub between: Vec<Option<Row>>,
    /// The tolerance of each step.
    pub tolerance: f64,
    /// Why it ended.
    pub stop: String,
}

impl StateReport {
    /// From what another program wrote: [t, x, v, a, w, force, z] at its steps and between them.
    pub fn read(told: &Value) -> Option<Self> {
        let change = |value: &Value| {
            Some(Change {
                slip: value[0] == "crossing",
                contact: usize::try_from(value[1].as_u64()?).ok()?,
                t: value[2].as_f64()?,
            })
        };
        Some(Self {
            changes: Some(
                told["changes"]
                    .as_array()?
                    .iter()
                    .map(change)
                    .collect::<Option<_>>()?,
            ),
            rows: told["rows"]
                .as_array()?
                .iter()
                .map(Row::read)
                .collect::<Option<_>>()?,
            between: told["between"].as_array()?.iter().map(Row::read).collect(),
            tolerance: told["tolerance"].as_f64()?,
            stop: told["stop"].as_str()?.to_owned(),
        })
    }
}

fn row(system: &StateSystem, t: f64, y: &[f64]) -> Row {
    let n = system.masses();
    let motion = system.motion(t, y);
    Row {
        t,
        x: y[..n].to_vec(),
        v: motion.v,
        a: motion.a,
        w: motion.w,
        force: motion.force,
        z: y[2 * n..].to_vec(),
    }
}

/// Let the core integrate a case.
///
/// # Errors
/// The engine's sentence.
pub fn run(case: &Value) -> Result<StateReport, String> {
    let (system, _) = System::<StateLaw>::read(&case["sys"]).map_err(|error| error.to_string())?;
    let system = StateSystem::new(system).map_err(|error| error.to_string())?;
    let numbers = |value: &Value| -> Option<Vec<f64>> {
        match value {
            Value::Array(values) => values.iter().map(Value::as_f64).collect(),
            one => Some(vec![one.as_f64()?]),
        }
    };
    let x0 = numbers(&case["x0"]).unwrap_or_else(|| vec![0.0; system.masses()]);
    let tolerance = case["tolerance"].as_f64().unwrap_or(1e-8);
    let y = system.variables(&x0, numbers(&case["v0"]));
    let mut integration = Integration::new(system, y, tolerance).map_err(|error| error.to_string())?;
    let t_end = case["t_end"].as_f64().unwrap_or(1.0);
    let mut asked = 0;
    let stop = integration.advance(t_end, 0.0, &mut || {
        asked += 1;
        asked * 100 < MOST_STEPS
    });
    let times = integration.times();
    let at = |t: f64| row(integration.system(), t, &integration.variables(t));
    Ok(StateReport {
        changes: None,
        rows: times.iter().map(|&t| at(t)).collect(),
        between: (times.windows(2).enumerate())
            .map(|(index, pair)| (index % STEPS_BETWEEN_LOOKS == 0).then(|| at(0.5 * (pair[0] + pair[1]))))
            .collect(),
        tolerance,
        stop: match stop {
            Stop::End => "t_end".into(),
            stop => stop.name().into(),
        },
    })
}
