//! Who of the contacts with zero slip velocity sticks, decided for all at once.
//!
//! Rule for the modes after an event, for all contacts with zero slip velocity at once: all stick, if adhesion can bear it
//! (a contact that has just arrived bears its break-away force at stick time zero, one that stuck before bears what its stick
//! time has made of it). Otherwise the most overloaded one slips in the direction of the force it could not bear, and the rest
//! is asked again; one that would then slip against its direction sticks after all, and so does one that could stick while the
//! others slip. Should this go round in circles, the first
//! consistent combination is taken, stick before slip forward before slip backward, the first contact changing fastest.
//!
//! Stuck contacts in a closed loop (two between the same bodies, or mass, drive, mass) leave the share of each undetermined.
//! They share such that the sum of squares of their forces is least; one that is overloaded while the others still hold it
//! stays where it is, pinned at its limit, and the others bear the rest until the next event.

use crate::flow::taylor::Frame;
use crate::series::{ORDER, Series};

/// Who of the contacts with zero slip velocity sticks, and where the others go.
pub(super) struct ContactProblem<'a> {
    pub(super) frame: &'a Frame,
    pub(super) zero: &'a [usize],
    /// The static limit, backward and forward.
    pub(super) limit: &'a [[f64; 2]],
    /// Friction slip would start with, likewise.
    pub(super) kinetic: &'a [[f64; 2]],
    /// The relative accelerations that all contacts must make up for to hold.
    pub(super) required: Vec<f64>,
    /// The drive velocities of all contacts.
    pub(super) drives: &'a [Series],
    /// An acceleration that is zero but for the error with which an event was found.
    pub(super) zero_acceleration: f64,
    /// The contact that cannot stick, by its index in `zero`.
    pub(super) released: Option<(usize, f64)>,
    /// The contact that is at its limit and relieved from there, by its index in `zero`: it sticks.
    pub(super) returned: Option<usize>,
}

/// Of a pair of numbers, backward and forward, that of a direction.
pub(super) fn toward([backward, forward]: [f64; 2], direction: f64) -> f64 {
    if direction < 0.0 { backward } else { forward }
}

