//! What moves, read from its document once: whoever asks something of it, again and again, hands over the same object.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use serde_json::Value;
use stickslip::error::Error;
use stickslip::model::Model;
use stickslip::state_law::StateLaw;
use stickslip::structure::Oscillator;
use stickslip::system;

use crate::refused;

/// An oscillator or a system of masses, checked.
#[pyclass(frozen, module = "stickslip._core")]
pub(crate) struct System {
    document: Value,
    /// It as masses, and the oscillator it may be; not under laws with an internal state, which an integrator reads itself.
    adhesion: Option<(system::System, Option<Oscillator>)>,
}

fn from<T: serde::de::DeserializeOwned>(document: &Value) -> PyResult<T> {
    T::deserialize(document).map_err(|error| PyValueError::new_err(error.to_string()))
}

fn checked<T>(value: T, check: impl Fn(&T) -> Result<(), Error>) -> PyResult<T> {
    check(&value).map(|()| value).map_err(|error| refused(&error))
}

impl System {
    fn of(document: Value) -> PyResult<Self> {
        let many = document.get("contacts").is_some();
        let adhesion = match (has_state(&document), many) {
            (true, true) => checked(from(&document)?, system::System::<StateLaw>::validate).map(|_| None),
            (true, false) => checked(from(&document)?, Oscillator::<StateLaw>::validate).map(|_| None),
            (false, true) => {
                checked(from(&document)?, system::System::validate).map(|system| Some((system, None)))
            }
            (false, false) => {
                let oscillator = checked(from(&document)?, Oscillator::validate)?;
                Ok(Some((system::System::from(&oscillator), Some(oscillator))))
            }
        }?;
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
        Model::read(self.document.clone()).map_err(|error| refused(&error))
    }
}

#[pymethods]
impl System {
    #[new]
    fn new(document: &str) -> PyResult<Self> {
        let document = serde_json::from_str(document);
        Self::of(document.map_err(|error| PyValueError::new_err(error.to_string()))?)
    }

    /// The number at a place such as `/law/kinetic`.
    fn number(&self, path: &str) -> Option<f64> {
        self.document.pointer(path)?.as_f64()
    }

    /// The same with another number at a place.
    fn with_number(&self, path: &str, value: f64) -> PyResult<Self> {
        let mut document = self.document.clone();
        match document.pointer_mut(path) {
            Some(place) => *place = value.into(),
            None => return Err(PyValueError::new_err(format!("the system has no number {path}"))),
        }
        Self::of(document)
    }

    /// Whether a forcing of an oscillator meets a resonance at which the closed form would lose digits.
    fn resonates(&self) -> bool {
        matches!(&self.adhesion, Some((_, Some(oscillator))) if oscillator.resonates())
    }
}

/// Whether the law of a document, or of the oscillator or system in it, has an internal state.
pub(crate) fn has_state(document: &Value) -> bool {
    let named = |law: &Value| {
        law["type"]
            .as_str()
            .is_some_and(|name| StateLaw::NAMES.contains(&name))
    };
    let contacts = document["contacts"].as_array();
    named(document)
        || named(&document["law"])
        || contacts.is_some_and(|contacts| contacts.iter().any(|contact| named(&contact["law"])))
}
