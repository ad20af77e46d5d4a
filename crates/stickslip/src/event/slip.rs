//! When slip along a piece of friction ends.

use super::free::end_of_free_slip;
use super::search::{Ends, Guard, Motion, SEARCH_DEGREE, Sample, first_exit};
use super::{ANEW_ROUNDINGS, BESIDE_ROOT, Start, changes_sign};
use crate::flow::enclosure::{bounds, sixth_and_seventh};
use crate::flow::exact::{Signal, Slip};
use crate::law::{End, Piece};
use crate::watch::Watched;

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

/// Slip along a piece of friction from one event to the next.
#[derive(Clone, Copy, Debug)]
pub struct SlipPhase<'a, const H: usize> {
    /// The motion.
    pub slip: &'a Slip<H>,
    /// Sign of w.
    pub direction: f64,
    /// Velocity of the drive.
    pub drive_velocity: f64,
    /// The piece of friction.
    pub piece: &'a Piece,
    /// What is known of the slip speed at the start.
    pub start: Start,
}

/// When and how `phase` ends within `horizon`, if it does.
pub fn end_of_slip<const H: usize>(
    phase: &SlipPhase<H>,
    horizon: f64,
    work: &mut Watched,
) -> Option<Arrival> {
    let arrival = if H == 0 {
        end_of_free_slip(phase, horizon, work)
    } else {
        end_of_forced_slip(phase, horizon, work)
    };
    debug_assert!(
        arrival.is_none_or(|arrival| is_end(phase, &arrival)),
        "{arrival:?} is no end of {phase:?}"
    );
    arrival
}

/// The certificate of an end of slip.
fn is_end<const H: usize>(phase: &SlipPhase<H>, arrival: &Arrival) -> bool {
    let speed = Speed::new(phase);
    let guard = match arrival.end {
        End::Low => Guard {
            target: phase.piece.low,
            ..Guard::LOW
        },
        End::High => Guard {
            target: phase.piece.high,
            ..Guard::HIGH
        },
        end @ End::Reversal { rising } => Guard {
            end,
            order: 1,
            side: if rising { -1.0 } else { 1.0 },
            target: 0.0,
        },
    };
    // Rounding of the start grows as the motion does.
    let grown = guard.rounding(&speed.at(0.0), &speed) * phase.slip.decay.growth(arrival.t);
    changes_sign(arrival.t, BESIDE_ROOT / speed.fastest, |t| {
        let sample = speed.at(t);
        [
            guard.margin(&sample)[0],
            ANEW_ROUNDINGS * (guard.rounding(&sample, &speed) + grown),
        ]
    })
}

fn end_of_forced_slip<const H: usize>(
    phase: &SlipPhase<H>,
    horizon: f64,
    work: &mut Watched,
) -> Option<Arrival> {
    let SlipPhase {
        slip, piece, start, ..
    } = *phase;
    let speed = Speed::new(phase);
    let ends = Ends {
        low: piece.low,
        high: piece.high,
        reverses: piece.reverses,
    };
    let exit = first_exit(&speed, ends, start, horizon, work)?;
    let at_reversal = start == Start::Reversal && !slip.decay.oscillates();
    let x = if at_reversal || slip.decay.separates() {
        work.evaluations += 1;
        speed.slip.position(exit.t, &slip.basis(exit.t))
    } else {
        let step = exit.t - exit.sample.t;
        speed.position(&exit.sample) + phase.drive_velocity * step - phase.direction * exit.travel
    };
    Some(Arrival {
        t: exit.t,
        end: exit.end,
        x,
        v: phase.drive_velocity - phase.direction * exit.value,
    })
}

/// The slip speed u = σ (s − ẋ).
struct Speed<const H: usize> {
    slip: Slip<H>,
    direction: f64,
    u: Signal<H>,
    du: Signal<H>,
    natural: f64,
    /// Sixth and seventh power of the exponents of the free part.
    powers: [[f64; 2]; 2],
    /// Bounds of the harmonics.
    waves: [f64; 3],
    fastest: f64,
}

