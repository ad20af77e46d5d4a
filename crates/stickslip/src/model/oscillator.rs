//! The oscillator: one mass on a spring and a damper, rubbing on a drive.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::clock::Clock;
use crate::error::{Error, finite, not_negative, positive, read};
use crate::harmonic::{Harmonic, MOST_HARMONICS};
use crate::law::{Checked, End, Friction, Law, Memory};

/// `$work` with the number of harmonic forces of an oscillator as the constant `$count`: each is a slot of the flow. In a browser,
/// where every instance has to be loaded, two or three leave slots empty, which changes no bit.
macro_rules! with_harmonics {
    ($oscillator:expr, $count:ident, $work:expr) => {
        match $oscillator.swinging().count() {
            0 => {
                const $count: usize = 0;
                $work
            }
            1 => {
                const $count: usize = 1;
                $work
            }
            #[cfg(not(target_family = "wasm"))]
            2 => {
                const $count: usize = 2;
                $work
            }
            #[cfg(not(target_family = "wasm"))]
            3 => {
                const $count: usize = 3;
                $work
            }
            _ => {
                const $count: usize = 4;
                $work
            }
        }
    };
}
pub(crate) use with_harmonics;

/// The closed form of a response loses as many digits as this is small.
const FAINT_RESPONSE: f64 = 1e-3;

/// m ẍ + D ẋ + k x = F(w, memory) + Σ A cos(Ω t + φ), w = s − ẋ; x is measured from the equilibrium of the moving drive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Oscillator<L = Law> {
    /// Mass m.
    pub mass: f64,
    /// Spring stiffness k.
    pub stiffness: f64,
    /// Viscous damping D.
    pub damping: f64,
    /// Drive velocity s.
    pub drive_velocity: f64,
    /// Friction between the mass and the drive.
    pub law: L,
    /// Harmonic forces on the mass.
    #[serde(default)]
    pub forcing: Vec<Harmonic>,
}

impl<L: Checked + DeserializeOwned> Oscillator<L> {
    /// An oscillator from its JSON document.
    ///
    /// # Errors
    /// What the document lacks, what it has too much, or the first value that makes no sense.
    pub fn from_json(document: &str) -> Result<Self, Error> {
        let oscillator: Self = read(document)?;
        oscillator.validate()?;
        Ok(oscillator)
    }

    /// Check every value.
    ///
    /// # Errors
    /// The first value that makes no sense.
    pub fn validate(&self) -> Result<(), Error> {
        if !(self.mass == 0.0 && self.law.balances_load()) {
            positive("mass", self.mass)?;
        }
        positive("stiffness", self.stiffness)?;
        not_negative("damping", self.damping)?;
        finite("drive_velocity", self.drive_velocity)?;
        let got = self.swinging().count();
        if got > MOST_HARMONICS {
            return Err(Error::TooManyHarmonics {
                most: MOST_HARMONICS,
                got,
            });
        }
        for harmonic in &self.forcing {
            harmonic.validate()?;
        }
        self.law.check()
    }
}

impl<L> Oscillator<L> {
    /// A mass of 1 on a spring of stiffness 1, unforced.
    #[must_use]
    pub fn new(damping: f64, drive_velocity: f64, law: impl Into<L>) -> Self {
        Self {
            mass: 1.0,
            stiffness: 1.0,
            damping,
            drive_velocity,
            law: law.into(),
            forcing: Vec::new(),
        }
    }

    /// The harmonic forces that vary.
    pub(crate) fn swinging(&self) -> impl Iterator<Item = Harmonic> + '_ {
        self.forcing.iter().copied().filter(Harmonic::swings)
    }

    /// The sum of the forces that do not vary, those of the frequency 0.
    pub(crate) fn constant_force(&self) -> f64 {
        let constant = self.forcing.iter().filter(|harmonic| !harmonic.swings());
        constant
            .map(|harmonic| harmonic.quadratures(Clock::default()).0)
            .sum()
    }
}

impl Oscillator {
    /// Whether its motion on a constant drive is in closed form: a law of linear pieces away from undamped resonance.
    pub fn closed(&self) -> bool {
        !self.law.smooth() && !self.resonates()
    }

    /// Whether a harmonic meets, or under a law whose slopes come from the motion may meet, so faint a damping on a piece of its
    /// law that the closed form, which holds the response of all times, would lose digits: such a motion belongs on a Taylor
    /// series.
    pub fn resonates(&self) -> bool {
        let met = |slope: f64| {
            self.forcing
                .iter()
                .any(|harmonic| self.detuning(slope, harmonic.frequency) < FAINT_RESPONSE)
        };
        let tuned = |harmonic: &Harmonic| self.detuning(-self.damping, harmonic.frequency) < FAINT_RESPONSE;
        if self.law.smooth() || !self.forcing.iter().any(tuned) {
            return false;
        }
        // What adhesion held and where ẇ turned decide its slopes: any may come.
        let laws = [-1.0, 1.0].map(|direction| self.law.toward(direction));
        if laws.iter().any(|law| matches!(law, Law::BogaczRyczek(_))) {
            return true;
        }
        let starts = laws
            .into_iter()
            .flat_map(|law| [(law, f64::INFINITY), (law, f64::NEG_INFINITY)]);
        starts.into_iter().any(|(law, balance)| {
            let mut memory = Memory::default();
            let mut piece = law.begin(0.0, balance, &mut memory);
            loop {
                if met(piece.slope) {
                    return true;
                }
                if piece.high.is_infinite() {
                    return false;
                }
                let next = law.next(&piece, End::High, piece.high, &mut memory);
                if next == piece {
                    return false;
                }
                piece = next;
            }
        })
    }

    /// |k − mΩ² + i(D + slope)Ω|/k.
    fn detuning(&self, slope: f64, frequency: f64) -> f64 {
        let real = 1.0 - self.mass / self.stiffness * frequency * frequency;
        let imaginary = (self.damping + slope) * frequency / self.stiffness;
        (real * real + imaginary * imaginary).sqrt()
    }
}
