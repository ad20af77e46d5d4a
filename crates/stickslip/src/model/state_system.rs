//! Masses under laws with an internal state: the right-hand side that an integrator asks for.

mod massless;
mod regular;

use std::f64::consts::TAU;

use crate::clock::Clock;
use crate::error::Error;
use crate::matrix::Matrix;
use crate::series::ZERO;
use crate::state_law::{StateFriction, StateLaw};
use crate::surface::Surface;
use crate::system::System;
use regular::{Steep, steep};

/// The part of a variable over which differences are taken: the root of the rounding.
const DIFFERENCE_SHARE: f64 = 1.5e-8;

/// M ẍ + D ẋ + K x = Σ b_c F_c(w_c, z_c) + Σ e_i A cos(Ω t + φ), ż_c = g_c(w_c, z_c), in the variables [x, q, z].
///
/// The state z is that of each contact after the other, of as many numbers as its law has.
/// Of the velocities q as many as can be are slip velocities, one for each contact that joins what was not joined; the rest
/// are velocities of masses. A stiff law multiplies the rounding of s − ẋ, which a variable of its own does not have.
///
/// Without mass (M = 0) friction balances the load L on each mass: L = F − D ẋ − K x + … = 0. The slip velocities are variables
/// all the same, and move by dL/dt = −L/τ: from a start in balance they keep it, and what errors leave of it fades.
#[derive(Clone, Debug)]
pub struct StateSystem {
    system: System<StateLaw>,
    /// That of the mass matrix; none without mass.
    inverse: Option<Matrix>,
    links: Vec<Link>,
    /// How many numbers the states are.
    states: usize,
    steep: Vec<Steep>,
}

/// One velocity variable, and the mass whose velocity follows from it and from those before.
#[derive(Clone, Copy, Debug)]
enum Link {
    /// The velocity of the mass itself.
    Mass(usize),
    /// The slip velocity of the contact; its first mass follows.
    Forward(usize),
    /// The same; its other mass follows.
    Backward(usize),
}

/// What follows from the variables.
#[derive(Clone, Debug)]
pub struct Motion {
    /// Velocities, mass by mass.
    pub v: Vec<f64>,
    /// Accelerations, mass by mass.
    pub a: Vec<f64>,
    /// Slip velocities, contact by contact.
    pub w: Vec<f64>,
    /// Slip accelerations, contact by contact.
    pub slip_acceleration: Vec<f64>,
    /// Friction forces, contact by contact.
    pub force: Vec<f64>,
    /// dz/dt, number by number.
    pub rate: Vec<f64>,
    /// The sum of all forces, mass by mass.
    pub load: Vec<f64>,
}

impl StateSystem {
    /// The right-hand side of a system.
    ///
    /// # Errors
    /// The first value that makes no sense.
    ///
    /// # Panics
    /// Never: a system whose mass matrix has no inverse makes no sense.
    pub fn new(system: System<StateLaw>) -> Result<Self, Error> {
        system.validate()?;
        let links = links(&system);
        Ok(Self {
            inverse: (!system.is_massless()).then(|| {
                Matrix::from_rows(&system.mass)
                    .inverse()
                    .expect("a validated mass matrix")
            }),
            steep: steep(&system, &links),
            links,
            states: system.contacts.iter().map(|contact| contact.law.states()).sum(),
            system,
        })
    }

    /// The number of masses.
    pub fn masses(&self) -> usize {
        self.links.len()
    }

    /// The number of variables.
    pub fn width(&self) -> usize {
        2 * self.masses() + self.states
    }

    /// The variables x and q at t = 0, and the slip velocities there; where no velocity is given, that of the drives.
    pub fn start(&self, x: &[f64], v: Option<Vec<f64>>) -> (Vec<f64>, Vec<f64>) {
        let v = v.unwrap_or_else(|| self.system.driven_velocities());
        let drives = self.drives(0.0);
        let w: Vec<f64> = (0..drives.len())
            .map(|c| self.across(c, drives[c][0], &v))
            .collect();
        let q = self.links.iter().map(|link| match *link {
            Link::Mass(mass) => v[mass],
            Link::Forward(c) | Link::Backward(c) => w[c],
        });
        (x.iter().copied().chain(q).collect(), w)
    }

    /// The time derivative of the variables `y`.
    pub fn rates(&self, t: f64, y: &[f64]) -> Vec<f64> {
        self.rates_of(&self.motion(t, y))
    }

    fn rates_of(&self, motion: &Motion) -> Vec<f64> {
        let Motion {
            v,
            a,
            slip_acceleration,
            rate,
            ..
        } = motion;
        let q = self.links.iter().map(|link| match *link {
            Link::Mass(mass) => a[mass],
            Link::Forward(c) | Link::Backward(c) => slip_acceleration[c],
        });
        v.iter().copied().chain(q).chain(rate.iter().copied()).collect()
    }

