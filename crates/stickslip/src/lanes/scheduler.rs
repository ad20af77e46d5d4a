//! The loop over many motions: it fills the lanes, takes them from mode to mode, and hands modes over to the engine of single
//! motions.

use std::marker::PhantomData;

use stickslip_lanes::{Lane, Mask, Task};

use super::curve_slip::OnLaneStep;
use super::eligible::Follows;
use super::lane_oscillator::{Constants, LaneOscillator, State};
use super::mode_end::{Kind, Occupant, Outcome, SlipPath};
use super::{LaneMotion, OnEvent, OnStep, Tally};
use crate::clock::Clock;
use crate::engine::steps::Track;
use crate::hybrid_state::HybridState;
use crate::network;
use crate::orbit::{Event, Record, Segment};
use crate::simulate::{lost, next_event};

/// Motions that wait for a lane.
pub(super) struct Scheduler<'a, 'b, 'c, K> {
    pub(super) motions: &'a mut [LaneMotion<'b>],
    /// Those that slip along something else stay.
    pub(super) follows: Follows,
    pub(super) kind: PhantomData<K>,
    pub(super) go_on: &'a mut dyn FnMut() -> bool,
    pub(super) on_event: Option<OnEvent<'c>>,
    /// Who is shown the steps along curves, of motions that then leave the lanes where a mode is handed over.
    pub(super) on_step: Option<OnStep<'c>>,
    pub(super) next: usize,
    pub(super) tally: Tally,
}

/// Keeps the event that one motion comes to.
struct EventKeeper<'a> {
    event: Option<Event>,
    go_on: &'a mut dyn FnMut() -> bool,
}

impl Record for EventKeeper<'_> {
    fn segment(&mut self, _: Segment) {}

    fn event(&mut self, event: Event) {
        self.event = Some(event);
    }

    fn go_on(&mut self) -> bool {
        (self.go_on)()
    }
}

impl<'b, K: Kind> Scheduler<'_, 'b, '_, K> {
    /// The next motion that goes in lanes.
    fn enter(&mut self) -> Option<(Occupant<'b>, State<f64>, HybridState)> {
        while let Some(motion) = self.motions.get(self.next) {
            self.next += 1;
            if Follows::of(motion.oscillator) != self.follows {
                continue;
            }
            if let Some(oscillator) = LaneOscillator::of(motion.oscillator)
                && lost(&[motion.x, motion.v]).is_none()
            {
                self.tally.lanes += 1;
                let (at, most) = ((motion.x, motion.v), motion.max_events);
                let state = State {
                    began: motion.began,
                    ..oscillator.state(at, &motion.hybrid, motion.t_end, most)
                };
                let occupant = Occupant {
                    index: self.next - 1,
                    oscillator,
                    law: &motion.oscillator.law,
                };
                return Some((occupant, state, motion.hybrid));
            }
            self.tally.others += 1;
        }
        None
    }

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a count of events, far below 2^53"
    )]
    fn leave(&mut self, occupant: &Occupant, at: (f64, f64, HybridState), events: f64) {
        let motion = &mut self.motions[occupant.index];
        // Along a curve a motion may have come on without an event.
        if events > 0.0 || occupant.oscillator.curve.is_some() {
            (motion.x, motion.v, motion.hybrid) = at;
            motion.events += events as u64;
            self.tally.events += events as u64;
        }
    }

    /// The state after the mode that begins at this one, as the engine of single motions finds it.
    #[cold]
    #[inline(never)]
    fn by_single_engine(
        &mut self,
        Occupant {
            index, oscillator, ..
        }: &Occupant,
        state: &State<f64>,
        (x, v, hybrid): (f64, f64, HybridState),
    ) -> Option<(State<f64>, HybridState)> {
        let motion = &self.motions[*index];
        let mut keeper = EventKeeper {
            event: None,
            go_on: self.go_on,
        };
        let next = if oscillator.curve.is_some() {
            network::next_event(
                motion.oscillator,
                (x, v),
                &hybrid,
                (motion.t_end, state.began),
                &mut keeper,
            )
        } else {
            next_event(motion.oscillator, (x, v), hybrid, motion.t_end, &mut keeper)
        };
        let (x, v, hybrid) = next?;
        self.tally.handed += 1;
        if let (Some(on_event), Some(event)) = (&mut self.on_event, keeper.event) {
            on_event(*index, &event, &Segment::new(hybrid.clock, x, v, &hybrid.mode));
        }
        let after = oscillator.state((x, v), &hybrid, motion.t_end, motion.max_events);
        let after = State {
            events: state.events + 1.0,
            began: state.began,
            ..after
        };
        Some((after, hybrid))
    }
}

