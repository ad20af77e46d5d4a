//! From one mode into the next: the end of a piece, a turn to the other branch, the hold between the two.

use super::contact_states::Passage;
use super::guards::Cause;
use super::{Loop, SPEED_ROUNDING};
use crate::law::{End, Friction, Piece};
use crate::mode::{Kind, branch_gap};
use crate::series::{at, slope_at};

impl Loop<'_> {
    /// Go to the event and into the modes that follow it.
    pub(super) fn occur(&mut self, h: f64, c: usize, cause: Cause) {
        let tolerance = SPEED_ROUNDING * self.scale;
        let arrived: Vec<usize> = (0..self.contacts.len())
            .filter(|&other| {
                let contact = &self.contacts[other];
                if contact.direction == 0.0
                    || contact.between.is_some()
                    || contact.separated
                    || contact.piece.low > 0.0
                {
                    return false;
                }
                let (speed, slope) = slope_at(&self.motion.u.series(other), h);
                if other == c {
                    // A slip that turns back before its speed is more than rounding never began.
                    return match cause {
                        Cause::End(End::Reversal { rising: false }) => speed <= tolerance,
                        _ => cause == Cause::End(End::Low),
                    };
                }
                // One that has just left zero with no slope has no sign of it yet.
                speed <= tolerance && slope < 0.0 && !(h == 0.0 && contact.at_reversal)
            })
            .collect();
        let speed = at(&self.motion.u.series(c), h).max(0.0);
        let mut reached = at(&self.motion.force.series(c), h);
        if h == 0.0 {
            reached = f64::INFINITY.copysign(reached);
        }
        let mut passage = Passage {
            released: (cause == Cause::Release).then_some((c, reached)),
            returned: (h == 0.0
                && self.contacts[c].at_reversal
                && self.contacts[c].piece.low <= 0.0
                && cause == Cause::End(End::Low))
            .then_some(c),
            rates: self.motion.force.slopes(h),
            starting: false,
            arrived,
        };
        for (c, contact) in self.contacts.iter_mut().enumerate() {
            if contact.between.is_some() {
                let force = at(&self.motion.force.series(c), h);
                contact.piece = Piece::constant(contact.direction * force);
            }
        }
        self.advance(h);
        self.motion.aim(&self.frame, self.clock);
        if h > 0.0 {
            // An event at once, at another contact, leaves what is known of the start as it was.
            for contact in &mut self.contacts {
                contact.at_reversal = false;
            }
        }
        match cause {
            Cause::End(end) if !passage.arrived.contains(&c) => self.leave(c, end, speed),
            Cause::Normal if self.contacts[c].separated => passage.arrived.extend(self.meet(c)),
            Cause::Normal => self.part(c),
            _ => {}
        }
        self.set_contact_states(&passage);
    }

    /// Leave the piece of contact `c` over its `end`, or the hold between its branches.
    pub(super) fn leave(&mut self, c: usize, end: End, speed: f64) {
        let law = self.laws[c].toward(self.contacts[c].direction);
        let rate = self.rate_if_stuck(c);
        let (follows, normal) = (self.follows(c), self.normal(c));
        let contact = &mut self.contacts[c];
        contact.memory.force_rate = rate;
        contact.sense = 0.0;
        contact.kept = 0.0;
        if let Some([falling, rising]) = contact.between.take() {
            let (bound, balance) = if end == End::High {
                (rising, f64::INFINITY)
            } else {
                (falling, f64::NEG_INFINITY)
            };
            let force = contact.direction * bound;
            contact.piece = law.begin(speed, balance, &mut contact.memory);
            contact.at_reversal = true;
            self.tell(Kind::Reversal, c, force);
            return;
        }
        let speed = match end {
            End::Reversal { rising } => {
                // Friction that jumps to another branch takes the slip acceleration with it, unless others give the motion.
                contact.at_reversal = follows || branch_gap(law, speed).is_none();
                return self.reverse(c, rising, speed);
            }
            End::Low => contact.piece.low,
            End::High => contact.piece.high,
        };
        let force = normal * contact.direction * law.force(&contact.piece, speed);
        let left = contact.piece.slope.abs();
        contact.piece = law.next(&contact.piece, end, speed, &mut contact.memory);
        // Where a steep line ends the slip acceleration may be rounding: which way it goes on, its rate then says.
        contact.steep = normal * left.max(contact.piece.slope.abs());
        contact.at_reversal = true;
        self.tell(Kind::Node, c, force);
    }

    /// The bodies of contact `c` part.
    fn part(&mut self, c: usize) {
        let w = self.motion.slip(&self.frame, c, &self.v);
        let contact = &mut self.contacts[c];
        if contact.direction == 0.0 {
            contact.direction = w.signum();
        }
        contact.separated = true;
        self.tell(Kind::Parting, c, 0.0);
    }

    /// The bodies of contact `c` meet: they slip on, or it arrives at zero slip velocity.
    fn meet(&mut self, c: usize) -> Option<usize> {
        let w = self.motion.slip(&self.frame, c, &self.v);
        let contact = &mut self.contacts[c];
        contact.separated = false;
        contact.direction = w.signum();
        let law = self.laws[c].toward(contact.direction);
        contact.piece = law.begin(w.abs(), f64::INFINITY, &mut contact.memory);
        self.tell(Kind::Meeting, c, 0.0);
        (w.abs() <= SPEED_ROUNDING * self.scale).then_some(c)
    }

    /// Friction of the two branches at slip speed `u` of a contact whose law has such, where the speed is held between them.
    pub(super) fn branch_gap(&self, c: usize, direction: f64, u: f64) -> Option<[f64; 2]> {
        let branches = branch_gap(self.laws[c].toward(direction), u)?;
        (branches[0] < branches[1] && u > SPEED_ROUNDING * self.scale).then_some(branches)
    }

    /// The slip acceleration changes its sign: to the other branch, or into the hold between them.
    pub(super) fn reverse(&mut self, c: usize, rising: bool, speed: f64) {
        let between = self
            .branch_gap(c, self.contacts[c].direction, speed)
            .filter(|_| !self.follows(c));
        let rate = self.rate_if_stuck(c);
        let contact = &mut self.contacts[c];
        contact.memory.force_rate = rate;
        let law = self.laws[c].toward(contact.direction);
        let force = contact.direction * law.force(&contact.piece, speed);
        let kind = if between.is_some() {
            contact.between = between;
            contact.kept = contact.direction * speed;
            Kind::Hold
        } else {
            contact.piece = law.next(
                &contact.piece,
                End::Reversal { rising },
                speed,
                &mut contact.memory,
            );
            Kind::Reversal
        };
        self.tell(kind, c, force);
    }

    /// Whether the motion across contact `c` is given by others that hold, so that its own friction cannot.
    pub(super) fn follows(&self, c: usize) -> bool {
        let others =
            (0..self.contacts.len()).filter(|&other| other != c && self.contacts[other].force_line().holds());
        self.frame.loops && self.frame.share(&others.collect::<Vec<_>>(), c).is_some()
    }
}
