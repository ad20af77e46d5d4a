//! What a run is asked for while it runs. Nothing of the run is kept but what an observer keeps.
//!
//! # Write an observer; everything else works
//!
//! Implement [`Observer`]: `pass` sees the motion between two events as a [`Course`], `event` sees the events. Every
//! [`Engine`](crate::engine::Engine) feeds it, in closed form, by Taylor steps or from samples, so the same observer works for
//! one mass and many, and for laws of every kind. Give it to [`Engine::go`](crate::engine::Engine::go) for one run; call that
//! in a function of a row of [`Rows`](crate::rows::Rows) for many. [`crate::section`], [`crate::sweep`] and [`crate::batch`]
//! are written like that.
//!
//! ```
//! use stickslip::{engine::{Closed, Engine}, law::Coulomb, observer::{Course, Observer}, simulate::Run, oscillator::Oscillator};
//!
//! /// The time in which the first contact sticks.
//! struct Stuck(f64);
//! impl Observer for Stuck {
//!     fn pass(&mut self, course: &impl Course, (from, to): (f64, f64), _last: bool) {
//!         if course.sticks(0) {
//!             self.0 += to - from;
//!         }
//!     }
//! }
//!
//! let oscillator = Oscillator {
//!     mass: 1.0, stiffness: 1.0, damping: 0.0, drive_velocity: 0.2, law: Coulomb { kinetic: 0.6 }.into(), forcing: vec![],
//! };
//! let mut stuck = Stuck(0.0);
//! Closed::new(&oscillator, Run::stuck(2.0), None).go(2.0, 0.0, &mut stuck).unwrap();
//! assert_eq!(stuck.0, 2.0);
//! ```

pub mod lyapunov;
pub mod regime;
pub mod section;
pub mod steady_motion;
pub mod surface;
pub mod zero_one;

use crate::clock::Clock;
use crate::orbit::Event;
use crate::surface::{Cut, Point};
use crate::watch::Watched;

/// The motion between two events, or along one step of it, as any engine knows it. Times count from its start.
pub trait Course {
    /// When it starts.
    fn clock(&self) -> Clock;
    /// The state of the mass of a contact.
    fn point(&self, contact: usize, tau: f64) -> Point;
    /// Whether the contact sticks.
    fn sticks(&self, contact: usize) -> bool;
    /// Tell `found` of every point of `span` where the mass of the contact crosses one of one or two surfaces, and which: in the
    /// order of time for each of them.
    fn cross(
        &self,
        contact: usize,
        cuts: &mut [&mut Cut],
        span: (f64, f64),
        watched: &mut Watched,
        found: &mut dyn FnMut(usize, Point),
    );
}

/// Whoever looks at a run.
pub trait Observer {
    /// Whether the motion between the events is looked at; what is not need not be made.
    const PASSES: bool = true;
    /// The motion follows `course` from `span.0` to `span.1` after its start; `last` where the run ends.
    fn pass(&mut self, course: &impl Course, span: (f64, f64), last: bool) {
        let _ = (course, span, last);
    }
    /// An event occurred, in the course that passes next or the one that passed last.
    fn event(&mut self, event: &Event) {
        let _ = event;
    }
    /// Whether to go on; asked every thousand events or steps, and within a long search.
    fn go_on(&mut self) -> bool {
        true
    }
    /// Whether what is kept may not grow any more; asked as often.
    fn full(&self) -> bool {
        false
    }
}
