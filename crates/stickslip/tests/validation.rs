//! Numbers known to 13 to 15 digits. Each case names its source; all are met to a relative 1e-11 or better.

mod support;

use stickslip::harmonic::Harmonic;
use stickslip::law::{Coulomb, DwellTime, Law, PiecewiseLinear, StaticKinetic};
use stickslip::mode::Kind;
use stickslip::orbit::{Event, Orbit};
use stickslip::oscillator::Oscillator;
use stickslip::simulate::{Run, simulate};
use support::close;

fn of_kind(orbit: &Orbit, kind: Kind) -> Vec<&Event> {
    orbit.events.iter().filter(|event| event.kind == kind).collect()
}

/// The last whole cycle of a belt oscillator: (release, capture, next release).
fn cycle(orbit: &Orbit) -> (Event, Event, Event) {
    let release = of_kind(orbit, Kind::Release);
    let capture = of_kind(orbit, Kind::Capture);
    let n = release.len();
    let after = capture.iter().find(|event| event.t > release[n - 2].t).unwrap();
    (*release[n - 2], **after, *release[n - 1])
}

/// Den Hartog 1931: each half swing loses 2 x_f.
#[test]
fn s1_coulomb_decay() {
    let run = Run::starting(5.3, 0.0, 100.0);
    let orbit = simulate(&Oscillator::new(0.0, 0.0, Coulomb::new(0.5)), run).unwrap();
    let reverses: Vec<f64> = orbit.events.iter().map(|event| event.x).collect();
    assert_eq!(reverses.len(), 5);
    for (got, expected) in reverses.iter().zip([-4.3, 3.3, -2.3, 1.3, -0.3]) {
        close(*got, expected);
    }
    let stop = orbit.events.last().unwrap();
    assert_eq!(stop.kind, Kind::Capture);
    close(stop.t, 15.707_963_267_948_966);
}

/// Closed form with viscous damping (computed in 30 digits).
#[test]
fn s2_coulomb_viscous_decay() {
    let run = Run::starting(5.3, 0.0, 100.0);
    let orbit = simulate(&Oscillator::new(0.1, 0.0, Coulomb::new(0.5)), run).unwrap();
    let reverses: Vec<f64> = orbit.events.iter().map(|event| event.x).collect();
    let expected = [
        -3.601_445_886_432_4,
        2.150_085_931_854_4,
        -0.909_945_449_471_71,
        -0.149_714_775_542_2,
    ];
    assert_eq!(reverses.len(), 4);
    for (got, expected) in reverses.iter().zip(expected) {
        close(*got, expected);
    }
    close(orbit.events.last().unwrap().t, 12.582_108_091_552_007);
}

/// Undamped belt with static and kinetic friction, closed form (Andronov, Vitt & Khaikin).
#[test]
fn s3_belt_static_kinetic() {
    let law = StaticKinetic::new(1.0, 0.6);
    let orbit = simulate(&Oscillator::new(0.0, 0.2, law), Run::stuck(100.0)).unwrap();
    let (release, capture, next) = cycle(&orbit);
    close(capture.t - release.t, 4.068_887_871_591_405);
    close(next.stick_time, 4.0);
    close(next.t - release.t, 8.068_887_871_591_405);
    let times: Vec<f64> = (0..=40_000).map(|i| release.t + f64::from(i) * 2.2e-4).collect();
    let states = orbit.states(&times);
    let most = |pick: fn(&stickslip::orbit::State) -> f64| states.iter().map(pick).fold(f64::MIN, f64::max);
    assert!((most(|state| state.x) - 1.047_213_595_499_958).abs() < 1e-8);
    assert!((-most(|state| -state.x) - 0.152_786_404_500_042_05).abs() < 1e-8);
    assert!((-most(|state| -state.v) + 0.447_213_595_499_957_9).abs() < 1e-8);
}

/// The same with viscous damping.
#[test]
fn s3b_belt_static_kinetic_damped() {
    let law = StaticKinetic::new(1.0, 0.6);
    let orbit = simulate(&Oscillator::new(0.1, 0.2, law), Run::stuck(100.0)).unwrap();
    let (release, capture, next) = cycle(&orbit);
    close(capture.t - release.t, 4.218_101_414_516_002);
    close(capture.x, 0.296_700_083_188_415_9);
    close(next.stick_time, 3.416_499_584_057_921);
    close(next.t - release.t, 7.634_600_998_573_922);
}

/// Static friction that grows with rest: the map of the break-away force (Brockley, Cameron & Potter 1967).
#[test]
fn s15_dwell_time_map() {
    let law = DwellTime::new(0.5, 0.5, 0.4, 1.0);
    let orbit = simulate(&Oscillator::new(0.0, 0.3, law), Run::stuck(1000.0)).unwrap();
    let (release, _, next) = cycle(&orbit);
    close(next.force - 0.5, 0.227_197_491_719_625_1);
    close(next.stick_time, 1.514_649_944_797_501);
    close(next.t - release.t, 6.501_489_987_952_009);
    // The multiplier, from how the first cycles approach the last.
    let force: Vec<f64> = of_kind(&orbit, Kind::Release)
        .iter()
        .map(|event| event.force - next.force)
        .collect();
    let ratio = force[16] / force[15];
    assert!((ratio - 0.571_676_324_821_628_7).abs() < 1e-3, "{ratio}");
}

