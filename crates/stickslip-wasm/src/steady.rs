//! Questions about steady motions over parameters and starts: orbit diagrams, regime maps, basins.

use serde::Deserialize;
use serde_json::{Value, json};
use stickslip::model::Start;
use stickslip::regime::Regime;
use stickslip::rows::Rows;
use stickslip::sweep::{Link, Look, Sweep};

use crate::Desk;
use crate::ask::{read, sentence};

#[derive(Deserialize)]
struct Ask {
    system: Value,
    /// What is varied: paths in the document, `x0` and `v0`.
    names: Vec<String>,
    /// The values, a row for each motion.
    values: Vec<f64>,
    look: Look,
    /// Whether each motion starts where the one before ended.
    #[serde(default)]
    chain: bool,
    /// Whether the first does so too: where the last chain that was asked for ended.
    #[serde(default)]
    go_on: bool,
    #[serde(default)]
    x0: f64,
    #[serde(default)]
    v0: Option<f64>,
    /// How often a motion may ask whether to go on: a limit that is the same on every machine.
    patience: u64,
}

/// For each motion: regime, period, chaos, share of sticks, x_min, x_max, period_time, mean x in the section, the numbers of
/// section points and of turning points of w; then the section points, x and v in turn, and the turning points.
pub(crate) fn rows(desk: &mut Desk) -> Result<Value, String> {
    let ask: Ask = read(&desk.question)?;
    let sweep = Sweep {
        rows: Rows {
            document: ask.system,
            names: ask.names,
            values: ask.values,
        },
        look: ask.look,
    };
    let (mut begin, mut before) = if ask.go_on {
        desk.chain.take().unwrap_or_default()
    } else {
        let begin = Start {
            x: vec![ask.x0],
            v: ask.v0.into_iter().collect(),
            restart: None,
        };
        (begin, None)
    };
    let mut events = 0;
    for index in 0..sweep.rows.len() {
        let mut left = ask.patience;
        let mut go_on = || {
            left = left.saturating_sub(1);
            left > 0
        };
        let row = if ask.chain {
            sweep
                .chain(index..index + 1, begin.clone(), before, &mut go_on)
                .map(|mut rows| rows.remove(0))
        } else {
            sweep.row(index, &begin, &mut go_on)
        }
        .map_err(sentence)?;
        events += row.events;
        desk.numbers.extend([
            f64::from(row.regime as u8),
            f64::from(row.period),
            row.chaos,
            row.stuck_share,
            row.x[0],
            row.x[1],
            row.period_time,
            row.mean.0,
            row.section.len() as f64,
            row.extrema_w.len() as f64,
        ]);
        desk.numbers
            .extend(row.section.iter().flat_map(|point| [point.x, point.v]));
        desk.numbers.extend(&row.extrema_w);
        before = row.end.as_ref().map(|_| Link::new(sweep.rows.row(index), &row));
        if ask.chain {
            begin = row.end.as_ref().map(Start::after).unwrap_or_default();
        }
    }
    if ask.chain {
        desk.chain = Some((begin, before));
    }
    Ok(json!({"events": events, "regimes": Regime::ALL.map(Regime::name)}))
}
