//! Kinetic friction by polynomials through nodes: any smooth function of the slip speed, as data.

use super::piecewise_linear::from_zero;
use super::static_kinetic::at_least_kinetic;
use super::{Friction, Memory, Piece, Point, Rest};
use crate::error::{Error, misshapen, wrong};
use crate::law::declaration::{Limited, parameters};
use crate::scalar::Scalar;
use crate::series::{Grown, Series, compose, nothing};

/// The highest degree of a polynomial.
const HIGHEST_DEGREE: usize = 16;

/// So far into the piece beside it, relative to its width, a polynomial may go on as the one there,
const STRIDE_SHARE: f64 = 0.02;
/// if they differ by no more than this share.
const SAME_PIECE_SHARE: f64 = 1e-13;

/// What the degree is where a document leaves it out.
#[expect(clippy::cast_precision_loss, reason = "a small whole number")]
fn highest<N: From<f64>>() -> N {
    (HIGHEST_DEGREE as f64).into()
}

parameters! {
    /// F(u) is the polynomial through nodes 0 to n on the first piece, through nodes n to 2n on the second, and so on; beyond the
    /// last node its tangent there goes on. |F| ≤ f_s at rest.
    pub struct PiecewisePolynomial<N> {
        /// Nodes (slip speed, kinetic force), the first at slip speed 0; n for each piece and one more.
        pub nodes: Vec<Point<N>> = vec![[0.0, 1.0], [0.15, 0.78], [0.5, 0.65], [0.85, 0.68], [1.0, 0.72]] => [SLIP_VELOCITY, NODE_FORCE],
        /// Break-away force f_s.
        pub break_away: N = 1.0 => [FORCE],
        /// Degree n of the polynomials.
        #[serde(default = "highest")]
        pub degree: N = 4.0 => [PURE.choices(&[2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0, 16.0])],
    }
}

impl<N: Scalar> PiecewisePolynomial<N> {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a small whole number"
    )]
    fn order(&self) -> usize {
        self.degree.value() as usize
    }

    /// The nodes of the piece around slip speed `u`; at a node between two pieces those above it.
    fn around(&self, u: N) -> &[Point<N>] {
        let n = self.order();
        let below = self.nodes.partition_point(|node| node[0] <= u).saturating_sub(1);
        let first = (below / n * n).min(self.nodes.len() - 1 - n);
        &self.nodes[first..=first + n]
    }

    fn top(&self) -> N {
        self.nodes[self.nodes.len() - 1][0]
    }

    /// The polynomial around slip speed `u`, and where on it `u` is: beyond the last node the tangent there goes on.
    fn polynomial(&self, u: N) -> (Newton<N>, N) {
        (Newton::through(self.around(u)), u.min(self.top()))
    }
}

/// The slip speeds between which a piece lies.
fn ends<N: Scalar>(nodes: &[Point<N>]) -> [N; 2] {
    [nodes[0][0], nodes[nodes.len() - 1][0]]
}

/// A polynomial by Newton's divided differences.
struct Newton<N> {
    at: [N; HIGHEST_DEGREE + 1],
    differences: [N; HIGHEST_DEGREE + 1],
    count: usize,
}

impl<N: Scalar> Newton<N> {
    /// Nodes are taken in the bit-reversed order of their numbers: so they are spread at every stage, and what is lost is of the
    /// size of rounding.
    fn through(nodes: &[Point<N>]) -> Self {
        let count = nodes.len();
        let (mut at, mut differences) = (
            [N::default(); HIGHEST_DEGREE + 1],
            [N::default(); HIGHEST_DEGREE + 1],
        );
        let spread = (0_u32..32).map(|i| (i.reverse_bits() >> 27) as usize);
        for (i, index) in spread.filter(|index| *index < count).enumerate() {
            [at[i], differences[i]] = nodes[index];
        }
        for stage in 1..count {
            for i in (stage..count).rev() {
                differences[i] = (differences[i] - differences[i - 1]) / (at[i] - at[i - stage]);
            }
        }
        Self {
            at,
            differences,
            count,
        }
    }