/// Beyond the critical velocity 0.4 of S15 stick-slip dies out.
#[test]
fn s15_critical_velocity() {
    let law = DwellTime::new(0.5, 0.5, 0.4, 1.0);
    let grown = |drive_velocity: f64| {
        let orbit = simulate(
            &Oscillator::new(0.0, drive_velocity, law.clone()),
            Run::stuck(20_000.0),
        )
        .unwrap();
        of_kind(&orbit, Kind::Release).last().unwrap().force - 0.5
    };
    assert!(grown(0.39) > 1e-2);
    assert!(grown(0.41) < 1e-6);
}

/// Stribeck friction in two linear pieces.
#[test]
fn s16_piecewise_linear_stribeck() {
    let law = PiecewiseLinear::new(vec![[0.0, 1.0], [0.2, 0.6], [0.3, 0.61]], 1.0);
    let orbit = simulate(&Oscillator::new(0.05, 0.3, law), Run::stuck(100.0)).unwrap();
    let (release, capture, next) = cycle(&orbit);
    let nodes: Vec<f64> = of_kind(&orbit, Kind::Node)
        .iter()
        .map(|event| event.t)
        .filter(|t| (release.t..capture.t).contains(t))
        .collect();
    assert_eq!(nodes.len(), 2);
    close(nodes[0] - release.t, 0.864_970_503_884_953_8);
    close(nodes[1] - nodes[0], 3.536_793_957_955_501);
    close(capture.t - nodes[1], 0.337_532_682_562_858_9);
    close(capture.t - release.t, 4.739_297_144_403_314);
    close(capture.x, 0.217_476_390_343_187_25);
    close(next.stick_time, 2.558_412_032_189_375_7);
    close(next.t - release.t, 7.297_709_176_592_689);
}

fn forced(frequency: f64, kinetic: f64, damping: f64, t_end: f64) -> Orbit {
    let mut oscillator = Oscillator::new(damping, 0.0, Coulomb::new(kinetic));
    oscillator.forcing = vec![Harmonic::new(1.0, frequency, 0.0)];
    simulate(&oscillator, Run::stuck(t_end)).unwrap()
}

/// The largest |x| where the mass turns or stops, late in the run.
fn amplitude(orbit: &Orbit) -> f64 {
    let late = 0.95 * orbit.run.t_end;
    orbit
        .events
        .iter()
        .filter(|event| event.t > late)
        .map(|event| event.x.abs())
        .fold(0.0, f64::max)
}

/// Forced Coulomb oscillator without sticking, closed form (Den Hartog, Trans. ASME 53 (1931) 107).
#[test]
fn s10_den_hartog() {
    close(amplitude(&forced(0.7, 0.3, 0.0, 20_000.0)), 1.885_699_850_414_254);
    close(
        amplitude(&forced(2.0, 0.2, 0.0, 20_000.0)),
        0.317_979_733_805_648_5,
    );
    close(amplitude(&forced(0.7, 0.3, 0.2, 2_000.0)), 1.630_786_095_798_15);
}

/// Forced Coulomb oscillator with two and with four stops in a period (Hong & Liu, J. Sound Vib. 229 (2000) 1171).
#[test]
fn s11_hong_liu() {
    let orbit = forced(0.5, 0.8, 0.0, 2_000.0);
    close(amplitude(&orbit), 1.020_785_173_611_162_2);
    close(
        of_kind(&orbit, Kind::Release).last().unwrap().stick_time,
        1.876_301_366_968_799_3,
    );
    let orbit = forced(0.2, 0.4, 0.0, 3_000.0);
    let stops: Vec<f64> = of_kind(&orbit, Kind::Capture)
        .iter()
        .rev()
        .take(4)
        .map(|event| event.x.abs())
        .collect();
    let (high, low) = (
        stops.iter().copied().fold(0.0, f64::max),
        stops.iter().copied().fold(9.0, f64::min),
    );
    close(high, 0.652_046_061_392);
    close(low, 0.528_984_961_496);
}

/// A forcing of no amplitude changes no event: the marching search agrees with the closed one.
#[test]
fn forced_search_agrees_with_the_closed_one() {
    let paper = stickslip::law::BogaczRyczek::default();
    let laws: [Law; 3] = [
        StaticKinetic::new(1.0, 0.6).into(),
        DwellTime::new(0.5, 0.5, 0.4, 0.6).into(),
        paper.into(),
    ];
    for law in laws {
        for drive_velocity in [0.1, 0.24, 0.3, 0.38] {
            let free = Oscillator::new(0.28, drive_velocity, law.clone());
            let forcing = vec![Harmonic::new(0.0, 0.9, 0.3)];
            let forced = Oscillator {
                forcing,
                ..free.clone()
            };
            let run = Run::stuck(100.0);
            let (one, two) = (simulate(&free, run).unwrap(), simulate(&forced, run).unwrap());
            assert_eq!(one.events.len(), two.events.len(), "{law:?} at {drive_velocity}");
            for (a, b) in one.events.iter().zip(&two.events) {
                assert_eq!(a.kind, b.kind);
                assert!(
                    (a.t - b.t).abs() < 1e-9 && (a.x - b.x).abs() < 1e-9,
                    "{a:?} {b:?}"
                );
            }
        }
    }
}
