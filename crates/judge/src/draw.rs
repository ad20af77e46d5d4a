//! Random documents, drawn to provoke: grazes, resonance, critical damping, forces one ulp apart, edges, scales, denormals.

mod further;
mod laws;
mod random;

use serde_json::{Value, json};

pub use further::further;
use laws::{LAWS, STATE_LAWS, choose, law};
pub use random::Random;
use random::{PLAIN, Units, units};

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
    one_mass(&mut Random::new(seed, index), |random| {
        LAWS[random.one_of(LAWS.len())]
    })
}

/// One mass or up to three under friction by polynomials, some under normal forces that vary and on springs that bend.
#[must_use]
pub fn polynomial(seed: u64, index: u64) -> Value {
    let seed = seed ^ 0x0901_1CA5;
    let mut random = Random::new(seed, index);
    let choose = |_: &mut Random| "PiecewisePolynomial";
    match random.one_of(4) {
        0 => chain(seed, index, 3, choose),
        1 => load(chain(seed, index, 3, choose), &mut random),
        _ => one_mass(&mut random, choose),
    }
}

fn one_mass(random: &mut Random, choose: fn(&mut Random) -> &'static str) -> Value {
    let name = choose(random);
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

/// One to six masses in a chain, on drives and on each other.
#[must_use]
pub fn system(seed: u64, index: u64) -> Value {
    chain(seed, index, 6, choose)
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
