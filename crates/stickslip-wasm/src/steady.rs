//! Questions about steady motions over parameters and starts: orbit diagrams, regime maps, basins.

use serde::Deserialize;
use serde_json::{Value, json};
use stickslip::hybrid_state::Restart;
use stickslip::model::Start;
use stickslip::regime::Regime;
use stickslip::rosenbrock::Integration;
use stickslip::rows::Rows;
use stickslip::state_law::StateLaw;
use stickslip::steady_motion::{Look, Steady, steady};
use stickslip::sweep::{Link, Sweep};

use crate::Desk;
use crate::ask::{read, sentence};
use crate::motion::{Memory, TOLERANCE, numbers, state_system, variables};

/// Where a chain of motions has come to.
#[derive(Default)]
pub(crate) enum Chain {
    /// There is none.
    #[default]
    New,
    /// How the next one begins, and what the last one was.
    Events(Box<Start>, Option<Link>),
    /// The variables at the end of an integration.
    Integrated(Vec<f64>),
}

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
    /// What the first motion remembers of one that went before.
    #[serde(default)]
    memory: Option<Memory>,
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
    let before = if ask.go_on {
        std::mem::take(&mut desk.chain)
    } else {
        Chain::New
    };
    let memory = ask.memory.as_ref().map(numbers);
    let begin = Start {
        x: vec![ask.x0],
        v: ask.v0.into_iter().collect(),
        restart: memory.as_deref().and_then(Restart::read),
    };
    let mut at = match (before, StateLaw::in_document(&sweep.rows.document)) {
        (Chain::New, true) => Chain::Integrated(memory.unwrap_or_default()),
        (Chain::New, false) => Chain::Events(Box::new(begin.clone()), None),
        (before, _) => before,
    };
    let mut abreast = Vec::new().into_iter();
    if let (Chain::Events(..), false) = (&at, ask.chain) {
        // Each has its own patience, and in lanes that of all.
        let count = sweep.rows.len();
        let mut left = vec![ask.patience; count];
        let mut left_in_lanes = ask.patience * count as u64;
        let mut go_on = |row: Option<usize>| more(row.map_or(&mut left_in_lanes, |row| &mut left[row]));
        let rows = sweep.rows_asking(0..count, &begin, &mut go_on);
        abreast = rows.map_err(sentence)?.into_iter();
    }
    let mut events = 0;
    for index in 0..sweep.rows.len() {
        let mut left = ask.patience;
        let mut go_on = || more(&mut left);
        let (row, end) = match (&mut at, ask.chain) {
            (Chain::Integrated(y), _) => {
                let (row, end) = integrated(&sweep, index, &begin, y, &mut go_on)?;
                (row, Chain::Integrated(end))
            }
            (Chain::Events(start, before), true) => {
                let mut rows = sweep
                    .chain(index..index + 1, (**start).clone(), before.take(), &mut go_on)
                    .map_err(sentence)?;
                let row = rows.remove(0);
                let link = row.end.as_ref().map(|_| Link::new(sweep.rows.row(index), &row));
                let start = row.end.as_ref().map(Start::after).unwrap_or_default();
                (row, Chain::Events(Box::new(start), link))
            }
            _ => (abreast.next().expect("a motion for each row"), Chain::New),
        };
        if ask.chain {
            at = end;
        }
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
    }
    if ask.chain {
        desk.chain = at;
    }
    Ok(json!({"events": events, "regimes": Regime::ALL.map(Regime::name)}))
}

/// Whether there is patience left, of which this is a part.
fn more(left: &mut u64) -> bool {
    *left = left.saturating_sub(1);
    *left > 0
}

/// One motion under laws with an internal state, from the variables of one before where they fit, and its variables at the end.
fn integrated(
    sweep: &Sweep,
    index: usize,
    begin: &Start,
    before: &[f64],
    go_on: &mut dyn FnMut() -> bool,
) -> Result<(Steady, Vec<f64>), String> {
    let (document, starts) = sweep.rows.described(sweep.rows.row(index)).map_err(sentence)?;
    let system = state_system(&document)?;
    let mut begin = begin.clone();
    starts.begin(&mut begin, system.masses()).map_err(sentence)?;
    let given = |values: &'_ [f64]| (!values.is_empty()).then(|| values.to_vec());
    let (x, v) = (given(&begin.x), given(&begin.v));
    let y = variables(&system, (x.as_deref(), v.as_deref()), Some(before.to_vec()));
    let (period, surface) = (system.period(), system.usual_surface());
    // No finer than the integration is.
    let look = &Look {
        tolerance: sweep.look.tolerance.max(1e3 * TOLERANCE),
        ..sweep.look
    };
    look.within(system.contacts()).map_err(sentence)?;
    let integration = Integration::new(system, y, TOLERANCE).map_err(sentence)?;
    let mut engine = integration.of_contact(look.contact);
    let surface = look.surface.unwrap_or(surface);
    let row = steady(&mut engine, period, &surface, look, go_on).map_err(sentence)?;
    Ok((row, engine.last()))
}
