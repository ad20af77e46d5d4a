//! Where the sub-pixel centre of a spot is computed, and its standard error. (Markers of other kinds: `tracking/finding/`.)
//!
//! The centre is that of the response I above the ground around the spot, a plane (uneven light shifts a dark marker of 12 px
//! by 0.035 px otherwise); the contrast c grows and falls with the light, so where the response `black` of what reflects no
//! light is known it is proportional to the brightness |ground − black| (without that, light that falls by 10 % over 200 px
//! shifts a marker of 20 px by 0.008 px),
//!
//!     x_c = Σ x_i g_i / Σ g_i,   g = u² (3 − 2u),   u_i = clip(½ + s ((I_i − ground_i)/c_i − ½), 0, 1)
//!
//! with c = crown − ground, and s = 1 up to 16 px of diameter and 1.5 from 24 px on (then only the rim is weighed, not the
//! face's texture). Its standard error is that of the picture's noise around the spot, of standard deviation σ and of
//! correlation ρ_ij between two pixels (a ground with texture is alike from pixel to pixel, the noise of a camera is not),
//!
//!     σ_x = s σ/c √(Σ_ij q_i q_j ρ_ij) / Σ g_i,   q_i = g′(u_i) (x_i − x_c).
//!
//! With u as weight, centres depend on how the rim lies between the pixels: by 0.003 to 0.015 px for s = 1.67 to 2. All
//! lengths are in px, all responses in grey levels from 0 to 255.

use std::f64::consts::PI;

use numpy::ndarray::{Array2, Zip, s};
use stickslip::elementary::{exp, hypot, ln};

use super::ground::{LEAST_GROUND, dilated, level_and_scatter, plane};
use super::moments::Moments;
use super::parts::parts;
use super::texture::Texture;
use super::{Known, Part, Picture, Row, whole};

/// A ground that scatters by no more than this share of a blob's contrast is even: only the light varies on it.
const EVEN_GROUND: f64 = 0.08;
/// Of a centre in px.
pub(crate) const LEAST_ERROR: f64 = 0.005;

/// The spot itself; None where it has no ground or does not stand out.
pub(super) fn centre(
    picture: Picture<'_>,
    work: Picture<'_>,
    half: Part,
    (level, wanted, black): Known,
) -> Option<Row> {
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
    if picture.dim() != work.dim() || above >= high || first >= wide {
        return None;
    }
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
    let (mut count, mut ground, mut off) = level_and_scatter(window, &around);
    if count < LEAST_GROUND {
        around = near.map(|&near| !near);
        (count, ground, off) = level_and_scatter(window, &around);
    }
    let ground = ground as f64;
    let contrast = level_and_scatter(window, &core).1 as f64 - ground;
    if count < LEAST_GROUND || contrast <= 0.0 {
        return None;
    }
    let steep = (side / 16.0).clamp(1.0, 1.5);
    let spread = 1.4826 * off;
    // what rounding to whole grey levels adds is in it
    let noise = spread.max(0.4);
    let least = (3.0 * steep * noise / contrast).min(0.1);
    let light = (spread <= EVEN_GROUND * contrast)
        .then(|| plane(window, &around, count, ground, spread))
        .flatten()
        .unwrap_or_else(|| Array2::zeros(window.dim()));
    let off = Zip::from(window)
        .and(&light)
        .map_collect(|&value, light| f64::from(value) - ground - light);
    let middle = level.map_or(0.5 * contrast, |level| level - ground);
    // what reflects little says little of the light
    let bright = black
        .map(|black| ground - black)
        .filter(|bright| bright.abs() > 0.5 * contrast);
    let share = |off: f64, light: f64| {
        let mut share = off - middle;
        let mut slope = steep / contrast;
        if let Some(bright) = bright {
            let light = light / bright;
            slope /= 1.0 + light;
            if level.is_none() {
                share -= middle * light;
            }
        }
        let share = (share * slope + 0.5).clamp(0.0, 1.0);
        // the ground's noise far from the centre weighs most
        if share < least { 0.0 } else { share }
    };
    let own = Zip::from(&near)
        .and(&core)
        .and(&others)
        .map_collect(|&near, &core, &other| near && (core || !other));
    let shares = Zip::from(&off)
        .and(&light)
        .and(&own)
        .map_collect(|&off, &light, &own| if own { share(off, light) } else { 0.0 });
    // without corners, at which a rim that lies otherwise between the pixels would weigh otherwise
    let of = Moments::of(&shares.view(), |share| share * share * (3.0 - 2.0 * share)).central();
    let weight = of.weight;
    if weight <= 0.0 {
        return None;
    }
    let [xx, yy, xy] = [of.xx, of.yy, of.xy].map(|sum| sum / weight);
    let texture = Texture::of(&off.map(|off| off.clamp(-3.0 * noise, 3.0 * noise)), &around);
    // g′ but for s/c, which is in `rough`; the noise of a pixel moves the centre by as much times its distance
    let rim = shares.map(|share| 6.0 * share * (1.0 - share));
    let alone = Moments::of(&rim.view(), |rim| rim * rim);
    let [across, upright] = alone.about(of.x, of.y);
    let rough = steep * noise / (contrast * weight);
    let error = |alone: f64, [a, b, c]: [f64; 3]| {
        let weights = || {
            Zip::indexed(&rim)
                .map_collect(|(row, column), rim| rim * (a + b * column as f64 + c * row as f64))
        };
        rough * (alone + texture.shared(weights)).sqrt()
    };
    let right = error(across, [-of.x, 1.0, 0.0]);
    let down = error(upright, [-of.y, 0.0, 1.0]);
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
        0.5 * size * error(alone.weight, [1.0, 0.0, 0.0]),
        contrast,
        score,
        -1,
        left == 0 || left + width >= wide,
        top == 0 || top + height >= high,
    ))
}
