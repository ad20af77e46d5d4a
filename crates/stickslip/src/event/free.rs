//! When unforced slip ends: between two extrema of the slip speed, whose times are known in closed form, it is monotone, so
//! an end of the piece is crossed there exactly once or not at all.

use super::direct::Direct;
use super::search::{TOUCH_ROUNDING, rounding_of};
use super::{Arrival, SlipPhase};
use crate::elementary::{acos, atan2, atanh, exp, ln};
use crate::flow::exact::{Basis, Signal};
use crate::law::End;
use crate::watch::Watched;

/// The slip speed as seen by the search.
struct Search<'a, 'w, const H: usize> {
    phase: &'a SlipPhase<'a, H>,
    u: Signal<H>,
    du: Signal<H>,
    ddu: Signal<H>,
    work: &'a mut Watched<'w>,
}

/// When and how `phase` ends within `horizon`, if it does.
pub(super) fn end_of_free_slip<const H: usize>(
    phase: &SlipPhase<H>,
    horizon: f64,
    work: &mut Watched,
) -> Option<Arrival> {
    if let Some(arrival) = Direct::new(phase).end(work) {
        return (arrival.t < horizon).then_some(arrival);
    }
    Search::new(phase, work)
        .between_extrema(horizon)
        .filter(|arrival| arrival.t < horizon)
}

impl<'a, 'w, const H: usize> Search<'a, 'w, H> {
    fn new(phase: &'a SlipPhase<'a, H>, work: &'a mut Watched<'w>) -> Self {
        let slip = phase.slip;
        let u = slip.speed(phase.direction, phase.drive_velocity);
        let du = u.derivative(&slip.decay, &slip.frequency);
        Self {
            phase,
            u,
            du,
            ddu: du.derivative(&slip.decay, &slip.frequency),
            work,
        }
    }

    #[inline]
    fn basis(&mut self, t: f64) -> Basis<H> {
        self.work.evaluations += 1;
        self.phase.slip.basis(t)
    }

    /// The state a step `h` from where `basis` was taken; for a step so short that its fourth power is below rounding.
    #[inline]
    fn arrive(&self, t: f64, basis: &Basis<H>, h: f64, end: End) -> Arrival {
        let (x, v) = (self.phase.slip.position(t, basis), self.phase.slip.v.at(basis));
        let (a, jerk) = (
            -self.phase.direction * self.du.at(basis),
            -self.phase.direction * self.ddu.at(basis),
        );
        Arrival {
            t: t + h,
            end,
            x: x + h * (v + h * (0.5 * a + h * jerk / 6.0)),
            v: v + h * (a + 0.5 * h * jerk),
        }
    }

    /// The state at `t`.
    fn arrive_at(&mut self, t: f64, end: End) -> Arrival {
        let basis = self.basis(t);
        self.arrive(t, &basis, 0.0, end)
    }

    /// The first time t > 0 at which the free slip acceleration vanishes, and the sign it has before.
    fn first_extremum(&self) -> (f64, bool) {
        let decay = &self.phase.slip.decay;
        let [a, b] = self.du.free;
        let mut start = decay.start([a, b]);
        if decay.separates() && start.abs() <= f64::EPSILON * a.abs() {
            start = 0.0;
        }
        let slope = decay.start(decay.derivative([a, b]));
        let rising = if start == 0.0 { slope > 0.0 } else { start > 0.0 };
        let time = if decay.oscillates() {
            // a cos + b sin / ω = 0; counted from zero, so that a slow oscillation loses no digits.
            let sine = b / decay.omega;
            let angle = if rising { atan2(a, -sine) } else { atan2(-a, sine) };
            if angle > 0.0 {
                angle / decay.omega
            } else {
                std::f64::consts::PI / decay.omega
            }
        } else if decay.separates() {
            // a e^{slow t} + b e^{fast t} = 0
            let (slow, fast) = decay.roots();
            let time = ln(-b / a) / (slow - fast);
            if start != 0.0 && time > 0.0 {
                time
            } else {
                f64::INFINITY
            }
        } else {
            // a cosh + b sinh / ω = 0
            let ratio = -a * decay.omega / b;
            if a == 0.0 || a * b >= 0.0 || ratio.abs() >= 1.0 {
                f64::INFINITY
            } else if ratio.abs() > 1e-8 {
                atanh(ratio.abs()) / decay.omega
            } else {
                -a / b
            }
        };
        (time, rising)
    }

    /// The slip speed at an extremum at `t`: there ü = −(k/m)(u − rest), and only the decay has to be evaluated.
    fn extreme(&self, t: f64, rising: bool) -> f64 {
        let decay = &self.phase.slip.decay;
        let [a, b] = self.du.free;
        let sine = b / decay.omega;
        let swing = (a * a + sine * sine).sqrt() * decay.omega / decay.natural_squared;
        let size = swing * exp(-decay.gamma * t);
        self.u.constant + if rising { size } else { -size }
    }

