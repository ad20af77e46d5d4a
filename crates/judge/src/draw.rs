//! Random documents, drawn to provoke: grazes, resonance, critical damping, forces one ulp apart, edges, scales, denormals.

use serde_json::{Value, json};

/// Marsaglia's xorshift with a multiplication (Vigna 2016), seeded by Steele's splitmix.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// The stream of one document of one seed.
    #[must_use]
    pub fn new(seed: u64, index: u64) -> Self {
        let mut random = Self(seed ^ index.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x5DEE_CE66_D1CE_4E5B);
        for _ in 0..4 {
            random.next();
        }
        random
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        bits ^ (bits >> 31)
    }

    /// Uniform between two numbers.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.next() >> 11) as f64 / 9_007_199_254_740_992.0)
    }

    /// Uniform in the logarithm, decades.
    pub fn decades(&mut self, low: f64, high: f64) -> f64 {
        10f64.powf(self.within(low, high))
    }

    /// One of `count`.
    pub fn one_of(&mut self, count: usize) -> usize {
        usize::try_from(self.next() >> 33).unwrap_or(0) % count
    }

    /// One of these.
    fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.one_of(of.len())]
    }

    /// True so often.
    pub fn chance(&mut self, share: f64) -> bool {
        self.within(0.0, 1.0) < share
    }

    fn sign(&mut self) -> f64 {
        if self.chance(0.5) { 1.0 } else { -1.0 }
    }
}

/// The names of the laws an oscillator is drawn with.
pub const LAWS: [&str; 14] = [
    "Coulomb",
    "StaticKinetic",
    "PiecewiseLinear",
    "DwellTime",
    "LogarithmicDwell",
    "ForceRate",
    "Tabulated",
    "TwoBranch",
    "Rational",
    "Cubic",
    "ExponentialStribeck",
    "Lorentzian",
    "PoppStelter",
    "BogaczRyczek",
];

/// Units of force, velocity and time.
#[derive(Clone, Copy)]
struct Units {
    force: f64,
    velocity: f64,
    time: f64,
}

const PLAIN: Units = Units {
    force: 1.0,
    velocity: 1.0,
    time: 1.0,
};

impl Units {
    fn length(self) -> f64 {
        self.velocity * self.time
    }
    fn mass(self) -> f64 {
        self.force * self.time / self.velocity
    }
    fn stiffness(self) -> f64 {
        self.force / self.length()
    }
    fn damping(self) -> f64 {
        self.force / self.velocity
    }
}

/// What lies above a force: it itself, an ulp, a rounding, or something to see.
fn above(random: &mut Random, force: f64) -> f64 {
    match random.one_of(6) {
        0 => force,
        1 => force.next_up(),
        2 => force * (1.0 + random.decades(-15.0, -3.0)),
        _ => force * random.within(1.0, 2.0),
    }
}

fn table(random: &mut Random, units: Units, first: f64) -> Vec<[f64; 2]> {
    let mut nodes = vec![[0.0, first]];
    let mut speed = 0.0;
    for _ in 0..=random.one_of(3) {
        speed += units.velocity
            * if random.chance(0.05) {
                random.decades(-10.0, 0.0)
            } else {
                random.within(0.03, 0.7)
            };
        nodes.push([speed, units.force * random.within(0.2, 1.2)]);
    }
    nodes
}

