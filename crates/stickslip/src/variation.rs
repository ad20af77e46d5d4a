//! The derivative of a motion through its events: fundamental matrices of the segments and jumps at the events at once.
//!
//! A *trail* is a motion with its event sequence held fixed: arc after arc, each ended by the event that ended it in the
//! motion it was taken from. The state carries everything that what follows depends on, the time, the line of friction and
//! the memory of the contact included, and every number in it is a [`Dual`]: the derivative with respect to the start and to
//! one parameter comes along. At an event the time moves with the state by −h′/ḣ, which is the saltation matrix
//! S = D_xR + (F⁺ − D_xR F⁻ − D_tR) nᵀ/(nᵀF⁻ + h_t) in the augmented state (Aizerman & Gantmakher 1958; Müller, Chaos
//! Solitons Fractals 5 (1995) 1671), sensitivities of memory included.
//!
//! Segments of linear friction are differentiated in closed form, smooth laws by extrapolation (Gragg 1965; Bulirsch & Stoer
//! 1966) of the variational equation. Only a law's own algebra (break-away force, next line) is differenced, to the fourth order.
//!
//! Held to its sequence, a motion goes on smoothly where the real one would change it. What vanishes there are the *borders*,
//! the test functions of the sliding bifurcations, and they carry their derivatives too.

use serde_json::Value;

use crate::dual::Dual;
use crate::error::Error;
use crate::law::{End, Friction, Hold, Law, Memory, Piece};
use crate::series::{Grown, ZERO};
use crate::structure::Oscillator;

/// What a state is made of: t, x, v, the line of friction, the memory, when it stuck.
pub const WIDTH: usize = 13;
/// Those and one parameter: the directions of differentiation.
pub const LANES: usize = WIDTH + 1;
/// Where in the state the line of friction (the memory follows it) and the begin of adhesion stand.
const LINE: usize = 3;
const SINCE: usize = 12;

/// What a contact does along an arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Phase {
    /// It sticks.
    Stick,
    /// It slips in a direction.
    Slip(f64),
    /// It slips in a direction at a speed held between two branches.
    Hold(f64),
}

/// What ends an arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ending {
    /// Adhesion breaks.
    Release,
    /// The line of friction ends, or friction leaves the hold over that end.
    Line(End),
    /// A turn of the slip speed of which the law is told nothing: a section.
    Section,
    /// A given time.
    Time,
}

/// One arc of a trail.
#[derive(Clone, Copy, Debug)]
pub struct Arc {
    /// What the contact does.
    pub phase: Phase,
    /// What ends it.
    pub ending: Ending,
    /// How long it took where it was taken from.
    pub duration: f64,
}

/// The state at the start of an arc.
#[derive(Clone, Copy, Debug)]
pub struct State<const N: usize> {
    /// t, x, v; offset, slope, low and high end of the line; anchor, corner, last break-away force; when it stuck.
    pub numbers: [Dual<N>; WIDTH],
    /// Branch of the law.
    pub branch: u32,
    /// Whether the law wants to know of turns.
    pub turns: bool,
    /// Whether the anchor was set by a break-away.
    pub released: bool,
}

/// The test functions whose zeros are borders of an event sequence; positive inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Border {
    /// Least slip speed of an arc above the low end of its line.
    Low,
    /// Greatest slip speed of an arc below the high end.
    High,
    /// What adhesion bears beyond the force where an arc ends in adhesion.
    Entry,
    /// The force beyond what adhesion bears where the slip velocity crosses zero.
    Crossing,
    /// The least that adhesion bears beyond the force during a stick.
    Stick,
    /// How fast the slip speed falls where it reaches zero.
    Arrival,
}

/// A test function along a trail.
#[derive(Clone, Copy, Debug)]
pub struct Test {
    /// Which.
    pub border: Border,
    /// On which arc.
    pub arc: usize,
    /// When, counted from the start of the arc.
    pub tau: f64,
    /// Its value and derivatives.
    pub value: Dual<LANES>,
    /// What tells borders apart: for `Low` and `High` the speed at the end of the line; for `Entry` and `Crossing` the rate
    /// at which the size of the force that would hold the mass grows.
    pub detail: f64,
}

/// A trail followed: states at the ends of the arcs, durations, test functions.
#[derive(Clone, Debug, Default)]
pub struct Followed {
    /// The state after each arc.
    pub states: Vec<State<LANES>>,
    /// How long each arc took.
    pub durations: Vec<f64>,
    /// The test functions.
    pub tests: Vec<Test>,
}