    /// ∂/∂y of the time derivative of the variables `y` of [`StateSystem::regular`], row after row, and ∂/∂t of it, by
    /// differences; `slope` is the time derivative itself, and `least` as there.
    pub fn jacobian(
        &self,
        t: f64,
        y: &[f64],
        slope: &[f64],
        scales: &[f64],
        least: f64,
    ) -> (Vec<f64>, Vec<f64>) {
        let n = y.len();
        let mut matrix = vec![0.0; n * n];
        let mut moved = y.to_vec();
        for j in 0..n {
            moved[j] += DIFFERENCE_SHARE * y[j].abs().max(scales[j]);
            let by = moved[j] - y[j];
            for (i, (there, here)) in self
                .regular_rates(t, &moved, least)
                .into_iter()
                .zip(slope)
                .enumerate()
            {
                matrix[i * n + j] = (there - here) / by;
            }
            moved[j] = y[j];
        }
        let by = DIFFERENCE_SHARE * t.max(self.period());
        let later = self.regular_rates(t + by, y, least).into_iter().zip(slope);
        (matrix, later.map(|(there, here)| (there - here) / by).collect())
    }

    /// What counts as small in each variable, from a start: that of a motion as fast as the drives, at the natural frequency.
    pub fn scales(&self, y: &[f64]) -> Vec<f64> {
        let n = self.masses();
        let frequency = self.natural_frequency();
        let largest = |values: &[f64]| values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        let drives: Vec<f64> = self.drives(0.0).iter().map(|drive| drive[0]).collect();
        let (far, fast) = (largest(&y[..n]), largest(&y[n..2 * n]).max(largest(&drives)));
        let speed = fast.max(1e-3 * far * frequency);
        let speed = if speed > 0.0 { speed } else { 1.0 };
        let mut states = vec![0.0; self.states];
        for (contact, scale) in self.system.contacts.iter().zip(self.each(&mut states)) {
            contact.law.state_scale(speed, scale);
        }
        let length = (speed / frequency).max(1e-9 * far);
        [length, speed]
            .into_iter()
            .flat_map(|scale| vec![scale; n])
            .chain(states)
            .collect()
    }

    /// The variables of a motion from positions and velocities, as [`StateSystem::start`] takes them; states are those of
    /// steady slip, or of a contact that was never loaded.
    pub fn variables(&self, x: &[f64], v: Option<Vec<f64>>) -> Vec<f64> {
        let (mut y, w) = self.start(x, v);
        let mut states = vec![0.0; self.states];
        let contacts = self.system.contacts.iter().zip(w);
        for ((contact, w), z) in contacts.zip(self.each(&mut states)) {
            contact.law.steady(w, z);
        }
        y.extend(states);
        y
    }

    /// What belongs to the state of each contact, of values that belong to the states.
    fn each<'a>(&'a self, values: &'a mut [f64]) -> impl Iterator<Item = &'a mut [f64]> {
        let mut rest = values;
        self.system.contacts.iter().map(move |contact| {
            let (own, others) = std::mem::take(&mut rest).split_at_mut(contact.law.states());
            rest = others;
            own
        })
    }

    /// The number of contacts.
    pub fn contacts(&self) -> usize {
        self.system.contacts.len()
    }

    /// The mass of a contact.
    pub fn mass_of(&self, contact: usize) -> usize {
        self.system.contacts[contact].mass
    }

    /// The first time after `t` at which the table of a drive has a node.
    pub fn node_after(&self, t: f64) -> f64 {
        let drives = self.system.contacts.iter().map(|contact| &contact.drive_velocity);
        let nodes = drives.flat_map(|drive| &drive.nodes).map(|node| node[0]);
        nodes.filter(|&node| node > t).fold(f64::INFINITY, f64::min)
    }

    /// The period of the first forcing, or the natural period.
    pub fn period(&self) -> f64 {
        let frequency = self.system.forcing_frequency();
        TAU / frequency.unwrap_or_else(|| self.natural_frequency())
    }

    /// The highest natural frequency; without mass the rate at which the fastest state comes to that of steady slip.
    pub fn natural_frequency(&self) -> f64 {
        if self.inverse.is_some() {
            return self.system.natural_frequency();
        }
        let contacts = self.system.contacts.iter().zip(self.drives(0.0));
        contacts
            .map(|(contact, [drive, _])| contact.law.pace(drive))
            .fold(0.0, f64::max)
    }

    /// The stroboscopic section where there is forcing, else the maxima of x.
    pub fn usual_surface(&self) -> Surface {
        Surface::of_forcing(self.system.forcing_frequency())
    }

    /// What follows from the variables `y` at `t`.
    pub fn motion(&self, t: f64, y: &[f64]) -> Motion {
        self.motion_on(&self.drives(t), t, y, None)
    }