fn law(random: &mut Random, name: &str, units: Units) -> Value {
    let force = |value: f64| value * units.force;
    let low = force(random.within(0.1, 1.0));
    let high = above(random, low);
    match name {
        "Coulomb" => json!({"type": name, "kinetic": low}),
        "StaticKinetic" => json!({"type": name, "break_away": high, "kinetic": low}),
        "PiecewiseLinear" => {
            let mut nodes = table(random, units, low);
            let last = nodes[nodes.len() - 1];
            nodes.push([
                last[0] + 0.1 * units.velocity,
                last[1] + random.within(0.0, 0.1) * units.force,
            ]);
            json!({"type": name, "nodes": nodes, "break_away": high})
        }
        "DwellTime" | "ForceRate" => {
            let exponent = [1.0, 0.36, 0.67, 1.5][random.one_of(4)];
            let mut document = json!({
                "type": name, "kinetic": low, "limit": force(random.within(0.0, 1.0)),
                "rate": random.decades(-2.0, 1.0) * units.time.powf(-exponent), "exponent": exponent,
            });
            if name == "ForceRate" {
                document["force_rate_scale"] = json!(random.decades(-2.0, 1.0) * units.force / units.time);
                document["force_rate_exponent"] = json!([1.0, 2.0, 0.5][random.one_of(3)]);
            }
            document
        }
        "LogarithmicDwell" => json!({
            "type": name, "kinetic": low, "growth": force(random.decades(-2.5, -0.3)), "onset": random.decades(-2.0, 1.0) * units.time,
        }),
        "Tabulated" => {
            let mut nodes = vec![[0.0, high]];
            for index in 0..=random.one_of(4) {
                let gap = random.within(0.1, 2.0) * units.time;
                nodes.push([
                    nodes[index][0] + gap,
                    nodes[index][1] + force(random.within(0.0, 0.2)),
                ]);
            }
            let kinetic = if random.chance(0.4) {
                json!(low)
            } else {
                json!(table(random, units, low))
            };
            json!({"type": name, "kinetic": kinetic, "break_away": nodes})
        }
        "TwoBranch" => {
            let other = force(random.within(0.1, 1.0));
            let (rising, falling) = (table(random, units, low), table(random, units, other));
            let most = rising[0][1].max(falling[0][1]);
            json!({"type": name, "rising": rising, "falling": falling, "break_away": above(random, most)})
        }
        "BogaczRyczek" => {
            let calibrated = random.chance(0.5);
            let (surface, alpha) = if calibrated {
                // The calibration of `docs/paper-law.md`.
                let surface = json!({
                    "initial": 0.68, "drop": 1.24, "drop_scale": 0.3695, "drop_exponent": 10.0, "limit": 0.39, "rate": 0.3,
                    "force_rate_scale": 0.5,
                });
                (surface, json!([[1.9, 0.0], [2.9, 1.7]]))
            } else {
                let surface = json!({
                    "initial": random.within(1.0, 1.1), "limit": random.within(0.0, 0.3), "rate": random.within(0.1, 2.0),
                    "force_rate_scale": random.decades(-0.7, 0.3), "second_drop": random.within(0.0, 0.4),
                    "second_drop_scale": random.within(0.2, 0.4), "second_drop_exponent": random.within(2.0, 8.0),
                });
                (surface, json!(random.within(0.0, 0.05)))
            };
            let beta = random.within(0.005, 0.02);
            json!({
                "type": name, "static_friction": surface, "A": null, "B": [-0.41, 1.33], "C": null, "D": [0.33, 2.4],
                "l": [3.41, -0.28], "alpha": alpha, "beta": beta, "phi": -58.0, "psi": 39.0, "eta": 89.0,
                "upper_turn": if random.chance(0.3) { "back" } else { "down" },
            })
        }
        "Dahl" | "LuGre" | "ElastoPlastic" | "BoucWen" | "RateState" | "Regularised" => {
            state_law(random, name, units)
        }
        "Rational" => {
            json!({"type": name, "break_away": low, "weakening": random.decades(-1.0, 1.5) / units.velocity})
        }
        "Cubic" => {
            let (deep, at) = (
                low * random.within(0.1, 0.9),
                random.within(0.2, 2.0) * units.velocity,
            );
            json!({"type": name, "static": low, "linear": 1.5 * deep / at, "cubic": 0.5 * deep / (at * at * at)})
        }
        "ExponentialStribeck" | "Lorentzian" => {
            let mut document = json!({
                "type": name, "break_away": high, "kinetic": low, "scale": random.decades(-2.0, 0.5) * units.velocity,
                "viscous": random.within(0.0, 0.3) * units.damping(),
            });
            if name == "ExponentialStribeck" {
                document["exponent"] = json!([1.0, 2.0][random.one_of(2)]);
            }
            document
        }
        _ => json!({
            "type": name, "break_away": high, "kinetic": low, "weakening": random.decades(-1.0, 1.5) / units.velocity,
            "square": random.within(0.0, 0.05) * units.force / (units.velocity * units.velocity),
        }),
    }
}

/// The names of the laws with an internal state.
pub const STATE_LAWS: [&str; 6] = [
    "Dahl",
    "LuGre",
    "ElastoPlastic",
    "BoucWen",
    "RateState",
    "Regularised",
];

