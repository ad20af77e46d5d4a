//! The certified next event: no root hides between two samples, however tangential.
//!
//! A motion is sampled at distances so large that an enclosure still tells whether one of its ends is reached between two
//! samples. Where one is, a guess of its time becomes the next sample; from a sample close enough the root follows from the
//! Taylor polynomial there; and the enclosure from the last clear sample up to that root says that it is the first. A guess
//! is never a certificate: it may cost a sample, not an event.

use super::Start;
use crate::flow::enclosure::{Span, reach};
use crate::law::End;
use crate::series::INVERSE;
use crate::simulate::lost;
use crate::watch::Watched;

/// As a part of the distance between samples, how near a sample must be to a root for its Taylor polynomial to give it to rounding.
const NEAR_ROOT: f64 = 0.02;
/// A step that is so short a part of that distance, and away from a touch, need not be polished: its error is of the fourth order.
const SHORT_STEP: f64 = 5e-5;
/// A motion that grows does so by the exponential of this from one sample to the next, at the most.
const MOST_GROWTH_EXPONENT: f64 = 40.0;
/// Degree of that polynomial.
pub(super) const SEARCH_DEGREE: usize = 8;
/// A touch this deep, in units of what is added up, is rounding.
pub(super) const TOUCH_ROUNDING: f64 = 8.0 * f64::EPSILON;

/// A quantity along a mode: a free part and harmonics.
pub(super) trait Motion<const H: usize> {
    fn at(&self, t: f64) -> Sample<H>;

    /// The largest of its exponents and frequencies.
    fn fastest(&self) -> f64;

    /// The exponent at which it can grow.
    fn growing(&self) -> f64 {
        0.0
    }

    /// The size of the terms that its rate is the sum of at a sample; they may cancel but for rounding.
    fn terms_of_rate(&self, sample: &Sample<H>) -> f64 {
        let [size, sixth, seventh] = sample.bound;
        size * (seventh / sixth)
    }

    /// Its derivatives, two from two of each part.
    fn derivatives(&self, sample: &Sample<H>) -> [f64; SEARCH_DEGREE + 1];
}

/// A quantity at one time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample<const H: usize> {
    pub(super) t: f64,
    /// Value and first three derivatives.
    pub(super) d: [f64; 4],
    /// Value and rate of the free part and of each harmonic.
    pub(super) free: [f64; 2],
    pub(super) waves: [[f64; 2]; H],
    /// Bounds of the value but for its constant part, and of the sixth and seventh derivative, of all that is to come or,
    /// for a motion that grows, of all that was.
    pub(super) bound: [f64; 3],
}

impl<const H: usize> Sample<H> {
    /// How far the next sample may be.
    #[inline]
    fn reach(&self) -> f64 {
        let [size, sixth, _] = self.bound;
        reach(size, sixth)
    }
}

/// Where a mode ends: the quantity leaves (low, high), or it turns if that counts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ends {
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) reverses: bool,
}

/// A first end reached.
#[derive(Clone, Copy, Debug)]
pub(super) struct Exit<const H: usize> {
    pub(super) end: End,
    pub(super) t: f64,
    /// The value there.
    pub(super) value: f64,
    /// The sample it was found from, and the integral of the value since.
    pub(super) sample: Sample<H>,
    pub(super) travel: f64,
}

/// One of the ends as a function of time that is positive inside: side · (derivative of that order − target).
#[derive(Clone, Copy, Debug)]
pub(super) struct Guard {
    pub(super) end: End,
    pub(super) order: usize,
    pub(super) side: f64,
    pub(super) target: f64,
}

impl Guard {
    pub(super) const LOW: Self = Self {
        end: End::Low,
        order: 0,
        side: 1.0,
        target: 0.0,
    };
    pub(super) const HIGH: Self = Self {
        end: End::High,
        side: -1.0,
        ..Self::LOW
    };

    /// The margin left, its slope and its curvature.
    #[inline]
    pub(super) fn margin<const H: usize>(&self, sample: &Sample<H>) -> [f64; 3] {
        let d = &sample.d;
        let n = self.order & 1;
        [
            self.side * (d[n] - self.target),
            self.side * d[n + 1],
            self.side * d[n + 2],
        ]
    }