    /// How far beyond a knot a motion may go unseen, into the piece through `beside` of a width with the sign of the way, or into
    /// the tangent: hardly any distance, unless the one goes on as the other.
    fn stride(&self, beside: Option<&[Point<N>]>, knot: N, width: N) -> N {
        let at = knot + width * STRIDE_SHARE;
        let [here, slope] = self.value_and_slope(knot);
        let [ahead, _] = self.value_and_slope(at);
        let other = match beside {
            Some(nodes) => Self::through(nodes).value_and_slope(at)[0],
            None => here + slope * (at - knot),
        };
        let alike = (ahead - other).abs() <= (here.abs() + (ahead - here).abs()) * SAME_PIECE_SHARE;
        width.abs() * if alike { STRIDE_SHARE } else { 1e-10 }
    }

    fn value_and_slope(&self, u: N) -> [N; 2] {
        let (mut value, mut slope) = (N::default(), N::default());
        for i in (0..self.count).rev() {
            let away = u - self.at[i];
            slope = slope * away + value;
            value = value * away + self.differences[i];
        }
        [value, slope]
    }

    /// In powers of (· − u).
    fn powers(&self, u: N) -> [N; HIGHEST_DEGREE + 1] {
        let mut powers = [N::default(); HIGHEST_DEGREE + 1];
        for i in (0..self.count).rev() {
            let away = u - self.at[i];
            for k in (1..self.count - i).rev() {
                powers[k] = powers[k] * away + powers[k - 1];
            }
            powers[0] = powers[0] * away + self.differences[i];
        }
        powers
    }
}

impl<N: Scalar> Friction<N> for PiecewisePolynomial<N> {
    fn validate(&self) -> Result<(), Error> {
        self.within_limits()?;
        let degree = self.degree.value();
        if !(2.0..=highest()).contains(&degree) || degree.fract() != 0.0 {
            return misshapen("degree must be a whole number from 2 to 16", degree);
        }
        let (n, count) = (self.order(), self.nodes.len());
        if count <= n || !(count - 1).is_multiple_of(n) {
            return wrong(format!(
                "expected degree times the number of pieces and one more nodes ({}, {}, {}, …), got {count}: give each \
                     piece of degree {n} its nodes, the last of a piece being the first of the next",
                n + 1,
                2 * n + 1,
                3 * n + 1
            ));
        }
        from_zero(&self.nodes)?;
        at_least_kinetic(self.break_away, self.nodes[0][1])
    }

    fn static_limit(&self, _rest: Rest<N>) -> N {
        self.break_away
    }

    fn force(&self, _piece: &Piece<N>, u: N) -> N {
        let (polynomial, at) = self.polynomial(u);
        let [value, slope] = polynomial.value_and_slope(at);
        value + slope * (u - at)
    }

    fn extend(&self, u: &Series<N>, k: usize, grown: &mut Grown<N>) -> N {
        let inner = &mut grown.inner;
        if k == 0 {
            let (polynomial, at) = self.polynomial(u[0]);
            let mut powers = polynomial.powers(at);
            powers[0] += powers[1] * (u[0] - at);
            let degree = if u[0] < self.top() { self.order() } else { 1 };
            inner.resize(degree + 1, nothing());
            inner[degree] = nothing();
            for (series, term) in inner.iter_mut().zip(powers) {
                series[0] = term;
            }
            return powers[0];
        }
        compose(u, inner, k)
    }

    fn resolution(&self, u: N) -> Option<N> {
        let (u, nodes) = (u.max(N::default()), self.around(u));
        let [low, high] = ends(nodes);
        let n = self.order();
        let first = self.nodes.partition_point(|node| node[0] < low);
        let below = first.checked_sub(n).map(|from| &self.nodes[from..=first]);
        let above = self.nodes.get(first + n..=first + 2 * n);
        if u >= high {
            return Some(u - high + Newton::through(nodes).stride(None, high, low - high));
        }
        let inside = (high - low) * 0.25;
        let mut room = inside;
        if high - u < inside {
            let beside = above.unwrap_or(nodes);
            let width = ends(beside)[1] - ends(beside)[0];
            room = room.min(high - u + Newton::through(nodes).stride(above, high, width));
        }
        if let Some(below) = below
            && u - low < inside
        {
            let width = ends(below)[1] - ends(below)[0];
            room = room.min(u - low + Newton::through(nodes).stride(Some(below), low, -width));
        }
        Some(room)
    }

