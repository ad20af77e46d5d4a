//! Systems of masses: one mass against the closed form, energy balances, adhesion and slip where they belong.

use stickslip::drive::Drive;
use stickslip::harmonic::Harmonic;
use stickslip::law::{
    BogaczRyczek, Coulomb, Cubic, DwellTime, ExponentialStribeck, Friction, Law, PiecewiseLinear,
    PoppStelter, Rational, Rest, StaticKinetic,
};
use stickslip::mode::Kind;
use stickslip::network::{self, Run};
use stickslip::oscillator::Oscillator;
use stickslip::simulate;
use stickslip::system::{Contact, Force, System};

#[path = "support/dice.rs"]
mod dice;
use dice::Dice;

/// Both engines over 100 time units: the same events and, at 10,000 times, the same motion. The worst difference.
fn difference(oscillator: &Oscillator, x0: f64, v0: Option<f64>) -> f64 {
    let exact = simulate::simulate(
        oscillator,
        simulate::Run {
            x0,
            v0,
            ..simulate::Run::stuck(100.0)
        },
    )
    .unwrap();
    let run = Run {
        x0: Some(vec![x0]),
        v0: v0.map(|v| vec![v]),
        ..Run::driven(100.0)
    };
    let general = network::simulate(&System::from(oscillator), run).unwrap();
    let slow = |kind: Kind| matches!(kind, Kind::Node | Kind::Reversal);
    let kinds = |kinds: Vec<Kind>| kinds.iter().map(|kind| kind.name()).collect::<Vec<_>>();
    let both = general.events.len().min(exact.events.len());
    assert_eq!(
        kinds(general.events[..both].iter().map(|event| event.kind).collect()),
        kinds(exact.events[..both].iter().map(|event| event.kind).collect()),
        "{oscillator:?} from {x0}, {v0:?}"
    );
    // Where a motion has died out to rounding, its last turns may be there or not.
    assert!(general.events[both..].iter().all(|event| slow(event.kind)));
    assert!(exact.events[both..].iter().all(|event| slow(event.kind)));
    let mut worst: f64 = 0.0;
    for (one, other) in general.events.iter().zip(&exact.events) {
        // A motion that dies out crosses nodes ever more slowly: its times, not its states, lose digits.
        worst = worst.max((one.t - other.t).abs() * if slow(one.kind) { 0.0 } else { 1.0 });
        for (a, b) in [
            (one.v, other.v),
            (one.force, other.force),
            (one.stick_time, other.stick_time),
            (one.force_rate, other.force_rate),
        ] {
            assert_eq!(a.is_nan(), b.is_nan());
            worst = worst.max(if a.is_nan() { 0.0 } else { (a - b).abs() });
        }
    }
    let times: Vec<f64> = (0..10_000).map(|i| f64::from(i) * 0.01).collect();
    let states = general.states(&times);
    for (i, state) in exact.states(&times).iter().enumerate() {
        worst = worst
            .max((states.x[i] - state.x).abs())
            .max((states.v[i] - state.v).abs());
    }
    worst
}

fn oscillators() -> Vec<Oscillator> {
    let laws: [Law; 5] = [
        StaticKinetic::new(1.0, 0.6).into(),
        PiecewiseLinear::new(vec![[0.0, 1.0], [0.2, 0.6], [0.5, 0.63]], 1.0).into(),
        DwellTime::new(0.5, 0.5, 0.4, 1.0).into(),
        with_one_static_friction().into(),
        falling_with_the_force_rate().into(),
    ];
    let mut all = Vec::new();
    for law in laws {
        for damping in [0.05, 0.28] {
            for drive_velocity in [0.1, 0.2, 0.3, 0.4] {
                for forcing in [vec![], vec![Harmonic::new(0.1, 1.25, 0.3)]] {
                    all.push(Oscillator {
                        forcing,
                        ..Oscillator::new(damping, drive_velocity, law.clone())
                    });
                }
            }
        }
    }
    all
}

