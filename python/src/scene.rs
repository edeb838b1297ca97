//! Scenes and runs inside the process.

use std::path::PathBuf;
use std::sync::Mutex;
use std::time::Duration;

use kanagata::prelude::{
    Accuracy, Cancel, Error, Run, RunOptions, RunProgress, SequenceLimits, SequenceProgress,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::{InputError, KanagataError, raised};
use crate::run::RunRecord;
use crate::tool::Tool;

/// Name of a tool, the tool, whether its file was made, and the file.
type MadeTool = (String, Tool, bool, String);

/// Makes the tool files of a scene whose tools have `cad`.
#[pyfunction]
#[pyo3(signature = (path, set = Vec::new()))]
pub fn make_tools(py: Python<'_>, path: PathBuf, set: Vec<String>) -> PyResult<Vec<MadeTool>> {
    let set: Vec<&str> = set.iter().map(String::as_str).collect();
    let make = || kanagata::prelude::make_tools_with(path, &set, &mut |_| ());
    let made = py.detach(make).map_err(raised)?;
    Ok(made.into_iter().map(|m| (m.name, Tool { inner: m.tool }, m.is_new, m.file)).collect())
}

/// A scene file with its tools and material, ready to run.
#[pyclass(frozen, module = "kanagata._kanagata")]
pub struct Scene {
    inner: kanagata::prelude::Scene,
}

#[pymethods]
impl Scene {
    #[new]
    #[pyo3(signature = (path, set = Vec::new()))]
    fn new(py: Python<'_>, path: PathBuf, set: Vec<String>) -> PyResult<Self> {
        let set: Vec<&str> = set.iter().map(String::as_str).collect();
        let read = || kanagata::prelude::Scene::read_with(path, &set);
        Ok(Self { inner: py.detach(read).map_err(raised)? })
    }

    /// A scene from its JSON text, with paths relative to `folder`.
    #[staticmethod]
    fn of_text(py: Python<'_>, text: &str, folder: PathBuf, set: Vec<String>) -> PyResult<Self> {
        let set: Vec<&str> = set.iter().map(String::as_str).collect();
        let read = || kanagata::prelude::Scene::of_text(text, folder, &set);
        Ok(Self { inner: py.detach(read).map_err(raised)? })
    }

    #[getter]
    fn name(&self) -> &str {
        self.inner.name()
    }

    #[getter]
    fn tools(&self) -> Vec<String> {
        self.inner.tools()
    }

    /// The scene with its defaults as JSON text.
    fn json(&self) -> PyResult<String> {
        serde_json::to_string(self.inner.values()).map_err(|e| InputError::new_err(e.to_string()))
    }

    /// Findings and cost as JSON texts.
    fn check(&self, py: Python<'_>) -> PyResult<(String, String)> {
        let check = py.detach(|| self.inner.check()).map_err(raised)?;
        let text = |value: Result<String, serde_json::Error>| {
            value.map_err(|e| KanagataError::new_err(e.to_string()))
        };
        Ok((
            text(serde_json::to_string(&check.findings))?,
            text(serde_json::to_string(&check.cost))?,
        ))
    }

    /// Runs the scene; `watch` gets a dictionary after every increment. An exception in it and an interrupt stop the run with
    /// a checkpoint.
    #[pyo3(signature = (folder, watch = None, *, restart = false, overwrite = false, threads = None))]
    fn run(
        &self,
        py: Python<'_>,
        folder: PathBuf,
        watch: Option<Py<PyAny>>,
        restart: bool,
        overwrite: bool,
        threads: Option<usize>,
    ) -> PyResult<RunRecord> {
        let watcher = Watcher::new(watch, self.inner.tools());
        solved(py, threads, &watcher, || {
            let stop = watcher.stop.clone();
            let options = RunOptions { restart, overwrite, stop, ..RunOptions::default() };
            self.inner.run(&folder, &options, &mut |progress| watcher.observe(progress))
        })
    }

    /// Runs the scene from coarse to fine to `accuracy` (JSON of the scene's key; that of the scene if None); `watch` gets a
    /// dictionary where a run begins or fails, and after every increment.
    #[pyo3(signature = (folder, accuracy = None, watch = None, *, wall_s = None, overwrite = false, threads = None))]
    #[allow(clippy::too_many_arguments, reason = "arguments of Python have names")]
    fn run_to_accuracy(
        &self,
        py: Python<'_>,
        folder: PathBuf,
        accuracy: Option<&str>,
        watch: Option<Py<PyAny>>,
        wall_s: Option<f64>,
        overwrite: bool,
        threads: Option<usize>,
    ) -> PyResult<RunRecord> {
        let accuracy = accuracy.map(serde_json::from_str::<Accuracy>).transpose();
        let accuracy = accuracy.map_err(|e| InputError::new_err(format!("accuracy: {e}")))?;
        let watcher = Watcher::new(watch, self.inner.tools());
        solved(py, threads, &watcher, || {
            let stop = watcher.stop.clone();
            let limits = SequenceLimits { wall_s, overwrite, stop, ..SequenceLimits::default() };
            let watch = &mut |progress: &SequenceProgress| watcher.observe_sequence(progress);
            self.inner.run_to_accuracy(&folder, accuracy, &limits, watch)
        })
    }
}

/// Solves on a thread of its own, with `threads` workers if given.
fn solved(
    py: Python<'_>,
    threads: Option<usize>,
    watcher: &Watcher,
    solve: impl Fn() -> Result<Run, Error> + Sync,
) -> PyResult<RunRecord> {
    let pool = threads.map(|n| rayon::ThreadPoolBuilder::new().num_threads(n).build());
    let pool = pool.transpose().map_err(|e| KanagataError::new_err(e.to_string()))?;
    let on_pool = || pool.as_ref().map_or_else(&solve, |pool| pool.install(&solve));
    let run = py.detach(|| with_interrupts(watcher, on_pool))?;
    match (watcher.raised.lock().map(|mut raised| raised.take()), run) {
        (Ok(Some(error)), _) => Err(error),
        (_, run) => Ok(RunRecord { inner: run.map_err(raised)? }),
    }
}

/// Calls the observer of a run, and keeps the first exception.
struct Watcher {
    watch: Option<Py<PyAny>>,
    tools: Vec<String>,
    stop: Cancel,
    raised: Mutex<Option<PyErr>>,
}

impl Watcher {
    fn new(watch: Option<Py<PyAny>>, tools: Vec<String>) -> Self {
        Self { watch, tools, stop: Cancel::default(), raised: Mutex::default() }
    }

    fn observe(&self, progress: &RunProgress) {
        self.call(|py| told(py, &self.tools, progress));
    }

    fn observe_sequence(&self, progress: &SequenceProgress) {
        self.call(|py| {
            let out = match &progress.increment {
                Some(increment) => told(py, &self.tools, increment)?,
                None => PyDict::new(py),
            };
            out.set_item("run", progress.run)?;
            out.set_item("purpose", &progress.purpose)?;
            out.set_item("model", &progress.model)?;
            out.set_item("known", progress.is_known)?;
            out.set_item("failure", &progress.failure)?;
            Ok(out)
        });
    }

    /// Calls the observer with what `of` makes, unless the run is stopped.
    fn call<'a>(&self, of: impl for<'py> FnOnce(Python<'py>) -> PyResult<Bound<'py, PyDict>> + 'a) {
        let Some(watch) = self.watch.as_ref().filter(|_| !self.stop.is_requested()) else { return };
        let called = Python::attach(|py| watch.call1(py, (of(py)?,)).map(drop));
        self.keep(called);
    }

    /// Keeps an exception and asks the run to stop.
    fn keep(&self, result: PyResult<()>) {
        let Err(error) = result else { return };
        if let Ok(mut raised) = self.raised.lock() {
            raised.get_or_insert(error);
        }
        self.stop.request();
    }
}

/// Time between two looks for interrupts. Doubled: an interrupt is noticed 0.1 s later at most.
const LOOK_INTERVAL: Duration = Duration::from_millis(100);
/// Stack of the thread that solves, as that of a program's main thread [bytes].
const STACK_BYTES: usize = 8 << 20;

/// Calls `solve` on a thread of its own. This thread, the only one that sees signals, looks for interrupts meanwhile.
fn with_interrupts<T: Send>(watcher: &Watcher, solve: impl FnOnce() -> T + Send) -> PyResult<T> {
    std::thread::scope(|scope| {
        let waiting = std::thread::current();
        let body = move || {
            let result = solve();
            waiting.unpark();
            result
        };
        let thread =
            std::thread::Builder::new().stack_size(STACK_BYTES).spawn_scoped(scope, body)?;
        while !thread.is_finished() {
            std::thread::park_timeout(LOOK_INTERVAL);
            if !watcher.stop.is_requested() {
                watcher.keep(Python::attach(|py| py.check_signals()));
            }
        }
        thread.join().map_err(|_| {
            KanagataError::new_err("the solver ended by a panic, which is a fault of the program")
        })
    })
}

/// The progress of a run as a dictionary.
fn told<'py>(
    py: Python<'py>,
    tools: &[String],
    progress: &RunProgress,
) -> PyResult<Bound<'py, PyDict>> {
    let row = &progress.row;
    let by_tool = |values: &[f64]| -> PyResult<Bound<'py, PyDict>> {
        let out = PyDict::new(py);
        tools.iter().zip(values).try_for_each(|(tool, value)| out.set_item(tool, value))?;
        Ok(out)
    };
    let out = PyDict::new(py);
    out.set_item("increment", row.increment)?;
    out.set_item("stage", &row.stage)?;
    out.set_item("time", row.time)?;
    out.set_item("travel_mm", by_tool(&row.travel_mm)?)?;
    out.set_item("force_n", by_tool(&row.force_n)?)?;
    out.set_item("iterations", row.iterations)?;
    out.set_item("contact_nodes", row.contacts[0])?;
    out.set_item("slipping_nodes", row.contacts[1])?;
    out.set_item("done", progress.done)?;
    out.set_item("elapsed_s", progress.elapsed_s)?;
    Ok(out)
}
