//! What of a system stays the same along an orbit, as its Taylor series need it.

use super::coefficients::Layout;
use super::slow::Heavy;
use super::tangent::Linear;
use crate::drive::Drive;
use crate::law::Friction;
use crate::matrix::{Matrix, Rows, filled};
use crate::normal_force::NormalForce;
use crate::series::{LINEAR_ORDER, ORDER};
use crate::spring::Spring;
use crate::system::{Contact, Force, System};

/// What stays the same along an orbit.
#[derive(Clone, Debug)]
pub(crate) struct Frame {
    pub(crate) masses: usize,
    /// The highest power of a step that is kept.
    pub(crate) order: usize,
    pub(super) inverse: Matrix,
    /// M.
    pub(super) inertia: Rows<f64>,
    /// M⁻¹ K and M⁻¹ D.
    pub(super) near: Rows<[f64; 2]>,
    /// b_c as (mass, other).
    pub(super) ends: Vec<(usize, Option<usize>)>,
    /// M⁻¹ b_c.
    pub(super) response: Rows<f64>,
    /// The contacts that a force of each accelerates, and how much a unit force does.
    pub(super) moved: Rows<f64>,
    /// How much it accelerates its own contact.
    pub(super) own: Vec<f64>,
    pub(super) layout: Layout,
    pub(super) forcing: Vec<Force>,
    pub(crate) drives: Vec<Drive>,
    /// The normal forces that vary.
    pub(crate) normals: Vec<Option<NormalForce>>,
    pub(crate) springs: Vec<Spring>,
    /// Whether the law of a contact is smooth, backward and forward.
    pub(super) smooth: Vec<[bool; 2]>,
    /// L without friction.
    pub(crate) rate: f64,
    /// The same without damping.
    pub(crate) undamped: f64,
    /// The highest frequency of drives and forces.
    pub(super) fastest: f64,
    /// The speed that drives and forces can give.
    pub(crate) push: f64,
    /// Whether the contacts can close a loop.
    pub(crate) loops: bool,
    pub(super) heavy: Option<Heavy>,
}

impl Frame {
    pub(crate) fn of(system: &System) -> Self {
        let inverse = Matrix::from_rows(&system.mass)
            .inverse()
            .expect("a validated mass matrix");
        let spring = inverse.times(&Matrix::from_rows(&system.stiffness));
        let damper = inverse.times(&Matrix::from_rows(&system.damping));
        let ends: Vec<_> = system.contacts.iter().map(|c| (c.mass, c.other)).collect();
        let n = system.masses();
        let near = Rows::new((0..n).map(|i| {
            let both = spring.row(i).iter().zip(damper.row(i));
            let both = both.map(|(spring, damper)| [*spring, *damper]).enumerate();
            both.filter(|(_, both)| *both != [0.0; 2])
        }));
        let response = Rows::new(ends.iter().map(|&(mass, other)| {
            let other = |i| other.map_or(0.0, |j| inverse.at(i, j));
            let row: Vec<f64> = (0..n).map(|i| inverse.at(i, mass) - other(i)).collect();
            filled(&row).collect::<Vec<_>>()
        }));
        let mut on: Vec<Vec<usize>> = vec![Vec::new(); n];
        for (c, &(mass, other)) in ends.iter().enumerate() {
            on[mass].push(c);
            if let Some(other) = other {
                on[other].push(c);
            }
        }
        let coupled = |to: usize, from: usize| {
            let (mass, other) = ends[to];
            let mut coupled = entry(&response, from, mass);
            if let Some(other) = other {
                coupled.add(-1.0, entry(&response, from, other));
            }
            coupled
        };
        let moved = Rows::new((0..ends.len()).map(|c| {
            let masses = response.row(c).iter();
            let mut moved: Vec<usize> = masses.flat_map(|&(mass, _)| &on[mass]).copied().collect();
            moved.sort_unstable();
            moved.dedup();
            moved
                .into_iter()
                .map(move |to| (to, coupled(to, c)))
                .collect::<Vec<_>>()
        }));
        let own = (0..ends.len()).map(|c| coupled(c, c)).collect();
        let drives: Vec<Drive> = system.contacts.iter().map(|c| c.drive_velocity.clone()).collect();
        let normals: Vec<_> = system.contacts.iter().map(|c| c.normal_force.clone()).collect();
        let fastest = drives
            .iter()
            .map(Drive::fastest)
            .chain(system.forcing.iter().map(|force| force.frequency))
            .chain(normals.iter().flatten().map(NormalForce::fastest))
            .fold(0.0, f64::max);
        let stiffer = system.springs.iter().map(|spring| {
            let own = |i: usize| inverse.at(i, i);
            spring.steepest() * (own(spring.mass) + spring.other.map_or(0.0, own)) * 2.0
        });
        let undamped = (spring.norm() + stiffer.sum::<f64>()).sqrt();
        let free = undamped + damper.norm();
        // Contacts as edges between the masses and, the last node, the ground of all drives.
        let mut joined: Vec<usize> = (0..=n).collect();
        let mut loops = false;
        for &(mass, other) in &ends {
            let (one, two) = (joined[mass], joined[other.unwrap_or(n)]);
            loops |= one == two;
            for node in &mut joined {
                if *node == two {
                    *node = one;
                }
            }
        }
        let sides = |contact: &Contact| [-1.0, 1.0].map(|direction| contact.law.toward(direction).smooth());
        let smooth: Vec<_> = system.contacts.iter().map(sides).collect();
        let rate = if free + fastest > 0.0 {
            free.max(fastest)
        } else {
            1.0
        };
        let driven = drives.iter().map(Drive::size).fold(0.0, f64::max);
        let pushed = system.forcing.iter().map(|force| {
            let response = inverse.row(force.mass).iter().map(|value| value.abs());
            force.amplitude.abs() * response.fold(0.0, f64::max) / rate
        });
        let undamped = Some(undamped.max(fastest))
            .filter(|&rate| rate > 0.0)
            .unwrap_or(rate);
        Self {
            masses: n,
            loops,
            rate,
            undamped,
            heavy: Heavy::of(system, damper.norm(), undamped, fastest),
            fastest,
            push: pushed.fold(driven, f64::max),
            layout: Layout::new(&near, &ends, &response),
            inverse,
            inertia: Rows::new(system.mass.iter().map(|row| filled(row))),
            near,
            ends,
            response,
            moved,
            own,
            forcing: system.forcing.clone(),
            drives,
            normals,
            springs: system.springs.clone(),
            order: if smooth.concat().contains(&true) {
                ORDER
            } else {
                LINEAR_ORDER
            },
            smooth,
        }
    }

