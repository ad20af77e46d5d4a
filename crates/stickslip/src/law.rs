//! Friction laws: immutable, tagged data that answer two questions, what force adhesion can bear and what force slip produces.
//!
//! A law never sees the sign of the slip velocity: the mode carries it, and asks the law of that direction ([`Law::toward`]). It speaks of the *slip speed* u = |w| ≥ 0 and of the
//! friction that opposes slip, ≥ 0 as a rule. Kinetic friction comes as linear [`Piece`]s; where a piece ends, the law names
//! the next one. What a law remembers lies in [`Memory`], which belongs to the mode.

mod asymmetric;
mod bogacz_ryczek;
mod break_away_force;
mod combined;
mod constant_or_nodes;
mod coulomb;
mod cubic;
mod curve;
pub mod declaration;
mod dwell_time;
mod exponential_stribeck;
mod force_rate;
mod logarithmic_dwell;
mod lorentzian;
mod piecewise_linear;
mod piecewise_polynomial;
mod popp_stelter;
mod rational;
mod static_kinetic;
mod tabulated;
mod two_branch;

use serde::{Deserialize, Serialize};

pub use asymmetric::Asymmetric;
pub use bogacz_ryczek::{BRANCHES, BogaczRyczek, UpperTurn};
pub use break_away_force::StaticFriction;
pub use combined::Combined;
pub use constant_or_nodes::ConstantOrNodes;
pub use coulomb::Coulomb;
pub use cubic::Cubic;
pub use curve::{Curve, Fall};
pub use dwell_time::DwellTime;
pub use exponential_stribeck::ExponentialStribeck;
pub use force_rate::ForceRate;
pub use logarithmic_dwell::LogarithmicDwell;
pub use lorentzian::Lorentzian;
pub use piecewise_linear::PiecewiseLinear;
pub use piecewise_polynomial::PiecewisePolynomial;
pub use popp_stelter::PoppStelter;
pub use rational::Rational;
pub use static_kinetic::StaticKinetic;
pub use tabulated::Tabulated;
pub use two_branch::TwoBranch;

use crate::error::{Error, wrong};
use crate::jet::Jet;
use crate::law::declaration::{Facts, Kind, Limited, Limits, Over, Value};
use crate::scalar::Scalar;
use crate::series::{Grown, Series};

/// A point (slip speed, friction force) of the characteristic.
pub type Point<N = f64> = [N; 2];

/// What an exponent is where a document leaves it out.
pub(crate) fn one<N: From<f64>>() -> N {
    1.0.into()
}

/// How the contact has been held: what static friction may depend on.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rest<N = f64> {
    /// Time since the contact stuck, t_s.
    pub stick_time: N,
    /// |dF/dt| of the friction force now, δ.
    pub force_rate: N,
}

impl<N> Rest<N> {
    /// For so long, at this force rate.
    #[must_use]
    pub fn new(stick_time: N, force_rate: N) -> Self {
        Self {
            stick_time,
            force_rate,
        }
    }
}

/// Static friction at one rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adhesion<N = f64> {
    /// The static limit, f_s.
    pub force: N,
    /// ∂f_s/∂t_s, or a bound of it.
    pub growth: N,
    /// ∂²f_s/∂t_s²; infinite where the growth is a bound only.
    pub curvature: N,
    /// −∂f_s/∂δ.
    pub softening: N,
}

/// A linear piece of kinetic friction, valid for low ≤ u ≤ high: force = offset + slope · u.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece<N = f64> {
    /// Force at zero slip speed, extrapolated.
    pub offset: N,
    /// df/du.
    pub slope: N,
    /// Slip speed at the low end.
    pub low: N,
    /// Slip speed at the high end.
    pub high: N,
    /// Which branch of its law this is; only the law reads it.
    pub branch: u32,
    /// Whether the law wants to know when the slip acceleration changes sign.
    pub reverses: bool,
}

impl<N: Scalar> Piece<N> {
    /// The line through `point` with `slope`, over low ≤ u ≤ high.
    pub(crate) fn line(point: Point<N>, slope: N, low: N, high: N, branch: u32) -> Self {
        Self {
            offset: point[1] - slope * point[0],
            slope,
            low,
            high,
            branch,
            reverses: false,
        }
    }

