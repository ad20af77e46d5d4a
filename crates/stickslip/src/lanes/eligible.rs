//! Which oscillators go in lanes: the conditions. The last of them is asked of each line by `Line::of` in `lane_oscillator.rs`.
//!
//! - At most one harmonic acts.
//! - The drive moves forward.
//! - Friction is alike in both directions.
//! - In slip, friction is one chain of not too many lines, without jumps and without memory; or lines with branches or a memory,
//!   of which the law names the next one; or a smooth curve that is known by its numbers ([`Friction::curve`]).
//! - Without a force, static friction grows exponentially or not at all.
//! - All numbers are moderate, and no line of a chain is so short that rounding makes its ends one.
//! - Lanes can follow the curve, or at least one line of the chain: it is not too steep, and its two exponents are not too near to
//!   each other.
//!
//! An oscillator that meets them may still have modes that a lane hands over to the engine of single motions: adhesion whose
//! limit grows other than exponentially or follows the force rate, slip along the other lines, and every mode whose end the
//! lanes cannot certify.
//! A motion whose start is not finite stays where it is.

use super::curve::Form;
use super::lane_oscillator::LaneOscillator;
use crate::harmonic::Harmonic;
use crate::law::{Curve, End, Friction, Law, Memory, Piece, Rest};
use crate::oscillator::Oscillator;

/// Numbers beyond these, or below one over them, are left to the engine of single motions: sixth powers must not leave the numbers.
const MODERATE: f64 = 1e20;
/// A phase beyond this keeps no digit of its whole turns.
const MOST_PHASE: f64 = 1e15;
/// An exponent of the free part beyond this many natural ones is left to that engine too.
pub(super) const STEEPEST_EXPONENT: f64 = 8.0;
/// So are two exponents that are nearer to each other than this part of a natural one.
pub(super) const NEAREST_EXPONENTS: f64 = 0.1;
/// So are laws with a line shorter than this part of the velocities at its ends.
pub(super) const SHORTEST_LINE: f64 = 1e-12;
/// So are laws of more lines than this.
const MOST_LINES: usize = 64;
/// Whether more goes in lanes than forced motions along lines. In a browser they alone do: its core must be small, and in two
/// lanes motions between branches or without a force take no less time.
pub(crate) const ALL_GO: bool = cfg!(not(target_family = "wasm"));

/// Whether motions of an oscillator go in lanes, many at once.
pub fn goes_in_lanes(oscillator: &Oscillator) -> bool {
    if ALL_GO {
        LaneOscillator::of(oscillator).is_some()
    } else {
        goes_in_a_single_lane(oscillator)
    }
}

/// Whether a single motion of an oscillator goes in a lane too.
pub(super) fn goes_in_a_single_lane(oscillator: &Oscillator) -> bool {
    single_lane(oscillator).is_some()
}

/// An oscillator of which a single motion goes in a lane: one that goes in lanes and is forced. Without a force the engine of
/// single motions is faster.
pub(super) fn single_lane(oscillator: &Oscillator) -> Option<LaneOscillator> {
    LaneOscillator::of(oscillator).filter(|lane| lane.constants.force > 0.0 && lane.follows == Follows::Lines)
}

/// What the motions of an oscillator slip along: those that slip along the same go side by side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Follows {
    /// A chain of lines.
    Lines,
    /// A curve of this form.
    Curve(Form),
    /// Pieces of which the law names the next one where one ends, from what the contact remembers.
    Branches,
}

impl Follows {
    pub(super) fn of(oscillator: &Oscillator) -> Self {
        let law = &oscillator.law;
        if let Some(form) = Form::of(oscillator) {
            return Self::Curve(form);
        }
        let first = law.begin(0.0, f64::INFINITY, &mut Memory::default());
        let varies = law.feels_force_rate() && !oscillator.forcing.is_empty();
        if first.reverses || varies {
            Self::Branches
        } else {
            Self::Lines
        }
    }
}

/// What was found of an oscillator that meets every condition but the last.
pub(super) struct Eligible {
    /// The force, its amplitude not negative; one of no size where there is none.
    pub(super) harmonic: Harmonic,
    /// The lines of friction.
    pub(super) pieces: Vec<Piece>,
    /// The static limit at the begin of adhesion.
    pub(super) static_limit: f64,
    /// How far it grows, and how fast.
    pub(super) growth: [f64; 2],
    /// The curve of friction, if it is one; then the only line is no more than its beginning. Of branches there are no lines.
    pub(super) curve: Option<Curve>,
    pub(super) follows: Follows,
}

