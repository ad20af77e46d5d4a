//! The mode that holds the slip speed between two branches of friction, as adhesion holds it at zero.
//!
//! With f₋ while the slip speed falls and f₊ > f₋ while it rises, neither branch is consistent with a balance of forces
//! between them: the slip speed stays, and friction is the reaction that keeps it. The balance is linear in time but for
//! the forcing, so the end is found as for adhesion: in steps that a bound of the curvature certifies.

use crate::event::{Start, Work};
use crate::flow::exact::Stick;
use crate::law::End;
use crate::series::free_time;

/// When the friction that holds a slip in `direction` leaves [f₋, f₊] within `horizon`, and over which end.
///
/// `stick` gives the reaction at this slip speed. `start` says on which end it starts: there it moves inward.
#[must_use]
pub fn end_of_hold<const H: usize>(
    stick: &Stick<H>,
    direction: f64,
    [low, high]: [f64; 2],
    start: Start,
    horizon: f64,
    work: &mut Work,
) -> Option<(f64, End)> {
    let curvature = stick.curvature();
    let tiny = f64::EPSILON * (high - low);
    let mut t = 0.0;
    loop {
        work.evaluations += 1;
        let (force, rate, _) = stick.at(t);
        let (force, rate) = (direction * force, direction * rate);
        let first = t == 0.0;
        let above_low = if first && start == Start::Low {
            0.0
        } else {
            force - low
        };
        let below_high = if first && start == Start::High {
            0.0
        } else {
            high - force
        };
        let to_low = free_time(above_low.max(0.0), rate, curvature);
        let to_high = free_time(below_high.max(0.0), -rate, curvature);
        let (step, margin, end) = if to_low < to_high {
            (to_low, above_low, End::Low)
        } else {
            (to_high, below_high, End::High)
        };
        if (!first && margin <= tiny) || step <= f64::EPSILON * t || step == 0.0 {
            return Some((t, end));
        }
        t += step;
        // Not finite: a balance that rests between the branches for ever.
        if t >= horizon || t.is_nan() {
            return None;
        }
    }
}
