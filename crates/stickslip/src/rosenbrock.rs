//! The motion of masses under laws with an internal state, step by step, by a Rosenbrock method.
//!
//! The page in the browser (`crates/stickslip-wasm`) runs these laws with it, and the judge (`crates/judge`) judges
//! its steps. Python does not use it: `python/stickslip/simulation/` integrates them with scipy's solvers on the right-hand side
//! of [`crate::state_system`].
//!
//! The method is RODAS4, a Rosenbrock method of order 4 with one of order 3 for its error, stiffly accurate and L-stable: E. Hairer &
//! G. Wanner, Solving Ordinary Differential Equations II, 2nd ed., Springer 1996, section IV.7. Between two steps each
//! variable is the cubic of the method's own dense output (the same, section VI.4 and the program RODAS): a cubic through the
//! slopes at both ends would multiply their errors by the stiffness.

use crate::elementary::power;
use crate::engine::{Engine, Reached, Samples};
use crate::error::{Error, finite, positive};
use crate::matrix::{factor, solve};
use crate::observer::Observer;
use crate::simulate::{MOST_BYTES, Stop, lost};
use crate::state_system::StateSystem;

/// A slip slower than this part of the fastest is called stuck, as these laws creep where others stick.
pub const CREEP_SPEED_RATIO: f64 = 1e-2;
/// Of the time so much must be stuck before a motion counts as one that sticks; others only pass through zero.
const LEAST_STUCK_TIME: f64 = 0.01;
/// A contact that slips slower than this part of the fastest mass rests.
const REST_SPEED_RATIO: f64 = 1e-6;
/// The part of the tolerance within which a slip velocity is at rest.
const LEAST_SPEED_SHARE: f64 = 0.01;
/// So many steps pass between two questions whether to go on.
const STEPS_BETWEEN_ASKS: usize = 100;
/// Steps shorter than this part of the time lead nowhere.
const SHORTEST_STEP: f64 = 4.0 * f64::EPSILON;

const GAMMA: f64 = 0.25;
/// What each stage adds of those before to the state at which friction is asked.
const A: [[f64; 4]; 5] = [
    [0.0; 4],
    [1.544, 0.0, 0.0, 0.0],
    [0.946_678_528_081_582_6, 0.255_701_169_898_328_4, 0.0, 0.0],
    [
        3.314_825_187_068_521,
        2.896_124_015_972_201,
        0.998_641_913_997_781_7,
        0.0,
    ],
    [
        1.221_224_509_226_641,
        6.019_134_481_288_629,
        12.537_083_329_320_87,
        -0.687_886_036_105_895,
    ],
];
/// What each stage adds of those before, over the step.
const C: [[f64; 5]; 6] = [
    [0.0; 5],
    [-5.6688, 0.0, 0.0, 0.0, 0.0],
    [-2.430_093_356_833_875, -0.206_359_915_709_191_5, 0.0, 0.0, 0.0],
    [
        -0.107_352_905_815_137_5,
        -9.594_562_251_023_355,
        -20.470_286_148_096_16,
        0.0,
        0.0,
    ],
    [
        7.496_443_313_967_647,
        -10.246_804_314_643_52,
        -33.999_903_528_199_05,
        11.708_908_932_061_6,
        0.0,
    ],
    [
        8.083_246_795_921_522,
        -7.981_132_988_064_893,
        -31.521_594_328_743_71,
        16.319_305_431_231_36,
        -6.058_818_238_834_054,
    ],
];
/// What each of the first five stages adds to the two coefficients of the cubic between two steps.
const BETWEEN: [[f64; 5]; 2] = [
    [
        10.126_235_083_445_86,
        -7.487_995_877_610_167,
        -34.800_918_615_557_47,
        -7.992_771_707_568_823,
        1.025_137_723_295_662,
    ],
    [
        -0.676_280_339_280_125_3,
        6.087_714_651_680_015,
        16.430_843_208_924_78,
        24.767_225_114_183_86,
        -6.594_389_125_716_872,
    ],
];
/// The time of each stage within the step, and the factor of ∂f/∂t.
const TIME: [f64; 6] = [0.0, 0.386, 0.21, 0.63, 1.0, 1.0];
const DRIFT: [f64; 6] = [0.25, -0.1043, 0.1035, -0.0362, 0.0, 0.0];

