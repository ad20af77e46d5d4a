//! The certified next event: no root hides between two samples, however tangential.
//!
//! Unforced slip: between two extrema of the slip speed, whose times are known in closed form, it is monotone, so an end of
//! the piece is crossed there exactly once or not at all. Forced slip and adhesion: march with the largest step in which a
//! bound of the curvature excludes every root; such steps close in on the first root from below, quadratically.

use crate::flow::exact::{Basis, Signal, Slip, Stick};
use crate::flow::expansion::Expansion;
use crate::law::{End, Friction, Hold, Law, Piece};
use crate::series::free_time;

/// What finding events has cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Events that occurred.
    pub events: u64,
    /// Evaluations of the closed-form motion.
    pub evaluations: u64,
}

/// What is known of the slip speed where a mode starts; rounding must not contradict it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    /// Anywhere inside the piece.
    Inside,
    /// At the low end, moving up.
    Low,
    /// At the high end, moving down.
    High,
    /// Where the slip acceleration is zero, maybe at an end: a turn, or adhesion that broke at the force slip produces.
    Turning,
}

/// Where slip along a piece ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// Time since the start of the mode.
    pub t: f64,
    /// How the piece ended.
    pub end: End,
    /// Position there.
    pub x: f64,
    /// Velocity there.
    pub v: f64,
}

/// The slip speed as seen by the search.
struct Search<'a, const H: usize> {
    slip: &'a Slip<H>,
    direction: f64,
    u: Signal<H>,
    du: Signal<H>,
    ddu: Signal<H>,
    work: &'a mut Work,
}

/// When and how slip along `piece` ends within `horizon`, if it does.
#[must_use]
pub fn end_of_slip<const H: usize>(
    slip: &Slip<H>,
    direction: f64,
    drive_velocity: f64,
    piece: &Piece,
    start: Start,
    horizon: f64,
    work: &mut Work,
) -> Option<Arrival> {
    let u = slip.speed(direction, drive_velocity);
    let du = u.derivative(&slip.decay, &slip.frequency);
    let ddu = du.derivative(&slip.decay, &slip.frequency);
    let mut search = Search {
        slip,
        direction,
        u,
        du,
        ddu,
        work,
    };
    let found = if H == 0 {
        search.between_extrema(piece, start, horizon)
    } else {
        search.march(piece, start, horizon)
    };
    found.filter(|arrival| arrival.t < horizon)
}