/// An oscillator that varies with one number of its document.
#[derive(Clone, Debug)]
pub struct Varied {
    /// The oscillator.
    pub base: Oscillator,
    /// The same two steps and one step down, one and two steps up, and the size of a step.
    around: Option<([Oscillator; 4], f64)>,
}

/// A fourth-order difference: the value two steps and one step down, one and two steps up.
fn difference(around: [f64; 4], step: f64) -> f64 {
    let [two_down, down, up, two_up] = around;
    (8.0 * (up - down) - (two_up - two_down)) / (12.0 * step)
}

const STEPS: [f64; 4] = [-2.0, -1.0, 1.0, 2.0];
/// A step relative to the number: its fourth power and rounding over it are both below 10⁻¹².
const RELATIVE_STEP: f64 = 1e-3;
/// One for the algebra of lines, which has corners: rounding over it is 10⁻¹⁰.
const LINE_STEP: f64 = 1e-6;

fn step_of(value: f64, relative: f64) -> f64 {
    if value == 0.0 {
        1e-6
    } else {
        relative * value.abs()
    }
}

impl Varied {
    /// Of a document; `path` names the number that varies, such as `/law/kinetic`.
    ///
    /// # Errors
    /// What is wrong with the document or the path.
    pub fn new(document: &str, path: Option<&str>) -> Result<Self, Error> {
        let base = Oscillator::from_json(document)?;
        let Some(path) = path else {
            return Ok(Self { base, around: None });
        };
        let refused = |reason: String| Error::Document { reason };
        let mut table: Value = serde_json::from_str(document).map_err(|error| refused(error.to_string()))?;
        let number = table.pointer(path).and_then(Value::as_f64);
        let value = number.ok_or_else(|| refused(format!("the system document has no number {path:?}")))?;
        let step = step_of(value, RELATIVE_STEP);
        let mut beside = |steps: f64| {
            if let Some(place) = table.pointer_mut(path) {
                *place = (value + steps * step).into();
            }
            serde_json::from_value::<Oscillator>(table.clone()).map_err(|error| refused(error.to_string()))
        };
        let around = [
            beside(STEPS[0])?,
            beside(STEPS[1])?,
            beside(STEPS[2])?,
            beside(STEPS[3])?,
        ];
        Ok(Self {
            base,
            around: Some((around, step)),
        })
    }

    /// A number of the oscillator and its derivative with respect to the parameter, in the last lane.
    fn number<const N: usize>(&self, of: impl Fn(&Oscillator) -> f64) -> Dual<N> {
        let mut number = Dual::fixed(of(&self.base));
        if let (Some((around, step)), LANES) = (&self.around, N) {
            number.rates[N - 1] = difference(std::array::from_fn(|i| of(&around[i])), *step);
        }
        number
    }

    /// What the law answers to numbers, with the derivatives of its answers.
    fn ask<const N: usize, const I: usize, const O: usize>(
        &self,
        inputs: [Dual<N>; I],
        relative: f64,
        answer: impl Fn(&Law, [f64; I]) -> [f64; O],
    ) -> [Dual<N>; O] {
        let values = inputs.map(|input| input.value);
        let mut outputs = answer(&self.base.law, values).map(Dual::fixed);
        let spread = |outputs: &mut [Dual<N>; O], around: [[f64; O]; 4], step: f64, rates: &[f64; N]| {
            for (o, output) in outputs.iter_mut().enumerate() {
                if output.value.is_finite() {
                    let slope = difference(around.map(|answers| answers[o]), step);
                    for (rate, along) in output.rates.iter_mut().zip(rates) {
                        *rate += slope * along;
                    }
                }
            }
        };
        for (i, input) in inputs.iter().enumerate() {
            if input.value.is_finite() && input.rates.iter().any(|rate| *rate != 0.0) {
                let step = step_of(input.value, relative);
                let around = STEPS.map(|steps| {
                    let mut beside = values;
                    beside[i] += steps * step;
                    answer(&self.base.law, beside)
                });
                spread(&mut outputs, around, step, &input.rates);
            }
        }
        if let (Some((around, step)), LANES) = (&self.around, N) {
            let around = std::array::from_fn(|i| answer(&around[i].law, values));
            let mut along = [0.0; N];
            along[N - 1] = 1.0;
            spread(&mut outputs, around, *step, &along);
        }
        outputs
    }

