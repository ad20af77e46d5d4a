//! A system that varies with numbers of its document, and what its laws answer to numbers that carry derivatives.

use serde_json::Value;

use super::segment::VariedMotion;
use super::state::{ContactMode, Layout, State};
use crate::dual::Dual;
use crate::error::Error;
use crate::jet::{AXES, Jet};
use crate::law::Law;
use crate::rows::numbers_at;
use crate::system::System;

/// A system that varies with numbers of its document, each a parameter.
#[derive(Clone, Debug)]
pub struct Varied {
    /// The system.
    pub base: System,
    /// What each parameter is a number of.
    pub(super) parameters: Vec<Parameter>,
    /// The law of each contact for numbers that carry derivatives.
    laws: Vec<VariedLaw>,
    /// How the numbers of the start move with them, row after row; empty where it does not move.
    pub(super) start: Vec<f64>,
}

/// What one number of a document belongs to.
#[derive(Clone, Debug)]
pub(super) enum Parameter {
    /// The law of a contact.
    Law,
    /// Anything else of the system: that two steps and one step down, one and two steps up, and the size of a step.
    System(Box<[System; 4]>, f64),
}

/// The law of a contact for numbers that carry derivatives, once for every few of the parameters that are numbers of it: with
/// which parameter each axis is. At least one axis is left each time.
type VariedLaw = Vec<(Law<Jet>, Vec<usize>)>;

/// The law at a position of a document, and the parameters that are numbers of it.
fn varied_law(own: &Law, table: &Value, position: &str, paths: &[String]) -> Result<VariedLaw, Error> {
    let mut varied = Vec::new();
    let paths = if cfg!(feature = "continuation") {
        paths
    } else {
        &[]
    };
    for (which, path) in paths.iter().enumerate() {
        let Some(path) = path.strip_prefix(position) else {
            continue;
        };
        // Another number there says which it is of those of the law.
        let mut beside = table.pointer(position).cloned().unwrap_or_default();
        let number = beside.pointer_mut(path).filter(|number| number.is_number());
        if let Some(number) = number {
            *number = (number.as_f64().unwrap_or_default() + 1.0).into();
            let beside: Law = serde_json::from_value(beside).map_err(|error| refused(&error))?;
            let at = beside
                .numbers()
                .iter()
                .zip(&own.numbers())
                .position(|(beside, own)| beside != own);
            varied.extend(at.map(|at| (at, which)));
        }
    }
    let with_axes = |varied: &[(usize, usize)]| {
        let (axes, parameters): (Vec<_>, Vec<_>) = varied.iter().copied().unzip();
        (own.along(&axes), parameters)
    };
    if varied.is_empty() {
        return Ok(vec![with_axes(&[])]);
    }
    Ok(varied.chunks(AXES - 1).map(with_axes).collect())
}

/// The position of the law of a contact in a document, up to the names of its numbers.
fn law_of(table: &Value, contact: usize) -> String {
    match table.get("contacts") {
        Some(_) => format!("/contacts/{contact}/law"),
        None => "/law".into(),
    }
}

impl Parameter {
    fn new(table: &mut Value, path: &str) -> Result<Self, Error> {
        if path.contains("/law/") {
            number_of(table, path)?;
            return Ok(Self::Law);
        }
        let (around, step) = around(table, path)?;
        Ok(Self::System(Box::new(around), step))
    }

    /// The derivative of what the systems around it answer; none by a law, of which it is not asked.
    pub(super) fn rate(&self, answer: impl Fn(&System) -> f64) -> f64 {
        match self {
            Self::Law => 0.0,
            Self::System(around, step) => difference(around.each_ref().map(answer), *step),
        }
    }
}

/// A fourth-order difference: the value two steps and one step down, one and two steps up.
pub(super) fn difference(around: [f64; 4], step: f64) -> f64 {
    let [two_down, down, up, two_up] = around;
    (8.0 * (up - down) - (two_up - two_down)) / (12.0 * step)
}

const DIFFERENCE_POINTS: [f64; 4] = [-2.0, -1.0, 1.0, 2.0];
/// A step relative to the number: its fourth power and rounding over it are both below 10⁻¹².
const RELATIVE_STEP: f64 = 1e-3;

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

/// The number at a position of a document.
fn number_of(table: &mut Value, path: &str) -> Result<f64, Error> {
    let number = numbers_at(table, path).first().and_then(|number| number.as_f64());
    number.ok_or_else(|| refused(&format!("the system document has no number {path:?}")))
}

