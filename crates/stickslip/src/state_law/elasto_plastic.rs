//! Bristles that are purely elastic at first, so that a stuck contact does not drift.

use super::{LuGre, StateFriction};
use crate::elementary::{exp, power, sin_cos};
use crate::error::Error;
use crate::law::declaration::{Limited, parameters};

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

/// Error of the bristle force that one sample may add, over the limit of steady slip.
const TOLERANCE: f64 = 1e-12;
/// Farthest that a step goes, over the distance in which the bristle force settles: beyond it the method is unstable.
const LONGEST_STEP: f64 = 2.0;
/// Nearer to the limit than this part of the yielding range all slip is plastic to the last bit, and what is left decays.
const NEAR_LIMIT: f64 = 1e-7;

/// One step of the pair of Dormand and Prince for df/ds = `slope`(f): f after it, and its error.
fn dormand_prince(slope: impl Fn(f64) -> f64, f: f64, h: f64) -> (f64, f64) {
    let a = slope(f);
    let b = slope(f + h * (a / 5.0));
    let c = slope(f + h * (3.0 / 40.0 * a + 9.0 / 40.0 * b));
    let d = slope(f + h * (44.0 / 45.0 * a - 56.0 / 15.0 * b + 32.0 / 9.0 * c));
    let e = slope(
        f + h * (19372.0 / 6561.0 * a - 25360.0 / 2187.0 * b + 64448.0 / 6561.0 * c - 212.0 / 729.0 * d),
    );
    let g = slope(
        f + h
            * (9017.0 / 3168.0 * a - 355.0 / 33.0 * b + 46732.0 / 5247.0 * c + 49.0 / 176.0 * d
                - 5103.0 / 18656.0 * e),
    );
    let end = f + h
        * (35.0 / 384.0 * a + 500.0 / 1113.0 * c + 125.0 / 192.0 * d - 2187.0 / 6784.0 * e + 11.0 / 84.0 * g);
    let error = 71.0 / 57600.0 * a - 71.0 / 16695.0 * c + 71.0 / 1920.0 * d - 17253.0 / 339_200.0 * e
        + 22.0 / 525.0 * g
        - slope(end) / 40.0;
    (end, (h * error).abs())
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

    /// Exact where the contact is elastic or the force above that of steady slip, to 1e-12 of it between.
    fn advance(&self, w: f64, z: &mut [f64], time: f64) {
        if w == 0.0 {
            return;
        }
        let limit = self.bristles.curve(w);
        // in the sense of the slip; the distance in units of force, which an elastic contact gains
        let mut f = self.bristles.stiffness * z[0] * w.signum();
        let mut left = self.bristles.stiffness * w.abs() * time;
        let elastic = left.min((self.elastic - f).max(0.0));
        f += elastic;
        left -= elastic;
        let slope = |f: f64| 1.0 - self.plastic(f, limit) * f / limit;
        let pace = 0.5 * std::f64::consts::PI / (limit - self.elastic) + 1.0 / limit;
        let mut h = 0.1 / pace;
        while left > 0.0 {
            let (short, width) = (limit - f, limit - self.elastic);
            if short < NEAR_LIMIT * width {
                f = limit - short * exp(-left / limit);
                break;
            }
            // beyond the middle of the yielding range the slope changes ever less
            let steepest = 0.5 * std::f64::consts::PI / width
                * sin_cos(std::f64::consts::PI * (short / width).min(0.5)).0;
            let step = h.min(left).min(LONGEST_STEP / (steepest + 1.0 / limit));
            let (end, error) = dormand_prince(slope, f, step);
            let allowed = TOLERANCE * limit;
            if error <= allowed {
                f = end;
                left -= step;
            }
            h = step * (0.9 * power((allowed / error.max(1e-300)).min(1e6), 0.2)).clamp(0.2, 5.0);
        }
        z[0] = f * w.signum() / self.bristles.stiffness;
    }
}

#[cfg(test)]
mod tests {
    use super::ElastoPlastic;
    use crate::law::declaration::Parameters;
    use crate::state_law::{LuGre, StateFriction, StateLaw, runge_kutta};

    #[test]
    fn the_state_goes_on_as_small_steps_have_it() {
        let bristles = LuGre {
            stiffness: 50.0,
            ..LuGre::example()
        };
        let law = ElastoPlastic {
            bristles,
            elastic: 0.5,
        };
        // from below, through the elastic range, from the yielding one, from above the limit, and to rest
        for (w, start, time) in [
            (0.2, -0.02, 0.3),
            (-0.2, 0.02, 0.5),
            (0.05, 0.015, 0.2),
            (0.4, 0.03, 0.05),
            (0.1, 0.0, 20.0),
            (0.0, 0.01, 1.0),
        ] {
            let (mut z, mut small) = ([start], start);
            law.advance(w, &mut z, time);
            for _ in 0..400_000 {
                let rate = |z: f64| {
                    let mut rate = [0.0];
                    law.rates(w, &[z], &mut rate);
                    rate[0]
                };
                small = runge_kutta(&rate, small, time / 400_000.0);
            }
            assert!(
                (z[0] - small).abs() < 1e-10 * 0.02,
                "{w} {start}: {} {small}",
                z[0]
            );
        }
    }

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
