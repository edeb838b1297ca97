//! Time and memory that one input may take.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::Once;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// What the readers promise for any input of this size [bytes].
const MEMORY: usize = 256 << 20;
/// What the readers promise [s]: time of the processor, so that a busy machine finds nothing.
const SECONDS: f64 = 1.0;

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
            stop(&format!("an input takes more than {} MB: {size} bytes more", MEMORY >> 20));
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

/// Calls `read` on this thread alone (parallel loops too) and ends the process when it takes more time or memory
/// than the readers promise.
pub fn within_limits(read: impl FnOnce()) {
    static POOL: Once = Once::new();
    POOL.call_once(|| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread();
        pool.build_global().expect("no other pool was made");
    });
    ALLOWED.store(HELD.load(Relaxed) + MEMORY, Relaxed);
    let start = used();
    read();
    let took = used() - start;
    ALLOWED.store(usize::MAX, Relaxed);
    if took > SECONDS {
        stop(&format!("an input takes {took:.2} s of the processor, {SECONDS} s are allowed"));
    }
}
