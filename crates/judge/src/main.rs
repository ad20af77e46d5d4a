//! Judge random oscillators and systems, or documents from files.
//!
//!   stickslip-judge --oscillators N --systems N --loaded N --states N --further N --polynomials N --seed S [--first I] [--threads T] [--show K] [FILE...]
//!
//! With --documents 1 documents are only written, a line each. A file holds a run under laws with an internal state as another
//! program made it, as `docs/evidence/events.py` has them, or one document {"sys", "x0", "v0", "t_end"} or a list of them. Counts go to the standard output as one JSON
//! object, and before it each failure as a line with the document that reproduces it.
#![expect(clippy::print_stdout, clippy::print_stderr, reason = "a command line")]

use std::collections::BTreeMap;
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use serde_json::{Value, json};
use stickslip_judge::draw;
use stickslip_judge::problem::Problem;
use stickslip_judge::report::run;
use stickslip_judge::states;
use stickslip_judge::verdict::{Verdict, judge};

#[derive(Default)]
struct Counts {
    documents: u64,
    refused: u64,
    not_understood: u64,
    events: u64,
    phases: u64,
    failures: u64,
    grazes: u64,
    edges: u64,
    sensitive: u64,
    left: u64,
    fallbacks: u64,
    stops: BTreeMap<String, u64>,
    laws: BTreeMap<String, [u64; 2]>,
    kinds: BTreeMap<String, u64>,
    shown: u64,
    slowest: (f64, String),
    worst: (f64, String),
}

impl Counts {
    fn add(&mut self, label: &str, case: &Value, verdict: Option<&Verdict>, show: u64) {
        self.documents += 1;
        let Some(verdict) = verdict else {
            self.not_understood += 1;
            println!("{}", json!({"from": label, "not understood": case}));
            return;
        };
        if let Some(sentence) = &verdict.refused {
            self.refused += 1;
            *self
                .kinds
                .entry(format!(
                    "refused: {}",
                    sentence.chars().take(50).collect::<String>()
                ))
                .or_default() += 1;
            return;
        }
        self.events += verdict.events;
        self.phases += verdict.phases;
        self.grazes += verdict.grazes;
        self.edges += verdict.edges;
        self.sensitive += verdict.sensitive;
        self.left += verdict.left;
        self.fallbacks += verdict.fallbacks;
        *self.stops.entry(verdict.stop.clone()).or_default() += 1;
        let law = case["sys"]["law"]["type"].as_str().unwrap_or("system");
        let count = self.laws.entry(law.to_owned()).or_default();
        count[0] += 1;
        if let Some(finding) = verdict.findings.first() {
            count[1] += 1;
            self.failures += 1;
            *self.kinds.entry(finding.what.clone()).or_default() += 1;
            if self.shown < show {
                self.shown += 1;
                let line = json!({
                    "from": label, "what": finding.what, "t": finding.t, "off": finding.off,
                    "tolerance": finding.tolerance, "document": case,
                });
                println!("{line}");
            }
        }
    }

    fn summary(&self) -> Value {
        json!({
            "documents": self.documents, "refused": self.refused, "not_understood": self.not_understood,
            "events": self.events, "phases": self.phases, "failures": self.failures, "grazes": self.grazes,
            "edges": self.edges, "sensitive": self.sensitive, "left": self.left, "fallbacks": self.fallbacks, "stops": self.stops,
            "laws_and_failures": self.laws, "kinds": self.kinds, "slowest": self.slowest,
            "worst": self.worst,
        })
    }
}

/// A document of a seed.
type Draw = fn(u64, u64) -> Value;
/// What is said of a document.
type Judge = fn(&Value) -> Option<Verdict>;