impl<'b, K: Kind> Task for Scheduler<'_, 'b, '_, K> {
    type Output = Tally;

    #[inline(always)]
    fn run<L: Lane>(mut self) -> Tally {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let Some((first, at, hybrid)) = self.enter() else {
            return self.tally;
        };
        // Lanes that wait hold something sensible.
        let mut c = Constants::<L>::splat(&first.oscillator.constants);
        let mut current = K::Of::<L>::splat(&first.oscillator, at.line);
        let mut state = State::<L>::splat(&at);
        current.enter(0, &hybrid);
        let mut occupants: Vec<Option<Occupant<'b>>> = vec![None; L::WIDTH];
        occupants[0] = Some(first);
        let mut alive = L::Mask::none();
        alive.put(0, true);
        let mut done = !alive;
        let mut rounds = 0_u32;
        loop {
            rounds += 1;
            if rounds.is_multiple_of(32) && !(self.go_on)() {
                done = alive;
                self.next = self.motions.len();
            }
            let left =
                (state.end_periods - state.periods) * (c.period + c.period_low) + (state.end_t - state.t);
            done = done | (alive & (left.at_most(zero) | state.most.at_most(state.events + one)));
            if done.any() {
                for i in (0..L::WIDTH).filter(|&i| done.at(i)) {
                    if let Some(occupant) = occupants[i].take() {
                        let here = state.take(i);
                        let at = current.hybrid(i, &occupant.oscillator, &here);
                        self.leave(&occupant, at, here.events);
                    }
                    let next = self.enter();
                    alive.put(i, next.is_some());
                    if let Some((occupant, at, hybrid)) = next {
                        c.put(i, &occupant.oscillator.constants);
                        current.put(i, &occupant.oscillator, at.line);
                        state.put(i, &at);
                        current.enter(i, &hybrid);
                        occupants[i] = Some(occupant);
                    }
                }
                done = L::Mask::none();
                if !alive.any() {
                    return self.tally;
                }
                continue;
            }
            let stuck = zero.below(state.stuck) & alive;
            if stuck.any() {
                let before = self.on_step.is_some().then_some(state);
                let outcome = current.break_away(&c, &mut state, (left, stuck), &occupants);
                done = done | outcome.at_horizon;
                if let Some(before) = before {
                    self.show_sticks(&occupants, &c, &before, &outcome);
                }
                self.hand_over(
                    (&mut state, &mut current),
                    &mut done,
                    &occupants,
                    outcome.unsettled,
                );
                self.tell(&occupants, &c, (&state, &current), &outcome);
            }
            // What has just come loose slips on in the same round.
            let left =
                (state.end_periods - state.periods) * (c.period + c.period_low) + (state.end_t - state.t);
            let slips = !zero.below(state.stuck) & alive & !done & (state.events + one).below(state.most);
            if slips.any() {
                let others = slips & current.left_by(&state);
                if others.any() {
                    for i in (0..L::WIDTH).filter(|&i| others.at(i)) {
                        if let Some(Occupant { oscillator, .. }) = &occupants[i] {
                            current.put(i, oscillator, state.line.get(i));
                        }
                    }
                }
                let mut on_step = self.on_step.as_mut().map(|on_step| {
                    |i: usize, (periods, t), track, lasts| {
                        if let Some(Occupant {
                            index, oscillator, ..
                        }) = &occupants[i]
                        {
                            let clock = oscillator.clock(periods, t);
                            on_step(*index, clock, track, lasts);
                        }
                    }
                });
                let shown = on_step.as_mut().map(|on_step| on_step as OnLaneStep);
                let outcome = current.arrive(&c, &mut state, (left, slips), &occupants, shown);
                done = done | outcome.at_horizon;
                self.hand_over(
                    (&mut state, &mut current),
                    &mut done,
                    &occupants,
                    outcome.unsettled,
                );
                self.tell(&occupants, &c, (&state, &current), &outcome);
            }
        }
    }
}

