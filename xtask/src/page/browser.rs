//! Headless Chromium over the DevTools protocol, through the pipes of `--remote-debugging-pipe`: JSON messages that end with a zero.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use serde_json::{Value, json};

/// Longest wait for an answer of the browser.
const ANSWER: Duration = Duration::from_secs(60);
/// Time between two looks at the page.
const LOOK: Duration = Duration::from_millis(50);
/// The browser reads commands from file descriptor 3 and answers on 4.
const PIPES: &str = r#"exec "$0" "$@" 3<&0 4>&1 </dev/null >/dev/null 2>&1"#;
const FLAGS: &[&str] = &[
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--remote-debugging-pipe",
];

/// A browser with one page.
pub(super) struct Browser {
    process: Child,
    commands: ChildStdin,
    messages: Receiver<Value>,
    /// Profile and downloads, removed at the end.
    folder: PathBuf,
    session: Value,
    last: u64,
    /// Errors on the console and exceptions that nothing caught.
    pub(super) errors: Vec<String>,
}

impl Browser {
    /// Starts a browser whose files are in a new folder.
    pub(super) fn start(folder: PathBuf) -> Result<Self> {
        fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
        let mut process = Command::new("sh")
            .args(["-c", PIPES, "chromium"])
            .args(FLAGS)
            .arg(format!("--user-data-dir={}", folder.join("profile").display()))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .context("cannot start chromium")?;
        let commands = process.stdin.take().context("a pipe that was asked for")?;
        let mut answers = BufReader::new(process.stdout.take().context("a pipe that was asked for")?);
        let (send, messages) = channel();
        thread::spawn(move || {
            let mut bytes = Vec::new();
            while answers.read_until(0, &mut bytes).is_ok_and(|length| length > 0) {
                let message = serde_json::from_slice(bytes.strip_suffix(&[0]).unwrap_or(&bytes));
                bytes.clear();
                if message.is_ok_and(|message| send.send(message).is_err()) {
                    return;
                }
            }
        });
        let mut browser =
            Self { process, commands, messages, folder, session: Value::Null, last: 0, errors: Vec::new() };
        let downloads = browser.folder.display().to_string();
        browser.ask("Browser.setDownloadBehavior", json!({"behavior": "allow", "downloadPath": downloads}))?;
        let page = browser.ask("Target.createTarget", json!({"url": "about:blank"}))?["targetId"].take();
        let attached = browser.ask("Target.attachToTarget", json!({"targetId": page, "flatten": true}))?;
        browser.session = attached["sessionId"].clone();
        for domain in ["Page", "Runtime", "Log", "DOM"] {
            browser.ask(&format!("{domain}.enable"), json!({}))?;
        }
        Ok(browser)
    }

    /// Sends a command and returns its result; errors of the page that come before it are kept.
    pub(super) fn ask(&mut self, method: &str, parameters: Value) -> Result<Value> {
        self.last += 1;
        let mut command = json!({"id": self.last, "method": method, "params": parameters});
        if !self.session.is_null() {
            command["sessionId"] = self.session.clone();
        }
        self.commands.write_all(format!("{command}\0").as_bytes()).context("chromium has ended")?;
        loop {
            let mut message = self.messages.recv_timeout(ANSWER).with_context(|| format!("no answer to {method}"))?;
            if message["id"] == self.last {
                if let Some(error) = message.get("error") {
                    bail!("{method}: {error}");
                }
                return Ok(message["result"].take());
            }
            let parameters = &message["params"];
            match message["method"].as_str() {
                Some("Runtime.exceptionThrown") => self.errors.push(parameters["exceptionDetails"].to_string()),
                Some("Runtime.consoleAPICalled") if parameters["type"] == "error" => {
                    self.errors.push(parameters["args"].to_string());
                }
                Some("Log.entryAdded") if parameters["entry"]["level"] == "error" => {
                    self.errors.push(parameters["entry"]["text"].to_string());
                }
                _ => {}
            }
        }
    }

    /// Opens a file and waits until it is loaded.
    pub(super) fn open(&mut self, file: &Path) -> Result<()> {
        self.ask("Page.navigate", json!({"url": format!("file://{}", file.display())}))?;
        self.wait("document.readyState === 'complete' && location.protocol === 'file:'", ANSWER)
    }

    /// The value of an expression in the page.
    pub(super) fn value(&mut self, expression: &str) -> Result<Value> {
        let parameters = json!({"expression": expression, "returnByValue": true, "awaitPromise": true});
        let mut answer = self.ask("Runtime.evaluate", parameters)?;
        if let Some(exception) = answer.get("exceptionDetails") {
            bail!("`{expression}`: {exception}");
        }
        Ok(answer["result"]["value"].take())
    }

    /// The text of an element.
    pub(super) fn text(&mut self, id: &str) -> Result<String> {
        let text = self.value(&format!("document.getElementById('{id}').textContent"))?;
        Ok(text.as_str().with_context(|| format!("#{id} has no text"))?.to_owned())
    }

