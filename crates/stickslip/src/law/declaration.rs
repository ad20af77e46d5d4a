//! How a law declares what is known of its parameters, once, for whoever checks, fits, scales or shows it. The declaration itself,
//! with the unit of each parameter, stands in the file of the law (`coulomb.rs`: `kinetic … => [FORCE.not_negative()]`).
//!
//! The macro `parameters!` makes of one declaration the struct, its document, the check of its limits, an example and the table
//! [`Parameters::PARAMETERS`].

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value as Document};

use crate::error::{Error, finite, not_negative, positive};
use crate::law::{Law, Point};
use crate::scalar::Scalar;

/// What a number must be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Limits {
    /// Any finite number.
    Finite,
    /// Finite and at least 0.
    NotNegative,
    /// Finite and greater than 0.
    Positive,
}

impl Limits {
    /// Those of the last number of a parameter, which is the value where that is a pair.
    pub(crate) const fn of(numbers: &[Number]) -> Self {
        match numbers {
            [.., last] => last.limits,
            [] => Self::Finite,
        }
    }

    pub(crate) fn check(self, name: &'static str, value: f64) -> Result<(), Error> {
        match self {
            Self::Finite => finite(name, value),
            Self::NotNegative => not_negative(name, value),
            Self::Positive => positive(name, value),
        }
        .map(drop)
    }
}

/// One number of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Number {
    /// Its name within a pair, such as `w` of a point.
    pub part: &'static str,
    /// Words such as `force` or `force velocity^-1`; nothing for a pure number.
    pub dimension: &'static str,
    /// What it must be.
    pub limits: Limits,
    /// Between which values it is searched when it is fitted.
    pub search: [f64; 2],
    /// Whether it is known by its ratio, so that its interval is symmetric in the logarithm.
    pub ratio: bool,
    /// The only values it may have, where it chooses a form of the law; it is then never fitted.
    pub choices: &'static [f64],
}

/// What numbers of laws are, as a rule.
pub(crate) mod numbers {
    pub(crate) use super::Number;

    /// A number without a dimension.
    pub(crate) const PURE: Number = Number::of("");
    /// A force.
    pub(crate) const FORCE: Number = Number::of("force");
    /// A velocity.
    pub(crate) const VELOCITY: Number = Number::of("velocity");
    /// The rate of growth with rest.
    pub(crate) const RATE: Number = Number::of("time^-exponent").positive().ratio();
    /// A force rate at which something is halved.
    pub(crate) const FORCE_RATE: Number = Number::of("force time^-1").positive().ratio();
    /// An exponent of rest or speed.
    pub(crate) const EXPONENT: Number = PURE.positive().search(0.05, 3.0);
    /// An angle in degrees, of a line in the plane of force over velocity.
    pub(crate) const ANGLE: Number = Number::of("angle");
    /// The first number of a point of the characteristic.
    pub(crate) const W: Number = VELOCITY.part("w");
    /// The second of them.
    pub(crate) const F: Number = FORCE.part("f");
    /// The first number of a node of the characteristic.
    pub(crate) const SLIP_VELOCITY: Number = VELOCITY.part("slip_velocity").search(0.0, f64::INFINITY);
    /// The first of a node over the time at rest.
    pub(crate) const STICK_TIME: Number = Number::of("time").part("stick_time").search(0.0, f64::INFINITY);
    /// The second of a node.
    pub(crate) const NODE_FORCE: Number = FORCE.part("force");
}

impl Number {
    /// Any finite number of a dimension.
    pub(crate) const fn of(dimension: &'static str) -> Self {
        Self {
            part: "",
            dimension,
            limits: Limits::Finite,
            search: [f64::NEG_INFINITY, f64::INFINITY],
            ratio: false,
            choices: &[],
        }
    }

    pub(crate) const fn part(self, part: &'static str) -> Self {
        Self { part, ..self }
    }

    pub(crate) const fn not_negative(self) -> Self {
        let limits = Limits::NotNegative;
        Self { limits, ..self }.search(0.0, f64::INFINITY)
    }

    pub(crate) const fn positive(self) -> Self {
        let limits = Limits::Positive;
        Self { limits, ..self }.search(0.0, f64::INFINITY)
    }

    pub(crate) const fn search(self, low: f64, high: f64) -> Self {
        let search = [low, high];
        Self { search, ..self }
    }

    pub(crate) const fn ratio(self) -> Self {
        Self { ratio: true, ..self }
    }

    pub(crate) const fn choices(self, choices: &'static [f64]) -> Self {
        Self { choices, ..self }
    }
}

