//! Many oscillators in SIMD lanes: one motion in each lane of the registers of a processor, from mode to mode.
//!
//! Which oscillators go in lanes is decided in one place, `lanes/eligible.rs` ([`goes_in_lanes`]). All others, and single modes
//! that a lane cannot go, are handled by the engine of single motions ([`crate::simulate`]). Both stand at the begin of a mode,
//! so one goes on from where the other is. A lane asks nothing of its neighbours, and has the same bits in every [`Width`].
//!
//! | file | one sentence |
//! |---|---|
//! | `eligible.rs` | which oscillators go in lanes |
//! | `scheduler.rs` | the loop that fills the lanes and takes them from mode to mode |
//! | `single_lane.rs` | one motion in a lane of its own |
//! | `mode_end.rs` | one mode, adhesion or slip, and the state at its end |
//! | `stick.rs`, `slip.rs` | when adhesion ends, and when slip leaves its line of friction |
//! | `branches.rs`, `branch_slip.rs` | laws that name the next line where one ends, and when slip between their branches ends |
//! | `curve.rs`, `curve_slip.rs` | a smooth curve and its Taylor series, and when slip along it ends |
//! | `lane_oscillator.rs` | the constants of an oscillator and the state of its motion, in lanes |
//! | `elementary.rs` | elementary functions in lanes |

mod branch_slip;
mod branches;
mod curve;
mod curve_slip;
mod elementary;
mod eligible;
mod lane_oscillator;
mod mode_end;
mod scheduler;
mod single_lane;
mod slip;
mod stick;

use std::cell::RefCell;
use std::marker::PhantomData;
use std::ops::AddAssign;

pub(crate) use eligible::ALL_GO;
pub use eligible::goes_in_lanes;
pub(crate) use single_lane::SingleLane;
pub use stickslip_lanes::Width;
use stickslip_lanes::run;

use crate::clock::Clock;
use crate::engine::steps::{PassedStep, Track, TrackStep};
use crate::hybrid_state::HybridState;
use crate::law::Friction;
use crate::model::Running;
use crate::network;
use crate::orbit::{Event, Segment};
use crate::oscillator::Oscillator;
use crate::simulate::{Run, first_hybrid_state};
use branches::Branches;
use eligible::{Follows, goes_in_a_single_lane};
use mode_end::{Curves, Kind, Lines};
use scheduler::Scheduler;

/// A motion at the begin of a mode, and how far it goes.
#[derive(Clone, Debug)]
pub struct LaneMotion<'a> {
    /// Its oscillator.
    pub oscillator: &'a Oscillator,
    /// Position.
    pub x: f64,
    /// Velocity.
    pub v: f64,
    /// Time and mode.
    pub hybrid: HybridState,
    /// The motion stops at the last begin of a mode before this time.
    pub t_end: f64,
    /// Or after so many events.
    pub max_events: u64,
    /// Events so far.
    pub events: u64,
    /// The speed of the motion where its run began.
    pub began: f64,
}

impl<'a> LaneMotion<'a> {
    /// From the start of a run, or from a hybrid state with the x and v of the run, to its end.
    #[must_use]
    pub fn new(oscillator: &'a Oscillator, run: Run, hybrid: Option<HybridState>) -> Self {
        let v = run.v0.unwrap_or(oscillator.drive_velocity);
        let natural = (oscillator.stiffness / oscillator.mass).sqrt();
        Self {
            oscillator,
            x: run.x0,
            v,
            hybrid: hybrid.unwrap_or_else(|| {
                if oscillator.law.smooth() {
                    network::first_hybrid_state(oscillator, run.x0, run.v0)
                } else {
                    first_hybrid_state(oscillator, run)
                }
            }),
            t_end: run.t_end,
            max_events: run.max_events,
            events: 0,
            began: (oscillator.drive_velocity.abs().max(v.abs())).max(natural * run.x0.abs()),
        }
    }
}

/// What motions in lanes have cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Motions that went in lanes.
    pub lanes: u64,
    /// Motions that do not go in lanes.
    pub others: u64,
    /// Events of those that did.
    pub events: u64,
    /// Events whose modes were handled by the engine of single motions.
    pub handed: u64,
}

