//! Number of threads.

use std::sync::OnceLock;

use super::exit::Failure;

/// Largest number of threads, above the processors of any machine used. Each thread has a stack and a place in every
/// parallel loop; twice as many would cost address space only.
const THREADS_MAX: usize = 1024;

/// Set once a number of threads was asked for.
static ASKED: OnceLock<()> = OnceLock::new();

/// Whether a number of threads was asked for.
pub(super) fn is_asked() -> bool {
    ASKED.get().is_some()
}

/// Sets the number of threads; default: the number of processors. The calling thread is one of them: it takes part in parallel
/// loops, and one thread alone waits for no other. No other thread may start a parallel loop while this one waits for it. A command that
/// computes nothing starts none.
///
/// # Errors
/// Exit code 2 for a number out of range, or if the system cannot start the threads.
pub(super) fn use_threads(asked: Option<usize>, computes: bool) -> Result<(), Failure> {
    let pool = rayon::ThreadPoolBuilder::new().use_current_thread();
    let Some(threads) = asked else {
        if !computes {
            return Ok(());
        }
        return pool.build_global().map_err(|e| {
            Failure::input(format!(
                "cannot start the threads of parallel loops: {e}; try --threads 1"
            ))
        });
    };
    if !(1..=THREADS_MAX).contains(&threads) {
        return Err(Failure::input(format!(
            "--threads: found {threads}; allowed: 1 to {THREADS_MAX}"
        )));
    }
    ASKED.get_or_init(|| ());
    let pool = pool.num_threads(threads).build_global();
    pool.map_err(|e| Failure::input(format!("--threads {threads}: {e}; give fewer")))
}
