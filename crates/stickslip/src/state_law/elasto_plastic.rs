//! Bristles that are purely elastic at first, so that a stuck contact does not drift.

use super::{LuGre, StateFriction};
use crate::elementary::sin_cos;
use crate::error::Error;
use crate::parameters::{Limited, parameters};

parameters! {
    /// ż = w (1 − α(z, w) z/z∞(w)), F = σ₀ z + σ₁ ż + σ₂ w, z∞ = g(w) sgn w/σ₀, g as for [`super::LuGre`].
    ///
    /// α = 0 where |z| ≤ z_e or z and w differ in sign, 1 where |z| ≥ |z∞|, and ½ + ½ sin π (|z| − (|z∞| + z_e)/2)/(|z∞| − z_e)
    /// between. Dupont, Hayward, Armstrong & Altpeter, IEEE Trans. Automatic Control 47 (2002) 787.
    pub struct ElastoPlastic {
        /// The bristles, whose parameters stand beside `elastic` in a document.
        #[serde(flatten)]
        pub bristles: LuGre = LuGre::example() => [],
        /// The force up to which the contact is purely elastic, σ₀ z_e.
        pub elastic: f64 = 0.8 => [FORCE.not_negative()],
    }
}

impl ElastoPlastic {
    /// α for a bristle force σ₀ |z|.
    fn plastic(&self, force: f64, static_limit: f64) -> f64 {
        if force <= self.elastic {
            0.0
        } else if force >= static_limit {
            1.0
        } else {
            let middle = 0.5 * (static_limit + self.elastic);
            0.5 + 0.5 * sin_cos(std::f64::consts::PI * (force - middle) / (static_limit - self.elastic)).0
        }
    }
}

impl StateFriction for ElastoPlastic {
    fn validate(&self) -> Result<(), Error> {
        self.within_limits()?;
        let weakest = self.bristles.kinetic.min(self.bristles.break_away);
        if self.elastic >= weakest {
            return Err(Error::ElasticBeyondSlip {
                elastic: self.elastic,
                weakest,
            });
        }
        Ok(())
    }

    fn rates(&self, w: f64, z: &[f64], rates: &mut [f64]) -> f64 {
        let z = z[0];
        let static_limit = self.bristles.curve(w);
        let force = self.bristles.stiffness * z;
        let yielding = if z * w > 0.0 {
            self.plastic(force.abs(), static_limit)
        } else {
            0.0
        };
        rates[0] = w * (1.0 - yielding * force.abs() / static_limit);
        force + self.bristles.damping * rates[0] + self.bristles.viscous * w
    }

    fn steady(&self, w: f64, z: &mut [f64]) {
        self.bristles.steady(w, z);
    }

    fn pace(&self, w: f64) -> f64 {
        let static_limit = self.bristles.curve(w);
        let slope = 0.5 * std::f64::consts::PI / (static_limit - self.elastic) + 1.0 / static_limit;
        self.bristles.stiffness * w.abs() * slope
    }
}

#[cfg(test)]
mod tests {
    use crate::state_law::StateLaw;

    #[test]
    fn the_bristles_of_a_document_stand_beside_it_and_nothing_else_does() {
        let document = r#"{"type": "ElastoPlastic", "stiffness": 1e5, "damping": 316.0, "viscous": 0.4, "kinetic": 1.0,
            "break_away": 1.5, "scale": 1e-3, "elastic": 0.9}"#;
        let law: StateLaw = serde_json::from_str(document).unwrap();
        let again = serde_json::to_string(&law).unwrap();
        assert_eq!(serde_json::from_str::<StateLaw>(&again).unwrap(), law);
        let other = document.replace("0.9}", "0.9, \"elastik\": 1.0}");
        assert!(serde_json::from_str::<StateLaw>(&other).is_err());
    }
}
