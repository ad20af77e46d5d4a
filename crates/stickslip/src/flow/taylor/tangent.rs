//! The derivative of a Taylor expansion: by where it starts, by the clock, by the lines of friction, and by parameters.
//!
//! With y' = f(y, t, p) the derivative obeys the variational equation δy' = f_y δy + f_t δt + f_p δp, whose coefficients follow
//! from those of the motion. F′ along the motion is the composition of its own series with that of the slip speed; f_p is a
//! difference of the accelerations that systems beside this one give to the same motion.

use super::{ForceLine, Frame, Held, Motion};
use crate::law::{Friction, Law};
use crate::series::{Grown, INVERSE, ORDER, Series, ZERO, product};

/// So many directions of differentiation go in SIMD lanes, through the registers of a processor.
pub(crate) const BLOCK: usize = 8;
/// A number along each of them.
pub(crate) type Block = [f64; BLOCK];
/// A series along each of them.
pub(crate) type Wide = [Block; ORDER + 1];

/// What linear equations move: a number, or several side by side.
pub(crate) trait Linear: Copy {
    const NOTHING: Self;
    fn add(&mut self, factor: f64, other: Self);
}

impl Linear for f64 {
    const NOTHING: Self = 0.0;
    #[inline]
    fn add(&mut self, factor: f64, other: Self) {
        *self += factor * other;
    }
}

impl Linear for Block {
    const NOTHING: Self = [0.0; BLOCK];
    #[inline]
    fn add(&mut self, factor: f64, other: Self) {
        for (own, other) in self.iter_mut().zip(other) {
            *own += factor * other;
        }
    }
}

/// Directions of differentiation: how the clock and the lines of friction move along each, and what becomes of
/// the motion.
#[derive(Clone, Debug)]
pub(crate) struct Tangent {
    /// How far the clock moves.
    pub(crate) clock: Block,
    /// How far offset and slope of the line of friction of each contact move.
    pub(crate) line: Vec<[Block; 2]>,
    pub(crate) x: Vec<Wide>,
    pub(crate) v: Vec<Wide>,
    /// Of the slip speeds.
    pub(crate) u: Vec<Wide>,
    pub(crate) force: Vec<Wide>,
    /// Of the normal forces that vary, and of friction under the normal forces of the laws.
    normal: Vec<Wide>,
    friction: Vec<Wide>,
    pub(super) acceleration: Vec<Block>,
}

/// What tangents go along: an expanded motion up to an order, F′ of the slipping contacts, and what parameters change along
/// their directions while the motion is held.
pub(crate) struct Along<'a> {
    pub(crate) order: usize,
    pub(crate) frame: &'a Frame,
    pub(crate) motion: &'a Motion,
    pub(crate) force_lines: &'a [ForceLine],
    pub(crate) held: &'a Held,
    pub(crate) slopes: &'a [Series],
    pub(crate) given: &'a [(usize, &'a Given)],
}

/// What a motion would be given by a system: accelerations, friction forces, drive velocities.
#[derive(Clone, Debug)]
pub(crate) struct Given {
    pub(crate) acceleration: Vec<Series>,
    pub(crate) force: Vec<Series>,
    pub(crate) drive: Vec<Series>,
}

impl Given {
    /// Nothing.
    pub(crate) fn clear(&mut self) {
        for rows in [&mut self.acceleration, &mut self.force, &mut self.drive] {
            rows.fill(ZERO);
        }
    }

    /// The accelerations of its friction forces in slip, while the contacts that hold do what their drives do.
    pub(crate) fn accelerate(&mut self, order: usize, frame: &Frame, held: &Held) {
        let mut acceleration = vec![0.0; self.acceleration.len()];
        for k in 0..order {
            acceleration.fill(0.0);
            for (c, force) in self.force.iter().enumerate() {
                frame.push(c, force[k], &mut acceleration);
            }
            frame.hold(held, k, |_| 0.0, &mut self.force, &mut acceleration);
            for (a, series) in acceleration.iter().zip(&mut self.acceleration) {
                series[k] = *a;
            }
        }
    }
}

/// Series along several directions at `h`, and their slopes.
pub(crate) fn wide_at(series: &Wide, h: f64) -> [Block; 2] {
    if h == 0.0 {
        return [series[0], series[1]];
    }
    let (mut value, mut slope) = (series[ORDER], Block::NOTHING);
    for term in series[..ORDER].iter().rev() {
        for lane in 0..BLOCK {
            slope[lane] = slope[lane] * h + value[lane];
            value[lane] = value[lane] * h + term[lane];
        }
    }
    [value, slope]
}

