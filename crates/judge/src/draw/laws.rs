//! Random friction laws.

use super::random::{Random, Units, above};
use serde_json::{Value, json};

/// The names of the laws an oscillator is drawn with.
pub(super) const LAWS: [&str; 14] = [
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

/// Low polynomials through what is drawn, with corners between them, or high ones through a smooth function.
fn polynomials(random: &mut Random, units: Units, low: f64) -> Value {
    let pieces = 1 + random.one_of(3);
    let degree = random.pick(&[2, 3, 4, 4, 8, 16]);
    let (fall, scale) = (
        low * random.within(-0.5, 1.0),
        units.velocity * random.decades(-1.3, 0.3),
    );
    let rise = random.within(0.0, 0.3) * units.damping();
    let mut nodes = vec![[0.0, low + fall]];
    for _ in 0..pieces {
        let from = nodes[nodes.len() - 1][0];
        let width = units.velocity * random.decades(-1.5, 0.3);
        for i in 1..=degree {
            let share = 0.5 - 0.5 * (std::f64::consts::PI * f64::from(i) / f64::from(degree)).cos();
            let u = from + width * share;
            let force = if degree < 8 {
                units.force * random.within(0.2, 1.2)
            } else {
                low + fall * (-u / scale).exp() + rise * u
            };
            nodes.push([u, force]);
        }
    }
    let break_away = above(random, nodes[0][1]);
    json!({"type": "PiecewisePolynomial", "nodes": nodes, "break_away": break_away, "degree": degree})
}

pub(super) fn law(random: &mut Random, name: &str, units: Units) -> Value {
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
        "PiecewisePolynomial" => polynomials(random, units, low),
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
pub(super) const STATE_LAWS: [&str; 6] = [
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

/// A law with a memory that is another's, or one that differs between the directions.
pub(super) fn composed(random: &mut Random, units: Units) -> Value {
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

/// A law that any contact may have: branches by the sense of the slip acceleration are for one mass.
pub(super) fn choose(random: &mut Random) -> &'static str {
    loop {
        let name = LAWS[random.one_of(LAWS.len())];
        if name != "TwoBranch" && name != "BogaczRyczek" {
            return name;
        }
    }
}