/// The closed form and the Taylor steps share neither flow nor search.
#[test]
fn one_mass_agrees_with_the_closed_form() {
    for oscillator in oscillators() {
        for (x0, v0) in [(0.0, None), (1.2, Some(0.7))] {
            let worst = difference(&oscillator, x0, v0);
            // Falls after break-away amplify a difference, and some of the forced motions do so from stick to stick.
            let most = if oscillator.forcing.is_empty() {
                1e-10
            } else {
                1e-9
            };
            assert!(worst < most, "{oscillator:?} from {x0}, {v0:?}: {worst:.1e}");
        }
    }
}

/// The paper's law with f_s(0) the same at every force rate: its motions are steady or repeat, so no rounding grows.
/// Heavy damping takes 25,000 Taylor steps along a motion that hardly moves: position and speed add up without a rounding each.
#[test]
fn many_short_steps_lose_no_digits() {
    let oscillator = Oscillator::new(1000.0, 0.3, Coulomb::new(0.6));
    let worst = difference(&oscillator, -1.7, Some(0.0));
    assert!(worst < 2e-15, "{worst:.1e}");
}

fn with_one_static_friction() -> BogaczRyczek {
    let mut law = BogaczRyczek::default();
    law.static_friction.initial = 1.084;
    law.static_friction.drop = 0.0;
    law
}

/// The paper's law with static friction that falls with the force rate, also without rest.
fn falling_with_the_force_rate() -> BogaczRyczek {
    let mut law = BogaczRyczek::default();
    law.static_friction.initial = 0.8;
    law.static_friction.drop = 1.2;
    law.static_friction.drop_scale = 0.35;
    law.static_friction.drop_exponent = 4.0;
    law
}

impl Dice {
    fn law(&mut self) -> Law {
        let kinetic = self.between(0.2, 0.6);
        let break_away = kinetic + self.between(0.0, 0.6);
        match self.below(10) {
            0 => Coulomb::new(kinetic).into(),
            1 => StaticKinetic::new(break_away, kinetic).into(),
            2 => DwellTime::new(
                kinetic,
                self.between(0.1, 0.6),
                self.between(0.1, 2.0),
                self.between(0.4, 1.3),
            )
            .into(),
            3 => PiecewiseLinear::new(
                vec![
                    [0.0, break_away],
                    [0.2, kinetic],
                    [0.6, kinetic + 0.05],
                    [1.0, 0.7],
                ],
                break_away + self.between(0.0, 0.3),
            )
            .into(),
            4 => Rational::new(break_away, self.between(0.5, 4.0)).into(),
            5 => ExponentialStribeck::new(break_away, kinetic, self.between(0.05, 0.5), 0.05, 1.0).into(),
            6 => Cubic::new(0.4, 0.45, 0.6).into(),
            7 => PoppStelter::new(break_away, kinetic, 1.42, 0.01).into(),
            8 => falling_with_the_force_rate().into(),
            _ => BogaczRyczek::default().into(),
        }
    }

    fn drive(&mut self) -> Drive {
        let velocity = self.between(0.05, 0.6);
        match self.below(4) {
            0 => Drive {
                velocity,
                harmonics: vec![Harmonic::new(
                    self.between(0.05, 0.5),
                    self.between(0.3, 3.0),
                    self.between(0.0, 6.0),
                )],
                nodes: vec![],
            },
            1 => Drive {
                velocity: 0.0,
                harmonics: vec![],
                nodes: vec![[3.0, 0.1], [8.0, velocity], [11.0, -velocity], [20.0, 0.2]],
            },
            _ => velocity.into(),
        }
    }

