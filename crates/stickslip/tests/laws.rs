//! Laws against their limits and against closed forms, each with its source.

mod support;

use serde_json::Value;
use stickslip::harmonic::Harmonic;
use stickslip::law::{
    BogaczRyczek, ConstantOrNodes, DwellTime, End, ForceRate, Friction, Law, Memory, PiecewiseLinear, Rest,
    StaticFriction, Tabulated, TwoBranch,
};
use stickslip::mode::Kind;
use stickslip::orbit::Orbit;
use stickslip::oscillator::Oscillator;
use stickslip::scalar::Scalar;
use stickslip::series::{Grown, nothing};
use stickslip::simulate::{Run, Stop, simulate};
use support::close;

fn same(one: &Orbit, two: &Orbit) {
    assert_eq!(one.events.len(), two.events.len());
    for (a, b) in one.events.iter().zip(&two.events) {
        assert_eq!(a.kind, b.kind);
        assert!(
            (a.t - b.t).abs() < 1e-9 && (a.x - b.x).abs() < 1e-9,
            "{a:?} {b:?}"
        );
    }
}

fn two_branch(rising: f64, falling: f64) -> TwoBranch {
    TwoBranch::new(
        ConstantOrNodes::Constant(rising),
        ConstantOrNodes::Constant(falling),
        rising.max(falling),
    )
}

/// x″ + x = h sgn(ẇ), set-valued at ẇ = 0: half swings about ±h of amplitude A − h, and between them 2h travelled at the
/// speed A − h. Hence T = 2π + 4h/(A − h), on the branches f₊ = f₀ + h above f₋ = f₀ − h.
#[test]
fn s20_accel_sign() {
    let run = Run::starting(2.0, 0.0, 1000.0);
    let orbit = simulate(&Oscillator::new(0.0, 2.0, two_branch(1.3, 0.7)), run).unwrap();
    let times = |kind: Kind| -> Vec<f64> {
        orbit
            .events
            .iter()
            .filter(|event| event.kind == kind)
            .map(|event| event.t)
            .collect()
    };
    let (hold, reversal) = (times(Kind::Hold), times(Kind::Reversal));
    assert_eq!(hold.len() + reversal.len(), orbit.events.len());
    let n = hold.len();
    close(hold[n - 1] - hold[n - 3], 7.997_471_021_465_301);
    close(
        hold[n - 1] - hold[1],
        7.997_471_021_465_301 * f64::from(u32::try_from(n - 2).unwrap()) / 2.0,
    );
    close(reversal[2] - hold[2], 0.6 / 0.7);
    let state = orbit.states(&[0.5 * (hold[2] + reversal[2])])[0];
    assert!(!state.stuck && state.a == 0.0);
    assert!(
        (state.force - 1.0).abs() < 1e-12,
        "friction half way through a hold: {}",
        state.force
    );
}

/// The same with damping and forcing: at every time friction lies on the branch that the sign of ẇ asks for, or between
/// the branches with ẇ = 0, and the equation of motion holds.
#[test]
fn branches_hold_where_neither_is_consistent() {
    let law = TwoBranch::new(
        ConstantOrNodes::Nodes(vec![[0.0, 1.2], [0.5, 0.9], [1.0, 1.0]]),
        ConstantOrNodes::Nodes(vec![[0.0, 0.8], [0.4, 0.6], [1.0, 0.9]]),
        1.2,
    );
    let mut system = Oscillator::new(0.02, 0.6, law.clone());
    for forcing in [vec![], vec![Harmonic::new(0.3, 1.7, 0.4)]] {
        system.forcing.clone_from(&forcing);
        let orbit = simulate(&system, Run::stuck(200.0)).unwrap();
        assert_eq!(orbit.stop, Stop::End);
        let times: Vec<f64> = (0..20_000).map(|i| 0.01 * f64::from(i)).collect();
        let mut held = 0;
        for (t, state) in times.iter().zip(orbit.states(&times)) {
            let push: f64 = forcing
                .iter()
                .map(|f| f.amplitude * (f.frequency * t + f.phase).cos())
                .sum();
            let rest = state.a + 0.02 * state.v + state.x - state.force - push;
            assert!(rest.abs() < 1e-11, "equation of motion off by {rest} at {t}");
            let w = 0.6 - state.v;
            if state.stuck || w.abs() < 1e-6 {
                continue;
            }
            let (u, force, rising) = (w.abs(), state.force * w.signum(), -state.a * w.signum());
            let [low, high] = Friction::branches(&law, u).unwrap();
            if rising == 0.0 {
                held += 1;
                assert!(force > low - 1e-9 && force < high + 1e-9);
            } else if rising.abs() > 1e-9 {
                let expected = if rising > 0.0 { high } else { low };
                assert!((force - expected).abs() < 1e-9, "{force} {expected} at {t}");
            }
        }
        assert!(held > 100, "{held}");
    }
}

