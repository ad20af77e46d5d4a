//! The derivative of a motion through its events: fundamental matrices of the segments and jumps at the events at once.
//!
//! A *trail* is a motion with its event sequence held fixed: arc after arc, each ended by the event that ended it in the
//! motion it was taken from. The state carries everything that what follows depends on, the time, the lines of friction and
//! the memory of the contacts included, and every number in it is a [`Dual`]: the derivative with respect to the start and to
//! one parameter comes along. At an event the time moves with the state by −h′/ḣ, which is the saltation matrix
//! S = D_xR + (F⁺ − D_xR F⁻ − D_tR) nᵀ/(nᵀF⁻ + h_t) in the augmented state (Aizerman & Gantmakher 1958; Müller, Chaos
//! Solitons Fractals 5 (1995) 1671), sensitivities of memory included.
//!
//! Segments are differentiated by the variational equation, whose Taylor series go along with those of the motion. Only a
//! law's own algebra (break-away force, next line) and the parameter of the system are differenced, to the fourth order.
//!
//! Held to its sequence, a motion goes on smoothly where the real one would change it. What vanishes there are the *borders*,
//! the test functions of the sliding bifurcations, and they carry their derivatives too.

mod border;
mod saltation;
mod segment;
mod state;
mod varied;

pub use border::{Border, Test};
pub use state::{Arc, CONTACT, Ending, Flags, Layout, Phase, State};
pub use varied::Varied;

use border::Traced;
use segment::Course;
use state::Moving;

use crate::dual::Dual;
use crate::error::Error;

/// A trail followed: states at the ends of the arcs, durations, test functions.
#[derive(Clone, Debug, Default)]
pub struct Followed {
    /// The state after each arc.
    pub states: Vec<State>,
    /// The derivatives of its numbers, row after row: by those of the start, and by the parameter.
    pub rates: Vec<Vec<f64>>,
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

/// Follow a trail from `start`; `last` is what the contacts do after it. With `reseed` the derivatives begin anew with each arc.
///
/// # Errors
/// The arc whose end is not found near where it was.
pub fn follow(
    varied: &Varied,
    start: &State,
    arcs: &[Arc],
    last: &[Phase],
    reseed: bool,
    tests: bool,
) -> Result<Followed, Error> {
    let course = Course::new(varied);
    let mut followed = Followed::default();
    let mut state = start.seeded(course.all_lanes());
    for (index, arc) in arcs.iter().enumerate() {
        let next = arcs.get(index + 1).map_or(last, |arc| &arc.phases);
        if reseed && index > 0 {
            state = state.values().seeded(course.all_lanes());
        }
        let tau =
            end_of(&course, &state.values().still(1), arc).ok_or_else(|| lost(index, "does not end"))?;
        let place = course.go(&state, &arc.phases, tau);
        let moment = course.moment(&place, &state);
        let moves = Course::moves(&course.guard(&state, arc, tau, &moment));
        let after = course.pass(&state, arc, tau, &moment, &moves, next);
        let motion = &after.numbers[..course.layout.contact(0)];
        if motion.iter().any(|number| !number.value.is_finite()) {
            return Err(lost(index, "leaves the numbers"));
        }
        if tests {
            let traced = Traced {
                index,
                arc,
                start: &state,
                tau,
            };
            course.borders(&traced, &mut followed.tests);
            if let Some(&next) = next.get(arc.contact) {
                course.entry(&traced, &moment, &moves, next, &mut followed.tests);
            }
        }
        followed.durations.push(tau);
        followed.states.push(after.values());
        let rows = after.numbers.iter();
        followed.rates.push(
            rows.flat_map(|number| &number.rates[..course.layout.lanes()])
                .copied()
                .collect(),
        );
        state = after;
    }
    Ok(followed)
}

/// When the arc ends, near where it did: Newton.
fn end_of(course: &Course, start: &Moving, arc: &Arc) -> Option<f64> {
    let mut tau = arc.duration;
    if arc.ending == Ending::Time {
        return Some(tau);
    }
    let rate_of_all = course.frame.rate;
    let longest = 0.3 / rate_of_all;
    let mut best = f64::INFINITY;
    let mut first = None;
    let mut place = course.go(start, &arc.phases, tau);
    for round in 0..60 {
        let moment = course.moment(&place, start);
        let guard: Dual = course.guard(start, arc, tau, &moment);
        let (value, rate) = (guard.value, guard.rates[0]);
        if !(value.is_finite() && rate.is_finite()) || rate == 0.0 {
            return (value == 0.0).then_some(tau);
        }
        let step = -value / rate;
        // Beside a tangency Newton may run away from an end that was known from the start.
        let known = *first.get_or_insert(step);
        if round > 0 && known.abs() < 1e-9 / rate_of_all && (tau - arc.duration).abs() > 1e-6 / rate_of_all {
            return Some(arc.duration);
        }
        // Rounding ends the descent.
        if step == 0.0 || (round > 3 && step.abs() >= 0.5 * best && step.abs() < 1e-9 / rate_of_all) {
            return Some(tau);
        }
        best = best.min(step.abs());
        let step = step.clamp(-longest, longest);
        tau += step;
        let h = tau - place.begin;
        if (-0.1 * place.reach..=place.reach).contains(&h) {
            place.h = h;
        } else {
            place = course.go(start, &arc.phases, tau);
        }
        if step.abs() <= 1e-16 * tau.abs() {
            return Some(tau);
        }
    }
    None
}