impl<K: Kind> Scheduler<'_, '_, '_, K> {
    /// Give the lanes of `unsettled` to the engine of single motions for one mode; those whose mode lasts to the end are done.
    #[inline(always)]
    fn hand_over<L: Lane>(
        &mut self,
        (state, current): (&mut State<L>, &mut K::Of<L>),
        done: &mut L::Mask,
        occupants: &[Option<Occupant>],
        unsettled: L::Mask,
    ) {
        if !unsettled.any() {
            return;
        }
        for i in (0..L::WIDTH).filter(|&i| unsettled.at(i)) {
            let Some(occupant) = &occupants[i] else {
                continue;
            };
            let here = state.take(i);
            // A motion that is shown leaves the lanes here, and so does one that may run away, which is told by its whole run.
            let leaves = self.on_step.is_some() || occupant.oscillator.may_run_away(&here);
            let after = if leaves || current.leaves(i) {
                None
            } else {
                let at = current.hybrid(i, &occupant.oscillator, &here);
                self.by_single_engine(occupant, &here, at)
            };
            match after {
                Some((after, hybrid)) => {
                    state.put(i, &after);
                    current.enter(i, &hybrid);
                }
                None => done.put(i, true),
            }
        }
    }

    /// Show the sticks that ended, from where they began.
    #[cold]
    #[inline(never)]
    fn show_sticks<L: Lane>(
        &mut self,
        occupants: &[Option<Occupant>],
        c: &Constants<L>,
        before: &State<L>,
        outcome: &Outcome<L>,
    ) {
        let Some(on_step) = &mut self.on_step else {
            return;
        };
        for i in (0..L::WIDTH).filter(|&i| outcome.at_event.at(i)) {
            if let Some(Occupant {
                index, oscillator, ..
            }) = &occupants[i]
            {
                let clock = oscillator.clock(before.periods.get(i), before.t.get(i));
                let track = Track::of_stick(before.x.get(i), c.drive.get(i), oscillator.rate());
                on_step(*index, clock, track, outcome.event[1].get(i));
            }
        }
    }

    /// Tell of the events of lanes, at the states after them.
    #[inline(always)]
    fn tell<L: Lane>(
        &mut self,
        occupants: &[Option<Occupant>],
        c: &Constants<L>,
        (state, current): (&State<L>, &K::Of<L>),
        outcome: &Outcome<L>,
    ) {
        let Some(on_event) = &mut self.on_event else {
            return;
        };
        // Side by side: one after the other these sums would take a quarter of all the time.
        let (high, low) = state.clock(c);
        for i in (0..L::WIDTH).filter(|&i| outcome.at_event.at(i)) {
            let Some(Occupant {
                index, oscillator, ..
            }) = &occupants[i]
            else {
                continue;
            };
            let event = outcome.event.map(|number| number.get(i));
            let state = state.take(i);
            let clock = Clock {
                high: high.get(i),
                low: low.get(i),
            };
            let (event, segment) = current.event_row(i, oscillator, (clock, &state), event);
            on_event(*index, &event, &segment);
        }
    }
}