impl Eligible {
    /// None where one of the conditions fails.
    pub(super) fn of(oscillator: &Oscillator) -> Option<Self> {
        let law = &oscillator.law;
        let forced = match oscillator.forcing[..] {
            [] => None,
            [harmonic] => Some(harmonic),
            _ => return None,
        };
        let alike = std::ptr::eq(law, law.toward(-1.0));
        let curve = law.curve().filter(|_| ALL_GO);
        if oscillator.resonates()
            || !alike
            || law.smooth() != curve.is_some()
            || oscillator.drive_velocity <= 0.0
        {
            return None;
        }
        let (m, k, s) = (oscillator.mass, oscillator.stiffness, oscillator.drive_velocity);
        let static_limit = law.static_limit(Rest::new(0.0, k * s));
        // Without a force the rate of the holding force stays.
        let varies = law.feels_force_rate() && forced.is_some();
        let follows = Follows::of(oscillator);
        let pieces = match follows {
            Follows::Branches => Some(Vec::new()).filter(|_| ALL_GO),
            _ => lines_of(law, static_limit),
        }?;
        let growth = match law.exponential_growth(forced.is_none().then_some(k * s)) {
            _ if varies => [f64::INFINITY, 1.0],
            _ if law.growth_bound(0.0) == 0.0 => [0.0, 1.0],
            Some(growth) => growth,
            // Without a force, lanes gain less in slip than it costs to hand every stick over.
            None if forced.is_none() => return None,
            None => [f64::INFINITY, 1.0],
        };
        let natural = (k / m).sqrt();
        // Without a force, one of no size at any frequency.
        let mut harmonic = forced.unwrap_or(Harmonic::new(0.0, natural, 0.0));
        if harmonic.amplitude < 0.0 {
            harmonic.phase += std::f64::consts::PI;
        }
        harmonic.amplitude = harmonic.amplitude.abs();
        let Harmonic {
            amplitude, frequency, ..
        } = harmonic;
        let moderate = |x: f64| (1.0 / MODERATE..MODERATE).contains(&x.abs());
        let usual = [m, k, s, natural, frequency].into_iter().all(moderate)
            && (1e-6..1e6).contains(&(frequency / natural))
            && harmonic.phase.abs() < MOST_PHASE
            && [amplitude, static_limit]
                .into_iter()
                .chain(pieces.iter().map(|piece| piece.offset))
                .all(|x| x == 0.0 || moderate(x))
            // A line must be longer than the rounding of a velocity: else its ends are one.
            && pieces
                .iter()
                .all(|piece| piece.high - piece.low > SHORTEST_LINE * s.max(piece.low));
        usual.then_some(Self {
            harmonic,
            pieces,
            static_limit,
            growth,
            curve,
            follows,
        })
    }
}

/// The pieces of a law whose friction in slip is one chain of lines, from slip speed 0 on, that remembers nothing.
fn lines_of(law: &Law, static_limit: f64) -> Option<Vec<Piece>> {
    let mut memory = Memory::default();
    let mut piece = law.begin(0.0, f64::INFINITY, &mut memory);
    let mut pieces = Vec::new();
    // Whatever the force at which adhesion broke.
    let mut good = piece.low == 0.0
        && [static_limit, f64::INFINITY]
            .into_iter()
            .all(|force| law.leave(force, &mut memory) == piece);
    while good && piece.high.is_finite() && pieces.len() < MOST_LINES {
        let next = law.next(&piece, End::High, piece.high, &mut memory);
        let jump = (next.force(next.low) - piece.force(piece.high)).abs();
        good = !piece.reverses
            && next.low == piece.high
            && jump <= 1e-12 * piece.force(piece.high).abs()
            && law.next(&next, End::Low, next.low, &mut memory) == piece;
        pieces.push(std::mem::replace(&mut piece, next));
    }
    good &= piece.high.is_infinite() && !piece.reverses && memory == Memory::default();
    pieces.push(piece);
    good.then_some(pieces)
}