    /// How large a margin may come from rounding.
    pub(super) fn rounding<const H: usize>(&self, sample: &Sample<H>, motion: &impl Motion<H>) -> f64 {
        let terms = if self.order == 0 {
            sample.bound[0] + self.target.abs()
        } else {
            motion.terms_of_rate(sample)
        };
        TOUCH_ROUNDING * terms
    }

    /// A bound of what the Taylor polynomial leaves out of a margin after a step. A fast part far smaller than the others is
    /// beneath rounding of the value where it is not beneath that of the rate.
    #[inline]
    fn remainder<const H: usize>(&self, sample: &Sample<H>, step: f64) -> f64 {
        let [_, sixth, seventh] = sample.bound;
        let ratio = seventh / sixth;
        // The derivative after the last of the polynomial, times step^k / k!.
        let next = seventh * ratio * ratio;
        let square = step * step;
        let eighth = square * square * (square * square);
        if self.order == 0 {
            next * (eighth * step.abs()) * (1.0 / 362_880.0)
        } else {
            next * eighth * (1.0 / 40_320.0)
        }
    }

    /// The step to the root, by Householder's method of the third order.
    #[inline]
    fn guess<const H: usize>(&self, sample: &Sample<H>) -> f64 {
        let [margin, slope, curvature] = self.margin(sample);
        let newton = -margin / slope;
        let third = if self.order == 0 {
            self.side * sample.d[3]
        } else {
            0.0
        };
        let (curvature, third) = (newton * curvature, newton * newton * third);
        newton * (slope + 0.5 * curvature) / (slope + curvature + third * (1.0 / 6.0))
    }
}

/// How large a sum of such terms may be by rounding alone.
pub(super) fn rounding_of(terms: [f64; 3]) -> f64 {
    TOUCH_ROUNDING * terms.iter().map(|term| term.abs()).sum::<f64>()
}

/// A margin below zero: beyond the end by more than a touch within rounding, which would turn back there.
fn beyond([margin, slope, curvature]: [f64; 3], rounding: f64) -> bool {
    margin < -rounding || through([slope, curvature], rounding)
}

/// Whether a motion that meets an end with this slope and curvature of its margin goes on by more than rounding.
fn through([slope, curvature]: [f64; 2], rounding: f64) -> bool {
    slope < 0.0 && slope * slope > 2.0 * curvature * rounding
}

/// A polynomial and its first two derivatives.
pub(super) fn polynomial(coefficients: &[f64], h: f64) -> [f64; 3] {
    let [mut value, mut slope, mut half] = [0.0; 3];
    for coefficient in coefficients.iter().rev() {
        half = half * h + slope;
        slope = slope * h + value;
        value = value * h + coefficient;
    }
    [value, slope, 2.0 * half]
}

/// The polynomial, or its derivative.
#[inline]
fn differentiated(coefficients: [f64; SEARCH_DEGREE + 1], order: usize) -> [f64; SEARCH_DEGREE + 1] {
    if order == 0 {
        return coefficients;
    }
    let mut result = [0.0; SEARCH_DEGREE + 1];
    for k in 0..SEARCH_DEGREE {
        result[k] = (k + 1) as f64 * coefficients[k + 1];
    }
    result
}

/// ∫ of a polynomial from 0 to `h`.
#[inline]
pub(super) fn integral(coefficients: &[f64], h: f64) -> f64 {
    let terms = coefficients.iter().zip(&INVERSE[1..]);
    h * terms
        .rev()
        .fold(0.0, |sum, (coefficient, inverse)| sum * h + coefficient * inverse)
}

/// What is known of the ends between two samples.
enum Verdict {
    Clear,
    /// Clear but for what rounding may be.
    Grazed,
    /// Beyond the end at the second sample.
    Crossed(Guard),
    /// The bounds do not exclude that the end is reached between the samples.
    Doubtful(Guard),
}