/// F′(u(h)), by composition of the series of F′ around u(0) with u(h).
pub(crate) fn stiffening(law: &Law, u: &Series) -> Series {
    let (mut line, mut grown) = (ZERO, Grown::default());
    (line[0], line[1]) = (u[0], 1.0);
    let around: Vec<f64> = (0..=ORDER).map(|k| law.extend(&line, k, &mut grown)).collect();
    let mut away = *u;
    away[0] = 0.0;
    let mut slope = ZERO;
    for k in (1..=ORDER).rev() {
        let mut next = ZERO;
        // It will be multiplied with what begins at h another k − 1 times.
        for (j, term) in next.iter_mut().enumerate().take(ORDER + 2 - k) {
            *term = product(&slope, &away, j);
        }
        next[0] += k as f64 * around[k];
        slope = next;
    }
    slope
}

impl Motion {
    /// What this system, aimed at the same clock, would give to another motion: its accelerations go to `acceleration`,
    /// friction to `given`, up to the `order`.
    #[expect(
        clippy::too_many_arguments,
        reason = "two motions, and what one gives to the other"
    )]
    pub(crate) fn give(
        &mut self,
        order: usize,
        frame: &Frame,
        laws: &[&Law],
        force_lines: &[ForceLine],
        held: &Held,
        motion: &Self,
        acceleration: &mut [Series],
    ) {
        let mut free = std::mem::take(&mut self.acceleration);
        for k in 0..order {
            let given = &mut free;
            let (x, v) = (motion.x.of(k), motion.v.of(k));
            frame.freely(|i| self.input[i][k], |i| x[i], |i| v[i], given);
            for (c, force_line) in force_lines.iter().enumerate() {
                self.speed[c][k] = force_line.sign() * (self.drive[c][k] - frame.across(c, |i| v[i]));
                if !force_line.slips() {
                    continue;
                }
                let law = frame.is_smooth(c, force_line.direction).then_some(laws[c]);
                let mut size = force_line.size(law, &self.speed[c], k, &mut self.grown[c]);
                if frame.normals[c].is_some() {
                    self.normal[c][k] = self.pressed_along(frame, c, k, |i| x[i], |i| v[i]);
                    self.friction[c][k] = size;
                    size = product(&self.normal[c], &self.friction[c], k);
                }
                self.given[c][k] = force_line.direction * size;
                frame.push(c, self.given[c][k], given);
            }
            let drive = |c: usize| (k + 1) as f64 * self.drive[c][k + 1];
            frame.hold(held, k, drive, &mut self.given, given);
            for (series, given) in acceleration.iter_mut().zip(given) {
                series[k] = *given;
            }
        }
        self.acceleration = free;
    }
}

impl Frame {
    /// The accelerations without friction that an input, positions and velocities give.
    fn freely<T: Linear>(
        &self,
        input: impl Fn(usize) -> T,
        x: impl Fn(usize) -> T,
        v: impl Fn(usize) -> T,
        acceleration: &mut [T],
    ) {
        for (i, a) in acceleration.iter_mut().enumerate() {
            *a = input(i);
            for &(j, [spring, damper]) in self.near.row(i) {
                a.add(-spring, x(j));
                a.add(-damper, v(j));
            }
        }
    }

    /// The forces that let the held contacts follow what their drives do, added to their series and to the accelerations.
    fn hold<T: Linear>(
        &self,
        held: &Held,
        k: usize,
        drive: impl Fn(usize) -> T,
        force: &mut [[T; ORDER + 1]],
        acceleration: &mut [T],
    ) {
        for (row, &c) in held.contacts.iter().enumerate() {
            let mut pull = T::NOTHING;
            for &(at, gain) in held.gain(row) {
                let c = held.contacts[at];
                pull.add(gain, drive(c));
                pull.add(-gain, self.across(c, |i| acceleration[i]));
            }
            force[c][k] = pull;
        }
        for &c in &held.contacts {
            self.push(c, force[c][k], acceleration);
        }
    }
}

impl Tangent {
    /// Along nothing.
    pub(crate) fn new(frame: &Frame) -> Self {
        let (n, c) = (frame.masses, frame.ends.len());
        let nothing = [Block::NOTHING; ORDER + 1];
        Self {
            clock: Block::NOTHING,
            line: vec![[Block::NOTHING; 2]; c],
            x: vec![nothing; n],
            v: vec![nothing; n],
            u: vec![nothing; c],
            force: vec![nothing; c],
            normal: vec![nothing; c],
            friction: vec![nothing; c],
            acceleration: vec![Block::NOTHING; n],
        }
    }

    /// Whether its series, of this order, have come to their end.
    pub(crate) fn ended(&self, order: usize) -> bool {
        let series = self.x.iter().chain(&self.v);
        let forces = self.force.iter().map(|force| &force[order - 1]);
        series
            .map(|series| &series[order])
            .chain(forces)
            .all(|last| *last == Block::NOTHING)
    }

