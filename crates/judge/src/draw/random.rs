//! Random numbers, and the units and levels that are drawn with them.

/// Marsaglia's xorshift with a multiplication (Vigna 2016), seeded by Steele's splitmix.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// The stream of one document of one seed.
    #[must_use]
    pub fn new(seed: u64, index: u64) -> Self {
        let mut random = Self(seed ^ index.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x5DEE_CE66_D1CE_4E5B);
        for _ in 0..4 {
            random.next();
        }
        random
    }

    pub(super) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        bits ^ (bits >> 31)
    }

    /// Uniform between two numbers.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.next() >> 11) as f64 / 9_007_199_254_740_992.0)
    }

    /// Uniform in the logarithm, decades.
    pub fn decades(&mut self, low: f64, high: f64) -> f64 {
        10f64.powf(self.within(low, high))
    }

    /// One of `count`.
    pub fn one_of(&mut self, count: usize) -> usize {
        usize::try_from(self.next() >> 33).unwrap_or(0) % count
    }

    /// One of these.
    pub(super) fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.one_of(of.len())]
    }

    /// True so often.
    pub fn chance(&mut self, share: f64) -> bool {
        self.within(0.0, 1.0) < share
    }

    pub(super) fn sign(&mut self) -> f64 {
        if self.chance(0.5) { 1.0 } else { -1.0 }
    }
}

/// Units of force, velocity and time.
#[derive(Clone, Copy)]
pub(super) struct Units {
    pub(super) force: f64,
    pub(super) velocity: f64,
    pub(super) time: f64,
}

pub(super) const PLAIN: Units = Units {
    force: 1.0,
    velocity: 1.0,
    time: 1.0,
};

impl Units {
    pub(super) fn length(self) -> f64 {
        self.velocity * self.time
    }
    pub(super) fn mass(self) -> f64 {
        self.force * self.time / self.velocity
    }
    pub(super) fn stiffness(self) -> f64 {
        self.force / self.length()
    }
    pub(super) fn damping(self) -> f64 {
        self.force / self.velocity
    }
}

/// What lies above a force: it itself, an ulp, a rounding, or something to see.
pub(super) fn above(random: &mut Random, force: f64) -> f64 {
    match random.one_of(6) {
        0 => force,
        1 => force.next_up(),
        2 => force * (1.0 + random.decades(-15.0, -3.0)),
        _ => force * random.within(1.0, 2.0),
    }
}

pub(super) fn units(random: &mut Random) -> Units {
    if random.chance(0.7) {
        return PLAIN;
    }
    let wide = if random.chance(0.8) { 4.0 } else { 9.0 };
    Units {
        force: random.decades(-wide, wide),
        velocity: random.decades(-wide, wide),
        time: random.decades(-wide, wide),
    }
}