    /// Waits until an expression is true.
    pub(super) fn wait(&mut self, expression: &str, longest: Duration) -> Result<()> {
        let begin = Instant::now();
        while self.value(expression)? != true {
            if begin.elapsed() > longest {
                bail!("after {} s not true: {expression}; errors: {:?}", longest.as_secs(), self.errors);
            }
            thread::sleep(LOOK);
        }
        Ok(())
    }

    /// Sets a field as a user does.
    pub(super) fn set(&mut self, id: &str, value: &str) -> Result<()> {
        let events = "for (const kind of ['input', 'change']) field.dispatchEvent(new Event(kind, { bubbles: true }));";
        let set = if value == "true" || value == "false" { "checked" } else { "value" };
        let value = if set == "value" { json!(value).to_string() } else { value.to_owned() };
        self.value(&format!("{{ const field = document.getElementById('{id}'); field.{set} = {value}; {events} }}"))
            .map(drop)
    }

    /// The middle of an element on the screen, which is scrolled to it.
    fn middle(&mut self, selector: &str) -> Result<[f64; 2]> {
        let of = format!(
            "(() => {{ const of = document.querySelector({}); of.scrollIntoView({{ block: 'center' }}); \
             const box = of.getBoundingClientRect(); return [box.x + box.width / 2, box.y + box.height / 2]; }})()",
            json!(selector)
        );
        let at = self.value(&of)?;
        match [&at[0], &at[1]].map(Value::as_f64) {
            [Some(x), Some(y)] => Ok([x, y]),
            _ => bail!("{selector} is not on the page"),
        }
    }

    /// Presses the mouse in the middle of an element, moves it by some pixels, and releases it.
    pub(super) fn drag(&mut self, selector: &str, by: [f64; 2]) -> Result<()> {
        let [x, y] = self.middle(selector)?;
        let mut mouse = |kind: &str, part: f64| {
            let at = [x + part * by[0], y + part * by[1]];
            let parameters =
                json!({"type": kind, "x": at[0], "y": at[1], "button": "left", "buttons": 1, "clickCount": 1});
            self.ask("Input.dispatchMouseEvent", parameters).map(drop)
        };
        mouse("mousePressed", 0.0)?;
        if by != [0.0; 2] {
            (1..=20).try_for_each(|step| mouse("mouseMoved", f64::from(step) / 20.0))?;
        }
        mouse("mouseReleased", 1.0)
    }

    /// Clicks an element.
    pub(super) fn click(&mut self, id: &str) -> Result<()> {
        self.drag(&format!("#{id}"), [0.0; 2])
    }

    /// Presses a key of the keyboard.
    pub(super) fn key(&mut self, key: &str) -> Result<()> {
        for kind in ["keyDown", "keyUp"] {
            self.ask("Input.dispatchKeyEvent", json!({"type": kind, "key": key, "code": key}))?;
        }
        Ok(())
    }

    /// Chooses a file in a field.
    pub(super) fn choose(&mut self, id: &str, file: &Path) -> Result<()> {
        let root = self.ask("DOM.getDocument", json!({}))?["root"]["nodeId"].take();
        let field =
            self.ask("DOM.querySelector", json!({"nodeId": root, "selector": format!("#{id}")}))?["nodeId"].take();
        self.ask("DOM.setFileInputFiles", json!({"nodeId": field, "files": [file]})).map(drop)
    }

    /// Drops a file with a text on the page.
    pub(super) fn drop_file(&mut self, name: &str, text: &str) -> Result<()> {
        let (name, text) = (json!(name), json!(text));
        self.value(&format!(
            "{{ const dataTransfer = new DataTransfer(); dataTransfer.items.add(new File([{text}], {name})); \
             const drop = new DragEvent('drop', {{ dataTransfer, bubbles: true, cancelable: true }}); \
             document.querySelector('main').dispatchEvent(drop); }}"
        ))
        .map(drop)
    }

    /// Waits for a download and returns its text.
    pub(super) fn downloaded(&mut self, name: &str) -> Result<String> {
        let path = self.folder.join(name);
        let begin = Instant::now();
        while !path.exists() {
            if begin.elapsed() > ANSWER {
                bail!("{name} was not saved");
            }
            thread::sleep(LOOK);
        }
        let text = fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
        fs::remove_file(&path)?;
        Ok(text)
    }

    /// Sets the width of the screen, in pixels, and its colours.
    pub(super) fn screen(&mut self, width: u32, scheme: &str) -> Result<()> {
        let size = json!({"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 500});
        self.ask("Emulation.setDeviceMetricsOverride", size)?;
        let media = json!({"features": [{"name": "prefers-color-scheme", "value": scheme}]});
        self.ask("Emulation.setEmulatedMedia", media).map(drop)
    }

    /// The whole page as a picture (PNG in base 64).
    pub(super) fn picture(&mut self) -> Result<String> {
        let mut picture = self.ask("Page.captureScreenshot", json!({"captureBeyondViewport": true}))?;
        Ok(picture["data"].take().as_str().context("a picture")?.to_owned())
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
        let _ = fs::remove_dir_all(&self.folder);
    }
}