/// A law with an internal state, from soft bristles to stiff ones, with forces, speeds and times of the units.
fn state_law(random: &mut Random, name: &str, units: Units) -> Value {
    let force = units.force * random.within(0.1, 1.0);
    // The way over which the contact yields, far shorter as a rule than that of the structure.
    let way = units.length() * random.decades(-5.0, -0.5);
    let stiffness = force / way;
    match name {
        "Dahl" => json!({
            "type": name, "stiffness": stiffness, "kinetic": force, "exponent": random.pick(&[1.0, 1.0, 2.0, 1.5, 0.5]),
        }),
        "BoucWen" => {
            // Its largest displacement is the way, for A = 1.
            let exponent = random.pick(&[1.0, 2.0, 1.5, 3.0]);
            let (amplitude, share) = (
                if random.chance(0.5) {
                    1.0
                } else {
                    random.decades(-1.0, 1.0)
                },
                random.within(-0.4, 0.5),
            );
            let both = amplitude * way.powf(-exponent);
            json!({
                "type": name, "stiffness": stiffness, "beta": both * (1.0 - share), "gamma": both * share, "exponent": exponent,
                "amplitude": amplitude,
            })
        }
        "LuGre" | "ElastoPlastic" => {
            let inertia = units.mass();
            let break_away = above(random, force);
            let mut document = json!({
                "type": name, "stiffness": stiffness, "kinetic": force, "break_away": break_away,
                "damping": if random.chance(0.2) { 0.0 } else { random.decades(-2.0, 0.3) * (stiffness * inertia).sqrt() },
                "viscous": if random.chance(0.4) { 0.0 } else { random.within(0.0, 0.5) * units.damping() },
                "scale": random.decades(-3.0, 0.3) * units.velocity, "exponent": random.pick(&[2.0, 2.0, 1.0, 1.5, 0.5]),
            });
            if name == "ElastoPlastic" {
                document["elastic"] = json!(
                    force * {
                        let share = random.within(0.0, 1.0);
                        random.pick(&[0.0, 0.9, share])
                    }
                );
            }
            document
        }
        "RateState" => {
            let a = random.decades(-2.0, -0.3);
            let velocity = units.velocity * random.decades(-3.0, 0.5);
            let mut document = json!({
                "type": name, "normal_force": units.force * random.within(0.5, 2.0), "a": a, "b": a * random.within(0.0, 2.5),
                "length": units.length() * random.decades(-3.0, 0.5), "reference_velocity": velocity,
                // How steep it is at rest, exp(μ₀/a), is what no double bears beyond some size.
                "reference_friction": a * random.within(1.0, 25.0),
                "law": random.pick(&["aging", "slip", "perrin-rice-zheng", "composite"]),
            });
            if document["law"] == "composite" {
                document["cutoff_velocity"] = json!(velocity * random.decades(-2.0, 2.0));
            }
            if random.chance(0.3) {
                document["second_b"] = json!(a * random.within(-0.5, 1.5));
                document["second_length"] = json!(units.length() * random.decades(-3.0, 0.5));
            }
            document
        }
        _ => {
            let smooth = [
                "Coulomb",
                "StaticKinetic",
                "PiecewiseLinear",
                "Rational",
                "Cubic",
                "ExponentialStribeck",
                "Lorentzian",
                "PoppStelter",
            ];
            let inner = random.pick(&smooth);
            json!({
                "type": name, "law": law(random, inner, units), "width": units.velocity * random.decades(-5.0, -0.5),
                "shape": random.pick(&["arctan", "tanh"]),
            })
        }
    }
}

fn units(random: &mut Random) -> Units {
    if random.chance(0.7) {
        return PLAIN;
    }
    let wide = if random.chance(0.8) { 4.0 } else { 9.0 };
    Units {
        force: random.decades(-wide, wide),
        velocity: random.decades(-wide, wide),
        time: random.decades(-wide, wide),
    }
}

