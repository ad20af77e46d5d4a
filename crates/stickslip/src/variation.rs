//! The derivative of a motion through its events: fundamental matrices of the segments and jumps at the events at once.
//!
//! A *trail* is a motion with its event sequence held fixed: arc after arc, each ended by the event that ended it in the
//! motion it was taken from. The state carries everything that what follows depends on, the time, the line of friction and
//! the memory of the contact included, and every number in it is a [`Dual`]: the derivative with respect to the start and to
//! one parameter comes along. At an event the time moves with the state by −h′/ḣ, which is the saltation matrix
//! S = D_xR + (F⁺ − D_xR F⁻ − D_tR) nᵀ/(nᵀF⁻ + h_t) in the augmented state (Aizerman & Gantmakher 1958; Müller, Chaos
//! Solitons Fractals 5 (1995) 1671), sensitivities of memory included.
//!
//! Segments of linear friction are differentiated in closed form, smooth laws by extrapolation (Gragg 1965; Bulirsch & Stoer
//! 1966) of the variational equation. Only a law's own algebra (break-away force, next line) is differenced, to the fourth order.
//!
//! Held to its sequence, a motion goes on smoothly where the real one would change it. What vanishes there are the *borders*,
//! the test functions of the sliding bifurcations, and they carry their derivatives too.

mod border;
mod saltation;
mod segment;
mod state;
mod varied;

pub use border::{Border, Test};
pub use state::{Arc, Ending, LANES, Phase, State, WIDTH, state_of};
pub use varied::Varied;

use segment::Frame;
use state::LINE;

use crate::dual::Dual;
use crate::error::Error;

/// A trail followed: states at the ends of the arcs, durations, test functions.
#[derive(Clone, Debug, Default)]
pub struct Followed {
    /// The state after each arc.
    pub states: Vec<State<LANES>>,
    /// How long each arc took.
    pub durations: Vec<f64>,
    /// The test functions.
    pub tests: Vec<Test>,
}

fn lost(index: usize, why: &str) -> Error {
    Error::Document {
        reason: format!("the motion held to its event sequence {why} on arc {index}"),
    }
}

/// Follow a trail from `start`; `last` is what the contact does after it. With `reseed` the derivatives begin anew with each arc.
///
/// # Errors
/// The arc whose end is not found near where it was.
pub fn follow(
    varied: &Varied,
    start: &State<LANES>,
    arcs: &[Arc],
    last: Phase,
    reseed: bool,
    tests: bool,
) -> Result<Followed, Error> {
    let frame = Frame::<LANES>::new(varied);
    let timed = Frame::<1>::new(varied);
    let mut followed = Followed::default();
    let mut state = *start;
    for (index, arc) in arcs.iter().enumerate() {
        let next = arcs.get(index + 1).map_or(last, |arc| arc.phase);
        if reseed && index > 0 {
            state = state.as_seeds();
        }
        let (tau, rate) =
            end_of(&timed, &state.as_seeds(), arc).ok_or_else(|| lost(index, "does not end"))?;
        let guard = frame.guard(&state, arc, Dual::fixed(tau));
        let mut moved = guard.chain(tau, -1.0 / rate);
        if arc.ending == Ending::Time {
            // The end is a time on the clock: an arc that starts later takes less.
            moved = state.numbers[0].chain(tau, -1.0);
        }
        let after = frame.pass(&state, arc, moved, next);
        if after.numbers[..LINE]
            .iter()
            .any(|number| !number.value.is_finite())
        {
            return Err(lost(index, "leaves the numbers"));
        }
        if tests {
            frame.borders(&state, arc, index, tau, &mut followed.tests);
            frame.entry(&state, &after, arc, index, moved, next, &mut followed.tests);
        }
        followed.durations.push(tau);
        followed.states.push(after);
        state = after;
    }
    Ok(followed)
}

/// When the arc ends, near where it did, and how fast its guard changes there: Newton.
fn end_of(frame: &Frame<1>, state: &State<1>, arc: &Arc) -> Option<(f64, f64)> {
    let mut tau = arc.duration;
    if arc.ending == Ending::Time {
        return Some((tau, 1.0));
    }
    let longest = 0.3 / frame.rate;
    let mut best = f64::INFINITY;
    let mut first = None;
    for round in 0..60 {
        let guard = frame.guard(state, arc, Dual::along(tau, 0));
        let (value, rate) = (guard.value, guard.rates[0]);
        if !(value.is_finite() && rate.is_finite()) || rate == 0.0 {
            return (value == 0.0).then_some((tau, rate));
        }
        let step = -value / rate;
        // Beside a tangency Newton may run away from an end that was known from the start.
        let known = *first.get_or_insert((step, rate));
        if round > 0 && known.0.abs() < 1e-9 / frame.rate && (tau - arc.duration).abs() > 1e-6 / frame.rate {
            return Some((arc.duration, known.1));
        }
        // Rounding ends the descent.
        if step == 0.0 || (round > 3 && step.abs() >= 0.5 * best && step.abs() < 1e-9 / frame.rate) {
            return Some((tau, rate));
        }
        best = best.min(step.abs());
        tau += step.clamp(-longest, longest);
        if step.abs() <= 1e-16 * tau.abs() {
            return Some((tau, rate));
        }
    }
    None
}
