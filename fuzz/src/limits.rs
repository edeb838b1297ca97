//! Time and memory that one input may take.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::Once;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Memory that any input may take [bytes].
const MEMORY: usize = 64 << 20;
/// Memory that an input may take besides, over its size.
const MEMORY_RATIO: usize = 32;
/// Time that reading an input may take [s]: of the processor, so that a busy machine finds nothing.
pub const SECONDS: f64 = 1.0;
/// Time that reading, two conversions and two audits of an input may take [s]: above what the search budgets of a face of
/// 1,000 elements and the evaluations of audits need in this build, which takes twice the time of others.
pub const SECONDS_CONVERTING: f64 = 30.0;

/// The system's allocator, which counts what is held [bytes] and stops the process above a limit.
struct Counting;

#[global_allocator]
static ALLOCATOR: Counting = Counting;
static HELD: AtomicUsize = AtomicUsize::new(0);
static ALLOWED: AtomicUsize = AtomicUsize::new(usize::MAX);

impl Counting {
    fn more(size: usize) {
        if HELD.fetch_add(size, Relaxed).saturating_add(size) > ALLOWED.load(Relaxed) {
            ALLOWED.store(usize::MAX, Relaxed);
            stop(&format!("an input takes more memory than it may: {size} bytes more"));
        }
    }
}

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        Self::more(layout.size());
        // SAFETY: the caller's promises are those of `System`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        Self::more(layout.size());
        // SAFETY: as above.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        Self::more(size);
        HELD.fetch_sub(layout.size(), Relaxed);
        // SAFETY: as above.
        unsafe { System.realloc(at, layout, size) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size(), Relaxed);
        // SAFETY: as above.
        unsafe { System.dealloc(at, layout) }
    }
}

/// Says why and ends the process as libFuzzer expects of a find: it then writes the input to a file.
fn stop(why: &str) -> ! {
    eprintln!("find: {why}");
    std::process::abort()
}

/// Time of the processor this process has used [s].
fn used() -> f64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `time` is valid for writing.
    let code = unsafe { libc::clock_gettime(libc::CLOCK_PROCESS_CPUTIME_ID, &raw mut time) };
    assert_eq!(code, 0, "no clock of the process");
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Calls `read` on an input of `size` bytes, on this thread alone (parallel loops too), and ends the process when it takes
/// more than `seconds` or more memory than it may.
pub fn within(size: usize, seconds: f64, read: impl FnOnce()) {
    static POOL: Once = Once::new();
    POOL.call_once(|| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread();
        pool.build_global().expect("no other pool was made");
    });
    ALLOWED.store(HELD.load(Relaxed) + MEMORY + MEMORY_RATIO * size, Relaxed);
    let start = used();
    read();
    let took = used() - start;
    ALLOWED.store(usize::MAX, Relaxed);
    if took > seconds {
        stop(&format!("an input takes {took:.2} s of the processor, {seconds} s are allowed"));
    }
}