/// A search along one mode.
pub(super) struct Search<'a, 'w, M, const H: usize> {
    motion: &'a M,
    ends: Ends,
    /// The ends that can be reached first: both, or one and a turn.
    guards: [Guard; 2],
    /// The end that is met after a turn only: where it is met, a turn was less than rounding.
    behind: Option<Guard>,
    work: &'a mut Watched<'w>,
}

impl<const H: usize, M: Motion<H>> Search<'_, '_, M, H> {
    #[inline]
    fn sample(&mut self, t: f64) -> Sample<H> {
        self.work.evaluations += 1;
        self.motion.at(t)
    }

    /// How near a root must be to follow from the Taylor polynomial. Even a part that has died away to rounding grows in it.
    #[inline]
    fn near(&self, reach: f64) -> f64 {
        (NEAR_ROOT * reach).min(1.0 / self.motion.fastest())
    }

    /// The ends that can be reached; infinite ones cannot.
    #[inline]
    fn guards(&self) -> impl Iterator<Item = &Guard> {
        self.guards.iter().filter(|guard| guard.target.is_finite())
    }

    /// The end the motion goes towards and the time to it by Newton's step.
    #[inline]
    fn ahead(&self, sample: &Sample<H>) -> Option<(Guard, f64)> {
        let mut nearest: Option<(Guard, f64)> = None;
        for guard in self.guards() {
            let [margin, slope, _] = guard.margin(sample);
            if slope < 0.0 && nearest.is_none_or(|(_, time)| margin < -slope * time) {
                nearest = Some((*guard, -margin / slope));
            }
        }
        nearest
    }

    /// What the samples say of the time between them; `root` is an end that is met at the second, on the way out.
    #[inline]
    fn verdict(&self, left: &Sample<H>, right: &Sample<H>, root: Option<End>) -> Verdict {
        let span = Span::new(right.t - left.t);
        let mut verdict = Verdict::Clear;
        for guard in self.guards().chain(&self.behind) {
            let behind = guard.order == 0 && matches!(guard.end, End::Reversal { .. });
            if behind && !matches!(verdict, Verdict::Grazed) {
                break;
            }
            let n = guard.order;
            let bound = left.bound[1 + n].max(right.bound[1 + n]);
            let (from, to) = (guard.margin(left), guard.margin(right));
            if to[0] <= 0.0 && root != Some(guard.end) && beyond(to, guard.rounding(right, self.motion)) {
                return Verdict::Crossed(*guard);
            }
            let low = span.least(from, to, bound);
            if low < 0.0 {
                if low < -guard.rounding(left, self.motion) {
                    verdict = Verdict::Doubtful(*guard);
                } else if matches!(verdict, Verdict::Clear) {
                    verdict = Verdict::Grazed;
                }
            }
        }
        verdict
    }

    /// Taylor coefficients of the motion at a sample.
    #[inline]
    fn coefficients(&self, sample: &Sample<H>) -> [f64; SEARCH_DEGREE + 1] {
        let mut coefficients = self.motion.derivatives(sample);
        let mut factorial = 1.0;
        for k in 2..=SEARCH_DEGREE {
            factorial *= INVERSE[k];
            coefficients[k] *= factorial;
        }
        coefficients
    }

    /// The guess made better by the Taylor polynomial, as far as that reaches.
    #[inline]
    fn aim(&self, sample: &Sample<H>, guard: &Guard, guess: f64) -> f64 {
        let [value, slope, curvature] =
            polynomial(&differentiated(self.coefficients(sample), guard.order), guess);
        let newton = (guard.target - value) / slope;
        let change = newton / (1.0 + 0.5 * newton * curvature / slope).max(0.5);
        if change.abs() < 0.5 * guess.abs() {
            guess + change
        } else {
            guess
        }
    }