    /// Friction of a smooth law at slip speed `u`.
    fn smooth_force<const N: usize>(&self, u: Dual<N>) -> Dual<N> {
        let at = |law: &Law| {
            let mut series = ZERO;
            (series[0], series[1]) = (u.value, 1.0);
            let mut grown = Grown::default();
            [
                law.extend(&series, 0, &mut grown),
                law.extend(&series, 1, &mut grown),
            ]
        };
        let [value, slope] = at(&self.base.law);
        let mut force = u.chain(value, slope);
        if let (Some((around, step)), LANES) = (&self.around, N) {
            force.rates[N - 1] += difference(std::array::from_fn(|i| at(&around[i].law)[0]), *step);
        }
        force
    }
}

/// The numbers of the oscillator with their derivatives.
struct Frame<'a, const N: usize> {
    varied: &'a Varied,
    mass: Dual<N>,
    damping: Dual<N>,
    stiffness: Dual<N>,
    drive: Dual<N>,
    forcing: Vec<[Dual<N>; 3]>,
    smooth: bool,
    /// The fastest rate at which anything moves.
    rate: f64,
}

/// Position, velocity and acceleration.
type Motion<const N: usize> = [Dual<N>; 3];

impl<'a, const N: usize> Frame<'a, N> {
    fn new(varied: &'a Varied) -> Self {
        let base = &varied.base;
        let harmonics = 0..base.forcing.len();
        let natural = (base.stiffness / base.mass).sqrt();
        Self {
            mass: varied.number(|o| o.mass),
            damping: varied.number(|o| o.damping),
            stiffness: varied.number(|o| o.stiffness),
            drive: varied.number(|o| o.drive_velocity),
            forcing: harmonics
                .map(|j| {
                    [
                        varied.number(|o| o.forcing[j].amplitude),
                        varied.number(|o| o.forcing[j].frequency),
                        varied.number(|o| o.forcing[j].phase),
                    ]
                })
                .collect(),
            smooth: base.law.smooth(),
            rate: base.forcing.iter().map(|f| f.frequency).fold(natural, f64::max),
            varied,
        }
    }

    /// The forcing and its rate at `t`.
    fn force(&self, t: Dual<N>) -> (Dual<N>, Dual<N>) {
        let (mut force, mut rate) = (Dual::fixed(0.0), Dual::fixed(0.0));
        for [amplitude, frequency, phase] in &self.forcing {
            let (sin, cos) = (*frequency * t + *phase).sin_cos();
            force = force + *amplitude * cos;
            rate = rate - *amplitude * *frequency * sin;
        }
        (force, rate)
    }

    /// The friction that holds the mass at the velocity `v`, and its rate.
    fn holding(&self, t: Dual<N>, x: Dual<N>, v: Dual<N>) -> (Dual<N>, Dual<N>) {
        let (force, rate) = self.force(t);
        (
            self.damping * v + self.stiffness * x - force,
            self.stiffness * v - rate,
        )
    }

    /// The slip speed.
    fn speed(&self, direction: f64, v: Dual<N>) -> Dual<N> {
        (self.drive - v) * direction
    }

    fn acceleration(&self, state: &State<N>, direction: f64, t: Dual<N>, [x, v]: [Dual<N>; 2]) -> Dual<N> {
        let u = self.speed(direction, v);
        let friction = if self.smooth {
            self.varied.smooth_force(u)
        } else {
            state.numbers[LINE] + state.numbers[LINE + 1] * u
        };
        (friction * direction + self.force(t).0 - self.damping * v - self.stiffness * x) / self.mass
    }

    /// The motion at `tau` from the start of the arc.
    fn motion(&self, state: &State<N>, phase: Phase, tau: Dual<N>) -> Motion<N> {
        let [t, x, v] = [state.numbers[0], state.numbers[1], state.numbers[2]];
        let (x, v, direction) = match phase {
            Phase::Stick => return [x + self.drive * tau, self.drive, Dual::fixed(0.0)],
            Phase::Hold(_) => return [x + v * tau, v, Dual::fixed(0.0)],
            Phase::Slip(direction) if self.smooth => {
                let [x, v] = self.extrapolated(state, direction, tau.value);
                let a = self.acceleration(state, direction, t + Dual::fixed(tau.value), [x, v]);
                (x.shifted(v.value, &tau), v.shifted(a.value, &tau), direction)
            }
            Phase::Slip(direction) => {
                let [x, v] = self.closed(state, direction, tau);
                (x, v, direction)
            }
        };
        [x, v, self.acceleration(state, direction, t + tau, [x, v])]
    }

