//! What ends a mode: the first guard of any contact that a step meets.

use super::end_of_stick::{StickPhase, end_of_adhesion};
use super::{Loop, SPEED_ROUNDING, ZERO_SLOPE_SHARE};
use crate::event::first_root::first_root;
use crate::law::End;
use crate::series::{Series, derivative, swing_bound};

/// What ends a mode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Cause {
    Release,
    End(End),
    /// The bodies part, or meet again.
    Normal,
    /// A spring goes on to this piece.
    Spring(usize),
}

/// The first guard met so far, and how far the others need to be searched.
struct First {
    met: Option<(f64, usize, Cause)>,
    reach: f64,
    grazes: Vec<f64>,
}

impl First {
    /// Search a guard of contact or spring `index`.
    fn search(&mut self, guard: Series, rounding: f64, at_reversal: bool, index: usize, cause: Cause) {
        if let Some(h) = first_root(guard, rounding, at_reversal, self.reach, &mut self.grazes) {
            self.meet(h, index, cause);
        }
    }

    /// One that is met at `h`; of several at one time the first in the order of the search counts.
    fn meet(&mut self, h: f64, index: usize, cause: Cause) {
        if h < self.reach || self.met.is_none() {
            (self.met, self.reach) = (Some((h, index, cause)), h);
        }
    }
}

impl Loop<'_> {
    /// The first event within `horizon`, which comes nearer where a search gives up on the way.
    pub(super) fn next(&mut self, horizon: &mut f64) -> Option<(f64, usize, Cause)> {
        let rounding = SPEED_ROUNDING * self.scale;
        let mut first = First {
            met: None,
            reach: *horizon,
            grazes: Vec::new(),
        };
        for (c, contact) in self.contacts.iter().enumerate() {
            let normal = self.frame.normals[c].is_some().then(|| &self.motion.normal[c]);
            if let Some(normal) = normal {
                let sign = if contact.separated { -1.0 } else { 1.0 };
                let guard = normal.map(|term| sign * term);
                first.search(guard, self.faint(c), false, c, Cause::Normal);
                if contact.separated {
                    continue;
                }
            }
            if contact.direction == 0.0 {
                if contact.pinned != 0.0 {
                    continue;
                }
                let phase = StickPhase {
                    force: &self.motion.force.series(c),
                    normal,
                    stick_time: self.stick_time(c),
                    zero_rate: ZERO_SLOPE_SHARE * self.acceleration / self.frame.coupling(c, c),
                };
                match end_of_adhesion(self.laws[c], phase, first.reach, &mut first.grazes) {
                    Ok(Some(h)) => first.meet(h, c, Cause::Release),
                    Ok(None) => {}
                    Err(clear) => (first.met, first.reach, *horizon) = (None, clear, clear),
                }
                continue;
            }
            if let Some([falling, rising]) = contact.between {
                let rounding = SPEED_ROUNDING * (rising + self.acceleration / self.frame.coupling(c, c));
                for (end, sign, bound) in [(End::Low, 1.0, -falling), (End::High, -1.0, rising)] {
                    let mut guard = self
                        .motion
                        .force
                        .series(c)
                        .map(|term| sign * contact.direction * term);
                    guard[0] += bound;
                    first.search(guard, rounding, false, c, Cause::End(end));
                }
                continue;
            }
            let piece = &contact.piece;
            let mut guard = self.motion.u.series(c);
            guard[0] -= piece.low;
            first.search(guard, rounding, contact.at_reversal, c, Cause::End(End::Low));
            if piece.high.is_finite() {
                let mut guard = self.motion.u.series(c).map(|term| -term);
                guard[0] += piece.high;
                first.search(guard, rounding, contact.at_reversal, c, Cause::End(End::High));
            }
            if piece.reverses {
                let mut guard = derivative(&self.motion.u.series(c)).map(|term| contact.sense * term);
                if contact.at_reversal {
                    guard[0] = 0.0;
                }
                let rounding = SPEED_ROUNDING * self.acceleration;
                if guard[0].abs() <= rounding && guard[1] * first.reach <= rounding {
                    // Beneath rounding a slip acceleration has no sense: it turns where it is more than that.
                    guard[0] += 2.0 * rounding;
                }
                let end = End::Reversal {
                    rising: contact.sense < 0.0,
                };
                first.search(guard, rounding, false, c, Cause::End(end));
            }
        }
        for (s, spring) in self.frame.springs.iter().enumerate() {
            let (piece, along) = (self.motion.pieces[s], &self.motion.displacement[s]);
            let [low, high] = spring.ends(piece);
            let ends = [Some(spring.mass), spring.other].into_iter().flatten();
            let far = ends.map(|i| self.x[i].abs()).sum::<f64>() + swing_bound(along, first.reach);
            for (end, sign, next) in [(low, 1.0, piece.wrapping_sub(1)), (high, -1.0, piece + 1)] {
                if !end.is_finite() {
                    continue;
                }
                let mut guard = along.map(|term| sign * term);
                guard[0] -= sign * end;
                // No more than where the masses are: speeds of stiff springs would lead further at the rate of the linear ones.
                let size = rounding / self.frame.rate;
                let rounding = size.min(SPEED_ROUNDING * far) + SPEED_ROUNDING * end.abs();
                first.search(guard, rounding, false, s, Cause::Spring(next));
            }
        }
        self.work.grazes += first.grazes.iter().filter(|&&h| h < first.reach).count() as u64;
        first.met
    }
}
