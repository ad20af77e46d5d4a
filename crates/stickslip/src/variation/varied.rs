//! A system that varies with one number of its document, and what its laws answer to numbers that carry derivatives.

use serde_json::Value;

use crate::dual::Dual;
use crate::error::Error;
use crate::law::{Checked, Law};
use crate::system::System;

/// A system that varies with one number of its document.
#[derive(Clone, Debug)]
pub struct Varied {
    /// The system.
    pub base: System,
    /// The same two steps and one step down, one and two steps up, and the size of a step.
    pub(super) around: Option<([System; 4], f64)>,
}

/// A fourth-order difference: the value two steps and one step down, one and two steps up.
pub(super) fn difference(around: [f64; 4], step: f64) -> f64 {
    let [two_down, down, up, two_up] = around;
    (8.0 * (up - down) - (two_up - two_down)) / (12.0 * step)
}

const STEPS: [f64; 4] = [-2.0, -1.0, 1.0, 2.0];
/// A step relative to the number: its fourth power and rounding over it are both below 10⁻¹².
pub(super) const RELATIVE_STEP: f64 = 1e-3;
/// One for the algebra of lines, which has corners: rounding over it is 10⁻¹⁰.
pub(super) const LINE_STEP: f64 = 1e-6;

fn step_of(value: f64, relative: f64) -> f64 {
    if value == 0.0 {
        1e-6
    } else {
        relative * value.abs()
    }
}

fn refused(reason: &impl ToString) -> Error {
    Error::Document {
        reason: reason.to_string(),
    }
}

/// The system of a document, of an oscillator or of masses.
fn system_of(document: &Value) -> Result<System, Error> {
    let read = System::read(document.clone());
    read.map(|(system, _)| system).map_err(|error| refused(&error))
}

/// The systems around that of a document, and the size of a step.
fn around(document: &Value, path: &str) -> Result<([System; 4], f64), Error> {
    let mut table = document.clone();
    let number = table.pointer(path).and_then(Value::as_f64);
    let value = number.ok_or_else(|| refused(&format!("the system document has no number {path:?}")))?;
    let step = step_of(value, RELATIVE_STEP);
    let mut beside = |steps: f64| {
        if let Some(expansion) = table.pointer_mut(path) {
            *expansion = (value + steps * step).into();
        }
        let system = system_of(&table)?;
        admit(&system).map_err(|error| {
            refused(&format!(
                "{} = {value} has no derivative, which is taken from values up to 0.2 % beside it: {error}",
                path.trim_start_matches('/').replace('/', ".")
            ))
        })?;
        Ok(system)
    };
    let systems = [
        beside(STEPS[0])?,
        beside(STEPS[1])?,
        beside(STEPS[2])?,
        beside(STEPS[3])?,
    ];
    Ok((systems, step))
}

/// Refuse a system in which nothing can move on, or friction that is no function of the slip speed. What only makes no sense,
/// such as a damping below zero, has a derivative all the same.
fn admit(system: &System) -> Result<(), Error> {
    system.check_masses()?;
    for contact in &system.contacts {
        if let Err(error @ Error::NodesNotIncreasing { .. }) = contact.law.check() {
            return Err(error);
        }
    }
    Ok(())
}

impl Varied {
    /// A system, and the number of its document that varies, such as `/law/kinetic` of an oscillator's.
    ///
    /// # Errors
    /// What is wrong with the path, or with the systems beside this one.
    pub fn new(base: &System, along: Option<(&Value, &str)>) -> Result<Self, Error> {
        let around = along.map(|(document, path)| around(document, path)).transpose()?;
        let base = base.clone();
        Ok(Self { base, around })
    }

    /// What the law of a contact answers to numbers, with the derivatives of its answers; `parameter` is the lane of the
    /// parameter.
    pub(super) fn ask<const I: usize, const O: usize>(
        &self,
        contact: usize,
        inputs: [&Dual; I],
        parameter: Option<usize>,
        relative: f64,
        answer: impl Fn(&Law, [f64; I]) -> [f64; O],
    ) -> [Dual; O] {
        let law = &self.base.contacts[contact].law;
        let values = inputs.map(|input| input.value);
        let lanes = inputs[0].rates.len();
        let mut outputs = answer(law, values).map(|value| Dual::fixed(value, lanes));
        let spread = |outputs: &mut [Dual; O], around: [[f64; O]; 4], step: f64, along: &Dual| {
            for (o, output) in outputs.iter_mut().enumerate() {
                if output.value.is_finite() {
                    let slope = difference(around.map(|answers| answers[o]), step);
                    if slope != 0.0 {
                        output.shift(slope, along);
                    }
                }
            }
        };
        for (i, input) in inputs.iter().enumerate() {
            if input.value.is_finite() && input.rates.iter().any(|rate| *rate != 0.0) {
                let step = step_of(input.value, relative);
                let around = STEPS.map(|steps| {
                    let mut beside = values;
                    beside[i] += steps * step;
                    answer(law, beside)
                });
                spread(&mut outputs, around, step, input);
            }
        }
        if let (Some((around, step)), Some(lane)) = (&self.around, parameter) {
            let around = std::array::from_fn(|i| answer(&around[i].contacts[contact].law, values));
            spread(&mut outputs, around, *step, &Dual::along(0.0, lane, lanes));
        }
        outputs
    }
}
