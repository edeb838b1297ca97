//! Being asked to stop.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::{SIGINT, SIGTERM};

/// A flag that is set when the process is asked to end (SIGTERM, SIGINT) in the place of ending at once.
pub(super) fn stop_flag() -> Arc<AtomicBool> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGTERM, SIGINT] {
        // Without it a signal ends the program at once; the last checkpoint stays.
        let _ = signal_hook::flag::register(signal, Arc::clone(&stop));
    }
    stop
}
