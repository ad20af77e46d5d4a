//! Any number of masses that rub on drives and on each other.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::clock::Clock;
use crate::drive::Drive;
use crate::error::{Error, finite, read, wrong};
use crate::harmonic::Harmonic;
use crate::law::{Checked, Law};
use crate::matrix::Matrix;
use crate::normal_force::NormalForce;
use crate::oscillator::Oscillator;
use crate::spring::Spring;

/// M ẍ + D ẋ + K x = Σ b_c F_c + Σ e_i A cos(Ω t + φ), w_c = s_c(t) − b_c·ẋ, with b_c = e_mass − e_other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct System<L = Law> {
    /// The mass matrix M, symmetric and positive definite; or zero, where friction of each mass balances the load on it.
    pub mass: Vec<Vec<f64>>,
    /// The stiffness matrix K.
    pub stiffness: Vec<Vec<f64>>,
    /// The damping matrix D.
    pub damping: Vec<Vec<f64>>,
    /// Where there is friction.
    pub contacts: Vec<Contact<L>>,
    /// Harmonic forces.
    #[serde(default)]
    pub forcing: Vec<Force>,
    /// Springs that are not linear.
    #[serde(default)]
    pub springs: Vec<Spring>,
}

/// A contact of a mass with a drive, or with another mass.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Contact<L = Law> {
    /// The mass.
    pub mass: usize,
    /// The other mass; none: the drive itself.
    #[serde(default)]
    pub other: Option<usize>,
    /// The drive velocity s(t).
    #[serde(default)]
    pub drive_velocity: Drive,
    /// Friction of this contact.
    pub law: L,
    /// The normal force over that of the law; none: always 1.
    #[serde(default)]
    pub normal_force: Option<NormalForce>,
}

/// A harmonic force on one mass.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Force {
    /// The mass.
    #[serde(default)]
    pub mass: usize,
    /// Amplitude, a force.
    pub amplitude: f64,
    /// Angular frequency Ω.
    pub frequency: f64,
    /// Phase at t = 0, rad.
    #[serde(default)]
    pub phase: f64,
}

impl Force {
    /// Without its mass.
    pub fn harmonic(&self) -> Harmonic {
        Harmonic::new(self.amplitude, self.frequency, self.phase)
    }
}

impl<L: Clone> From<&Oscillator<L>> for System<L> {
    fn from(oscillator: &Oscillator<L>) -> Self {
        let forcing = oscillator.forcing.iter().map(|harmonic| Force {
            mass: 0,
            amplitude: harmonic.amplitude,
            frequency: harmonic.frequency,
            phase: harmonic.phase,
        });
        Self {
            mass: vec![vec![oscillator.mass]],
            stiffness: vec![vec![oscillator.stiffness]],
            damping: vec![vec![oscillator.damping]],
            contacts: vec![Contact {
                mass: 0,
                other: None,
                drive_velocity: oscillator.drive_velocity.into(),
                law: oscillator.law.clone(),
                normal_force: None,
            }],
            forcing: forcing.collect(),
            springs: Vec::new(),
        }
    }
}

/// One mass as a document: an oscillator, with whatever a contact may have.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct OneMass<L> {
    mass: f64,
    stiffness: f64,
    damping: f64,
    drive_velocity: Drive,
    law: L,
    #[serde(default)]
    forcing: Vec<Harmonic>,
    #[serde(default)]
    normal_force: Option<NormalForce>,
    #[serde(default)]
    springs: Vec<Spring>,
}

impl<L: Checked + Clone + DeserializeOwned> System<L> {
    /// The system of the document of an oscillator or of masses, and of one mass the oscillator with the constant part of all;
    /// neither is checked.
    ///
    /// # Errors
    /// What the document lacks or has too much.
    pub fn read(document: &Value) -> Result<(Self, Option<Oscillator<L>>), serde_json::Error> {
        if document.get("contacts").is_some() {
            return Self::deserialize(document).map(|system| (system, None));
        }
        let one = OneMass::<L>::deserialize(document)?;
        let oscillator = Oscillator {
            mass: one.mass,
            stiffness: one.stiffness,
            damping: one.damping,
            drive_velocity: one.drive_velocity.velocity,
            law: one.law,
            forcing: one.forcing,
        };
        let mut system = Self::from(&oscillator);
        let contact = &mut system.contacts[0];
        contact.drive_velocity = one.drive_velocity;
        contact.normal_force = one.normal_force;
        system.springs = one.springs;
        Ok((system, Some(oscillator)))
    }
}

impl System {
    /// The oscillator that is the same, if there is one.
    pub(crate) fn one_mass(&self) -> Option<Oscillator> {
        let ([mass], [stiffness], [damping], [contact]) = (
            &self.mass[..],
            &self.stiffness[..],
            &self.damping[..],
            &self.contacts[..],
        ) else {
            return None;
        };
        let oscillator = Oscillator {
            mass: mass[0],
            stiffness: stiffness[0],
            damping: damping[0],
            drive_velocity: contact.drive_velocity.velocity,
            law: contact.law.clone(),
            forcing: self.forcing.iter().map(Force::harmonic).collect(),
        };
        (Self::from(&oscillator) == *self).then_some(oscillator)
    }
}

/// The least part of a mass that the others must leave alone: accelerations have fewer digits by as much.
const LEAST_OWN_MASS: f64 = 1e-9;