fn waves(random: &mut Random, units: Units, natural: f64, amplitude: f64) -> Vec<Value> {
    let count = [1, 1, 2, 4][random.one_of(4)];
    let mut frequencies: Vec<f64> = Vec::new();
    for _ in 0..count {
        let frequency = match random.one_of(8) {
            0 => natural * (1.0 + random.sign() * random.decades(-8.0, -1.0)),
            1 => natural * random.decades(-2.0, -0.5),
            2 => natural * random.decades(0.5, 1.5),
            3 if !frequencies.is_empty() => frequencies[0].next_up(),
            _ => natural * random.within(0.2, 3.0),
        };
        frequencies.push(frequency);
    }
    frequencies
        .iter()
        .map(|frequency| {
            let amplitude = amplitude
                * units.force
                * if random.chance(0.1) {
                    random.decades(-12.0, 0.0)
                } else {
                    random.within(0.0, 0.6)
                };
            json!({"amplitude": amplitude, "frequency": frequency, "phase": random.within(0.0, 6.3)})
        })
        .collect()
}

/// Most runs are short, for many different ones; some are long.
fn stretch(random: &mut Random) -> f64 {
    if random.chance(0.01) { 20.0 } else { 1.0 }
}

/// One mass on one drive.
#[must_use]
pub fn oscillator(seed: u64, index: u64) -> Value {
    let mut random = Random::new(seed, index);
    let random = &mut random;
    let name = LAWS[random.one_of(LAWS.len())];
    // The angles of the paper's law are of dimensionless numbers.
    let units = if name == "BogaczRyczek" {
        PLAIN
    } else {
        units(random)
    };
    let (mut mass, mut stiffness) = (random.within(0.5, 2.0), random.within(0.3, 3.0));
    if random.chance(0.15) {
        stiffness *= random.decades(-6.0, 4.0);
    }
    if random.chance(0.1) {
        mass *= random.decades(-4.0, 4.0);
    }
    let natural = (stiffness / mass).sqrt();
    let critical = 2.0 * (stiffness * mass).sqrt();
    let damping = match random.one_of(10) {
        0 | 1 => 0.0,
        2 => critical * (1.0 + random.sign() * random.decades(-16.0, -2.0)),
        3 => critical * random.decades(-5.0, -2.0),
        4 => critical * random.decades(0.0, 3.5),
        _ => critical * random.within(0.0, 0.4),
    };
    let speed = random.sign()
        * match random.one_of(12) {
            0 => 0.0,
            1 => random.decades(-12.0, -2.0),
            2 if random.chance(0.1) => 5e-324,
            3 => random.decades(0.0, 2.0),
            _ => random.within(0.02, 1.5),
        };
    let law = law(random, name, units);
    let natural_here = natural / units.time;
    let forcing = if random.chance(0.45) {
        waves(random, units, natural_here, 1.0)
    } else {
        Vec::new()
    };
    let (mass, stiffness, damping) = (
        mass * units.mass(),
        stiffness * units.stiffness(),
        damping * units.damping(),
    );
    let speed = speed * units.velocity;
    let at_rest = ["break_away", "kinetic", "static"]
        .iter()
        .find_map(|key| law[key].as_f64());
    let at_rest = at_rest.unwrap_or(units.force);
    let (x0, v0) = match random.one_of(10) {
        0 => (0.0, None),
        // Stuck, at the edge of what adhesion bears.
        1 => ((random.sign() * at_rest - damping * speed) / stiffness, None),
        2 => (
            (random.sign() * at_rest * (1.0 + random.sign() * random.decades(-16.0, -8.0)) - damping * speed)
                / stiffness,
            None,
        ),
        // Slip that just reaches the drive, or just not, were it undamped and unforced.
        3 | 4 => {
            let swing = (speed * (1.0 + random.sign() * random.decades(-15.0, -3.0))).abs() / natural_here;
            let angle = random.within(0.0, 6.3);
            let centre =
                law["kinetic"].as_f64().unwrap_or(at_rest) * if speed < 0.0 { -1.0 } else { 1.0 } / stiffness;
            (
                centre + swing * angle.cos(),
                Some(-swing * natural_here * angle.sin()),
            )
        }
        5 => (
            random.within(-2.0, 2.0) * at_rest / stiffness,
            Some(speed * (1.0 + random.sign() * random.decades(-16.0, -6.0))),
        ),
        6 if random.chance(0.2) => (random.sign() * 1e-310, Some(random.sign() * 3e-320)),
        _ => (
            random.within(-2.0, 2.0) * units.length(),
            Some(random.within(-2.0, 2.0) * units.velocity),
        ),
    };
    let t_end = random.within(0.3, 4.0) * 6.3 / natural_here * stretch(random);
    let mut system = json!({
        "mass": mass, "stiffness": stiffness, "damping": damping, "drive_velocity": speed, "law": law,
    });
    if !forcing.is_empty() {
        system["forcing"] = json!(forcing);
    }
    let mut case = json!({"sys": system, "x0": x0, "v0": v0, "t_end": t_end});
    if random.chance(0.2) {
        case["engine"] = json!("series");
    }
    case
}

