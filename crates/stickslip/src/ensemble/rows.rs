//! Many runs of one document: a row of values for each, in the places of some of its numbers.

use serde_json::Value;

use crate::error::{Error, wrong};
use crate::model::{Model, Start};
use crate::oscillator::Oscillator;

/// A document, and what is varied in it.
#[derive(Clone, Debug)]
pub struct Rows {
    /// The document of the oscillator or system.
    pub document: Value,
    /// What is varied: paths in the document such as `forcing.0.amplitude` ([`numbers_at`]), or starts such as `x0` and `v0`.
    pub names: Vec<String>,
    /// The values, a row for each run.
    pub values: Vec<f64>,
}

impl Rows {
    /// How many runs there are.
    pub fn len(&self) -> usize {
        self.values.len() / self.names.len().max(1)
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The values of a row.
    pub fn row(&self, index: usize) -> &[f64] {
        &self.values[index * self.names.len()..][..self.names.len()]
    }

    fn named(&self, values: &[f64]) -> impl Iterator<Item = (&str, f64)> {
        self.names.iter().map(String::as_str).zip(values.iter().copied())
    }

    /// The model of the values of a row, and its start: `begin` but for what they say.
    ///
    /// # Errors
    /// A name that is no number of the document, and what makes no sense in the document.
    pub fn model(&self, values: &[f64], begin: &Start) -> Result<(Model, Start), Error> {
        self.model_beside(None, values, begin)
    }

    /// The oscillator of the document where nothing is varied but numbers of its own, none of its law, and its start.
    pub(crate) fn oscillator(&self) -> Option<Oscillator> {
        let Ok(Model::Closed(mut oscillator)) = Model::read(&self.document) else {
            return None;
        };
        let direct = self.names.iter().all(|name| {
            let number = self.document.pointer(&pointer(name));
            start_of(name).is_some()
                || number.is_some_and(Value::is_number) && own_number(&mut oscillator, name).is_some()
        });
        direct.then_some(oscillator)
    }

    /// The same, where [`Self::oscillator`] is known: to read a document for each row takes as long as a hundred events in lanes.
    pub(crate) fn model_beside(
        &self,
        oscillator: Option<&Oscillator>,
        values: &[f64],
        begin: &Start,
    ) -> Result<(Model, Start), Error> {
        let beside = oscillator.and_then(|oscillator| self.beside(oscillator, values));
        let (model, starts) = if let Some((oscillator, starts)) = beside {
            oscillator.validate()?;
            (Model::Closed(oscillator), starts)
        } else {
            let (document, starts) = self.described(values)?;
            (Model::read(&document)?, starts)
        };
        let mut start = begin.clone();
        starts.begin(&mut start, model.masses())?;
        Ok((model, start))
    }

    /// The oscillator with the values of a row; none where its motion is not in closed form, or a value has no place in a document.
    fn beside(&self, oscillator: &Oscillator, values: &[f64]) -> Option<(Oscillator, Starts<'_>)> {
        let mut oscillator = oscillator.clone();
        let mut starts = Vec::new();
        for (name, value) in self.named(values) {
            match start_of(name) {
                Some((head, mass)) => starts.push((head, mass, value)),
                None => *own_number(&mut oscillator, name).filter(|_| value.is_finite())? = value,
            }
        }
        oscillator.closed().then_some((oscillator, Starts(starts)))
    }

    /// The document of the values of a row, and what they say of its start.
    ///
    /// # Errors
    /// A name that is no number of the document.
    pub fn described(&self, values: &[f64]) -> Result<(Value, Starts<'_>), Error> {
        let mut document = self.document.clone();
        let mut starts = Vec::new();
        for (name, value) in self.named(values) {
            match start_of(name) {
                Some((head, mass)) => starts.push((head, mass, value)),
                None => {
                    for number in numbers(&mut document, name)? {
                        *number = value.into();
                    }
                }
            }
        }
        Ok((document, Starts(starts)))
    }

    /// An error with the run it belongs to.
    pub(crate) fn error(&self, index: usize, error: &Error) -> Error {
        let row: Vec<String> = self
            .named(self.row(index))
            .map(|(name, value)| format!("{name} = {value}"))
            .collect();
        Error::Document {
            reason: format!("run {index} ({}): {error}", row.join(", ")),
        }
    }
}

/// What a row says of its start: x0 or v0, the mass, and the value.
#[derive(Clone, Debug)]
pub struct Starts<'a>(Vec<(&'a str, &'a str, f64)>);

impl Starts<'_> {
    /// Put it into the start of so many masses.
    ///
    /// # Errors
    /// A mass that is not there.
    pub fn begin(self, start: &mut Start, masses: usize) -> Result<(), Error> {
        for (head, mass, value) in self.0 {
            let of = if head == "x0" { &mut start.x } else { &mut start.v };
            of.resize(masses, f64::NAN);
            let node = match mass {
                "" if masses == 1 => of.first_mut(),
                _ => mass.parse().ok().and_then(|mass: usize| of.get_mut(mass)),
            };
            *node.ok_or_else(|| Error::Document {
                reason: format!("{head} must name a mass, such as {head}.0, got {mass:?}"),
            })? = value;
        }
        Ok(())
    }
}

/// x0 or v0 and the mass, where a name is that of a start.
fn start_of(name: &str) -> Option<(&str, &str)> {
    let (head, mass) = name.split_once('.').unwrap_or((name, ""));
    matches!(head, "x0" | "v0").then_some((head, mass))
}

/// A number of an oscillator, none of its law, at a dotted path of its document.
fn own_number<'a>(oscillator: &'a mut Oscillator, path: &str) -> Option<&'a mut f64> {
    Some(match path {
        "mass" => &mut oscillator.mass,
        "stiffness" => &mut oscillator.stiffness,
        "damping" => &mut oscillator.damping,
        "drive_velocity" => &mut oscillator.drive_velocity,
        _ => {
            let (index, number) = path.strip_prefix("forcing.")?.split_once('.')?;
            let force = oscillator.forcing.get_mut(index.parse::<usize>().ok()?)?;
            match number {
                "amplitude" => &mut force.amplitude,
                "frequency" => &mut force.frequency,
                "phase" => &mut force.phase,
                _ => return None,
            }
        }
    })
}

fn pointer(path: &str) -> String {
    format!("/{}", path.replace('.', "/"))
}

/// The numbers at a dotted path of a document.
fn numbers<'a>(document: &'a mut Value, path: &str) -> Result<Vec<&'a mut Value>, Error> {
    let found = numbers_at(document, &pointer(path));
    if found.is_empty() {
        return wrong(format!("the system document has no number {path:?}"));
    }
    Ok(found)
}

/// The numbers at a place of the document of a system, such as `/law/kinetic`; none where there is no number.
///
/// `/drive_velocity` of a system of masses is that of all its contacts on a drive, where they have the same one.
pub fn numbers_at<'a>(document: &'a mut Value, pointer: &str) -> Vec<&'a mut Value> {
    if pointer != "/drive_velocity" || document.get("contacts").is_none() {
        return document
            .pointer_mut(pointer)
            .filter(|node| node.is_number())
            .into_iter()
            .collect();
    }
    let contacts = document["contacts"].as_array_mut().into_iter().flatten();
    let driven = contacts.filter(|contact| contact.get("other").is_none_or(Value::is_null));
    let speeds: Vec<_> = driven
        .filter_map(|contact| contact.get_mut("drive_velocity"))
        .collect();
    let one = speeds
        .iter()
        .all(|speed| speed.is_number() && **speed == *speeds[0]);
    if one { speeds } else { Vec::new() }
}