    /// The same force at every slip speed.
    pub(crate) fn constant(force: N) -> Self {
        let zero = N::default();
        Self::line([zero, force], zero, zero, f64::INFINITY.into(), 0)
    }

    /// Friction force at slip speed `u`.
    pub fn force(&self, u: N) -> N {
        self.offset + self.slope * u
    }
}

/// How a piece ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The slip speed fell to the low end.
    Low,
    /// The slip speed rose to the high end.
    High,
    /// The slip acceleration changed its sign inside the piece; `rising` after it.
    Reversal {
        /// The sense of the slip acceleration after the turn.
        rising: bool,
    },
}

/// What a contact remembers; written at events, read by laws that have a memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Memory<N = f64> {
    /// Where the upper branch starts.
    pub anchor: Point<N>,
    /// Where the upper, the lower and the common line meet.
    pub corner: Point<N>,
    /// The break-away force, where the anchor was set by a break-away.
    pub released_at: Option<N>,
    /// |dF/dt| that adhesion would feel now; written by the caller before a start in slip and a turn to rising slip speed.
    pub force_rate: N,
}

/// What can be checked before it runs: laws of either kind, with adhesion or with an internal state.
pub trait Checked {
    /// Check the parameters.
    ///
    /// # Errors
    /// The first parameter that makes no sense.
    fn check(&self) -> Result<(), Error>;

    /// Check that its friction may be scaled by a normal force that varies.
    ///
    /// # Errors
    /// Where what it remembers is a force.
    fn check_scaled(&self) -> Result<(), Error>;

    /// Whether friction grows with w whatever the state is, so that it balances the load on a body without mass at one slip velocity.
    fn balances_load(&self) -> bool {
        false
    }
}

impl<N: Scalar> Value for Law<N> {
    const KIND: Kind = Kind::Law;

    fn check(&self, _name: &'static str, _limits: Limits) -> Result<(), Error> {
        self.validate()
    }
}

impl<N: Scalar> Checked for Law<N> {
    fn check(&self) -> Result<(), Error> {
        self.validate()
    }

    fn check_scaled(&self) -> Result<(), Error> {
        let remembers = |law: &Self| {
            let first = law.begin(0.0.into(), f64::INFINITY.into(), &mut Memory::default());
            law.feels_force_rate() || law.branches(1.0.into()).is_some() || first.reverses
        };
        if [-1.0, 1.0]
            .into_iter()
            .any(|direction| remembers(self.toward(direction)))
        {
            return wrong(
                "a normal_force that varies needs a law that follows neither the force rate nor the sign of the slip acceleration: \
                 give another law, or leave out normal_force"
                    .into(),
            );
        }
        Ok(())
    }
}

/// The answers every law gives, to numbers of any type. To add a law: one file with this trait, one line in [`Law`], and the same in
/// Python.
pub trait Friction<N: Scalar = f64>: Limited {
    /// Check the parameters, by their own limits and, where a law says more, together.
    ///
    /// # Errors
    /// The first parameter that makes no sense.
    fn validate(&self) -> Result<(), Error> {
        self.within_limits()
    }

    /// The static limit. It must not fall with the stick time nor rise with the force rate.
    fn static_limit(&self, rest: Rest<N>) -> N;

    /// An upper bound of ∂f_s/∂t_s at and after `stick_time`; 0 for a law without dwell.
    fn growth_bound(&self, _stick_time: N) -> N {
        N::default()
    }

    /// Where the static limit is f_s(0) + Δ (1 − e^(−γ t_s)), at a force rate that stays or whatever it is: Δ and γ. None where
    /// it is not, or grows otherwise.
    fn exponential_growth(&self, _force_rate: Option<N>) -> Option<[N; 2]> {
        None
    }

    /// The static limit and, for the search for where it breaks, how that changes.
    fn adhesion(&self, rest: Rest<N>) -> Adhesion<N> {
        let growth = self.growth_bound(rest.stick_time);
        Adhesion {
            force: self.static_limit(rest),
            growth,
            curvature: if growth == 0.0 {
                N::default()
            } else {
                f64::INFINITY.into()
            },
            softening: N::default(),
        }
    }

    /// For a law that feels the force rate: an upper bound of −∂f_s/∂δ between two force rates, whatever the stick time.
    fn softening_bound(&self, _rates: [N; 2]) -> N {
        f64::INFINITY.into()
    }

