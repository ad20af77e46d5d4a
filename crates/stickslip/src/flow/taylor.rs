//! Motion of any number of masses in one combination of modes, as a Taylor series.
//!
//! With y = (x, v) the equation of motion gives the next coefficient of y from those known. For linear pieces of friction
//! y' = A y + waves, so |y_{k+1}| ≤ L |y_k|/(k + 1): with L h ≤ 4 what is left out is less than a quarter of the last term,
//! and the step keeps that term below rounding. For a smooth law the series of its friction grows along; the last two terms
//! give an estimate instead of a bound, so the law itself is compared with its series along the step, at slip speeds so close
//! that no feature of the law hides between two of them, and the step ends where they still agree.

mod coefficients;
mod frame;
mod held;
mod reach;
mod slow;
pub(crate) mod tangent;

use crate::clock::Clock;
use crate::elementary::add;
use crate::harmonic::add_wave;
use crate::law::{Friction, Law};
use crate::series::{Grown, INVERSE, Series, ZERO};
use coefficients::Acting;
pub(crate) use coefficients::Coefficients;
pub(crate) use frame::Frame;
pub(crate) use held::{Held, holding};
use slow::Pace;

/// What a contact does, as far as the flow cares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ForceLine {
    /// Sign of the slip velocity, 0 while stuck.
    pub direction: f64,
    /// Friction that opposes slip is offset + slope · u, unless the law is smooth.
    pub offset: f64,
    /// The slope of that line; infinite where the slip speed is held, −infinite where the bodies are apart.
    pub slope: f64,
    /// The slip acceleration is zero at the start, by what led there: rounding must not give it a sign.
    pub zero_slope: bool,
}

impl ForceLine {
    /// Of a contact that sticks.
    pub(crate) const STUCK: Self = Self {
        direction: 0.0,
        offset: 0.0,
        slope: 0.0,
        zero_slope: false,
    };

    /// Whether friction here is the reaction of a constraint: adhesion, or a slip speed that is held between two branches.
    /// A stuck contact at its limit that others hold has a force, its offset, instead.
    pub(crate) fn holds(&self) -> bool {
        self.slope == f64::INFINITY || self.direction == 0.0 && self.offset == 0.0
    }

    /// Whether the bodies are apart.
    pub(crate) fn separated(&self) -> bool {
        self.slope == f64::NEG_INFINITY
    }

    /// Whether friction follows from the law.
    pub(crate) fn slips(&self) -> bool {
        self.direction != 0.0 && self.slope.is_finite()
    }

    /// Coefficient k of the size of friction under the normal force of the law, from the slip speed up to k.
    fn size(&self, law: Option<&Law>, u: &Series, k: usize, grown: &mut Grown) -> f64 {
        match law {
            Some(law) => law.toward(self.direction).extend(u, k, grown),
            None if k == 0 => self.offset + self.slope * u[0],
            None => self.slope * u[k],
        }
    }

    /// What the slip velocity is multiplied with to give the slip speed.
    fn sign(&self) -> f64 {
        if self.direction == 0.0 {
            1.0
        } else {
            self.direction
        }
    }
}

/// What gives the accelerations in one combination of modes.
#[derive(Clone, Copy)]
pub(crate) struct VectorField<'a> {
    pub(crate) frame: &'a Frame,
    pub(crate) laws: &'a [&'a Law],
    pub(crate) force_lines: &'a [ForceLine],
    pub(crate) held: &'a Held,
}

/// One Taylor expansion; its memory is used again for the next.
#[derive(Clone, Debug)]
pub(crate) struct Motion {
    /// Positions.
    pub(crate) x: Coefficients,
    /// Velocities.
    pub(crate) v: Coefficients,
    /// Slip speed along the direction of slip; slip velocity while stuck.
    pub(crate) u: Coefficients,
    /// Friction forces on the mass of each contact.
    pub(crate) force: Coefficients,
    /// Slip speeds of the contacts whose laws are asked for coefficients, and forces that another motion is given.
    speed: Vec<Series>,
    pub(crate) given: Vec<Series>,
    /// Normal forces that vary, over those of the laws.
    pub(crate) normal: Vec<Series>,
    /// Friction in slip under the normal force of the law, where that varies.
    friction: Vec<Series>,
    drive: Vec<Series>,
    /// The pieces of the springs, their displacements, the squares of these, and the forces.
    pub(crate) pieces: Vec<usize>,
    pub(crate) displacement: Vec<Series>,
    square: Vec<Series>,
    pub(crate) pull: Vec<Series>,
    /// What of the normal forces does not depend on the motion.
    pressed: Vec<Series>,
    input: Vec<Series>,
    grown: Vec<Grown>,
    acceleration: Vec<f64>,
    wanted: Vec<f64>,
    /// The accelerations that contacts that hold give the masses, and the forces on those for that.
    gained: Vec<f64>,
    load: Vec<f64>,
    /// What rounding took of the positions and velocities along the steps so far: of a slip speed that is less than the
    /// rounding of the velocities it is all there is.
    lost: Vec<[f64; 2]>,
    acting: Acting,
    /// How fast the motion is, where damping leaves no other than a slow one.
    slow: Option<Pace>,
}

