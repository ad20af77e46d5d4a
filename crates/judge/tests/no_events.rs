//! Long forced runs that can have no event have none, for every law and both engines.

use serde_json::{Value, json};
use stickslip_judge::problem::Problem;
use stickslip_judge::report::run;

/// One of each law; at rest each bears 0.6 at least, in slip each gives between 0.2 and 0.9 up to a slip speed of 8.
fn laws() -> Vec<Value> {
    let table = json!([[0.0, 0.6], [0.1, 0.5], [0.3, 0.4]]);
    vec![
        json!({"type": "Coulomb", "kinetic": 0.6}),
        json!({"type": "StaticKinetic", "break_away": 0.6, "kinetic": 0.5}),
        json!({"type": "PiecewiseLinear", "nodes": [[0.0, 0.6], [0.2, 0.4], [0.3, 0.41]], "break_away": 0.6}),
        json!({"type": "DwellTime", "kinetic": 0.6, "limit": 0.3, "rate": 0.4}),
        json!({"type": "LogarithmicDwell", "kinetic": 0.6, "growth": 0.05, "onset": 0.5}),
        json!({"type": "ForceRate", "kinetic": 0.6, "limit": 0.3, "rate": 0.4, "force_rate_scale": 0.3}),
        json!({"type": "Tabulated", "kinetic": table, "break_away": [[0.0, 0.6], [2.0, 0.8]]}),
        json!({"type": "TwoBranch", "rising": table, "falling": [[0.0, 0.5], [0.3, 0.4]], "break_away": 0.6}),
        json!({"type": "Rational", "break_away": 0.6, "weakening": 0.2}),
        json!({"type": "Cubic", "static": 0.6, "linear": 0.05, "cubic": 0.001}),
        json!({"type": "ExponentialStribeck", "break_away": 0.6, "kinetic": 0.4, "scale": 0.5, "viscous": 0.01}),
        json!({"type": "Lorentzian", "break_away": 0.6, "kinetic": 0.4, "scale": 0.5}),
        json!({"type": "PoppStelter", "break_away": 0.6, "kinetic": 0.4, "weakening": 1.0}),
        json!({"type": "BogaczRyczek", "static_friction": {"initial": 1.07, "limit": 0.3}, "A": null, "B": [-0.41, 1.33], "C": null,
               "D": [0.33, 2.4], "l": [3.41, -0.28], "alpha": 0.0, "beta": 0.01, "phi": -58.0, "psi": 39.0, "eta": 89.0}),
    ]
}

/// Periods of the forcing: some 100,000 evaluations of the search in the closed form.
const PERIODS: f64 = 5000.0;

fn events(law: &Value, amplitude: f64, drive: f64, x0: f64, engine: &str) -> Vec<String> {
    let forcing = json!([{"amplitude": amplitude, "frequency": 1.37, "phase": 0.3}]);
    let periods = if engine == "closed" {
        PERIODS
    } else {
        PERIODS / 20.0
    };
    let case = json!({
        "sys": {"mass": 1.0, "stiffness": 1.0, "damping": 0.3, "drive_velocity": drive, "law": law, "forcing": forcing},
        "x0": x0, "v0": 0.0, "t_end": periods * 4.586, "engine": engine, "max_events": 10_000_000,
    });
    let problem = Problem::read(&case).unwrap();
    let report = run(&case, &problem).unwrap();
    assert_eq!(report.stop, "t_end", "{law}");
    let all = report
        .marks
        .iter()
        .flat_map(|mark| mark.events.iter().map(|event| (mark.time[0], event)));
    // A law of pieces or branches may pass from one to the next: that is no change of contact.
    let change = |kind: &str| !matches!(kind, "node" | "reversal" | "hold");
    all.filter(|(_, event)| change(event.kind.name()))
        .map(|(t, event)| format!("{} at {t}", event.kind.name()))
        .collect()
}

#[test]
fn a_stick_that_cannot_break_holds() {
    for law in laws() {
        for engine in ["closed", "series"] {
            // |F| ≤ 0.59 < 0.6 at every time.
            assert_eq!(
                events(&law, 0.54, 0.0, 0.05, engine),
                Vec::<String>::new(),
                "{law}, {engine}"
            );
        }
    }
}

#[test]
fn a_slip_that_cannot_stop_goes_on() {
    for law in laws() {
        for engine in ["closed", "series"] {
            // From rest at x = 0.7: |ẋ| stays below 2, the drive has 5.
            assert_eq!(
                events(&law, 0.3, 5.0, 0.7, engine),
                Vec::<String>::new(),
                "{law}, {engine}"
            );
        }
    }
}
