//! Spots in pictures, as the tracker measures them: outline, ground and centre. The formulas are those in
//! `tracking/finding/blobs.py`, in loops over a few thousand pixels for every marker of every picture.
#![expect(
    clippy::needless_pass_by_value,
    reason = "views of arrays are two words and a pointer"
)]

use std::f64::consts::PI;

use numpy::ndarray::{Array2, ArrayView2, Axis, Zip, s};
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;
use stickslip::elementary::{exp, hypot, ln};

/// Shares within the noise of the ground, up to a tenth, are left out, which jumps from picture to picture: errors are larger
/// than by the rim's noise alone.
const JUMPS: f64 = 1.0;
/// A ground that scatters by no more than this share of a blob's contrast is even: only the light varies on it.
const EVEN: f64 = 0.08;
/// Diameters of one spot in successive pictures differ by less than this factor.
pub(crate) const ALIKE: f64 = 1.5;
/// Shares of its contrast below its crown at which a spot that is known is cut out.
const DEPTHS: [f64; 3] = [0.5, 0.3, 0.7];
/// One that has this share of its last score is the same, and not looked for at another depth.
const SAME: f64 = 0.9;
/// Pixels of ground at least around a spot, which its contrast is over.
const LEAST_GROUND: u32 = 12;
/// Pixels up to which apart a ground with texture may be alike.
const REACH: usize = 12;
/// Smaller correlations may be those of the few pixels around a spot.
const LEAST_CORRELATION: f64 = 0.15;
/// Of a centre in px.
pub(crate) const LEAST_ERROR: f64 = 0.005;
/// Pixels of a line that are summed side by side.
const LANES: usize = 16;

type Picture<'a> = ArrayView2<'a, u8>;

/// x, y, their errors, size, its error, contrast, score, label, whether an edge cuts x and y off: the `Row` of `detections.py`.
type Row = (f64, f64, f64, f64, f64, f64, f64, f64, i64, bool, bool);

/// A connected part of a cut picture: the height of the cut, the number of pixels, left, top, width and height of its box.
type Part = (f64, usize, usize, usize, usize, usize);

/// What is said of the markers: the response at their outline, their diameter, the response of what reflects no light.
type Known = (Option<f64>, Option<f64>, Option<f64>);

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "whole numbers of pixels, negative ones are none"
)]
fn whole(value: f64) -> usize {
    value as usize
}

/// Weights of a Gaussian in 256ths, rounded so that their sum is 256; OpenCV's for pictures of 8 bits.
fn gaussian(sigma: f64) -> Vec<u16> {
    let half = whole((6.0 * sigma + 1.0).round_ties_even()) / 2;
    let curve: Vec<f64> = (0..=half)
        .map(|i| (half - i) as f64 / sigma)
        .map(|off| exp(-off * off / 2.0))
        .collect();
    let sum = 2.0 * curve[..half].iter().sum::<f64>() + 1.0;
    let (mut weights, mut error, mut left) = (vec![0; 2 * half + 1], 0.0, 256);
    for i in 0..half {
        let exact = 256.0 * curve[i] / sum + error;
        let weight = exact.round_ties_even();
        error = exact - weight;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "at most 128"
        )]
        let weight = weight as u16;
        left -= 2 * weight;
        weights[i] = weight;
        weights[2 * half - i] = weight;
    }
    weights[half] = left;
    weights
}

/// Index `at` of a line of `count` that goes on as in a mirror at its first and last.
fn mirrored(at: isize, count: usize) -> usize {
    let period = 2 * count.cast_signed() - 2;
    let there = if period > 0 { at.rem_euclid(period) } else { 0 };
    there.min(period - there).max(0).unsigned_abs()
}

