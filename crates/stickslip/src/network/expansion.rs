//! The Taylor series from where a run is, for what its contacts do.

use super::{ContactState, Loop, SPEED_ROUNDING};
use crate::flow::taylor::VectorField;
use crate::law::End;

impl Loop<'_> {
    /// The Taylor series from here on; laws that follow the sense of the slip acceleration are told where it jumped.
    pub(super) fn expand(&mut self) {
        self.motion.aim(&self.frame, self.clock);
        self.measure_scale();
        // A jump of the acceleration elsewhere may turn a contact, whose new piece may turn the next one.
        for _ in 0..=self.contacts.len() {
            self.set_force_lines();
            // What adhesion or the branches hold drifts by rounding otherwise, the more the longer it is held.
            let kept = |c: usize| self.contacts[c].kept;
            self.motion.keep(&self.frame, &self.held, kept, &mut self.v);
            self.series();
            let rate = self.frame.rate;
            self.scale = self.scale.max(self.motion.speed(&self.frame, &self.force_lines));
            self.acceleration = self.acceleration.max(self.motion.size(rate, 1));
            let size = self.acceleration;
            // A start that has no slope is expanded without one: what follows may be less than what rounding makes of it.
            for (c, contact) in self.contacts.iter_mut().enumerate() {
                if contact.direction != 0.0 && contact.between.is_none() && !contact.separated {
                    let slope = self.motion.u.of(1)[c].abs();
                    let zero = self.zero_share * size;
                    // What a slip speed of rounding makes of it along a steep line only lets the search ignore its sign.
                    let steep = SPEED_ROUNDING * self.scale * contact.steep * self.frame.coupling(c, c);
                    contact.at_reversal &= slope <= zero.max(steep);
                    self.force_lines[c].zero_slope = contact.at_reversal && slope <= zero;
                    if !contact.at_reversal {
                        contact.steep = 0.0;
                    }
                }
            }
            if self.force_lines.iter().any(|force_line| force_line.zero_slope) {
                self.series();
            }
            let mut reversed = false;
            for c in 0..self.contacts.len() {
                let contact = &mut self.contacts[c];
                if contact.direction == 0.0 || contact.between.is_some() || !contact.piece.reverses {
                    continue;
                }
                let slope = self.motion.u.of(1)[c];
                let now = if contact.at_reversal {
                    self.motion.u.of(2)[c]
                } else {
                    slope
                }
                .signum();
                if contact.sense == 0.0 {
                    contact.sense = now;
                } else if now != contact.sense && slope.abs() > 1e3 * SPEED_ROUNDING * size {
                    let speed = self.motion.u.of(0)[c].max(0.0);
                    self.reverse(c, now > 0.0, speed);
                    (self.contacts[c].sense, self.contacts[c].at_reversal) = (now, false);
                    reversed = true;
                }
            }
            if !reversed {
                return;
            }
        }
    }

    pub(super) fn measure_scale(&mut self) {
        let mut scale = self.scale.max(self.frame.push);
        for (i, v) in self.v.iter().enumerate() {
            scale = scale.max(self.frame.sprung(i, &self.x)).max(v.abs());
        }
        // Nothing moves yet: what is pushed will, and what is not has no size.
        self.scale = if scale > 0.0 { scale } else { f64::MIN_POSITIVE };
        self.acceleration = self.acceleration.max(self.frame.rate * self.scale);
    }

    /// The coefficients for what the contacts do.
    fn series(&mut self) {
        let field = VectorField {
            frame: &self.frame,
            laws: &self.laws,
            force_lines: &self.force_lines,
            held: &self.held,
        };
        self.motion.expand(&field, &self.x, &self.v);
        self.work.evaluations += 1;
    }

    fn set_force_lines(&mut self) {
        for c in 0..self.contacts.len() {
            if self.contacts[c].between.is_some() && self.follows(c) {
                // To either branch; where the slip acceleration has the other sign it turns.
                self.leave(c, End::Low, self.motion.u.of(0)[c].max(0.0));
                (self.contacts[c].sense, self.contacts[c].at_reversal) = (-1.0, false);
            }
        }
        self.force_lines.clear();
        self.force_lines
            .extend(self.contacts.iter().map(ContactState::force_line));
        let stuck = (0..self.contacts.len()).filter(|&c| self.force_lines[c].holds());
        if !stuck.clone().eq(self.held.contacts.iter().copied()) {
            self.held = self.frame.held_along(stuck.collect());
        }
    }
}