/// A motion that is integrated further and further, known at its steps and between them.
#[derive(Clone, Debug)]
pub struct Integration {
    system: StateSystem,
    scales: Vec<f64>,
    /// The part of each variable itself that counts besides its scale.
    shares: Vec<f64>,
    /// The slip velocity below which nothing slips.
    least: f64,
    tolerance: f64,
    /// Times of the steps that are kept.
    t: Vec<f64>,
    /// The variables there, those of [`StateSystem::regular`], row after row, and the two coefficients of the polynomial that
    /// leads to each row from the one before.
    y: Vec<f64>,
    between: [Vec<f64>; 2],
    /// Their slopes at the last step.
    slope: Vec<f64>,
    /// The variables at t = 0 as they were given: those of [`StateSystem::regular`] have rounding of their own.
    start: Box<[f64]>,
    /// The length of the next step.
    h: f64,
    steps: usize,
    /// What an observer sees.
    contact: usize,
    end: Reached,
}

impl Integration {
    /// From the variables `y` at t = 0. The error of each step is at most `tolerance` of each variable, or of its scale.
    ///
    /// # Errors
    /// Numbers that make no sense.
    pub fn new(system: StateSystem, y: Vec<f64>, tolerance: f64) -> Result<Self, Error> {
        positive("tolerance", tolerance)?;
        for &value in &y {
            finite("start", value)?;
        }
        let (scales, shares) = system.regular_scales(&y);
        let least = LEAST_SPEED_SHARE * tolerance * system.scales(&y)[system.masses()];
        let start = system.balanced(y);
        let y = system.regular(start.clone());
        Ok(Self {
            start: start.into(),
            scales,
            shares,
            least,
            t: vec![0.0],
            slope: system.regular_rates(0.0, &y, least),
            between: [vec![0.0; y.len()], vec![0.0; y.len()]],
            y,
            h: 1e-3 * system.period(),
            steps: 0,
            contact: 0,
            end: Reached::default(),
            system,
            tolerance,
        })
    }

    /// Of this contact an observer is shown the motion; without a choice of the first.
    #[must_use]
    pub fn of_contact(self, contact: usize) -> Self {
        Self { contact, ..self }
    }

    /// Go on to `t_end` and keep the steps from `after` on; asked every hundred steps, `go_on` says whether to.
    pub fn advance(&mut self, t_end: f64, after: f64, go_on: &mut dyn FnMut() -> bool) -> Stop {
        loop {
            let t = self.t_last();
            if t >= t_end {
                return Stop::End;
            }
            // A step ends where a drive has a corner, of which its estimate of the error does not know.
            let node = self.system.node_after(t);
            let until = node.min(t_end);
            let left = until - t;
            self.steps += 1;
            if self.steps.is_multiple_of(STEPS_BETWEEN_ASKS) && !go_on() {
                return Stop::MaxSeconds;
            }
            // The last two steps are of one length: none is left that is too short.
            let h = if self.h >= left {
                left
            } else {
                self.h.min(0.5 * left)
            };
            let Step { error, y, between } = self.step(t, h, node);
            self.h =
                h * (0.9 * power(error.max(1e-10), -0.25)).clamp(0.2, if error <= 1.0 { 5.0 } else { 0.9 });
            if error <= 1.0 {
                if let Some(stop) = lost(&y) {
                    return stop;
                }
                let now = if h == left { until } else { t + h };
                self.slope = self.system.regular_rates(now, &y, self.least);
                if now <= after {
                    self.t.clear();
                    self.y.clear();
                    self.between.iter_mut().for_each(Vec::clear);
                }
                self.t.push(now);
                self.y.extend(y);
                for (kept, coefficients) in self.between.iter_mut().zip(between) {
                    kept.extend(coefficients);
                }
                if self.y.len() * 3 * size_of::<f64>() > MOST_BYTES {
                    return Stop::Memory;
                }
            } else if self.h <= SHORTEST_STEP * t.max(self.system.period()) {
                return Stop::Stiff;
            }
        }
    }

