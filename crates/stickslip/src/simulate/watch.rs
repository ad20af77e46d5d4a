//! Whether a run goes on, asked within every loop whose length nobody knows beforehand.

use std::ops::{Deref, DerefMut};

use crate::event::Work;

/// Rounds of a loop between two questions: below a millisecond even where a round is dear.
const ROUNDS_BETWEEN_ASKS: u32 = 1024;

/// The work of a search, and the question whether to go on with it.
pub struct Watched<'a> {
    work: &'a mut Work,
    go_on: &'a mut dyn FnMut() -> bool,
    left: u32,
    /// How far the search had come when it was ended, if it was.
    pub stopped: Option<f64>,
}

impl<'a> Watched<'a> {
    /// A search that counts its `work` and ends once `go_on` says no.
    pub fn new(work: &'a mut Work, go_on: &'a mut dyn FnMut() -> bool) -> Self {
        Self {
            work,
            go_on,
            left: ROUNDS_BETWEEN_ASKS,
            stopped: None,
        }
    }

    /// Whether the search is to end, having come to `t`; asked once a round.
    #[inline]
    pub fn ends(&mut self, t: f64) -> bool {
        self.left -= 1;
        self.left == 0 && self.ask(t)
    }

    #[cold]
    fn ask(&mut self, t: f64) -> bool {
        if self.stopped.is_none() && !(self.go_on)() {
            self.stopped = Some(t);
        }
        // A search within a search may have had the answer: the outer one has it at its next round, not after as many again.
        self.left = if self.stopped.is_some() {
            1
        } else {
            ROUNDS_BETWEEN_ASKS
        };
        self.stopped.is_some()
    }
}

impl Deref for Watched<'_> {
    type Target = Work;

    fn deref(&self) -> &Work {
        self.work
    }
}

impl DerefMut for Watched<'_> {
    fn deref_mut(&mut self) -> &mut Work {
        self.work
    }
}

#[cfg(test)]
mod tests {
    use super::{ROUNDS_BETWEEN_ASKS, Watched};
    use crate::event::Work;

    #[test]
    fn a_search_around_another_ends_too() {
        let (mut work, mut no) = (Work::default(), || false);
        let mut watched = Watched::new(&mut work, &mut no);
        // Two questions a round: the one of the inner search is the last of each thousand.
        let ended = (0..ROUNDS_BETWEEN_ASKS).find(|_| {
            let outer = watched.ends(0.0);
            watched.ends(0.0);
            outer
        });
        assert_eq!(ended, Some(ROUNDS_BETWEEN_ASKS / 2));
    }
}
