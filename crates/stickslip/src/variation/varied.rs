//! A system that varies with numbers of its document, and what its laws answer to numbers that carry derivatives.

use serde_json::Value;

use super::state::{Layout, State};
use crate::dual::Dual;
use crate::error::Error;
use crate::law::{Checked, Law};
use crate::rows::numbers_at;
use crate::system::System;

/// A system that varies with numbers of its document, each a parameter.
#[derive(Clone, Debug)]
pub struct Varied {
    /// The system.
    pub base: System,
    /// What each parameter does to it.
    pub(super) parameters: Vec<Parameter>,
    /// How the numbers of the start move with them, row after row; empty where it does not move.
    pub(super) start: Vec<f64>,
}

/// What one number of a document does to its system.
#[derive(Clone, Debug)]
pub(super) struct Parameter {
    /// The system two steps and one step down, one and two steps up.
    pub(super) around: [System; 4],
    /// The size of a step.
    pub(super) step: f64,
    /// Whether it changes nothing but laws of friction.
    pub(super) of_law: bool,
    /// Whether it changes the law of each contact.
    laws: Vec<bool>,
}

impl Parameter {
    fn new(base: &System, table: &mut Value, path: &str) -> Result<Self, Error> {
        let (around, step) = around(table, path)?;
        let mut beside = around[0].clone();
        for (contact, own) in beside.contacts.iter_mut().zip(&base.contacts) {
            contact.law = own.law.clone();
        }
        let of_law = beside == *base;
        let both = around[0].contacts.iter().zip(&base.contacts);
        let laws = both.map(|(beside, own)| beside.law != own.law).collect();
        Ok(Self {
            around,
            step,
            of_law,
            laws,
        })
    }

    /// The derivative of what the systems around it answer.
    pub(super) fn rate(&self, answer: impl Fn(&System) -> f64) -> f64 {
        difference(self.around.each_ref().map(answer), self.step)
    }
}

/// A fourth-order difference: the value two steps and one step down, one and two steps up.
pub(super) fn difference(around: [f64; 4], step: f64) -> f64 {
    let [two_down, down, up, two_up] = around;
    (8.0 * (up - down) - (two_up - two_down)) / (12.0 * step)
}

const DIFFERENCE_POINTS: [f64; 4] = [-2.0, -1.0, 1.0, 2.0];
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
    let read = System::read(document);
    read.map(|(system, _)| system).map_err(|error| refused(&error))
}

