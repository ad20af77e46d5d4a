//! What the state of an oscillator is made of, and what an arc of its motion does and ends with.

use crate::dual::Dual;
use crate::law::End;

/// What a state is made of: t, x, v, the line of friction, the memory, when it stuck.
pub const WIDTH: usize = 13;
/// Those and one parameter: the directions of differentiation.
pub const LANES: usize = WIDTH + 1;
/// Where in the state the line of friction (the memory follows it) and the begin of adhesion stand.
pub(super) const LINE: usize = 3;
pub(super) const SINCE: usize = 12;

/// What a contact does along an arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Phase {
    /// It sticks.
    Stick,
    /// It slips in a direction.
    Slip(f64),
    /// It slips in a direction at a speed held between two branches.
    Hold(f64),
}

/// What ends an arc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ending {
    /// Adhesion breaks.
    Release,
    /// The line of friction ends, or friction leaves the hold over that end.
    Line(End),
    /// A turn of the slip speed of which the law is told nothing: a section.
    Section,
    /// A given time.
    Time,
}

/// One arc of a trail.
#[derive(Clone, Copy, Debug)]
pub struct Arc {
    /// What the contact does.
    pub phase: Phase,
    /// What ends it.
    pub ending: Ending,
    /// How long it took where it was taken from.
    pub duration: f64,
}

/// The state at the start of an arc.
#[derive(Clone, Copy, Debug)]
pub struct State<const N: usize> {
    /// t, x, v; offset, slope, low and high end of the line; anchor, corner, last break-away force; when it stuck.
    pub numbers: [Dual<N>; WIDTH],
    /// Branch of the law.
    pub branch: u32,
    /// Whether the law wants to know of turns.
    pub turns: bool,
    /// Whether the anchor was set by a break-away.
    pub released: bool,
}

impl<const N: usize> State<N> {
    /// The same state, every derivative forgotten and those in the given directions begun.
    pub(super) fn as_seeds<const M: usize>(&self) -> State<M> {
        let mut numbers = self.numbers.map(|number| Dual::fixed(number.value));
        for (lane, number) in numbers.iter_mut().enumerate() {
            if M > WIDTH && number.value.is_finite() {
                *number = Dual::along(number.value, lane);
            }
        }
        State {
            numbers,
            branch: self.branch,
            turns: self.turns,
            released: self.released,
        }
    }
}

/// How a start is found.
#[must_use]
pub fn state_of(values: &[f64; WIDTH], branch: u32, turns: bool, released: bool) -> State<LANES> {
    let plain = State::<0> {
        numbers: values.map(Dual::fixed),
        branch,
        turns,
        released,
    };
    plain.as_seeds()
}
