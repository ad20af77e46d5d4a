//! Friction laws with an internal state: no adhesion, no modes, one smooth (and stiff) equation for all times.
//!
//! A law here says how much force slip at velocity w and state z produces, and how fast z changes. The state is one number, of
//! some laws two.
//! The motion is integrated ([`crate::rosenbrock`], or by scipy's solvers in Python), as an orbit of these laws is no closed form.

mod bouc_wen;
mod dahl;
mod elasto_plastic;
mod lu_gre;
mod rate_state;
mod regularised;

use serde::{Deserialize, Serialize};
use serde_json::Value;

pub use bouc_wen::BoucWen;
pub use dahl::Dahl;
pub use elasto_plastic::ElastoPlastic;
pub use lu_gre::LuGre;
pub use rate_state::{Evolution, RateState};
pub use regularised::{Regularised, Shape};

use crate::error::{Error, wrong};
use crate::law::Checked;
use crate::law::declaration::{Facts, Limited};

impl StateLaw {
    /// Whether the law of a document, or of the oscillator or system in it, has an internal state.
    ///
    /// ```
    /// use serde_json::json;
    /// use stickslip::state_law::StateLaw;
    /// assert!(StateLaw::in_document(&json!({ "contacts": [{ "law": { "type": "Dahl" } }] })));
    /// assert!(!StateLaw::in_document(&json!({ "law": { "type": "Coulomb" } })));
    /// ```
    pub fn in_document(document: &Value) -> bool {
        let named = |law: &Value| {
            law["type"]
                .as_str()
                .is_some_and(|name| Self::NAMES.contains(&name))
        };
        let contacts = document["contacts"].as_array();
        named(document)
            || named(&document["law"])
            || contacts.is_some_and(|contacts| contacts.iter().any(|contact| named(&contact["law"])))
    }
}

impl Checked for StateLaw {
    fn check(&self) -> Result<(), Error> {
        self.validate()
    }

    /// A bristle or a state of the surface is as it is under any load.
    fn check_scaled(&self) -> Result<(), Error> {
        Ok(())
    }

    fn balances_load(&self) -> bool {
        self.direct_effect() > 0.0
    }
}

/// The answers every law with a state gives. To add one: a file with this trait, one line in [`StateLaw`], and the same in
/// Python.
pub trait StateFriction: Limited {
    /// Check the parameters, by their own limits and, where a law says more, together.
    ///
    /// # Errors
    /// The first parameter that makes no sense.
    fn validate(&self) -> Result<(), Error> {
        self.within_limits()
    }

    /// Whether there is a state; without one it stays at 0.
    fn has_state(&self) -> bool {
        true
    }

    /// How many numbers the state is made of.
    fn states(&self) -> usize {
        1
    }

    /// Friction force, with the sign it has on the mass, at slip velocity `w` and state `z`; dz/dt goes to `rates`.
    fn rates(&self, w: f64, z: &[f64], rates: &mut [f64]) -> f64;

    /// The state of steady slip at velocity `w` goes to `z`; for w = 0 the state of a contact that was never loaded.
    fn steady(&self, w: f64, z: &mut [f64]);

    /// The size of the state in slip at that speed, by which an integration measures its errors.
    fn state_scale(&self, speed: f64, scale: &mut [f64]) {
        self.steady(speed, scale);
        for size in scale {
            *size = if size.abs() > 0.0 { size.abs() } else { 1.0 };
        }
    }

    /// Whether friction is so steep in w at rest that an integrator takes another variable u(w, z) in its place.
    fn is_steep(&self) -> bool {
        false
    }

    /// The variable u, of size 1 where the law is steep; else w itself.
    fn slip_variable(&self, w: f64, _z: &[f64]) -> f64 {
        w
    }

    /// Slip velocity and friction force at `u` and `z`; dz/dt goes to `rates`.
    fn at_slip_variable(&self, u: f64, z: &[f64], rates: &mut [f64]) -> [f64; 2] {
        [u, self.rates(u, z, rates)]
    }

    /// ∂F/∂u where friction is a line through rest in the variable u at any state; else 0.
    fn direct_effect(&self) -> f64 {
        0.0
    }

    /// ∂u/∂w, no more than `most`, and what du/dt is besides where the state changes by `rates`.
    fn slip_variable_slopes(&self, _u: f64, _z: &[f64], _rates: &[f64], _most: f64) -> [f64; 2] {
        [1.0, 0.0]
    }

    /// How fast the state comes to that of steady slip at velocity `w`, a bound of |∂ż/∂z| for [`StateFriction::advance`].
    fn pace(&self, _w: f64) -> f64 {
        0.0
    }

    /// Let the state go on for `time` at constant slip velocity. Without an answer of its own a law has a state of one number.
    fn advance(&self, w: f64, z: &mut [f64], time: f64) {
        in_small_steps(self, w, z, time);
    }
}

/// Let a state of one number go on for `time` at constant slip velocity, by the method of Runge and Kutta.
fn in_small_steps<L: StateFriction + ?Sized>(law: &L, w: f64, z: &mut [f64], time: f64) {
    // Steps of 1/50 of the law's own time: 1e-10 a step at worst, and more steps than needed.
    let steps = (50.0 * time * law.pace(w)).ceil().clamp(1.0, 1e5);
    let rate = |z: f64| {
        let mut rate = [0.0];
        law.rates(w, &[z], &mut rate);
        rate[0]
    };
    let mut left = steps;
    while left > 0.0 {
        let next = runge_kutta(&rate, z[0], time / steps);
        if next == z[0] {
            break; // steady to the last digit: every further step ends here too
        }
        z[0] = next;
        left -= 1.0;
    }
}