impl ContactProblem<'_> {
    /// Whether a contact that does not stick is held in place all the same, by others that do.
    pub(super) fn idle(&self, directions: &[f64], row: usize) -> bool {
        directions[row] != 0.0 && self.follows(directions, row) == Some(true)
    }

    /// Whether the motion across a contact is given by the other stuck ones, and if so whether its drive goes along.
    fn follows(&self, directions: &[f64], row: usize) -> Option<bool> {
        if !self.frame.loops {
            return None;
        }
        let stuck: Vec<usize> = (0..directions.len())
            .filter(|&other| other != row && directions[other] == 0.0)
            .map(|other| self.zero[other])
            .collect();
        let share = self.frame.share(&stuck, self.zero[row])?;
        let size = self
            .drives
            .iter()
            .flatten()
            .fold(0.0, |most: f64, term| most.max(term.abs()));
        Some((0..=ORDER).all(|k| {
            let along: f64 = stuck
                .iter()
                .zip(&share)
                .map(|(&from, share)| share * self.drives[from][k])
                .sum();
            (self.drives[self.zero[row]][k] - along).abs() <= 1e-9 * size
        }))
    }

    /// For each contact the force with which it sticks, or the slip acceleration along its direction; and for one that
    /// cannot be held (redundant contacts that needed different accelerations) the acceleration that is left.
    fn loads(&self, directions: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut required = self.required.clone();
        let contact = |row: usize| self.zero[row];
        for from in (0..directions.len()).filter(|&row| directions[row] != 0.0) {
            let size = if self.idle(directions, from) {
                toward(self.limit[from], directions[from])
            } else {
                toward(self.kinetic[from], directions[from])
            };
            self.frame
                .relieve(&mut required, contact(from), directions[from] * size);
        }
        let stuck: Vec<usize> = (0..directions.len())
            .filter(|&row| directions[row] == 0.0)
            .collect();
        let mut load = vec![0.0; directions.len()];
        if !stuck.is_empty() {
            let held = self.frame.held(stuck.iter().map(|&row| contact(row)).collect());
            for (row, force) in stuck.iter().zip(held.forces(|i| required[contact(stuck[i])])) {
                load[*row] = force;
            }
            for &from in &stuck {
                self.frame.relieve(&mut required, contact(from), load[from]);
            }
        }
        (load, self.zero.iter().map(|&c| required[c]).collect())
    }

    /// The most overloaded of the stuck contacts, with its direction; or a slipping one that would go backwards, with 0.
    fn objection(&self, directions: &[f64]) -> Option<(usize, f64)> {
        const OVERLOAD_ROUNDING: f64 = 16.0 * f64::EPSILON;
        // Less than what the search for the end of adhesion takes for a limit that was passed.
        const RELIEVED_OVERLOAD: f64 = 5e-10;
        let (load, left) = self.loads(directions);
        let sizes = self.zero.iter().map(|&c| self.required[c].abs());
        let size = sizes.fold(0.0, f64::max);
        // In a loop a load is what the others leave of it: it has the rounding of theirs.
        let limits = self.limit.iter().flatten().copied();
        let largest = limits.filter(|limit| limit.is_finite()).fold(0.0, f64::max);
        let mut worst = None;
        let mut most = 1.0 + OVERLOAD_ROUNDING;
        for row in (0..directions.len()).filter(|&row| directions[row] == 0.0) {
            let limit = toward(self.limit[row], load[row]);
            let rounding = if self.frame.loops && limit > 0.0 {
                OVERLOAD_ROUNDING * largest / limit
            } else {
                OVERLOAD_ROUNDING
            };
            let unheld = left[row].abs() > 1e-9 * size || self.follows(directions, row) == Some(false);
            // A contact at its limit beside one that breaks breaks too.
            let room = if self.returned == Some(row) {
                let held = limit * self.frame.coupling(self.zero[row], self.zero[row]);
                1.0 + RELIEVED_OVERLOAD.max(self.zero_acceleration / held)
            } else if self.released.is_some() {
                1.0 - rounding
            } else {
                1.0 + rounding
            };
            let share = if unheld {
                f64::INFINITY
            } else if load[row] == 0.0 {
                0.0
            } else {
                load[row].abs() / limit / room
            };
            if share * (1.0 + OVERLOAD_ROUNDING) > most {
                most = share * (1.0 + OVERLOAD_ROUNDING);
                worst = Some((row, if unheld { left[row] } else { load[row] }.signum()));
            }
        }
        worst.or_else(|| {
            let backwards = |&row: &usize| directions[row] * left[row] < -1e-10 * size;
            let slips =
                (0..directions.len()).filter(|&row| directions[row] != 0.0 && !self.idle(directions, row));
            slips.clone().find(backwards).map(|row| (row, 0.0))
        })
    }

    /// Directions with which the contacts of a loop bear the load all the same when they share it anew, although one of them is
    /// at its limit: one that was pinned at its limit may have been pinned against the load of another time.
    fn shared_anew(&self) -> Option<Vec<f64>> {
        const CLEARLY: f64 = 1.0 - 1e-9;
        if !self.frame.loops {
            return None;
        }
        let mut directions = vec![0.0; self.zero.len()];
        while let Some((row, direction)) = self.objection(&directions) {
            // Each is pinned once, and none is let go.
            if directions[row] != 0.0 || direction == 0.0 {
                return None;
            }
            directions[row] = direction;
        }
        let (load, _) = self.loads(&directions);
        let within = |row: usize| {
            if directions[row] == 0.0 {
                load[row].abs() < CLEARLY * toward(self.limit[row], load[row])
            } else {
                self.idle(&directions, row)
            }
        };
        (0..load.len()).all(within).then_some(directions)
    }

    /// Of contacts that slip together each one sticks all the same that can while the others slip: of two that were overloaded
    /// at once, the first to slip may relieve the other.
    fn held_after_all(&self, mut directions: Vec<f64>) -> Vec<f64> {
        let slipping = |directions: &[f64]| directions.iter().filter(|&&direction| direction != 0.0).count();
        for row in 0..directions.len() {
            let forced = self.released.is_some_and(|(released, _)| released == row);
            if forced || slipping(&directions) < 2 || directions[row] == 0.0 || self.idle(&directions, row) {
                continue;
            }
            let direction = std::mem::take(&mut directions[row]);
            if self.objection(&directions).is_some() {
                directions[row] = direction;
            }
        }
        directions
    }

    /// The direction of every contact, 0 for those that stick.
    pub(super) fn answer(&self) -> Vec<f64> {
        let count = self.zero.len();
        let mut directions = vec![0.0; count];
        if let Some((row, direction)) = self.released {
            if let Some(shared) = self.shared_anew() {
                return shared;
            }
            directions[row] = direction;
        }
        for _ in 0..4 * count + 4 {
            match self.objection(&directions) {
                None => return self.held_after_all(directions),
                Some((row, direction)) => directions[row] = direction,
            }
        }
        // In circles: the first consistent combination. Beyond a few contacts there are too many to try.
        if count <= 8 {
            for code in 0..3_usize.pow(u32::try_from(count).unwrap_or(0)) {
                let mut rest = code;
                let trial: Vec<f64> = (0..count)
                    .map(|_| {
                        let digit = [0.0, 1.0, -1.0][rest % 3];
                        rest /= 3;
                        digit
                    })
                    .collect();
                if self.released.is_none_or(|(row, _)| trial[row] != 0.0) && self.objection(&trial).is_none()
                {
                    return trial;
                }
            }
        }
        directions
    }
}
