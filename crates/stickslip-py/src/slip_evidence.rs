//! How likely samples make a slip between two times, as `measurement/signals/slip_evidence.py` says it: a quintic spline by
//! banded orthogonal triangles, some ten thousand times for a record. Normal equations would lose half of the digits.
#![expect(
    clippy::needless_pass_by_value,
    reason = "views of arrays are two words and a pointer"
)]

use std::ops::Range;

use numpy::ndarray::ArrayView1;
use numpy::{PyReadonlyArray1, PyReadonlyArray3};
use pyo3::prelude::*;
use stickslip::elementary::{exp, ln};

const SPLINE_DEGREE: usize = 5;
/// Splines that an interval has.
const SPLINE_ORDER: usize = SPLINE_DEGREE + 1;
/// Legendre's five points in (-1, 1), and their weights.
const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.906_179_845_938_664, 0.236_926_885_056_189_08),
];
/// Of the largest number on the diagonal of a triangle: less than this is rounding.
const DIAGONAL_ROUNDING: f64 = 1e-14;

/// A number for each spline of an interval.
type Local = [f64; SPLINE_ORDER];
/// The splines of an interval as polynomials: their coefficients by power.
type Piece = [Local; SPLINE_ORDER];
/// Mass, damping, stiffness and drive velocity; noise, cut-off and sampling interval; slope of the fall and its decay.
type Model = ((f64, f64, f64, f64), (f64, f64, f64), (f64, f64));

/// The factors of splines next to each other, of the level of the stick, and the right side.
type Row = [f64; SPLINE_ORDER + 2];
/// An equation: the first spline it holds, and its row.
type Equation = (usize, Row);

/// Equations for splines made a triangle by rotations: each row begins at its diagonal.
#[derive(Clone)]
struct Triangle {
    rows: Vec<Row>,
}

impl Triangle {
    fn new(size: usize) -> Self {
        Self {
            rows: vec![[0.0; SPLINE_ORDER + 2]; size],
        }
    }

    /// Take an equation in; returns what no splines can take up of its right sides.
    ///
    /// Where equations come in the order of their first splines each meets at most `SPLINE_ORDER` rows.
    fn rotate(&mut self, (first, mut row): Equation) -> [f64; 2] {
        for line in &mut self.rows[first..] {
            if row[0] != 0.0 {
                if line[0] == 0.0 && line[1..SPLINE_ORDER] == [0.0; SPLINE_DEGREE] {
                    std::mem::swap(line, &mut row);
                    break;
                }
                let over = 1.0 / (line[0] * line[0] + row[0] * row[0]).sqrt();
                let (c, s) = (line[0] * over, row[0] * over);
                for (own, other) in line.iter_mut().zip(&mut row) {
                    (*own, *other) = (c * *own + s * *other, c * *other - s * *own);
                }
            }
            row.copy_within(1..SPLINE_ORDER, 0);
            row[SPLINE_DEGREE] = 0.0;
            if row[..SPLINE_ORDER] == [0.0; SPLINE_ORDER] {
                break;
            }
        }
        [row[SPLINE_ORDER], row[SPLINE_ORDER + 1]]
    }

    /// Log determinant of the sum of squares; None where the equations do not tell all splines.
    fn log(&self) -> Option<f64> {
        let sizes = || self.rows.iter().map(|line| line[0].abs());
        let least = DIAGONAL_ROUNDING * sizes().fold(0.0, f64::max);
        sizes()
            .all(|size| size > least)
            .then(|| 2.0 * sizes().map(ln).sum::<f64>())
    }
}

/// An equation in the splines that are free, the others being at the level of the stick.
fn tied(free: &Range<usize>, first: usize, all: Local, right: f64) -> Equation {
    let (from, mut row) = (first.max(free.start), [0.0; SPLINE_ORDER + 2]);
    for (column, value) in (first..).zip(all) {
        if free.contains(&column) {
            row[column - from] = value;
        } else {
            row[SPLINE_ORDER] += value;
        }
    }
    row[SPLINE_ORDER + 1] = right;
    (from - free.start, row)
}

/// Derivative of this order of the splines of an interval at a position in it.
fn derivative(piece: &Piece, order: usize, at: f64) -> Local {
    let mut found = [0.0; SPLINE_ORDER];
    for power in (order..SPLINE_ORDER).rev() {
        let falling = (power + 1 - order..=power).product::<usize>() as f64;
        for (value, coefficient) in found.iter_mut().zip(piece[power]) {
            *value = *value * at + falling * coefficient;
        }
    }
    found
}

fn scaled(row: Local, factor: f64) -> Local {
    row.map(|value| factor * value)
}

