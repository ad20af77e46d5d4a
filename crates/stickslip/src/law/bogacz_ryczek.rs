//! The law of Bogacz and Ryczek: static friction with memory and two piecewise-linear branches with shared geometry.
//!
//! The break-away force f_s(t_s, δ) is computed by `StaticFriction::force` in `law/break_away_force.rs`: `static_limit` here only
//! hands it on.
//!
//! What the paper states and what we had to read into it stands in `docs/paper-law.md`. In short, with an *anchor* on the
//! upper branch and the *corner* where all branches meet:
//!
//! ```text
//!  f │  ╲ upper (pencil A)            ╱ common (pencil C)
//!    │   ╲                          ╱
//!    │ steep╲↑↓ or climb (pencil D)╱
//!    │___ lower╲____ (pencil B) __╱ corner, on the line l
//!    └────────────────────────────────── u = |w|
//! ```

use super::constant_or_nodes::ConstantOrNodes;
use super::{Adhesion, End, Friction, Memory, Piece, Point, Rest, StaticFriction};
use crate::error::{Error, misshapen};
use crate::law::declaration::{Limited, Parameters, parameters, words};
use crate::scalar::Scalar;

words! {
    /// The way that slip takes where its acceleration turns from + to − on the upper branch; the paper does not say it.
    pub enum UpperTurn {
        /// Down to the lower branch, with slope tan η.
        #[default]
        Down = "down",
        /// Back along the upper line; the lower branch is met on the common line alone.
        Back = "back",
    }
}

parameters! {
    /// The friction law with memory f(w, t_s, δ, sign ẇ) of "Almost periodic vibration excited by dry friction".
    ///
    /// Pencils A, C and D may lie at infinity (`None`); their lines then have the angles φ, ψ and η.
    pub struct BogaczRyczek<N> {
        /// The surface f_s(t_s, δ).
        pub static_friction: StaticFriction<N> = StaticFriction::example() => [],
        /// Pencil of the upper, falling lines.
        pub a: Option<Point<N>> as "A" = None => [W, F],
        /// Pencil of the lower lines.
        pub b: Point<N> as "B" = [-0.41, 1.33] => [W.search(f64::NEG_INFINITY, 0.0), F],
        /// Pencil of the common, rising lines.
        pub c: Option<Point<N>> as "C" = None => [W, F],
        /// Pencil of the lines that climb from the lower to the upper branch.
        pub d: Option<Point<N>> as "D" = Some([0.33, 2.40]) => [W, F],
        /// The line of corners, (slope, intercept).
        pub l: Point<N> = [3.41, -0.28] => [Number::of("force velocity^-1").part("slope"), FORCE.part("intercept")],
        /// α(f_s): how far friction falls after break-away, the same after every one or a table over the break-away force.
        pub alpha: ConstantOrNodes<N> = ConstantOrNodes::Nodes(vec![[1.9, 0.0], [2.9, 1.7]]) => [FORCE.part("f_s"), FORCE.part("drop").not_negative()],
        /// β: the slip speed over which it falls.
        pub beta: N = 0.01 => [VELOCITY.not_negative()],
        /// φ in degrees: angle of the upper line when A lies at infinity.
        pub phi: N = -58.0 => [ANGLE.search(-89.99, 89.99)],
        /// ψ in degrees: angle of the common line when C lies at infinity.
        pub psi: N = 39.0 => [ANGLE.search(-89.99, 89.99)],
        /// η in degrees: angle of the steepest climb, and of every passage between the branches but D's.
        pub eta: N = 89.0 => [ANGLE.search(0.01, 89.99)],
        /// What a turn of ẇ from + to − on the upper branch does.
        #[serde(default)]
        pub upper_turn: UpperTurn = UpperTurn::Down => [],
    }
}

/// The paper's geometry with our calibration of what it leaves open: f_s(t_s, δ), α.
impl Default for BogaczRyczek {
    fn default() -> Self {
        Self::example()
    }
}

const FALL: u32 = 0;
const UPPER: u32 = 1;
const COMMON: u32 = 2;
const LOWER: u32 = 3;
const CLIMB: u32 = 4;
const STEEP: u32 = 5;

/// Names of the branches, by the number an orbit's segment carries.
pub const BRANCHES: [&str; 6] = ["fall", "upper", "common", "lower", "climb", "steep"];

impl<N: Scalar> BogaczRyczek<N> {
    fn steepest(&self) -> N {
        self.eta.tan_degrees()
    }

    fn upper_slope(&self, anchor: Point<N>) -> N {
        match self.a {
            None => self.phi.tan_degrees(),
            Some(a) => slope(a, anchor),
        }
    }

    fn common_slope(&self, corner: Point<N>) -> N {
        match self.c {
            None => self.psi.tan_degrees(),
            Some(c) => slope(c, corner),
        }
    }