    /// The root of `guard` near `sample`, if it is one and the first end reached after `left`.
    ///
    /// A short step is no proof: Householder's can vanish far from any root. What counts is what the Taylor polynomial leaves
    /// of the margin after it, and that must be rounding.
    #[inline]
    fn finish(&mut self, left: &Sample<H>, sample: &Sample<H>, guard: &Guard, guess: f64) -> Option<Exit<H>> {
        let (n, mut step) = (guard.order, guess);
        let mut end = *sample;
        let travel;
        let [value, slope, curvature, jerk] = sample.d;
        let short = step.abs() < SHORT_STEP * sample.reach() && (step * curvature).abs() < 1e-4 * slope.abs();
        if n == 0 && short {
            travel = step * (value + step * (0.5 * slope + step * (1.0 / 6.0) * curvature));
            end.d[0] = value + step * (slope + step * (0.5 * curvature + step * (1.0 / 6.0) * jerk));
            end.d[1] = slope + step * (curvature + 0.5 * step * jerk);
            end.d[2] = curvature + step * jerk;
        } else {
            let coefficients = self.coefficients(sample);
            let differentiated = differentiated(coefficients, n);
            let mut converged = false;
            for _ in 0..6 {
                let [value, slope, _] = polynomial(&differentiated, step);
                let newton = (guard.target - value) / slope;
                step += newton;
                converged = newton.abs() <= 1e-8 * step.abs();
                if converged {
                    break;
                }
            }
            if !converged || step.abs() > 2.0 * guess.abs() {
                return None;
            }
            travel = integral(&coefficients, step);
            if n == 1 {
                end.d[0] = polynomial(&coefficients, step)[0];
            }
            end.d[n..n + 3].copy_from_slice(&polynomial(&differentiated, step));
        }
        end.t = sample.t + step;
        if end.t <= left.t {
            return None;
        }
        let (rounding, [left_over, slope, curvature]) =
            (guard.rounding(sample, self.motion), guard.margin(&end));
        if left_over.is_nan() || left_over.abs().max(guard.remainder(sample, step)) > rounding {
            self.work.fallbacks += 1;
            return None;
        }
        if !through([slope, curvature], rounding) {
            return None;
        }
        let first = matches!(
            self.verdict(left, &end, Some(guard.end)),
            Verdict::Clear | Verdict::Grazed
        );
        first.then_some(Exit {
            end: guard.end,
            t: end.t,
            value: end.d[0],
            sample: *sample,
            travel,
        })
    }

    /// The end reached at a sample.
    fn here(sample: &Sample<H>, end: End) -> Exit<H> {
        Exit {
            end,
            t: sample.t,
            value: sample.d[0],
            sample: *sample,
            travel: 0.0,
        }
    }

    /// The end on which the motion lies at its start and beyond which it goes at once; one that it leaves is armed.
    #[inline]
    fn begin(&mut self, sample: &mut Sample<H>, start: Start) -> Option<End> {
        if start.reverses(sample.d[1]) {
            sample.d[1] = 0.0;
        }
        match start {
            Start::Low => sample.d[0] = self.ends.low,
            Start::High => sample.d[0] = self.ends.high,
            _ => {}
        }
        let leads = sample.d[1..].iter().find(|&&derivative| derivative != 0.0);
        let heading = match start {
            // Of a branch for one sense: a slip acceleration of rounding must not lead back.
            Start::Low if self.ends.reverses => 1.0,
            Start::High if self.ends.reverses => -1.0,
            _ => leads.copied().unwrap_or(0.0),
        };
        if sample.d[0] <= self.ends.low {
            if heading <= 0.0 {
                return Some(End::Low);
            }
            sample.d[0] = self.ends.low;
        }
        if sample.d[0] >= self.ends.high {
            if heading >= 0.0 {
                return Some(End::High);
            }
            sample.d[0] = self.ends.high;
        }
        if self.ends.reverses && heading != 0.0 {
            let rising = heading > 0.0;
            let end = End::Reversal { rising: !rising };
            let other = &mut self.guards[usize::from(!rising)];
            self.behind = other.target.is_finite().then_some(Guard { end, ..*other });
            *other = Guard {
                end,
                order: 1,
                side: heading.signum(),
                target: 0.0,
            };
        }
        None
    }

