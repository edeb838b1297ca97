//! What people look at: history, VTU, HTML.