    fn between_extrema(&mut self, horizon: f64) -> Option<Arrival> {
        let SlipPhase { piece, start, .. } = *self.phase;
        if start.reverses(self.du.start(&self.phase.slip.decay)) {
            // Known to be zero here; rounding must not shift the extrema.
            let decay = &self.phase.slip.decay;
            if decay.separates() {
                // Nor feed a fast exponential: one that grows would make more of it than of the motion.
                self.u.free = decay.coefficients(decay.start(self.u.free), 0.0);
                let [slow, _] = decay.derivative(self.u.free);
                self.du.free = [slow, -slow];
                self.ddu.free = decay.derivative(self.du.free);
            } else {
                self.du = self.du.started_at_zero(decay);
            }
        }
        if self.du.free == [0.0; 2] {
            return None;
        }
        let decay = self.phase.slip.decay;
        let (mut extremum, mut rising) = self.first_extremum();
        let half_period = if decay.oscillates() {
            std::f64::consts::PI / decay.omega
        } else {
            f64::INFINITY
        };
        let mut from = 0.0;
        let mut seen = [false; 2];
        loop {
            if self.work.ends(from) {
                return None;
            }
            let (target, end) = if rising {
                (piece.high, End::High)
            } else {
                (piece.low, End::Low)
            };
            let beyond = |value: f64| if rising { value > target } else { value < target };
            if target.is_finite() {
                if extremum < horizon {
                    let value = if decay.oscillates() {
                        self.extreme(extremum, rising)
                    } else {
                        let basis = self.basis(extremum);
                        self.u.at(&basis)
                    };
                    let rounding = TOUCH_ROUNDING * (self.u.constant.abs() + (value - self.u.constant).abs());
                    if (value - target).abs() <= rounding {
                        self.work.grazes += 1;
                    } else if beyond(value) {
                        return Some(self.crossing(target, from, extremum, end, Some(value)));
                    }
                } else {
                    // No extremum ahead: bracket the crossing from the near side, if there is one.
                    let (mut near, mut step) = (from, decay.time());
                    loop {
                        if self.work.ends(near) {
                            return None;
                        }
                        let far = (near + step).min(horizon);
                        let basis = self.basis(far);
                        if beyond(self.u.at(&basis)) {
                            return Some(self.crossing(target, near, far, end, None));
                        }
                        if far == horizon {
                            return None;
                        }
                        near = far;
                        step *= 2.0;
                    }
                }
            }
            if extremum >= horizon {
                return None;
            }
            if piece.reverses {
                return Some(self.arrive_at(extremum, End::Reversal { rising: !rising }));
            }
            // A decaying oscillation that missed both ends once misses them for ever.
            seen[usize::from(rising)] = true;
            if decay.gamma >= 0.0 && seen[0] && seen[1] {
                return None;
            }
            from = extremum;
            extremum += half_period;
            rising = !rising;
        }
    }

    /// A first guess of where u(t) = target in (from, until].
    fn guess(&self, target: f64, from: f64, until: f64, extremum: Option<f64>) -> f64 {
        if from == 0.0 {
            let decay = &self.phase.slip.decay;
            let (start, slope, curvature) =
                (self.u.start(decay), self.du.start(decay), self.ddu.start(decay));
            let travel = target - start;
            let whole = extremum.map_or(f64::INFINITY, |value| value - start);
            let discriminant = slope * slope + 2.0 * curvature * travel;
            if travel.abs() < 0.5 * whole.abs() && discriminant > 0.0 {
                // Near the start the speed is a parabola.
                return 2.0 * travel / (slope + discriminant.sqrt().copysign(travel));
            }
        }
        match extremum {
            // Between extrema it is nearly a cosine about its rest value.
            Some(value) if self.phase.slip.decay.oscillates() => {
                let share = (target - self.u.constant) / (value - self.u.constant);
                until - acos(share.clamp(-1.0, 1.0)) / self.phase.slip.decay.omega
            }
            _ => 0.5 * (from + until),
        }
    }

