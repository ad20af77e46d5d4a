//! Contacts that hold as a constraint: their forces, and the masses that they carry.

use super::slow::Slow;
use super::{ForceLine, Frame};
use crate::matrix::{Matrix, Rows, filled};

/// The adhesion of some contacts as a constraint: (b M⁻¹ bᵀ)⁻¹ over them, or the solution of least size where contacts are
/// redundant (a closed loop of stuck contacts leaves the share of each undetermined).
#[derive(Clone, Debug)]
pub(crate) struct Held {
    pub(crate) contacts: Vec<usize>,
    pub(super) gain: Rows<f64>,
    /// Masses whose acceleration follows from that of what they are held to, in an order in which that is known.
    pub(super) carried: Vec<Carried>,
    /// Whether each of the contacts carries one.
    pub(super) each_carries: bool,
    /// What heavy damping makes slow meanwhile.
    pub(super) slow: Option<Slow>,
}

/// A mass held by a contact to another mass or to a drive: a = a of the other + sign · drive acceleration.
///
/// The sum of the forces on it would give the same but for rounding of these forces over its mass, which for a light mass is
/// a drift against what it is held to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Carried {
    pub(super) mass: usize,
    pub(super) by: Option<usize>,
    pub(super) contact: usize,
    pub(super) sign: f64,
}

impl Held {
    /// What a held contact's force owes to what they needed, each by its index among them.
    pub(crate) fn gain(&self, row: usize) -> &[(usize, f64)] {
        self.gain.row(row)
    }

    /// The force of a held contact that makes up for what they needed.
    pub(super) fn force(&self, row: usize, required: impl Fn(usize) -> f64) -> f64 {
        self.gain(row).iter().map(|&(at, gain)| gain * required(at)).sum()
    }

    /// The forces that make up for what the contacts needed.
    pub(crate) fn forces(&self, required: impl Fn(usize) -> f64) -> Vec<f64> {
        (0..self.contacts.len())
            .map(|row| self.force(row, &required))
            .collect()
    }
}

/// The contacts that hold.
pub(crate) fn holding(force_lines: &[ForceLine]) -> Vec<usize> {
    (0..force_lines.len())
        .filter(|&c| force_lines[c].holds())
        .collect()
}

impl Frame {
    /// Some contacts as a constraint.
    pub(crate) fn held(&self, contacts: Vec<usize>) -> Held {
        let m = contacts.len();
        let mut index = vec![None; self.ends.len()];
        for (i, &c) in contacts.iter().enumerate() {
            index[c] = Some(i);
        }
        // Which of them a force of each accelerates: as a rule itself alone.
        let moves = |i: usize| {
            let moved = self.moved.row(contacts[i]).iter();
            moved.filter_map(|&(to, coupling)| Some((index[to]?, coupling)))
        };
        let gain = if m == 1 {
            Rows::of_diagonal(std::iter::once(1.0 / self.own[contacts[0]]))
        } else if m > 1 && (0..m).all(|i| moves(i).all(|(to, _)| to == i)) {
            Rows::of_diagonal(contacts.iter().map(|&c| {
                // With the rounding of Cholesky's way.
                let lower = self.own[c].sqrt();
                (1.0 / lower) / lower
            }))
        } else {
            let mut block = Matrix::zero(m);
            for j in 0..m {
                for (i, coupling) in moves(j) {
                    block.set(i, j, coupling);
                }
            }
            let dense = block.pseudo_inverse();
            Rows::new((0..m).map(|i| filled(dense.row(i))))
        };
        let carried = self.carried(&contacts);
        Held {
            each_carries: carried.len() == contacts.len(),
            contacts,
            gain,
            carried,
            slow: None,
        }
    }

    /// The same for the motion of a whole phase, which heavy damping makes slow.
    pub(crate) fn held_along(&self, contacts: Vec<usize>) -> Held {
        let slow = self.heavy.as_ref().map(|heavy| heavy.slow(&self.ends, &contacts));
        Held {
            slow,
            ..self.held(contacts)
        }
    }

    /// Which masses some contacts carry: from the drives on, and where there is none from the heaviest mass on.
    fn carried(&self, contacts: &[usize]) -> Vec<Carried> {
        let mut known = vec![false; self.masses];
        let mut carried = Vec::with_capacity(contacts.len());
        let mut left = contacts.to_vec();
        loop {
            let before = left.len();
            left.retain(|&contact| {
                let (mass, other) = self.ends[contact];
                match (known[mass], other.is_none_or(|other| known[other])) {
                    (false, true) => {
                        known[mass] = true;
                        carried.push(Carried {
                            mass,
                            by: other,
                            contact,
                            sign: 1.0,
                        });
                        false
                    }
                    (true, false) => {
                        if let Some(other) = other {
                            known[other] = true;
                            carried.push(Carried {
                                mass: other,
                                by: Some(mass),
                                contact,
                                sign: -1.0,
                            });
                        }
                        false
                    }
                    // Others hold what it would, or nothing is known of either mass yet.
                    (both, _) => !both,
                }
            });
            if left.len() < before {
                continue;
            }
            let masses = left.iter().flat_map(|&contact| {
                let (mass, other) = self.ends[contact];
                std::iter::once(mass).chain(other)
            });
            let light = |&mass: &usize| self.inverse.at(mass, mass);
            match masses.min_by(|one, other| light(one).total_cmp(&light(other))) {
                Some(heaviest) => known[heaviest] = true,
                None => return carried,
            }
        }
    }

    /// b_c as a sum of those of other contacts, where it is one: its share of each.
    pub(crate) fn share(&self, others: &[usize], c: usize) -> Option<Vec<f64>> {
        if others.is_empty() {
            return None;
        }
        let share = self.held(others.to_vec()).forces(|i| self.coupling(others[i], c));
        let given: f64 = others
            .iter()
            .zip(&share)
            .map(|(&other, share)| share * self.coupling(c, other))
            .sum();
        // What of its own response to a force is left once the others hold.
        let own = self.coupling(c, c);
        (own - given <= 1e-9 * own).then_some(share)
    }
}
