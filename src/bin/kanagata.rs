//! CAD to tool models, audits, reports.

fn main() -> std::process::ExitCode {
    kanagata::cli::cad::main()
}
