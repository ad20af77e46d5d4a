//! The clock and the signals that the core does not know: a run ends when its time is up, or when the user interrupts it.

use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError};
use pyo3::prelude::*;
use rayon::ThreadPool;
use stickslip::error::Error;

use crate::refused;

/// Time between two looks at the interpreter's signals.
const LOOK: Duration = Duration::from_millis(50);

/// The interrupt, if the user asked for one.
fn signals() -> PyResult<()> {
    #[expect(
        clippy::redundant_closure_for_method_calls,
        reason = "the method alone is not general enough in its lifetime"
    )]
    Python::attach(|py| py.check_signals())
}

thread_local! {
    static HEEDED: RefCell<Option<Arc<AtomicBool>>> = const { RefCell::new(None) };
}

/// A flag by which one thread ends the runs of others: signals come to the main thread alone.
#[pyclass(frozen, module = "stickslip._core")]
pub(crate) struct Halt(Arc<AtomicBool>);

#[pymethods]
impl Halt {
    #[new]
    fn new() -> Self {
        Self(Arc::default())
    }

    /// From now on the runs on this thread end once the flag is set.
    fn heed(&self) {
        HEEDED.set(Some(self.0.clone()));
    }

    /// End them.
    fn set(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Whether the flag that this thread heeds is set: for runs in Python.
#[pyfunction]
pub(crate) fn halted() -> bool {
    HEEDED.with_borrow(|halt| halt.as_ref().is_some_and(|halt| halt.load(Ordering::Relaxed)))
}

/// Whoever watches a run on the present thread.
pub(crate) struct Watch {
    until: Option<Instant>,
    look: Instant,
    interrupt: Option<PyErr>,
}

impl Watch {
    /// From now on, for so many seconds.
    pub(crate) fn new(max_seconds: Option<f64>) -> Self {
        let now = Instant::now();
        let limit = max_seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
        Self {
            until: limit.and_then(|limit| now.checked_add(limit)),
            look: now + LOOK,
            interrupt: None,
        }
    }

    /// Whether the run goes on.
    pub(crate) fn go_on(&mut self) -> bool {
        let now = Instant::now();
        // Signals tell of an interrupt once; asked again, while the work still ends, they must not take it back.
        if self.interrupt.is_none() && now >= self.look {
            self.look = now + LOOK;
            self.interrupt = signals().err();
        }
        if halted() {
            self.interrupt = Some(PyKeyboardInterrupt::new_err(()));
        }
        self.interrupt.is_none() && self.until.is_none_or(|until| now < until)
    }
}

/// Do a run that asks whether to go on.
pub(crate) fn watched<T: Send>(
    py: Python<'_>,
    max_seconds: Option<f64>,
    run: impl FnOnce(&mut dyn FnMut() -> bool) -> Result<T, Error> + Send,
) -> PyResult<T> {
    let mut watch = Watch::new(max_seconds);
    let done = py.detach(|| run(&mut || watch.go_on()));
    watch.interrupt.map_or(Ok(()), Err)?;
    done.map_err(refused)
}

/// Do work on the threads of a pool while the present one watches; the work is asked to end by its flag.
pub(crate) fn interruptibly<T: Send>(
    py: Python<'_>,
    pool: &ThreadPool,
    watch: &mut Watch,
    work: impl FnOnce(&AtomicBool) -> T + Send,
) -> PyResult<T> {
    let halt = &AtomicBool::new(!watch.go_on());
    let done = py.detach(|| {
        pool.in_place_scope(|scope| {
            let (done, wait) = channel();
            scope.spawn(move |_| drop(done.send(work(halt))));
            loop {
                match wait.recv_timeout(LOOK) {
                    Err(RecvTimeoutError::Timeout) => {
                        halt.fetch_or(!watch.go_on(), Ordering::Relaxed);
                    }
                    // No result is a panic, which the scope passes on.
                    result => return result.map_err(|error| PyRuntimeError::new_err(error.to_string())),
                }
            }
        })
    })?;
    watch.interrupt.take().map_or(Ok(done), Err)
}
