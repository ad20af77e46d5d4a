//! A law along a measured motion: the friction it predicts for a given slip velocity over time.

use crate::error::{Error, wrong};
use crate::law::{End, Friction, Law, Memory, Piece, Rest};

/// The friction force of `law` along samples of time, slip velocity and adhesion.
///
/// While slipping it is the kinetic force with the sign of w. While stuck friction is a reaction that no law knows: the
/// break-away force of that moment is returned, with the sign of `force_rate`. While slipping `force_rate` is what adhesion
/// would feel (k V on a spring); it matters to laws whose static friction without rest depends on it.
///
/// # Errors
/// The law's first parameter that makes no sense, or columns of different length.
pub fn force_along(
    law: &Law,
    t: &[f64],
    w: &[f64],
    stuck: &[bool],
    force_rate: &[f64],
) -> Result<Vec<f64>, Error> {
    law.validate()?;
    if w.len() != t.len() || stuck.len() != t.len() || force_rate.len() != t.len() {
        return wrong(format!(
            "t, w, stuck and force_rate must have the same length, got {}, {}, {} and {}",
            t.len(),
            w.len(),
            stuck.len(),
            force_rate.len()
        ));
    }
    let mut memory = Memory::default();
    let mut force = Vec::with_capacity(t.len());
    let mut stuck_since = None;
    let mut rest = Rest::default();
    let mut slip: Option<Follow> = None;
    for i in 0..t.len() {
        if stuck[i] {
            let since = *stuck_since.get_or_insert(t[i]);
            rest = Rest::new(t[i] - since, force_rate[i].abs());
            slip = None;
            let direction = force_rate[i].signum();
            force.push(direction * law.toward(direction).static_limit(rest));
            continue;
        }
        memory.force_rate = force_rate[i].abs();
        let (direction, u) = (w[i].signum(), w[i].abs());
        let law = law.toward(direction);
        let follow = match &mut slip {
            Some(follow) if follow.direction == direction => follow,
            other => {
                let piece = if i == 0 {
                    let rising = w.get(1).is_none_or(|next| next.abs() >= u);
                    law.begin(
                        u,
                        if rising { f64::INFINITY } else { f64::NEG_INFINITY },
                        &mut memory,
                    )
                } else {
                    if stuck_since.is_none() {
                        rest = Rest::new(0.0, memory.force_rate);
                    }
                    law.leave(law.static_limit(rest), &mut memory)
                };
                other.insert(Follow {
                    direction,
                    piece,
                    u: if i == 0 { u } else { 0.0 },
                    rising: true,
                    fresh: i == 0,
                })
            }
        };
        stuck_since = None;
        follow.to(law, u, &mut memory);
        force.push(direction * law.force(&follow.piece, u));
    }
    Ok(force)
}

/// A slip phase followed sample by sample.
struct Follow {
    direction: f64,
    piece: Piece,
    u: f64,
    rising: bool,
    /// Whether the sense of the acceleration is not known yet.
    fresh: bool,
}

impl Follow {
    fn to(&mut self, law: &Law, u: f64, memory: &mut Memory) {
        let rising = u > self.u;
        if u != self.u {
            if rising != self.rising && !self.fresh && self.piece.reverses {
                self.piece = law.next(&self.piece, End::Reversal { rising }, self.u, memory);
            }
            (self.rising, self.fresh) = (rising, false);
        }
        // As many pieces as the sample skipped; a law has far fewer than this.
        for _ in 0..10_000 {
            let (end, at) = if u > self.piece.high {
                (End::High, self.piece.high)
            } else if u < self.piece.low {
                (End::Low, self.piece.low)
            } else {
                break;
            };
            self.piece = law.next(&self.piece, end, at, memory);
        }
        self.u = u;
    }
}