impl Motion {
    pub(crate) fn of(frame: &Frame) -> Self {
        let (n, c) = (frame.masses, frame.ends.len());
        Self {
            x: Coefficients::new(n, frame.order),
            v: Coefficients::new(n, frame.order),
            u: Coefficients::new(c, frame.order),
            force: Coefficients::new(c, frame.order),
            speed: vec![ZERO; c],
            given: vec![ZERO; c],
            normal: vec![ZERO; c],
            friction: vec![ZERO; c],
            drive: vec![ZERO; c],
            pieces: vec![0; frame.springs.len()],
            displacement: vec![ZERO; frame.springs.len()],
            square: vec![ZERO; frame.springs.len()],
            pull: vec![ZERO; frame.springs.len()],
            pressed: vec![ZERO; c],
            input: vec![ZERO; n],
            grown: vec![Grown::default(); c],
            acceleration: vec![0.0; n],
            wanted: vec![0.0; c],
            gained: vec![0.0; n],
            load: vec![0.0; n],
            lost: vec![[0.0; 2]; n],
            acting: Acting::new(frame),
            slow: None,
        }
    }

    /// The slip velocity of a contact at velocities, to the rounding of itself.
    pub(crate) fn slip(&self, frame: &Frame, c: usize, v: &[f64]) -> f64 {
        self.drive[c][0] - frame.across(c, |i| v[i]) - frame.across(c, |i| self.lost[i][1])
    }

    /// Give the held contacts exactly zero slip velocity, at no change of momentum where two masses meet.
    pub(crate) fn stop(&mut self, frame: &Frame, held: &Held, v: &mut [f64]) {
        self.keep(frame, held, |_| 0.0, v);
    }

    /// The same for any slip velocity.
    pub(crate) fn keep(&mut self, frame: &Frame, held: &Held, kept: impl Fn(usize) -> f64, v: &mut [f64]) {
        if held.contacts.is_empty() {
            return;
        }
        for (row, &c) in held.contacts.iter().enumerate() {
            self.wanted[row] = self.slip(frame, c, v) - kept(c);
        }
        self.acceleration.fill(0.0);
        for (row, &c) in held.contacts.iter().enumerate() {
            frame.push(c, held.force(row, |at| self.wanted[at]), &mut self.acceleration);
        }
        for (i, change) in self.acceleration.iter().enumerate() {
            (v[i], self.lost[i][1]) = add((v[i], self.lost[i][1]), (*change, 0.0));
        }
    }

    /// Whether damping leaves only its slow part.
    pub(crate) fn is_slow(&self) -> bool {
        self.slow.is_some()
    }

    /// All drive velocities.
    pub(crate) fn drives(&self) -> &[Series] {
        &self.drive
    }

    /// What acts from outside, from `clock` on.
    pub(crate) fn aim(&mut self, frame: &Frame, clock: Clock) {
        for (drive, series) in frame.drives.iter().zip(&mut self.drive) {
            drive.expand(clock, series);
        }
        for (normal, series) in frame.normals.iter().zip(&mut self.pressed) {
            if let Some(normal) = normal {
                normal.expand(clock, series);
            }
        }
        if !frame.forcing.is_empty() {
            self.input.fill(ZERO);
            for force in &frame.forcing {
                for (i, series) in self.input.iter_mut().enumerate() {
                    let response = frame.inverse.at(i, force.mass);
                    if response != 0.0 {
                        add_wave(&force.harmonic(), clock, response, series);
                    }
                }
            }
        }
        self.acting.aim(frame, &self.drive, &self.input);
    }

    /// Coefficient k of the normal force of a contact, where that varies, from those of positions and velocities.
    fn pressed_along(
        &self,
        frame: &Frame,
        c: usize,
        k: usize,
        x: impl Fn(usize) -> f64,
        v: impl Fn(usize) -> f64,
    ) -> f64 {
        frame.normals[c].as_ref().map_or(0.0, |normal| {
            let (x, v) = (frame.across(c, x), frame.across(c, v));
            self.pressed[c][k] + normal.position * x + normal.velocity * v
        })
    }