    fn system(&mut self) -> System {
        let n = 1 + self.below(4);
        let zero = vec![vec![0.0; n]; n];
        let (mut mass, mut stiffness, mut damping) = (zero.clone(), zero.clone(), zero);
        for i in 0..n {
            mass[i][i] = self.between(0.5, 2.0);
            stiffness[i][i] += self.between(0.3, 2.0);
            damping[i][i] += self.between(0.0, 0.2);
            for j in 0..i {
                let (inertia, spring, damper) = (
                    self.between(0.0, 0.1),
                    self.between(0.0, 1.0),
                    self.between(0.0, 0.1),
                );
                mass[i][j] = inertia;
                mass[j][i] = inertia;
                for (matrix, value) in [(&mut stiffness, spring), (&mut damping, damper)] {
                    matrix[i][i] += value;
                    matrix[j][j] += value;
                    matrix[i][j] -= value;
                    matrix[j][i] -= value;
                }
            }
        }
        let mut contacts: Vec<Contact> = (0..n)
            .map(|mass| Contact {
                mass,
                other: None,
                drive_velocity: self.drive(),
                law: self.law(),
                normal_force: None,
            })
            .collect();
        if n > 1 {
            // One mass force_lines on its neighbour instead of on a drive, another on both.
            let (first, second) = (self.below(n - 1), self.below(n - 1));
            contacts[first].other = Some(first + 1);
            contacts[first].drive_velocity = 0.0.into();
            contacts.push(Contact {
                mass: second + 1,
                other: Some(second),
                drive_velocity: 0.0.into(),
                law: self.law(),
                normal_force: None,
            });
        }
        let forcing = (0..self.below(3))
            .map(|_| Force {
                mass: self.below(n),
                amplitude: self.between(0.0, 0.6),
                frequency: self.between(0.2, 3.0),
                phase: self.between(0.0, 6.0),
            })
            .collect();
        System {
            mass,
            stiffness,
            damping,
            contacts,
            forcing,
            springs: Vec::new(),
        }
    }
}