/// What a parameter is made of.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum Kind {
    /// One number.
    Number,
    /// Two numbers.
    Point,
    /// A list of points.
    Nodes,
    /// One number, or a list of points.
    NumberOrNodes,
    /// One of these words.
    Words(&'static [&'static str]),
    /// A table of further parameters.
    Table(&'static [Parameter]),
    /// Parameters that stand beside the others in a document.
    Beside(&'static [Parameter]),
    /// A law of its own.
    Law,
}

/// A parameter of a law.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Parameter {
    /// Its name in documents.
    pub name: &'static str,
    /// What it is made of.
    pub kind: Kind,
    /// Its numbers: none, one or the two of a pair, of which a single value is the second.
    pub numbers: &'static [Number],
}

/// What a parameter may be.
pub(crate) trait Value {
    const KIND: Kind;

    /// Check it against its numbers.
    fn check(&self, name: &'static str, limits: Limits) -> Result<(), Error>;
}

impl<N: Scalar> Value for N {
    const KIND: Kind = Kind::Number;

    fn check(&self, name: &'static str, limits: Limits) -> Result<(), Error> {
        limits.check(name, self.value())
    }
}

impl<N: Scalar> Value for Point<N> {
    const KIND: Kind = Kind::Point;

    fn check(&self, name: &'static str, limits: Limits) -> Result<(), Error> {
        finite(name, self[0].value())?;
        limits.check(name, self[1].value())
    }
}

impl<N: Scalar> Value for Box<Law<N>> {
    const KIND: Kind = Kind::Law;

    fn check(&self, name: &'static str, limits: Limits) -> Result<(), Error> {
        (**self).check(name, limits)
    }
}

impl<T: Value> Value for Option<T> {
    const KIND: Kind = T::KIND;

    fn check(&self, name: &'static str, limits: Limits) -> Result<(), Error> {
        self.as_ref().map_or(Ok(()), |value| value.check(name, limits))
    }
}

/// What can be made of other numbers instead.
pub trait Over<M> {
    /// What it is then.
    type Of;

    /// The same where `of` says for each number, in the order of the declaration, what stands in its place.
    fn over(&self, of: &mut dyn FnMut(f64) -> M) -> Self::Of;
}

impl<M> Over<M> for f64 {
    type Of = M;

    fn over(&self, of: &mut dyn FnMut(f64) -> M) -> M {
        of(*self)
    }
}

impl<M, T: Over<M>> Over<M> for [T; 2] {
    type Of = [T::Of; 2];

    fn over(&self, of: &mut dyn FnMut(f64) -> M) -> Self::Of {
        self.each_ref().map(|part| part.over(of))
    }
}

impl<M, T: Over<M>> Over<M> for Option<T> {
    type Of = Option<T::Of>;

    fn over(&self, of: &mut dyn FnMut(f64) -> M) -> Self::Of {
        self.as_ref().map(|part| part.over(of))
    }
}

impl<M, T: Over<M>> Over<M> for Vec<T> {
    type Of = Vec<T::Of>;

    fn over(&self, of: &mut dyn FnMut(f64) -> M) -> Self::Of {
        self.iter().map(|part| part.over(of)).collect()
    }
}

impl<M, T: Over<M>> Over<M> for Box<T> {
    type Of = Box<T::Of>;

    fn over(&self, of: &mut dyn FnMut(f64) -> M) -> Self::Of {
        Box::new((**self).over(of))
    }
}

/// The declared parameters of a law, or of a table within one.
pub trait Parameters: Sized {
    /// What they are, in the order of the document.
    const PARAMETERS: &'static [Parameter];

    /// Plain dimensionless numbers; where there is one, the set of the law's source.
    #[must_use]
    fn example() -> Self;
}

/// What has parameters with limits of their own.
pub trait Limited {
    /// Check each parameter against its own limits.
    ///
    /// # Errors
    /// The first that is outside.
    fn within_limits(&self) -> Result<(), Error>;
}

/// What is known of a law.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Facts {
    /// Its name, the `type` of its documents.
    pub name: &'static str,
    /// Its parameters.
    pub parameters: &'static [Parameter],
    /// The document of its example, without the type.
    pub example: Document,
    /// The parameters that a document may leave out, with the value they have then.
    pub defaults: Map<String, Document>,
    /// Whether kinetic friction is one smooth curve instead of linear pieces.
    pub smooth: bool,
}

