//! Motions under laws with branches in lanes: the same bits in every width, and the events of the engine of single motions.

use stickslip::batch::Batch;
use stickslip::harmonic::Harmonic;
use stickslip::lanes::Width;
use stickslip::law::{
    BogaczRyczek, Combined, ConstantOrNodes, Coulomb, DwellTime, ForceRate, Friction, Law, StaticFriction,
    TwoBranch, UpperTurn,
};
use stickslip::mode::Kind;
use stickslip::oscillator::Oscillator;
use stickslip::rows::Rows;
use stickslip::simulate::{Run, simulate};

#[path = "support/dice.rs"]
mod dice;
#[path = "support/lane_runs.rs"]
mod lane_runs;
use dice::Dice;
use lane_runs::{all_forward, apart, beside, compare, many, usual};

/// A branch of one to four nodes, or a number.
fn branch(dice: &mut Dice, top: f64) -> ConstantOrNodes {
    let first = top * dice.between(0.3, 1.0);
    if dice.below(5) == 0 {
        return ConstantOrNodes::Constant(first);
    }
    let mut nodes = vec![[0.0, first]];
    for _ in 0..dice.below(4) {
        let [u, _] = nodes[nodes.len() - 1];
        nodes.push([u + dice.between(0.1, 0.6), top * dice.between(0.2, 1.0)]);
    }
    ConstantOrNodes::Nodes(nodes)
}

/// The paper's law, near its example.
fn draw_paper(dice: &mut Dice) -> (Oscillator, Run) {
    let example = BogaczRyczek::default();
    loop {
        let mut near = |number: f64| number * dice.between(0.8, 1.2);
        let law = BogaczRyczek {
            static_friction: StaticFriction {
                initial: near(0.68),
                drop: near(1.24),
                drop_scale: near(0.37),
                limit: near(0.39),
                rate: near(0.3),
                ..example.static_friction
            },
            beta: near(0.01),
            phi: near(-58.0),
            eta: near(70.0),
            upper_turn: if near(1.0) < 1.0 {
                UpperTurn::Down
            } else {
                UpperTurn::Back
            },
            ..example.clone()
        };
        if law.validate().is_err() {
            continue;
        }
        let drawn = beside(law.into(), dice);
        // What may resonate is followed by Taylor steps.
        if !drawn.0.resonates() {
            return drawn;
        }
    }
}

/// Static friction that feels the force rate, with the same kinetic friction at every slip speed or two branches of it.
fn draw_force_rate(dice: &mut Dice) -> (Oscillator, Run) {
    let top = dice.between(0.3, 1.0);
    let growth = ForceRate {
        kinetic: top,
        limit: dice.between(0.1, 1.0),
        rate: dice.between(0.05, 2.0),
        force_rate_scale: dice.between(0.05, 1.0),
        exponent: 1.0,
        force_rate_exponent: dice.between(0.5, 2.0),
    };
    if dice.below(2) == 0 {
        return beside(growth.into(), dice);
    }
    let law = TwoBranch {
        rising: branch(dice, top),
        falling: branch(dice, top),
        break_away: top,
    };
    beside(
        Combined::new(Box::new(growth.into()), Box::new(law.into())).into(),
        dice,
    )
}

/// Two branches, the falling one below, above or across the other.
fn draw_two_branches(dice: &mut Dice) -> (Oscillator, Run) {
    let top = dice.between(0.3, 1.2);
    let law = TwoBranch {
        rising: branch(dice, top),
        falling: branch(dice, top),
        break_away: top * dice.between(1.0, 1.5),
    };
    if dice.below(3) > 0 {
        return beside(law.into(), dice);
    }
    // With static friction that grows with the stick time.
    let growth = DwellTime::new(top, dice.between(0.0, 1.0), dice.between(0.05, 2.0), 1.0);
    beside(
        Combined::new(Box::new(growth.into()), Box::new(law.into())).into(),
        dice,
    )
}

#[test]
fn two_branches_agree_with_single_motions() {
    usual(compare(400, 11, draw_two_branches));
}

#[test]
#[ignore = "minutes; STICKSLIP_MOTIONS says how many, STICKSLIP_SEED the first thousand's seed"]
fn many_branches_agree_with_single_motions() {
    let [two_branches, paper, force_rate] = many([draw_two_branches, draw_paper, draw_force_rate]);
    usual(two_branches);
    sticks_are_handed_over(paper);
    sticks_are_handed_over(force_rate);
}

