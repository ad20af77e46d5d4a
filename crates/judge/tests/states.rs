//! Runs under laws with an internal state: the judge finds what is wrong with one, and nothing wrong with a sample.

use serde_json::{Value, json};
use stickslip_judge::draw;
use stickslip_judge::problem::{Document, Problem};
use stickslip_judge::states::law::StateLaw;
use stickslip_judge::states::report::{Change, StateReport, run};
use stickslip_judge::states::{judge, judge_report};

fn bristles() -> Value {
    json!({
        "sys": {"mass": [[1.0]], "stiffness": [[1.0]], "damping": [[0.05]],
                "contacts": [{"mass": 0, "drive_velocity": {"velocity": 0.1, "harmonics": [{"amplitude": 0.3, "frequency": 1.3}]},
                              "law": {"type": "LuGre", "stiffness": 300.0, "damping": 4.0, "viscous": 0.1, "kinetic": 0.6,
                                      "break_away": 1.0, "scale": 0.05, "exponent": 2.0}}]},
        "x0": [0.3], "v0": [0.1], "t_end": 12.0, "tolerance": 1e-8,
    })
}

/// What the judge finds first once the report was changed.
fn finding(case: &Value, change: impl Fn(&mut StateReport)) -> String {
    let mut report = run(case).unwrap();
    change(&mut report);
    let verdict = judge_report(&Problem::read(case).unwrap(), &report);
    assert_eq!(verdict.left, 0);
    let first = verdict.findings.first();
    first.map_or_else(String::new, |finding| finding.what.clone())
}

#[test]
fn a_run_that_was_left_alone_is_right_and_a_step_that_was_moved_is_found() {
    let case = bristles();
    assert_eq!(finding(&case, |_| ()), "");
    let what = finding(&case, |report| report.rows[40].x[0] += 1e-5);
    assert_eq!(what, "acceleration");
    // Steps of 1e-8 that are said to be of 1e-13.
    let what = finding(&case, |report| report.tolerance = 1e-13);
    assert!(what.contains(" step"), "{what}");
    let what = finding(&case, |report| report.rows[40].z[0] += 1e-5);
    assert_eq!(what, "friction");
    let what = finding(&case, |report| report.rows[40].a[0] *= 1.0 + 1e-9);
    assert_eq!(what, "acceleration");
    let what = finding(&case, |report| report.rows[0].z[0] += 1e-9);
    assert_eq!(what, "state of steady slip");
}

#[test]
fn another_law_is_found() {
    for name in [
        "stiffness",
        "damping",
        "viscous",
        "kinetic",
        "break_away",
        "scale",
    ] {
        let case = bristles();
        let mut other = case.clone();
        let number = &mut other["sys"]["contacts"][0]["law"][name];
        *number = json!(number.as_f64().unwrap() * (1.0 + 1e-6));
        let verdict = judge_report(&Problem::read(&case).unwrap(), &run(&other).unwrap());
        assert!(!verdict.findings.is_empty(), "{name}");
    }
}

/// As an orbit is reported: it keeps the start, and names its changes of sign.
fn as_orbit(report: &mut StateReport, changes: Vec<Change>) {
    report.rows[0].v = vec![0.1];
    report.changes = Some(changes);
}

#[test]
fn changes_of_sign_that_are_missed_invented_or_displaced_are_found() {
    let case = bristles();
    let signs = |report: &StateReport| {
        let pairs = report.rows.windows(2);
        pairs.filter(|pair| pair[0].w[0] * pair[1].w[0] < 0.0).count()
    };
    let what = finding(&case, |report| {
        assert!(signs(report) > 2);
        as_orbit(report, Vec::new());
    });
    assert_eq!(what, "changes of the sign of the slip velocity");
    let what = finding(&case, |report| {
        let row = &report.rows[report.rows.len() / 3];
        let (slip, contact, t) = (true, 0, row.t);
        as_orbit(report, vec![Change { slip, contact, t }]);
    });
    assert_eq!(what, "slip velocity where it changes its sign");
    // Under a fast drive the slip velocity keeps its sign, and the mass swings.
    let mut fast = case.clone();
    fast["sys"]["contacts"][0]["drive_velocity"] = json!(5.0);
    let what = finding(&fast, |report| {
        let v = |at: usize| report.rows[at].v[0];
        let rows = 1..report.rows.len();
        let first = rows.clone().find(|&at| v(at - 1) * v(at) < 0.0).unwrap();
        let back = rows.skip(first).find(|&at| v(at) * v(first) < 0.0).unwrap();
        // No row lies between the two changes of its sign.
        report.rows.truncate(back + 1);
        report.rows.drain(first..back);
        report.between = Vec::new();
        as_orbit(report, Vec::new());
        report.stop = "cut".into();
    });
    assert_eq!(what, "two changes of sign in one step");
}