    /// Whether the law of a contact is smooth in a direction of slip.
    pub(crate) fn is_smooth(&self, contact: usize, direction: f64) -> bool {
        self.smooth[contact][usize::from(direction >= 0.0)]
    }

    /// The mass of a contact.
    pub(crate) fn mass_of(&self, contact: usize) -> usize {
        self.ends[contact].0
    }

    /// Whether a contact is with a drive, not with another mass.
    pub(crate) fn driven(&self, contact: usize) -> bool {
        self.ends[contact].1.is_none()
    }

    /// b_c · a for any vector over the masses.
    pub(crate) fn across<T: Linear>(&self, contact: usize, a: impl Fn(usize) -> T) -> T {
        let (mass, other) = self.ends[contact];
        let mut across = a(mass);
        if let Some(other) = other {
            across.add(-1.0, a(other));
        }
        across
    }

    /// The speed that the springs can give mass `i` while the motion changes. Under heavy damping that is far less than the
    /// position times the fastest rate.
    pub(crate) fn sprung(&self, i: usize, x: &[f64]) -> f64 {
        let loads = self.near.row(i).iter();
        loads.map(|&(j, [spring, _])| (spring * x[j]).abs()).sum::<f64>() / self.rate
    }

    /// How much a unit force of `from` accelerates `to`: b_to M⁻¹ b_from.
    pub(crate) fn coupling(&self, to: usize, from: usize) -> f64 {
        if to == from {
            self.own[to]
        } else {
            entry(&self.moved, from, to)
        }
    }

    /// What a unit force of a contact accelerates a mass by.
    pub(crate) fn response(&self, contact: usize, mass: usize) -> f64 {
        entry(&self.response, contact, mass)
    }

    /// Take out of `required` what a force of a contact does about what every contact required.
    pub(crate) fn relieve(&self, required: &mut [f64], contact: usize, force: f64) {
        for &(to, coupling) in self.moved.row(contact) {
            required[to] -= coupling * force;
        }
    }

    /// Add what a force of a contact accelerates.
    pub(crate) fn push<T: Linear>(&self, contact: usize, force: T, acceleration: &mut [T]) {
        for &(i, response) in self.response.row(contact) {
            acceleration[i].add(response, force);
        }
    }
}

/// An entry of a sparse matrix.
fn entry(rows: &Rows<f64>, i: usize, j: usize) -> f64 {
    let row = rows.row(i);
    let index = row.binary_search_by_key(&j, |&(column, _)| column);
    index.map_or(0.0, |index| row[index].1)
}
