//! An oscillator that varies with one number of its document, and what its law answers to numbers that carry derivatives.

use serde_json::Value;

use super::state::LANES;
use crate::dual::Dual;
use crate::error::Error;
use crate::law::{Friction, Law};
use crate::series::{Grown, ZERO};
use crate::structure::Oscillator;

/// An oscillator that varies with one number of its document.
#[derive(Clone, Debug)]
pub struct Varied {
    /// The oscillator.
    pub base: Oscillator,
    /// The same two steps and one step down, one and two steps up, and the size of a step.
    around: Option<([Oscillator; 4], f64)>,
}

/// A fourth-order difference: the value two steps and one step down, one and two steps up.
fn difference(around: [f64; 4], step: f64) -> f64 {
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

impl Varied {
    /// Of a document; `path` names the number that varies, such as `/law/kinetic`.
    ///
    /// # Errors
    /// What is wrong with the document or the path.
    pub fn new(document: &str, path: Option<&str>) -> Result<Self, Error> {
        let base = Oscillator::from_json(document)?;
        let Some(path) = path else {
            return Ok(Self { base, around: None });
        };
        let refused = |reason: String| Error::Document { reason };
        let mut table: Value = serde_json::from_str(document).map_err(|error| refused(error.to_string()))?;
        let number = table.pointer(path).and_then(Value::as_f64);
        let value = number.ok_or_else(|| refused(format!("the system document has no number {path:?}")))?;
        let step = step_of(value, RELATIVE_STEP);
        let mut beside = |steps: f64| {
            if let Some(place) = table.pointer_mut(path) {
                *place = (value + steps * step).into();
            }
            serde_json::from_value::<Oscillator>(table.clone()).map_err(|error| refused(error.to_string()))
        };
        let around = [
            beside(STEPS[0])?,
            beside(STEPS[1])?,
            beside(STEPS[2])?,
            beside(STEPS[3])?,
        ];
        Ok(Self {
            base,
            around: Some((around, step)),
        })
    }

    /// A number of the oscillator and its derivative with respect to the parameter, in the last lane.
    pub(super) fn number<const N: usize>(&self, of: impl Fn(&Oscillator) -> f64) -> Dual<N> {
        let mut number = Dual::fixed(of(&self.base));
        if let (Some((around, step)), LANES) = (&self.around, N) {
            number.rates[N - 1] = difference(std::array::from_fn(|i| of(&around[i])), *step);
        }
        number
    }

    /// What the law answers to numbers, with the derivatives of its answers.
    pub(super) fn ask<const N: usize, const I: usize, const O: usize>(
        &self,
        inputs: [Dual<N>; I],
        relative: f64,
        answer: impl Fn(&Law, [f64; I]) -> [f64; O],
    ) -> [Dual<N>; O] {
        let values = inputs.map(|input| input.value);
        let mut outputs = answer(&self.base.law, values).map(Dual::fixed);
        let spread = |outputs: &mut [Dual<N>; O], around: [[f64; O]; 4], step: f64, rates: &[f64; N]| {
            for (o, output) in outputs.iter_mut().enumerate() {
                if output.value.is_finite() {
                    let slope = difference(around.map(|answers| answers[o]), step);
                    for (rate, along) in output.rates.iter_mut().zip(rates) {
                        *rate += slope * along;
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
                    answer(&self.base.law, beside)
                });
                spread(&mut outputs, around, step, &input.rates);
            }
        }
        if let (Some((around, step)), LANES) = (&self.around, N) {
            let around = std::array::from_fn(|i| answer(&around[i].law, values));
            let mut along = [0.0; N];
            along[N - 1] = 1.0;
            spread(&mut outputs, around, *step, &along);
        }
        outputs
    }

    /// Friction of a smooth law at slip speed `u`.
    pub(super) fn smooth_force<const N: usize>(&self, u: Dual<N>) -> Dual<N> {
        let at = |law: &Law| {
            let mut series = ZERO;
            (series[0], series[1]) = (u.value, 1.0);
            let mut grown = Grown::default();
            [
                law.extend(&series, 0, &mut grown),
                law.extend(&series, 1, &mut grown),
            ]
        };
        let [value, slope] = at(&self.base.law);
        let mut force = u.chain(value, slope);
        if let (Some((around, step)), LANES) = (&self.around, N) {
            force.rates[N - 1] += difference(std::array::from_fn(|i| at(&around[i].law)[0]), *step);
        }
        force
    }
}
