//! The derivative of a Taylor expansion: by where it starts, by the clock, by the lines of friction, and by one parameter.
//!
//! With y' = f(y, t, p) the derivative obeys the variational equation δy' = f_y δy + f_t δt + f_p δp, whose coefficients follow
//! from those of the motion. F′ along the motion is the composition of its own series with that of the slip speed; f_p is a
//! difference of the accelerations that systems beside this one give to the same motion.

use super::{Frame, Held, Motion, Rub};
use crate::law::{Friction, Law};
use crate::series::{Grown, INVERSE, ORDER, Series, ZERO, derivative, product};

/// One direction of differentiation: how the clock, the lines of friction and the parameter move along it, and what becomes of
/// the motion.
#[derive(Clone, Debug)]
pub(crate) struct Tangent {
    /// How far the clock moves.
    pub(crate) clock: f64,
    /// How far offset and slope of the line of friction of each contact move.
    pub(crate) line: Vec<[f64; 2]>,
    /// Whether the parameter moves.
    pub(crate) parameter: bool,
    pub(crate) x: Vec<Series>,
    pub(crate) v: Vec<Series>,
    /// Of the slip speeds.
    pub(crate) u: Vec<Series>,
    pub(crate) force: Vec<Series>,
}

/// What a motion would be given by a system: accelerations, friction forces, drive velocities.
#[derive(Clone, Debug, Default)]
pub(crate) struct Given {
    pub(crate) acceleration: Vec<Series>,
    pub(crate) force: Vec<Series>,
    pub(crate) drive: Vec<Series>,
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
        for (j, term) in next.iter_mut().enumerate() {
            *term = product(&slope, &away, j);
        }
        next[0] += k as f64 * around[k];
        slope = next;
    }
    slope
}

impl Motion {
    /// What this system, aimed at the same clock, would give to the motion `x`, `v`.
    pub(crate) fn given(
        &self,
        frame: &Frame,
        laws: &[&Law],
        rubs: &[Rub],
        held: &Held,
        (x, v): (&[Series], &[Series]),
    ) -> Given {
        let (n, contacts) = (frame.masses, rubs.len());
        let mut given = Given {
            acceleration: vec![ZERO; n],
            force: vec![ZERO; contacts],
            drive: self.drive.clone(),
        };
        let mut u = vec![ZERO; contacts];
        let mut grown = vec![Grown::default(); contacts];
        let mut acceleration = vec![0.0; n];
        for k in 0..ORDER {
            frame.freely(k, &self.input, (x, v), &mut acceleration);
            for (c, rub) in rubs.iter().enumerate() {
                u[c][k] = rub.sign() * (self.drive[c][k] - frame.across(c, |i| v[i][k]));
                if rub.holds() {
                    continue;
                }
                let size = if frame.smooth[c] {
                    laws[c].extend(&u[c], k, &mut grown[c])
                } else {
                    rub.slope * u[c][k] + if k == 0 { rub.offset } else { 0.0 }
                };
                given.force[c][k] = rub.direction * size;
                frame.push_by(c, given.force[c][k], &mut acceleration);
            }
            frame.hold(held, k, &self.drive, &mut given.force, &mut acceleration);
            for (series, a) in given.acceleration.iter_mut().zip(&acceleration) {
                series[k] = *a;
            }
        }
        given
    }

    /// The derivatives of all drives and free accelerations by the clock, times `amount`.
    fn later(&self, amount: f64) -> (Vec<Series>, Vec<Series>) {
        let shifted = |series: &Series| derivative(series).map(|term| amount * term);
        (
            self.drive.iter().map(shifted).collect(),
            self.input.iter().map(shifted).collect(),
        )
    }
}

impl Frame {
    /// The accelerations without friction that an input, positions and velocities give.
    fn freely(&self, k: usize, input: &[Series], (x, v): (&[Series], &[Series]), acceleration: &mut [f64]) {
        for (i, a) in acceleration.iter_mut().enumerate() {
            let (spring, damper) = (self.spring.row(i), self.damper.row(i));
            *a = input[i][k];
            for j in 0..self.masses {
                *a -= spring[j] * x[j][k] + damper[j] * v[j][k];
            }
        }
    }