    /// Where u(t) = target in (from, until], where u is monotone: Halley, kept inside the bracket by bisection, until what is
    /// left is rounding or the bracket is. `extremum` is u(until), where that is an extremum.
    fn crossing(&mut self, target: f64, from: f64, until: f64, end: End, extremum: Option<f64>) -> Arrival {
        let sign = if end == End::High { 1.0 } else { -1.0 };
        let (mut low, mut high) = (from, until);
        let mut t = self.guess(target, from, until, extremum);
        if !(t > low && t < high) {
            t = 0.5 * (low + high);
        }
        let mut last = high - low;
        let settled = 1e-5 * self.phase.slip.decay.time();
        loop {
            let basis = self.basis(t);
            let value = sign * (self.u.at(&basis) - target);
            let (first, second) = (sign * self.du.at(&basis), sign * self.ddu.at(&basis));
            let newton = value / first;
            let halley = newton / (1.0 - 0.5 * newton * second / first).max(0.5);
            // Halley's error is cubic: from a step this short the next one would be below rounding.
            if value == 0.0 || (halley.abs() < settled && (halley * second).abs() < 1e-5 * first.abs()) {
                let step = if value == 0.0 {
                    0.0
                } else {
                    (t - halley).max(low).min(high) - t
                };
                let [a, b] = self.u.free;
                let rounding = rounding_of([self.u.constant, a * basis.c, b * basis.s]);
                if (value + step * (first + 0.5 * step * second)).abs() <= rounding {
                    return self.arrive(t, &basis, step, end);
                }
                self.work.fallbacks += 1;
            }
            if value > 0.0 {
                high = t;
            } else {
                low = t;
            }
            // Of a time below the normal numbers a share is none, and the middle of two neighbours is one of them.
            if high - low <= (2.0 * f64::EPSILON * high).max(f64::MIN_POSITIVE) {
                return self.arrive_at(high, end);
            }
            let mut next = t - halley;
            // Beside an extremum Halley's step is tiny far from any root; Newton's is not.
            let near = halley.abs() < 0.5 * last && newton.abs() < last;
            if !(next > low && next < high && near) {
                next = 0.5 * (low + high);
            }
            last = (next - t).abs();
            t = next;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Search;
    use crate::clock::Clock;
    use crate::event::direct::Direct;
    use crate::event::{SlipPhase, Start, Work};
    use crate::flow::exact::Frame;
    use crate::law::Piece;
    use crate::watch::Watched;

    /// Slips of all kinds of damping, to ends near and far: what is found at once is what the search between extrema finds.
    #[test]
    fn an_end_found_at_once_is_the_first() {
        let mut seed: u64 = 1;
        let mut random = |low: f64, high: f64| {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            low + (high - low) * (seed >> 11) as f64 / (1u64 << 53) as f64
        };
        let mut found = 0;
        for case in 0..200_000 {
            let frame = Frame::<0> {
                mass: 1.0,
                stiffness: random(0.2, 2.0),
                damping: random(-0.1, 0.3),
                drive_velocity: random(0.05, 1.0),
                constant: 0.0,
                forcing: [],
            };
            let low = if case % 2 == 0 { 0.0 } else { random(0.0, 0.5) };
            let high = if case % 3 == 0 {
                f64::INFINITY
            } else {
                low + random(0.01, 1.0)
            };
            let slope = if case % 5 == 0 {
                random(-60.0, 60.0)
            } else {
                random(-2.0, 1.0)
            };
            let piece = Piece {
                reverses: case % 7 == 0,
                ..Piece::line([low, 0.5], slope, low, high, 0)
            };
            let direction = if case % 11 == 0 { -1.0 } else { 1.0 };
            let (start, u) = match case % 4 {
                0 => (Start::Low, low),
                1 if high.is_finite() => (Start::High, high),
                _ => (
                    Start::Inside,
                    low + random(0.0, 1.0) * (high.min(low + 1.0) - low),
                ),
            };
            let v = frame.drive_velocity - direction * u;
            let slip = frame.closed(Clock::default(), random(-1.5, 1.5), v, direction, &piece);
            let (mut work, mut go_on) = (Work::default(), || true);
            let mut work = Watched::new(&mut work, &mut go_on);
            let phase = SlipPhase {
                slip: &slip,
                direction,
                drive_velocity: frame.drive_velocity,
                piece: &piece,
                start,
            };
            let Some(direct) = Direct::new(&phase).end(&mut work) else {
                continue;
            };
            let searched = Search::new(&phase, &mut work)
                .between_extrema(2.0 * direct.t + 1.0)
                .expect("an end was found at once");
            // A root is as good as rounding divided by the rate there.
            let rate = slip
                .v
                .derivative(&slip.decay, &[])
                .at(&slip.basis(direct.t))
                .abs();
            let close = 1e-14
                * (1.0 + slip.x.free[0].abs() + slip.x.free[1].abs())
                * (1.0 + 1.0 / rate)
                * slip.decay.growth(direct.t);
            assert!(
                direct.end == searched.end && (direct.t - searched.t).abs() < close,
                "{case}: {direct:?} {searched:?}"
            );
            assert!(
                (direct.x - searched.x).abs() < close,
                "{case}: {direct:?} {searched:?}"
            );
            found += 1;
        }
        assert!(found > 50_000, "{found}");
    }
}
