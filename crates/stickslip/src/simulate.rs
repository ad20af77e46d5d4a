//! Runs of one mass in closed form: from where and how long.

mod one_mass;
mod stop;
pub mod watch;

use crate::clock::Clock;
use crate::error::{Error, finite, positive, wrong};
use crate::event::Work;
use crate::hybrid_state::{HybridState, Restart};
use crate::law::Friction;
use crate::network;
use crate::orbit::{Orbit, Record, While};
use crate::oscillator::{Oscillator, with_harmonics};
use one_mass::{Loop, Passed};
pub use stop::Stop;
pub(crate) use stop::lost;

/// Where and how long to run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Run {
    /// Position at t = 0.
    pub x0: f64,
    /// Velocity at t = 0; none: that of the drive.
    pub v0: Option<f64>,
    /// Time to run.
    pub t_end: f64,
    /// Most events.
    pub max_events: u64,
}

impl Run {
    /// From x = 0 at the velocity of the drive, for `t_end`.
    #[must_use]
    pub fn stuck(t_end: f64) -> Self {
        Self {
            x0: 0.0,
            v0: None,
            t_end,
            max_events: 10_000_000,
        }
    }

    /// From a position and a velocity, for `t_end`.
    #[must_use]
    pub fn starting(x0: f64, v0: f64, t_end: f64) -> Self {
        Self {
            x0,
            v0: Some(v0),
            ..Self::stuck(t_end)
        }
    }

    /// Of one mass, from a run of masses.
    #[must_use]
    pub fn of_one(run: &network::Run) -> Self {
        let first = |values: &Option<Vec<f64>>| values.as_ref().and_then(|values| values.first().copied());
        Self {
            x0: first(&run.x0).unwrap_or(0.0),
            v0: first(&run.v0),
            t_end: run.t_end,
            max_events: run.max_events,
        }
    }

    fn validate(&self) -> Result<(), Error> {
        finite("x0", self.x0)?;
        if let Some(v0) = self.v0 {
            finite("v0", v0)?;
        }
        positive("t_end", self.t_end).map(drop)
    }
}

/// Simulate and keep the whole orbit.
///
/// # Errors
/// The first value of the oscillator or the run that makes no sense.
pub fn simulate(oscillator: &Oscillator, run: Run) -> Result<Orbit, Error> {
    simulate_while(oscillator, run, || true)
}

/// The same, as long as `go_on` says so.
///
/// # Errors
/// The first value of the oscillator or the run that makes no sense.
pub fn simulate_while(
    oscillator: &Oscillator,
    run: Run,
    go_on: impl FnMut() -> bool,
) -> Result<Orbit, Error> {
    let mut orbit = Orbit::new(oscillator.clone(), run);
    let record = &mut orbit;
    (orbit.stop, orbit.work) = observe(oscillator, run, &mut While { record, go_on })?;
    Ok(orbit)
}

/// The same from where another motion ended, if any, and how this one goes on, if it reached its end.
///
/// # Errors
/// The first value of the oscillator or the run that makes no sense.
pub fn simulate_from(
    oscillator: &Oscillator,
    run: Run,
    from: Option<Restart>,
    go_on: impl FnMut() -> bool,
) -> Result<(Orbit, Option<Restart>), Error> {
    let orbit = if let Some(from) = from {
        let (x0, v0, hybrid) = from.hybrid(oscillator.drive_velocity, Clock::default());
        let v0 = Some(v0);
        let run = Run { x0, v0, ..run };
        oscillator.validate()?;
        run.validate()?;
        simulate_on(oscillator, run, hybrid, go_on)?
    } else {
        simulate_while(oscillator, run, go_on)?
    };
    let restart = orbit.restart();
    Ok((orbit, restart))
}

/// Go on from a hybrid state as [`resume`] does, and keep the whole orbit.
pub(crate) fn simulate_on(
    oscillator: &Oscillator,
    run: Run,
    hybrid: HybridState,
    go_on: impl FnMut() -> bool,
) -> Result<Orbit, Error> {
    let mut orbit = Orbit::new(oscillator.clone(), run);
    let record = &mut orbit;
    (orbit.stop, orbit.work) = resume(oscillator, run, hybrid, &mut While { record, go_on })?;
    Ok(orbit)
}

/// Simulate and tell `record` of every segment and event.
///
/// # Errors
/// The first value of the oscillator or the run that makes no sense.
pub fn observe(oscillator: &Oscillator, run: Run, record: &mut impl Record) -> Result<(Stop, Work), Error> {
    with_harmonics!(oscillator, H, observe_forced::<H>(oscillator, run, record))
}

/// The same by who knows the number of harmonics, so that a record that depends on it is not compiled for every other one too.
pub(crate) fn observe_forced<const H: usize>(
    oscillator: &Oscillator,
    run: Run,
    record: &mut impl Record,
) -> Result<(Stop, Work), Error> {
    oscillator.validate()?;
    run.validate()?;
    if oscillator.law.smooth() {
        // No closed form: the caller turns the oscillator into a system of one mass.
        return wrong("a smooth law has no closed form: simulate it as a system of one mass".into());
    }
    Loop::<H>::new(oscillator, run, Clock::default())
        .in_a_lane(oscillator)
        .go(run, record)
}

