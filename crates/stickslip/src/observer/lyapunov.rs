//! Lyapunov exponents: how fast motions that start close together part, through events, memory included.
//!
//! λ_i = lim (1/t) Σ ln R_ii with the QR factors of directions that each phase of the event sequence carries along by its
//! derivative. Sources: Benettin, Galgani, Giorgilli & Strelcyn, Meccanica 15 (1980) 9; with events Müller, Chaos Solitons
//! Fractals 5 (1995) 1671.

use std::f64::consts::TAU;
use std::iter::repeat_n;

use crate::elementary::{ln, power};
use crate::error::{Error, wrong};
use crate::event_sequence::{self as of_oscillator, EventSequence};
use crate::law::{Friction, Law, Rest};
use crate::matrix::filled;
use crate::model::Model;
use crate::network::{self, sequence as of_system};
use crate::simulate::{Run, Stop};
use crate::system::System;
use crate::variation::{
    ContactMode, Ending, Followed, Keep, Layout, Phase, STICK_TIME, State, Varied, follow,
};

/// Natural periods of a part of the motion: each is run from the end of the one before, so that a chaotic motion and its
/// derivative do not part.
const PERIODS_A_PART: f64 = 20.0;
/// The averages over so many shares of the time give the error.
const AVERAGED_SHARES: u32 = 20;
/// Not more of the run is left out, so that rounding leaves something of it.
const MOST_TRANSIENT: f64 = 1.0 - 1e-9;
/// At the end of the transient others take the place of directions that it forgot, which the motion it leads to may remember;
/// and once before, at this share of it, so that they have turned by its end to where they go.
const TAKEN_EARLY: f64 = 0.75;

/// What shrinks to less of the largest direction is not well known, and below the other it is what rounding leaves, and lost.
const SMALL: f64 = 1e-8;
const LOST: f64 = 1e-12;
/// In so many parts a phase is cut in which that happens, and those again, down to so many in a natural period: damping takes
/// its time, a stick forgets at once.
const CUTS: usize = 4;
const MOST_PARTS: f64 = 1000.0;

/// How directions grow along a motion.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Spectrum {
    /// When each phase ended, from the end of the transient.
    pub times: Vec<f64>,
    /// ln of the growth of each direction up to these times; −∞ once sticks have forgotten it.
    pub growths: Vec<Vec<f64>>,
    /// Events in this time.
    pub events: u64,
    /// Whether a shift in time is none of the directions: its exponent is 0.
    pub shift: bool,
}

impl Spectrum {
    /// The exponent of a direction and its standard error, in 1/time, from the averages over 20 shares of the time; no error
    /// of −∞.
    pub fn average(&self, direction: usize) -> [f64; 2] {
        let (times, growth) = (&self.times, &self.growths[direction]);
        let (end, count) = (times[times.len() - 1], f64::from(AVERAGED_SHARES));
        let mean = growth[growth.len() - 1] / end;
        let (mut known, mut squares) = (0.0, 0.0);
        for share in 1..=AVERAGED_SHARES {
            let t = end * f64::from(share) / count;
            let next = times.partition_point(|&time| time < t).min(times.len() - 1);
            let before = |of: &[f64]| next.checked_sub(1).map_or(0.0, |before| of[before]);
            let (time, grown) = (before(times), before(growth));
            let here = grown + (growth[next] - grown) * (t - time) / (times[next] - time);
            let aside = (here - known) * count / end - mean;
            (known, squares) = (here, squares + aside * aside);
        }
        [mean, (squares / (count * (count - 1.0))).sqrt()]
    }
}

