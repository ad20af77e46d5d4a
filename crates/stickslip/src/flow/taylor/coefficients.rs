//! The expansion of many masses: coefficient after coefficient, all masses and contacts side by side, which lets a processor
//! take several at once. Sums are added up in the order of their terms, whichever way they lie in memory.

use super::{ForceLine, Frame, Held, Motion, VectorField};
use crate::matrix::Rows;
use crate::series::{INVERSE, ORDER, Series, ZERO, gain, product, slope_at};

/// Entries of a sparse matrix that follow each other along a diagonal: what masses feel of others.
#[derive(Clone, Debug)]
struct Diagonal {
    row: usize,
    column: usize,
    springs: Vec<f64>,
    dampers: Vec<f64>,
}

/// Contacts that follow each other, on masses that do, with drives or with other masses that do.
#[derive(Clone, Copy, Debug)]
struct Joints {
    contact: usize,
    mass: usize,
    other: Option<usize>,
    count: usize,
}

/// Contacts that follow each other, each of which accelerates one mass, these following each other too, by so much; none for a
/// contact that accelerates several.
#[derive(Clone, Debug)]
struct Pushes {
    contact: usize,
    mass: usize,
    responses: Vec<f64>,
}

/// What of a frame an expansion reads, as it lies in memory.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    diagonals: Vec<Diagonal>,
    joints: Vec<Joints>,
    pushes: Vec<Pushes>,
}

impl Layout {
    pub(super) fn new(near: &Rows<[f64; 2]>, ends: &[(usize, Option<usize>)], response: &Rows<f64>) -> Self {
        let rows = near.count();
        let entries = (0..rows).flat_map(|i| near.row(i).iter().map(move |&(j, both)| (i, j, both)));
        let mut entries: Vec<_> = entries.collect();
        // Row after row within a diagonal, and for each row the diagonals in the order of the columns.
        entries.sort_by_key(|&(i, j, _)| (rows + j - i, i));
        let mut diagonals: Vec<Diagonal> = Vec::new();
        for (row, column, [spring, damper]) in entries {
            let follows = |last: &&mut Diagonal| {
                let count = last.springs.len();
                (last.row + count, last.column + count) == (row, column)
            };
            if let Some(last) = diagonals.last_mut().filter(follows) {
                last.springs.push(spring);
                last.dampers.push(damper);
            } else {
                diagonals.push(Diagonal {
                    row,
                    column,
                    springs: vec![spring],
                    dampers: vec![damper],
                });
            }
        }
        let mut joints: Vec<Joints> = Vec::new();
        let mut pushes: Vec<Pushes> = Vec::new();
        for (contact, &(mass, other)) in ends.iter().enumerate() {
            let follows = |last: &&mut Joints| {
                last.mass + last.count == mass && last.other.map(|first| first + last.count) == other
            };
            match joints.last_mut().filter(follows) {
                Some(last) => last.count += 1,
                None => joints.push(Joints {
                    contact,
                    mass,
                    other,
                    count: 1,
                }),
            }
            let &[(mass, response)] = response.row(contact) else {
                let responses = Vec::new();
                pushes.push(Pushes {
                    contact,
                    mass,
                    responses,
                });
                continue;
            };
            let follows =
                |last: &&mut Pushes| !last.responses.is_empty() && last.mass + last.responses.len() == mass;
            match pushes.last_mut().filter(follows) {
                Some(last) => last.responses.push(response),
                None => pushes.push(Pushes {
                    contact,
                    mass,
                    responses: vec![response],
                }),
            }
        }
        Self {
            diagonals,
            joints,
            pushes,
        }
    }
}

/// The Taylor coefficients of several series: those of a power of time side by side, one power after the other.
#[derive(Clone, Debug)]
pub(crate) struct Coefficients {
    count: usize,
    numbers: Vec<f64>,
}

