//! Pages in a headless Chromium.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// What tests of pages need, and how to get it.
pub const CHROMIUM: [&str; 2] = [
    "a Chromium browser",
    "install the package chromium, or name the program in KANAGATA_CHROMIUM",
];

/// The browser, if there is one.
pub fn chromium() -> Option<PathBuf> {
    if let Some(named) = std::env::var_os("KANAGATA_CHROMIUM") {
        return Some(named.into());
    }
    let path = std::env::var_os("PATH")?;
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let all =
        names.iter().flat_map(|name| std::env::split_paths(&path).map(move |at| at.join(name)));
    all.into_iter().find(|program| program.is_file())
}

/// Options that keep the browser off the network, with WebGL by the processor.
const OPTIONS: [&str; 9] = [
    "--headless=new",
    "--no-sandbox",
    "--disable-quic",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--virtual-time-budget=300000",
];

/// The document of a page after its scripts have run in a window of this height [px]; `more`: options.
pub fn document(browser: &Path, page: &Path, height: usize, more: &[&str]) -> String {
    let profile = tempfile::tempdir().unwrap();
    let done = Command::new(browser)
        .args(OPTIONS)
        .args(more)
        .arg(format!("--window-size=1200,{height}"))
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .arg("--dump-dom")
        .arg(format!("file://{}", page.display()))
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let errors = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success(), "{errors}");
    String::from_utf8(done.stdout).unwrap()
}

/// Results of a script that acts on a page: it gives an object, which becomes text in the page. The page has no policy then.
pub fn driven(browser: &Path, page: &Path, script: &str) -> serde_json::Value {
    let html = fs::read_to_string(page).unwrap();
    let (before, rest) = html.split_once("<meta http-equiv=\"Content-Security-Policy\"").unwrap();
    let (_, after) = rest.split_once('>').unwrap();
    let after = after.replace(
        "</body></html>",
        &format!("<pre id=\"results\"></pre><script>{HELPERS}(async () => {{{script}}})().then(done, (e) => done(String(e.stack)));</script></body></html>"),
    );
    let driven = page.with_file_name("driven.html");
    fs::write(&driven, format!("{before}{after}")).unwrap();
    let document = document(browser, &driven, 900, &[]);
    let (_, rest) = document.split_once("<pre id=\"results\">").unwrap();
    let text = rest
        .split_once("</pre>")
        .unwrap()
        .0
        .replace("&lt;", "<")
        .replace("&gt;", ">")
        .replace("&amp;", "&");
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}: '{text}'"))
}

/// Functions for scripts that act on a page.
const HELPERS: &str = r#"
const done = (result) => { document.getElementById("results").textContent = JSON.stringify(result); };
// The browser's clock runs ahead where it has nothing to do: each wait gives other threads time as well.
const wait = (ms) => new Promise((resume) => {
  let sum = 0;
  for (let k = 0; k < 3e6; k++) sum += Math.sqrt(k);
  setTimeout(() => resume(sum), ms);
});
const change = (control, value, event) => { control.value = value; control.dispatchEvent(new Event(event, { bubbles: true })); };
const press = (target, key) => target.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true }));
async function live(id) {
  const figure = document.getElementById(id);
  figure.scrollIntoView();
  for (let k = 0; k < 1000 && !figure.classList.contains("live"); k++) await wait(50);
  if (!figure.classList.contains("live")) throw new Error(`${id} is a picture`);
  await wait(200);
  return figure;
}
function probes(figure, columns, rows) {
  const canvas = figure.querySelector("canvas");
  const box = canvas.getBoundingClientRect();
  const out = [];
  for (let i = 0; i < columns; i++) {
    for (let j = 0; j < rows; j++) {
      const [clientX, clientY] = [box.left + (box.width * (i + 0.5)) / columns, box.top + (box.height * (j + 0.5)) / rows];
      canvas.dispatchEvent(new PointerEvent("pointermove", { clientX, clientY, pointerId: 9, bubbles: true }));
      const text = figure.querySelector(".probe").textContent;
      if (text) out.push(text);
    }
  }
  return out;
}
// Number of pixels of the canvas that are not clear, and a sum over all.
function pixels(figure) {
  const canvas = figure.querySelector("canvas");
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  let [count, sum] = [0, 0];
  for (let k = 0; k < data.length; k += 4) {
    count += data[k + 3] > 0;
    sum = (sum * 31 + data[k] + data[k + 1] + data[k + 2]) % 1000003;
  }
  return { count, sum };
}
"#;