    /// Try a step. Up to a `node` of a drive it sees the piece before it alone.
    fn step(&mut self, t: f64, h: f64, node: f64) -> Step {
        let before = node * (1.0 - f64::EPSILON);
        let (system, width) = (&self.system, self.system.width());
        let y = &self.y[self.y.len() - width..];
        let slope = &self.slope;
        let (mut matrix, drift) = system.jacobian(t, y, slope, &self.scales, self.least);
        for entry in &mut matrix {
            *entry = -*entry;
        }
        for i in 0..width {
            matrix[i * width + i] += 1.0 / (h * GAMMA);
        }
        let Some(pivots) = factor(&mut matrix, width) else {
            return Step {
                error: f64::INFINITY,
                y: Vec::new(),
                between: Default::default(),
            };
        };
        let mut stages: Vec<Vec<f64>> = Vec::with_capacity(6);
        let mut at = y.to_vec();
        for stage in 0..6 {
            if (1..5).contains(&stage) {
                at.copy_from_slice(y);
                for (k, factor) in stages.iter().zip(A[stage]) {
                    add(&mut at, factor, k);
                }
            } else if let Some(last) = stages.last() {
                // The last stage goes on from where the one before it came to.
                add(&mut at, 1.0, last);
            }
            let mut right = if stage == 0 {
                slope.clone()
            } else {
                system.regular_rates((t + TIME[stage] * h).min(before), &at, self.least)
            };
            add(&mut right, h * DRIFT[stage], &drift);
            for (k, factor) in stages.iter().zip(C[stage]) {
                add(&mut right, factor / h, k);
            }
            solve(&matrix, &pivots, &mut right);
            stages.push(right);
        }
        let between = BETWEEN.map(|factors| {
            let mut sum = vec![0.0; width];
            for (k, factor) in stages.iter().zip(factors) {
                add(&mut sum, factor, k);
            }
            sum
        });
        let missed = &stages[5];
        add(&mut at, 1.0, missed);
        let scales = self.scales.iter().zip(&self.shares);
        let each = missed.iter().zip(scales).zip(y.iter().zip(&at));
        let squares = each.map(|((missed, (scale, share)), (y, at))| {
            let may = self.tolerance * (scale + share * y.abs().max(at.abs()));
            (missed / may) * (missed / may)
        });
        let error = (squares.sum::<f64>() / width as f64).sqrt();
        Step {
            error: if error.is_nan() { f64::INFINITY } else { error },
            y: at,
            between,
        }
    }

    /// What moved.
    pub fn system(&self) -> &StateSystem {
        &self.system
    }

    /// The time up to which it is known.
    ///
    /// # Panics
    /// Never: the start is a step.
    pub fn t_last(&self) -> f64 {
        *self.t.last().expect("the start")
    }

    /// The times of the steps that are kept.
    pub fn times(&self) -> &[f64] {
        &self.t
    }

    /// The variables at the end.
    pub fn last(&self) -> Vec<f64> {
        self.system.natural(&self.y[self.y.len() - self.system.width()..])
    }

    /// The variables at a time, those of the nearest end outside of what is known.
    pub fn variables(&self, t: f64) -> Vec<f64> {
        if t <= 0.0 {
            return self.start.to_vec();
        }
        let width = self.system.width();
        let row = |values: &[f64], i: usize| values[i * width..][..width].to_vec();
        let next = self.t.partition_point(|&begun| begun <= t);
        if next == 0 || next == self.t.len() {
            return self.system.natural(&row(&self.y, next.max(1) - 1));
        }
        let h = self.t[next] - self.t[next - 1];
        let s = (t - self.t[next - 1]) / h;
        let (mut y, to) = (row(&self.y, next - 1), row(&self.y, next));
        let [first, second] = [0, 1].map(|power: usize| row(&self.between[power], next));
        for i in 0..width {
            y[i] = y[i] * (1.0 - s) + s * (to[i] + (1.0 - s) * (first[i] + s * second[i]));
        }
        self.system.natural(&y)
    }

