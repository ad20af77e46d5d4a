//! The judge finds what is wrong with an orbit, and nothing wrong with a sample of random runs.

use serde_json::{Value, json};
use stickslip::mode::Kind;
use stickslip_judge::draw;
use stickslip_judge::problem::Problem;
use stickslip_judge::report::{Report, run};
use stickslip_judge::verdict::{judge, judge_report};

fn stick_slip() -> Value {
    json!({
        "sys": {"mass": 1.0, "stiffness": 1.0, "damping": 0.05, "drive_velocity": 0.2,
                "law": {"type": "Tabulated", "kinetic": 0.6, "break_away": [[0.0, 0.7], [2.0, 1.0], [9.0, 1.1]]}},
        "x0": 0.1, "v0": null, "t_end": 60.0,
    })
}

/// What the judge finds first once the report was changed.
fn finding(case: &Value, change: impl Fn(&mut Report)) -> String {
    let problem = Problem::read(case).unwrap();
    let mut report = run(case, &problem).unwrap();
    change(&mut report);
    let verdict = judge_report(&problem, &report);
    verdict
        .findings
        .first()
        .map_or_else(String::new, |finding| finding.what.clone())
}

#[test]
fn an_orbit_that_was_left_alone_is_right() {
    assert_eq!(finding(&stick_slip(), |_| ()), "");
    let mut series = stick_slip();
    series["engine"] = json!("series");
    assert_eq!(finding(&series, |_| ()), "");
}

#[test]
fn a_late_event_is_found() {
    for index in [1, 2, 5] {
        let what = finding(&stick_slip(), |report| report.marks[index].time[0] += 1e-9);
        assert!(!what.is_empty(), "event {index}");
    }
}

#[test]
fn a_missed_event_is_found() {
    for (index, wanted) in [
        (1, "adhesion beyond its limit"),
        (2, "slip velocity changes its sign"),
    ] {
        let what = finding(&stick_slip(), |report| report.marks.truncate(index));
        assert!(what.contains(wanted), "{what}");
    }
}

#[test]
fn an_event_too_many_is_found() {
    let what = finding(&stick_slip(), |report| {
        let mut early = report.marks[1].clone();
        let back = 0.5 * early.time[0];
        early.state[0] -= 0.2 * back;
        early.time[0] -= back;
        report.marks.insert(1, early);
    });
    assert_eq!(what, "release off the limit");
}

#[test]
fn numbers_of_an_event_are_checked() {
    type Change = fn(&mut Report);
    let changes: [(&str, Change); 4] = [
        ("force reported at the release", |report| {
            report.marks[1].events[0].force += 1e-9;
        }),
        ("stick time reported at the release", |report| {
            report.marks[1].events[0].stick_time += 1e-9;
        }),
        ("force rate reported at the release", |report| {
            report.marks[1].events[0].force_rate += 1e-9;
        }),
        ("position of mass 0 at the end of the phase", |report| {
            report.marks[2].state[0] += 1e-9;
        }),
    ];
    for (wanted, change) in changes {
        assert_eq!(finding(&stick_slip(), change), wanted);
    }
    assert_eq!(
        finding(&stick_slip(), |report| report.marks[0].state[0] += 1e-16),
        "start is not the start given"
    );
}

#[test]
fn a_wrong_law_is_found() {
    // The engine runs another friction than the document says.
    let case = stick_slip();
    let mut other = case.clone();
    other["sys"]["law"]["break_away"][1][1] = json!(1.000_000_01);
    let report = run(&other, &Problem::read(&other).unwrap()).unwrap();
    let verdict = judge_report(&Problem::read(&case).unwrap(), &report);
    assert_eq!(verdict.findings[0].what, "adhesion beyond its limit (contact 0)");
}

#[test]
fn every_law_slips_on_either_engine_as_its_formula_says() {
    let mut kinds = [0; 6];
    for index in 0..300 {
        let case = draw::oscillator(7, index);
        if let Some(report) = Problem::read(&case).and_then(|problem| run(&case, &problem).ok()) {
            for event in report.marks.iter().flat_map(|mark| &mark.events) {
                kinds[event.kind as usize] += 1;
            }
        }
    }
    // The kinds that one mass under a constant normal force has.
    for &kind in &Kind::ALL[..kinds.len()] {
        assert!(kinds[kind as usize] > 5, "hardly any {}: {kinds:?}", kind.name());
    }
}