    /// Whether static friction depends on the force rate.
    fn feels_force_rate(&self) -> bool {
        false
    }

    /// For a law whose kinetic friction is one smooth curve over all slip speeds instead of linear pieces: how far the slip
    /// speed may move from `u` without passing over a feature of the force that its values at both ends do not show. Such a
    /// law says its [`Friction::curve`], or answers this, [`Friction::force`] and [`Friction::extend`]; its one piece holds
    /// nothing but the force at zero slip speed.
    fn resolution(&self, u: N) -> Option<N> {
        self.curve().map(|curve| curve.resolution(u))
    }

    /// Whether it is such a law.
    fn smooth(&self) -> bool {
        self.resolution(N::default()).is_some()
    }

    /// For a smooth law: its kinetic friction as numbers, where it is of that form.
    fn curve(&self) -> Option<Curve<N>> {
        None
    }

    /// Kinetic friction on `piece` at slip speed `u`.
    fn force(&self, piece: &Piece<N>, u: N) -> N {
        self.curve()
            .map_or_else(|| piece.force(u), |curve| curve.force(u))
    }

    /// For a smooth law: coefficient `k` of F(u(h)) from the coefficients of u up to `k`; called for k = 0, 1, 2, … in turn.
    fn extend(&self, u: &Series<N>, k: usize, grown: &mut Grown<N>) -> N {
        self.curve()
            .map_or_else(|| f64::NAN.into(), |curve| curve.extend(u, k, grown))
    }

    /// For a smooth law: coefficient after coefficient of F(u(h)), of which `next` makes the next one of u. One call for all of
    /// them lets a compiler put a law into the loop, and asks a law once for its curve.
    #[inline]
    fn grow(
        &self,
        u: &mut Series<N>,
        order: usize,
        grown: &mut Grown<N>,
        mut next: impl FnMut(usize, N) -> N,
    ) {
        if let Some(curve) = self.curve() {
            for k in 0..order {
                let size = curve.extend(u, k, grown);
                u[k + 1] = next(k, size);
            }
            return;
        }
        for k in 0..order {
            let size = self.extend(u, k, grown);
            u[k + 1] = next(k, size);
        }
    }

    /// For a law with branches by the sign of the slip acceleration that do not meet: its force at slip speed `u` while u
    /// falls and while it rises. Where the first is the smaller, the mode between them holds u; else the branches switch.
    fn branches(&self, _u: N) -> Option<[N; 2]> {
        None
    }

    /// The first piece after adhesion broke at `force`, slip speed 0.
    fn leave(&self, _force: N, memory: &mut Memory<N>) -> Piece<N> {
        self.begin(N::default(), f64::INFINITY.into(), memory)
    }

    /// The piece for a motion that starts while slipping at speed `u`; `balance` is the friction at which the slip speed
    /// would not change. The one piece of a smooth law holds its force at rest.
    fn begin(&self, _u: N, _balance: N, _memory: &mut Memory<N>) -> Piece<N> {
        Piece::constant(self.static_limit(Rest::default()))
    }

    /// The piece that follows where `piece` ended at slip speed `u`; a law of one piece has no other.
    fn next(&self, piece: &Piece<N>, _end: End, _u: N, _memory: &mut Memory<N>) -> Piece<N> {
        *piece
    }
}