/// Branches the other way round switch at once, and the acceleration jumps by (f₋ − f₊)/m.
#[test]
fn branches_the_other_way_round_switch_at_once() {
    let run = Run::starting(2.5, 0.0, 50.0);
    let orbit = simulate(&Oscillator::new(0.0, 8.0, two_branch(0.7, 1.3)), run).unwrap();
    assert!(orbit.events.iter().all(|event| event.kind == Kind::Reversal));
    // Each half swing is about 1 ∓ 0.3 and ends where the slip acceleration vanishes, a quarter period later.
    let gaps: Vec<f64> = orbit
        .events
        .windows(2)
        .map(|pair| pair[1].t - pair[0].t)
        .collect();
    for (event, gap) in orbit.events.iter().zip(&gaps) {
        let jump = orbit.states(&[event.t + 1e-9])[0].a.abs();
        assert!((jump - 0.6).abs() < 1e-6, "{jump}");
        assert!(*gap > 1.0 && *gap < std::f64::consts::PI);
    }
}

/// Branches that meet everywhere are one table.
#[test]
fn equal_branches_are_one_table() {
    let nodes = vec![[0.0, 1.0], [0.2, 0.6], [0.3, 0.61]];
    let end = vec![[0.0, 1.0], [0.2, 0.6], [9.0, 1.48]];
    let both = TwoBranch::new(
        ConstantOrNodes::Nodes(end.clone()),
        ConstantOrNodes::Nodes(end.clone()),
        1.0,
    );
    let plain = PiecewiseLinear::new(nodes, 1.0);
    let table = Tabulated::new(ConstantOrNodes::Nodes(end), ConstantOrNodes::Constant(1.0));
    let one = simulate(&Oscillator::new(0.05, 0.3, plain), Run::stuck(100.0)).unwrap();
    same(
        &one,
        &simulate(&Oscillator::new(0.05, 0.3, table), Run::stuck(100.0)).unwrap(),
    );
    let mut two = simulate(&Oscillator::new(0.05, 0.3, both), Run::stuck(100.0)).unwrap();
    two.events.retain(|event| event.kind != Kind::Reversal);
    same(&one, &two);
}

/// Without dependence on the force rate (δ₀ → ∞) the law is Kato's.
#[test]
fn force_rate_without_scale_is_dwell_time() {
    let law = ForceRate::new(0.5, 0.5, 0.4, 1e300, 1.0, 1.0);
    let dwell = DwellTime::new(0.5, 0.5, 0.4, 1.0);
    let run = Run::stuck(300.0);
    same(
        &simulate(&Oscillator::new(0.0, 0.3, law), run).unwrap(),
        &simulate(&Oscillator::new(0.0, 0.3, dwell), run).unwrap(),
    );
}

/// On one drive velocity the force rate is k s throughout: friction falls as if Δ∞ were smaller. S15 with the stiffer
/// growth halved by the force rate must give the same cycle (Brockley, Cameron & Potter 1967).
#[test]
fn force_rate_at_constant_drive_scales_the_growth() {
    let law = ForceRate::new(0.5, 1.0, 0.4, 0.3, 1.0, 2.0);
    let orbit = simulate(&Oscillator::new(0.0, 0.3, law), Run::stuck(1000.0)).unwrap();
    let release = orbit
        .events
        .iter()
        .rfind(|event| event.kind == Kind::Release)
        .unwrap();
    close(release.stick_time, 1.514_649_944_797_501);
    close(release.force - 0.5, 0.227_197_491_719_625_1);
    close(release.force_rate, 0.3);
}

/// A table of Kato's curve, fine enough, gives its cycle; the release lies on the table to the bit.
#[test]
fn tabulated_dwell_follows_the_curve() {
    let curve = |t: f64| 0.5 + 0.5 * (1.0 - (-0.4 * t).exp());
    let nodes = (0..=4000)
        .map(|i| 0.005 * f64::from(i))
        .map(|t| [t, curve(t)])
        .collect();
    let law = Tabulated::new(ConstantOrNodes::Constant(0.5), ConstantOrNodes::Nodes(nodes));
    for forcing in [vec![], vec![Harmonic::new(0.0, 0.7, 0.0)]] {
        let mut system = Oscillator::new(0.0, 0.3, law.clone());
        system.forcing = forcing;
        let orbit = simulate(&system, Run::stuck(500.0)).unwrap();
        let release = orbit
            .events
            .iter()
            .rfind(|event| event.kind == Kind::Release)
            .unwrap();
        assert!(
            (release.stick_time - 1.514_649_944_797_501).abs() < 1e-5,
            "{}",
            release.stick_time
        );
    }
}

/// The places of the numbers of a document.
fn places(document: &Value, place: &str, found: &mut Vec<String>) {
    match document {
        Value::Number(_) => found.push(place.into()),
        Value::Array(items) => {
            for (i, item) in items.iter().enumerate() {
                places(item, &format!("{place}/{i}"), found);
            }
        }
        Value::Object(items) => {
            for (name, item) in items {
                places(item, &format!("{place}/{name}"), found);
            }
        }
        _ => {}
    }
}

