//! Forces that are no linear function of the state: curved laws, lines under a normal force that varies, cubic springs.

use crate::law::{Law, Line};
use crate::matrix::{Row, dot};
use crate::number::Real;

/// A force that is no linear function of the state.
#[derive(Clone, Debug)]
pub(super) struct Curve<'a, R> {
    /// Its contact; none: it is of a spring.
    pub(super) contact: Option<usize>,
    /// Which number of the state it is.
    pub(super) at: usize,
    /// What it depends on: a slip velocity or a displacement.
    pub(super) along: Row<R>,
    pub(super) shape: Shape<'a>,
    /// The normal force that it is multiplied with.
    pub(super) load: Option<Row<R>>,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Shape<'a> {
    Law(f64, &'a Law),
    Line(f64, Line),
    Cubic(f64),
}

impl Shape<'_> {
    pub(super) fn force<R: Real>(self, s: R) -> R {
        match self {
            Self::Law(direction, law) => R::of(direction * law.curve(direction * s.value())[0]),
            Self::Line(direction, line) => {
                let [u, force] = line.point.map(R::of);
                R::of(line.slope) * (s - R::of(direction) * u) + R::of(direction) * force
            }
            Self::Cubic(cubic) => R::of(-cubic) * s * s * s,
        }
    }

    /// Whether it has corners at which no event lies.
    pub(super) fn cornered(self) -> bool {
        matches!(self, Self::Law(_, law) if law.cornered())
    }

    pub(super) fn slope(self, s: f64) -> f64 {
        match self {
            Self::Law(direction, law) => law.curve(direction * s)[1],
            Self::Line(_, line) => line.slope,
            Self::Cubic(cubic) => -3.0 * cubic * s * s,
        }
    }
}

impl<R: Real> Curve<'_, R> {
    pub(super) fn force(&self, y: &[R]) -> R {
        let force = self.shape.force(dot(&self.along, y));
        self.load.as_ref().map_or(force, |load| dot(load, y) * force)
    }

    /// d/dt of it.
    pub(super) fn rate(&self, y: &[R], rates: &[R]) -> R {
        let s = dot(&self.along, y);
        let rate = R::of(self.shape.slope(s.value())) * dot(&self.along, rates);
        self.load.as_ref().map_or(rate, |load| {
            dot(load, y) * rate + dot(load, rates) * self.shape.force(s)
        })
    }
}