/// Go on from a hybrid state, with x and v of the run, until `run.t_end`, a time on the clock of the hybrid state, and tell `record`.
///
/// # Errors
/// A harmonic that meets an undamped resonance.
pub fn resume(
    oscillator: &Oscillator,
    run: Run,
    hybrid: HybridState,
    record: &mut impl Record,
) -> Result<(Stop, Work), Error> {
    with_harmonics!(oscillator, H, resume_forced::<H>(oscillator, run, hybrid, record))
}

/// The same by who knows the number of harmonics.
pub(crate) fn resume_forced<const H: usize>(
    oscillator: &Oscillator,
    run: Run,
    hybrid: HybridState,
    record: &mut impl Record,
) -> Result<(Stop, Work), Error> {
    let mut state = Loop::<H>::new(oscillator, run, hybrid.clock).in_a_lane(oscillator);
    state.memory = hybrid.memory;
    state.go_from(hybrid.mode, run, record)
}

/// The hybrid state where a run starts.
pub(crate) fn first_hybrid_state(oscillator: &Oscillator, run: Run) -> HybridState {
    fn hybrid<const H: usize>(oscillator: &Oscillator, run: Run) -> HybridState {
        let mut state = Loop::<H>::new(oscillator, run, Clock::default());
        let mode = state.first();
        state.hybrid(mode)
    }
    with_harmonics!(oscillator, H, hybrid::<H>(oscillator, run))
}

/// Position, velocity and hybrid state after the next event of a motion from a hybrid state, if it occurs before `t_end` and `record` goes
/// on until then.
pub(crate) fn next_event(
    oscillator: &Oscillator,
    (x, v): (f64, f64),
    hybrid: HybridState,
    t_end: f64,
    record: &mut impl Record,
) -> Option<(f64, f64, HybridState)> {
    fn next<const H: usize>(
        oscillator: &Oscillator,
        run: Run,
        hybrid: HybridState,
        record: &mut impl Record,
    ) -> Option<(f64, f64, HybridState)> {
        let mut state = Loop::<H>::new(oscillator, run, hybrid.clock);
        state.memory = hybrid.memory;
        let horizon = state.clock.until(run.t_end);
        let mut mode = hybrid.mode;
        match state.end_of(&mut mode, horizon, record) {
            Ok(Passed::Event) => Some((state.x, state.v, state.hybrid(mode))),
            _ => None,
        }
    }
    let run = Run {
        x0: x,
        v0: Some(v),
        t_end,
        max_events: 1,
    };
    with_harmonics!(oscillator, H, next::<H>(oscillator, run, hybrid, record))
}

/// So many events pass between two questions whether to go on; in less than a millionth of the natural time √(m/k) they are an
/// accumulation.
const EVENTS_BETWEEN_ASKS: u64 = 1000;
/// The most bytes that an orbit may take.
pub(crate) const MOST_BYTES: usize = 1 << 30;

#[cfg(test)]
mod tests {
    use super::{Run, observe_forced};
    use crate::harmonic::Harmonic;
    use crate::law::declaration::Parameters;
    use crate::law::{BogaczRyczek, DwellTime, ForceRate, Law, StaticKinetic};
    use crate::orbit::{Event, Record, Segment};
    use crate::oscillator::Oscillator;

    struct Events(Vec<Event>);

    impl Record for Events {
        fn segment(&mut self, _: Segment) {}

        fn event(&mut self, event: Event) {
            self.0.push(event);
        }
    }

    fn events<const H: usize>(oscillator: &Oscillator) -> Vec<Event> {
        let mut events = Events(Vec::new());
        observe_forced::<H>(oscillator, Run::stuck(400.0), &mut events).expect("a good run");
        events.0
    }

    #[test]
    fn slots_without_a_harmonic_change_no_bit() {
        let laws: [Law; 4] = [
            StaticKinetic::new(1.0, 0.5).into(),
            DwellTime::new(0.5, 0.5, 0.4, 1.0).into(),
            BogaczRyczek::default().into(),
            ForceRate::example().into(),
        ];
        for (law, damping) in laws.into_iter().flat_map(|law| [(law.clone(), 0.05), (law, 0.6)]) {
            let mut oscillator = Oscillator::new(damping, 0.3, law);
            oscillator.forcing = vec![Harmonic::new(0.5, 0.7, 0.3), Harmonic::new(0.2, 1.9, 0.0)];
            let two = events::<2>(&oscillator);
            assert!(two.len() > 30, "{}", two.len());
            assert_eq!(format!("{two:?}"), format!("{:?}", events::<4>(&oscillator)));
            oscillator.forcing.push(Harmonic::new(0.1, 0.2, 0.0));
            let three = events::<3>(&oscillator);
            assert_eq!(format!("{three:?}"), format!("{:?}", events::<4>(&oscillator)));
        }
    }
}
