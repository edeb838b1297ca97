//! Running the binary.

use std::path::Path;

use assert_cmd::Command;

/// A file of the fixtures.
pub fn fixture(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name);
    path.to_str().unwrap().to_owned()
}

/// Exit code, output and error text of `kanagata`.
pub fn kanagata(arguments: &[&str]) -> (i32, String, String) {
    let done = Command::cargo_bin("kanagata").unwrap().args(arguments).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (done.status.code().unwrap_or(-1), text(&done.stdout), text(&done.stderr))
}