impl<const H: usize> Search<'_, H> {
    fn basis(&mut self, t: f64) -> Basis<H> {
        self.work.evaluations += 1;
        self.slip.basis(t)
    }

    /// The state a step `h` from where `basis` was taken; for a step so short that its fourth power is below rounding.
    fn arrive(&self, t: f64, basis: &Basis<H>, h: f64, end: End) -> Arrival {
        let (x, v) = (self.slip.x.at(basis), self.slip.v.at(basis));
        let (a, jerk) = (
            -self.direction * self.du.at(basis),
            -self.direction * self.ddu.at(basis),
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

    /// The first time t > 0 at which the free slip acceleration e^{−γt}(a C + b S) vanishes, and the sign it has before.
    fn first_extremum(&self) -> (f64, bool) {
        let decay = &self.slip.decay;
        let (a, b) = (self.du.a, self.du.b);
        let rising = if a == 0.0 { b > 0.0 } else { a > 0.0 };
        let time = if decay.oscillates() {
            let sine = b / decay.omega;
            let phase = if rising { a.atan2(sine) } else { (-a).atan2(-sine) };
            (std::f64::consts::PI - phase) / decay.omega
        } else {
            // a cosh + b sinh / ω = 0
            let ratio = -a * decay.omega / b;
            if a == 0.0 || a * b >= 0.0 || ratio.abs() >= 1.0 {
                f64::INFINITY
            } else if ratio.abs() > 1e-8 {
                ratio.abs().atanh() / decay.omega
            } else {
                -a / b
            }
        };
        (time, rising)
    }

    /// The slip speed at an extremum at `t`: there ü = −(k/m)(u − rest), and only the decay has to be evaluated.
    fn extreme(&self, t: f64, rising: bool) -> f64 {
        let decay = &self.slip.decay;
        let sine = self.du.b / decay.omega;
        let swing = (self.du.a * self.du.a + sine * sine).sqrt() * decay.omega / decay.natural_squared();
        let size = swing * (-decay.gamma * t).exp();
        self.u.constant + if rising { size } else { -size }
    }

    fn between_extrema(&mut self, piece: &Piece, start: Start, horizon: f64) -> Option<Arrival> {
        let turning = start == Start::Turning;
        if turning {
            // Known to be zero here; rounding must not shift the extrema.
            self.du.a = 0.0;
        }
        if self.du.a == 0.0 && self.du.b == 0.0 {
            return None;
        }
        let decay = self.slip.decay;
        let (mut extremum, mut rising) = self.first_extremum();
        let half_period = if decay.oscillates() {
            std::f64::consts::PI / decay.omega
        } else {
            f64::INFINITY
        };
        let mut from = 0.0;
        let mut seen = [false; 2];
        loop {
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
                    if beyond(value) {
                        return Some(self.crossing(target, from, extremum, end, Some(value)));
                    }
                } else {
                    // No extremum ahead: bracket the crossing from the near side, if there is one.
                    let (mut near, mut step) = (from, decay.time());
                    loop {
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
            if piece.turns {
                return Some(self.arrive_at(extremum, End::Turn { rising: !rising }));
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
            let (travel, slope, bend) = (target - self.u.start(), self.du.start(), self.ddu.start());
            let whole = extremum.map_or(f64::INFINITY, |value| value - self.u.start());
            let discriminant = slope * slope + 2.0 * bend * travel;
            if travel.abs() < 0.5 * whole.abs() && discriminant > 0.0 {
                // Near the start the speed is a parabola.
                return 2.0 * travel / (slope + discriminant.sqrt().copysign(travel));
            }
        }
        match extremum {
            // Between extrema it is nearly a cosine about its rest value.
            Some(value) if self.slip.decay.oscillates() => {
                let share = (target - self.u.constant) / (value - self.u.constant);
                until - share.clamp(-1.0, 1.0).acos() / self.slip.decay.omega
            }
            _ => 0.5 * (from + until),
        }
    }

    /// Where u(t) = target in (from, until], where u is monotone: Halley, kept inside the bracket by bisection.
    /// `extremum` is u(until), where that is an extremum.
    fn crossing(&mut self, target: f64, from: f64, until: f64, end: End, extremum: Option<f64>) -> Arrival {
        let sign = if end == End::High { 1.0 } else { -1.0 };
        let (mut low, mut high) = (from, until);
        let mut t = self.guess(target, from, until, extremum);
        if !(t > low && t < high) {
            t = 0.5 * (low + high);
        }
        let mut last = high - low;
        let settled = 1e-5 * self.slip.decay.time();
        for _ in 0..200 {
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
                return self.arrive(t, &basis, step, end);
            }
            if value > 0.0 {
                high = t;
            } else {
                low = t;
            }
            let mut next = t - halley;
            // Beside an extremum Halley's step is tiny far from any root; Newton's is not.
            let near = halley.abs() < 0.5 * last && newton.abs() < last;
            if !(next > low && next < high && near) {
                next = 0.5 * (low + high);
            }
            last = (next - t).abs();
            t = next;
            if last <= f64::EPSILON * t {
                break;
            }
        }
        self.arrive_at(t, end)
    }

    /// March in steps that a bound on the curvature certifies to be free of roots, on one [`Expansion`] after the other.
    fn march(&mut self, piece: &Piece, start: Start, horizon: f64) -> Option<Arrival> {
        let mut t = 0.0;
        // The sign of the acceleration in this mode, for laws that care.
        let mut sense = 0.0;
        loop {
            let basis = self.basis(t);
            let near = Expansion::new(&self.u, &self.du, &self.slip.decay, &self.slip.frequency, &basis);
            let tiny = f64::EPSILON * near.reach.max(2.0 * t);
            let (value, mut slope, curve) = near.start();
            let first = t == 0.0;
            // At an end the slope points inward; one that rounding made zero or worse is a turn.
            let turning = first
                && match start {
                    Start::Inside => false,
                    Start::Turning => true,
                    Start::Low => slope <= 0.0,
                    Start::High => slope >= 0.0,
                };
            if first {
                slope = if turning { 0.0 } else { slope };
                sense = if turning { curve } else { slope }.signum();
            }
            let mut guards = Guards {
                piece,
                sense,
                jerk: near.jerk,
                free: near.reach,
                end: None,
            };
            if turning && curve > 0.0 {
                // At a turn that may lie on the end: the cubic bound ü τ²/2 − jerk τ³/6 keeps it away.
                guards.watch(0.0, 1.5 * curve, near.jerk, End::Low);
            } else {
                let margin = if first && start == Start::Low {
                    0.0
                } else {
                    value - piece.low
                };
                guards.watch(margin, slope, near.bend, End::Low);
            }
            if turning && curve < 0.0 {
                guards.watch(0.0, -1.5 * curve, near.jerk, End::High);
            } else {
                let margin = if first && start == Start::High {
                    0.0
                } else {
                    piece.high - value
                };
                guards.watch(margin, -slope, near.bend, End::High);
            }
            guards.watch_turn(slope, curve);
            if let Some(end) = guards.end
                && guards.free <= tiny
                && !(first && guards.free > 0.0)
            {
                return Some(self.arrive(t, &basis, 0.0, end));
            }
            // A first step this short means that a root may be near: expand no further than needed to close in on it.
            let reach = near.reach.min(8.0 * guards.free.max(tiny));
            let (error, slope_error) = near.error(reach);
            let mut h = guards.free;
            while h < reach {
                let (value, slope, curve) = near.at(h, piece.turns);
                guards.free = near.reach;
                guards.watch(value - error - piece.low, slope, near.bend, End::Low);
                guards.watch(piece.high - error - value, -slope, near.bend, End::High);
                guards.watch_turn(slope - sense * slope_error, curve);
                if guards.free <= tiny {
                    if let Some(end) = guards.end
                        && error <= f64::EPSILON * near.bend * near.reach * tiny
                    {
                        return Some(self.arrive_at(t + h, end));
                    }
                    break;
                }
                h += guards.free;
            }
            t += h.min(reach).max(tiny);
            if t >= horizon {
                return None;
            }
        }
    }
}

/// The ends of a piece as guards: how far ahead the nearest of them certainly is, and which it is.
struct Guards<'a> {
    piece: &'a Piece,
    sense: f64,
    jerk: f64,
    free: f64,
    end: Option<End>,
}

impl Guards<'_> {
    fn watch(&mut self, margin: f64, rate: f64, bound: f64, end: End) {
        let free = free_time(margin.max(0.0), rate, bound);
        if free < self.free {
            (self.free, self.end) = (free, Some(end));
        }
    }

    fn watch_turn(&mut self, slope: f64, curve: f64) {
        if self.piece.turns {
            let rising = self.sense < 0.0;
            self.watch(
                self.sense * slope,
                self.sense * curve,
                self.jerk,
                End::Turn { rising },
            );
        }
    }
}