impl AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.lanes += other.lanes;
        self.others += other.others;
        self.events += other.events;
        self.handed += other.handed;
    }
}

/// Whoever is told of the events, each with the number of its motion and the mode that follows.
pub type OnEvent<'a> = &'a mut dyn FnMut(usize, &Event, &Segment);

/// Whoever is shown the steps along curves: the number of the motion, when a step starts, what the motion is along it, and how long
/// it takes.
type OnStep<'a> = &'a mut dyn FnMut(usize, Clock, Track, f64);

/// So many events of a run are kept until it is looked at.
const MOST_EVENTS_KEPT: u64 = 1024;
/// And so many of one along a curve, with all its steps.
const MOST_CURVED_EVENTS_KEPT: u64 = 128;

/// Bring every motion that goes in lanes to the last begin of a mode before its end, or of a step along a curve, as long as
/// `go_on` says so; the others stay.
pub fn forward(
    motions: &mut [LaneMotion],
    width: Width,
    go_on: &mut dyn FnMut() -> bool,
    on_event: Option<OnEvent>,
) -> Tally {
    forward_shown(motions, width, go_on, on_event, None)
}

/// The same, and show the steps along curves.
fn forward_shown(
    motions: &mut [LaneMotion],
    width: Width,
    go_on: &mut dyn FnMut() -> bool,
    mut on_event: Option<OnEvent>,
    mut on_step: Option<OnStep>,
) -> Tally {
    let mut tally = Tally::default();
    let mut kinds: Vec<Follows> = Vec::new();
    for motion in &*motions {
        let follows = Follows::of(motion.oscillator);
        if !kinds.contains(&follows) {
            kinds.push(follows);
        }
    }
    for follows in kinds {
        let observers = (&mut on_event, &mut on_step);
        tally += match follows {
            // None of them goes in lanes then: said once more for the compiler.
            Follows::Curve(_) | Follows::Branches if !ALL_GO => Tally::default(),
            Follows::Curve(_) => scheduled::<Curves>(motions, width, go_on, observers, follows),
            Follows::Lines => scheduled::<Lines>(motions, width, go_on, observers, follows),
            Follows::Branches => scheduled::<Branches>(motions, width, go_on, observers, follows),
        };
    }
    tally
}

fn scheduled<K: Kind>(
    motions: &mut [LaneMotion],
    width: Width,
    go_on: &mut dyn FnMut() -> bool,
    (on_event, on_step): (&mut Option<OnEvent>, &mut Option<OnStep>),
    follows: Follows,
) -> Tally {
    let scheduler = Scheduler::<K> {
        motions,
        go_on,
        on_event: match on_event {
            Some(on_event) => Some(&mut **on_event),
            None => None,
        },
        on_step: match on_step {
            Some(on_step) => Some(&mut **on_step),
            None => None,
        },
        next: 0,
        follows,
        kind: PhantomData,
        tally: Tally::default(),
    };
    run(scheduler, width)
}

/// Bring many runs of models to the time that each has, in the width that suits their number.
pub(crate) fn forward_all(
    runs: &mut [(Running, f64)],
    go_on: &mut dyn FnMut() -> bool,
    on_event: Option<OnEvent>,
) -> Tally {
    let singles: Vec<_> = runs.iter().map(|(run, _)| run.smooth_oscillator()).collect();
    let (mut motions, indices) = motions_of(runs, &singles, goes_in_lanes);
    let width = Width::for_lanes(motions.len());
    let mut tally = match on_event {
        Some(on_event) => {
            let on_event: OnEvent = &mut |index, event, segment| on_event(indices[index], event, segment);
            forward(&mut motions, width, go_on, Some(on_event))
        }
        None => forward(&mut motions, width, go_on, None),
    };
    tally.others += (runs.len() - indices.len()) as u64;
    for (motion, index) in motions.iter().zip(indices) {
        match &mut runs[index].0 {
            Running::Closed(engine) => engine.take(motion, Vec::new()),
            Running::Steps(engine) => engine.take(motion, Vec::new()),
        }
    }
    tally
}