/// How directions grow along a run whose first `transient` (a share in [0, 1)) is left out: `most` of them, or as many as
/// there are, two a mass; a motion with events that nothing forces has a shift in time beside them. Where no event comes in
/// the second half of the average, it begins after the last one: that is the motion it leads to. `seed` says with which
/// directions to begin; the first is the same whatever their number. The derivatives of `run.max_events` are held at a time.
///
/// # Errors
/// What makes no sense in the run, systems whose motion has no derivative, and runs that end early.
pub fn spectrum(
    model: &Model,
    run: network::Run,
    transient: f64,
    most: usize,
    seed: u64,
    go_on: &mut dyn FnMut() -> bool,
) -> Result<Spectrum, Error> {
    let system = match model {
        Model::Closed(oscillator) => System::from(oscillator),
        Model::Steps(system) => system.clone(),
    };
    let (autonomous, natural) = (model.forcing_frequency().is_none(), model.natural_period());
    let begin = transient.min(MOST_TRANSIENT) * run.t_end;
    let layout = Layout::of(&system);
    let laws = system.contacts.iter().map(|contact| &contact.law).enumerate();
    let timeless = laws.filter(|(_, law)| !feels_stick_time(law, natural));
    let unread = timeless.map(|(c, _)| layout.contact(c) + STICK_TIME);
    let mut motion = Motion {
        model,
        unread: autonomous.then_some(0).into_iter().chain(unread).collect(),
        varied: Varied::new(&system, &serde_json::Value::Null, &[])?,
        layout,
        natural,
        end: run.t_end,
        // What follows the last event of a run of the most events is not known.
        most: run.max_events.max(2),
        go_on,
    };
    let run = network::Run {
        t_end: run.t_end.min(PERIODS_A_PART * natural),
        max_events: motion.most,
        ..run
    };
    let mut sequence = match model {
        Model::Closed(one) => of_oscillator::run(one, Run::of_one(&run), &mut *motion.go_on)?,
        Model::Steps(system) => of_system::run(system, run, &mut *motion.go_on)?,
    };
    let directions = |shift: bool, now: f64| Directions {
        random: seed,
        now,
        due: vec![begin, TAKEN_EARLY * begin, f64::NEG_INFINITY],
        found: Spectrum {
            growths: vec![Vec::new(); most.min(2 * system.masses() - usize::from(shift))],
            shift,
            ..Spectrum::default()
        },
        ..Directions::default()
    };
    // From event to event a shift in time is no direction of a motion that nothing forces.
    let mut whole = directions(autonomous, 0.0);
    let (mut last_event, mut after) = (0.0, Vec::new());
    loop {
        let start = whole.now;
        let (mut part, over) = motion.part(sequence, start)?;
        whole.take(&mut motion, &mut part)?;
        let ends = part.phases.last().zip(part.followed.states.last());
        let next = ends.filter(|_| !over).map(|(next, state)| {
            let length = (PERIODS_A_PART * natural).min(motion.end - whole.now);
            motion.run(state, &next.contact_modes, length)
        });
        let mut phases = part.phases[..part.followed.states.len()].iter();
        if let Some(event) = phases.rposition(|phase| phase.ending != Ending::Time) {
            let durations = &part.followed.durations[..=event];
            last_event = start + durations.iter().sum::<f64>();
            after.clear();
            part.start = part.followed.states[event].clone();
            part.phases.drain(..=event);
        }
        part.followed = Followed::default();
        after.push(part);
        let Some(next) = next else { break };
        sequence = next?;
    }
    if last_event > 0.5 * (begin + whole.now) {
        return Ok(whole.found);
    }
    // The motion has left its events, and what they do, for good.
    let mut rest = directions(false, last_event);
    for mut part in after {
        rest.take(&mut motion, &mut part)?;
    }
    Ok(rest.found)
}

/// Whether static friction depends on how long a contact has stuck.
fn feels_stick_time(law: &Law, natural: f64) -> bool {
    let limit = |law: &Law, time: f64, rate: f64| law.static_limit(Rest::new(time, rate));
    [1.0, -1.0].into_iter().any(|direction| {
        let law = law.toward(direction);
        let later = [1e-3, 1.0, 1e3].map(|share| share * natural);
        [0.0, 1.0].into_iter().any(|rate| {
            later
                .iter()
                .any(|&time| limit(law, time, rate) != limit(law, 0.0, rate))
        })
    })
}

fn ended<T>(stop: Stop) -> Result<T, Error> {
    let stop = stop.name();
    let advice = "choose another start or a shorter t_end";
    wrong(format!("the run ended by {stop}; {advice}"))
}

/// A part of a motion; the last of the phases only says what the contacts do after it.
#[derive(Default)]
struct Part {
    start: State,
    phases: Vec<Phase>,
    followed: Followed,
}