impl<L: Checked + DeserializeOwned> System<L> {
    /// A system from its JSON document.
    ///
    /// # Errors
    /// What the document lacks, what it has too much, or the first value that makes no sense.
    pub fn from_json(document: &str) -> Result<Self, Error> {
        let system: Self = read(document)?;
        system.validate()?;
        Ok(system)
    }

    /// The number of masses.
    pub fn masses(&self) -> usize {
        self.mass.len()
    }

    /// Check every value.
    ///
    /// # Errors
    /// The first value that makes no sense.
    pub fn validate(&self) -> Result<(), Error> {
        let n = self.masses();
        if n == 0 {
            return wrong("a system needs at least one mass, got none".into());
        }
        for (name, matrix) in [
            ("mass", &self.mass),
            ("stiffness", &self.stiffness),
            ("damping", &self.damping),
        ] {
            if matrix.len() != n || matrix.iter().any(|row| row.len() != n) {
                return wrong(format!(
                    "{name} must be a {n} by {n} matrix like the mass matrix, got rows of length {:?}",
                    matrix.iter().map(Vec::len).collect::<Vec<_>>()
                ));
            }
            for value in matrix.iter().flatten() {
                finite(name, *value)?;
            }
        }
        if self.is_massless() {
            self.check_balance()?;
        } else {
            self.check_masses()?;
        }
        for (index, contact) in self.contacts.iter().enumerate() {
            for mass in [Some(contact.mass), contact.other].into_iter().flatten() {
                if mass >= n {
                    return wrong(format!(
                        "contact {index} must name masses from 0 to {}, got {mass}",
                        n - 1
                    ));
                }
            }
            if contact.other == Some(contact.mass) {
                return wrong(format!(
                    "contact {index} must join two masses, got {} twice",
                    contact.mass
                ));
            }
            contact.drive_velocity.validate()?;
            contact.law.check()?;
            if let Some(normal_force) = &contact.normal_force {
                normal_force.validate()?;
                contact.law.check_scaled()?;
            }
        }
        for force in &self.forcing {
            if force.mass >= n {
                return wrong(format!(
                    "forcing must name a mass from 0 to {}, got {}",
                    n - 1,
                    force.mass
                ));
            }
            force.harmonic().validate()?;
        }
        for (index, spring) in self.springs.iter().enumerate() {
            let ends = [Some(spring.mass), spring.other];
            if spring.other == Some(spring.mass) || ends.into_iter().flatten().any(|mass| mass >= n) {
                return wrong(format!(
                    "spring {index} must join a mass from 0 to {} with the ground or with another one, got {} and {:?}",
                    n - 1,
                    spring.mass,
                    spring.other
                ));
            }
            spring.validate()?;
        }
        Ok(())
    }

    /// Check that friction of each mass balances the load on it, in one way.
    fn check_balance(&self) -> Result<(), Error> {
        let mut free = vec![true; self.masses()];
        let each = self.contacts.iter().all(|contact| {
            let law = contact.law.balances_load() && contact.normal_force.is_none();
            law && contact.other.is_none() && free.get_mut(contact.mass).is_some_and(std::mem::take)
        });
        if each && !free.contains(&true) {
            return Ok(());
        }
        wrong(
            "mass may be 0 only where every mass rubs once, on a drive, under RateState without a normal force of its own: give a mass"
                .into(),
        )
    }

    /// Check that every force accelerates.
    pub(crate) fn check_masses(&self) -> Result<(), Error> {
        let symmetric = (0..self.masses()).all(|i| (0..i).all(|j| self.mass[i][j] == self.mass[j][i]));
        let mass = Matrix::from_rows(&self.mass);
        match mass.inverse().filter(|_| symmetric) {
            Some(inverse) if inverse.norm().is_finite() => {
                // What is left of each mass beside the others: 1 / (M⁻¹)ⱼⱼ.
                let share = |j: usize| 1.0 / (inverse.at(j, j) * mass.at(j, j));
                match (0..self.masses()).find(|&j| share(j) < LEAST_OWN_MASS) {
                    Some(j) => wrong(format!(
                        "the mass matrix is singular within rounding: beside the others only {:.1e} of mass {j} is left, and a \
                         motion would be lost in that; give coordinates that move by themselves",
                        share(j)
                    )),
                    None => Ok(()),
                }
            }
            Some(_) => wrong("the masses must be so large that their inverses are finite numbers".into()),
            None => wrong(
                "the mass matrix must be symmetric and positive definite: every mass must be greater than 0"
                    .into(),
            ),
        }
    }

    /// Where every mass starts unless asked otherwise: moving with the drive it touches, itself or through other masses.
    pub fn driven_velocities(&self) -> Vec<f64> {
        let mut velocity = vec![None; self.masses()];
        let mut series = crate::series::ZERO;
        for _ in 0..self.masses() {
            for contact in &self.contacts {
                contact.drive_velocity.expand(Clock::default(), &mut series);
                match contact.other {
                    None => velocity[contact.mass] = velocity[contact.mass].or(Some(series[0])),
                    Some(other) => {
                        let (mine, its) = (velocity[contact.mass], velocity[other]);
                        velocity[contact.mass] = mine.or(its.map(|v| v + series[0]));
                        velocity[other] = its.or(mine.map(|v| v - series[0]));
                    }
                }
            }
        }
        velocity.into_iter().map(|v| v.unwrap_or(0.0)).collect()
    }
}