fn many(
    count: u64,
    first: u64,
    threads: u64,
    show: u64,
    label: &str,
    (draw, judge): (impl Fn(u64) -> Value + Sync, Judge),
) -> Counts {
    let (next, counts) = (AtomicU64::new(first), Mutex::new(Counts::default()));
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    if index >= first + count {
                        return;
                    }
                    let case = draw(index);
                    let start = std::time::Instant::now();
                    let verdict = judge(&case);
                    let seconds = start.elapsed().as_secs_f64();
                    if let Ok(mut counts) = counts.lock() {
                        if seconds > counts.slowest.0 {
                            counts.slowest = (seconds, format!("{label} {index}"));
                        }
                        let worst = verdict.as_ref().map_or(0.0, |verdict| verdict.worst);
                        if worst > counts.worst.0 {
                            counts.worst = (worst, format!("{label} {index}"));
                        }
                        counts.add(&format!("{label} {index}"), &case, verdict.as_ref(), show);
                    }
                }
            });
        }
    });
    counts.into_inner().unwrap_or_default()
}

fn main() -> ExitCode {
    let mut options = BTreeMap::from([
        ("oscillators", 0),
        ("systems", 0),
        ("loaded", 0),
        ("states", 0),
        ("further", 0),
        ("polynomials", 0),
        ("seed", 1),
        ("first", 0),
        ("threads", 1),
        ("show", 100),
        ("marks", 0),
        ("documents", 0),
    ]);
    let mut files = Vec::new();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let name = argument.strip_prefix("--").unwrap_or_default();
        if let Some(option) = options.get_mut(name) {
            let Some(value) = arguments.next().and_then(|value| value.parse().ok()) else {
                eprintln!("--{name} expects a whole number");
                return ExitCode::from(2);
            };
            *option = value;
        } else {
            files.push(argument);
        }
    }
    let (seed, first, threads, show) = (
        options["seed"],
        options["first"],
        options["threads"],
        options["show"],
    );
    let mut failures = 0;
    let mut summary = json!({"seed": seed});
    let mut tell = |name: &str, counts: &Counts| {
        failures += counts.failures;
        summary[name] = counts.summary();
    };
    let kinds: [(&str, &str, Draw, Judge); 6] = [
        ("oscillators", "oscillator", draw::oscillator, judge),
        ("systems", "system", draw::system, judge),
        ("loaded", "loaded", draw::loaded, judge),
        ("further", "further", draw::further, judge),
        ("polynomials", "polynomial", draw::polynomial, judge),
        ("states", "state", draw::state, states::judge),
    ];
    for (name, label, draw, judge) in kinds {
        if options["documents"] > 0 {
            // Only to be run elsewhere.
            for index in first..first + options[name] {
                println!("{}", draw(seed, index));
            }
        } else if options[name] > 0 {
            let draw = |index| draw(seed, index);
            tell(
                name,
                &many(options[name], first, threads, show, label, (draw, judge)),
            );
        }
    }
    for file in files {
        let document = std::fs::read_to_string(&file)
            .ok()
            .and_then(|text| serde_json::from_str::<Value>(&text).ok());
        let Some(document) = document else {
            eprintln!("{file}: expected a JSON document of a run or a list of them");
            return ExitCode::from(2);
        };
        let cases = document.as_array().cloned().unwrap_or_else(|| vec![document]);
        let mut counts = Counts::default();
        for (index, case) in cases.iter().enumerate() {
            let problem = Problem::read(case);
            if let Some(Ok(report)) = problem
                .filter(|_| options["marks"] > 0)
                .map(|problem| run(case, &problem))
            {
                for mark in report
                    .marks
                    .iter()
                    .take(usize::try_from(options["marks"]).unwrap_or(usize::MAX))
                {
                    println!(
                        "{:?} {:?} {:?} {:?}",
                        mark.time, mark.state, mark.directions, mark.events
                    );
                }
            }
            let verdict = if case["rows"].is_null() {
                judge(case)
            } else {
                states::judge_told(case)
            };
            let document = if case["rows"].is_null() {
                case
            } else {
                &case["document"]
            };
            if let Some(verdict) = &verdict {
                counts.worst = (verdict.worst.max(counts.worst.0), String::new());
            }
            counts.add(&format!("{file} {index}"), document, verdict.as_ref(), show);
        }
        tell(&file, &counts);
    }
    println!("{summary}");
    ExitCode::from(u8::from(failures > 0))
}