    /// The pieces of the springs at positions.
    pub(crate) fn choose_pieces(&mut self, frame: &Frame, x: &[f64]) {
        for (piece, spring) in self.pieces.iter_mut().zip(&frame.springs) {
            *piece = spring.piece(x[spring.mass] - spring.other.map_or(0.0, |other| x[other]));
        }
    }

    /// The free accelerations b_c · a of every contact at (x, v), and the drive's: what its force must make up for to hold.
    pub(crate) fn required(&mut self, frame: &Frame, x: &[f64], v: &[f64], required: &mut Vec<f64>) {
        self.begin(x, v);
        self.free(frame, 0);
        required.clear();
        required.extend(
            (0..frame.ends.len()).map(|c| self.drive[c][1] - frame.across(c, |i| self.acceleration[i])),
        );
    }

    /// Expand from (x, v), after [`Motion::aim`]: every coefficient up to the order of the frame, friction up to one less.
    pub(crate) fn expand(&mut self, field: &VectorField, x: &[f64], v: &[f64]) {
        if !self.expand_slow(field, x, v) {
            self.expand_whole(field, x, v);
        }
    }

    /// The same where the fast part of the motion counts too.
    pub(crate) fn expand_whole(&mut self, field: &VectorField, x: &[f64], v: &[f64]) {
        self.slow = None;
        let (frame, laws, force_lines) = (field.frame, field.laws, field.force_lines);
        let linear = frame.springs.is_empty();
        if let ([_], [law], [force_line], [None], true) = (x, laws, force_lines, &frame.normals[..], linear) {
            self.expand_single(frame, law, *force_line, x[0], v[0]);
            return;
        }
        self.expand_many(field, x, v);
    }

    /// The same for one mass on one drive, where the bookkeeping would cost more than the motion.
    fn expand_single(&mut self, frame: &Frame, law: &Law, force_line: ForceLine, x0: f64, v0: f64) {
        let [spring, damper] = frame.near.row(0).first().map_or([0.0; 2], |(_, near)| *near);
        let (response, order) = (frame.response(0, 0), frame.order);
        let slip = self.drive[0][0] - v0 - self.lost[0][1];
        let (x, v, u) = (self.x.only(), self.v.only(), self.u.only());
        let (force, drive, input) = (self.force.only(), &self.drive[0], &self.input[0]);
        (x[0], v[0]) = (x0, v0);
        let ForceLine {
            direction,
            offset,
            slope,
            zero_slope,
        } = force_line;
        if force_line.holds() {
            for k in 0..order {
                let wanted = (k + 1) as f64 * drive[k + 1];
                u[k] = if k == 0 { force_line.sign() * slip } else { 0.0 };
                force[k] = (wanted - input[k] + spring * x[k] + damper * v[k]) / response;
                x[k + 1] = v[k] * INVERSE[k + 1];
                v[k + 1] = drive[k + 1];
            }
            u[order] = 0.0;
            return;
        }
        let drive_varies = !frame.drives[0].is_constant();
        u[0] = direction * slip;
        // All waits for what is done with `size`: a product and a sum.
        let next = |k: usize, size: f64| {
            force[k] = direction * size;
            let along = if zero_slope && k == 0 {
                direction * drive[1]
            } else {
                let free = input[k] - spring * x[k] - damper * v[k];
                direction * free * INVERSE[k + 1] + response * INVERSE[k + 1] * size
            };
            x[k + 1] = v[k] * INVERSE[k + 1];
            v[k + 1] = direction * along;
            if drive_varies {
                direction * drive[k + 1] - along
            } else {
                -along
            }
        };
        if frame.is_smooth(0, direction) {
            law.toward(direction).grow(u, order, &mut self.grown[0], next);
        } else {
            let mut next = next;
            for k in 0..order {
                u[k + 1] = next(k, slope * u[k] + if k == 0 { offset } else { 0.0 });
            }
        }
    }

    /// Move positions and velocities on by `h`, and what rounding took of both: many short steps add up to what one long step is.
    pub(crate) fn advance(&mut self, h: f64, x: &mut [f64], v: &mut [f64]) {
        let gains = &mut self.acceleration;
        self.x.gains(h, gains);
        for ((x, lost), gain) in x.iter_mut().zip(&mut self.lost).zip(&*gains) {
            (*x, lost[0]) = add((*x, lost[0]), (*gain, 0.0));
        }
        self.v.gains(h, gains);
        for ((v, lost), gain) in v.iter_mut().zip(&mut self.lost).zip(&*gains) {
            (*v, lost[1]) = add((*v, lost[1]), (*gain, 0.0));
        }
    }
}