/// The next branch is laid through the state that is reported at a turn: whether that is right is asked before.
#[test]
fn a_wrong_turn_is_found() {
    let case = json!({
        "sys": {"mass": 1.0, "stiffness": 1.0, "damping": 0.05, "drive_velocity": 0.3,
                "law": {"type": "BogaczRyczek", "A": null, "B": [-0.41, 1.33], "C": null, "D": [0.33, 2.4], "l": [3.41, -0.28],
                        "alpha": 0.04, "beta": 0.01, "phi": -58.0, "psi": 39.0, "eta": 89.0,
                        "static_friction": {"initial": 1.03, "limit": 0.3, "rate": 0.6, "force_rate_scale": 1.4}}},
        "x0": -0.7, "v0": 0.1, "t_end": 60.0,
    });
    let problem = Problem::read(&case).unwrap();
    assert_eq!(finding(&case, |_| ()), "");
    let marks = run(&case, &problem).unwrap().marks;
    let turns =
        |mark: &stickslip_judge::report::Mark| mark.events.iter().any(|event| event.kind == Kind::Reversal);
    let turns: Vec<usize> = (0..marks.len()).filter(|&index| turns(&marks[index])).collect();
    assert!(turns.len() > 10, "{} turns", turns.len());
    for index in turns {
        for part in 0..2 {
            let what = finding(&case, |report| report.marks[index].state[part] += 2e-11);
            assert!(!what.is_empty(), "turn {index}, {part}");
        }
    }
}

/// A block that jumps and runs against a stop.
fn jumping() -> Value {
    json!({
        "sys": {"mass": 1.0, "stiffness": 1.0, "damping": 0.1, "drive_velocity": 0.3,
                "law": {"type": "StaticKinetic", "break_away": 1.0, "kinetic": 0.6},
                "normal_force": {"constant": 0.9, "harmonics": [{"amplitude": 1.0, "frequency": 1.3}], "position": 0.1, "velocity": -0.05},
                "springs": [{"nodes": [[-1.0, 0.0], [0.4, 0.0], [1.4, 30.0]], "cubic": 0.2}]},
        "x0": 0.1, "v0": null, "t_end": 60.0,
    })
}

#[test]
fn a_wrong_normal_force_or_spring_is_found() {
    let case = jumping();
    assert_eq!(finding(&case, |_| ()), "");
    let problem = Problem::read(&case).unwrap();
    for path in [
        "/sys/normal_force/constant",
        "/sys/normal_force/harmonics/0/amplitude",
        "/sys/normal_force/position",
        "/sys/normal_force/velocity",
        "/sys/springs/0/nodes/1/0",
        "/sys/springs/0/nodes/2/1",
        "/sys/springs/0/cubic",
    ] {
        let mut other = case.clone();
        let number = other.pointer_mut(path).unwrap();
        *number = json!(number.as_f64().unwrap() * (1.0 + 1e-9));
        let report = run(&other, &problem).unwrap();
        assert!(!judge_report(&problem, &report).findings.is_empty(), "{path}");
    }
}

#[test]
fn where_bodies_part_and_springs_go_on_is_checked() {
    let case = jumping();
    let marks = run(&case, &Problem::read(&case).unwrap()).unwrap().marks;
    for (kind, missed) in [
        (Kind::Parting, "bodies together that are not pressed (contact 0)"),
        (
            Kind::Meeting,
            "bodies apart that are pressed together (contact 0)",
        ),
        (Kind::Spring, "spring above its piece (contact 0)"),
    ] {
        let first = marks
            .iter()
            .position(|mark| mark.events.iter().any(|event| event.kind == kind));
        let index = first.unwrap_or_else(|| panic!("no {}", kind.name()));
        let late = finding(&case, |report| report.marks[index].time[0] += 1e-9);
        assert!(!late.is_empty(), "{} late", kind.name());
        // So soon after it nothing else would follow.
        let what = finding(&case, |report| {
            report.t_last = report.marks[index].time[0] + 1e-4;
            report.marks.truncate(index);
        });
        assert!(what == missed, "{}: {what}", kind.name());
        let what = finding(&case, |report| report.marks[index].events[0].force += 1e-9);
        assert!(what.starts_with("force reported"), "{}: {what}", kind.name());
    }
}