    /// The closed form along a line of friction.
    fn closed(&self, state: &State<N>, direction: f64, tau: Dual<N>) -> [Dual<N>; 2] {
        let [t, x, v] = [state.numbers[0], state.numbers[1], state.numbers[2]];
        let [offset, slope] = [state.numbers[LINE], state.numbers[LINE + 1]];
        let damping = self.damping + slope;
        let gamma = damping / self.mass * 0.5;
        let kappa = gamma * gamma - self.stiffness / self.mass;
        let (c, s) = basis(kappa, tau);
        let decay = (-(gamma * tau)).exp();
        let rest = (offset * direction + slope * self.drive) / self.stiffness;
        let (mut a, mut b) = (x - rest, v);
        let (mut forced, mut forced_rate) = (rest, Dual::fixed(0.0));
        for [amplitude, frequency, phase] in &self.forcing {
            let real = self.stiffness - self.mass * *frequency * *frequency;
            let imaginary = damping * *frequency;
            let share = *amplitude / (real * real + imaginary * imaginary);
            let wave = |t: Dual<N>| {
                let (sin, cos) = (*frequency * t + *phase).sin_cos();
                (
                    share * (real * cos + imaginary * sin),
                    share * *frequency * (imaginary * cos - real * sin),
                )
            };
            let (before, after) = (wave(t), wave(t + tau));
            (a, b) = (a - before.0, b - before.1);
            (forced, forced_rate) = (forced + after.0, forced_rate + after.1);
        }
        b = b + gamma * a;
        [
            forced + decay * (a * c + b * s),
            forced_rate + decay * ((b - gamma * a) * c + (kappa * a - gamma * b) * s),
        ]
    }

    /// Extrapolation of the midpoint rule under a smooth law.
    fn extrapolated(&self, state: &State<N>, direction: f64, tau: f64) -> [Dual<N>; 2] {
        const COLUMNS: usize = 12;
        let t0 = state.numbers[0];
        let mut y = [state.numbers[1], state.numbers[2]];
        let (mut at, mut big) = (0.0, 0.5_f64.copysign(tau) / self.rate);
        let floor = 1e-3 * big.abs();
        let slope = |t: f64, [x, v]: [Dual<N>; 2]| {
            [
                v,
                self.acceleration(state, direction, t0 + Dual::fixed(t), [x, v]),
            ]
        };
        while at != tau {
            let last = (tau - at).abs() <= big.abs() * (1.0 + 1e-12);
            let step = if last { tau - at } else { big };
            let start = slope(at, y);
            let mut table: Vec<[Dual<N>; 2]> = Vec::with_capacity(COLUMNS);
            let mut error = f64::INFINITY;
            for column in 0..COLUMNS {
                let count = 2 * (column + 1);
                let h = step / count as f64;
                let advance = |from: [Dual<N>; 2], rate: [Dual<N>; 2], h: f64| {
                    [from[0] + rate[0] * h, from[1] + rate[1] * h]
                };
                let (mut before, mut now) = (y, advance(y, start, h));
                for n in 1..count {
                    (before, now) = (now, advance(before, slope(at + n as f64 * h, now), 2.0 * h));
                }
                let end = advance(before, slope(at + step, now), h);
                let raw: [Dual<N>; 2] = std::array::from_fn(|i| (now[i] + end[i]) * 0.5);
                let mut entry = raw;
                for k in (0..column).rev() {
                    let ratio = count as f64 / (2 * (k + 1)) as f64;
                    let weight = 1.0 / (ratio * ratio - 1.0);
                    let next: [Dual<N>; 2] =
                        std::array::from_fn(|i| entry[i] + (entry[i] - table[k][i]) * weight);
                    error = far(&next, &table[k]);
                    table[k] = next;
                    entry = next;
                }
                table.push(raw);
                if error <= 1e-14 {
                    break;
                }
            }
            // Rounding may keep it from the last digit; a step too long keeps it from the twelfth.
            if error > 1e-12 && step.abs() > floor {
                big = 0.5 * step;
                continue;
            }
            let end = table[0];
            y = end;
            at = if last { tau } else { at + step };
        }
        y
    }