fn drive(random: &mut Random, units: Units) -> Value {
    let speed = units.velocity
        * random.sign()
        * if random.chance(0.1) {
            random.decades(-9.0, -1.0)
        } else {
            random.within(0.0, 1.2)
        };
    match random.one_of(6) {
        0 => {
            // A table, reversing as a rule.
            let mut t = 0.0;
            let nodes: Vec<[f64; 2]> = (0..2 + random.one_of(5))
                .map(|_| {
                    t += random.within(0.3, 8.0) * units.time;
                    [
                        t,
                        units.velocity * [0.0, 1.0, -1.0, random.within(-1.0, 1.0)][random.one_of(4)],
                    ]
                })
                .collect();
            json!({"velocity": if random.chance(0.5) { 0.0 } else { speed }, "nodes": nodes})
        }
        1 => json!({
            "velocity": speed,
            "harmonics": [{"amplitude": units.velocity * random.within(0.0, 1.0), "frequency": random.within(0.2, 3.0) / units.time, "phase": random.within(0.0, 6.3)}],
        }),
        _ => json!(speed),
    }
}

/// A law with a memory that is another's, or one that differs between the directions.
fn composed(random: &mut Random, units: Units) -> Value {
    let plain = [
        "StaticKinetic",
        "PiecewiseLinear",
        "DwellTime",
        "LogarithmicDwell",
        "Tabulated",
        "Rational",
        "ExponentialStribeck",
    ];
    let side = |random: &mut Random| {
        let name = random.pick(&plain);
        law(random, name, units)
    };
    if random.chance(0.5) {
        return json!({"type": "Asymmetric", "forward": side(random), "backward": side(random)});
    }
    let name = random.pick(&[
        "PiecewiseLinear",
        "Rational",
        "ExponentialStribeck",
        "Lorentzian",
        "Cubic",
    ]);
    let kinetic = law(random, name, units);
    let name = random.pick(&["DwellTime", "ForceRate", "LogarithmicDwell"]);
    let mut at_rest = law(random, name, units);
    // What adhesion bears must not lie below what slip begins with.
    let nodes = kinetic["nodes"][0][1].as_f64();
    let from = nodes
        .or(kinetic["break_away"].as_f64())
        .or(kinetic["static"].as_f64());
    at_rest["kinetic"] = json!(above(random, from.unwrap_or(units.force)));
    json!({"type": "Combined", "static": at_rest, "kinetic": kinetic})
}

/// A drive that is at once a table and several waves.
fn busy_drive(random: &mut Random, units: Units) -> Value {
    let mut drive = json!({"velocity": units.velocity * random.within(-1.0, 1.0)});
    if random.chance(0.6) {
        let mut t = 0.0;
        let nodes: Vec<[f64; 2]> = (0..2 + random.one_of(4))
            .map(|_| {
                t += random.decades(-2.0, 0.9) * units.time;
                [t, units.velocity * random.within(-1.0, 1.0)]
            })
            .collect();
        drive["nodes"] = json!(nodes);
    }
    drive["harmonics"] = json!(waves(
        random,
        Units {
            force: units.velocity,
            ..units
        },
        1.0 / units.time,
        1.0
    ));
    drive
}

