//! The automaton: which mode the mass is in, and which mode follows an event.
//!
//! Selection rule. With f_s > f_k both adhesion and slip can be consistent where the slip velocity reaches zero: the automaton
//! chooses adhesion whenever the force it asks for is within the break-away force at stick time zero. Otherwise the mass slips
//! in the direction of the force that adhesion could not bear, starting with the break-away force at stick time zero.

use serde::Deserialize;

use crate::event::Start;
use crate::flow::exact::Frame;
use crate::law::{End, Friction, Law, Memory, Piece, Rest};
use crate::named::named;

/// What the contact does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mode {
    /// The mass moves with the drive.
    Stick,
    /// The mass slips; `direction` is the sign of the slip velocity w.
    Slip {
        /// Sign of w.
        direction: f64,
        /// The line of friction.
        piece: Piece,
        /// What is known of the slip speed at the start.
        start: Start,
    },
    /// The mass slips at the constant speed `u`: friction is the reaction between the branches.
    Hold {
        /// Sign of w.
        direction: f64,
        /// The slip speed.
        u: f64,
        /// Friction while the slip speed falls and while it rises.
        between: [f64; 2],
        /// The end of `between` on which friction starts, if it does.
        start: Start,
    },
}

named! {
    /// What happens at an event.
    #[derive(Deserialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Kind {
        /// Adhesion breaks.
        Release = "release",
        /// The mass sticks.
        Capture = "capture",
        /// The slip velocity changes its sign without a stick.
        Crossing = "crossing",
        /// The slip acceleration changes its sign (reported for laws that have branches by that sign).
        Reversal = "reversal",
        /// The next linear piece of the law begins.
        Node = "node",
        /// The slip velocity is held constant between two branches of the law.
        Hold = "hold",
        /// The bodies part: their normal force falls to zero.
        Parting = "parting",
        /// Bodies that were apart meet again.
        Meeting = "meeting",
        /// A spring goes on to its next piece; the contact of the event is the number of the spring.
        Spring = "spring",
    }
}

/// The mode in which a motion from (x, v) starts, given the `holding` force of adhesion there and its rate.
pub fn first<const H: usize>(
    frame: &Frame<H>,
    law: &Law,
    (v, holding, rate): (f64, f64, f64),
    memory: &mut Memory,
) -> Mode {
    let w = frame.drive_velocity - v;
    if w == 0.0 {
        return at_zero(law, holding, rate, memory);
    }
    memory.force_rate = rate.abs();
    let direction = w.signum();
    // m u̇ = σ·holding − D u − f(u): the friction that would keep the slip speed.
    let balance = direction * holding - frame.damping * w.abs();
    let law = law.toward(direction);
    if let Some(between @ [falling, rising]) = branch_gap(law, w.abs())
        && falling < balance
        && balance < rising
    {
        return Mode::Hold {
            direction,
            u: w.abs(),
            between,
            start: Start::Inside,
        };
    }
    Mode::Slip {
        direction,
        piece: law.begin(w.abs(), balance, memory),
        start: Start::Inside,
    }
}

/// The mode at zero slip velocity: adhesion if it can bear the holding force, else slip towards it.
pub fn at_zero(law: &Law, holding: f64, rate: f64, memory: &mut Memory) -> Mode {
    let static_limit = law.toward(holding).static_limit(Rest::new(0.0, rate.abs()));
    if holding.abs() <= static_limit {
        Mode::Stick
    } else {
        slip_from_zero(law, holding, static_limit, memory)
    }
}

/// Slip that starts at zero speed under the `pull` that adhesion, broken at the size `force`, could not bear.
pub fn slip_from_zero(law: &Law, pull: f64, force: f64, memory: &mut Memory) -> Mode {
    let piece = law.toward(pull).leave(force, memory);
    let start = if piece.force(0.0) >= pull.abs() {
        Start::Reversal
    } else {
        Start::Low
    };
    Mode::Slip {
        direction: pull.signum(),
        piece,
        start,
    }
}

/// The mode after `piece` ended by `end` away from zero speed.
pub fn after(law: &Law, direction: f64, piece: &Piece, end: End, u: f64, memory: &mut Memory) -> Mode {
    let law = law.toward(direction);
    let branches = branch_gap(law, u);
    if let (End::Reversal { rising }, Some(between)) = (end, branches)
        && between[0] < between[1]
    {
        return Mode::Hold {
            direction,
            u,
            between,
            start: if rising { Start::Low } else { Start::High },
        };
    }
    let next = law.next(piece, end, u, memory);
    let start = match end {
        End::High if next.low == u => Start::Low,
        End::Low if next.high == u => Start::High,
        End::Reversal { .. } if branches.is_none() => Start::Reversal,
        // A piece that is entered between its ends; or friction jumps to the other branch, and the slip acceleration with it.
        _ => Start::Inside,
    };
    Mode::Slip {
        direction,
        piece: next,
        start,
    }
}

/// What follows where slip along `piece` ended by `end` at slip speed `u`, and what happened there; `held` is the holding force
/// of adhesion there and its rate.
pub fn after_slip(
    law: &Law,
    (direction, piece): (f64, &Piece),
    (end, u): (End, f64),
    held: impl FnOnce() -> [f64; 2],
    memory: &mut Memory,
) -> (Mode, Kind) {
    let turns_up = end == End::Reversal { rising: true };
    if u > 0.0 || turns_up {
        if turns_up {
            memory.force_rate = held()[1].abs();
        }
        let next = after(law, direction, piece, end, u, memory);
        let kind = match (end, &next) {
            (_, Mode::Hold { .. }) => Kind::Hold,
            (End::Reversal { .. }, _) => Kind::Reversal,
            _ => Kind::Node,
        };
        return (next, kind);
    }
    let [holding, rate] = held();
    // Friction stopped this slip: adhesion holds against no more than that, and what is more is rounding.
    let pull = direction * (direction * holding).min(piece.force(0.0));
    let mode = at_zero(law, pull, rate, memory);
    let kind = if mode == Mode::Stick {
        Kind::Capture
    } else {
        Kind::Crossing
    };
    (mode, kind)
}

/// The mode after friction between the branches left them over `end`.
pub fn after_hold(law: &Law, direction: f64, u: f64, end: End, memory: &mut Memory) -> Mode {
    let balance = if end == End::High {
        f64::INFINITY
    } else {
        f64::NEG_INFINITY
    };
    Mode::Slip {
        direction,
        piece: law.toward(direction).begin(u, balance, memory),
        start: Start::Reversal,
    }
}

/// Friction while the slip speed falls and while it rises, where the two differ by more than rounding.
pub(crate) fn branch_gap(law: &Law, u: f64) -> Option<[f64; 2]> {
    law.branches(u)
        .filter(|[falling, rising]| (falling - rising).abs() > 1e-12 * rising.abs())
}