    fn begin(&self, _u: N, _balance: N, _memory: &mut Memory<N>) -> Piece<N> {
        Piece::constant(self.nodes[0][1])
    }
}

#[cfg(test)]
mod tests {
    use super::{Friction, Memory, PiecewisePolynomial};
    use crate::series::{Grown, ZERO, at};

    /// Three pieces of degree 16 at Chebyshev points.
    fn law(f: impl Fn(f64) -> f64) -> PiecewisePolynomial {
        let mut nodes = vec![[0.0, f(0.0)]];
        for (low, high) in [(0.0, 0.4), (0.4, 0.8), (0.8, 2.0)] {
            for i in 1..=16 {
                let share = 0.5 - 0.5 * (std::f64::consts::PI * f64::from(i) / 16.0).cos();
                let u = if i == 16 { high } else { low + (high - low) * share };
                nodes.push([u, f(u)]);
            }
        }
        let break_away = nodes[0][1];
        PiecewisePolynomial::new(nodes, break_away, 16.0)
    }

    #[test]
    fn polynomials_through_a_function_give_its_force_and_its_taylor_coefficients() {
        let f = |u: f64| 0.5 + 0.5 * (-u / 0.3).exp() + 0.1 * u;
        let law = law(f);
        law.validate().unwrap();
        let piece = law.begin(0.0, 0.0, &mut Memory::default());
        for i in 0..=400 {
            let u = 0.005 * f64::from(i);
            assert!((law.force(&piece, u) - f(u)).abs() < 2e-14, "{u}");
        }
        // A slip speed that wanders within a piece.
        let mut u = ZERO;
        (u[0], u[1], u[2], u[3]) = (0.6, 0.3, -0.5, 0.2);
        let mut grown = Grown::default();
        let mut force = ZERO;
        for (k, term) in force.iter_mut().enumerate() {
            *term = law.extend(&u, k, &mut grown);
        }
        for h in [-0.1, 0.05, 0.2] {
            assert!((at(&force, h) - f(at(&u, h))).abs() < 1e-13, "{h}");
        }
        // The tangent beyond the last node, in value and series.
        let slope = -0.5 / 0.3 * (-2.0_f64 / 0.3).exp() + 0.1;
        u[0] = 3.0;
        assert!((law.force(&piece, 3.0) - f(2.0) - slope).abs() < 1e-11);
        assert!(
            (law.extend(&u, 1, &mut {
                let mut grown = Grown::default();
                law.extend(&u, 0, &mut grown);
                grown
            }) - 0.3 * slope)
                .abs()
                < 1e-11
        );
    }

    #[test]
    fn no_piece_is_passed_over_between_two_looks() {
        for (f, least, most) in [
            (
                Box::new(|u: f64| 1.0 - 0.3 * u) as Box<dyn Fn(f64) -> f64>,
                12,
                40,
            ),
            // Two knots are corners: looks lie closely beside them.
            (Box::new(|u: f64| (u - 0.4).abs() + (u - 0.8).abs()), 60, 250),
        ] {
            let law = law(f);
            let (mut u, mut looks) = (0.0_f64, 0);
            while u < 2.5 {
                let room = law.resolution(u).unwrap();
                for knot in [0.4, 0.8] {
                    let past = u + room - knot;
                    assert!(
                        u >= knot || past <= if least > 20 { 2e-10 } else { 0.03 },
                        "{u} {room}"
                    );
                }
                u += room;
                looks += 1;
            }
            assert!((least..most).contains(&looks), "{looks}");
        }
    }
}