/// One step of the classical method of Runge and Kutta.
fn runge_kutta(rate: &impl Fn(f64) -> f64, z: f64, h: f64) -> f64 {
    let first = rate(z);
    let second = rate(z + 0.5 * h * first);
    let third = rate(z + 0.5 * h * second);
    let fourth = rate(z + h * third);
    z + h / 6.0 * (first + 2.0 * (second + third) + fourth)
}

macro_rules! laws {
    ($($name:ident),+) => {
        /// Any friction law with a state, as one tagged document.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(tag = "type")]
        pub enum StateLaw { $(#[doc = "See the struct of that name."] $name($name)),+ }

        impl StateLaw {
            /// The names of these laws.
            pub const NAMES: &'static [&'static str] = &[$(stringify!($name)),+];

            /// What is known of each of them.
            pub fn facts() -> Vec<Facts> { vec![$(Facts::of(stringify!($name), |_: &$name| true)),+] }
        }

        impl Limited for StateLaw {
            fn within_limits(&self) -> Result<(), Error> { match self { $(Self::$name(law) => law.within_limits()),+ } }
        }

        impl StateFriction for StateLaw {
            fn validate(&self) -> Result<(), Error> { match self { $(Self::$name(law) => law.validate()),+ } }
            fn has_state(&self) -> bool { match self { $(Self::$name(law) => law.has_state()),+ } }
            fn states(&self) -> usize { match self { $(Self::$name(law) => law.states()),+ } }
            #[inline]
            fn rates(&self, w: f64, z: &[f64], rates: &mut [f64]) -> f64 {
                match self { $(Self::$name(law) => law.rates(w, z, rates)),+ }
            }
            fn steady(&self, w: f64, z: &mut [f64]) { match self { $(Self::$name(law) => law.steady(w, z)),+ } }
            fn state_scale(&self, speed: f64, scale: &mut [f64]) {
                match self { $(Self::$name(law) => law.state_scale(speed, scale)),+ }
            }
            fn is_steep(&self) -> bool { match self { $(Self::$name(law) => law.is_steep()),+ } }
            fn slip_variable(&self, w: f64, z: &[f64]) -> f64 { match self { $(Self::$name(law) => law.slip_variable(w, z)),+ } }
            fn at_slip_variable(&self, u: f64, z: &[f64], rates: &mut [f64]) -> [f64; 2] {
                match self { $(Self::$name(law) => law.at_slip_variable(u, z, rates)),+ }
            }
            fn slip_variable_slopes(&self, u: f64, z: &[f64], rates: &[f64], most: f64) -> [f64; 2] {
                match self { $(Self::$name(law) => law.slip_variable_slopes(u, z, rates, most)),+ }
            }
            fn direct_effect(&self) -> f64 { match self { $(Self::$name(law) => law.direct_effect()),+ } }
            fn pace(&self, w: f64) -> f64 { match self { $(Self::$name(law) => law.pace(w)),+ } }
            fn advance(&self, w: f64, z: &mut [f64], time: f64) { match self { $(Self::$name(law) => law.advance(w, z, time)),+ } }
        }

        $(impl From<$name> for StateLaw { fn from(law: $name) -> Self { Self::$name(law) } })+
    };
}

laws!(Dahl, LuGre, ElastoPlastic, BoucWen, RateState, Regularised);

/// Force and state of `law` along samples of time and slip velocity, from the state `z`; the states row after row.
///
/// Between samples w is linear; a change of its sign there is respected, so that no distance is lost. It ends early once
/// `go_on`, asked before every sample, says no.
///
/// # Errors
/// The law's first parameter that makes no sense, columns of different length, or a state of another law.
pub fn follow(
    law: &StateLaw,
    t: &[f64],
    w: &[f64],
    z: &[f64],
    go_on: &mut dyn FnMut() -> bool,
) -> Result<(Vec<f64>, Vec<f64>), Error> {
    law.validate()?;
    if w.len() != t.len() {
        return wrong(format!(
            "t and w must have the same length, got {} and {}",
            t.len(),
            w.len()
        ));
    }
    let states = law.states();
    if z.len() != states {
        return wrong(format!("state must be {states} numbers, got {}", z.len()));
    }
    let mut state = Vec::with_capacity(states * t.len());
    let (mut z, mut rates) = (z.to_vec(), vec![0.0; states]);
    let mut force = Vec::with_capacity(t.len());
    for i in 0..t.len() {
        if !go_on() {
            break;
        }
        if i > 0 {
            let (from, to, time) = (w[i - 1], w[i], t[i] - t[i - 1]);
            if from * to < 0.0 {
                let share = from / (from - to);
                law.advance(0.5 * from, &mut z, share * time);
                law.advance(0.5 * to, &mut z, (1.0 - share) * time);
            } else if time > 0.0 {
                law.advance(0.5 * (from + to), &mut z, time);
            }
        }
        force.push(law.rates(w[i], &z, &mut rates));
        state.extend(&z);
    }
    Ok((force, state))
}
