//! Spots in pictures, as the tracker measures them, in loops over a few thousand pixels for every marker of every picture. A
//! spot's centre is computed in `centre.rs`.
#![expect(
    clippy::needless_pass_by_value,
    reason = "views of arrays are two words and a pointer"
)]

mod blur;
mod centre;
mod ground;
mod levels;
mod moments;
mod near;
mod parts;
mod texture;

use numpy::ndarray::ArrayView2;
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use blur::blur;
pub(crate) use centre::LEAST_ERROR;
use centre::centre;
pub(crate) use levels::spot_levels;
pub(crate) use near::ALIKE_DIAMETERS;
use near::{Like, nearest};

/// No outline is looked for in a picture that is blurred by as many px.
const MOST_SIGMA: f64 = 1000.0;

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

/// A picture blurred by a Gaussian, as OpenCV does it.
#[pyfunction]
pub(crate) fn blurred<'py>(
    py: Python<'py>,
    picture: PyReadonlyArray2<'py, u8>,
    sigma: f64,
) -> PyResult<Bound<'py, PyArray2<u8>>> {
    if !(sigma > 0.0 && sigma < MOST_SIGMA) {
        return Err(PyValueError::new_err(format!(
            "expected a sigma in px above 0 and below {MOST_SIGMA}, got {sigma}"
        )));
    }
    let picture = picture.as_array();
    Ok(py.detach(|| blur(picture, sigma)).into_pyarray(py))
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
