//! What ends a mode: the first guard of any contact that a step meets.

use super::end_of_stick::end_of_adhesion;
use super::{Loop, ROUNDING, STILL};
use crate::law::End;
use crate::series::{derivative, first_root, swing_bound};

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

impl Loop<'_> {
    /// The first event within `horizon`, which comes nearer where a search gives up on the way.
    pub(super) fn next(&mut self, horizon: &mut f64) -> Option<(f64, usize, Cause)> {
        let rounding = ROUNDING * self.scale;
        let mut found = None;
        let mut reach = *horizon;
        let grazes = &mut Vec::new();
        for (c, contact) in self.contacts.iter().enumerate() {
            let normal = self.frame.normals[c].is_some().then(|| &self.motion.normal[c]);
            if let Some(normal) = normal {
                let sign = if contact.apart { -1.0 } else { 1.0 };
                let guard = normal.map(|term| sign * term);
                if let Some(h) = first_root(&guard, self.faint(c), false, reach, grazes)
                    && (h < reach || found.is_none())
                {
                    (found, reach) = (Some((h, c, Cause::Normal)), h);
                }
                if contact.apart {
                    continue;
                }
            }
            if contact.direction == 0.0 {
                if contact.pinned != 0.0 {
                    continue;
                }
                let rested = self.rested(c);
                let still = STILL * self.acceleration / self.frame.coupling(c, c);
                match end_of_adhesion(
                    self.laws[c],
                    (&self.motion.force.series(c), normal),
                    rested,
                    still,
                    reach,
                    grazes,
                ) {
                    Ok(Some(h)) if h < reach || found.is_none() => {
                        (found, reach) = (Some((h, c, Cause::Release)), h);
                    }
                    Ok(_) => {}
                    Err(clear) => (found, reach, *horizon) = (None, clear, clear),
                }
                continue;
            }
            if let Some([falling, rising]) = contact.between {
                let rounding = ROUNDING * (rising + self.acceleration / self.frame.coupling(c, c));
                for (end, sign, bound) in [(End::Low, 1.0, -falling), (End::High, -1.0, rising)] {
                    let mut guard = self
                        .motion
                        .force
                        .series(c)
                        .map(|term| sign * contact.direction * term);
                    guard[0] += bound;
                    if let Some(h) = first_root(&guard, rounding, false, reach, grazes)
                        && (h < reach || found.is_none())
                    {
                        (found, reach) = (Some((h, c, Cause::End(end))), h);
                    }
                }
                continue;
            }
            let piece = &contact.piece;
            let u = self.motion.u.series(c);
            let mut guard = u;
            guard[0] -= piece.low;
            if let Some(h) = first_root(&guard, rounding, contact.at_reversal, reach, grazes)
                && (h < reach || found.is_none())
            {
                (found, reach) = (Some((h, c, Cause::End(End::Low))), h);
            }
            if piece.high.is_finite() {
                let mut guard = u.map(|term| -term);
                guard[0] += piece.high;
                if let Some(h) = first_root(&guard, rounding, contact.at_reversal, reach, grazes)
                    && (h < reach || found.is_none())
                {
                    (found, reach) = (Some((h, c, Cause::End(End::High))), h);
                }
            }
            if piece.reverses {
                let mut guard = derivative(&u).map(|term| contact.sense * term);
                if contact.at_reversal {
                    guard[0] = 0.0;
                }
                let rounding = ROUNDING * self.acceleration;
                if guard[0].abs() <= rounding && guard[1] * reach <= rounding {
                    // Beneath rounding a slip acceleration has no sense: it turns where it is more than that.
                    guard[0] += 2.0 * rounding;
                }
                let end = End::Reversal {
                    rising: contact.sense < 0.0,
                };
                if let Some(h) = first_root(&guard, rounding, false, reach, grazes)
                    && (h < reach || found.is_none())
                {
                    (found, reach) = (Some((h, c, Cause::End(end))), h);
                }
            }
        }
        for (s, spring) in self.frame.springs.iter().enumerate() {
            let (piece, along) = (self.motion.pieces[s], &self.motion.displacement[s]);
            let [low, high] = spring.ends(piece);
            let ends = [Some(spring.mass), spring.other].into_iter().flatten();
            let far = ends.map(|i| self.x[i].abs()).sum::<f64>() + swing_bound(along, reach);
            for (end, sign, next) in [(low, 1.0, piece.wrapping_sub(1)), (high, -1.0, piece + 1)] {
                if !end.is_finite() {
                    continue;
                }
                let mut guard = along.map(|term| sign * term);
                guard[0] -= sign * end;
                // No more than where the masses are: speeds of stiff springs would lead further at the rate of the linear ones.
                let size = rounding / self.frame.rate;
                let rounding = size.min(ROUNDING * far) + ROUNDING * end.abs();
                if let Some(h) = first_root(&guard, rounding, false, reach, grazes)
                    && (h < reach || found.is_none())
                {
                    (found, reach) = (Some((h, s, Cause::Spring(next))), h);
                }
            }
        }
        self.work.grazes += grazes.iter().filter(|&&h| h < reach).count() as u64;
        found
    }
}