fn blur(picture: Picture<'_>, sigma: f64) -> Array2<u8> {
    let (high, wide) = picture.dim();
    if picture.is_empty() {
        return picture.to_owned();
    }
    let weights = gaussian(sigma);
    let reach = (weights.len() / 2).cast_signed();
    let padded = wide.next_multiple_of(LANES);
    let from = |count: usize| (-reach..count.cast_signed() + reach).map(move |at| mirrored(at, count));
    let columns: Vec<usize> = from(wide).collect();
    let mut line = vec![0_u16; padded + weights.len()];
    let mut across = Vec::with_capacity(high * padded);
    for row in picture.rows() {
        for (value, &column) in line.iter_mut().zip(&columns) {
            *value = row[column].into();
        }
        for first in (0..padded).step_by(LANES) {
            let mut sums = [0_u16; LANES];
            for (ahead, &weight) in line[first..].windows(LANES).zip(&weights) {
                for (sum, value) in sums.iter_mut().zip(ahead) {
                    *sum += weight * value;
                }
            }
            across.extend_from_slice(&sums);
        }
    }
    let rows: Vec<usize> = from(high).map(|row| row * padded).collect();
    let mut blurred = Vec::with_capacity(across.len());
    for near in rows.windows(weights.len()) {
        for first in (0..padded).step_by(LANES) {
            let mut sums = [1_u32 << 15; LANES];
            for (&row, &weight) in near.iter().zip(&weights) {
                for (sum, &value) in sums.iter_mut().zip(&across[row + first..][..LANES]) {
                    *sum += u32::from(weight) * u32::from(value);
                }
            }
            blurred.extend(sums.map(|sum| sum.to_le_bytes()[2]));
        }
    }
    let blurred =
        Array2::from_shape_vec((high, padded), blurred).expect("a row of sums for each of the picture");
    blurred.slice(s![.., ..wide]).to_owned()
}

/// The connected parts of what lies above a height, eight neighbours each, in the order of their first pixels; each with the
/// sums of its columns and rows. The numbers of a picture are those of the parts, from 1 on.
fn parts(picture: Picture<'_>, cut: f64) -> (Array2<u32>, Vec<(Part, [usize; 2])>) {
    let (high, wide) = picture.dim();
    let mut labels = picture.map(|&value| if f64::from(value) > cut { u32::MAX } else { 0 });
    let mut found = Vec::new();
    let mut open = Vec::new();
    for top in 0..high {
        for first in 0..wide {
            if labels[[top, first]] != u32::MAX {
                continue;
            }
            let label = 1 + u32::try_from(found.len()).unwrap_or(u32::MAX - 2);
            let (mut area, mut sums, mut left, mut right, mut bottom) = (0, [0, 0], first, first, top);
            labels[[top, first]] = label;
            open.push((top, first));
            while let Some((row, column)) = open.pop() {
                area += 1;
                sums = [sums[0] + column, sums[1] + row];
                (left, right, bottom) = (left.min(column), right.max(column), bottom.max(row));
                for y in row.saturating_sub(1)..(row + 2).min(high) {
                    for x in column.saturating_sub(1)..(column + 2).min(wide) {
                        if labels[[y, x]] == u32::MAX {
                            labels[[y, x]] = label;
                            open.push((y, x));
                        }
                    }
                }
            }
            found.push(((cut, area, left, top, right + 1 - left, bottom + 1 - top), sums));
        }
    }
    (labels, found)
}

/// Which pixels lie within `reach` rows and columns of one that is set.
fn dilated(mask: &Array2<bool>, reach: usize) -> Array2<bool> {
    let mut found = mask.clone();
    for axis in [Axis(0), Axis(1)] {
        for mut line in found.lanes_mut(axis) {
            let from: Vec<bool> = line.iter().copied().collect();
            // how many of the line from `reach` before to `reach` after are set
            let mut near = from.iter().take(reach).filter(|&&set| set).count();
            for (at, found) in line.iter_mut().enumerate() {
                near += usize::from(from.get(at + reach).is_some_and(|&set| set));
                *found = near > 0;
                near -= usize::from(at >= reach && from[at - reach]);
            }
        }
    }
    found
}

/// The first value up to which there are more than `count`.
fn passing(counts: &[u32], count: u32) -> Option<usize> {
    let mut below = 0;
    counts.iter().position(|more| {
        below += more;
        below > count
    })
}