    /// Where the upper line from `anchor` meets l; the anchor itself where it already lies beyond l.
    fn corner(&self, anchor: Point<N>) -> Point<N> {
        let falling = self.upper_slope(anchor);
        let [rising, intercept] = self.l;
        let w = (anchor[1] - falling * anchor[0] - intercept) / (rising - falling);
        if w > anchor[0] {
            [w, rising * w + intercept]
        } else {
            anchor
        }
    }

    fn remember(&self, anchor: Point<N>, memory: &mut Memory<N>) {
        memory.anchor = anchor;
        memory.corner = self.corner(anchor);
    }

    /// The upper characteristic at slip speed `u`, on which the motion is while the slip speed rises.
    fn rising(&self, u: N, memory: &Memory<N>) -> Piece<N> {
        match memory.released_at {
            Some(force) if u < memory.anchor[0] => Self::fall(force, memory),
            _ if u < memory.corner[0] => self.upper(memory),
            _ => self.common(memory),
        }
    }

    /// The first slip after a break-away at `force`.
    fn fall(force: N, memory: &Memory<N>) -> Piece<N> {
        let start = [N::default(), force];
        let slope = slope(start, memory.anchor);
        Piece {
            reverses: true,
            ..Piece::line(start, slope, start[0], memory.anchor[0], FALL)
        }
    }

    fn upper(&self, memory: &Memory<N>) -> Piece<N> {
        let slope = self.upper_slope(memory.anchor);
        // It is left by rising beyond the corner, by a turn or into a stick, never at a low end.
        Piece {
            reverses: true,
            ..Piece::line(memory.anchor, slope, N::default(), memory.corner[0], UPPER)
        }
    }

    fn common(&self, memory: &Memory<N>) -> Piece<N> {
        let slope = self.common_slope(memory.corner);
        Piece {
            reverses: true,
            ..Piece::line(
                memory.corner,
                slope,
                memory.corner[0],
                f64::INFINITY.into(),
                COMMON,
            )
        }
    }

    fn lower(&self, memory: &Memory<N>) -> Piece<N> {
        let slope = slope(self.b, memory.corner);
        Piece {
            reverses: true,
            ..Piece::line(memory.corner, slope, N::default(), memory.corner[0], LOWER)
        }
    }

    /// From the turning point `from` up to the friction `top`.
    fn climb(&self, from: Point<N>, top: N) -> Piece<N> {
        let steepest = self.steepest();
        let slope = match self.d {
            Some(d) if from[0] < d[0] && d[1] > from[1] => slope(from, d).min(steepest),
            _ => steepest,
        };
        let high = from[0] + (top - from[1]) / slope;
        Piece {
            reverses: true,
            ..Piece::line(from, slope, from[0], high, CLIMB)
        }
    }

    /// Check that the branches after a break-away without rest at the force `top` make a characteristic.
    fn validate_branches(&self, top: N) -> Result<(), Error> {
        let fallen = top - self.alpha.at(top);
        if fallen < 0.0 {
            return misshapen(
                "alpha must not exceed the break-away force: friction after it would be negative",
                self.alpha.at(top).value(),
            );
        }
        let beyond = self.corner([self.beta, fallen]);
        if beyond[0] <= self.beta {
            return misshapen(
                "the fall after break-away must end before the corner: beta must be smaller",
                self.beta.value(),
            );
        }
        let mut memory = Memory::default();
        self.remember([N::default(), top], &mut memory);
        if memory.corner[0] <= 0.0 || !memory.corner[0].value().is_finite() {
            return misshapen(
                "the upper line from (0, f_s(0)) must meet the line l at w > 0",
                memory.corner[0].value(),
            );
        }
        let lower = self.lower(&memory).force(N::default());
        if lower > top {
            return misshapen(
                "the lower branch must lie below the upper one: move B down or l up; its force at w = 0 must not exceed f_s(0)",
                lower.value(),
            );
        }
        Ok(())
    }

    /// What follows where the slip speed turns to rise at `from`, on the lower or the common line.
    fn after_minimum(&self, from: Point<N>, piece: &Piece<N>, memory: &Memory<N>) -> Piece<N> {
        // Static friction at stick time zero and the force rate of this moment (the paper's Eq. 7).
        let top = self.static_friction.without_rest(memory.force_rate);
        if from[1] < top {
            self.climb(from, top)
        } else if piece.branch == LOWER {
            // Friction is already above the static limit: the branches stay as they are.
            self.steep_up(from, memory)
        } else {
            *piece
        }
    }

    /// The characteristic at slip speed `u` while it falls.
    fn falling(&self, u: N, memory: &Memory<N>) -> Piece<N> {
        if u > memory.corner[0] {
            self.common(memory)
        } else {
            self.lower(memory)
        }
    }

