//! A memoryless law whose sign is smoothed: what other codes call friction, offered under its name.

use super::StateFriction;
use crate::elementary::{atan, tanh};
use crate::error::Error;
use crate::law::declaration::{Limited, parameters, words};
use crate::law::{Friction, Law, Memory, Rational};

words! {
    /// The smooth sign.
    pub enum Shape {
        /// (2/π) arctan(w/width).
        #[default]
        Arctan = "arctan",
        /// tanh(w/width).
        Tanh = "tanh",
    }
}

parameters! {
    /// F = s(w/width) f(|w|) with the kinetic force f of a memoryless law. It creeps where the law itself would stick.
    pub struct Regularised {
        /// The law whose kinetic force is used.
        pub law: Law = Rational::example().into() => [],
        /// Slip velocity over which the sign changes.
        pub width: f64 = 0.05 => [VELOCITY.positive()],
        /// The smooth sign.
        #[serde(default)]
        pub shape: Shape = Shape::Arctan => [],
    }
}

impl StateFriction for Regularised {
    fn validate(&self) -> Result<(), Error> {
        self.within_limits()?;
        let reverses = |direction: f64| {
            let law = self.law.toward(direction);
            law.begin(0.0, f64::INFINITY, &mut Memory::default()).reverses
        };
        if reverses(1.0) || reverses(-1.0) || self.law.feels_force_rate() || self.law.growth_bound(0.0) > 0.0
        {
            return Err(Error::Remembers);
        }
        Ok(())
    }

    fn has_state(&self) -> bool {
        false
    }

    fn rates(&self, w: f64, _z: &[f64], rates: &mut [f64]) -> f64 {
        rates.fill(0.0);
        let (u, law) = (w.abs(), self.law.toward(w));
        let piece = law.begin(u, f64::INFINITY, &mut Memory::default());
        let sign = match self.shape {
            Shape::Arctan => std::f64::consts::FRAC_2_PI * atan(w / self.width),
            Shape::Tanh => tanh(w / self.width),
        };
        sign * law.force(&piece, u)
    }

    fn steady(&self, _w: f64, z: &mut [f64]) {
        z.fill(0.0);
    }

    fn advance(&self, _w: f64, _z: &mut [f64], _time: f64) {}
}