    /// The motion of the contact's mass at the steps that are kept.
    fn columns(&self) -> Columns {
        let contact = self.contact;
        let (mass, width) = (self.system.mass_of(contact), self.system.width());
        let mut columns = Columns {
            t: self.t.clone(),
            ..Columns::default()
        };
        let mut fastest: f64 = 0.0;
        for (&t, y) in self.t.iter().zip(self.y.chunks_exact(width)) {
            let motion = self.system.motion(t, &self.system.natural(y));
            fastest = motion.v.iter().fold(fastest, |most, v| most.max(v.abs()));
            columns.x.push(y[mass]);
            columns.v.push(motion.v[mass]);
            columns.a.push(motion.a[mass]);
            columns.w.push(motion.w[contact]);
            columns.slip_acceleration.push(motion.slip_acceleration[contact]);
        }
        let most = columns.w.iter().fold(0.0, |most: f64, w| most.max(w.abs()));
        let rests = most <= REST_SPEED_RATIO * fastest;
        columns.stuck = columns
            .w
            .iter()
            .map(|w| rests || w.abs() <= CREEP_SPEED_RATIO * most)
            .collect();
        let each = columns.t.windows(2).zip(columns.stuck.windows(2));
        let stuck: f64 = each
            .filter(|(_, stuck)| stuck[0] && stuck[1])
            .map(|(t, _)| t[1] - t[0])
            .sum();
        if !rests && stuck <= LEAST_STUCK_TIME * (self.t_last() - self.t[0]) {
            columns.stuck.fill(false);
        }
        columns
    }
}

impl Engine for Integration {
    /// What is stuck is told by the fastest slip from `after` on: the motion is integrated first and shown afterwards.
    fn go(&mut self, t_end: f64, after: f64, observer: &mut impl Observer) -> Result<Stop, Error> {
        positive("t_end", t_end)?;
        let stop = self.advance(t_end, after, &mut || observer.go_on());
        let Columns {
            t,
            x,
            v,
            a,
            w,
            slip_acceleration,
            stuck,
        } = &self.columns();
        let end = Reached::default();
        let mut samples = Samples {
            t,
            x,
            v,
            a,
            w,
            slip_acceleration,
            stuck,
            events: 0,
            end,
        };
        match stop {
            Stop::End => samples.go(t_end, after, observer),
            stop => Ok(stop),
        }
    }

    fn events(&self) -> u64 {
        0
    }

    fn end(&self) -> &Reached {
        &self.end
    }
}

/// The motion of a contact's mass by columns of one length, as [`Samples`] has them.
#[derive(Clone, Debug, Default)]
struct Columns {
    t: Vec<f64>,
    x: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
    w: Vec<f64>,
    slip_acceleration: Vec<f64>,
    stuck: Vec<bool>,
}

/// A step that was tried.
struct Step {
    /// What it missed, over what it may: it is taken where that is no more than 1.
    error: f64,
    /// Where it leads.
    y: Vec<f64>,
    /// The coefficients of the polynomial that leads there.
    between: [Vec<f64>; 2],
}

fn add(sum: &mut [f64], factor: f64, values: &[f64]) {
    for (sum, value) in sum.iter_mut().zip(values) {
        *sum += factor * value;
    }
}

#[cfg(test)]
mod tests {
    use super::Integration;
    use crate::law::declaration::Parameters;
    use crate::oscillator::Oscillator;
    use crate::simulate::Stop;
    use crate::state_law::{Dahl, LuGre, RateState, StateLaw};
    use crate::state_system::StateSystem;
    use crate::system::System;

    fn integrated(law: impl Into<StateLaw>, tolerance: f64, times: &[f64]) -> Integration {
        started(law, 0.3, None, tolerance, times)
    }

    fn started(
        law: impl Into<StateLaw>,
        x: f64,
        v: Option<f64>,
        tolerance: f64,
        times: &[f64],
    ) -> Integration {
        let oscillator = Oscillator::new(0.05, 0.2, law);
        let system = StateSystem::new(System::from(&oscillator)).unwrap();
        let y = system.variables(&[x], v.map(|v| vec![v]));
        let mut motion = Integration::new(system, y, tolerance).unwrap();
        for &t in times {
            assert_eq!(motion.advance(t, 0.0, &mut || true), Stop::End);
        }
        motion
    }