    /// What vanishes where the arc ends, given the motion there.
    fn guard(&self, state: &State<N>, arc: &Arc, tau: Dual<N>) -> Dual<N> {
        let t = state.numbers[0] + tau;
        let [x, v, a] = self.motion(state, arc.phase, tau);
        match (arc.phase, arc.ending) {
            (_, Ending::Time) => tau - Dual::fixed(arc.duration),
            (Phase::Stick, _) => self.margin(state, t, x),
            (Phase::Hold(direction), ending) => {
                let rising = usize::from(ending == Ending::Line(End::High));
                let u = self.speed(direction, state.numbers[2]);
                let [between] = self.varied.ask([u], LINE_STEP, |law, [u]| {
                    [law.branches(u).map_or(f64::NAN, |pair| pair[rising])]
                });
                self.holding(t, x, v).0 * direction - between
            }
            (Phase::Slip(direction), Ending::Line(End::Low)) => {
                self.speed(direction, v) - state.numbers[LINE + 2]
            }
            (Phase::Slip(direction), Ending::Line(End::High)) => {
                self.speed(direction, v) - state.numbers[LINE + 3]
            }
            (Phase::Slip(_), _) => a,
        }
    }

    /// What adhesion bears beyond the force that holds the mass.
    fn margin(&self, state: &State<N>, t: Dual<N>, x: Dual<N>) -> Dual<N> {
        let (force, rate) = self.holding(t, x, self.drive);
        self.bears(t - state.numbers[SINCE], rate) - force.abs()
    }

    fn bears(&self, stick_time: Dual<N>, rate: Dual<N>) -> Dual<N> {
        let [bears] = self.varied.ask(
            [stick_time, rate.abs()],
            RELATIVE_STEP,
            |law, [stick_time, force_rate]| {
                [law.break_away(Hold {
                    stick_time: stick_time.max(0.0),
                    force_rate: force_rate.abs(),
                })]
            },
        );
        bears
    }

    /// The law names the line of friction that comes next.
    fn turn_to(
        &self,
        state: &mut State<N>,
        u: Dual<N>,
        next: impl Fn(&Law, &Piece, f64, &mut Memory) -> Piece,
    ) {
        // What adhesion would feel now; the law reads it where a slip turns or starts.
        let rate = self
            .holding(state.numbers[0], state.numbers[1], self.drive)
            .1
            .abs();
        let mut inputs = [u; 11];
        inputs[10] = rate;
        inputs[..9].copy_from_slice(&state.numbers[LINE..SINCE]);
        let (branch, turns, released) = (state.branch, state.turns, state.released);
        let answer = |law: &Law, z: [f64; 11]| {
            let mut memory = Memory {
                anchor: [z[4], z[5]],
                corner: [z[6], z[7]],
                released_at: released.then_some(z[8]),
                force_rate: z[10],
            };
            let piece = Piece {
                offset: z[0],
                slope: z[1],
                low: z[2],
                high: z[3],
                branch,
                turns,
            };
            (next(law, &piece, z[9], &mut memory), memory)
        };
        let (piece, memory) = answer(&self.varied.base.law, inputs.map(|input| input.value));
        let numbers = self.varied.ask(inputs, LINE_STEP, |law, z| {
            let (piece, memory) = answer(law, z);
            [
                piece.offset,
                piece.slope,
                piece.low,
                piece.high,
                memory.anchor[0],
                memory.anchor[1],
                memory.corner[0],
                memory.corner[1],
                memory.released_at.unwrap_or(0.0),
            ]
        });
        state.numbers[LINE..SINCE].copy_from_slice(&numbers);
        (state.branch, state.turns) = (piece.branch, piece.turns);
        state.released = memory.released_at.is_some();
    }

