//! Number of threads.

use super::exit::Failure;

/// Threads at most: more than any machine that this program was measured on has processors. Each has a stack and a place in
/// every parallel loop; twice as many would cost address space and no more.
const THREADS_MAX: usize = 1024;

/// Uses so many threads; as many as there are processors when none are given.
///
/// # Errors
/// Exit code 2 for a number out of range, and where the system gives no threads.
pub(super) fn use_threads(asked: Option<usize>) -> Result<(), Failure> {
    let Some(threads) = asked else { return Ok(()) };
    if !(1..=THREADS_MAX).contains(&threads) {
        return Err(Failure::input(format!(
            "--threads: found {threads}; allowed: 1 to {THREADS_MAX}"
        )));
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
    pool.map_err(|e| Failure::input(format!("--threads {threads}: {e}; give fewer")))
}