impl Coefficients {
    /// Of an order; a single one is a series as others are.
    pub(super) fn new(count: usize, order: usize) -> Self {
        let order = if count == 1 { ORDER } else { order };
        Self {
            count,
            numbers: vec![0.0; count * (order + 1)],
        }
    }

    /// The highest power.
    fn order(&self) -> usize {
        self.numbers.len() / self.count - 1
    }

    /// How many series.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// Those of a power, series by series.
    pub(crate) fn of(&self, k: usize) -> &[f64] {
        &self.numbers[k * self.count..][..self.count]
    }

    pub(super) fn of_mut(&mut self, k: usize) -> &mut [f64] {
        &mut self.numbers[k * self.count..][..self.count]
    }

    /// One of them.
    #[inline]
    pub(crate) fn series(&self, i: usize) -> Series {
        if self.count == 1 {
            return self.numbers[..].try_into().expect("one series");
        }
        let mut series = ZERO;
        for (own, row) in series.iter_mut().zip(self.numbers.chunks_exact(self.count)) {
            *own = row[i];
        }
        series
    }

    /// The only one.
    pub(super) fn only(&mut self) -> &mut Series {
        (&mut self.numbers[..]).try_into().expect("one series")
    }

    fn set(&mut self, i: usize, series: &Series) {
        for (row, number) in self.numbers.chunks_exact_mut(self.count).zip(series) {
            row[i] = *number;
        }
    }

    /// By how much each is more at `h` than at 0.
    #[inline]
    pub(super) fn gains(&self, h: f64, gains: &mut Vec<f64>) {
        gains.clear();
        if self.count == 1 {
            return gains.push(gain(&self.series(0), h));
        }
        gains.resize(self.count, 0.0);
        for k in (1..=self.order()).rev() {
            for (sum, term) in gains.iter_mut().zip(self.of(k)) {
                *sum = *sum * h + term;
            }
        }
        for sum in gains {
            *sum *= h;
        }
    }

    /// The slopes at `h`.
    pub(crate) fn slopes(&self, h: f64) -> Vec<f64> {
        if self.count == 1 {
            return vec![slope_at(&self.series(0), h).1];
        }
        let order = self.order();
        let (mut values, mut slopes) = (self.of(order).to_vec(), vec![0.0; self.count]);
        for k in (0..order).rev() {
            for ((slope, value), term) in slopes.iter_mut().zip(&mut values).zip(self.of(k)) {
                *slope = *slope * h + *value;
                *value = *value * h + term;
            }
        }
        slopes
    }
}

/// A line of friction for every contact: the slip speed is the `sign` times the slip velocity, the force the `turn` times
/// offset + slope · speed.
#[derive(Clone, Debug)]
struct Lines {
    sign: Vec<f64>,
    turn: Vec<f64>,
    offset: Vec<f64>,
    slope: Vec<f64>,
    /// Contacts whose force does not follow from such a line.
    others: Vec<usize>,
    /// Stuck contacts for themselves: contact, mass, what its force owes to what it needs.
    alone: Vec<(usize, usize, f64)>,
}

/// What acts from outside, and the lines of friction.
#[derive(Clone, Debug)]
pub(super) struct Acting {
    drive: Coefficients,
    input: Coefficients,
    lines: Lines,
}

impl Acting {
    pub(super) fn new(frame: &Frame) -> Self {
        let (n, c) = (frame.masses, frame.ends.len());
        Self {
            drive: Coefficients::new(c, frame.order),
            input: Coefficients::new(n, frame.order),
            lines: Lines {
                sign: vec![0.0; c],
                turn: vec![0.0; c],
                offset: vec![0.0; c],
                slope: vec![0.0; c],
                others: Vec::new(),
                alone: Vec::new(),
            },
        }
    }

    /// What acts from outside.
    pub(super) fn aim(&mut self, frame: &Frame, drives: &[Series], inputs: &[Series]) {
        for (c, (drive, series)) in frame.drives.iter().zip(drives).enumerate() {
            if drive.is_constant() {
                self.drive.numbers[c] = series[0];
            } else {
                self.drive.set(c, series);
            }
        }
        if !frame.forcing.is_empty() {
            for (i, series) in inputs.iter().enumerate() {
                self.input.set(i, series);
            }
        }
    }
}