/// What the other draws leave out: laws composed of others, busy drives and normal forces, inclines, masses that are coupled by
/// inertia or lie decades apart, contacts and springs between any two of them, masses on no spring.
#[must_use]
pub fn further(seed: u64, index: u64) -> Value {
    let mut random = Random::new(seed ^ 0x00F0_47E4, index);
    let random = &mut random;
    let units = units(random);
    let n = [1, 1, 2, 3, 4][random.one_of(5)];
    let (mut mass, mut stiffness, mut damping) = (
        vec![vec![0.0; n]; n],
        vec![vec![0.0; n]; n],
        vec![vec![0.0; n]; n],
    );
    let apart = if random.chance(0.3) { 3.0 } else { 0.4 };
    for i in 0..n {
        mass[i][i] = random.decades(-apart, apart) * units.mass();
    }
    if n > 1 && random.chance(0.3) {
        let coupling = random.within(-0.6, 0.6) * (mass[0][0] * mass[1][1]).sqrt();
        (mass[0][1], mass[1][0]) = (coupling, coupling);
    }
    let damped = random.pick(&[0.0, 0.02, 0.5]);
    for i in 0..n {
        for j in 0..=i {
            if i == j && i > 0 && random.chance(0.3) || i != j && random.chance(0.4) {
                continue;
            }
            let [k, d] = [
                random.decades(-1.0, 0.5) * units.stiffness(),
                damped * random.within(0.0, 1.0) * units.damping(),
            ];
            for (matrix, value) in [(&mut stiffness, k), (&mut damping, d)] {
                matrix[i][i] += value;
                if i != j {
                    matrix[j][j] += value;
                    matrix[i][j] -= value;
                    matrix[j][i] -= value;
                }
            }
        }
    }
    let pressed = random.chance(0.4);
    let mut contacts = Vec::new();
    for i in 0..n {
        let mut contact = json!({"mass": i});
        if i > 0 && random.chance(0.3) {
            contact["other"] = json!(random.one_of(i));
            if random.chance(0.3) {
                contact["drive_velocity"] = drive(random, units);
            }
        } else if i == 0 || random.chance(0.7) {
            contact["drive_velocity"] = if random.chance(0.5) {
                busy_drive(random, units)
            } else {
                drive(random, units)
            };
        } else {
            continue;
        }
        contact["law"] = match random.one_of(4) {
            0 if n == 1 => law(random, "TwoBranch", units),
            0 | 1 => {
                let name = choose(random);
                law(random, name, units)
            }
            _ => composed(random, units),
        };
        // What a law remembers of forces has no meaning where they are scaled.
        let law = contact["law"].to_string();
        if pressed && !law.contains("ForceRate") && !law.contains("TwoBranch") {
            let mut normal = normal_force(random, units);
            if random.chance(0.4) {
                normal["harmonics"] = json!(waves(
                    random,
                    Units { force: 1.0, ..units },
                    1.0 / units.time,
                    1.0
                ));
            }
            contact["normal_force"] = normal;
        }
        contacts.push(contact);
    }
    let mut forcing = Vec::new();
    if random.chance(0.5) {
        // Weight along an incline.
        forcing.push(json!({"mass": random.one_of(n), "amplitude": units.force * random.within(-1.0, 1.0), "frequency": 0.0}));
    }
    if random.chance(0.4) {
        for mut wave in waves(random, units, 1.0 / units.time, 1.0) {
            wave["mass"] = json!(random.one_of(n));
            forcing.push(wave);
        }
    }
    let mut springs = Vec::new();
    while random.chance(0.35) {
        let mut spring = spring(random, units);
        let one = random.one_of(n);
        spring["mass"] = json!(one);
        if one > 0 && random.chance(0.4) {
            spring["other"] = json!(random.one_of(one));
        }
        springs.push(spring);
    }
    let state = |random: &mut Random, unit: f64| -> Vec<f64> {
        (0..n).map(|_| random.within(-1.0, 1.0) * unit).collect()
    };
    let x0 = if random.chance(0.2) {
        vec![0.0; n]
    } else {
        state(random, units.length())
    };
    let v0 = if random.chance(0.4) {
        Value::Null
    } else {
        json!(state(random, units.velocity))
    };
    json!({
        "sys": {"mass": mass, "stiffness": stiffness, "damping": damping, "contacts": contacts, "forcing": forcing, "springs": springs},
        "x0": x0, "v0": v0, "t_end": random.within(2.0, 15.0) * units.time * stretch(random),
    })
}

/// One to six masses in a chain, on drives and on each other.
#[must_use]
pub fn system(seed: u64, index: u64) -> Value {
    chain(seed, index, 6, choose)
}

/// A law that any contact may have: branches by the sense of the slip acceleration are for one mass.
fn choose(random: &mut Random) -> &'static str {
    loop {
        let name = LAWS[random.one_of(LAWS.len())];
        if name != "TwoBranch" && name != "BogaczRyczek" {
            return name;
        }
    }
}

