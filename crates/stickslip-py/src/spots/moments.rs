//! Sums over a picture.

use numpy::ndarray::ArrayView2;

/// Sums over a picture: of the weights, of these times x, y, x², y² and xy.
pub(super) struct Moments {
    pub(super) weight: f64,
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) xx: f64,
    pub(super) yy: f64,
    pub(super) xy: f64,
}

impl Moments {
    pub(super) fn of<T: Copy>(picture: &ArrayView2<'_, T>, weight: impl Fn(T) -> f64) -> Self {
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
    pub(super) fn central(&self) -> Self {
        let (x, y) = (self.x / self.weight, self.y / self.weight);
        Self {
            x,
            y,
            xx: self.xx - self.x * x,
            yy: self.yy - self.y * y,
            xy: self.xy - self.x * y,
            ..*self
        }
    }

    /// The sums of squares about a point.
    pub(super) fn about(&self, x: f64, y: f64) -> [f64; 2] {
        [
            self.xx - (2.0 * self.x - self.weight * x) * x,
            self.yy - (2.0 * self.y - self.weight * y) * y,
        ]
    }
}