/// Under a force that lanes do not follow in sticks, these are handed over.
fn sticks_are_handed_over(counts: [u64; 4]) {
    let [count, total, handed, ill] = counts;
    let seen = format!("{total} events, {handed} handed over, {ill} of {count} ill-conditioned");
    assert!(
        total > 10 * count && handed < total / 2 && ill * 20 < count,
        "{seen}"
    );
}

#[test]
fn the_papers_law_agrees_with_single_motions() {
    sticks_are_handed_over(compare(400, 13, draw_paper));
}

#[test]
fn force_rates_agree_with_single_motions() {
    sticks_are_handed_over(compare(400, 17, draw_force_rate));
}

/// Between branches slip is held, or friction jumps, and the events of both are told by their names.
#[test]
fn holds_and_jumps_are_told() {
    for (falling, kind) in [(0.6, Kind::Hold), (1.2, Kind::Reversal)] {
        let law = TwoBranch {
            rising: ConstantOrNodes::Nodes(vec![[0.0, 1.0], [0.6, 0.7]]),
            falling: ConstantOrNodes::Constant(falling),
            break_away: 1.2,
        };
        for forcing in [vec![], vec![Harmonic::new(0.5, 0.7, 0.3)]] {
            let oscillator = Oscillator {
                forcing,
                ..Oscillator::new(0.05, 0.3, law.clone())
            };
            let run = Run::stuck(200.0);
            let (_, events, handed) = all_forward(&[(oscillator.clone(), run)], Width::widest());
            let single = simulate(&oscillator, run).unwrap().events;
            let count = events[0].len();
            assert!(
                single.len() - count < 2 && handed == 0,
                "{handed}, {count} of {}",
                single.len()
            );
            assert!(apart(&events[0], &single[..count]) < 1e-9);
            assert!(events[0].iter().filter(|event| event.kind == kind).count() > 10);
        }
    }
}

/// A run of a batch has the same bits alone and among others of its law, whatever the width that their number asks for, and the
/// events of the engine of single motions.
#[test]
fn batches_do_not_depend_on_neighbours() {
    let oscillator = Oscillator {
        forcing: vec![Harmonic::new(0.5, 0.7, 0.0)],
        ..Oscillator::new(
            0.05,
            0.3,
            TwoBranch {
                rising: ConstantOrNodes::Nodes(vec![[0.0, 1.0], [0.6, 0.7]]),
                falling: ConstantOrNodes::Nodes(vec![[0.0, 0.5], [0.6, 0.6]]),
                break_away: 1.0,
            },
        )
    };
    let batch = Batch {
        rows: Rows {
            document: serde_json::to_value(&oscillator).unwrap(),
            names: vec!["damping".into()],
            values: (0..40).map(|i| 0.05 + 0.004 * f64::from(i)).collect(),
        },
        t_end: 60.0,
        max_events: 1000,
        after: 10.0,
        section: Some(Kind::Hold),
        keep: 3,
    };
    let all = batch.rows(0..40, &|| true).unwrap();
    let mut held = 0;
    for (index, row) in all.iter().enumerate() {
        assert_eq!(
            batch.rows(index..index + 1, &|| true).unwrap()[0],
            *row,
            "{index}"
        );
        let alone = Oscillator {
            damping: batch.rows.values[index],
            ..oscillator.clone()
        };
        let orbit = simulate(&alone, Run::stuck(60.0)).unwrap();
        let late = orbit.events.iter().filter(|event| event.t >= 10.0);
        assert_eq!(row.counts.iter().sum::<u64>(), late.clone().count() as u64);
        let holds: Vec<_> = late.filter(|event| event.kind == Kind::Hold).collect();
        held += row.section.len();
        for (point, event) in row.section.iter().rev().zip(holds.iter().rev()) {
            assert!((point[0] - event.t).abs() < 1e-9 && (point[1] - event.x).abs() < 1e-9);
        }
    }
    assert!(held > 40, "{held}");
}

/// Motions of all kinds go at once: each as it goes among its own.
#[test]
fn kinds_go_beside_each_other() {
    let mut dice = Dice(5);
    let mut runs: Vec<_> = (0..30).map(|_| draw_two_branches(&mut dice)).collect();
    let own = all_forward(&runs, Width::widest()).1;
    for place in [0, 7, 20] {
        runs.insert(place, beside(Coulomb::new(0.4).into(), &mut dice));
    }
    let mixed = all_forward(&runs, Width::widest()).1;
    let branched = runs
        .iter()
        .zip(mixed)
        .filter(|((one, _), _)| !matches!(one.law, Law::Coulomb(_)));
    for (own, (_, mixed)) in own.iter().zip(branched) {
        assert_eq!(apart(own, &mixed), 0.0);
    }
}