/// One to four masses under laws with an internal state; some under normal forces that vary and on springs that bend.
#[must_use]
pub fn state(seed: u64, index: u64) -> Value {
    let choose = |random: &mut Random| STATE_LAWS[random.one_of(STATE_LAWS.len())];
    let mut random = Random::new(seed ^ 0x0057_A7E5, index);
    let random = &mut random;
    let most = if random.chance(0.5) { 1 } else { 4 };
    let mut case = chain(seed ^ 0x57A7, index, most, choose);
    if random.chance(0.4) {
        case = load(case, random);
    }
    let n = case["sys"]["mass"].as_array().map_or(1, Vec::len);
    match random.one_of(4) {
        // With the drives, where nothing slips.
        0 => case["v0"] = Value::Null,
        1 => case["x0"] = json!(vec![0.0; n]),
        _ => {}
    }
    case["t_end"] = json!(case["t_end"].as_f64().unwrap_or(1.0) * 0.5);
    case["tolerance"] = json!([1e-6, 1e-8, 1e-9][random.one_of(3)]);
    case
}

fn chain(seed: u64, index: u64, most: usize, choose: fn(&mut Random) -> &'static str) -> Value {
    let mut random = Random::new(seed ^ 0xABCD_EF01, index);
    let random = &mut random;
    let units = units(random);
    let n = 1 + random.one_of(most);
    let mut stiffness = vec![vec![0.0; n]; n];
    let mut damping = vec![vec![0.0; n]; n];
    let light = [0.0, 0.02, 0.3, 3.0][random.one_of(4)];
    let mut join = |i: usize, j: usize, k: f64, d: f64| {
        for (matrix, value) in [
            (&mut stiffness, k * units.stiffness()),
            (&mut damping, d * units.damping()),
        ] {
            matrix[i][i] += value;
            if i != j {
                matrix[j][j] += value;
                matrix[i][j] -= value;
                matrix[j][i] -= value;
            }
        }
    };
    for i in 0..n {
        join(i, i, random.within(0.2, 2.0), light * random.within(0.0, 1.0));
        if i > 0 {
            join(i - 1, i, random.within(0.1, 3.0), light * random.within(0.0, 1.0));
        }
    }
    if random.chance(0.08) {
        damping[0][0] -= units.damping() * random.within(0.0, 0.1);
    }
    let mut mass = vec![vec![0.0; n]; n];
    for (i, row) in mass.iter_mut().enumerate() {
        row[i] = random.within(0.3, 3.0) * units.mass();
    }
    let mut contacts = Vec::new();
    for i in 0..n {
        if i == 0 || random.chance(0.6) {
            let name = choose(random);
            contacts.push(
                json!({"mass": i, "drive_velocity": drive(random, units), "law": law(random, name, units)}),
            );
        } else if random.chance(0.5) {
            let name = choose(random);
            contacts.push(json!({"mass": i, "other": i - 1, "law": law(random, name, units)}));
        }
    }
    let mut forcing = Vec::new();
    if random.chance(0.4) {
        for mut wave in waves(random, units, 1.0 / units.time, 1.0) {
            wave["mass"] = json!(random.one_of(n));
            forcing.push(wave);
        }
    }
    let state = |random: &mut Random, unit: f64| -> Vec<f64> {
        (0..n).map(|_| random.within(-1.0, 1.0) * unit).collect()
    };
    let x0 = state(random, units.length());
    let v0 = if random.chance(0.5) {
        json!(state(random, units.velocity))
    } else {
        json!(vec![0.0; n])
    };
    json!({
        "sys": {"mass": mass, "stiffness": stiffness, "damping": damping, "contacts": contacts, "forcing": forcing},
        "x0": x0, "v0": v0, "t_end": random.within(2.0, 20.0) * units.time * stretch(random),
    })
}

/// A normal force that varies with time, position and velocity: over it, at it and below zero now and then, or just touching.
fn normal_force(random: &mut Random, units: Units) -> Value {
    let constant = [1.0, 1.0, 1.0, 0.0, -0.3][random.one_of(5)];
    let mut normal = json!({"constant": constant});
    if random.chance(0.7) {
        let amplitude = match random.one_of(4) {
            // It comes down to zero, or almost, or within rounding.
            0 => constant,
            1 => constant * (1.0 + random.sign() * random.decades(-15.0, -3.0)),
            _ => random.within(0.0, 1.6),
        };
        let frequency = random.decades(-1.0, 1.0) / units.time;
        let phase = if random.chance(0.2) {
            0.0
        } else {
            random.within(0.0, 6.3)
        };
        normal["harmonics"] = json!([{"amplitude": amplitude, "frequency": frequency, "phase": phase}]);
    }
    for (name, unit) in [("position", units.length()), ("velocity", units.velocity)] {
        if random.chance(0.4) {
            normal[name] = json!(random.sign() * random.decades(-2.0, 0.3) / unit);
        }
    }
    normal
}