    /// The state after `arc`, whose end `tau` is known; `next` is what follows.
    fn pass(&self, state: &State<N>, arc: &Arc, tau: Dual<N>, next: Phase) -> State<N> {
        let mut after = *state;
        let [x, v, _] = self.motion(state, arc.phase, tau);
        let t = state.numbers[0] + tau;
        (after.numbers[0], after.numbers[1], after.numbers[2]) = (t, x, v);
        let Ending::Line(end) = arc.ending else {
            if arc.ending == Ending::Release {
                after.numbers[2] = self.drive;
                let (_, rate) = self.holding(t, x, self.drive);
                let force = self.bears(t - state.numbers[SINCE], rate);
                self.turn_to(&mut after, force, |law, _, force, memory| {
                    law.leave(force, memory)
                });
            }
            return after;
        };
        let (Phase::Slip(direction) | Phase::Hold(direction)) = arc.phase else {
            return after;
        };
        if let Phase::Hold(_) = arc.phase {
            let balance = if end == End::High {
                f64::INFINITY
            } else {
                f64::NEG_INFINITY
            };
            let u = self.speed(direction, v);
            self.turn_to(&mut after, u, |law, _, u, memory| law.begin(u, balance, memory));
            return after;
        }
        let u = match end {
            End::Low => state.numbers[LINE + 2],
            End::High => state.numbers[LINE + 3],
            End::Turn { .. } => self.speed(direction, v),
        };
        if !matches!(end, End::Turn { .. }) {
            after.numbers[2] = self.drive - u * direction;
        }
        match next {
            Phase::Stick => after.numbers[SINCE] = t,
            _ if end == End::Low && u.value <= 0.0 => {
                let (_, rate) = self.holding(t, x, self.drive);
                let force = self.bears(Dual::fixed(0.0), rate);
                self.turn_to(&mut after, force, |law, _, force, memory| {
                    law.leave(force, memory)
                });
            }
            Phase::Slip(_) => self.turn_to(&mut after, u, |law, piece, u, memory| {
                law.next(piece, end, u, memory)
            }),
            Phase::Hold(_) => {}
        }
        after
    }
}

/// How far apart two states are, derivatives included, relative to each.
fn far<const N: usize>(one: &[Dual<N>; 2], other: &[Dual<N>; 2]) -> f64 {
    let size = one[0].value.abs() + one[1].value.abs();
    let mut most = 0.0_f64;
    for (a, b) in one.iter().zip(other) {
        most = most.max((a.value - b.value).abs() / size.max(f64::MIN_POSITIVE));
        for (a, b) in a.rates.iter().zip(b.rates) {
            most = most.max((a - b).abs() / (1.0 + a.abs()));
        }
    }
    most
}

/// C and S of e^{−γτ}(a C + b S): cos ωτ and sin ωτ / ω, or what they become where ω² = −κ is not positive.
fn basis<const N: usize>(kappa: Dual<N>, tau: Dual<N>) -> (Dual<N>, Dual<N>) {
    let z = kappa * tau * tau;
    if z.value.abs() < 0.3 {
        // Σ zⁿ/(2n)! and Σ zⁿ/(2n+1)!: no root to differentiate at zero.
        let (mut c, mut s) = (Dual::fixed(0.0), Dual::fixed(0.0));
        for n in (0..10_u32).rev() {
            let k = f64::from(2 * n);
            c = Dual::fixed(1.0) + c * z * (1.0 / ((k + 1.0) * (k + 2.0)));
            s = Dual::fixed(1.0) + s * z * (1.0 / ((k + 2.0) * (k + 3.0)));
        }
        return (c, s * tau);
    }
    if kappa.value < 0.0 {
        let omega = (-kappa).sqrt();
        let (sin, cos) = (omega * tau).sin_cos();
        (cos, sin / omega)
    } else {
        let omega = kappa.sqrt();
        let (up, down) = ((omega * tau).exp(), (-(omega * tau)).exp());
        ((up + down) * 0.5, (up - down) * 0.5 / omega)
    }
}

impl<const N: usize> State<N> {
    /// The same state, every derivative forgotten and those in the given directions begun.
    fn as_seeds<const M: usize>(&self) -> State<M> {
        let mut numbers = self.numbers.map(|number| Dual::fixed(number.value));
        for (lane, number) in numbers.iter_mut().enumerate() {
            if M > WIDTH && number.value.is_finite() {
                *number = Dual::along(number.value, lane);
            }
        }
        State {
            numbers,
            branch: self.branch,
            turns: self.turns,
            released: self.released,
        }
    }
}

/// How a start is found.
#[must_use]
pub fn state_of(values: &[f64; WIDTH], branch: u32, turns: bool, released: bool) -> State<LANES> {
    let plain = State::<0> {
        numbers: values.map(Dual::fixed),
        branch,
        turns,
        released,
    };
    plain.as_seeds()
}