/// When adhesion breaks within `horizon`, if it does.
#[must_use]
pub fn end_of_stick<const H: usize>(
    stick: &Stick<H>,
    law: &Law,
    horizon: f64,
    work: &mut Work,
) -> Option<f64> {
    let mut t = 0.0;
    let curvature = stick.curvature();
    let feels_rate = law.feels_force_rate();
    let reach = if H == 0 {
        f64::INFINITY
    } else {
        1.0 / stick.frequency.iter().copied().fold(0.0, f64::max)
    };
    let limit = |t: f64, rate: f64| {
        law.break_away(Hold {
            stick_time: t,
            force_rate: rate.abs(),
        })
    };
    loop {
        work.evaluations += 1;
        let (force, rate, bend) = stick.at(t);
        let bears = limit(t, rate);
        let margin = bears - force.abs();
        let outward = rate * force.signum();
        let rounding = 4.0 * f64::EPSILON * bears;
        if margin <= rounding {
            // At the limit adhesion breaks, but for a force that has its crest here within rounding: it only touches.
            let inward = -bend * force.signum();
            if inward <= 0.0 || (outward > 0.0 && outward * outward > 2.0 * inward * rounding) {
                return Some(t);
            }
            t += outward.max(0.0) / inward + (16.0 * rounding / inward).sqrt();
            continue;
        }
        let growth = law.growth_bound(t);
        if growth == 0.0 && H == 0 {
            // A constant limit and a force linear in time.
            let free = margin_time(bears, force, rate, 0.0);
            let at = t + free;
            return (at < horizon).then_some(at);
        }
        // As the limit does not fall while the contact rests, its value now, at the worst force rate ahead, is a lower bound.
        let mut step = margin_time(bears, force, rate, curvature).min(reach);
        if feels_rate && H > 0 {
            while step > 0.0
                && limit(t, rate.abs() + curvature * step)
                    - force.abs()
                    - rate.abs() * step
                    - 0.5 * curvature * step * step
                    <= 0.0
            {
                step *= 0.5;
                if step < f64::EPSILON * reach {
                    return Some(t);
                }
            }
        }
        if (!feels_rate || H == 0) && force != 0.0 && growth < outward - curvature * (2.0 * step) {
            // The margin falls from here to twice the step: at most one root, close it.
            match close(stick, &limit, law, (t, t + 2.0 * step), work) {
                Ok(root) => return (root < horizon).then_some(root),
                Err(free) => step = free - t,
            }
        }
        if step <= 2.0 * f64::EPSILON * t.max(1e-3 * reach.min(1.0)) {
            return Some(t);
        }
        t += step;
        if t >= horizon {
            return None;
        }
    }
}

