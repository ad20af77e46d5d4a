//! Kinetic friction that is one formula over all slip speeds: a polynomial and a part that falls. A law of that form says its
//! numbers, and what else is asked of it follows here; SIMD lanes, which cannot ask a law, compute with them.

use crate::scalar::Scalar;
use crate::series::{Grown, Series, exponential, product, reciprocal};

/// How the part that falls with the slip speed u does so, by one number c.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fall {
    /// There is none.
    Nothing,
    /// 1/(1 + c u)
    Rational,
    /// 1/(1 + (u/c)²)
    Lorentzian,
    /// e^(−u/c)
    Exponential,
    /// e^(−(u/c)²)
    Gaussian,
}

impl Fall {
    /// Whether it goes with the square of the slip speed.
    pub(crate) fn squares(self) -> bool {
        matches!(self, Self::Lorentzian | Self::Gaussian)
    }
}

/// F(u) = p₀ + p₁ u + p₂ u² + p₃ u³ + size · g(u).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curve<N = f64> {
    /// p₀ to p₃.
    pub polynomial: [N; 4],
    /// The highest power that has a coefficient, whatever that is.
    pub degree: usize,
    /// The size of the part that falls.
    pub size: N,
    /// The function g.
    pub fall: Fall,
    /// Its number c.
    pub constant: N,
}

impl<N: Scalar> Curve<N> {
    /// Of a polynomial without its zeros, and a part that falls.
    pub(super) fn new<const COUNT: usize>(polynomial: [N; COUNT], size: N, fall: Fall, constant: N) -> Self {
        let mut all = [N::default(); 4];
        all[..COUNT].copy_from_slice(&polynomial);
        Self {
            polynomial: all,
            degree: COUNT.saturating_sub(1),
            size,
            // A part of no size falls nowhere, be it over a speed as small as numbers go.
            fall: if size.vanishes() { Fall::Nothing } else { fall },
            constant,
        }
    }

    /// F at slip speed `u`.
    #[inline]
    pub fn force(&self, u: N) -> N {
        let ([p0, p1, p2, p3], c) = (self.polynomial, self.constant);
        let fallen = match self.fall {
            Fall::Nothing => N::default(),
            Fall::Rational => self.size / (c * u + 1.0),
            Fall::Lorentzian => self.size / (u / c * (u / c) + 1.0),
            Fall::Exponential => self.size * (-(u / c)).exp(),
            Fall::Gaussian => self.size * (-(u / c * (u / c))).exp(),
        };
        let force = p0 + fallen + p1 * u;
        if self.degree < 2 {
            return force;
        }
        force + p2 * u * u + p3 * u * u * u
    }

    /// Coefficient `k` of F(u(h)), as [`super::Friction::extend`].
    #[expect(
        clippy::inline_always,
        reason = "so that a motion asks once what kind of curve it is, measured"
    )]
    #[inline(always)]
    pub fn extend(&self, u: &Series<N>, k: usize, grown: &mut Grown<N>) -> N {
        let ([p0, p1, p2, p3], c) = (self.polynomial, self.constant);
        let Grown {
            first: fallen,
            second: square,
            third: weighted,
            ..
        } = grown;
        if self.degree >= 2 || self.fall.squares() {
            square[k] = product(u, u, k);
        }
        match self.fall {
            Fall::Nothing => {}
            Fall::Rational => fallen[k] = reciprocal(c, u, fallen, k),
            Fall::Lorentzian => fallen[k] = reciprocal((c * c).inverse(), square, fallen, k),
            Fall::Exponential => fallen[k] = exponential(-c.inverse(), u, weighted, fallen, k),
            Fall::Gaussian => fallen[k] = exponential(-(c * c).inverse(), square, weighted, fallen, k),
        }
        // Each addition waits for the one before, and the next coefficient of u for all of them: none is made for nothing.
        let mut force = N::default();
        if self.fall != Fall::Nothing {
            force = self.size * fallen[k];
        }
        if k == 0 {
            force = p0 + force;
        }
        if self.degree >= 1 {
            force += p1 * u[k];
        }
        if self.degree >= 2 {
            force = force + p2 * square[k] + p3 * product(square, u, k);
        }
        force
    }

    /// How far the slip speed may move from `u`, as [`super::Friction::resolution`].
    #[inline]
    pub fn resolution(&self, u: N) -> N {
        let c = self.constant;
        // So far out an exponential is below rounding.
        let until = |gone: f64| (u.abs() - c * gone).max(c);
        match self.fall {
            Fall::Nothing => f64::INFINITY.into(),
            // Half of the way to the pole at −1/c, or the poles at ±i c.
            Fall::Rational => (u.abs() + c.inverse()) * 0.5,
            Fall::Lorentzian => (u * u + c * c).sqrt() * 0.5,
            Fall::Exponential => until(36.0),
            Fall::Gaussian => until(6.0),
        }
    }
}
