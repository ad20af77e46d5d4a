//! The questions, and those about a law alone.

use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use stickslip::law::{Friction, Law, Rest};
use stickslip::replay::force_along;
use stickslip::state_law::{StateFriction, StateLaw, follow};

use crate::{Desk, motion, steady};

pub(crate) fn answer(verb: u32, desk: &mut Desk) -> Result<Value, String> {
    match verb {
        0 => motion::orbit(desk),
        1 => motion::states(desk),
        2 => steady::rows(desk),
        3 => curve(desk),
        4 => surface(desk),
        5 => motion::lyapunov(desk),
        _ => Err(format!(
            "expected the number of a question from 0 to 5, got {verb}"
        )),
    }
}

pub(crate) fn read<T: DeserializeOwned>(question: &[u8]) -> Result<T, String> {
    serde_json::from_slice(question).map_err(sentence)
}

/// What a document says.
pub(crate) fn document<T: DeserializeOwned>(value: Value) -> Result<T, String> {
    serde_json::from_value(value).map_err(sentence)
}

#[expect(clippy::needless_pass_by_value, reason = "to be given to map_err")]
pub(crate) fn sentence(error: impl ToString) -> String {
    error.to_string()
}

#[derive(Deserialize)]
struct Curve {
    law: Value,
}

/// The friction force of a law along a slip velocity, from the columns t, w, stuck (0 or 1) and force rate; for a law with an
/// internal state also its state, from that of steady slip at the first slip velocity, a column for each of its numbers.
fn curve(desk: &mut Desk) -> Result<Value, String> {
    let ask: Curve = read(&desk.question)?;
    let (rows, rest) = (desk.columns.len() / 4, desk.columns.len() % 4);
    if rest > 0 {
        return Err(format!(
            "expected the columns t, w, stuck and force rate of one length, got {} numbers",
            desk.columns.len()
        ));
    }
    let column = |index: usize| &desk.columns[index * rows..][..rows];
    let (t, w) = (column(0), column(1));
    let state = StateLaw::in_document(&ask.law);
    if state {
        let law: StateLaw = document(ask.law)?;
        let mut start = vec![0.0; law.states()];
        law.steady(w.first().copied().unwrap_or(0.0), &mut start);
        let (force, state) = follow(&law, t, w, &start, &mut || true).map_err(sentence)?;
        desk.numbers.extend(force);
        for number in 0..start.len() {
            desk.numbers
                .extend(state.iter().skip(number).step_by(start.len()));
        }
    } else {
        let law: Law = document(ask.law)?;
        let stuck: Vec<bool> = column(2).iter().map(|&stuck| stuck != 0.0).collect();
        let force = force_along(&law, t, w, &stuck, column(3)).map_err(sentence)?;
        desk.numbers.extend(force);
    }
    Ok(json!({"state": state}))
}

#[derive(Deserialize)]
struct Surface {
    law: Value,
    stick_times: Vec<f64>,
    force_rates: Vec<f64>,
    /// Whether the two go together, one by one.
    #[serde(default)]
    pairs: bool,
}

/// Break-away force, a row for each force rate, or one of each pair.
fn surface(desk: &mut Desk) -> Result<Value, String> {
    let ask: Surface = read(&desk.question)?;
    if StateLaw::in_document(&ask.law) {
        return Err("a law with an internal state has no break-away force of its own: what adhesion bears depends on how it is loaded".into());
    }
    let law: Law = document(ask.law)?;
    law.validate().map_err(sentence)?;
    let mut add = |stick_time: f64, force_rate: f64| {
        desk.numbers.push(law.toward(force_rate).static_limit(Rest {
            stick_time,
            force_rate: force_rate.abs(),
        }));
    };
    if ask.pairs {
        for (&stick_time, &force_rate) in ask.stick_times.iter().zip(&ask.force_rates) {
            add(stick_time, force_rate);
        }
        return Ok(json!({}));
    }
    for &force_rate in &ask.force_rates {
        for &stick_time in &ask.stick_times {
            add(stick_time, force_rate);
        }
    }
    Ok(json!({}))
}