fn lost(index: usize, why: &str) -> Error {
    Error::Document {
        reason: format!("the motion held to its event sequence {why} on arc {index}"),
    }
}

/// Follow a trail from `start`; `last` is what the contact does after it. With `reseed` the derivatives begin anew with each arc.
///
/// # Errors
/// The arc whose end is not found near where it was.
pub fn follow(
    varied: &Varied,
    start: &State<LANES>,
    arcs: &[Arc],
    last: Phase,
    reseed: bool,
    tests: bool,
) -> Result<Followed, Error> {
    let frame = Frame::<LANES>::new(varied);
    let timed = Frame::<1>::new(varied);
    let mut followed = Followed::default();
    let mut state = *start;
    for (index, arc) in arcs.iter().enumerate() {
        let next = arcs.get(index + 1).map_or(last, |arc| arc.phase);
        if reseed && index > 0 {
            state = state.as_seeds();
        }
        let (tau, rate) =
            end_of(&timed, &state.as_seeds(), arc).ok_or_else(|| lost(index, "does not end"))?;
        let guard = frame.guard(&state, arc, Dual::fixed(tau));
        let mut moved = guard.chain(tau, -1.0 / rate);
        if arc.ending == Ending::Time {
            // The end is a time on the clock: an arc that starts later takes less.
            moved = state.numbers[0].chain(tau, -1.0);
        }
        let after = frame.pass(&state, arc, moved, next);
        if after.numbers[..LINE]
            .iter()
            .any(|number| !number.value.is_finite())
        {
            return Err(lost(index, "leaves the numbers"));
        }
        if tests {
            frame.borders(&state, arc, index, tau, &mut followed.tests);
            frame.entry(&state, &after, arc, index, moved, next, &mut followed.tests);
        }
        followed.durations.push(tau);
        followed.states.push(after);
        state = after;
    }
    Ok(followed)
}

/// When the arc ends, near where it did, and how fast its guard changes there: Newton.
fn end_of(frame: &Frame<1>, state: &State<1>, arc: &Arc) -> Option<(f64, f64)> {
    let mut tau = arc.duration;
    if arc.ending == Ending::Time {
        return Some((tau, 1.0));
    }
    let longest = 0.3 / frame.rate;
    let mut best = f64::INFINITY;
    let mut first = None;
    for round in 0..60 {
        let guard = frame.guard(state, arc, Dual::along(tau, 0));
        let (value, rate) = (guard.value, guard.rates[0]);
        if !(value.is_finite() && rate.is_finite()) || rate == 0.0 {
            return (value == 0.0).then_some((tau, rate));
        }
        let step = -value / rate;
        // Beside a tangency Newton may run away from an end that was known from the start.
        let known = *first.get_or_insert((step, rate));
        if round > 0 && known.0.abs() < 1e-9 / frame.rate && (tau - arc.duration).abs() > 1e-6 / frame.rate {
            return Some((arc.duration, known.1));
        }
        // Rounding ends the descent.
        if step == 0.0 || (round > 3 && step.abs() >= 0.5 * best && step.abs() < 1e-9 / frame.rate) {
            return Some((tau, rate));
        }
        best = best.min(step.abs());
        tau += step.clamp(-longest, longest);
        if step.abs() <= 1e-16 * tau.abs() {
            return Some((tau, rate));
        }
    }
    None
}