    #[inline]
    fn first(&mut self, start: Start, horizon: f64) -> Option<Exit<H>> {
        let mut left = self.motion.at(0.0);
        if let Some(end) = self.begin(&mut left, start) {
            return Some(Self::here(&left, end));
        }
        // Samples taken but not reached yet: a guess, and what lies beyond it.
        let (mut near, mut far): (Option<Sample<H>>, Option<Sample<H>>) = (None, None);
        let mut splits = 0;
        loop {
            if self.work.ends(left.t) {
                return None;
            }
            let right = if let Some(sample) = near.take().or(far.take()) {
                sample
            } else {
                // A motion that grows from next to nothing would leave the numbers in one step.
                let mut step = left.reach().min(MOST_GROWTH_EXPONENT / self.motion.growing());
                let mut aimed = None;
                if let Some((guard, newton)) = self.ahead(&left)
                    && newton < step
                {
                    let guess = guard.guess(&left);
                    let near = self.near(step);
                    if guess.abs() < near {
                        // No root there: a touch, which is passed.
                        if let Some(exit) = self.finish(&left, &left, &guard, guess) {
                            return Some(exit);
                        }
                    } else if guess > 0.0 && guess < step {
                        step = self.aim(&left, &guard, guess);
                        aimed = Some(guard);
                    }
                }
                splits = 0;
                let right = self.sample((left.t + step.max(f64::EPSILON * left.t)).min(horizon));
                if let Some(guard) = aimed {
                    let guess = guard.guess(&right);
                    if guess.abs() < self.near(right.reach())
                        && let Some(exit) = self.finish(&left, &right, &guard, guess)
                    {
                        return Some(exit);
                    }
                }
                right
            };
            // Far out its bounds leave the numbers before it does, and no search among them would end.
            if lost(&right.d[..2]).is_some() {
                // The motion leaves the numbers, and met no end while it was within them.
                return None;
            }
            let (guard, crossed) = match self.verdict(&left, &right, None) {
                Verdict::Crossed(guard) => (guard, true),
                Verdict::Doubtful(guard) => (guard, false),
                clear => {
                    self.work.grazes += u64::from(matches!(clear, Verdict::Grazed));
                    if right.t >= horizon {
                        return None;
                    }
                    left = right;
                    continue;
                }
            };
            let d = right.t - left.t;
            if d <= f64::EPSILON * (right.t + NEAR_ROOT / self.motion.fastest()) {
                if crossed {
                    return Some(Self::here(&right, guard.end));
                }
                self.work.grazes += 1;
                left = right;
                continue;
            }
            let ([from, falls, _], [to, rises, _]) = (guard.margin(&left), guard.margin(&right));
            let mut at = left.t + 0.5 * d;
            splits += 1;
            if splits % 4 == 0 {
                // Guesses that creep are halved now and then.
            } else if !crossed && falls < 0.0 && rises > 0.0 {
                // The bottom of the dip.
                at = left.t + d * (falls / (falls - rises)).clamp(0.01, 0.99);
            } else if crossed && (falls < 0.0 || rises < 0.0) {
                // From the nearer side, but not along a slope that leads away from the end.
                let nearer = rises < 0.0 && (falls >= 0.0 || to * falls < from * -rises);
                let base = if nearer { &right } else { &left };
                let guess = guard.guess(base);
                if guess.abs() < self.near(base.reach())
                    && let Some(exit) = self.finish(&left, base, &guard, guess)
                {
                    return Some(exit);
                }
                let aim = base.t + self.aim(base, &guard, guess);
                if aim > left.t && aim < right.t {
                    at = aim;
                }
            }
            near = Some(self.sample(at));
            far = Some(right);
        }
    }
}

/// Where `motion` first leaves `ends` within `horizon`, if it does.
#[inline]
pub(super) fn first_exit<const H: usize>(
    motion: &impl Motion<H>,
    ends: Ends,
    start: Start,
    horizon: f64,
    work: &mut Watched,
) -> Option<Exit<H>> {
    let guards = [
        Guard {
            target: ends.low,
            ..Guard::LOW
        },
        Guard {
            target: ends.high,
            ..Guard::HIGH
        },
    ];
    let mut search = Search {
        motion,
        ends,
        guards,
        behind: None,
        work,
    };
    search.first(start, horizon).filter(|exit| exit.t < horizon)
}
