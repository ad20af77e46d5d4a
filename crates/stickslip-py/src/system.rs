//! What moves, read from its document once: whoever asks something of it, again and again, hands over the same object.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use serde::de::DeserializeOwned;
use serde_json::Value;
use stickslip::law::{Checked, Law};
use stickslip::model::Model;
use stickslip::oscillator::Oscillator;
use stickslip::rows::numbers_at;
use stickslip::state_law::StateLaw;
use stickslip::system;

use crate::refused;

/// An oscillator or a system of masses, checked.
#[pyclass(frozen, module = "stickslip._core")]
pub(crate) struct System {
    document: Value,
    /// It as masses, and the oscillator it may be; not under laws with an internal state, which an integrator reads itself.
    adhesion: Option<(system::System, Option<Oscillator>)>,
}

/// The masses of a document, and the oscillator it may be, checked.
fn read<L: Checked + Clone + DeserializeOwned>(
    document: &Value,
) -> PyResult<(system::System<L>, Option<Oscillator<L>>)> {
    let (system, oscillator) = system::System::read(document).map_err(refused)?;
    // As an oscillator it may say more of what is wrong.
    let check = oscillator.as_ref().map_or(Ok(()), Oscillator::validate);
    check.and_then(|()| system.validate()).map_err(refused)?;
    Ok((system, oscillator))
}

impl System {
    fn of(document: Value) -> PyResult<Self> {
        let adhesion = if StateLaw::in_document(&document) {
            read::<StateLaw>(&document)?;
            None
        } else {
            let (system, oscillator) = read::<Law>(&document)?;
            let whole = oscillator.filter(|oscillator| system::System::from(oscillator) == system);
            Some((system, whole))
        };
        Ok(Self { document, adhesion })
    }

    pub(crate) fn document(&self) -> &Value {
        &self.document
    }

    /// As a system of masses, and as the oscillator it may be.
    pub(crate) fn masses(&self) -> PyResult<(&system::System, Option<&Oscillator>)> {
        match &self.adhesion {
            Some((system, oscillator)) => Ok((system, oscillator.as_ref())),
            None => Err(PyValueError::new_err(
                "a law with an internal state has no events",
            )),
        }
    }

    pub(crate) fn model(&self) -> PyResult<Model> {
        let (system, oscillator) = self.masses()?;
        Ok(match oscillator {
            Some(oscillator) if oscillator.closed() => Model::Closed(oscillator.clone()),
            _ => Model::Steps(system.clone()),
        })
    }
}

#[pymethods]
impl System {
    #[new]
    fn new(document: &str) -> PyResult<Self> {
        Self::of(crate::read(document)?)
    }

    /// The number at a place such as `/law/kinetic`.
    fn number(&self, path: &str) -> Option<f64> {
        numbers_at(&mut self.document.clone(), path).first()?.as_f64()
    }

    /// The same with another number at a place.
    fn with_number(&self, path: &str, value: f64) -> PyResult<Self> {
        let mut document = self.document.clone();
        let numbers = numbers_at(&mut document, path);
        if numbers.is_empty() {
            return Err(PyValueError::new_err(format!("the system has no number {path}")));
        }
        for number in numbers {
            *number = value.into();
        }
        Self::of(document)
    }

    /// Whether a forcing of an oscillator meets a resonance at which the closed form would lose digits.
    fn resonates(&self) -> bool {
        matches!(&self.adhesion, Some((_, Some(oscillator))) if oscillator.resonates())
    }
}