    /// Expand along an expanded motion from the coefficients 0 of x and v.
    pub(crate) fn expand(&mut self, along: &Along) {
        for k in 0..along.order {
            self.accelerate(along, k);
            self.follow(k);
        }
        self.finish(along);
    }

    /// Coefficients k of the slip speeds, of friction and of the accelerations.
    pub(super) fn accelerate(&mut self, along: &Along, k: usize) {
        let Along {
            frame,
            motion,
            force_lines,
            held,
            slopes,
            given,
            ..
        } = *along;
        let clock = self.clock;
        let acceleration = &mut self.acceleration;
        frame.freely(
            |i| later(clock, &motion.input[i], k),
            |j| self.x[j][k],
            |j| self.v[j][k],
            acceleration,
        );
        for (c, force_line) in force_lines.iter().enumerate() {
            let drive = later(clock, &motion.drive[c], k);
            self.u[c][k] = slip(frame, force_line, c, drive, |i| self.v[i][k]);
            if !force_line.slips() {
                continue;
            }
            // Of the size of friction under the normal force of the law.
            let mut force = Block::NOTHING;
            if frame.is_smooth(c, force_line.direction) {
                for (j, slope) in slopes[c][..=k].iter().enumerate() {
                    force.add(*slope, self.u[c][k - j]);
                }
            } else {
                force.add(force_line.slope, self.u[c][k]);
            }
            let [offset, slope] = self.line[c];
            force.add(motion.u.of(k)[c], slope);
            if k == 0 {
                force.add(1.0, offset);
            }
            if let Some(normal) = &frame.normals[c] {
                self.friction[c][k] = force;
                let mut pressed = later(clock, &motion.pressed[c], k);
                pressed.add(normal.position, frame.across(c, |i| self.x[i][k]));
                pressed.add(normal.velocity, frame.across(c, |i| self.v[i][k]));
                self.normal[c][k] = pressed;
                force = Block::NOTHING;
                for j in 0..=k {
                    force.add(motion.friction[c][k - j], self.normal[c][j]);
                    force.add(motion.normal[c][k - j], self.friction[c][j]);
                }
            }
            let force = force.map(|force| force_line.direction * force);
            self.force[c][k] = force;
            frame.push(c, force, acceleration);
        }
        let drive = |c: usize| later(clock, &motion.drive[c], k + 1).map(|rate| (k + 1) as f64 * rate);
        frame.hold(held, k, drive, &mut self.force, acceleration);
        for (lane, given) in given {
            for (a, series) in acceleration.iter_mut().zip(&given.acceleration) {
                a[*lane] += series[k];
            }
        }
    }

    /// Coefficients k + 1 of positions and velocities.
    pub(super) fn follow(&mut self, k: usize) {
        for (i, a) in self.acceleration.iter().enumerate() {
            self.x[i][k + 1] = self.v[i][k].map(|v| v * INVERSE[k + 1]);
            self.v[i][k + 1] = a.map(|a| a * INVERSE[k + 1]);
        }
    }

    /// The last slip speeds, and what parameters change of slip speeds and forces.
    pub(super) fn finish(&mut self, along: &Along) {
        let Along { order, frame, .. } = *along;
        for (c, force_line) in along.force_lines.iter().enumerate() {
            let drive = later(self.clock, &along.motion.drive[c], order);
            self.u[c][order] = slip(frame, force_line, c, drive, |i| self.v[i][order]);
            for (lane, given) in along.given {
                // The law has answered for these in what is given. A force has no coefficient of the last order: what would be
                // added to it would stay there for all expansions to come.
                for (own, drive) in self.u[c][..=order].iter_mut().zip(&given.drive[c]) {
                    own[*lane] += force_line.sign() * drive;
                }
                for (own, force) in self.force[c][..order].iter_mut().zip(&given.force[c]) {
                    own[*lane] += force;
                }
            }
        }
    }
}

/// What the clock changes in a coefficient of a series that comes from outside: its derivative.
fn later(clock: Block, series: &Series, k: usize) -> Block {
    let slope = if k < ORDER {
        (k + 1) as f64 * series[k + 1]
    } else {
        0.0
    };
    clock.map(|amount| amount * slope)
}

/// The slip speed of a contact from the velocities of its drive and of the masses.
fn slip(
    frame: &Frame,
    force_line: &ForceLine,
    contact: usize,
    drive: Block,
    v: impl Fn(usize) -> Block,
) -> Block {
    let mut slip = Block::NOTHING;
    slip.add(force_line.sign(), drive);
    slip.add(-force_line.sign(), frame.across(contact, v));
    slip
}