/// How many values there are in a mask, their upper median, and the median of what they are off it, values taken as rounded.
fn levels(values: Picture<'_>, mask: &Array2<bool>) -> (u32, usize, f64) {
    let mut counts = [0_u32; 256];
    Zip::from(values)
        .and(mask)
        .for_each(|&value, &set| counts[usize::from(value)] += u32::from(set));
    let count: u32 = counts.iter().sum();
    let median = passing(&counts, count / 2).unwrap_or(255);
    let mut apart = [0_u32; 256];
    for (value, more) in counts.iter().enumerate() {
        apart[value.abs_diff(median)] += more;
    }
    let off = passing(&apart, count / 2).unwrap_or(256);
    let nearer: u32 = apart[..off.min(255)].iter().sum();
    let share = (0.5 * f64::from(count) - f64::from(nearer)) / f64::from(apart[off.min(255)].max(1));
    let width = if off == 0 { 0.5 } else { 1.0 };
    (
        count,
        median,
        (off as f64 - 0.5).max(0.0) + width * share.clamp(0.0, 1.0),
    )
}

/// Sums over a picture: of the weights, of these times x, y, x², y² and xy.
struct Moments {
    weight: f64,
    x: f64,
    y: f64,
    xx: f64,
    yy: f64,
    xy: f64,
}

impl Moments {
    fn of<T: Copy>(picture: &ArrayView2<'_, T>, weight: impl Fn(T) -> f64) -> Self {
        let mut all = [0.0; 6];
        for (row, y) in picture.rows().into_iter().zip((0_u32..).map(f64::from)) {
            let mut line = [0.0; 3];
            for (&value, x) in row.iter().zip((0_u32..).map(f64::from)) {
                let weight = weight(value);
                line = [line[0] + weight, line[1] + weight * x, line[2] + weight * x * x];
            }
            let sums = [
                line[0],
                line[1],
                line[0] * y,
                line[2],
                line[0] * y * y,
                line[1] * y,
            ];
            all.iter_mut().zip(sums).for_each(|(all, sum)| *all += sum);
        }
        let [weight, x, y, xx, yy, xy] = all;
        Self {
            weight,
            x,
            y,
            xx,
            yy,
            xy,
        }
    }

    /// The same about the centre: x and y are its position.
    fn central(&self) -> Self {
        let (x, y) = (self.x / self.weight, self.y / self.weight);
        let (xx, yy, xy) = (self.xx - self.x * x, self.yy - self.y * y, self.xy - self.x * y);
        Self {
            weight: self.weight,
            x,
            y,
            xx,
            yy,
            xy,
        }
    }
}

/// A plane over a picture, 0 at its centre: how much the light falls off.
struct Tilt {
    right: f64,
    down: f64,
    x: f64,
    y: f64,
}

impl Tilt {
    /// The plane through what is around a spot; None where that is no even ground but holds edges or texture.
    fn of(window: Picture<'_>, around: &Array2<bool>, count: u32, ground: f64, spread: f64) -> Option<Self> {
        let [low, high] = [-1.0, 1.0].map(|side| (ground + side * (3.0 * spread + 1.0)).round_ties_even());
        let mut plain = around.clone();
        plain.zip_mut_with(&window, |plain, &value| {
            *plain &= (low..=high).contains(&f64::from(value));
        });
        let of = Moments::of(&plain.view(), f64::from).central();
        if of.weight < 0.95 * f64::from(count) {
            return None;
        }
        let lit = Zip::from(window)
            .and(&plain)
            .map_collect(|&value, &plain| if plain { value } else { 0 });
        let bright = Moments::of(&lit.view(), f64::from);
        let determinant = of.xx * of.yy - of.xy * of.xy;
        if determinant <= 0.0 {
            return None;
        }
        let (x, y) = (bright.x - of.x * bright.weight, bright.y - of.y * bright.weight);
        let right = (x * of.yy - y * of.xy) / determinant;
        let down = (y * of.xx - x * of.xy) / determinant;
        Some(Self {
            right,
            down,
            x: of.x,
            y: of.y,
        })
    }
}

