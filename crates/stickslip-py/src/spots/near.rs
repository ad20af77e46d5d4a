//! A spot that was seen before, looked for in a small window.

use std::f64::consts::PI;

use pyo3::FromPyObject;
use stickslip::elementary::hypot;

use super::centre::centre;
use super::ground::passing;
use super::parts::parts;
use super::{Known, Part, Picture, Row};

/// Diameters of one spot in successive pictures differ by less than this factor.
pub(crate) const ALIKE_DIAMETERS: f64 = 1.5;
/// Shares of its contrast below its crown at which a spot that is known is cut out.
const DEPTHS: [f64; 3] = [0.5, 0.3, 0.7];
/// One that has this share of its last score is the same, and not looked for at another depth.
const SAME_SCORE_SHARE: f64 = 0.9;

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
    let alike = usual / (ALIKE_DIAMETERS * ALIKE_DIAMETERS)..usual * (ALIKE_DIAMETERS * ALIKE_DIAMETERS);
    let away = |&(part, [x, y]): &(Part, [usize; 2])| {
        let area = part.1 as f64;
        hypot(x as f64 / area - position.0, y as f64 / area - position.1)
    };
    let (nearest, _) = parts(work, cut)
        .1
        .into_iter()
        .filter(|(part, _)| alike.contains(&(part.1 as f64)))
        .min_by(|one, other| away(one).total_cmp(&away(other)))?;
    let ratio = 1.0 / ALIKE_DIAMETERS..ALIKE_DIAMETERS;
    centre(picture, work, nearest, known)
        .filter(|row| !(row.9 || row.10) && ratio.contains(&(row.4 / like.size)))
}

/// The spot that is like one that was seen before, and nearest to a position: that of the best score of those cut out at some
/// depths.
pub(super) fn nearest(
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
        if best.is_some_and(|best| best.7 > SAME_SCORE_SHARE * like.score) {
            break;
        }
    }
    best
}