impl Frame<'_, LANES> {
    /// The test functions inside an arc.
    fn borders(&self, state: &State<LANES>, arc: &Arc, index: usize, end: f64, tests: &mut Vec<Test>) {
        let timed = Frame::<1>::new(self.varied);
        let plain: State<1> = state.as_seeds();
        // What has an extremum where its rate vanishes.
        let watched = |tau: f64| match arc.phase {
            Phase::Slip(direction) => -direction * timed.motion(&plain, arc.phase, Dual::fixed(tau))[2].value,
            Phase::Stick => {
                let tau = Dual::along(tau, 0);
                let [x, ..] = timed.motion(&plain, arc.phase, tau);
                timed.margin(&plain, plain.numbers[0] + tau, x).rates[0]
            }
            Phase::Hold(_) => 1.0,
        };
        if end <= 0.0 {
            return;
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a few hundred"
        )]
        let count = (end * timed.rate / 0.1).ceil().clamp(8.0, 1e5) as usize;
        let at = |i: usize| end * i as f64 / count as f64;
        let mut before = watched(at(1) * 0.5);
        let mut low = at(1) * 0.5;
        for i in 1..=count {
            let high = if i == count { end * (1.0 - 1e-9) } else { at(i) };
            let after = watched(high);
            if before * after < 0.0 {
                let rising = after > 0.0;
                let tau = root(&watched, (low, before), (high, after));
                self.extremum(state, arc, index, tau, rising, tests);
            }
            (low, before) = (high, after);
        }
    }

    fn extremum(
        &self,
        state: &State<LANES>,
        arc: &Arc,
        index: usize,
        tau: f64,
        least: bool,
        tests: &mut Vec<Test>,
    ) {
        let [x, v, _] = self.motion(state, arc.phase, Dual::fixed(tau));
        match arc.phase {
            Phase::Slip(direction) => {
                both_ends(state, (index, tau), self.speed(direction, v), least, tests);
            }
            _ if least => tests.push(Test {
                border: Border::Stick,
                arc: index,
                tau,
                value: self.margin(state, state.numbers[0] + Dual::fixed(tau), x),
                detail: 0.0,
            }),
            _ => {}
        }
    }

    /// The test functions where the slip velocity reaches zero.
    #[expect(clippy::too_many_arguments, reason = "the arc and what lies at both its ends")]
    fn entry(
        &self,
        before: &State<LANES>,
        after: &State<LANES>,
        arc: &Arc,
        index: usize,
        tau: Dual<LANES>,
        next: Phase,
        tests: &mut Vec<Test>,
    ) {
        let Phase::Slip(direction) = arc.phase else { return };
        if let Ending::Line(End::Turn { rising }) = arc.ending {
            let u = self.speed(direction, after.numbers[2]);
            both_ends(before, (index, tau.value), u, rising, tests);
            return;
        }
        if arc.ending == Ending::Section && next == Phase::Stick {
            let u = self.speed(direction, self.motion(before, arc.phase, tau)[1]);
            tests.push(Test {
                border: Border::Low,
                arc: index,
                tau: tau.value,
                value: u,
                detail: 0.0,
            });
        }
        let at_rest = self.speed(direction, after.numbers[2]).value == 0.0;
        if arc.ending != Ending::Line(End::Low) || !at_rest {
            return;
        }
        let (force, rate) = self.holding(after.numbers[0], after.numbers[1], self.drive);
        let margin = self.bears(Dual::fixed(0.0), rate) - force.abs();
        let (border, value) = if next == Phase::Stick {
            (Border::Entry, margin)
        } else {
            (Border::Crossing, -margin)
        };
        let detail = rate.value * force.value.signum();
        let falls = self.motion(before, arc.phase, tau)[2] * direction;
        for (border, value) in [(border, value), (Border::Arrival, falls)] {
            tests.push(Test {
                border,
                arc: index,
                tau: tau.value,
                value,
                detail,
            });
        }
    }
}

/// How far an extremum of the slip speed lies from both ends of its line: from the one it may reach, and from the one
/// behind it, where the arc itself may vanish.
fn both_ends(
    state: &State<LANES>,
    (arc, tau): (usize, f64),
    u: Dual<LANES>,
    least: bool,
    tests: &mut Vec<Test>,
) {
    let (low, high) = (state.numbers[LINE + 2], state.numbers[LINE + 3]);
    let mut push = |border, value, end: Dual<LANES>| {
        tests.push(Test {
            border,
            arc,
            tau,
            value,
            detail: end.value,
        });
    };
    // The end it may reach comes first.
    if least {
        push(Border::Low, u - low, low);
        push(Border::High, high - u, high);
    } else {
        push(Border::High, high - u, high);
        if low.value > 0.0 {
            push(Border::Low, u - low, low);
        }
    }
}

/// The root of `function` in a bracket (Illinois).
fn root(function: &impl Fn(f64) -> f64, (mut a, mut fa): (f64, f64), (mut b, mut fb): (f64, f64)) -> f64 {
    for _ in 0..100 {
        let c = (a * fb - b * fa) / (fb - fa);
        let fc = function(c);
        if fc == 0.0 || (b - a).abs() <= 1e-15 * c.abs() {
            return c;
        }
        if fc * fb < 0.0 {
            (a, fa) = (b, fb);
        } else {
            fa *= 0.5;
        }
        if (c - b).abs() <= 1e-16 * c.abs() {
            return c;
        }
        (b, fb) = (c, fc);
    }
    b
}