/// How alike noise is in pixels beside each other: the correlation of pixels that are (x, y) apart is `share` times that of its
/// part along rows at x times that along columns at y, from distance 1 on; without texture nothing is.
struct Texture {
    share: f64,
    rows: Vec<f64>,
    columns: Vec<f64>,
}

impl Texture {
    /// That of what a ground is off its median, NaN where there is none.
    fn of(off: &Array2<f64>) -> Self {
        let (count, sum) = off
            .iter()
            .filter(|off| !off.is_nan())
            .fold((0.0, 0.0), |(count, sum), off| (count + 1.0, sum + off));
        let off = &off.map(|off| off - sum / f64::max(count, 1.0));
        let [rows, columns] = [Axis(1), Axis(0)].map(|along| {
            let moment = |apart: usize| {
                let (mut pairs, mut sum) = (0_u32, 0.0);
                for line in off.lanes(along) {
                    let products = line
                        .iter()
                        .zip(line.iter().skip(apart))
                        .map(|(one, other)| one * other);
                    for product in products.filter(|product| !product.is_nan()) {
                        pairs += 1;
                        sum += product;
                    }
                }
                (pairs >= LEAST_GROUND).then(|| sum / f64::from(pairs))
            };
            let square = moment(0).unwrap_or(f64::INFINITY);
            (1..=REACH)
                .map_while(|apart| Some(moment(apart)? / square))
                .take_while(|&alike| alike > LEAST_CORRELATION)
                .collect::<Vec<f64>>()
        });
        // the rest is noise that no two pixels share
        let share = [&rows, &columns]
            .iter()
            .filter_map(|alike| alike.first())
            .fold(0.0, |most, &alike| alike.clamp(most, 1.0));
        let part = |alike: Vec<f64>| alike.into_iter().map(|alike| (alike / share).min(1.0)).collect();
        Self {
            share,
            rows: part(rows),
            columns: part(columns),
        }
    }

    /// The variance of a sum of such noise with weights, over that of one pixel.
    fn variance(&self, weights: &Array2<f64>) -> f64 {
        let alone = weights.iter().map(|weight| weight * weight).sum();
        if self.share == 0.0 {
            return alone;
        }
        let mut sums = weights.clone();
        for (along, alike) in [(Axis(1), &self.rows), (Axis(0), &self.columns)] {
            let from = sums.clone();
            for (from, mut to) in from.lanes(along).into_iter().zip(sums.lanes_mut(along)) {
                for (apart, &alike) in (1..).zip(alike) {
                    for at in apart..from.len() {
                        to[at] += alike * from[at - apart];
                        to[at - apart] += alike * from[at];
                    }
                }
            }
        }
        alone + self.share * ((weights * &sums).sum() - alone).max(0.0)
    }
}