/// What a law answers to a few questions.
fn answers<N: Scalar>(law: &Law<N>) -> Vec<N> {
    let number = |value: f64| N::from(value);
    let law = law.toward(1.0);
    let rest = Rest::new(number(1.3), number(0.4));
    let mut found = vec![
        law.static_limit(rest),
        law.static_limit(Rest::new(number(0.0), number(0.2))),
    ];
    let mut pieces = Vec::new();
    let mut memory = Memory::default();
    for u in [0.05, 0.35] {
        for balance in [f64::NEG_INFINITY, f64::INFINITY] {
            pieces.push(law.begin(number(u), number(balance), &mut memory));
        }
    }
    let mut piece = law.leave(number(2.1), &mut memory);
    for end in [
        End::High,
        End::Reversal { rising: false },
        End::Reversal { rising: true },
    ] {
        pieces.push(piece);
        if piece.high.value().is_finite() || !matches!(end, End::High) {
            piece = law.next(&piece, end, number(0.21), &mut memory);
        }
    }
    for piece in pieces {
        found.extend([
            piece.offset,
            piece.slope,
            piece.low,
            law.force(&piece, number(0.07)),
        ]);
    }
    if law.smooth() {
        let (mut u, mut grown) = (nothing(), Grown::default());
        (u[0], u[1], u[2]) = (number(0.13), number(0.4), number(-0.3));
        found.extend((0..8).map(|k| law.extend(&u, k, &mut grown)));
    }
    found.extend(law.branches(number(0.2)).into_iter().flatten());
    found.extend([memory.anchor, memory.corner].into_iter().flatten());
    found
}

/// Asked with numbers that carry derivatives, a law answers the same, and its derivatives by each number of its document are those
/// of differences of the fourth order.
#[test]
fn laws_give_their_exact_derivatives() {
    let mut checked = 0;
    for facts in Law::facts() {
        let mut document = facts.example;
        document["type"] = facts.name.into();
        let law: Law = serde_json::from_value(document.clone()).unwrap();
        let own = answers(&law);
        let mut found = Vec::new();
        places(&document, "", &mut found);
        for place in found {
            let put = |value: Value| {
                let mut beside = document.clone();
                *beside.pointer_mut(&place).unwrap() = value;
                beside
            };
            let value = document.pointer(&place).and_then(Value::as_f64).unwrap();
            let step = 1e-4 * if value == 0.0 { 1.0 } else { value.abs() };
            let beside: Law = serde_json::from_value(put((value + step).into())).unwrap();
            let mut pairs = beside.numbers().into_iter().zip(law.numbers());
            let at = pairs.position(|(beside, own)| beside != own).unwrap();
            // The last of six axes; the others are no numbers of the law.
            let jets = answers(&law.along(&[usize::MAX, usize::MAX, usize::MAX, usize::MAX, usize::MAX, at]));
            let around = [-2.0, -1.0, 1.0, 2.0].map(|steps| {
                let beside: Law = serde_json::from_value(put((value + steps * step).into())).unwrap();
                answers(&beside)
            });
            for (i, (jet, own)) in jets.iter().zip(&own).enumerate() {
                assert!(jet.value == *own || own.is_nan(), "{} {place} {i}", facts.name);
                assert!(
                    jet.slopes
                        .iter()
                        .enumerate()
                        .all(|(axis, slope)| axis == 5 || *slope == 0.0)
                );
                let [a, b, c, d] = [0, 1, 2, 3].map(|which| around[which][i]);
                let expected = (8.0 * (c - b) - (d - a)) / (12.0 * step);
                // At a corner of the law there is no derivative: differences to both sides tell.
                let (down, up) = ((own - b) / step, (c - own) / step);
                if !expected.is_finite() || (up - down).abs() > 1e-2 * (1.0 + up.abs()) {
                    continue;
                }
                checked += 1;
                assert!(
                    (jet.slopes[5] - expected).abs() < 1e-7 * (1.0 + expected.abs()),
                    "{} {place} {i}: {} {expected}",
                    facts.name,
                    jet.slopes[5]
                );
            }
        }
    }
    assert!(checked > 2000, "{checked}");
}

/// A fall of static friction that is none yet has a derivative all the same.
#[test]
fn a_number_that_is_zero_varies() {
    let law: Law = BogaczRyczek {
        static_friction: StaticFriction {
            initial: 2.0,
            drop: 0.0,
            drop_scale: 0.5,
            limit: 0.0,
            ..BogaczRyczek::default().static_friction
        },
        ..BogaczRyczek::default()
    }
    .into();
    let drop = law.numbers().iter().position(|number| *number == 0.0).unwrap();
    let law = law.along(&[drop]);
    let limit = law.static_limit(Rest::new(1.0.into(), 0.5.into()));
    assert_eq!((limit.value, limit.slopes[0]), (2.0, 0.5));
}
