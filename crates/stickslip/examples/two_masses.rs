//! Two coupled blocks on one belt, and an observer of one's own: how long each block sticks, without keeping the orbit.

#![expect(clippy::print_stdout, reason = "an example")]

use stickslip::engine::{Engine, Steps};
use stickslip::error::Error;
use stickslip::law::StaticKinetic;
use stickslip::network::Run;
use stickslip::observer::{Course, Observer};
use stickslip::orbit::Event;
use stickslip::system::{Contact, System};

/// The time each contact sticks, and the events of all of them.
#[derive(Default)]
struct Sticking {
    time: [f64; 2],
    events: u64,
}

impl Observer for Sticking {
    fn pass(&mut self, course: &impl Course, (from, to): (f64, f64), _last: bool) {
        for (contact, time) in self.time.iter_mut().enumerate() {
            if course.sticks(contact) {
                *time += to - from;
            }
        }
    }

    fn event(&mut self, _event: &Event) {
        self.events += 1;
    }
}

fn main() -> Result<(), Error> {
    let force_lines = |mass, kinetic| Contact {
        mass,
        other: None,
        drive_velocity: 0.1.into(),
        law: StaticKinetic::new(1.0, kinetic).into(),
        normal_force: None,
    };
    let system = System {
        mass: vec![vec![1.0, 0.0], vec![0.0, 1.0]],
        stiffness: vec![vec![2.0, -1.0], vec![-1.0, 2.0]],
        damping: vec![vec![0.1, 0.0], vec![0.0, 0.1]],
        contacts: vec![force_lines(0, 0.6), force_lines(1, 0.7)],
        forcing: vec![],
        springs: Vec::new(),
    };
    let run = Run::driven(500.0);
    let mut sticking = Sticking::default();
    // The first 100 are left out.
    Steps::new(&system, run)?.go(500.0, 100.0, &mut sticking)?;
    for (mass, time) in sticking.time.iter().enumerate() {
        println!("block {mass} sticks {:.1} % of the time", time / 4.0);
    }
    println!("{} events", sticking.events);
    Ok(())
}
