//! Systems without mass: friction balances the load at every time.

use super::regular::Steep;
use super::{Motion, StateSystem, dot};
use crate::clock::Clock;
use crate::matrix::{factor, solve};
use crate::state_law::StateFriction;
use crate::system::Contact;

/// Without mass what is left of the balance of forces falls at so many times the rate of the states.
const BALANCE_RATE: f64 = 10.0;
/// No slope ∂u/∂w of a law is taken for more, which leaves room for its products.
const STEEPEST_SLOPE: f64 = 1e150;
/// Newton's method comes down from too fast a slip by one e-fold a round.
const MOST_ROUNDS: usize = 10_000;

impl StateSystem {
    /// Whether nothing has a mass.
    pub fn is_massless(&self) -> bool {
        self.inverse.is_none()
    }

    /// The variables y at t = 0 with the slip velocities at which friction balances the load, where there is no mass.
    ///
    /// Newton's method in the variable u of each law, in which friction is a line: the load of the dampers bends upwards from
    /// rest, so that it comes down to the solution.
    pub fn balanced(&self, y: Vec<f64>) -> Vec<f64> {
        let n = self.masses();
        if self.inverse.is_some() {
            return y;
        }
        let (mut y, drives) = (y, self.drives(0.0));
        let mut u = self.regular(y.clone());
        for _ in 0..MOST_ROUNDS {
            let motion = self.motion_on(&drives, 0.0, &y, Some((&u, STEEPEST_SLOPE)));
            let (mut matrix, mut left) = (vec![0.0; n * n], vec![0.0; n]);
            for Steep { contact, slip, state } in &self.steep {
                let Contact { mass: j, law, .. } = &self.system.contacts[*contact];
                let rates = &motion.rate[state.start - 2 * n..state.end - 2 * n];
                let [slope, _] = law.slip_variable_slopes(u[*slip], &y[state.clone()], rates, STEEPEST_SLOPE);
                for i in 0..n {
                    matrix[i * n + slip - n] = self.system.damping[i][*j] / slope;
                }
                matrix[j * n + slip - n] += law.direct_effect();
            }
            left.copy_from_slice(&motion.load);
            let Some(pivots) = factor(&mut matrix, n) else {
                break;
            };
            solve(&matrix, &pivots, &mut left);
            let mut settled = true;
            for (u, step) in u[n..2 * n].iter_mut().zip(&left) {
                let before = *u;
                *u -= step;
                settled &= (*u - before).abs() <= 4.0 * f64::EPSILON * u.abs();
            }
            y = self.natural(&u);
            if settled {
                break;
            }
        }
        y
    }

    /// The slip accelerations that keep friction and load in balance: ẇ of dL/dt = −L/τ, where dF/dt = F' (ẇ ∂u/∂w + …).
    pub(super) fn balancing(
        &self,
        drives: &[[f64; 2]],
        clock: Clock,
        y: &[f64],
        regular: Option<(&[f64], f64)>,
        motion: &Motion,
    ) -> Vec<f64> {
        let (n, system) = (self.masses(), &self.system);
        let fades = BALANCE_RATE * self.natural_frequency();
        let mut right: Vec<f64> = (0..n)
            .map(|i| dot(&system.stiffness[i], &motion.v) - fades * motion.load[i])
            .collect();
        for push in &system.forcing {
            right[push.mass] -= push.frequency * push.harmonic().quadratures(clock).1;
        }
        for spring in &system.springs {
            let across = |values: &[f64]| values[spring.mass] - spring.other.map_or(0.0, |i| values[i]);
            let displacement = across(y);
            let force = spring.slope(spring.piece(displacement), displacement) * across(&motion.v);
            right[spring.mass] += force;
            if let Some(other) = spring.other {
                right[other] -= force;
            }
        }
        let mut matrix = vec![0.0; n * n];
        for Steep { contact, slip, state } in &self.steep {
            let Contact { mass, law, .. } = &system.contacts[*contact];
            let (z, rates) = (
                &y[state.clone()],
                &motion.rate[state.start - 2 * n..state.end - 2 * n],
            );
            let (u, most) = match regular {
                Some((regular, most)) => (regular[*slip], most),
                None => (law.slip_variable(y[*slip], z), STEEPEST_SLOPE),
            };
            let [slope, more] = law.slip_variable_slopes(u, z, rates, most);
            for i in 0..n {
                let damping = system.damping[i][*mass];
                matrix[i * n + contact] = damping;
                right[i] += damping * drives[*contact][1];
            }
            matrix[mass * n + contact] += law.direct_effect() * slope;
            right[*mass] -= law.direct_effect() * more;
        }
        // One column a contact, as each mass has one.
        if let Some(pivots) = factor(&mut matrix, n) {
            solve(&matrix, &pivots, &mut right);
        } else {
            right.fill(f64::NAN);
        }
        right
    }
}
