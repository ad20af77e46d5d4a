//! What the other draws leave out.

use super::laws::{choose, composed, law};
use super::random::{Random, Units, units};
use super::{drive, normal_force, spring, stretch, waves};
use serde_json::{Value, json};

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
