//! A run of one mass that goes on from a hybrid state, and comes to one.

use super::{Loop, Run};
use crate::event::Start;
use crate::hybrid_state::HybridState;
use crate::mode::Mode;
use crate::observer::Observer;
use crate::orbit::{Event, Record};
use crate::oscillator::Oscillator;
use crate::simulate::Stop;
use crate::system::System;

/// Hands the one event on.
struct One<'a, R>(&'a mut R);

impl<R: Record> Observer for One<'_, R> {
    const PASSES: bool = false;

    fn event(&mut self, event: &Event) {
        self.0.event(*event);
    }

    fn go_on(&mut self) -> bool {
        self.0.go_on()
    }
}

/// Position, velocity and hybrid state after the next event of a motion from a hybrid state, if it occurs before `t_end` and
/// `record` goes on until then: as [`crate::simulate::next_event`] for motions that have no closed form.
pub(crate) fn next_event(
    oscillator: &Oscillator,
    at: (f64, f64),
    hybrid: &HybridState,
    (t_end, began): (f64, f64),
    record: &mut impl Record,
) -> Option<(f64, f64, HybridState)> {
    let system = System::from(oscillator);
    let mut state = Loop::resumed(&system, at, hybrid);
    // Whether it runs away is told by its whole run.
    state.began = Some(began);
    let run = Run {
        max_events: 1,
        ..Run::driven(t_end)
    };
    let stop = state.follow(&run, false, f64::NEG_INFINITY, &mut One(record));
    (stop == Stop::MaxEvents).then(|| {
        let ((x, v), hybrid) = state.at();
        (x, v, hybrid)
    })
}

/// The hybrid state where a run starts: as [`crate::simulate::first_hybrid_state`] for motions that have no closed form.
pub(crate) fn first_hybrid_state(oscillator: &Oscillator, x0: f64, v0: Option<f64>) -> HybridState {
    let system = System::from(oscillator);
    let run = Run {
        x0: Some(vec![x0]),
        v0: v0.map(|v0| vec![v0]),
        ..Run::driven(f64::INFINITY)
    };
    let mut state = Loop::new(&system, &run);
    state.start();
    state.at().1
}

impl<'a> Loop<'a> {
    /// From a hybrid state, that of the only contact.
    pub(crate) fn resumed(system: &'a System, (x, v): (f64, f64), hybrid: &HybridState) -> Self {
        let run = Run {
            x0: Some(vec![x]),
            v0: Some(vec![v]),
            ..Run::driven(f64::INFINITY)
        };
        let mut state = Self::new(system, &run);
        state.clock = hybrid.clock;
        let contact = &mut state.contacts[0];
        contact.memory = hybrid.memory;
        contact.stuck_since = hybrid.clock;
        if let Mode::Slip {
            direction,
            piece,
            start,
        } = hybrid.mode
        {
            (contact.direction, contact.piece) = (direction, piece);
            contact.at_reversal = start == Start::Reversal;
        }
        state
    }

    /// The size of the motion where the run began.
    pub(crate) fn began(&self) -> f64 {
        self.began.unwrap_or(self.scale)
    }

    /// Position and velocity of the only mass, and the hybrid state of the only contact.
    pub(crate) fn at(&mut self) -> ((f64, f64), HybridState) {
        // Only the series tells whether a slip begins without a slope.
        self.expand();
        let (contact, drive_velocity) = (&self.contacts[0], self.frame.drives[0].velocity);
        let (mut x, mut clock) = (self.x[0], self.clock);
        let mode = if contact.direction == 0.0 {
            // Where the stick began.
            x -= drive_velocity * self.stick_time(0);
            clock = contact.stuck_since;
            Mode::Stick
        } else {
            let at_zero = self.v[0] == drive_velocity;
            Mode::Slip {
                direction: contact.direction,
                piece: contact.piece,
                start: match (contact.at_reversal, at_zero) {
                    (true, _) => Start::Reversal,
                    (false, true) => Start::Low,
                    (false, false) => Start::Inside,
                },
            }
        };
        let hybrid = HybridState {
            clock,
            mode,
            memory: contact.memory,
        };
        ((x, self.v[0]), hybrid)
    }
}