/// The spot itself; None where it has no ground or does not stand out.
fn centre(picture: Picture<'_>, work: Picture<'_>, half: Part, (level, wanted, black): Known) -> Option<Row> {
    let (high, wide) = picture.dim();
    let (cut, area, left, top, width, height) = half;
    let side = (area as f64).sqrt();
    let reach = (2 + whole((0.12 * side).ceil())).min(6);
    let ring = reach + 2 + whole((0.1 * side).ceil());
    let (first, above) = (left.saturating_sub(ring), top.saturating_sub(ring));
    let at = s![
        above..(top + height + ring).min(high),
        first..(left + width + ring).min(wide)
    ];
    let window = picture.slice(at);
    let (labels, found) = parts(work.slice(at), cut);
    let mut counts = vec![0_u32; found.len() + 1];
    let inside = labels.slice(s![top - above.., left - first..]);
    // a box that was found in every other pixel may end beyond the picture
    let (down, right) = (height.min(inside.nrows()), width.min(inside.ncols()));
    for &label in inside.slice(s![..down, ..right]) {
        counts[label as usize] += 1;
    }
    let most = (1..counts.len()).rev().max_by_key(|&label| counts[label])?;
    let core = labels.map(|&label| label as usize == most);
    let others = dilated(&labels.map(|&label| label != 0 && label as usize != most), 2);
    let near = dilated(&core, reach);
    let mut around = Zip::from(&near)
        .and(&others)
        .map_collect(|&near, &other| !(near || other));
    let (mut count, mut ground, mut off) = levels(window, &around);
    if count < LEAST_GROUND {
        around = near.map(|&near| !near);
        (count, ground, off) = levels(window, &around);
    }
    let ground = ground as f64;
    let contrast = levels(window, &core).1 as f64 - ground;
    if count < LEAST_GROUND || contrast <= 0.0 {
        return None;
    }
    let steep = (side / 16.0).clamp(1.0, 1.5);
    let spread = 1.4826 * off;
    // what rounding to whole grey levels adds is in it
    let noise = spread.max(0.4);
    let least = (3.0 * steep * noise / contrast).min(0.1);
    let tilt = (spread <= EVEN * contrast)
        .then(|| Tilt::of(window, &around, count, ground, spread))
        .flatten();
    let middle = level.map_or(0.5 * contrast, |level| level - ground);
    // what reflects little says little of the light
    let bright = black
        .map(|black| ground - black)
        .filter(|bright| bright.abs() > 0.5 * contrast);
    let tilted = |x: f64, y: f64| {
        tilt.as_ref()
            .map_or(0.0, |tilt| tilt.down * (y - tilt.y) + tilt.right * (x - tilt.x))
    };
    let share = |value: u8, x: f64, y: f64| {
        let off = tilted(x, y);
        let mut share = f64::from(value) - (ground + middle) - off;
        let mut slope = steep / contrast;
        if let Some(bright) = bright {
            let light = off / bright;
            slope /= 1.0 + light;
            if level.is_none() {
                share -= middle * light;
            }
        }
        let share = (share * slope + 0.5).clamp(0.0, 1.0);
        // the ground's noise far from the centre weighs most
        if share < least { 0.0 } else { share }
    };
    let shares = Array2::from_shape_fn(window.dim(), |at| {
        if near[at] && (core[at] || !others[at]) {
            share(window[at], at.1 as f64, at.0 as f64)
        } else {
            0.0
        }
    });
    // without corners, at which a rim that lies otherwise between the pixels would weigh otherwise
    let of = Moments::of(&shares.view(), |share| share * share * (3.0 - 2.0 * share)).central();
    let weight = of.weight;
    if weight <= 0.0 {
        return None;
    }
    let [xx, yy, xy] = [of.xx, of.yy, of.xy].map(|sum| sum / weight);
    let rough = JUMPS * steep * noise / (contrast * weight);
    let texture = Texture::of(&Array2::from_shape_fn(window.dim(), |at| {
        let off = f64::from(window[at]) - ground - tilted(at.1 as f64, at.0 as f64);
        if around[at] {
            off.clamp(-3.0 * noise, 3.0 * noise)
        } else {
            f64::NAN
        }
    }));
    let error = |away: &dyn Fn((usize, usize)) -> f64| {
        let weights = Array2::from_shape_fn(window.dim(), |at| {
            6.0 * shares[at] * (1.0 - shares[at]) * away(at)
        });
        rough * texture.variance(&weights).sqrt()
    };
    let right = error(&|(_, column)| column as f64 - of.x);
    let down = error(&|(row, _)| row as f64 - of.y);
    let determinant = (xx * yy - xy * xy).max(1e-12);
    let compact = (weight / (4.0 * PI * determinant.sqrt())).min(1.0);
    let longest = 0.5 * (xx + yy) + hypot(0.5 * (xx - yy), xy);
    let round = if longest > 0.0 {
        determinant.sqrt() / longest
    } else {
        1.0
    };
    let size = 2.0 * (weight / PI).sqrt();
    let mut score = contrast * compact * compact * round.sqrt() * size.sqrt().sqrt();
    if let Some(wanted) = wanted {
        let off = ln(size / wanted) / 0.4;
        score *= exp(-off * off);
    }
    Some((
        of.x + first as f64,
        of.y + above as f64,
        right.max(LEAST_ERROR),
        down.max(LEAST_ERROR),
        size,
        // a size grows with the root of the sum of weights
        0.5 * size * error(&|_| 1.0),
        contrast,
        score,
        -1,
        left == 0 || left + width >= wide,
        top == 0 || top + height >= high,
    ))
}