impl Lines {
    /// What the contacts do, as far as it stays what it is from coefficient to coefficient.
    fn set(&mut self, frame: &Frame, force_lines: &[ForceLine], held: &Held) {
        self.others.clear();
        for (c, line) in force_lines.iter().enumerate() {
            let slips = line.slips();
            self.sign[c] = line.sign();
            (self.turn[c], self.offset[c], self.slope[c]) = if slips {
                (line.direction, line.offset, line.slope)
            } else {
                (0.0, 0.0, 0.0)
            };
            let pinned = !slips && !line.separated() && line.offset != 0.0;
            let smooth = slips && frame.is_smooth(c, line.direction);
            if pinned || smooth || line.separated() || frame.normals[c].is_some() {
                self.others.push(c);
            }
        }
        self.alone.clear();
        for (row, &c) in held.contacts.iter().enumerate() {
            let (&[(at, gain)], &[(mass, _)], None) =
                (held.gain(row), frame.response.row(c), frame.ends[c].1)
            else {
                return self.alone.clear();
            };
            if at != row || mass != frame.ends[c].0 {
                return self.alone.clear();
            }
            self.alone.push((c, mass, gain));
        }
    }
}

impl Motion {
    /// Coefficients k of the accelerations without any friction, from those of x and v.
    pub(super) fn free(&mut self, frame: &Frame, k: usize) {
        let (x, v) = (self.x.of(k), self.v.of(k));
        self.acceleration.copy_from_slice(self.acting.input.of(k));
        for diagonal in &frame.layout.diagonals {
            let count = diagonal.springs.len();
            let own = &mut self.acceleration[diagonal.row..][..count];
            let (x, v) = (&x[diagonal.column..][..count], &v[diagonal.column..][..count]);
            let (springs, dampers) = (&diagonal.springs[..count], &diagonal.dampers[..count]);
            for i in 0..count {
                own[i] -= springs[i] * x[i] + dampers[i] * v[i];
            }
        }
        for (s, spring) in frame.springs.iter().enumerate() {
            let at = spring.other.map_or(0.0, |other| x[other]);
            self.displacement[s][k] = x[spring.mass] - at;
            let [offset, slope] = spring.line(self.pieces[s]);
            let mut pull = slope * self.displacement[s][k] + if k == 0 { offset } else { 0.0 };
            if spring.cubic != 0.0 {
                self.square[s][k] = product(&self.displacement[s], &self.displacement[s], k);
                pull += spring.cubic * product(&self.square[s], &self.displacement[s], k);
            }
            self.pull[s][k] = pull;
            for i in 0..frame.masses {
                let other = spring.other.map_or(0.0, |other| frame.inverse.at(i, other));
                self.acceleration[i] -= (frame.inverse.at(i, spring.mass) - other) * pull;
            }
        }
    }

    /// Coefficients 0 of x and v.
    pub(super) fn begin(&mut self, x: &[f64], v: &[f64]) {
        self.x.of_mut(0).copy_from_slice(x);
        self.v.of_mut(0).copy_from_slice(v);
    }

    /// Coefficients k of the slip speeds.
    fn speeds(&mut self, frame: &Frame, k: usize) {
        let Acting { drive, lines, .. } = &self.acting;
        let (v, u, drive) = (self.v.of(k), self.u.of_mut(k), drive.of(k));
        for joints in &frame.layout.joints {
            let Joints {
                contact,
                mass,
                other,
                count,
            } = *joints;
            let (u, drive) = (&mut u[contact..][..count], &drive[contact..][..count]);
            let (sign, one) = (&lines.sign[contact..][..count], &v[mass..][..count]);
            if let Some(other) = other {
                let two = &v[other..][..count];
                for i in 0..count {
                    u[i] = sign[i] * (drive[i] - (one[i] - two[i]));
                }
            } else {
                for i in 0..count {
                    u[i] = sign[i] * (drive[i] - one[i]);
                }
            }
        }
    }

