//! A headless Chromium, spoken to over its own pipe [Chrome DevTools Protocol, `--remote-debugging-pipe`]: no server, no port, no driver.

use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// The longest that an answer, or what is waited for, may take.
const PATIENCE: Duration = Duration::from_secs(120);
const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];

/// One browser runs at a time: it has processes enough to keep a machine busy, and pages of several wait for one another.
static ALONE: Mutex<()> = Mutex::new(());

/// A browser with one page, which is closed when it is dropped.
pub struct Browser {
    process: Child,
    input: ChildStdin,
    answers: Receiver<Value>,
    session: Option<String>,
    last: u64,
    complaints: Vec<String>,
    _profile: TempDir,
    _alone: MutexGuard<'static, ()>,
}

/// The browser's program: NEUMANN_BROWSER, or the first of the usual names that is found.
fn program() -> Option<PathBuf> {
    if let Some(path) = std::env::var_os("NEUMANN_BROWSER") {
        return Some(path.into());
    }
    let folders: Vec<PathBuf> = std::env::split_paths(&std::env::var_os("PATH")?).collect();
    NAMES.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name))).find(|path| path.is_file())
}

impl Browser {
    /// Starts one; `None` where there is none, which it says.
    pub fn start() -> Option<Self> {
        let Some(program) = program() else {
            println!("skipped: no browser; .ci/browser installs one, or set NEUMANN_BROWSER");
            return None;
        };
        let alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
        let profile = tempfile::tempdir().unwrap();
        // It reads from descriptor 3 and writes to descriptor 4.
        let mut process = Command::new("sh")
            .args(["-c", "exec \"$0\" \"$@\" 3<&0 4>&1 </dev/null >/dev/null 2>/dev/null"])
            .arg(program)
            .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run"])
            .arg("--remote-debugging-pipe")
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .env("TMPDIR", profile.path())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("a shell starts");
        let (input, output) = (process.stdin.take().unwrap(), process.stdout.take().unwrap());
        let (sender, answers) = channel();
        std::thread::spawn(move || {
            for message in BufReader::new(output).split(0).map_while(Result::ok) {
                let message = serde_json::from_slice(&message).expect("the browser writes JSON");
                if sender.send(message).is_err() {
                    break;
                }
            }
        });
        let mut browser = Self {
            process,
            input,
            answers,
            session: None,
            last: 0,
            complaints: Vec::new(),
            _profile: profile,
            _alone: alone,
        };
        let Some(target) = browser.answer("Target.createTarget", json!({"url": "about:blank"})) else {
            println!("skipped: the browser is there, but does not start");
            return None;
        };
        let target = target["targetId"].clone();
        let attached = browser.ask("Target.attachToTarget", json!({"targetId": target, "flatten": true}));
        browser.session = attached["sessionId"].as_str().map(str::to_owned);
        for domain in ["Page", "Runtime", "Log"] {
            browser.ask(&format!("{domain}.enable"), json!({}));
        }
        browser.resize(1280, 800);
        Some(browser)
    }

    /// Sends a command and waits for its result.
    fn ask(&mut self, method: &str, parameters: Value) -> Value {
        self.answer(method, parameters).unwrap_or_else(|| panic!("no answer to {method}"))
    }

    /// The same; `None` where no answer comes. Notes what the page complains about meanwhile.
    fn answer(&mut self, method: &str, parameters: Value) -> Option<Value> {
        self.last += 1;
        let mut message = json!({"id": self.last, "method": method, "params": parameters});
        if let Some(session) = &self.session {
            message["sessionId"] = json!(session);
        }
        let mut bytes = message.to_string().into_bytes();
        bytes.push(0);
        self.input.write_all(&bytes).ok()?;
        loop {
            let answer = self.answers.recv_timeout(PATIENCE).ok()?;
            if answer["id"] == self.last {
                assert!(answer["error"].is_null(), "{method}: {}", answer["error"]);
                return Some(answer["result"].clone());
            }
            self.note(&answer);
        }
    }

    fn note(&mut self, event: &Value) {
        let parameters = &event["params"];
        let is_complaint = match event["method"].as_str() {
            Some("Runtime.exceptionThrown") => true,
            Some("Runtime.consoleAPICalled") => {
                ["error", "warning", "assert"].contains(&parameters["type"].as_str().unwrap_or(""))
            }
            Some("Log.entryAdded") => {
                ["error", "warning"].contains(&parameters["entry"]["level"].as_str().unwrap_or(""))
            }
            _ => false,
        };
        if is_complaint {
            self.complaints.push(parameters.to_string());
        }
    }

    /// The size of the window.
    pub fn resize(&mut self, width: u32, height: u32) {
        let size = json!({"width": width, "height": height, "deviceScaleFactor": 1, "mobile": false});
        self.ask("Emulation.setDeviceMetricsOverride", size);
    }