/// The largest step in which |force + rate τ| + curvature τ²/2 stays within `bears`.
fn margin_time(bears: f64, force: f64, rate: f64, curvature: f64) -> f64 {
    free_time(bears - force, -rate, curvature).min(free_time(bears + force, rate, curvature))
}

/// The root of the falling margin in (low, high], or `high` where it is still positive there: Halley inside the bracket.
fn close<const H: usize>(
    stick: &Stick<H>,
    limit: &impl Fn(f64, f64) -> f64,
    law: &Law,
    (mut low, high): (f64, f64),
    work: &mut Work,
) -> Result<f64, f64> {
    let (mut t, mut above) = (low, high);
    // From a step this short the next one is below rounding, as Halley's error is cubic; with a limit that grows it is not.
    let grows = law.growth_bound(low) > 0.0;
    let settled = if grows { 0.0 } else { 1e-5 * (high - low) };
    for _ in 0..100 {
        work.evaluations += 1;
        let (force, rate, bend) = stick.at(t);
        let bears = limit(t, rate);
        let margin = bears - force.abs();
        if margin.abs() <= f64::EPSILON * bears {
            return Ok(t);
        }
        if margin > 0.0 {
            if t == high {
                return Err(high);
            }
            low = t;
        } else {
            above = t;
        }
        let fall = rate * force.signum() - law.growth_bound(t);
        let newton = margin / fall;
        let halley = newton / (1.0 + 0.5 * newton * bend * force.signum() / fall).max(0.5);
        let mut next = t + halley;
        if halley.abs() <= settled.max(f64::EPSILON * t) {
            return Ok(next.max(low).min(above));
        }
        if !(next > low && next < above) {
            next = if above == high && margin > 0.0 {
                high
            } else {
                0.5 * (low + above)
            };
            if next == t {
                return Ok(t);
            }
        }
        t = next;
    }
    Ok(t)
}