/// No failure among random documents of one seed.
fn clean(count: u64, draw: impl Fn(u64) -> Value) {
    let (mut events, mut left) = (0, 0);
    for index in 0..count {
        let case = draw(index);
        let verdict = judge(&case).unwrap_or_else(|| panic!("the judge does not understand {case}"));
        assert!(verdict.refused.is_none(), "{:?} of {case}", verdict.refused);
        assert!(verdict.findings.is_empty(), "{:?} in {case}", verdict.findings);
        events += verdict.events;
        left += verdict.left;
    }
    assert!(
        events > 3 * count && left < count / 10,
        "{events} events, {left} phases left"
    );
}

/// Documents on which the engine or the judge was wrong once.
#[test]
fn what_once_failed_is_right() {
    let documents: Vec<Value> = serde_json::from_str(include_str!("found.json")).unwrap();
    for case in documents {
        let verdict = judge(&case).unwrap_or_else(|| panic!("the judge does not understand {case}"));
        assert!(verdict.findings.is_empty(), "{:?} in {case}", verdict.findings);
        assert!(verdict.phases > 0, "nothing judged in {case}");
    }
}

/// Beyond 1e30 times its start a run is left out where the engine calls it diverged, and judged where it does not.
#[test]
fn a_run_that_diverges_is_judged_as_long_as_it_is_known() {
    // Friction that falls without end feeds a growing swing, in closed form beyond all numbers.
    let case = json!({
        "sys": {"mass": 1.0, "stiffness": 1.0, "damping": 0.0, "drive_velocity": 0.2,
                "law": {"type": "PiecewiseLinear", "nodes": [[0.0, 1.0], [0.1, 0.84]], "break_away": 1.0}},
        "x0": 50.0, "v0": null, "t_end": 3000.0,
    });
    let problem = Problem::read(&case).unwrap();
    let report = run(&case, &problem).unwrap();
    assert_eq!(report.stop, "diverged");
    let verdict = judge_report(&problem, &report);
    assert!(verdict.findings.is_empty(), "{:?}", verdict.findings);
    assert!(verdict.left > 0);
    let mut other = run(&case, &problem).unwrap();
    other.stop = "max_events";
    assert!(judge_report(&problem, &other).phases > verdict.phases);
}

#[test]
fn a_sample_of_random_oscillators_is_right() {
    clean(600, |index| draw::oscillator(2, index));
}

/// Also where the events are those of motions in lanes: under all laws, and under those whose branches lanes follow.
#[test]
fn a_sample_of_motions_in_lanes_is_right() {
    let branched = ["TwoBranch", "BogaczRyczek", "ForceRate"];
    let cases = (0..).map(|index| draw::oscillator(3, index)).enumerate();
    let some = cases.filter(|(index, case)| {
        let law = case["sys"]["law"]["type"].as_str().unwrap_or_default();
        *index < 100 || branched.contains(&law)
    });
    let cases: Vec<Value> = some
        .map(|(_, mut case)| {
            case["engine"] = json!("lanes");
            case
        })
        .take(400)
        .collect();
    clean(400, |index| cases[usize::try_from(index).unwrap()].clone());
}

#[test]
fn a_sample_of_random_systems_is_right() {
    clean(60, |index| draw::system(2, index));
}

#[test]
fn a_sample_of_what_the_others_leave_out_is_right() {
    clean(80, |index| draw::further(2, index));
}

#[test]
fn a_sample_under_friction_by_polynomials_is_right() {
    clean(80, |index| draw::polynomial(2, index));
}

#[test]
fn a_sample_under_varying_normal_forces_and_on_bent_springs_is_right() {
    clean(80, |index| draw::loaded(2, index));
    let kinds = |index| {
        let case = draw::loaded(2, index);
        let report = Problem::read(&case).and_then(|problem| run(&case, &problem).ok());
        let marks = report.map_or_else(Vec::new, |report| report.marks);
        marks
            .into_iter()
            .flat_map(|mark| mark.events)
            .map(|event| event.kind)
    };
    let found: Vec<Kind> = (0..80).flat_map(kinds).collect();
    for kind in [Kind::Parting, Kind::Meeting, Kind::Spring] {
        let count = found.iter().filter(|&&one| one == kind).count();
        assert!(count > 20, "hardly any {}: {count}", kind.name());
    }
}