/// The same where they will be looked at: each shows what it passed, or the first of it, when it goes on. Those stay that do
/// not have these bits when they go alone.
pub(crate) fn forward_seen(runs: &mut [(Running, f64)], go_on: &mut dyn FnMut() -> bool) {
    let singles = vec![None; runs.len()];
    let (mut motions, indices) = motions_of(runs, &singles, goes_in_a_single_lane);
    let mut open: Vec<Segment> = Vec::with_capacity(motions.len());
    for motion in &mut motions {
        motion.max_events = motion.max_events.min(MOST_EVENTS_KEPT);
        let HybridState { clock, mode, .. } = &motion.hybrid;
        open.push(Segment::new(*clock, motion.x, motion.v, mode));
    }
    let mut passed = vec![Vec::new(); motions.len()];
    let on_event: OnEvent = &mut |index, event, segment| {
        let before = std::mem::replace(&mut open[index], *segment);
        passed[index].push((before, *event));
    };
    let width = Width::for_lanes(motions.len());
    forward(&mut motions, width, go_on, Some(on_event));
    for ((motion, passed), index) in motions.iter().zip(passed).zip(indices) {
        if let Running::Closed(engine) = &mut runs[index].0 {
            engine.take(motion, passed);
        }
    }
}

/// The same of smooth oscillators, few at a time: what their steps pass takes much room.
pub(crate) fn forward_seen_along_curves(runs: &mut [(Running, f64)], go_on: &mut dyn FnMut() -> bool) {
    let singles: Vec<_> = runs.iter().map(|(run, _)| run.smooth_oscillator()).collect();
    if !ALL_GO || singles.iter().all(Option::is_none) {
        return;
    }
    let (mut motions, indices) = motions_of(runs, &singles, |oscillator| {
        oscillator.law.smooth() && goes_in_lanes(oscillator)
    });
    for motion in &mut motions {
        motion.max_events = motion.max_events.min(MOST_CURVED_EVENTS_KEPT);
    }
    let passed = RefCell::new(vec![Vec::new(); motions.len()]);
    let on_step: OnStep = &mut |index, clock, track, lasts| {
        passed.borrow_mut()[index].push(PassedStep {
            step: TrackStep {
                clock,
                sticks: track.direction == 0.0,
                track,
            },
            lasts,
            event: None,
        });
    };
    let on_event: OnEvent = &mut |index, event, _| {
        if let Some(step) = passed.borrow_mut()[index].last_mut() {
            step.event = Some(*event);
        }
    };
    let width = Width::for_lanes(motions.len());
    forward_shown(&mut motions, width, go_on, Some(on_event), Some(on_step));
    for ((motion, mut passed), index) in motions.iter().zip(passed.into_inner()).zip(indices) {
        // Of a slip whose end lanes did not find the motion stands at its begin.
        let end = motion.hybrid.clock;
        passed.retain(|passed| passed.step.clock.until(end.high) + end.low > 0.0);
        if let Running::Steps(engine) = &mut runs[index].0 {
            engine.take(motion, passed);
        }
    }
}

/// The runs of the oscillators that a rule takes, of one mass in closed form or given as `singles`, and their numbers.
fn motions_of<'a, 'b: 'a>(
    runs: &mut [(Running<'b>, f64)],
    singles: &'a [Option<Oscillator>],
    takes: fn(&Oscillator) -> bool,
) -> (Vec<LaneMotion<'a>>, Vec<usize>) {
    let motions = runs.iter_mut().zip(singles).enumerate();
    let motions = motions.filter_map(|(index, ((run, t_end), single))| match (run, single) {
        (Running::Closed(engine), _) if takes(engine.oscillator()) => {
            Some((engine.lane_motion(*t_end), index))
        }
        (Running::Steps(engine), Some(oscillator)) if takes(oscillator) => {
            Some((engine.lane_motion(oscillator, *t_end), index))
        }
        _ => None,
    });
    motions.unzip()
}
