//! The variables in which rest is no steep place.

use std::ops::Range;

use super::{Link, StateSystem};
use crate::state_law::{StateFriction, StateLaw};
use crate::system::System;

/// The part of u of [`StateSystem::regular`] that counts, where a slip velocity is a multiple of it: u goes to about 100.
const MULTIPLE_SHARE: f64 = 0.1;

/// A slip velocity that is a variable, under a law that is steep at rest.
#[derive(Clone, Debug)]
pub(super) struct Steep {
    pub(super) contact: usize,
    /// Where its slip velocity is among the variables, and where its state is.
    pub(super) slip: usize,
    pub(super) state: Range<usize>,
}

impl StateSystem {
    /// Whether an integration is in other variables: [`StateSystem::regular`].
    pub fn is_steep(&self) -> bool {
        !self.steep.is_empty()
    }

    /// The variables in which rest is no steep place: y with u(w, z) of the law in place of each slip velocity w that is one
    /// of its variables, where the law is steep at rest.
    pub fn regular(&self, y: Vec<f64>) -> Vec<f64> {
        let mut regular = y;
        for Steep { contact, slip, state } in &self.steep {
            let law = &self.system.contacts[*contact].law;
            regular[*slip] = law.slip_variable(regular[*slip], &regular[state.clone()]);
        }
        regular
    }

    /// The variables y from those of [`StateSystem::regular`].
    pub fn natural(&self, regular: &[f64]) -> Vec<f64> {
        let mut y = regular.to_vec();
        let mut rates = vec![0.0; self.states];
        for Steep { contact, slip, state } in &self.steep {
            let (law, rates) = (&self.system.contacts[*contact].law, &mut rates[..state.len()]);
            [y[*slip], _] = law.at_slip_variable(regular[*slip], &regular[state.clone()], rates);
        }
        y
    }

    /// The time derivative of the variables of [`StateSystem::regular`].
    ///
    /// From slip to rest u goes through all its values while w falls by next to nothing, in less time than a clock can tell.
    /// Within `least` of rest du/dw is held at 1/`least`: a velocity is wrong by some `least` once it has come to rest, and
    /// u, w and friction at rest, where they follow the load, are not.
    pub fn regular_rates(&self, t: f64, regular: &[f64], least: f64) -> Vec<f64> {
        if !self.is_steep() {
            return self.rates(t, regular);
        }
        let motion = self.motion_on(
            &self.drives(t),
            t,
            &self.natural(regular),
            Some((regular, least.recip())),
        );
        let mut rates = self.rates_of(&motion);
        for Steep { contact, slip, state } in &self.steep {
            let law = &self.system.contacts[*contact].law;
            let (z, changes) = (&regular[state.clone()], &rates[state.clone()]);
            let [slope, more] = law.slip_variable_slopes(regular[*slip], z, changes, least.recip());
            rates[*slip] = slope * motion.slip_acceleration[*contact] + more;
        }
        rates
    }

    /// What counts as small in the variables of [`StateSystem::regular`], and which part of each variable does besides it: 1,
    /// and less of those in place of a slip velocity.
    ///
    /// u is a logarithm of w where it is large: an error of it is a relative one of w. Where it is small, it is a multiple of
    /// w: what counts as small in w does so in it too.
    pub fn regular_scales(&self, y: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let (mut scales, mut shares) = (self.scales(y), vec![1.0; y.len()]);
        for Steep { contact, slip, state } in &self.steep {
            let law = &self.system.contacts[*contact].law;
            let mut steady = vec![0.0; state.len()];
            law.steady(scales[*slip], &mut steady);
            let sizes = [&y[state.clone()], &*steady].map(|z| law.slip_variable(scales[*slip], z));
            let least = sizes[0].min(sizes[1]).max(f64::MIN_POSITIVE);
            (scales[*slip], shares[*slip]) = if least < 1.0 {
                (least, MULTIPLE_SHARE)
            } else {
                (1.0, 0.0)
            };
        }
        (scales, shares)
    }
}

/// The slip velocities among the variables whose laws are steep at rest.
pub(super) fn steep(system: &System<StateLaw>, links: &[Link]) -> Vec<Steep> {
    let n = links.len();
    let mut state = 2 * n..2 * n;
    let contacts = system.contacts.iter().enumerate();
    contacts
        .filter_map(|(contact, law)| {
            state = state.end..state.end + law.law.states();
            let own = |link: &Link| matches!(*link, Link::Forward(c) | Link::Backward(c) if c == contact);
            let slip = n + links.iter().position(own)?;
            law.law.is_steep().then(|| Steep {
                contact,
                slip,
                state: state.clone(),
            })
        })
        .collect()
}