    /// Coefficients k of friction that does not hold, from those of the slip speeds, and what it accelerates.
    fn friction(&mut self, field: &VectorField, k: usize, sloped: bool) {
        let (frame, laws, force_lines) = (field.frame, field.laws, field.force_lines);
        let lines = &self.acting.lines;
        let (speeds, forces) = (self.u.of(k), self.force.of_mut(k));
        let count = speeds.len();
        let (turn, offset, slope) = (
            &lines.turn[..count],
            &lines.offset[..count],
            &lines.slope[..count],
        );
        for c in 0..count {
            let size = slope[c] * speeds[c];
            forces[c] = turn[c] * if k == 0 { offset[c] + size } else { size };
        }
        for at in 0..self.acting.lines.others.len() {
            let c = self.acting.lines.others[at];
            self.press(frame, c, k);
            let line = &force_lines[c];
            let force = if line.separated() {
                0.0
            } else if line.slips() {
                self.speed[c][k] = self.u.of(k)[c];
                let law = frame.is_smooth(c, line.direction).then_some(laws[c]);
                let mut size = line.size(law, &self.speed[c], k, &mut self.grown[c]);
                if frame.normals[c].is_some() {
                    self.friction[c][k] = size;
                    size = product(&self.normal[c], &self.friction[c], k);
                }
                line.direction * size
            } else if k == 0 && !line.holds() {
                line.offset
            } else {
                0.0
            };
            self.force.of_mut(k)[c] = force;
        }
        if !sloped && k > 0 {
            return;
        }
        let forces = self.force.of(k);
        for pushes in &frame.layout.pushes {
            let count = pushes.responses.len();
            if count == 0 {
                let force = forces[pushes.contact];
                if force != 0.0 {
                    frame.push(pushes.contact, force, &mut self.acceleration);
                }
                continue;
            }
            let pushed = &mut self.acceleration[pushes.mass..][..count];
            let forces = &forces[pushes.contact..][..count];
            for ((a, response), force) in pushed.iter_mut().zip(&pushes.responses).zip(forces) {
                *a = if *force == 0.0 { *a } else { *a + response * force };
            }
        }
    }

    /// Coefficients k of the forces of adhesion, and what they accelerate.
    fn hold(&mut self, frame: &Frame, held: &Held, k: usize) {
        let next = (k + 1) as f64;
        let Acting { drive, lines, .. } = &self.acting;
        let (force, drive) = (self.force.of_mut(k), drive.of(k + 1));
        for &(c, mass, gain) in &lines.alone {
            let own = &mut self.acceleration[mass];
            let held = next * drive[c];
            force[c] = gain * (held - *own);
            *own = held;
        }
        if !lines.alone.is_empty() {
            return;
        }
        for (row, &c) in held.contacts.iter().enumerate() {
            self.wanted[row] = next * drive[c] - frame.across(c, |i| self.acceleration[i]);
        }
        self.gained.copy_from_slice(&self.acceleration);
        for (row, &c) in held.contacts.iter().enumerate() {
            let pull = held.force(row, |at| self.wanted[at]);
            force[c] = pull;
            frame.push(c, pull, &mut self.acceleration);
        }
        for carried in &held.carried {
            let by = carried.by.map_or(0.0, |mass| self.acceleration[mass]);
            self.acceleration[carried.mass] = by + carried.sign * (next * drive[carried.contact]);
        }
        if !held.each_carries {
            return;
        }
        // From accelerations across contacts the force of a light mass beside a heavy one has rounding of its acceleration over
        // the mobility of the heavy one. Newton's law of each mass that is carried has that of the forces on it alone.
        for (a, free) in self.acceleration.iter().zip(&mut self.gained) {
            *free = a - *free;
        }
        for carried in &held.carried {
            let inertia = frame.inertia.row(carried.mass).iter();
            self.load[carried.mass] = inertia.map(|&(i, mass)| mass * self.gained[i]).sum();
        }
        for carried in held.carried.iter().rev() {
            let load = self.load[carried.mass];
            force[carried.contact] = carried.sign * load;
            if let Some(by) = carried.by {
                self.load[by] += load;
            }
        }
    }