impl<const H: usize> Speed<H> {
    fn new(phase: &SlipPhase<H>) -> Self {
        let (mut slip, direction) = (*phase.slip, phase.direction);
        let decay = slip.decay;
        let mut u = slip.speed(direction, phase.drive_velocity);
        let mut du = u.derivative(&decay, &slip.frequency);
        if phase.start.reverses(du.start(&decay)) {
            // Known to be zero here; rounding must not shift the next turn.
            if decay.separates() {
                // Nor feed a fast exponential: of one that grows the state, to its last digit, need not tell even the sign.
                u.free = decay.coefficients(decay.start(u.free), -du.p.iter().sum::<f64>());
                du = u.derivative(&decay, &slip.frequency);
                let (slow, fast) = decay.roots();
                slip.v.free = u.free.map(|free| -direction * free);
                slip.x.free = [slip.v.free[0] / slow, slip.v.free[1] / fast];
            } else {
                // Where the motion grows, the rate then no longer fits the speed well enough for the position to follow from
                // both.
                du = du.started_at_zero(&decay);
            }
        }
        let exponents = slip.decay.exponents();
        let fastest = slip
            .frequency
            .iter()
            .fold(exponents[0].max(exponents[1]), |most, one| most.max(*one));
        Self {
            slip,
            direction,
            u,
            du,
            natural: slip.decay.natural_squared,
            powers: exponents.map(sixth_and_seventh),
            waves: bounds(&u.p, &u.q, &slip.frequency),
            fastest,
        }
    }
}

impl<const H: usize> Speed<H> {
    /// x where the slip speed was sampled, as x″ = −2γ x′ − (k/m) x in its free part and x″ = −Ω² x in a harmonic.
    fn position(&self, sample: &Sample<H>) -> f64 {
        let [value, rate] = sample.free;
        let mut swing = (rate + 2.0 * self.slip.decay.gamma * value) / self.natural;
        for (wave, frequency) in sample.waves.iter().zip(&self.slip.frequency) {
            swing += wave[1] / (frequency * frequency);
        }
        self.slip.x.constant + self.direction * swing
    }
}

/// The harmonics at `basis`: value and rate of each, and what they add to a value and its first three derivatives.
pub(super) fn waves<const H: usize>(
    value: [f64; H],
    rate: [f64; H],
    frequency: &[f64; H],
    d: &mut [f64; 4],
) -> [[f64; 2]; H] {
    std::array::from_fn(|j| {
        let square = frequency[j] * frequency[j];
        d[0] += value[j];
        d[1] += rate[j];
        d[2] -= square * value[j];
        d[3] -= square * rate[j];
        [value[j], rate[j]]
    })
}

/// The same for all derivatives.
pub(super) fn add_waves<const H: usize>(
    waves: &[[f64; 2]; H],
    frequency: &[f64; H],
    derivatives: &mut [f64; SEARCH_DEGREE + 1],
) {
    for j in 0..H {
        let [mut even, mut odd] = waves[j];
        let square = frequency[j] * frequency[j];
        for pair in derivatives.chunks_mut(2) {
            pair[0] += even;
            even *= -square;
            if let Some(second) = pair.get_mut(1) {
                *second += odd;
                odd *= -square;
            }
        }
    }
}

impl<const H: usize> Motion<H> for Speed<H> {
    #[inline]
    fn at(&self, t: f64) -> Sample<H> {
        let (decay, frequency) = (&self.slip.decay, &self.slip.frequency);
        let basis = self.slip.basis(t);
        let free @ [value, rate] = [self.u.free(&basis), self.du.free(&basis)];
        let curvature = -2.0 * decay.gamma * rate - self.natural * value;
        let jerk = -2.0 * decay.gamma * curvature - self.natural * rate;
        let mut d = [self.u.constant + value, rate, curvature, jerk];
        let waves = waves(
            std::array::from_fn(|j| self.u.wave(j, &basis)),
            std::array::from_fn(|j| self.du.wave(j, &basis)),
            frequency,
            &mut d,
        );
        let [one, two] = decay.amplitudes(value, rate);
        let free_bound = |n: usize| one * self.powers[0][n] + two * self.powers[1][n];
        Sample {
            t,
            d,
            free,
            waves,
            bound: [
                self.waves[0] + one + two,
                self.waves[1] + free_bound(0),
                self.waves[2] + free_bound(1),
            ],
        }
    }

