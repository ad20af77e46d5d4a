//! The kinetic friction of most smooth laws, as numbers: what SIMD lanes, which cannot ask a law, compute with.

/// How the part that falls with the slip speed does so, with y = u/scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fall {
    /// 1/(1 + y)
    Rational,
    /// 1/(1 + y²)
    Lorentzian,
    /// e^(−y)
    Exponential,
    /// e^(−y²)
    Gaussian,
}

/// F(u) = p₀ + p₁ u + p₂ u² + p₃ u³ + fall · g(u/scale).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curve {
    /// p₀ to p₃.
    pub polynomial: [f64; 4],
    /// The size of the part that falls.
    pub fall: f64,
    /// Over which slip speed it falls.
    pub scale: f64,
    /// The function g.
    pub form: Fall,
}

impl Curve {
    /// F at slip speed `u`.
    pub fn force(&self, u: f64) -> f64 {
        let [p0, p1, p2, p3] = self.polynomial;
        let y = u / self.scale;
        let g = match self.form {
            Fall::Rational => 1.0 / (1.0 + y),
            Fall::Lorentzian => 1.0 / (1.0 + y * y),
            Fall::Exponential => crate::elementary::exp(-y),
            Fall::Gaussian => crate::elementary::exp(-(y * y)),
        };
        p0 + u * (p1 + u * (p2 + u * p3)) + self.fall * g
    }
}