/// Friction takes energy but for what it stores, and steady slip is steady.
#[test]
fn laws_are_passive_and_their_steady_states_rest() {
    let laws = [
        json!({"type": "Dahl", "stiffness": 4.0, "kinetic": 0.7, "exponent": 1.5}),
        json!({"type": "BoucWen", "stiffness": 4.0, "beta": 8.0, "gamma": -3.0, "exponent": 2.0, "amplitude": 1.3}),
        json!({"type": "LuGre", "stiffness": 50.0, "damping": 0.0, "viscous": 0.1, "kinetic": 0.6, "break_away": 1.0, "scale": 0.1}),
        json!({"type": "ElastoPlastic", "stiffness": 50.0, "damping": 0.0, "viscous": 0.1, "kinetic": 0.6, "break_away": 1.0,
               "scale": 0.1, "elastic": 0.3}),
        json!({"type": "RateState", "normal_force": 1.3, "a": 0.05, "b": 0.07, "length": 0.3, "reference_velocity": 0.1,
               "law": "aging", "second_b": 0.02, "second_length": 0.1}),
        json!({"type": "RateState", "normal_force": 1.3, "a": 0.05, "b": 0.07, "length": 0.3, "reference_velocity": 0.1, "law": "slip"}),
        json!({"type": "RateState", "normal_force": 1.3, "a": 0.05, "b": 0.07, "length": 0.3, "reference_velocity": 0.1,
               "law": "perrin-rice-zheng"}),
        json!({"type": "RateState", "normal_force": 1.3, "a": 0.05, "b": 0.07, "length": 0.3, "reference_velocity": 0.1,
               "law": "composite", "cutoff_velocity": 0.2}),
        json!({"type": "Regularised", "law": {"type": "Rational", "break_away": 1.0, "weakening": 3.0}, "width": 0.01}),
    ];
    for document in laws {
        let law = StateLaw::read(&document).unwrap();
        // dE/dz of what is stored, over z: none where the state is no strain.
        let stored = match document["type"].as_str().unwrap() {
            "Dahl" => 1.0 / 4.0,
            "BoucWen" => 4.0 / 1.3,
            "LuGre" | "ElastoPlastic" => 50.0,
            _ => 0.0,
        };
        for speed in [-1.7, -0.3, -0.01, 0.02, 0.4, 2.0_f64] {
            let steady = law.steady(speed);
            let [_, first, second] = law.rates(speed, &steady);
            assert!(
                first.value.abs() < 1e-12 && second.value.abs() < 1e-12,
                "{document}"
            );
            for share in [-0.95, -0.4, 0.0, 0.3, 0.9] {
                let z: Vec<f64> = steady.iter().map(|z| share * z).collect();
                let [force, rate, _] = law.rates(speed, &z);
                let taken = force.value * speed - stored * z[0] * rate.value;
                assert!(taken >= -1e-15, "{document} {speed} {share}: {taken}");
            }
        }
    }
}

#[test]
fn a_sample_of_random_runs_is_right() {
    let (mut steps, mut left) = (0, 0);
    for index in 0..25 {
        let case = draw::state(2, index);
        let verdict = judge(&case).unwrap_or_else(|| panic!("the judge does not understand {case}"));
        assert!(verdict.findings.is_empty(), "{:?} in {case}", verdict.findings);
        steps += verdict.phases;
        left += verdict.left;
    }
    assert!(steps > 2500 && left < 3, "{steps} steps, {left} left");
}

/// Runs of the core's own integrator on which it or the judge was wrong once: an interpolant in a logarithm that overshot by
/// many times its base, a step over a corner of a drive, a start with the rounding of its logarithm, a corner of |w| in a step,
/// bodies that only a point beside the motion would have parted, a slope that a drive has after its node in the step before,
/// a slope at the end of a step that multiplied its error by the stiffness.
#[test]
fn what_once_failed_is_right() {
    let once = [
        (6004, 39),
        (12, 1114),
        (3, 83),
        (6010, 6),
        (6009, 37),
        (6003, 21),
        (6310, 31),
        (6303, 2),
    ];
    for (seed, index) in once {
        let verdict = judge(&draw::state(seed, index)).unwrap();
        assert!(
            verdict.findings.is_empty(),
            "{:?} in {seed} {index}",
            verdict.findings
        );
        assert!(verdict.phases > 0, "nothing judged in {seed} {index}");
    }
}