    #[test]
    fn the_error_falls_with_the_tolerance_and_no_interruption_counts() {
        let law = LuGre::new(100.0, 2.0, 0.1, 1.0, 1.5, 0.1, 2.0);
        let known = integrated(law.clone(), 1e-11, &[20.0]);
        let missed = |motion: &Integration, t: f64| (motion.variables(t)[0] - known.variables(t)[0]).abs();
        let (coarse, fine) = (
            integrated(law.clone(), 1e-6, &[20.0]),
            integrated(law.clone(), 1e-9, &[20.0]),
        );
        assert!(missed(&coarse, 20.0) < 1e-4 && missed(&fine, 20.0) < 0.03 * missed(&coarse, 20.0));
        // Between steps too, and as it is gone on with.
        assert!((1..20).all(|t| missed(&coarse, f64::from(t)) < 1e-4));
        assert!(missed(&integrated(law, 1e-9, &[7.3, 12.0, 20.0]), 20.0) < 1e-6);
    }

    #[test]
    fn two_states_of_one_length_move_as_one_with_both_effects() {
        let one = RateState {
            b: 0.014,
            ..RateState::example()
        };
        let two = RateState {
            b: 0.008,
            second_b: Some(0.006),
            second_length: Some(one.length),
            ..one.clone()
        };
        let slipping = |law: RateState| started(law, 0.7, Some(0.0), 1e-10, &[1.0]).variables(1.0);
        let (known, found) = (slipping(one), slipping(two));
        assert_eq!((known.len(), found.len()), (3, 4));
        let known = [known[0], known[1], known[2], known[2]];
        assert!(
            found.iter().zip(known).all(|(a, b)| (a - b).abs() < 1e-7),
            "{found:?} {known:?}"
        );
        // From that of steady slip at 0.2.
        assert!((known[2] + 0.2_f64.ln()).abs() > 0.01, "{known:?}");
    }

    #[test]
    fn rate_and_state_friction_is_left_and_reached_at_rest() {
        let law = RateState::example();
        // At rest the drive alone moves the mass: x = s t, and friction bears the spring and the damper.
        let rest = integrated(law.clone(), 1e-9, &[0.5]);
        let y = rest.variables(0.5);
        assert!((y[0] - 0.4).abs() < 1e-8, "{y:?}");
        let force = rest.system().motion(0.5, &y).force[0];
        assert!((force - (0.4 + 0.05 * 0.2)).abs() < 1e-6, "{force}");
        assert!(y[1] > 0.0 && y[1] < 1e-7, "{y:?}");
        // Break-away at about 0.6 + b ln(1 + t), and rest again after a start in slip.
        for (a, tolerance) in [
            (0.03, 1e-6),
            (0.01, 1e-6),
            (0.01, 1e-8),
            (0.003, 1e-6),
            (0.001, 1e-6),
        ] {
            let law = RateState { a, ..law.clone() };
            let slid = started(law, 0.0, Some(0.0), tolerance, &[1.0, 30.0]);
            let early = slid.variables(1.0);
            assert!(early[1].abs() < 1e-5, "{early:?}");
            let late = (0..30).map(|t| slid.variables(f64::from(t))[1]);
            assert!(late.fold(0.0, f64::max) > 0.1);
        }
    }

    #[test]
    fn friction_that_only_adheres_is_a_spring() {
        // Dahl's bristles at small slip: F = σ z, so the mass swings at √(k + σ) about where both springs balance.
        let law = Dahl::new(3.0, 1e9, 1.0);
        let motion = integrated(law, 1e-9, &[5.0]);
        let (x0, s, damping) = (0.3, 0.2, 0.05_f64);
        // d³x/dt³ + D ẍ + (k + σ) ẋ = σ s: ẋ oscillates about σ s/(k + σ) from s, with ẍ(0) = −D s − k x₀.
        let (decay, mean) = (0.5 * damping, 3.0 * s / 4.0);
        let frequency = (4.0 - decay * decay).sqrt();
        let (a, b) = (s - mean, (-damping * s - x0 + decay * (s - mean)) / frequency);
        let t = 5.0_f64;
        let v = mean + (-decay * t).exp() * (a * (frequency * t).cos() + b * (frequency * t).sin());
        let slip = motion.variables(t)[1];
        assert!((s - slip - v).abs() < 1e-6, "{} {v}", s - slip);
    }
}
