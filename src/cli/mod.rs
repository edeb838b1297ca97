//! One file a subcommand, for both programs.
