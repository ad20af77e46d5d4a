//! What an oscillator is to the lanes, and where its motion is.

use std::f64::consts::TAU;

use stickslip_lanes::{Lane, Mask, Single};

use super::curve::{CurveNumbers, Form};
use super::curve_slip::RUNAWAY_RATIO;
use super::elementary::{add, exp, sin_cos};
use super::eligible::{Eligible, Follows, NEAREST_EXPONENTS, STEEPEST_EXPONENT};
use super::slip::basis;
use crate::clock::Clock;
use crate::elementary::{PI, whole_turns_less};
use crate::event::Start;
use crate::harmonic::Harmonic;
use crate::hybrid_state::HybridState;
use crate::law::{Memory, Piece};
use crate::mode::{Kind, Mode};
use crate::orbit::{Event, Segment};
use crate::oscillator::Oscillator;

/// A structure of lanes, of which each lane can be written and read.
macro_rules! lanes {
    ($(#[$of:meta])* $name:ident { $($(#[$about:meta])* $field:ident),* $(,)? }) => {
        $(#[$of])*
        #[derive(Clone, Copy, Debug)]
        pub(super) struct $name<L> { $($(#[$about])* pub(super) $field: L),* }

        impl<L: Lane> $name<L> {
            /// The same in every lane.
            pub(super) fn splat(one: &$name<f64>) -> Self {
                Self { $($field: L::splat(one.$field)),* }
            }

            /// Write lane `i`.
            pub(super) fn put(&mut self, i: usize, one: &$name<f64>) {
                $(self.$field.set(i, one.$field);)*
            }

            /// Read lane `i`; what nobody asks for is not read.
            #[inline(always)]
            #[allow(dead_code, reason = "not every structure is read and chosen from")]
            pub(super) fn take(&self, i: usize) -> $name<f64> {
                $name { $($field: self.$field.get(i)),* }
            }

            /// Another one where the mask says so.
            #[inline(always)]
            #[allow(dead_code, reason = "as above")]
            pub(super) fn or(&self, mask: L::Mask, other: &Self) -> Self {
                Self { $($field: L::choose(mask, other.$field, self.$field)),* }
            }

        }
    };
}

lanes! {
    /// What stays the same along a motion.
    Constants {
        /// s, k, D, 1/k and k/m.
        drive, stiffness, damper, per_stiffness, natural_squared,
        /// The static limit at the begin of adhesion f₀, and the friction slip starts with.
        static_limit, offset,
        /// The limit after a rest, f₀ + Δ (1 − e^(−γ t_s)): Δ, infinite where it grows otherwise, and γ.
        growth, growth_rate,
        /// Of the force: amplitude A, frequency Ω, 1/Ω and Ω².
        force, frequency, per_frequency, frequency_squared,
        /// 2π/Ω in two parts, of which small multiples of the first are exact.
        period, period_low,
        /// The time by which zero phase of the force is before zero time.
        shift,
        /// ks, its rate a radian of the force, and their reciprocals.
        rise, rise_a_radian, per_rise,
        /// ks over a period.
        rise_a_period,
        /// The holding force only rises: 1; else 0. The angle by which its extremes are off those of the force, and their height.
        monotone, early, crest,
        /// A holding force that is this near to a limit is there within rounding.
        faint,
    }
}

lanes! {
    /// What stays the same in slip along one line of friction, `offset` + `slope` · u for `low` ≤ u ≤ `high`.
    Line {
        /// Its number, and 1 where it is left to the engine of single motions, else 0.
        index, left,
        offset, slope, low,
        /// `high` − `low`, which may be infinite.
        reach,
        /// The rest of x but for the sign of friction, and that of friction.
        rest, lag,
        /// Of the free part: γ, 2γ, ω and 1/ω; its slower and its faster rate of decay, where it does not oscillate; else γ and 0.
        gamma, twice_gamma, omega, per_omega, slow, fast,
        /// Sixth power of its larger exponent, and that over ω.
        power, power_per_omega,
        /// The response to the force, in phase and behind, its amplitude as a velocity, and a bound of its sixth derivative.
        within, behind, swing, sixth,
    }
}

lanes! {
    /// How a motion advances over one distance between samples: the free part by a 2 × 2 matrix, the harmonic by a rotation.
    Step {
        f11, f12, f21, f22, cos, sin_over, sin_times, h, slack,
        /// By how much the free part may grow.
        growth,
    }
}

lanes! {
    /// Where a motion is: at the start of a mode.
    State {
        x, v,
        /// Whole periods since the phase of the force was zero, the time since then, and cos and sin of the force.
        periods, t, cos, sin,
        /// 1 in adhesion, else 0; the sign of w; whether slip starts without slope (1) or not (0).
        stuck, direction, at_reversal,
        /// The number of the line, where it slips.
        line,
        /// Events so far.
        events,
        /// Where to stop, in periods and time.
        end_periods, end_t,
        /// The most events.
        most,
        /// The speed of the motion at its start.
        began,
    }
}

/// How often a distance between samples is halved before a lane is given to the search that has no such limit.
pub(super) const STEP_HALVINGS: usize = 5;
/// The distance between samples, in units of the time in which the motion changes.
pub(super) const SAMPLE_REACH: f64 = 1.5;

/// A line of friction: what the lanes need of it, and steps from the longest to the shortest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Track {
    pub(super) line: Line<f64>,
    pub(super) steps: [Step<f64>; STEP_HALVINGS + 1],
    piece: Piece,
}

/// An oscillator as the lanes need it: what stays the same along a motion, and the lines of its law, or one for the beginning of
/// its curve.
#[derive(Clone, Debug)]
pub(super) struct LaneOscillator {
    pub(super) constants: Constants<f64>,
    pub(super) tracks: Vec<Track>,
    pub(super) curve: Option<(Form, CurveNumbers<f64>)>,
    pub(super) follows: Follows,
    pub(super) mass: f64,
}

/// Where a mode of the lanes ends.
pub(super) struct End<L: Lane> {
    /// Lanes for which that is known.
    pub(super) found: L::Mask,
    /// How long the mode lasted.
    pub(super) lasted: L,
    /// Periods passed and the time in the last one, cos and sin of the force there.
    pub(super) periods: L,
    pub(super) t: L,
    pub(super) cos: L,
    pub(super) sin: L,
    pub(super) x: L,
}

pub(super) use lanes;

impl<L: Lane> End<L> {
    /// Of no lane yet.
    #[inline(always)]
    pub(super) fn unknown() -> Self {
        let zero = L::splat(0.0);
        Self {
            found: L::Mask::none(),
            lasted: zero,
            periods: zero,
            t: zero,
            cos: L::splat(1.0),
            sin: zero,
            x: zero,
        }
    }
}

impl<L: Lane> State<L> {
    /// The time, high and low part: [`LaneOscillator::clock`], operation for operation.
    #[inline(always)]
    pub(super) fn clock(&self, c: &Constants<L>) -> (L, L) {
        let zero = L::splat(0.0);
        let whole = (self.periods * c.period, zero);
        add(
            add(whole, (self.t, zero)),
            (self.periods * c.period_low - c.shift, zero),
        )
    }

    /// To the end of a mode, in the lanes of `go`, at the velocity `v`.
    #[inline(always)]
    pub(super) fn go_to(&mut self, go: L::Mask, end: &End<L>, v: L) {
        self.periods = L::choose(go, self.periods + end.periods, self.periods);
        self.t = L::choose(go, end.t, self.t);
        self.cos = L::choose(go, end.cos, self.cos);
        self.sin = L::choose(go, end.sin, self.sin);
        self.x = L::choose(go, end.x, self.x);
        self.v = L::choose(go, v, self.v);
    }
}

impl LaneOscillator {
    /// Of an oscillator that goes in lanes ([`Eligible`]).
    pub(super) fn of(oscillator: &Oscillator) -> Option<Self> {
        let Eligible {
            harmonic,
            pieces,
            static_limit,
            growth: [growth, growth_rate],
            curve,
            follows,
        } = Eligible::of(oscillator)?;
        let (m, k, s) = (oscillator.mass, oscillator.stiffness, oscillator.drive_velocity);
        let (natural_squared, offset) = (k / m, pieces.first().map_or(0.0, |piece| piece.offset));
        let Harmonic {
            amplitude,
            frequency,
            phase,
        } = harmonic;
        let whole = TAU / frequency;
        let period = f64::from_bits(whole.to_bits() & !((1 << 22) - 1));
        // 2π = TAU + 2.4e-16, and what the quotient leaves of it.
        let (back, lost) = crate::elementary::product(frequency, whole);
        let left = ((TAU - back) - lost) + 2.449_293_598_294_706_4e-16;
        let rise = k * s;
        let (change, monotone) = (amplitude * frequency, rise >= amplitude * frequency);
        let ratio = if monotone { 1.0 } else { rise / change };
        let crest = amplitude * (1.0 - ratio * ratio).sqrt();
        let early = if monotone { 0.0 } else { libm::asin(ratio) };
        // Less than none would round the time of the start.
        let turned = whole_turns_less(phase, 0.0);
        let ahead = if turned < 0.0 { turned + 2.0 * PI.0 } else { turned };
        let constants = Constants {
            drive: s,
            stiffness: k,
            damper: oscillator.damping,
            per_stiffness: 1.0 / k,
            natural_squared,
            static_limit,
            offset,
            growth,
            growth_rate,
            force: amplitude,
            frequency,
            per_frequency: 1.0 / frequency,
            frequency_squared: frequency * frequency,
            period,
            period_low: (whole - period) + left / frequency,
            shift: ahead / frequency,
            rise,
            rise_a_radian: rise / frequency,
            per_rise: 1.0 / rise,
            rise_a_period: rise * whole,
            monotone: f64::from(u8::from(monotone)),
            early,
            crest,
            faint: 64.0 * f64::EPSILON * (static_limit + amplitude + rise * whole + oscillator.damping * s),
        };
        let tracks: Vec<Track> = pieces
            .iter()
            .enumerate()
            .map(|(index, piece)| Track::of(&constants, m, piece, index))
            .collect();
        let curve = curve.and_then(|curve| {
            Some((
                Form::of(oscillator)?,
                CurveNumbers::of(oscillator, &constants, &curve),
            ))
        });
        let one_goes = follows != Follows::Lines || tracks.iter().any(|track| track.line.left == 0.0);
        one_goes.then_some(Self {
            constants,
            tracks,
            curve,
            follows,
            mass: m,
        })
    }

    /// Whether a motion along its curve may run away.
    pub(super) fn may_run_away(&self, state: &State<f64>) -> bool {
        let natural = self.constants.natural_squared.sqrt();
        self.curve.is_some() && natural * state.x.abs() > RUNAWAY_RATIO * state.began
    }

    /// The fastest rate of motion along its curve, if it has one.
    pub(super) fn rate(&self) -> f64 {
        self.curve.as_ref().map_or(1.0, |(_, numbers)| numbers.rate)
    }

    /// The line of a state.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the number of a line is small"
    )]
    #[inline]
    pub(super) fn track(&self, line: f64) -> &Track {
        // Most laws have one line: a number need not be made whole for it.
        match &self.tracks[..] {
            [only] => only,
            tracks => &tracks[line as usize],
        }
    }

    /// The state at a hybrid state, to go on until `t_end` for so many events at the most.
    pub(super) fn state(
        &self,
        (x, v): (f64, f64),
        hybrid: &HybridState,
        t_end: f64,
        most: u64,
    ) -> State<f64> {
        let (periods, t) = self.local(hybrid.clock);
        let (end_periods, end_t) = self.local(Clock::at(t_end));
        let (sin, cos) = crate::elementary::sin_cos(self.constants.frequency * t);
        let (stuck, direction, at_reversal, line) = match hybrid.mode {
            Mode::Slip {
                direction,
                start,
                piece,
            } => {
                let on = |track: &Track| track.piece.branch == piece.branch;
                let line = self.tracks.iter().position(on).unwrap_or(0);
                let at_reversal = f64::from(u8::from(start == Start::Reversal));
                (0.0, direction, at_reversal, line as f64)
            }
            Mode::Stick => (1.0, 1.0, 0.0, 0.0),
            Mode::Hold { direction, .. } => (0.0, direction, 0.0, 0.0),
        };
        State {
            x,
            v,
            periods,
            t,
            cos,
            sin,
            stuck,
            direction,
            at_reversal,
            line,
            events: 0.0,
            end_periods,
            end_t,
            most: most as f64,
            began: 0.0,
        }
    }

    /// The position, velocity and hybrid state of a state.
    #[inline(always)]
    pub(super) fn hybrid(&self, state: &State<f64>) -> (f64, f64, HybridState) {
        let mode = if state.stuck == 1.0 {
            Mode::Stick
        } else {
            let (direction, piece) = (state.direction, self.track(state.line).piece);
            let at = |speed: f64| state.v == self.constants.drive - direction * speed;
            let start = if state.at_reversal == 1.0 {
                Start::Reversal
            } else if at(piece.low) {
                Start::Low
            } else if at(piece.high) {
                Start::High
            } else {
                Start::Inside
            };
            Mode::Slip {
                direction,
                piece,
                start,
            }
        };
        let hybrid = HybridState {
            clock: self.clock(state.periods, state.t),
            mode,
            memory: Memory::default(),
        };
        (state.x, state.v, hybrid)
    }

    /// The event after which a state is; only a release has a stick time, and only at a node the mass has not the velocity of
    /// the drive.
    #[inline(always)]
    pub(super) fn event(&self, clock: Clock, state: &State<f64>, event: [f64; 3]) -> Event {
        let [force, stick_time, force_rate] = event;
        let kind = if !stick_time.is_nan() {
            Kind::Release
        } else if state.v != self.constants.drive {
            Kind::Node
        } else if state.stuck == 1.0 {
            Kind::Capture
        } else {
            Kind::Crossing
        };
        Event {
            t: clock.high,
            kind,
            contact: 0,
            x: state.x,
            v: state.v,
            force,
            stick_time,
            force_rate,
        }
    }

    /// The mode of a state after an event: adhesion, or slip in a direction.
    #[inline(always)]
    pub(super) fn segment(&self, clock: Clock, state: &State<f64>) -> Segment {
        let sticks = state.stuck == 1.0;
        let Piece {
            offset,
            slope,
            branch,
            ..
        } = if sticks {
            Piece::constant(0.0)
        } else {
            self.track(state.line).piece
        };
        Segment {
            clock,
            x: state.x,
            v: state.v,
            direction: if sticks { 0.0 } else { state.direction },
            offset,
            slope,
            branch,
        }
    }

    /// The time so many periods and a time after the phase of the force was zero.
    pub(super) fn clock(&self, periods: f64, t: f64) -> Clock {
        let Constants {
            period,
            period_low,
            shift,
            ..
        } = self.constants;
        Clock::at(periods * period)
            .after(t)
            .after(periods * period_low - shift)
    }

    /// Whole periods of the force since its phase was zero, and the time since then.
    fn local(&self, clock: Clock) -> (f64, f64) {
        let Constants {
            period,
            period_low,
            shift,
            ..
        } = self.constants;
        let after =
            |periods: f64| ((clock.high - periods * period) + (clock.low + shift)) - periods * period_low;
        let mut periods = ((clock.high + shift) / (period + period_low)).floor();
        if after(periods) < 0.0 {
            periods -= 1.0;
        }
        (periods, after(periods))
    }
}

/// x⁶.
#[inline(always)]
pub(super) fn sixth_power<L: Lane>(x: L) -> L {
    (x * x * x) * (x * x * x)
}

impl<L: Lane> Line<L> {
    /// Of a mass on a piece of friction, and the larger exponent of its free part.
    #[inline(always)]
    pub(super) fn of(c: &Constants<L>, m: L, [offset, slope, low, high]: [L; 4]) -> (Self, L) {
        let (n, zero) = (L::splat, L::splat(0.0));
        let (natural_squared, frequency) = (c.natural_squared, c.frequency);
        let natural = natural_squared.sqrt();
        let damping = c.damper + slope;
        let gamma = n(0.5) * damping / m;
        let kappa = gamma * gamma - natural_squared;
        let omega = kappa.abs().sqrt();
        let oscillates = kappa.below(zero);
        let exponent = L::choose(oscillates, natural, gamma.abs() + omega);
        let cube = natural_squared * natural_squared * natural_squared;
        let power = L::choose(oscillates, cube, sixth_power(exponent));
        let goes =
            (n(NEAREST_EXPONENTS) * natural).below(omega) & exponent.below(n(STEEPEST_EXPONENT) * natural);
        let (real, imaginary) = (c.stiffness - m * frequency * frequency, damping * frequency);
        let size = real * real + imaginary * imaginary;
        // Without damping, the frequency that stands for none is that of a resonance.
        let forced = zero.below(c.force);
        let within = L::choose(forced, c.force * real / size, zero);
        let behind = L::choose(forced, c.force * imaginary / size, zero);
        let swing = (within * within + behind * behind).sqrt() * frequency;
        let line = Self {
            index: zero,
            left: L::choose(goes, zero, n(1.0)),
            offset,
            slope,
            low,
            reach: high - low,
            rest: slope * c.drive / c.stiffness,
            lag: offset / c.stiffness,
            gamma,
            twice_gamma: n(2.0) * gamma,
            omega,
            per_omega: n(1.0) / omega,
            slow: L::choose(oscillates, gamma, gamma - omega),
            fast: L::choose(oscillates, zero, gamma + omega),
            power,
            power_per_omega: power / omega,
            within,
            behind,
            swing,
            sixth: n(1.000_001) * swing * sixth_power(frequency),
        };
        (line, exponent)
    }
}

impl Track {
    fn of(constants: &Constants<f64>, m: f64, piece: &Piece, index: usize) -> Self {
        let c = Constants::splat(constants);
        let numbers = [piece.offset, piece.slope, piece.low, piece.high].map(Single::splat);
        let (line, exponent) = Line::of(&c, Single::splat(m), numbers);
        let mut h = Single::splat(SAMPLE_REACH / exponent.get(0).max(constants.frequency));
        let steps = std::array::from_fn(|_| {
            let step = Step::over(&c, &line, c.natural_squared, basis(&line, h), h);
            h = Single::splat(0.5) * h;
            step.take(0)
        });
        Self {
            line: Line {
                index: index as f64,
                ..line.take(0)
            },
            steps,
            piece: *piece,
        }
    }
}

impl<L: Lane> Step<L> {
    /// Over the time `h`, at which the free part is made of `basis`.
    #[inline(always)]
    pub(super) fn over(
        c: &Constants<L>,
        line: &Line<L>,
        natural_squared: L,
        (cos, sin): (L, L),
        h: L,
    ) -> Self {
        let n = L::splat;
        let (wave_sin, wave_cos) = sin_cos(c.frequency * h);
        let faster = -line.slow.min(line.fast);
        let growth = L::choose(n(0.0).below(faster), exp(faster * h), n(1.0));
        Self {
            f11: cos + line.gamma * sin,
            f12: sin,
            f21: -natural_squared * sin,
            f22: cos - line.gamma * sin,
            cos: wave_cos,
            sin_over: wave_sin * c.per_frequency,
            sin_times: wave_sin * c.frequency,
            h,
            slack: growth * (sixth_power(h) / n(14_400.0)),
            growth,
        }
    }
}