/// A stop with a gap, a spring that softens or hardens by pieces, a cubic one.
fn spring(random: &mut Random, units: Units) -> Value {
    let (length, force) = (units.length(), units.force);
    let gap = random.decades(-1.5, 0.3);
    let steep = random.decades(-1.0, 3.5);
    let nodes: Vec<[f64; 2]> = match random.one_of(4) {
        0 => vec![[-1.0, 0.0], [gap, 0.0], [gap + 1.0, steep]],
        1 => vec![[-gap - 1.0, -steep], [-gap, 0.0], [gap, 0.0], [gap + 1.0, steep]],
        2 => Vec::new(),
        _ => {
            let mut at = [-1.5, random.within(-1.5, 1.0)];
            let mut nodes = vec![at];
            for _ in 0..=random.one_of(4) {
                let step = random.decades(-2.0, 0.0);
                at = [at[0] + step, at[1] + step * random.within(-0.2, 3.0)];
                nodes.push(at);
            }
            // Beyond its ends it must hold what the others hold.
            nodes.push([at[0] + 0.5, at[1] + random.within(0.0, 2.0)]);
            nodes.insert(0, [-2.0, nodes[0][1] - random.within(0.0, 2.0)]);
            nodes
        }
    };
    let nodes: Vec<[f64; 2]> = nodes
        .iter()
        .map(|node| [node[0] * length, node[1] * force])
        .collect();
    let mut spring = json!({});
    if nodes.is_empty() || random.chance(0.2) {
        spring["cubic"] = json!(random.decades(-2.0, 1.5) * force / (length * length * length));
    }
    if !nodes.is_empty() {
        spring["nodes"] = json!(nodes);
    }
    spring
}

/// One to three masses under normal forces that vary, and on springs that bend.
#[must_use]
pub fn loaded(seed: u64, index: u64) -> Value {
    let case = chain(seed ^ 0x10AD, index, 3, choose);
    load(case, &mut Random::new(seed ^ 0x1357_9BDF, index))
}

/// Normal forces that vary and springs that bend, for a chain.
fn load(mut case: Value, random: &mut Random) -> Value {
    let size = |value: &Value| value.as_f64().unwrap_or(1.0).abs();
    let sys = &mut case["sys"];
    // The units it was drawn in, as far as they show.
    let (mass, stiffness) = (size(&sys["mass"][0][0]), size(&sys["stiffness"][0][0]));
    let law = &sys["contacts"][0]["law"];
    let forces = ["break_away", "kinetic", "static"]
        .iter()
        .find_map(|key| law[key].as_f64());
    let force = forces.unwrap_or((mass * stiffness).sqrt());
    let time = (mass / stiffness).sqrt();
    let units = Units {
        force,
        time,
        velocity: force / stiffness / time,
    };
    let n = sys["mass"].as_array().map_or(1, Vec::len);
    if let Some(contacts) = sys["contacts"].as_array_mut() {
        for contact in contacts {
            // What a law remembers of forces has no meaning where they are scaled.
            if contact["law"]["type"] != "ForceRate" && random.chance(0.7) {
                contact["normal_force"] = normal_force(random, units);
            }
        }
    }
    let mut springs = Vec::new();
    for mass in 0..n {
        if random.chance(0.4) {
            let mut spring = spring(random, units);
            spring["mass"] = json!(mass);
            if mass > 0 && random.chance(0.4) {
                spring["other"] = json!(mass - 1);
            }
            springs.push(spring);
        }
    }
    if random.chance(0.2) {
        // A start on a node.
        let on = springs
            .first()
            .map(|spring| [spring["mass"].clone(), spring["nodes"][1][0].clone()]);
        if let Some([mass, node]) = on
            && springs[0]["other"].is_null()
            && !node.is_null()
        {
            case["x0"][usize::try_from(mass.as_u64().unwrap_or(0)).unwrap_or(0)] = node;
        }
    }
    case["sys"]["springs"] = json!(springs);
    case
}