/// The systems around that of a document, which is left as it was, and the size of a step.
fn around(table: &mut Value, path: &str) -> Result<([System; 4], f64), Error> {
    let number = numbers_at(table, path).first().and_then(|number| number.as_f64());
    let value = number.ok_or_else(|| refused(&format!("the system document has no number {path:?}")))?;
    let step = step_of(value, RELATIVE_STEP);
    let mut beside = |steps: f64| {
        for number in numbers_at(table, path) {
            *number = (value + steps * step).into();
        }
        let system = system_of(table)?;
        admit(&system).map_err(|error| {
            refused(&format!(
                "{} = {value} has no derivative, which is taken from values up to 0.2 % beside it: {error}",
                path.trim_start_matches('/').replace('/', ".")
            ))
        })?;
        Ok(system)
    };
    let systems = [
        beside(DIFFERENCE_POINTS[0])?,
        beside(DIFFERENCE_POINTS[1])?,
        beside(DIFFERENCE_POINTS[2])?,
        beside(DIFFERENCE_POINTS[3])?,
    ];
    for number in numbers_at(table, path) {
        *number = value.into();
    }
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
    /// A system, and the numbers of its document that vary, such as `/law/kinetic` of an oscillator's.
    ///
    /// # Errors
    /// What is wrong with a path, or with the systems beside this one.
    pub fn new(base: &System, document: &Value, paths: &[String]) -> Result<Self, Error> {
        let mut table = document.clone();
        let parameters = paths.iter().map(|path| Parameter::new(base, &mut table, path));
        Ok(Self {
            parameters: parameters.collect::<Result<_, _>>()?,
            base: base.clone(),
            start: Vec::new(),
        })
    }

    /// The same where the motion begins as `begin` says, so that its start moves with the parameters: a slip begins on a line
    /// of friction of its law.
    #[must_use]
    pub fn begun(mut self, begin: impl Fn(&System) -> State) -> Self {
        let own = begin(&self.base);
        let beside: Vec<_> = (self.parameters.iter())
            .map(|parameter| parameter.around.each_ref().map(&begin))
            .collect();
        let same = |around: &[State; 4]| around.iter().all(|state| state.flags == own.flags);
        let mut rates = Vec::with_capacity(own.numbers.len() * self.parameters.len());
        for i in 0..own.numbers.len() {
            for (around, parameter) in beside.iter().zip(&self.parameters) {
                let rate = difference(around.each_ref().map(|state| state.numbers[i]), parameter.step);
                rates.push(if same(around) && rate.is_finite() {
                    rate
                } else {
                    0.0
                });
            }
        }
        self.start = rates;
        self
    }

    /// Directions of differentiation: the numbers of a state and the parameters, one at least.
    pub fn directions(&self) -> usize {
        Layout::of(&self.base).width() + self.parameters.len().max(1)
    }

    /// What the law of a contact answers to numbers, with the derivatives of its answers; `parameters` is the axis of the
    /// first parameter.
    pub(super) fn ask<const I: usize, const O: usize>(
        &self,
        contact: usize,
        inputs: [&Dual; I],
        parameters: Option<usize>,
        relative: f64,
        answer: impl Fn(&Law, [f64; I]) -> [f64; O],
    ) -> [Dual; O] {
        let law = &self.base.contacts[contact].law;
        let values = inputs.map(|input| input.value);
        let directions = inputs[0].rates.len();
        let own = answer(law, values);
        let mut outputs: [Dual; O] = std::array::from_fn(|o| Dual::fixed(own[o], directions));
        for (i, input) in inputs.iter().enumerate() {
            if input.value.is_finite() && input.varies() {
                let step = step_of(input.value, relative);
                let slopes = slopes(&own, input.value, step, |which| {
                    let mut beside = values;
                    beside[i] += DIFFERENCE_POINTS[which] * step;
                    answer(law, beside)
                });
                for (output, slope) in outputs.iter_mut().zip(slopes) {
                    if slope != 0.0 {
                        output.shift(slope, input);
                    }
                }
            }
        }
        let directions_of = parameters.into_iter().flat_map(|first| first..);
        for (parameter, axis) in self.parameters.iter().zip(directions_of) {
            if parameter.laws[contact] {
                let slopes = slopes(&own, f64::NAN, parameter.step, |which| {
                    answer(&parameter.around[which].contacts[contact].law, values)
                });
                for (output, slope) in outputs.iter_mut().zip(slopes) {
                    output.rates[axis] += slope;
                }
            }
        }
        outputs
    }
}

/// How answers change with a number, from those beside it.
fn slopes<const O: usize>(
    own: &[f64; O],
    number: f64,
    step: f64,
    beside: impl Fn(usize) -> [f64; O],
) -> [f64; O] {
    // Most answers depend on few of the numbers: what is the same on one side as here has no slope.
    let far_up = beside(3);
    let up = number + DIFFERENCE_POINTS[3] * step;
    let (mut alone, mut slopes) = (true, [0.0; O]);
    for o in 0..O {
        if far_up[o] != own[o] {
            // What a law only remembers it hands on.
            alone &= own[o] == number && far_up[o] == up;
            slopes[o] = 1.0;
        }
    }
    if !alone {
        let around = [beside(0), beside(1), beside(2), far_up];
        for (o, slope) in slopes.iter_mut().enumerate() {
            *slope = if own[o].is_finite() {
                difference(around.map(|answers| answers[o]), step)
            } else {
                0.0
            };
        }
    }
    slopes
}