    /// The forces of the held contacts, added to their series and to the accelerations.
    fn hold(&self, held: &Held, k: usize, drive: &[Series], force: &mut [Series], acceleration: &mut [f64]) {
        for (row, &c) in held.contacts.iter().enumerate() {
            let gain = held.gain.row(row);
            let wants = held.contacts.iter().zip(gain).map(|(&c, gain)| {
                gain * ((k + 1) as f64 * drive[c][k + 1] - self.across(c, |i| acceleration[i]))
            });
            force[c][k] = wants.sum();
        }
        for &c in &held.contacts {
            self.push_by(c, force[c][k], acceleration);
        }
    }

    /// Add what a force of a contact accelerates.
    fn push_by(&self, contact: usize, force: f64, acceleration: &mut [f64]) {
        for (a, response) in acceleration.iter_mut().zip(&self.response[contact]) {
            *a += response * force;
        }
    }

    /// What a unit force of a contact accelerates a mass by.
    pub(crate) fn response(&self, contact: usize, mass: usize) -> f64 {
        self.response[contact][mass]
    }

    pub(crate) fn is_smooth(&self, contact: usize) -> bool {
        self.smooth[contact]
    }
}

impl Tangent {
    /// Along nothing.
    pub(crate) fn new(frame: &Frame) -> Self {
        let (n, c) = (frame.masses, frame.ends.len());
        Self {
            clock: 0.0,
            line: vec![[0.0; 2]; c],
            parameter: false,
            x: vec![ZERO; n],
            v: vec![ZERO; n],
            u: vec![ZERO; c],
            force: vec![ZERO; c],
        }
    }

    /// Whether anything moves along it at all.
    pub(crate) fn moves(&self) -> bool {
        let still = |series: &[Series]| series.iter().all(|series| series[0] == 0.0);
        self.parameter
            || self.clock != 0.0
            || self.line.iter().any(|line| *line != [0.0; 2])
            || !still(&self.x)
            || !still(&self.v)
    }

    /// Expand along an expanded motion from the coefficients 0 of x and v; `slopes` are F′ of the slipping contacts, `given`
    /// what the parameter changes while the motion is held.
    pub(crate) fn expand(
        &mut self,
        frame: &Frame,
        motion: &Motion,
        rubs: &[Rub],
        held: &Held,
        slopes: &[Series],
        given: Option<&Given>,
    ) {
        let n = frame.masses;
        let given = given.filter(|_| self.parameter);
        let (drive, input) = motion.later(self.clock);
        let mut acceleration = vec![0.0; n];
        for k in 0..ORDER {
            frame.freely(k, &input, (&self.x, &self.v), &mut acceleration);
            for (c, rub) in rubs.iter().enumerate() {
                self.u[c][k] = rub.sign() * (drive[c][k] - frame.across(c, |i| self.v[i][k]));
                if rub.holds() {
                    continue;
                }
                let stiff = if frame.smooth[c] {
                    product(&slopes[c], &self.u[c], k)
                } else {
                    rub.slope * self.u[c][k]
                };
                let [offset, slope] = self.line[c];
                let own = slope * motion.u[c][k] + if k == 0 { offset } else { 0.0 };
                self.force[c][k] = rub.direction * (stiff + own);
                frame.push_by(c, self.force[c][k], &mut acceleration);
            }
            frame.hold(held, k, &drive, &mut self.force, &mut acceleration);
            if let Some(given) = given {
                for (a, series) in acceleration.iter_mut().zip(&given.acceleration) {
                    *a += series[k];
                }
            }
            for (i, a) in acceleration.iter().enumerate() {
                self.x[i][k + 1] = self.v[i][k] * INVERSE[k + 1];
                self.v[i][k + 1] = a * INVERSE[k + 1];
            }
        }
        for (c, rub) in rubs.iter().enumerate() {
            self.u[c][ORDER] = rub.sign() * (drive[c][ORDER] - frame.across(c, |i| self.v[i][ORDER]));
            if let Some(given) = given {
                // The law has answered for these in what is given.
                for k in 0..=ORDER {
                    self.u[c][k] += rub.sign() * given.drive[c][k];
                    self.force[c][k] += given.force[c][k];
                }
            }
        }
    }
}