/// What is known of a spot from the picture before: its diameter, contrast and score.
#[derive(Clone, Copy, FromPyObject)]
pub(crate) struct Like {
    size: f64,
    contrast: f64,
    score: f64,
}

/// The spot nearest to a position, with the outline at one height; None where it is not like before, or not whole.
fn spot_at(
    picture: Picture<'_>,
    work: Picture<'_>,
    cut: f64,
    like: Like,
    position: (f64, f64),
    known: Known,
) -> Option<Row> {
    let usual = PI / 4.0 * like.size * like.size;
    let alike = usual / (ALIKE * ALIKE)..usual * (ALIKE * ALIKE);
    let away = |&(part, [x, y]): &(Part, [usize; 2])| {
        let area = part.1 as f64;
        hypot(x as f64 / area - position.0, y as f64 / area - position.1)
    };
    let (nearest, _) = parts(work, cut)
        .1
        .into_iter()
        .filter(|(part, _)| alike.contains(&(part.1 as f64)))
        .min_by(|one, other| away(one).total_cmp(&away(other)))?;
    let ratio = 1.0 / ALIKE..ALIKE;
    centre(picture, work, nearest, known)
        .filter(|row| !(row.9 || row.10) && ratio.contains(&(row.4 / like.size)))
}

fn nearest(
    picture: Picture<'_>,
    work: Picture<'_>,
    like: Like,
    position: (f64, f64),
    known: Known,
) -> Option<Row> {
    let crown = || {
        let mut counts = [0_u32; 256];
        // from the brightest on
        work.iter().for_each(|value| counts[usize::from(!value)] += 1);
        let half = (0.125 * PI * like.size * like.size).round_ties_even() - 1.0;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "pixels of a spot"
        )]
        let brighter = passing(&counts, half as u32).unwrap_or(255);
        255.0 - brighter as f64
    };
    let cuts = known.0.map_or_else(
        || {
            let crown = crown();
            DEPTHS.map(|share| crown - share * like.contrast).to_vec()
        },
        |level| vec![level],
    );
    let mut best: Option<Row> = None;
    for cut in cuts {
        let found = spot_at(picture, work, cut, like, position, known);
        best = found
            .filter(|found| best.is_none_or(|best| found.7 > best.7))
            .or(best);
        if best.is_some_and(|best| best.7 > SAME * like.score) {
            break;
        }
    }
    best
}

/// A picture blurred by a Gaussian, as OpenCV does it.
#[pyfunction]
pub(crate) fn blurred<'py>(
    py: Python<'py>,
    picture: PyReadonlyArray2<'py, u8>,
    sigma: f64,
) -> Bound<'py, PyArray2<u8>> {
    let picture = picture.as_array();
    py.detach(|| blur(picture, sigma)).into_pyarray(py)
}

/// The centre of a part of a picture whose outline was found in `work`; see `find_blobs`.
#[pyfunction]
pub(crate) fn spot_centre(
    py: Python<'_>,
    picture: PyReadonlyArray2<'_, u8>,
    work: PyReadonlyArray2<'_, u8>,
    part: Part,
    known: Known,
) -> Option<Row> {
    let (picture, work) = (picture.as_array(), work.as_array());
    py.detach(|| centre(picture, work, part, known))
}

/// The spot that is like one that was seen before; see `look_near`.
#[pyfunction]
pub(crate) fn spot_near(
    py: Python<'_>,
    picture: PyReadonlyArray2<'_, u8>,
    work: PyReadonlyArray2<'_, u8>,
    like: Like,
    position: (f64, f64),
    known: Known,
) -> Option<Row> {
    let (picture, work) = (picture.as_array(), work.as_array());
    py.detach(|| nearest(picture, work, like, position, known))
}
