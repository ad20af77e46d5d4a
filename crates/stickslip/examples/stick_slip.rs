//! A block on a belt: its orbit, event by event, and its state at any time.

#![expect(clippy::print_stdout, reason = "an example")]

use stickslip::error::Error;
use stickslip::law::DwellTime;
use stickslip::law::declaration::Parameters;
use stickslip::mode::Kind;
use stickslip::oscillator::Oscillator;
use stickslip::simulate::{Run, simulate};

fn main() -> Result<(), Error> {
    let oscillator = Oscillator::new(0.05, 0.1, DwellTime::example());
    let orbit = simulate(&oscillator, Run::stuck(60.0))?;
    for event in &orbit.events {
        println!(
            "t = {:8.5}  {:8}  x = {:+.6}",
            event.t,
            event.kind.name(),
            event.x
        );
    }
    let releases = orbit.events.iter().filter(|event| event.kind == Kind::Release);
    let times: Vec<f64> = releases.map(|event| event.t).collect();
    if let [.., before, last] = times[..] {
        println!("period {:.12}", last - before);
    }
    for state in orbit.states(&[10.0, 10.5, 11.0]) {
        println!(
            "x = {:+.6}  v = {:+.6}  friction = {:+.6}",
            state.x, state.v, state.force
        );
    }
    Ok(())
}
