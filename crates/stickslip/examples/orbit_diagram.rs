//! Steady motions over the velocity of the drive, each begun where the one before ended.

#![expect(clippy::print_stdout, reason = "an example")]

use serde_json::json;
use stickslip::error::Error;
use stickslip::model::Start;
use stickslip::rows::Rows;
use stickslip::steady_motion::Look;
use stickslip::sweep::Sweep;

fn main() -> Result<(), Error> {
    let velocities: Vec<f64> = (1..=20).map(|step| 0.03 * f64::from(step)).collect();
    let sweep = Sweep {
        rows: Rows {
            document: json!({
                "mass": 1.0, "stiffness": 1.0, "damping": 0.1, "drive_velocity": 0.1,
                "law": {"type": "ExponentialStribeck", "break_away": 1.0, "kinetic": 0.6, "scale": 0.2},
                "forcing": [{"amplitude": 0.1, "frequency": 1.3, "phase": 0.0}],
            }),
            names: vec!["drive_velocity".into()],
            values: velocities.clone(),
        },
        look: Look {
            points: 8,
            ..Look::new(100.0, 200.0)
        },
    };
    let rows = sweep.chain(0..velocities.len(), Start::default(), None, &mut || true)?;
    for (velocity, steady) in velocities.iter().zip(&rows) {
        let points: Vec<String> = steady
            .section
            .iter()
            .map(|point| format!("{:+.4}", point.x))
            .collect();
        println!(
            "{velocity:.2}  {:15}  period {}  x = {}",
            steady.regime.name(),
            steady.period,
            points.join(" ")
        );
    }
    Ok(())
}