macro_rules! laws {
    ($($name:ident),+) => {
        /// Any friction law, as one tagged document: `{"type": "Coulomb", "kinetic": 0.5}`.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(tag = "type", bound(deserialize = "N: Scalar + serde::de::DeserializeOwned"))]
        pub enum Law<N = f64> { $(#[doc = "See the struct of that name."] $name($name<N>)),+ }

        impl Law {
            /// What is known of each law.
            pub fn facts() -> Vec<Facts> { vec![$(Facts::of(stringify!($name), $name::smooth)),+] }
        }

        impl<M> Over<M> for Law {
            type Of = Law<M>;

            fn over(&self, of: &mut dyn FnMut(f64) -> M) -> Law<M> { match self { $(Self::$name(law) => Law::$name(law.over(of))),+ } }
        }

        impl<N: Scalar> Limited for Law<N> {
            fn within_limits(&self) -> Result<(), Error> { match self { $(Self::$name(law) => law.within_limits()),+ } }
        }

        impl<N: Scalar> Friction<N> for Law<N> {
            fn validate(&self) -> Result<(), Error> { match self { $(Self::$name(law) => law.validate()),+ } }
            #[inline]
            fn static_limit(&self, rest: Rest<N>) -> N { match self { $(Self::$name(law) => law.static_limit(rest)),+ } }
            fn growth_bound(&self, stick_time: N) -> N { match self { $(Self::$name(law) => law.growth_bound(stick_time)),+ } }
            fn exponential_growth(&self, force_rate: Option<N>) -> Option<[N; 2]> { match self { $(Self::$name(law) => law.exponential_growth(force_rate)),+ } }
            #[inline]
            fn adhesion(&self, rest: Rest<N>) -> Adhesion<N> { match self { $(Self::$name(law) => law.adhesion(rest)),+ } }
            fn softening_bound(&self, rates: [N; 2]) -> N { match self { $(Self::$name(law) => law.softening_bound(rates)),+ } }
            fn feels_force_rate(&self) -> bool { match self { $(Self::$name(law) => law.feels_force_rate()),+ } }
            #[inline]
            fn force(&self, piece: &Piece<N>, u: N) -> N { match self { $(Self::$name(law) => law.force(piece, u)),+ } }
            #[inline]
            fn extend(&self, u: &Series<N>, k: usize, grown: &mut Grown<N>) -> N { match self { $(Self::$name(law) => law.extend(u, k, grown)),+ } }
            fn grow(&self, u: &mut Series<N>, order: usize, grown: &mut Grown<N>, next: impl FnMut(usize, N) -> N) {
                match self { $(Self::$name(law) => law.grow(u, order, grown, next)),+ }
            }
            fn curve(&self) -> Option<Curve<N>> { match self { $(Self::$name(law) => law.curve()),+ } }
            fn resolution(&self, u: N) -> Option<N> { match self { $(Self::$name(law) => law.resolution(u)),+ } }
            fn branches(&self, u: N) -> Option<[N; 2]> { match self { $(Self::$name(law) => law.branches(u)),+ } }
            #[inline]
            fn leave(&self, force: N, memory: &mut Memory<N>) -> Piece<N> { match self { $(Self::$name(law) => law.leave(force, memory)),+ } }
            fn begin(&self, u: N, balance: N, memory: &mut Memory<N>) -> Piece<N> { match self { $(Self::$name(law) => law.begin(u, balance, memory)),+ } }
            #[inline]
            fn next(&self, piece: &Piece<N>, end: End, u: N, memory: &mut Memory<N>) -> Piece<N> { match self { $(Self::$name(law) => law.next(piece, end, u, memory)),+ } }
        }

        $(impl<N> From<$name<N>> for Law<N> { fn from(law: $name<N>) -> Self { Self::$name(law) } })+
    };
}

laws!(
    Coulomb,
    StaticKinetic,
    PiecewiseLinear,
    DwellTime,
    BogaczRyczek,
    Rational,
    Cubic,
    ExponentialStribeck,
    PoppStelter,
    ForceRate,
    Tabulated,
    TwoBranch,
    Lorentzian,
    LogarithmicDwell,
    PiecewisePolynomial,
    Asymmetric,
    Combined
);

impl Law {
    /// All its numbers, in the order of the declarations.
    #[must_use]
    pub fn numbers(&self) -> Vec<f64> {
        let mut numbers = Vec::new();
        self.over(&mut |number| numbers.push(number));
        numbers
    }

    /// The same where each of the numbers that are named, by their positions among [`Law::numbers`], is an axis of its own.
    #[must_use]
    pub fn along(&self, axes: &[usize]) -> Law<Jet> {
        let mut position = 0..;
        self.over(&mut |number| {
            let position = position.next();
            match axes.iter().position(|axis| Some(*axis) == position) {
                Some(axis) => Jet::along(number, axis),
                None => number.into(),
            }
        })
    }
}

impl<N: Scalar> Law<N> {
    /// The law of one direction of slip, by the sign of w; at rest that of the friction force. The engines ask it before all that
    /// depends on the direction, as the mode knows that and a law does not.
    #[must_use]
    #[inline]
    pub fn toward(&self, direction: f64) -> &Self {
        match self {
            Self::Asymmetric(law) => law.toward(direction),
            law => law,
        }
    }
}