/// Index of the first time that is not before this one.
fn first_from(time: &ArrayView1<'_, f64>, at: f64) -> usize {
    let (mut low, mut high) = (0, time.len());
    while low < high {
        let middle = usize::midpoint(low, high);
        if time[middle] < at {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    low
}

/// The three numbers of an `Evidence`: see `SlipModel.slip`. `pieces` are those of splines on intervals of length one, (count,
/// power, spline). None where the samples do not tell the slip.
#[pyfunction]
pub(crate) fn slip_evidence(
    samples: (
        PyReadonlyArray1<'_, f64>,
        PyReadonlyArray1<'_, f64>,
        PyReadonlyArray1<'_, f64>,
    ),
    model: Model,
    pieces: PyReadonlyArray3<'_, f64>,
    limits: (f64, f64, f64),
    joined: &str,
    soft: bool,
) -> Option<(f64, f64, f64)> {
    let ((mass, damping, stiffness, drive), (noise, cutoff, step), (slope, decay)) = model;
    let (start, end, origin) = limits;
    let (time, path, weight) = (samples.0.as_array(), samples.1.as_array(), samples.2.as_array());
    let pieces: Vec<Piece> = (pieces.as_array().outer_iter())
        .map(|piece| std::array::from_fn(|power| std::array::from_fn(|j| piece[[power, j]])))
        .collect();
    let count = pieces.len();
    let (size, h) = (count + SPLINE_DEGREE, (end - start) / count as f64);
    // the stick holds u = U and u' = 0, and u'' = 0 at a soft joint
    let ends = if soft { 3 } else { 2 };
    let free = match joined {
        "start" => ends..size,
        "end" => 0..size - ends,
        _ => 0..size,
    };
    let mut sums = [0.0; 3];
    let mut take = |triangle: &mut Triangle, equation: Equation| {
        let [level, right] = triangle.rotate(equation);
        sums = [
            sums[0] + level * level,
            sums[1] + level * right,
            sums[2] + right * right,
        ];
    };
    // df/dt / m = target - sum_d factors[d] u^(d)
    let factors = [stiffness / mass / h, damping / mass / (h * h), 1.0 / (h * h * h)];
    let (target, rate) = (stiffness * drive / mass, (stiffness / mass).sqrt());
    let band = 2.0 * std::f64::consts::PI * cutoff;
    let strength = 1.0 / (step.sqrt() * (band * band * band) * noise);
    let mut walk = Triangle::new(free.len());
    for (interval, piece) in pieces.iter().enumerate() {
        for (node, share) in GAUSS {
            let inside = 0.5 + 0.5 * node;
            let since = h * (interval as f64 + inside);
            let softer = if soft {
                1.0 + 1.0 / (rate * since * (rate * since))
            } else {
                1.0
            };
            let root = strength * (h * 0.5 * share * softer).sqrt();
            let falls = if joined == "start" && slope != 0.0 {
                slope * exp(-decay * since) / mass / (h * h)
            } else {
                0.0
            };
            let [first, second, third] = [1, 2, 3].map(|order| derivative(piece, order, inside));
            let change = std::array::from_fn(|j| {
                root * (factors[0] * first[j] + (factors[1] + falls) * second[j] + factors[2] * third[j])
            });
            take(&mut walk, tied(&free, interval, change, root * target));
        }
    }
    // the walk alone leaves states open, which have a unit each
    let units = [rate, 1.0 / h, 1.0 / (h * h * rate)].map(|unit| unit / drive);
    let state = |order: usize, first: usize, at: f64| {
        let row = derivative(&pieces[first], order, at);
        tied(&free, first, scaled(row, units[order]), 0.0)
    };
    let held = match joined {
        "start" | "end" if soft => vec![],
        "start" => vec![state(2, 0, 0.0)],
        "end" => vec![state(2, count - 1, 1.0)],
        _ => (0..3).map(|order| state(order, 0, 0.0)).collect(),
    };
    let mut prior = walk.clone();
    let squares = |row: &Row| row[..SPLINE_ORDER].iter().map(|value| value * value).sum::<f64>();
    let mut scale = 1.0;
    if !held.is_empty() {
        scale = held.iter().map(|(_, row)| squares(row)).sum::<f64>()
            / walk.rows.iter().map(squares).sum::<f64>();
    }
    for (first, row) in &held {
        prior.rotate((*first, row.map(|value| value / scale.sqrt())));
    }
    let log_prior = prior.log()? + held.len() as f64 * ln(scale);
    let sampled = first_from(&time, start)..first_from(&time, end);
    let mut sampled = sampled
        .map(|i| {
            let position = (time[i] - start) / h;
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "positions lie in 0..count"
            )]
            let interval = (position as usize).min(count - 1);
            let row = derivative(&pieces[interval], 0, position - interval as f64);
            let root = weight[i].sqrt() / noise;
            tied(&free, interval, scaled(row, root), root * (path[i] - origin))
        })
        .peekable();
    // the walk and the samples in the order of their splines
    let mut slip = Triangle::new(free.len());
    for (first, row) in walk.rows.into_iter().enumerate() {
        take(&mut slip, (first, row));
        while let Some(equation) = sampled.next_if(|(begun, _)| *begun == first) {
            take(&mut slip, equation);
        }
    }
    let [square, linear, rest] = sums;
    Some((square, linear, rest + slip.log()? - log_prior))
}
