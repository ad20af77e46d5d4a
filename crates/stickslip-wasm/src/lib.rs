//! The border to WebAssembly: a document goes in, a document and columns of numbers come out. No physics, and no unsafe block.
//!
//! A caller writes a question as JSON to where `question(len)` points, and its columns of f64, if it has any, to where
//! `columns(len)` does; it calls `answer(verb)` and reads `words()` (JSON: what the columns are; or the sentence of an error)
//! and `numbers()` (f64). JSON has no infinity and no not-a-number, so what holds them (orbits, how a motion goes on) stays
//! here between two questions.
#![warn(clippy::disallowed_methods)]

mod ask;
mod motion;
mod steady;

use std::cell::RefCell;

/// What lies between caller and module.
#[derive(Default)]
struct Desk {
    question: Vec<u8>,
    columns: Vec<f64>,
    words: Vec<u8>,
    numbers: Vec<f64>,
    /// The orbit that was simulated last.
    orbit: Option<motion::Orbit>,
    /// How the last motion of the last chain goes on.
    chain: steady::Chain,
}

thread_local! {
    static DESK: RefCell<Desk> = RefCell::default();
}

/// Where to write a question of `len` bytes.
#[unsafe(no_mangle)]
pub extern "C" fn question(len: usize) -> *mut u8 {
    DESK.with_borrow_mut(|desk| {
        desk.question.clear();
        desk.question.resize(len, 0);
        desk.question.as_mut_ptr()
    })
}

/// Where to write `len` numbers that belong to it, column after column.
#[unsafe(no_mangle)]
pub extern "C" fn columns(len: usize) -> *mut f64 {
    DESK.with_borrow_mut(|desk| {
        desk.columns.clear();
        desk.columns.resize(len, 0.0);
        desk.columns.as_mut_ptr()
    })
}

/// Answer it; 0 where that went well, 1 where `words` says what is wrong.
#[unsafe(no_mangle)]
pub extern "C" fn answer(verb: u32) -> u32 {
    DESK.with_borrow_mut(|desk| {
        desk.numbers.clear();
        let (bad, words) = match ask::answer(verb, desk) {
            Ok(words) => (0, words.to_string()),
            Err(sentence) => (1, sentence),
        };
        desk.words = words.into_bytes();
        bad
    })
}

/// Where the words lie.
#[unsafe(no_mangle)]
pub extern "C" fn words() -> *const u8 {
    DESK.with_borrow(|desk| desk.words.as_ptr())
}

/// How many bytes they are.
#[unsafe(no_mangle)]
pub extern "C" fn words_len() -> usize {
    DESK.with_borrow(|desk| desk.words.len())
}

/// Where the numbers lie.
#[unsafe(no_mangle)]
pub extern "C" fn numbers() -> *const f64 {
    DESK.with_borrow(|desk| desk.numbers.as_ptr())
}

/// How many they are.
#[unsafe(no_mangle)]
pub extern "C" fn numbers_len() -> usize {
    DESK.with_borrow(|desk| desk.numbers.len())
}