    /// With the variables of [`StateSystem::regular`] friction is told by them: at rest w may be too small for a number. With
    /// them comes the most that ∂u/∂w may be.
    fn motion_on(&self, drives: &[[f64; 2]], t: f64, y: &[f64], regular: Option<(&[f64], f64)>) -> Motion {
        let n = self.masses();
        let (x, q, z) = (&y[..n], &y[n..2 * n], &y[2 * n..]);
        let contacts = &self.system.contacts;
        let (mut v, mut own) = (vec![0.0; n], vec![None; contacts.len()]);
        for (link, &q) in self.links.iter().zip(q) {
            let slipping = |c: usize| drives[c][0] - q;
            match *link {
                Link::Mass(mass) => v[mass] = q,
                Link::Forward(c) => {
                    v[contacts[c].mass] = contacts[c].other.map_or(0.0, |i| v[i]) + slipping(c);
                }
                Link::Backward(c) => {
                    if let Some(other) = contacts[c].other {
                        v[other] = v[contacts[c].mass] - slipping(c);
                    }
                }
            }
            if let Link::Forward(c) | Link::Backward(c) = *link {
                own[c] = Some(q);
            }
        }
        let clock = Clock::at(t);
        let w: Vec<f64> = (0..contacts.len())
            .map(|c| own[c].unwrap_or_else(|| self.across(c, drives[c][0], &v)))
            .collect();
        let mut rate = vec![0.0; self.states];
        let mut z = z;
        let force: Vec<f64> = contacts
            .iter()
            .zip(w.iter().zip(self.each(&mut rate)))
            .enumerate()
            .map(|(c, (contact, (&w, rates)))| {
                let (own, others) = z.split_at(rates.len());
                z = others;
                let steep = || self.steep.iter().find(|steep| steep.contact == c);
                let force = match regular.zip(steep()) {
                    Some(((regular, _), steep)) => {
                        contact.law.at_slip_variable(regular[steep.slip], own, rates)[1]
                    }
                    None => contact.law.rates(w, own, rates),
                };
                let across = |values: &[f64]| values[contact.mass] - contact.other.map_or(0.0, |i| values[i]);
                let normal = contact.normal_force.as_ref();
                let normal = normal.map_or(1.0, |normal| normal.at(clock, across(x), across(&v)).max(0.0));
                normal * force
            })
            .collect();
        let mut load = vec![0.0; n];
        for push in &self.system.forcing {
            load[push.mass] += push.harmonic().quadratures(clock).0;
        }
        for spring in &self.system.springs {
            let displacement = x[spring.mass] - spring.other.map_or(0.0, |other| x[other]);
            let force = spring.force(spring.piece(displacement), displacement);
            load[spring.mass] -= force;
            if let Some(other) = spring.other {
                load[other] += force;
            }
        }
        for (contact, force) in contacts.iter().zip(&force) {
            load[contact.mass] += force;
            if let Some(other) = contact.other {
                load[other] -= force;
            }
        }
        for (i, load) in load.iter_mut().enumerate() {
            *load -= dot(&self.system.damping[i], &v) + dot(&self.system.stiffness[i], x);
        }
        let mut motion = Motion {
            slip_acceleration: Vec::new(),
            a: Vec::new(),
            v,
            w,
            force,
            rate,
            load,
        };
        if let Some(inverse) = &self.inverse {
            motion.a = (0..n).map(|i| dot(inverse.row(i), &motion.load)).collect();
            let across = (0..contacts.len()).map(|c| self.across(c, drives[c][1], &motion.a));
            motion.slip_acceleration = across.collect();
        } else {
            motion.slip_acceleration = self.balancing(drives, clock, y, regular, &motion);
            motion.a = vec![0.0; n];
            for (contact, (drive, w)) in contacts.iter().zip(drives.iter().zip(&motion.slip_acceleration)) {
                motion.a[contact.mass] = drive[1] - w;
            }
        }
        motion
    }

    /// Value and slope of the drive velocities.
    fn drives(&self, t: f64) -> Vec<[f64; 2]> {
        let mut series = ZERO;
        let clock = Clock::at(t);
        let contacts = self.system.contacts.iter();
        contacts
            .map(|contact| {
                contact.drive_velocity.expand(clock, &mut series);
                [series[0], series[1]]
            })
            .collect()
    }

    /// drive − b_c · v.
    fn across(&self, c: usize, drive: f64, v: &[f64]) -> f64 {
        let contact = &self.system.contacts[c];
        drive + contact.other.map_or(0.0, |other| v[other]) - v[contact.mass]
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// A velocity variable for every mass, in an order in which each follows from those before. The ground is known.
fn links(system: &System<StateLaw>) -> Vec<Link> {
    let mut known = vec![false; system.masses()];
    let mut links = Vec::with_capacity(known.len());
    while links.len() < known.len() {
        let next = system.contacts.iter().enumerate().find_map(|(c, contact)| {
            match (
                known[contact.mass],
                contact.other.is_none_or(|other| known[other]),
            ) {
                (false, true) => Some((Link::Forward(c), contact.mass)),
                (true, false) => contact.other.map(|other| (Link::Backward(c), other)),
                _ => None,
            }
        });
        // Masses that force_line on no drive: one of them is a variable itself.
        let free = || {
            known
                .iter()
                .position(|known| !known)
                .map(|mass| (Link::Mass(mass), mass))
        };
        let Some((link, mass)) = next.or_else(free) else {
            break;
        };
        known[mass] = true;
        links.push(link);
    }
    links
}
