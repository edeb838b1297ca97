//! `kanagata-solve`: the forming solver.

fn main() -> std::process::ExitCode {
    kanagata::cli::solve::main()
}