/// A motion that is followed part by part.
struct Motion<'a> {
    model: &'a Model,
    varied: Varied,
    layout: Layout,
    /// Numbers of a state that nothing reads, such as the clock of a motion that nothing forces: they are no directions.
    unread: Vec<usize>,
    natural: f64,
    end: f64,
    most: u64,
    go_on: &'a mut dyn FnMut() -> bool,
}

impl Motion<'_> {
    /// What it does from a state, for a length of time.
    fn run(&mut self, state: &State, modes: &[ContactMode], length: f64) -> Result<EventSequence, Error> {
        let go_on = &mut *self.go_on;
        match self.model {
            Model::Closed(one) => of_oscillator::from(one, state, modes[0], length, self.most, go_on),
            Model::Steps(system) => of_system::from(system, state, modes, length, self.most, go_on),
        }
    }

    /// The part that begins at a time, up to an event, and whether it is the last one. A long mode without events comes in
    /// phases so short that no derivative underflows.
    fn part(&mut self, mut sequence: EventSequence, now: f64) -> Result<(Part, bool), Error> {
        let mut length = PERIODS_A_PART * self.natural;
        let over = loop {
            if !matches!(sequence.stop, Stop::End | Stop::MaxEvents) {
                return ended(sequence.stop);
            }
            let durations = sequence.phases.iter().map(|phase| phase.duration);
            let over = now + durations.sum::<f64>() >= self.end * (1.0 - 1e-12);
            let modes = &sequence.phases[0].contact_modes;
            let sticks = modes.iter().all(|&mode| mode == ContactMode::Stick);
            if over || !sequence.kinds.is_empty() || !sticks {
                break over;
            }
            // Stuck beyond this part: a stick must be followed from its begin.
            length *= 2.0;
            sequence = self.run(&sequence.start, modes, length.min(self.end - now))?;
        };
        let (mut phases, events) = (sequence.phases, sequence.kinds.len());
        if over || events == 0 {
            let last = phases[phases.len() - 1].clone();
            if let Some(mut piece) = phases.pop_if(|phase| phase.ending == Ending::Time) {
                let pieces = (piece.duration / self.natural).ceil().max(1.0);
                piece.duration /= pieces;
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "a small number above 0"
                )]
                phases.extend(repeat_n(piece, pieces as usize));
            }
            phases.push(last);
        } else {
            phases.truncate(events + usize::from(sequence.stop == Stop::End));
        }
        let start = sequence.start;
        Ok((
            Part {
                start,
                phases,
                ..Part::default()
            },
            over,
        ))
    }

    fn follow(&mut self, part: &mut Part, keep: Keep) -> Result<(), Error> {
        let (count, start) = (part.phases.len() - 1, &part.start);
        let (phases, last) = (&part.phases[..count], &part.phases[count].contact_modes);
        part.followed = follow(&self.varied, start, phases, last, keep, false, self.go_on)?;
        if part.followed.states.len() < count {
            return ended(Stop::MaxSeconds);
        }
        Ok(())
    }
}

/// Directions that a motion carries along, orthonormal, and the logarithms of their growth.
#[derive(Default)]
struct Directions {
    /// The unit of each number of a state, once it is known.
    units: Vec<f64>,
    /// Number by number of a state, those of all that are carried, and which these are.
    basis: Vec<f64>,
    carried: Vec<usize>,
    /// ln of the growth of each since they were taken; −∞ of one that is lost.
    sums: Vec<f64>,
    random: u64,
    now: f64,
    /// When others are to be taken, the first time last; from then on the motion counts.
    due: Vec<f64>,
    found: Spectrum,
}

impl Directions {
    /// Go through a part of the motion.
    fn take(&mut self, motion: &mut Motion, part: &mut Part) -> Result<(), Error> {
        let idle = self.due.is_empty() && self.carried.is_empty();
        motion.follow(part, if idle { Keep::Nothing } else { Keep::Phases })?;
        for (index, duration) in part.followed.durations.iter().enumerate() {
            if self.units.is_empty() {
                self.units = units(motion, &part.followed.states);
            }
            self.now += duration;
            while self.due.pop_if(|due| *due < self.now).is_some() {
                self.complete(motion.layout);
            }
            self.through(motion, part, index)?;
            if self.due.is_empty() {
                let elapsed = self.found.times.last().copied().unwrap_or_default();
                self.found.times.push(elapsed + duration);
                self.found.events += u64::from(part.phases[index].ending != Ending::Time);
                for (growth, sum) in self.found.growths.iter_mut().zip(&self.sums) {
                    growth.push(*sum);
                }
            }
        }
        Ok(())
    }

