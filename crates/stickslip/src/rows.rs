//! Many runs of one document: a row of values for each, in the places of some of its numbers.

use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::error::Error;
use crate::simulate::Run;
use crate::structure::Oscillator;

/// A document, and what is varied in it.
#[derive(Clone, Debug)]
pub struct Rows {
    /// The document of the oscillator or system.
    pub document: Value,
    /// What is varied: paths in the document such as `forcing.0.amplitude`, or starts such as `x0` and `v0`.
    pub names: Vec<String>,
    /// The values, a row for each run.
    pub values: Vec<f64>,
}

impl Rows {
    /// How many runs there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.values.len() / self.names.len().max(1)
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn row(&self, index: usize) -> impl Iterator<Item = (&str, f64)> {
        let values = self.values[index * self.names.len()..].iter();
        self.names.iter().map(String::as_str).zip(values.copied())
    }

    /// The oscillator or system of a row; `start` takes the values that are not of the document and says whether it did.
    ///
    /// # Errors
    /// A name that is no number of the document, and what makes no sense in the document.
    pub(crate) fn system<T: DeserializeOwned>(
        &self,
        index: usize,
        mut start: impl FnMut(&str, f64) -> bool,
    ) -> Result<T, Error> {
        let mut document = self.document.clone();
        for (name, value) in self.row(index) {
            if !start(name, value) {
                *number(&mut document, name)? = value.into();
            }
        }
        serde_json::from_value(document).map_err(|error| Error::Document {
            reason: error.to_string(),
        })
    }

    /// The oscillator of a row, and its run.
    ///
    /// # Errors
    /// As [`Rows::system`].
    pub(crate) fn oscillator(&self, index: usize, mut run: Run) -> Result<(Oscillator, Run), Error> {
        let oscillator = self.system(index, |name, value| {
            match name {
                "x0" => run.x0 = value,
                "v0" => run.v0 = Some(value),
                _ => return false,
            }
            true
        })?;
        Ok((oscillator, run))
    }

    /// An error with the run it belongs to.
    pub(crate) fn error(&self, index: usize, error: &Error) -> Error {
        let row: Vec<String> = self
            .row(index)
            .map(|(name, value)| format!("{name} = {value}"))
            .collect();
        Error::Document {
            reason: format!("run {index} ({}): {error}", row.join(", ")),
        }
    }
}

/// The number at a dotted path of a document.
fn number<'a>(document: &'a mut Value, path: &str) -> Result<&'a mut Value, Error> {
    let missing = || Error::Document {
        reason: format!("the system document has no number {path:?}"),
    };
    let pointer = format!("/{}", path.replace('.', "/"));
    let place = document.pointer_mut(&pointer).ok_or_else(missing)?;
    if place.is_number() {
        Ok(place)
    } else {
        Err(missing())
    }
}