fn times_vector(matrix: &[Vec<f64>], vector: &[f64]) -> Vec<f64> {
    let row = |row: &Vec<f64>| row.iter().zip(vector).map(|(a, b)| a * b).sum();
    matrix.iter().map(row).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Gauss-Legendre nodes and weights of 8 points on (−1, 1), the positive half.
const GAUSS: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

/// Parts of a step for the quadrature.
const PARTS: u32 = 4;

/// The error of the energy balance over the run, and what it is relative to; every mode is looked at on the way.
fn audit(system: &System, t_end: f64) -> (f64, f64) {
    let orbit = network::simulate(
        system,
        Run {
            max_events: 20_000,
            ..Run::driven(t_end)
        },
    )
    .unwrap();
    let last = &orbit.events[orbit.events.len().saturating_sub(6)..];
    assert_eq!(
        orbit.t_last(),
        t_end,
        "{}: {last:#?} {system:?}",
        orbit.stop.sentence()
    );
    let (n, contacts, width) = (system.masses(), system.contacts.len(), orbit.width());
    let energy = |x: &[f64], v: &[f64]| {
        0.5 * dot(v, &times_vector(&system.mass, v)) + 0.5 * dot(x, &times_vector(&system.stiffness, x))
    };
    let rows: Vec<&[f64]> = orbit.steps.chunks_exact(width).collect();
    let (mut work, mut size) = (0.0, 1.0);
    for (index, row) in rows.iter().enumerate() {
        let until = rows.get(index + 1).map_or(t_end, |next| next[0]);
        let half = 0.5 * (until - row[0]) / f64::from(PARTS);
        if half <= 1e-13 {
            continue;
        }
        for part in 0..PARTS {
            let middle = row[0] + half * f64::from(2 * part + 1);
            for (node, weight) in GAUSS
                .iter()
                .flat_map(|&(node, weight)| [(-node, weight), (node, weight)])
            {
                let t = middle + half * node;
                let states = orbit.states(&[t]);
                let (x, v) = (&states.x, &states.v);
                let mut power = -dot(v, &times_vector(&system.damping, v));
                for (c, contact) in system.contacts.iter().enumerate() {
                    let direction = row[2 + 2 * n + 4 * c];
                    let across = v[contact.mass] - contact.other.map_or(0.0, |other| v[other]);
                    power += states.force[c] * across;
                    if direction == 0.0 {
                        let static_limit = contact.law.static_limit(Rest::new(t_end, 0.0));
                        assert!(
                            states.force[c].abs() <= static_limit + 1e-12,
                            "overloaded at {t}: {system:?}"
                        );
                    } else {
                        assert!(direction * states.w[c] >= -1e-12, "backwards at {t}: {system:?}");
                        assert!(direction * states.force[c] >= -1e-12);
                    }
                }
                for force in &system.forcing {
                    power += force.amplitude * (force.frequency * t + force.phase).cos() * v[force.mass];
                }
                // The equation of motion itself.
                let inertia = times_vector(&system.mass, &states.a);
                let (spring, damper) = (
                    times_vector(&system.stiffness, x),
                    times_vector(&system.damping, v),
                );
                for i in 0..n {
                    let mut force = -spring[i] - damper[i];
                    for (c, contact) in system.contacts.iter().enumerate() {
                        force += match () {
                            () if contact.mass == i => states.force[c],
                            () if contact.other == Some(i) => -states.force[c],
                            () => 0.0,
                        };
                    }
                    for push in system.forcing.iter().filter(|push| push.mass == i) {
                        force += push.amplitude * (push.frequency * t + push.phase).cos();
                    }
                    assert!(
                        (inertia[i] - force).abs() < 1e-10 * (1.0 + force.abs()),
                        "at {t}: {system:?}"
                    );
                }
                work += weight * half * power;
                size = f64::max(size, energy(x, v));
            }
        }
    }
    let start = orbit.states(&[0.0]);
    let end = orbit.states(&[t_end]);
    assert_eq!(end.stuck.len(), contacts);
    (
        (energy(&end.x, &end.v) - energy(&start.x, &start.v) - work).abs(),
        size,
    )
}

/// Work of drives, forcing, friction and damping against the energy of the masses.
#[test]
fn energy_is_balanced_on_random_systems() {
    let mut dice = Dice(0x5eed);
    for number in 0..100 {
        let system = dice.system();
        let (error, size) = audit(&system, 40.0);
        assert!(
            error < 1e-9 * size,
            "system {number}: {error:.1e} of {size}: {system:?}"
        );
    }
}

/// The mass below a shaken drive may move slowly; the drive's own waves limit the steps all the same.
#[test]
fn slip_below_a_shaken_drive_ends_at_zero_slip_velocity() {
    let system = System {
        mass: vec![vec![2.693_569_150_682_007]],
        stiffness: vec![vec![0.600_140_905_714_352_1]],
        damping: vec![vec![0.216_732_819_946_588_02]],
        contacts: vec![Contact {
            mass: 0,
            other: None,
            drive_velocity: Drive {
                velocity: -0.425_062_055_513_408_5,
                harmonics: vec![Harmonic::new(
                    0.630_531_513_947_387_2,
                    1.522_414_315_874_116_8,
                    0.872_398_373_726_761_2,
                )],
                nodes: Vec::new(),
            },
            law: Coulomb::new(0.280_975_105_532_056_2).into(),
            normal_force: None,
        }],
        forcing: Vec::new(),
        springs: Vec::new(),
    };
    let run = Run {
        x0: Some(vec![-0.281_095_155_010_708_6]),
        v0: Some(vec![-0.373_812_131_063_937_74]),
        ..Run::driven(4.130_483_270_392_579)
    };
    let orbit = network::simulate(&system, run).unwrap();
    let wave = &system.contacts[0].drive_velocity;
    assert!(orbit.events.len() >= 3);
    for event in &orbit.events {
        let phase = wave.harmonics[0].frequency * event.t + wave.harmonics[0].phase;
        let drive = wave.velocity + wave.harmonics[0].amplitude * phase.cos();
        assert!(
            (drive - event.v).abs() < 1e-14,
            "w = {:e} at {}",
            drive - event.v,
            event.t
        );
    }
}