    /// Take as many directions as there are, those that are known first, and count from here.
    fn complete(&mut self, layout: Layout) {
        let (known, count) = (self.carried.len(), self.found.growths.len());
        let mut rows = vec![0.0; layout.width() * count];
        let old = self.basis.chunks_exact(known.max(1));
        for (row, old) in rows.chunks_exact_mut(count).zip(old) {
            row[..known].copy_from_slice(old);
        }
        for direction in known..count {
            for number in layout.x(0)..layout.contact(0) {
                // Knuth's linear congruential generator of MMIX, in [−1, 1).
                let factor = self.random.wrapping_mul(0x5851_F42D_4C95_7F2D);
                self.random = factor.wrapping_add(0x1405_7B7E_F767_814F);
                rows[number * count + direction] = (self.random >> 11) as f64 / (1_u64 << 52) as f64 - 1.0;
            }
        }
        orthonormal(&mut rows, count);
        (self.basis, self.carried, self.sums) = (rows, (0..count).collect(), vec![0.0; count]);
    }

    /// Carry them through a phase of a part of the motion.
    fn through(&mut self, motion: &mut Motion, part: &Part, index: usize) -> Result<(), Error> {
        let (width, count, columns) = (
            motion.layout.width(),
            self.carried.len(),
            motion.varied.directions(),
        );
        if count == 0 {
            return Ok(());
        }
        let mut moved = vec![0.0; width * count];
        let rates = part.followed.rates[index * width * columns..].chunks_exact(columns);
        let rows = rates.zip(moved.chunks_exact_mut(count)).enumerate();
        for (number, (rates, sums)) in rows.filter(|(number, _)| !motion.unread.contains(number)) {
            for (by, rate) in filled(&rates[..width]) {
                let rate = rate * self.units[by] / self.units[number];
                for (sum, along) in sums.iter_mut().zip(&self.basis[by * count..]) {
                    *sum += rate * along;
                }
            }
        }
        let sizes = orthonormal(&mut moved, count);
        let largest = sizes.iter().copied().fold(1.0, f64::max);
        let (small, duration) = (SMALL * largest, part.followed.durations[index]);
        if duration > motion.natural / MOST_PARTS && sizes.iter().any(|&size| size < small) {
            // Rounding hides what is small beside the largest: damping gives that in time, a stick at once.
            let mut piece = part.phases[index].clone();
            piece.duration = duration / CUTS as f64;
            let mut phases = vec![piece; CUTS];
            phases[..CUTS - 1]
                .iter_mut()
                .for_each(|piece| piece.ending = Ending::Time);
            phases.push(part.phases[index + 1].clone());
            let before = index.checked_sub(1).map(|before| &part.followed.states[before]);
            let start = before.unwrap_or(&part.start).clone();
            let mut cut = Part {
                start,
                phases,
                ..Part::default()
            };
            motion.follow(&mut cut, Keep::Phases)?;
            return (0..CUTS).try_for_each(|piece| self.through(motion, &cut, piece));
        }
        let kept = |column: &usize| sizes[*column] > LOST * largest;
        for (column, size) in sizes.iter().enumerate() {
            let size = if kept(&column) { *size } else { 0.0 };
            self.sums[self.carried[column]] += ln(size);
        }
        let columns = (0..count).filter(kept);
        self.carried = columns.clone().map(|column| self.carried[column]).collect();
        let rows = moved.chunks_exact(count);
        let rows = rows.map(|row| columns.clone().map(|column| row[column]));
        self.basis = rows.flatten().collect();
        Ok(())
    }
}