    /// Expand from (x, v), after [`Motion::aim`].
    pub(super) fn expand_many(&mut self, field: &VectorField, x: &[f64], v: &[f64]) {
        let kind = self.ready(field, x, v);
        for k in 0..field.frame.order {
            self.accelerate(field, k, kind);
            self.follow(k, INVERSE[k + 1]);
        }
        self.finish(field.frame);
    }

    /// Begin an expansion; whether friction has slopes, and whether adhesion leaves no mass any freedom.
    pub(super) fn ready(&mut self, field: &VectorField, x: &[f64], v: &[f64]) -> (bool, bool) {
        let (frame, force_lines, held) = (field.frame, field.force_lines, field.held);
        self.begin(x, v);
        self.acting.lines.set(frame, force_lines, held);
        let lines = &self.acting.lines;
        let sloped = !lines.others.is_empty() || lines.slope.iter().any(|slope| *slope != 0.0);
        (sloped, held.contacts.len() == frame.masses && !frame.loops)
    }

    /// Coefficients k of the accelerations, from those of x and v.
    pub(super) fn accelerate(&mut self, field: &VectorField, k: usize, (sloped, ridden): (bool, bool)) {
        let (frame, force_lines, held) = (field.frame, field.force_lines, field.held);
        self.free(frame, k);
        self.speeds(frame, k);
        if k == 0 {
            self.slips(frame, force_lines);
        }
        self.friction(field, k, sloped);
        self.hold(frame, held, k);
        let drive = self.acting.drive.of(k + 1);
        if ridden && held.contacts.iter().all(|&c| drive[c] == 0.0) {
            // Every mass keeps its speed, without rounding.
            self.acceleration.fill(0.0);
        }
        if k == 0 {
            for (c, _) in force_lines.iter().enumerate().filter(|(_, line)| line.zero_slope) {
                let slope = drive[c] - frame.across(c, |i| self.acceleration[i]);
                frame.push(c, slope / frame.coupling(c, c), &mut self.acceleration);
            }
        }
    }

    /// The slip speeds at the start, to the rounding of the slip velocity itself.
    fn slips(&mut self, frame: &Frame, force_lines: &[ForceLine]) {
        for (c, line) in force_lines.iter().enumerate() {
            let slip = self.slip(frame, c, self.v.of(0));
            self.u.numbers[c] = line.sign() * slip;
        }
    }

    /// The next coefficients of x and v, from those of v and of the accelerations.
    pub(super) fn follow(&mut self, k: usize, share: f64) {
        for (x, v) in self.x.of_mut(k + 1).iter_mut().zip(self.v.of(k)) {
            *x = v * share;
        }
        for (v, a) in self.v.of_mut(k + 1).iter_mut().zip(&self.acceleration) {
            *v = a * share;
        }
    }

    /// The last coefficients of all that follows from x and v.
    pub(super) fn finish(&mut self, frame: &Frame) {
        let order = frame.order;
        self.speeds(frame, order);
        for at in 0..self.acting.lines.others.len() {
            self.press(frame, self.acting.lines.others[at], order);
        }
        let x = self.x.of(order);
        for (s, spring) in frame.springs.iter().enumerate() {
            let at = spring.other.map_or(0.0, |other| x[other]);
            self.displacement[s][order] = x[spring.mass] - at;
        }
    }

    /// Coefficient k of the normal force of a contact, where that varies.
    fn press(&mut self, frame: &Frame, c: usize, k: usize) {
        let (x, v) = (self.x.of(k), self.v.of(k));
        self.normal[c][k] = self.pressed_along(frame, c, k, |i| x[i], |i| v[i]);
    }
}