impl Facts {
    pub(crate) fn of<L: Parameters + Serialize + DeserializeOwned>(
        name: &'static str,
        smooth: impl Fn(&L) -> bool,
    ) -> Self {
        let law = L::example();
        let example = serde_json::to_value(&law).unwrap_or_default();
        // What the reader of documents fills in, tried on the example.
        let left_out = |key: &String| {
            let mut document = example.clone();
            document.as_object_mut()?.remove(key);
            let read: L = serde_json::from_value(document).ok()?;
            Some((key.clone(), serde_json::to_value(read).ok()?.get(key)?.clone()))
        };
        let keys = example.as_object().into_iter().flat_map(Map::keys);
        let defaults = keys.filter_map(left_out).collect();
        Self {
            name,
            parameters: L::PARAMETERS,
            defaults,
            smooth: smooth(&law),
            example,
        }
    }
}

/// Declare the parameters of a law: `name: type = example => [its numbers]`; `as "other"` where a document has another name.
macro_rules! parameters {
    // Of a law for any number type.
    ($(#[$about:meta])* pub struct $law:ident<N> { $($fields:tt)* }) => {
        parameters! {
            for N:
            $(#[$about])*
            #[serde(bound(deserialize = "N: crate::scalar::Scalar + serde::de::DeserializeOwned"))]
            pub struct $law { $($fields)* }
        }
        parameters! { of other numbers $law { $($fields)* } }
    };
    (of other numbers $law:ident {
        $($(#[$meta:meta])* pub $field:ident: $type:ty $(as $name:literal)? = $example:expr => [$($number:expr),*]),+ $(,)?
    }) => {
        impl<M> $crate::law::declaration::Over<M> for $law {
            type Of = $law<M>;

            fn over(&self, of: &mut dyn FnMut(f64) -> M) -> $law<M> {
                $law { $($field: $crate::law::declaration::Over::over(&self.$field, of)),+ }
            }
        }
    };
    ($(for $N:ident:)? $(#[$about:meta])* pub struct $law:ident {
        $($(#[$meta:meta])* pub $field:ident: $type:ty $(as $name:literal)? = $example:expr => [$($number:expr),*]),+ $(,)?
    }) => {
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        $(#[$about])*
        pub struct $law $(<$N = f64>)? { $($(#[$meta])* $(#[serde(rename = $name)])? pub $field: $type),+ }

        impl $crate::law::declaration::Parameters for $law {
            const PARAMETERS: &'static [$crate::law::declaration::Parameter] = {
                #[allow(unused_imports, reason = "a law that is made of laws has no numbers")]
                use $crate::law::declaration::numbers::*;
                $(type $N = f64;)?
                &[$($crate::law::declaration::Parameter {
                    name: [$($name,)? stringify!($field)][0],
                    kind: <$type as $crate::law::declaration::Value>::KIND,
                    numbers: &[$($number),*],
                }),+]
            };

            fn example() -> Self { Self { $($field: $example),+ } }
        }

        impl $(<$N>)? $law $(<$N>)? {
            /// From its parameters, in their order here.
            #[must_use]
            #[allow(clippy::too_many_arguments, reason = "a law has as many parameters as its source gives it")]
            pub fn new($($field: $type),+) -> Self { Self { $($field),+ } }
        }

        impl $(<$N: $crate::scalar::Scalar>)? $crate::law::declaration::Limited for $law $(<$N>)? {
            fn within_limits(&self) -> Result<(), $crate::error::Error> {
                #[allow(unused_imports, reason = "a law that is made of laws has no numbers")]
                use $crate::law::declaration::numbers::*;
                $($crate::law::declaration::Value::check(&self.$field, [$($name,)? stringify!($field)][0], const {
                    $crate::law::declaration::Limits::of(&[$($number),*])
                })?;)+
                Ok(())
            }
        }
    };
}

/// Declare the words that a parameter may be.
macro_rules! words {
    ($(#[$about:meta])* pub enum $name:ident { $($(#[$meta:meta])* $word:ident = $text:literal),+ $(,)? }) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
        pub enum $name { $($(#[$meta])* #[serde(rename = $text)] $word),+ }

        impl<M> $crate::law::declaration::Over<M> for $name {
            type Of = Self;

            fn over(&self, _of: &mut dyn FnMut(f64) -> M) -> Self { *self }
        }

        impl $crate::law::declaration::Value for $name {
            const KIND: $crate::law::declaration::Kind = $crate::law::declaration::Kind::Words(&[$($text),+]);

            fn check(&self, _name: &'static str, _limits: $crate::law::declaration::Limits) -> Result<(), $crate::error::Error> {
                Ok(())
            }
        }
    };
}

pub(crate) use {parameters, words};