    /// The passage from `from`, on the lower branch, up to the upper characteristic that is there.
    fn steep_up(&self, from: Point<N>, memory: &Memory<N>) -> Piece<N> {
        let steepest = self.steepest();
        let mut high = from[0];
        let fall = memory.released_at.map(|force| Self::fall(force, memory));
        for line in fall.into_iter().chain([self.upper(memory), self.common(memory)]) {
            high = (from[1] - steepest * from[0] - line.offset) / (line.slope - steepest);
            if high <= line.high {
                break;
            }
        }
        Piece {
            reverses: true,
            ..Piece::line(from, steepest, from[0], high.max(from[0]), STEEP)
        }
    }

    /// The passage from `from`, on the upper branch, down to the lower branch.
    fn steep_down(&self, from: Point<N>, memory: &Memory<N>) -> Piece<N> {
        let steepest = self.steepest();
        let lower = self.lower(memory);
        let low = (from[1] - steepest * from[0] - lower.offset) / (lower.slope - steepest);
        Piece {
            reverses: true,
            ..Piece::line(from, steepest, low.max(N::default()), from[0], STEEP)
        }
    }
}

impl<N: Scalar> Friction<N> for BogaczRyczek<N> {
    fn validate(&self) -> Result<(), Error> {
        self.within_limits()?;
        for (angle, low) in [(self.phi, -90.0), (self.psi, -90.0), (self.eta, 0.0)] {
            let angle = angle.value();
            if angle <= low || angle >= 90.0 {
                return misshapen(
                    "the angles phi, psi must lie in (−90°, 90°) and eta in (0°, 90°)",
                    angle,
                );
            }
        }
        if self.b[0] > 0.0 {
            return misshapen(
                "the pencil B of the lower lines must lie at w ≤ 0",
                self.b[0].value(),
            );
        }
        // At the force rate at which the static limit is largest; where it is less, the branches may cross near w = 0.
        self.validate_branches(self.static_friction.without_rest(N::default()))
    }

    fn static_limit(&self, rest: Rest<N>) -> N {
        self.static_friction.force(rest)
    }

    fn exponential_growth(&self, force_rate: Option<N>) -> Option<[N; 2]> {
        self.static_friction.exponential_growth(force_rate)
    }

    fn adhesion(&self, rest: Rest<N>) -> Adhesion<N> {
        self.static_friction.at(rest)
    }

    fn softening_bound(&self, rates: [N; 2]) -> N {
        self.static_friction.softening_bound(rates)
    }

    fn growth_bound(&self, stick_time: N) -> N {
        self.static_friction.growth_bound(stick_time)
    }

    fn feels_force_rate(&self) -> bool {
        self.static_friction.feels_force_rate()
    }

    fn leave(&self, force: N, memory: &mut Memory<N>) -> Piece<N> {
        self.remember([self.beta, force - self.alpha.at(force)], memory);
        memory.released_at = (self.beta > 0.0).then_some(force);
        self.rising(N::default(), memory)
    }

    fn begin(&self, u: N, balance: N, memory: &mut Memory<N>) -> Piece<N> {
        self.leave(self.static_friction.without_rest(memory.force_rate), memory);
        let rising = self.rising(u, memory);
        let upper = balance >= rising.force(u) || self.upper_turn == UpperTurn::Back;
        if u >= memory.corner[0] || upper {
            return rising;
        }
        let lower = self.lower(memory);
        if balance <= lower.force(u) {
            return lower;
        }
        // Between the branches neither sign of the acceleration is consistent: start on the steep passage, at rest.
        let down = self.steep_down([u, balance], memory);
        let up = self.steep_up([u, balance], memory);
        Piece {
            high: up.high,
            ..down
        }
    }

    fn next(&self, piece: &Piece<N>, end: End, u: N, memory: &mut Memory<N>) -> Piece<N> {
        match (piece.branch, end) {
            (FALL, End::High) => self.rising(memory.anchor[0], memory),
            (UPPER, End::High) => self.common(memory),
            (COMMON | STEEP, End::Low) => self.lower(memory),
            (CLIMB, End::Low) => self.falling(u, memory),
            (CLIMB, End::High) => {
                self.remember([piece.high, piece.force(piece.high)], memory);
                memory.released_at = None;
                self.rising(piece.high, memory)
            }
            (STEEP, End::High) => self.rising(u, memory),
            // Where the static limit is small, the lower branch may lie above near w = 0: the way back is then the same line.
            (FALL | UPPER, End::Reversal { rising: false })
                if self.upper_turn == UpperTurn::Down && self.lower(memory).force(u) < piece.force(u) =>
            {
                self.steep_down([u, piece.force(u)], memory)
            }
            (LOWER | COMMON, End::Reversal { rising: true }) => {
                self.after_minimum([u, piece.force(u)], piece, memory)
            }
            // Any other turn, down the common line or on a steep one, goes back along it.
            _ => *piece,
        }
    }
}

/// Slope of the line through two points.
fn slope<N: Scalar>(from: Point<N>, to: Point<N>) -> N {
    (to[1] - from[1]) / (to[0] - from[0])
}
