//! A scene becomes a run folder.
