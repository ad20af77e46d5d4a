//! Motion of any number of masses in one combination of modes, as a Taylor series.
//!
//! With y = (x, v) the equation of motion gives the next coefficient of y from those known. For linear pieces of friction
//! y' = A y + waves, so |y_{k+1}| ≤ L |y_k|/(k + 1): with L h ≤ 4 what is left out is less than a quarter of the last term,
//! and the step keeps that term below rounding. For a smooth law the series of its friction grows along; the last two terms
//! give an estimate instead of a bound, so the law itself is compared with its series along the step, at slip speeds so close
//! that no feature of the law hides between two of them, and the step ends where they still agree.

mod coefficients;
mod reach;
mod slow;
pub(crate) mod tangent;

use crate::clock::Clock;
use crate::drive::Drive;
use crate::elementary::add;
use crate::harmonic::add_wave;
use crate::law::{Friction, Law};
use crate::matrix::{Matrix, Rows, filled};
use crate::normal_force::NormalForce;
use crate::series::{Grown, INVERSE, LINEAR_ORDER, ORDER, Series, ZERO};
use crate::spring::Spring;
use crate::system::{Contact, System};
pub(crate) use coefficients::Coefficients;
use coefficients::{Acting, Layout};
use slow::{Heavy, Pace, Slow};
use tangent::Linear;

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
    fn slips(&self) -> bool {
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

/// What stays the same along an orbit.
#[derive(Clone, Debug)]
pub(crate) struct Frame {
    pub(crate) masses: usize,
    /// The highest power of a step that is kept.
    pub(crate) order: usize,
    inverse: Matrix,
    /// M.
    inertia: Rows<f64>,
    /// M⁻¹ K and M⁻¹ D.
    near: Rows<[f64; 2]>,
    /// b_c as (mass, other).
    ends: Vec<(usize, Option<usize>)>,
    /// M⁻¹ b_c.
    response: Rows<f64>,
    /// The contacts that a force of each accelerates, and how much a unit force does.
    moved: Rows<f64>,
    /// How much it accelerates its own contact.
    own: Vec<f64>,
    layout: Layout,
    forcing: Vec<crate::system::Force>,
    pub(crate) drives: Vec<Drive>,
    /// The normal forces that vary.
    pub(crate) normals: Vec<Option<NormalForce>>,
    pub(crate) springs: Vec<Spring>,
    /// Whether the law of a contact is smooth, backward and forward.
    smooth: Vec<[bool; 2]>,
    /// L without friction.
    pub(crate) rate: f64,
    /// The same without damping.
    pub(crate) undamped: f64,
    /// The highest frequency of drives and forces.
    fastest: f64,
    /// The speed that drives and forces can give.
    pub(crate) push: f64,
    /// Whether the contacts can close a loop.
    pub(crate) loops: bool,
    heavy: Option<Heavy>,
}

/// The adhesion of some contacts as a constraint: (b M⁻¹ bᵀ)⁻¹ over them, or the solution of least size where contacts are
/// redundant (a closed loop of stuck contacts leaves the share of each undetermined).
#[derive(Clone, Debug)]
pub(crate) struct Held {
    pub(crate) contacts: Vec<usize>,
    gain: Rows<f64>,
    /// Masses whose acceleration follows from that of what they are held to, in an order in which that is known.
    carried: Vec<Carried>,
    /// Whether each of the contacts carries one.
    each_carries: bool,
    /// What heavy damping makes slow meanwhile.
    slow: Option<Slow>,
}

/// A mass held by a contact to another mass or to a drive: a = a of the other + sign · drive acceleration.
///
/// The sum of the forces on it would give the same but for rounding of these forces over its mass, which for a light mass is
/// a drift against what it is held to.
#[derive(Clone, Copy, Debug)]
struct Carried {
    mass: usize,
    by: Option<usize>,
    contact: usize,
    sign: f64,
}

impl Held {
    /// What a held contact's force owes to what they needed, each by its index among them.
    pub(crate) fn gain(&self, row: usize) -> &[(usize, f64)] {
        self.gain.row(row)
    }

    /// The force of a held contact that makes up for what they needed.
    fn force(&self, row: usize, required: impl Fn(usize) -> f64) -> f64 {
        self.gain(row).iter().map(|&(at, gain)| gain * required(at)).sum()
    }

    /// The forces that make up for what the contacts needed.
    pub(crate) fn forces(&self, required: impl Fn(usize) -> f64) -> Vec<f64> {
        (0..self.contacts.len())
            .map(|row| self.force(row, &required))
            .collect()
    }
}

impl Frame {
    pub(crate) fn of(system: &System) -> Self {
        let inverse = Matrix::from_rows(&system.mass)
            .inverse()
            .expect("a validated mass matrix");
        let spring = inverse.times(&Matrix::from_rows(&system.stiffness));
        let damper = inverse.times(&Matrix::from_rows(&system.damping));
        let ends: Vec<_> = system.contacts.iter().map(|c| (c.mass, c.other)).collect();
        let n = system.masses();
        let near = Rows::new((0..n).map(|i| {
            let both = spring.row(i).iter().zip(damper.row(i));
            let both = both.map(|(spring, damper)| [*spring, *damper]).enumerate();
            both.filter(|(_, both)| *both != [0.0; 2])
        }));
        let response = Rows::new(ends.iter().map(|&(mass, other)| {
            let other = |i| other.map_or(0.0, |j| inverse.at(i, j));
            let row: Vec<f64> = (0..n).map(|i| inverse.at(i, mass) - other(i)).collect();
            filled(&row).collect::<Vec<_>>()
        }));
        let mut on: Vec<Vec<usize>> = vec![Vec::new(); n];
        for (c, &(mass, other)) in ends.iter().enumerate() {
            on[mass].push(c);
            if let Some(other) = other {
                on[other].push(c);
            }
        }
        let coupled = |to: usize, from: usize| {
            let (mass, other) = ends[to];
            let mut coupled = entry(&response, from, mass);
            if let Some(other) = other {
                coupled.add(-1.0, entry(&response, from, other));
            }
            coupled
        };
        let moved = Rows::new((0..ends.len()).map(|c| {
            let masses = response.row(c).iter();
            let mut moved: Vec<usize> = masses.flat_map(|&(mass, _)| &on[mass]).copied().collect();
            moved.sort_unstable();
            moved.dedup();
            moved
                .into_iter()
                .map(move |to| (to, coupled(to, c)))
                .collect::<Vec<_>>()
        }));
        let own = (0..ends.len()).map(|c| coupled(c, c)).collect();
        let drives: Vec<Drive> = system.contacts.iter().map(|c| c.drive_velocity.clone()).collect();
        let normals: Vec<_> = system.contacts.iter().map(|c| c.normal_force.clone()).collect();
        let fastest = drives
            .iter()
            .map(Drive::fastest)
            .chain(system.forcing.iter().map(|force| force.frequency))
            .chain(normals.iter().flatten().map(NormalForce::fastest))
            .fold(0.0, f64::max);
        let stiffer = system.springs.iter().map(|spring| {
            let own = |i: usize| inverse.at(i, i);
            spring.steepest() * (own(spring.mass) + spring.other.map_or(0.0, own)) * 2.0
        });
        let undamped = (spring.norm() + stiffer.sum::<f64>()).sqrt();
        let free = undamped + damper.norm();
        // Contacts as edges between the masses and, the last node, the ground of all drives.
        let mut joined: Vec<usize> = (0..=n).collect();
        let mut loops = false;
        for &(mass, other) in &ends {
            let (one, two) = (joined[mass], joined[other.unwrap_or(n)]);
            loops |= one == two;
            for node in &mut joined {
                if *node == two {
                    *node = one;
                }
            }
        }
        let sides = |contact: &Contact| [-1.0, 1.0].map(|direction| contact.law.toward(direction).smooth());
        let smooth: Vec<_> = system.contacts.iter().map(sides).collect();
        let rate = if free + fastest > 0.0 {
            free.max(fastest)
        } else {
            1.0
        };
        let driven = drives.iter().map(Drive::size).fold(0.0, f64::max);
        let pushed = system.forcing.iter().map(|force| {
            let response = inverse.row(force.mass).iter().map(|value| value.abs());
            force.amplitude.abs() * response.fold(0.0, f64::max) / rate
        });
        let undamped = Some(undamped.max(fastest))
            .filter(|&rate| rate > 0.0)
            .unwrap_or(rate);
        Self {
            masses: n,
            loops,
            rate,
            undamped,
            heavy: Heavy::of(system, damper.norm(), undamped, fastest),
            fastest,
            push: pushed.fold(driven, f64::max),
            layout: Layout::new(&near, &ends, &response),
            inverse,
            inertia: Rows::new(system.mass.iter().map(|row| filled(row))),
            near,
            ends,
            response,
            moved,
            own,
            forcing: system.forcing.clone(),
            drives,
            normals,
            springs: system.springs.clone(),
            order: if smooth.concat().contains(&true) {
                ORDER
            } else {
                LINEAR_ORDER
            },
            smooth,
        }
    }

    /// Whether the law of a contact is smooth in a direction of slip.
    pub(crate) fn is_smooth(&self, contact: usize, direction: f64) -> bool {
        self.smooth[contact][usize::from(direction >= 0.0)]
    }

    /// The mass of a contact.
    pub(crate) fn mass_of(&self, contact: usize) -> usize {
        self.ends[contact].0
    }

    /// Whether a contact is with a drive, not with another mass.
    pub(crate) fn driven(&self, contact: usize) -> bool {
        self.ends[contact].1.is_none()
    }

    /// b_c · a for any vector over the masses.
    pub(crate) fn across<T: Linear>(&self, contact: usize, a: impl Fn(usize) -> T) -> T {
        let (mass, other) = self.ends[contact];
        let mut across = a(mass);
        if let Some(other) = other {
            across.add(-1.0, a(other));
        }
        across
    }

    /// The speed that the springs can give mass `i` while the motion changes. Under heavy damping that is far less than the
    /// position times the fastest rate.
    pub(crate) fn sprung(&self, i: usize, x: &[f64]) -> f64 {
        let loads = self.near.row(i).iter();
        loads.map(|&(j, [spring, _])| (spring * x[j]).abs()).sum::<f64>() / self.rate
    }

    /// How much a unit force of `from` accelerates `to`: b_to M⁻¹ b_from.
    pub(crate) fn coupling(&self, to: usize, from: usize) -> f64 {
        if to == from {
            self.own[to]
        } else {
            entry(&self.moved, from, to)
        }
    }

    /// What a unit force of a contact accelerates a mass by.
    pub(crate) fn response(&self, contact: usize, mass: usize) -> f64 {
        entry(&self.response, contact, mass)
    }

    /// Take out of `required` what a force of a contact does about what every contact required.
    pub(crate) fn relieve(&self, required: &mut [f64], contact: usize, force: f64) {
        for &(to, coupling) in self.moved.row(contact) {
            required[to] -= coupling * force;
        }
    }

    /// Add what a force of a contact accelerates.
    pub(crate) fn push<T: Linear>(&self, contact: usize, force: T, acceleration: &mut [T]) {
        for &(i, response) in self.response.row(contact) {
            acceleration[i].add(response, force);
        }
    }

    pub(crate) fn held(&self, contacts: Vec<usize>) -> Held {
        let m = contacts.len();
        let mut index = vec![None; self.ends.len()];
        for (i, &c) in contacts.iter().enumerate() {
            index[c] = Some(i);
        }
        // Which of them a force of each accelerates: as a rule itself alone.
        let moves = |i: usize| {
            let moved = self.moved.row(contacts[i]).iter();
            moved.filter_map(|&(to, coupling)| Some((index[to]?, coupling)))
        };
        let gain = if m == 1 {
            Rows::of_diagonal(std::iter::once(1.0 / self.own[contacts[0]]))
        } else if m > 1 && (0..m).all(|i| moves(i).all(|(to, _)| to == i)) {
            Rows::of_diagonal(contacts.iter().map(|&c| {
                // With the rounding of Cholesky's way.
                let lower = self.own[c].sqrt();
                (1.0 / lower) / lower
            }))
        } else {
            let mut block = Matrix::zero(m);
            for j in 0..m {
                for (i, coupling) in moves(j) {
                    block.set(i, j, coupling);
                }
            }
            let dense = block.pseudo_inverse();
            Rows::new((0..m).map(|i| filled(dense.row(i))))
        };
        let carried = self.carried(&contacts);
        Held {
            each_carries: carried.len() == contacts.len(),
            contacts,
            gain,
            carried,
            slow: None,
        }
    }

    /// Which masses some contacts carry: from the drives on, and where there is none from the heaviest mass on.
    fn carried(&self, contacts: &[usize]) -> Vec<Carried> {
        let mut known = vec![false; self.masses];
        let mut carried = Vec::with_capacity(contacts.len());
        let mut left = contacts.to_vec();
        loop {
            let before = left.len();
            left.retain(|&contact| {
                let (mass, other) = self.ends[contact];
                match (known[mass], other.is_none_or(|other| known[other])) {
                    (false, true) => {
                        known[mass] = true;
                        carried.push(Carried {
                            mass,
                            by: other,
                            contact,
                            sign: 1.0,
                        });
                        false
                    }
                    (true, false) => {
                        if let Some(other) = other {
                            known[other] = true;
                            carried.push(Carried {
                                mass: other,
                                by: Some(mass),
                                contact,
                                sign: -1.0,
                            });
                        }
                        false
                    }
                    // Others hold what it would, or nothing is known of either mass yet.
                    (both, _) => !both,
                }
            });
            if left.len() < before {
                continue;
            }
            let masses = left.iter().flat_map(|&contact| {
                let (mass, other) = self.ends[contact];
                std::iter::once(mass).chain(other)
            });
            let light = |&mass: &usize| self.inverse.at(mass, mass);
            match masses.min_by(|one, other| light(one).total_cmp(&light(other))) {
                Some(heaviest) => known[heaviest] = true,
                None => return carried,
            }
        }
    }

    /// The same for the motion of a whole phase, which heavy damping makes slow.
    pub(crate) fn held_along(&self, contacts: Vec<usize>) -> Held {
        let slow = self.heavy.as_ref().map(|heavy| heavy.slow(&self.ends, &contacts));
        Held {
            slow,
            ..self.held(contacts)
        }
    }

    /// b_c as a sum of those of other contacts, where it is one: its share of each.
    pub(crate) fn share(&self, others: &[usize], c: usize) -> Option<Vec<f64>> {
        if others.is_empty() {
            return None;
        }
        let share = self.held(others.to_vec()).forces(|i| self.coupling(others[i], c));
        let given: f64 = others
            .iter()
            .zip(&share)
            .map(|(&other, share)| share * self.coupling(c, other))
            .sum();
        // What of its own response to a force is left once the others hold.
        let own = self.coupling(c, c);
        (own - given <= 1e-9 * own).then_some(share)
    }
}

/// An entry of a sparse matrix.
fn entry(rows: &Rows<f64>, i: usize, j: usize) -> f64 {
    let row = rows.row(i);
    let index = row.binary_search_by_key(&j, |&(column, _)| column);
    index.map_or(0.0, |index| row[index].1)
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
        let (smooth, law) = (frame.is_smooth(0, direction), law.toward(direction));
        let grown = &mut self.grown[0];
        let pull = response * direction;
        for k in 0..order {
            u[k] = direction * if k == 0 { slip } else { drive[k] - v[k] };
            let size = if smooth {
                law.extend(u, k, grown)
            } else {
                slope * u[k] + if k == 0 { offset } else { 0.0 }
            };
            force[k] = direction * size;
            let a = if zero_slope && k == 0 {
                drive[1]
            } else {
                input[k] - spring * x[k] - damper * v[k] + pull * size
            };
            x[k + 1] = v[k] * INVERSE[k + 1];
            v[k + 1] = a * INVERSE[k + 1];
        }
        u[order] = direction * (drive[order] - v[order]);
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