/// The unit of each number of a state: those of time and force are of the system, that of length a power of 1000.
fn units(motion: &Motion, states: &[State]) -> Vec<f64> {
    let (time, Layout { masses, contacts }) = (motion.natural / TAU, motion.layout);
    let largest = |from: usize| {
        let numbers = states
            .iter()
            .flat_map(|state| &state.numbers[from..from + masses]);
        numbers.fold(0.0, |most: f64, number| most.max(number.abs()))
    };
    let size = largest(motion.layout.x(0)).max(time * largest(motion.layout.v(0)));
    let thousands = if size > 0.0 { ln(size) / ln(1000.0) } else { 0.0 };
    let length = power(1000.0, thousands.round());
    let masses_of = motion.varied.base.mass.iter().flatten();
    let mass = masses_of.fold(0.0, |most: f64, mass| most.max(mass.abs()));
    let (speed, force) = (length / time, mass * length / (time * time));
    let line = [force, force / speed, speed, speed];
    let memory = [speed, force, speed, force, force, time];
    let contact = [&line[..], &memory].concat().repeat(contacts);
    [vec![time], vec![length; masses], vec![speed; masses], contact].concat()
}

/// Make the columns of so many numbers a row orthonormal, the first first (Gram–Schmidt, twice, which is enough: Giraud, Langou
/// & Rozložník, Comput. Math. Appl. 50 (2005) 1069); how long each was beside those before it, |R_ii| of the QR factors.
fn orthonormal(rows: &mut [f64], count: usize) -> Vec<f64> {
    let (mut sizes, mut largest) = (Vec::with_capacity(count), 1.0_f64);
    for column in 0..count {
        for _ in 0..2 {
            let mut shares = vec![0.0; column];
            for row in rows.chunks_exact(count) {
                for (share, along) in shares.iter_mut().zip(row) {
                    *share += along * row[column];
                }
            }
            for row in rows.chunks_exact_mut(count) {
                let known = row.iter().zip(&shares);
                row[column] -= known.map(|(along, share)| along * share).sum::<f64>();
            }
        }
        let numbers = rows.iter().skip(column).step_by(count);
        let size = numbers.map(|number| number * number).sum::<f64>().sqrt();
        largest = largest.max(size);
        // What rounding leaves takes nothing from those behind it.
        let unit = if size > LOST * largest { 1.0 / size } else { 0.0 };
        for number in rows.iter_mut().skip(column).step_by(count) {
            *number *= unit;
        }
        sizes.push(size);
    }
    sizes
}

#[cfg(test)]
mod tests {
    use super::spectrum;
    use crate::harmonic::Harmonic;
    use crate::law::{Coulomb, StaticKinetic};
    use crate::model::Model;
    use crate::network::Run;
    use crate::oscillator::Oscillator;

    #[test]
    fn what_damping_makes_small_between_two_events_is_not_lost() {
        // ẍ + D ẋ + x = cos Ω t with next to no friction: disturbances decay as e^(−D t/2), to 1e-14 in half a period.
        let slow = Model::Closed(Oscillator {
            forcing: vec![Harmonic::new(1.0, 0.05, 0.0)],
            ..Oscillator::new(1.0, 0.0, Coulomb { kinetic: 1e-9 })
        });
        for most in [1, 2] {
            let found = spectrum(&slow, Run::driven(3000.0), 0.1, most, 0, &mut || true).expect("a run");
            let exponents: Vec<_> = (0..found.growths.len())
                .map(|which| found.average(which)[0])
                .collect();
            assert_eq!(exponents.len(), most);
            assert!(
                exponents.iter().all(|one| (one + 0.5).abs() < 5e-3),
                "{exponents:?}"
            );
        }
    }

    #[test]
    fn what_a_stick_forgets_is_lost_and_a_run_that_is_stopped_is_refused() {
        let law = StaticKinetic {
            break_away: 1.0,
            kinetic: 0.6,
        };
        let pulled = Model::Closed(Oscillator::new(0.0, 0.2, law));
        let mut asked = 0;
        let mut found = |most: u32| {
            asked = 0;
            spectrum(&pulled, Run::driven(500.0), 0.1, 9, 0, &mut || {
                asked += 1;
                asked <= most
            })
        };
        let whole = found(u32::MAX).expect("a run");
        assert_eq!((whole.growths.len(), whole.shift), (1, true));
        assert!(whole.average(0)[0] == f64::NEG_INFINITY && whole.average(0)[1].is_nan());
        for most in 0..100 {
            assert!(found(most).is_err_and(|error| error.to_string().contains("ended by max_seconds")));
        }
    }
}