    fn fastest(&self) -> f64 {
        self.fastest
    }

    fn growing(&self) -> f64 {
        self.slip.decay.growing()
    }

    /// The slip acceleration is what springs, damping, friction and forcing leave of each other: near steady slip, rounding.
    fn terms_of_rate(&self, sample: &Sample<H>) -> f64 {
        let (decay, [value, rate]) = (&self.slip.decay, sample.free);
        let (spring, damper) = (
            self.natural * self.slip.x.constant,
            2.0 * decay.gamma * self.u.constant,
        );
        let free = decay.amplitudes(value, rate).into_iter().zip(decay.exponents());
        let waves = self.u.p.iter().zip(&self.u.q).zip(&self.slip.frequency);
        spring.abs()
            + damper.abs()
            + free
                .map(|(amplitude, exponent)| amplitude * exponent)
                .sum::<f64>()
            + waves
                .map(|((p, q), frequency)| (p.abs() + q.abs()) * frequency)
                .sum::<f64>()
    }

    fn derivatives(&self, sample: &Sample<H>) -> [f64; SEARCH_DEGREE + 1] {
        let mut derivatives = [0.0; SEARCH_DEGREE + 1];
        derivatives[..2].copy_from_slice(&sample.free);
        for n in 2..=SEARCH_DEGREE {
            derivatives[n] =
                -2.0 * self.slip.decay.gamma * derivatives[n - 1] - self.natural * derivatives[n - 2];
        }
        add_waves(&sample.waves, &self.slip.frequency, &mut derivatives);
        derivatives[0] = sample.d[0];
        derivatives
    }
}

#[cfg(test)]
mod tests {
    use super::{Arrival, SlipPhase, end_of_slip, is_end};
    use crate::clock::Clock;
    use crate::event::{Start, Work};
    use crate::flow::exact::Frame;
    use crate::harmonic::Harmonic;
    use crate::law::Piece;
    use crate::watch::Watched;

    /// A root has its certificate; a time beside it has none.
    #[test]
    fn only_a_root_is_certified() {
        let forcing = [Harmonic::new(0.3, 1.7, 0.4)];
        let frame = Frame::<1> {
            mass: 1.0,
            stiffness: 1.3,
            damping: 0.1,
            drive_velocity: 0.3,
            constant: 0.0,
            forcing,
        };
        let mut found = 0;
        for case in 0..200 {
            let piece = Piece::line([0.0, 0.5], -0.2, 0.0, 0.1 + 0.01 * f64::from(case), 0);
            let piece = Piece {
                reverses: case % 3 == 0,
                ..piece
            };
            let (x, v) = (0.02 * f64::from(case) - 1.5, 0.3 - 0.5 * piece.high);
            let slip = frame.closed(Clock::default(), x, v, 1.0, &piece);
            let (mut work, mut go_on) = (Work::default(), || true);
            let mut watched = Watched::new(&mut work, &mut go_on);
            let phase = SlipPhase {
                slip: &slip,
                direction: 1.0,
                drive_velocity: 0.3,
                piece: &piece,
                start: Start::Inside,
            };
            let Some(arrival) = end_of_slip(&phase, 50.0, &mut watched) else {
                continue;
            };
            let certified = |t: f64| is_end(&phase, &Arrival { t, ..arrival });
            assert!(certified(arrival.t), "{case}: {arrival:?}");
            assert!(
                !certified(arrival.t + 1e-6) && !certified((arrival.t - 1e-6).max(0.0)),
                "{case}: {arrival:?}"
            );
            found += 1;
        }
        assert!(found > 150, "{found}");
    }
}
