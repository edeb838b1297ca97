//! `kanagata`: CAD to tool models, audits, studies.

fn main() -> std::process::ExitCode {
    kanagata::cli::cad::main()
}