    /// Whether the reader prefers a page `light` or `dark`.
    pub fn prefer(&mut self, scheme: &str) {
        let feature = json!({"name": "prefers-color-scheme", "value": scheme});
        self.ask("Emulation.setEmulatedMedia", json!({"features": [feature]}));
    }

    /// Opens a file, and waits until it is loaded and its first image painted.
    pub fn open(&mut self, path: &Path) {
        self.ask("Page.navigate", json!({"url": format!("file://{}", path.display())}));
        self.wait("document.readyState === 'complete' && document.querySelector('.viewer')?.dataset.turn");
    }

    /// The value of an expression, which may be a promise.
    pub fn value(&mut self, expression: &str) -> Value {
        let asked = json!({"expression": expression, "awaitPromise": true, "returnByValue": true});
        let result = self.ask("Runtime.evaluate", asked);
        assert!(result["exceptionDetails"].is_null(), "{expression:.200}: {}", result["exceptionDetails"]);
        result["result"]["value"].clone()
    }

    /// Waits until an expression is true.
    pub fn wait(&mut self, expression: &str) {
        let begin = Instant::now();
        while !self.value(&format!("Boolean({expression})")).as_bool().unwrap() {
            assert!(begin.elapsed() < PATIENCE, "{expression} never holds; {:?}", self.complaints);
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Presses and releases a key, such as `ArrowRight` or `v`.
    pub fn press(&mut self, key: &str) {
        for kind in ["keyDown", "keyUp"] {
            self.ask("Input.dispatchKeyEvent", json!({"type": kind, "key": key}));
        }
    }

    /// Turns the wheel over a place of the window.
    pub fn wheel(&mut self, (x, y): (f64, f64), down: f64) {
        self.ask("Input.dispatchMouseEvent", json!({"type": "mouseMoved", "x": x, "y": y}));
        let wheel = json!({"type": "mouseWheel", "x": x, "y": y, "deltaX": 0, "deltaY": down});
        self.ask("Input.dispatchMouseEvent", wheel);
    }

    /// Has a screen that is touched.
    pub fn touches(&mut self) {
        self.ask("Emulation.setTouchEmulationEnabled", json!({"enabled": true, "maxTouchPoints": 2}));
    }

    /// Puts fingers down, moves them along these places and lifts them.
    pub fn touch<const N: usize>(&mut self, paths: &[[(f64, f64); N]]) {
        for (i, places) in paths.iter().enumerate() {
            let kind = if i == 0 { "touchStart" } else { "touchMove" };
            let points: Vec<Value> =
                places.iter().enumerate().map(|(id, (x, y))| json!({"x": x, "y": y, "id": id})).collect();
            self.ask("Input.dispatchTouchEvent", json!({"type": kind, "touchPoints": points}));
        }
        self.ask("Input.dispatchTouchEvent", json!({"type": "touchEnd", "touchPoints": []}));
    }

    /// Shows the page as it is printed.
    pub fn print(&mut self) {
        self.ask("Emulation.setEmulatedMedia", json!({"media": "print"}));
    }

    /// The printed pages as a PDF file.
    pub fn pages(&mut self) -> Vec<u8> {
        let pages = self.ask("Page.printToPDF", json!({"paperWidth": 8.27, "paperHeight": 11.69}));
        decoded(pages["data"].as_str().unwrap())
    }

    /// Opens a file with scripts switched off.
    pub fn without_scripts(&mut self, path: &Path) {
        self.ask("Emulation.setScriptExecutionDisabled", json!({"value": true}));
        self.ask("Page.navigate", json!({"url": format!("file://{}", path.display())}));
        self.wait("document.readyState === 'complete' && document.querySelector('.pictures')");
    }

    /// What the console had to say of errors and warnings since the last call.
    pub fn complaints(&mut self) -> Vec<String> {
        // What came before an answer has been noted.
        self.value("0");
        std::mem::take(&mut self.complaints)
    }
}

/// The bytes of base64.
fn decoded(text: &str) -> Vec<u8> {
    let digit = |c: u8| match c {
        b'A'..=b'Z' => c - b'A',
        b'a'..=b'z' => c - b'a' + 26,
        b'0'..=b'9' => c - b'0' + 52,
        b'+' => 62,
        _ => 63,
    };
    let digits: Vec<u8> = text.bytes().filter(|&c| c != b'=').map(digit).collect();
    let group = |four: &[u8]| {
        let bits = four.iter().fold(0_u32, |bits, &d| bits << 6 | u32::from(d)) << (6 * (4 - four.len()));
        bits.to_be_bytes()[1..four.len()].to_vec()
    };
    digits.chunks(4).flat_map(group).collect()
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