/// The systems around that of a document, which is left as it was, and the size of a step.
fn around(table: &mut Value, path: &str) -> Result<([System; 4], f64), Error> {
    let value = number_of(table, path)?;
    let step = if value == 0.0 {
        1e-6
    } else {
        RELATIVE_STEP * value.abs()
    };
    let mut beside = |steps: f64| {
        for number in numbers_at(table, path) {
            *number = (value + steps * step).into();
        }
        let system = system_of(table)?;
        // What only makes no sense, such as a damping below zero, has a derivative all the same.
        system.check_masses().map_err(|error| {
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

impl Varied {
    /// A system, and the numbers of its document that vary, such as `/law/kinetic` of an oscillator's.
    ///
    /// # Errors
    /// What is wrong with a path, or with the systems beside this one.
    pub fn new(base: &System, document: &Value, paths: &[String]) -> Result<Self, Error> {
        if !cfg!(feature = "continuation") && !paths.is_empty() {
            return Err(refused(
                &"derivatives by numbers of a system need the feature `continuation` of the crate",
            ));
        }
        let mut table = document.clone();
        let parameters = paths.iter().map(|path| Parameter::new(&mut table, path));
        let parameters = parameters.collect::<Result<_, _>>()?;
        let laws = base.contacts.iter().enumerate();
        let laws = laws.map(|(c, contact)| varied_law(&contact.law, &table, &law_of(&table, c), paths));
        Ok(Self {
            laws: laws.collect::<Result<_, _>>()?,
            parameters,
            base: base.clone(),
            start: Vec::new(),
        })
    }

    /// The same where the motion begins as `begin` says, with what the contacts do then, so that its start moves with the
    /// parameters: a slip begins on a line of friction of its law.
    #[must_use]
    pub fn begun(mut self, contact_modes: &[ContactMode], begin: impl Fn(&System) -> State) -> Self {
        let own = begin(&self.base);
        let width = own.numbers.len();
        let mut rates = vec![0.0; width * self.parameters.len()];
        let begun = VariedMotion::new(&self).begun(&own, contact_modes);
        for (column, parameter) in self.parameters.iter().enumerate() {
            let rates = rates[column..].iter_mut().step_by(self.parameters.len());
            match parameter {
                Parameter::Law => {
                    for (rate, number) in rates.zip(&begun.numbers) {
                        *rate = number.rates[width + column];
                    }
                }
                Parameter::System(around, step) => {
                    let around = around.each_ref().map(&begin);
                    if around.iter().all(|state| state.flags == own.flags) {
                        for (i, rate) in rates.enumerate() {
                            let slope = difference(around.each_ref().map(|state| state.numbers[i]), *step);
                            *rate = if slope.is_finite() { slope } else { 0.0 };
                        }
                    }
                }
            }
        }
        self.start = rates;
        self
    }

    /// Directions of differentiation: the numbers of a state and the parameters, one at least.
    pub fn directions(&self) -> usize {
        Layout::of(&self.base).width() + self.parameters.len().max(1)
    }

    /// The law of a contact with some of its numbers as axes, and of which parameter each axis is.
    pub(super) fn laws_along(&self, contact: usize) -> &VariedLaw {
        &self.laws[contact]
    }

    /// What the law of a contact answers to numbers goes to `outputs`, with its derivatives; `parameters` is the axis of the
    /// first parameter.
    pub(super) fn ask<const I: usize, const O: usize>(
        &self,
        contact: usize,
        inputs: [&Dual; I],
        parameters: Option<usize>,
        outputs: &mut [Dual],
        mut answer: impl FnMut(&Law<Jet>, [Jet; I]) -> [Jet; O],
    ) {
        let mut varying = (0..I)
            .filter(|&i| inputs[i].value.is_finite() && inputs[i].varies())
            .peekable();
        let laws = &self.laws[contact];
        let last = laws.len() - 1;
        // Without directions for parameters the last one serves, of which their axes are then not read.
        let mut next = if parameters.is_some() { 0 } else { last };
        let mut first = parameters;
        for output in &mut *outputs {
            output.rates.fill(0.0);
        }
        loop {
            let (law, own) = &laws[next];
            let mut jets = inputs.map(|input| Jet::from(input.value));
            let mut along = [0; AXES];
            let mut used = own.len();
            while used < AXES
                && let Some(input) = varying.next()
            {
                jets[input].slopes[used] = 1.0;
                along[used] = input;
                used += 1;
            }
            for (output, jet) in outputs.iter_mut().zip(answer(law, jets)) {
                output.value = jet.value;
                if !jet.value.is_finite() {
                    continue;
                }
                if let Some(first) = first {
                    for (which, slope) in own.iter().zip(jet.slopes) {
                        output.rates[first + which] += slope;
                    }
                }
                for axis in own.len()..used {
                    if jet.slopes[axis] != 0.0 {
                        output.shift(jet.slopes[axis], inputs[along[axis]]);
                    }
                }
            }
            if next < last {
                next += 1;
            } else if varying.peek().is_some() {
                first = None;
            } else {
                return;
            }
        }
    }
}
