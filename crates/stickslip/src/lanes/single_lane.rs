//! One motion in a lane of its own.

use stickslip_lanes::{Lane, Mask, Single};

use super::eligible::single_lane;
use super::lane_oscillator::{Constants, LaneOscillator, State};
use super::mode_end::{CurrentLine, SlipPath, arrive, break_away};
use crate::clock::Clock;
use crate::hybrid_state::HybridState;
use crate::law::Memory;
use crate::mode::Mode;
use crate::orbit::Event;
use crate::oscillator::Oscillator;

/// One motion by the arithmetic of the lanes: it has the same bits as in a sweep.
pub(crate) struct SingleLane {
    oscillator: LaneOscillator,
    constants: Constants<Single>,
    current: CurrentLine<Single>,
    state: State<Single>,
    /// Whether the state is where the motion is.
    state_is_valid: bool,
}

impl SingleLane {
    /// Of an oscillator of which a single motion goes in a lane ([`single_lane`]).
    pub(crate) fn of(oscillator: &Oscillator) -> Option<Box<Self>> {
        let oscillator = single_lane(oscillator)?;
        let start = HybridState {
            clock: Clock::default(),
            mode: Mode::Stick,
            memory: Memory::default(),
        };
        Some(Box::new(Self {
            constants: Constants::splat(&oscillator.constants),
            current: CurrentLine::splat(&oscillator, 0.0),
            state: State::splat(&oscillator.state((0.0, 0.0), &start, 0.0, 0)),
            state_is_valid: false,
            oscillator,
        }))
    }

    /// The event that ends the mode that begins at a position, velocity and hybrid state, which are those after it then. None
    /// where the mode lasts to the horizon or its end is not certified; they stay, but for rounding of the time.
    pub(crate) fn event(
        &mut self,
        at: &mut (f64, f64, HybridState),
        horizon: f64,
        evaluations: &mut u64,
    ) -> Option<Event> {
        if !self.state_is_valid {
            let state = self.oscillator.state((at.0, at.1), &at.2, 0.0, 0);
            self.state = State::splat(&state);
        }
        let (state, horizon) = (&mut self.state, Single::splat(horizon));
        let (mut all, zero) = (<Single as Lane>::Mask::none(), Single::splat(0.0));
        all.put(0, true);
        let outcome = if zero.below(state.stuck).any() {
            break_away(&self.constants, state, horizon, all)
        } else {
            if self.current.left_by(state).any() {
                self.current = CurrentLine::splat(&self.oscillator, state.line.get(0));
            }
            arrive(&self.constants, &self.current, state, horizon, all, None)
        };
        *evaluations += outcome.evaluations;
        self.state_is_valid = outcome.at_event.any();
        // Also where it stays: its clock is that of the lanes from here on, as in a sweep.
        let state = self.state.take(0);
        *at = self.oscillator.hybrid(&state);
        self.state_is_valid.then(|| {
            let event = outcome.event.map(|number| number.get(0));
            self.oscillator.event(at.2.clock, &state, event)
        })
    }
}
