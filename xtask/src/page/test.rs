//! The page in a browser, by clicks and keys, compared with the command `vsj`.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::Value;
use xtask::{build, shell};

use super::browser::Browser;

/// Longest run of the control panel and of a diagnosis.
const CONTROL: Duration = Duration::from_secs(30);
const DIAGNOSIS: Duration = Duration::from_secs(300);
/// Relative difference between numbers of the page and of the command: their functions in double precision (`exp`, `sin`) are of
/// different libraries. The fixed-point tick has none.
const ROUNDING: f64 = 1e-12;
/// Relative difference between results of a search on the page and in the command: its steps end when they gain little.
const CONVERGENCE: f64 = 1e-5;
/// Relative difference between errors of a search's result on readings that it did not see: they are not at a minimum there, so that a
/// difference between the results changes them in proportion, and not as its square.
const UNSEEN: f64 = 1e-4;
/// Relative difference between the numbers of steps of a search on the page and in the command.
const WORK: f64 = 0.04;
/// Relative difference between the largest errors of the fixed-point tick on the page and in the command: its rounding depends on the
/// last digit of each parameter.
const OF_TICK: f64 = 1e-4;
/// Longest time until something of the page is painted, in ms: of several loads the best, as other work may delay one.
const PAINT_MS: f64 = 1000.0;
const LOADS: usize = 3;
/// A record in the repository.
const RECORD: &str = "data/sample_hysteresis.csv";

/// The browser, the command and a folder for the command's files.
struct Test {
    browser: Browser,
    vsj: PathBuf,
    folder: PathBuf,
}

/// One test.
type Check = fn(&mut Test) -> Result<()>;

/// Runs all tests on the page in a folder; pictures of it go to the folder `page-test` beside it.
pub(super) fn run(page: &Path) -> Result<()> {
    let vsj = build::vsj()?;
    let folder = env::temp_dir().join(format!("vsj-page-{}", std::process::id()));
    let mut test = Test { browser: Browser::start(folder.join("browser"))?, vsj, folder };
    let tests: [(&str, Check); 12] = [
        ("the stair has the command's numbers", Test::stair),
        ("every field has a label", Test::labels),
        ("a target drawn by pointer and keys has the command's numbers", Test::drawn),
        ("settings out of range show the command's error", Test::refused),
        ("a hidden effect is diagnosed like the command's", Test::hidden),
        ("a spring is identified with its cause like the command's", Test::identified),
        ("a file is diagnosed like the command's", Test::file),
        ("several records are diagnosed like the command's", Test::several),
        ("the next experiment is the command's, and is simulated", Test::planned),
        ("cancel gives the best answer so far", Test::best_so_far),
        ("cancel again ends a diagnosis without an answer", Test::cancel),
        ("a damaged file shows the command's error", Test::damaged),
    ];
    test.browser.screen(1400, "light")?;
    let paint_ms = test.paint_ms(&page.join("index.html"))?;
    println!("first paint after {paint_ms:.0} ms");
    ensure!(paint_ms < PAINT_MS, "first paint after {paint_ms:.0} ms; expected less than {PAINT_MS}");
    for (name, of) in tests {
        let begin = Instant::now();
        of(&mut test).with_context(|| name.to_owned())?;
        println!("ok, {:.1} s: {name}", begin.elapsed().as_secs_f64());
    }
    let pictures = page.with_file_name("page-test");
    fs::create_dir_all(&pictures)?;
    test.screens(&pictures)?;
    test.reports(&pictures)?;
    ensure!(test.browser.errors.is_empty(), "errors in the page: {:?}", test.browser.errors);
    fs::remove_dir_all(&test.folder).with_context(|| format!("cannot remove {}", test.folder.display()))
}

impl Test {
    /// Loads the page several times; returns the shortest time until something was painted.
    fn paint_ms(&mut self, page: &Path) -> Result<f64> {
        let paint = "performance.getEntriesByName('first-contentful-paint')[0]?.startTime";
        let mut shortest = f64::INFINITY;
        for _ in 0..LOADS {
            self.browser.open(page)?;
            self.browser.wait(&format!("{paint} > 0"), CONTROL)?;
            shortest = shortest.min(self.browser.value(paint)?.as_f64().context("nothing was painted")?);
        }
        Ok(shortest)
    }

    /// Waits until the control panel has shown what the settings make, and returns its JSON.
    fn control(&mut self) -> Result<Value> {
        self.browser.wait("document.body.dataset.control === 'done'", CONTROL)?;
        Ok(serde_json::from_str(&self.browser.text("stair-json")?)?)
    }

    /// The answer of the command in the folder of its files.
    fn command(&self, args: &[&str]) -> Result<Value> {
        shell::json(shell::command(&self.vsj).args(args).arg("--json").current_dir(&self.folder))
    }

    /// The command's refusal, without its name.
    fn refusal(&self, args: &[&str]) -> Result<String> {
        let output = shell::command(&self.vsj).args(args).current_dir(&self.folder).output()?;
        ensure!(output.status.code() == Some(2), "`vsj {}` is not refused", args.join(" "));
        let text = String::from_utf8(output.stderr)?;
        Ok(text.trim().trim_start_matches("vsj: ").to_owned())
    }

    fn stair(&mut self) -> Result<()> {
        self.browser.wait("document.body.dataset.control === 'done'", CONTROL)?;
        same("stair", &self.control()?, &self.command(&["stair", "--input", "step"])?, ROUNDING)?;
        self.browser.set("controller", "fast")?;
        self.browser.set("limit", "1000")?;
        let args = ["stair", "--input", "step", "--controller", "fast", "--limit-v", "1000"];
        same("stair", &self.control()?, &self.command(&args)?, ROUNDING)?;
        self.browser.set("target", "stair")?;
        self.browser.set("tau", "4")?;
        self.browser.set("slew", "400")?;
        self.write("p.toml", "schema = 1\n[relaxation]\nshare = 0.0909\ntau_s = 4\n")?;
        let args = [&["stair", "--plant", "p.toml", "--slew-v-per-s", "400"], &args[3..]].concat();
        same("stair", &self.control()?, &self.command(&args)?, ROUNDING)?;
        self.browser.click("report-spring")?;
        self.browser.set("slew", "")?;
        self.browser.set("limit", "700")?;
        self.browser.set("controller", "paper")?;
        let answer = self.control()?;
        ensure!(answer["printed_agree"] == 32, "of Table 3 agree {}", answer["printed_agree"]);
        Ok(())
    }

    fn labels(&mut self) -> Result<()> {
        let fields = "[...document.querySelectorAll('input, select, textarea')].filter((of) => !of.labels.length).map((of) => of.id)";
        let buttons =
            "[...document.querySelectorAll('button')].filter((of) => !of.textContent.trim()).map((of) => of.id)";
        for unnamed in [fields, buttons] {
            let found = self.browser.value(unnamed)?;
            ensure!(found.as_array().is_some_and(Vec::is_empty), "without a name: {found}");
        }
        let images = self.browser.value("document.querySelectorAll('svg[role=img][aria-label]').length")?;
        ensure!(images.as_u64() >= Some(2), "{images} plots have a description");
        Ok(())
    }

    fn drawn(&mut self) -> Result<()> {
        self.browser.set("target", "drawn")?;
        self.control()?;
        self.browser.set("points", "0 0\n5 300\n20,100\n 35 450\n60 450\n")?;
        self.control()?;
        let before = self.points()?;
        ensure!(before == [[0.0, 0.0], [5.0, 300.0], [20.0, 100.0], [35.0, 450.0], [60.0, 450.0]], "typed: {before:?}");
        self.browser.drag("#drawing [data-index='1']", [20.0, 30.0])?;
        let moved = self.points()?;
        ensure!(moved[1][0] > before[1][0] && moved[1][1] < before[1][1], "not moved: {moved:?}");
        for key in ["ArrowUp", "ArrowRight", "+"] {
            self.browser.key(key)?;
        }
        let pressed = self.points()?;
        ensure!(
            pressed[1] == [moved[1][0] + 0.5, moved[1][1] + 10.0] && pressed.len() == moved.len() + 1,
            "the keys made {pressed:?} of {moved:?}"
        );
        self.browser.drag("#drawing", [60.0, -40.0])?;
        ensure!(self.points()?.len() > pressed.len() + 3, "nothing was drawn");
        let page = self.control()?;
        self.browser.click("save-target")?;
        let csv = self.browser.downloaded("target.csv")?;
        self.write("target.csv", &csv)?;
        same("drawn", &page, &self.command(&["stair", "--input", "target.csv"])?, ROUNDING)?;
        self.browser.set("linear", "true")?;
        let args = ["stair", "--input", "target.csv", "--between", "linear"];
        same("drawn", &self.control()?, &self.command(&args)?, ROUNDING)
    }

    /// The points of the drawing, in s and V.
    fn points(&mut self) -> Result<Vec<[f64; 2]>> {
        let text = self.browser.value("document.getElementById('points').value")?;
        let point = |line: &str| {
            let (time, volts) = line.split_once(' ')?;
            Some([time.parse().ok()?, volts.parse().ok()?])
        };
        text.as_str().context("a text")?.lines().map(|line| point(line).with_context(|| line.to_owned())).collect()
    }

    fn refused(&mut self) -> Result<()> {
        self.browser.set("target", "step")?;
        self.browser.set("limit", "5")?;
        self.browser.wait("document.body.dataset.control === 'refused'", CONTROL)?;
        let shown = self.browser.text("control-error")?;
        let refusal = self.refusal(&["stair", "--input", "step", "--limit-v", "5"])?;
        ensure!(refusal == shown, "the page shows `{shown}`, the command `{refusal}`");
        self.browser.set("limit", "700")?;
        self.control().map(drop)
    }

    fn hidden(&mut self) -> Result<()> {
        self.browser.set("target", "stair")?;
        self.browser.set("effect", "hysteresis")?;
        self.control()?;
        self.save_record("record.csv")?;
        self.browser.click("diagnose-hidden")?;
        let page = self.found()?;
        same("diagnosis", &page, &self.command(&["diagnose", "record.csv"])?, CONVERGENCE)?;
        let cause = &page["findings"][0]["cause"];
        ensure!(cause == "hysteresis", "the first finding is {cause}");
        let text = self.browser.text("answer")?;
        ensure!(text.contains("hysteresis") && text.contains("width_v"), "the table shows {text}");
        Ok(())
    }

    /// Saves the record that the panel has made as a file of the command.
    fn save_record(&mut self, name: &str) -> Result<()> {
        self.browser.click("save-record")?;
        let csv = self.browser.downloaded("record.csv")?;
        self.write(name, &csv).map(drop)
    }

    /// Waits for the end of a diagnosis and returns its JSON.
    fn found(&mut self) -> Result<Value> {
        self.browser.wait("document.body.dataset.record === 'idle'", DIAGNOSIS)?;
        let error = self.browser.text("record-error")?;
        ensure!(error.is_empty(), "{error}");
        Ok(serde_json::from_str(&self.browser.text("diagnosis-json")?)?)
    }

    /// A curve, of which the identified spring has the mean slope: once it is known, nothing else is left to find. Under a loop the
    /// identified spring has lags without a use, and the last digits of the answer depend on rounding.
    fn identified(&mut self) -> Result<()> {
        self.browser.set("effect", "static-nonlinearity")?;
        self.control()?;
        self.save_record("curve.csv")?;
        let file = self.folder.join("curve.csv");
        self.browser.choose("file", &file)?;
        self.browser.wait("document.getElementById('file-name').textContent.startsWith('curve')", CONTROL)?;
        self.browser.set("nominal", "identify")?;
        self.browser.click("diagnose")?;
        let page = self.found()?;
        same("diagnose", &page, &self.command(&["diagnose", "curve.csv", "--plant", "identify"])?, CONVERGENCE)?;
        let cause = &page["findings"][0]["cause"];
        ensure!(cause == "static-nonlinearity", "the first finding is {cause}");
        Ok(())
    }

    fn file(&mut self) -> Result<()> {
        let record = shell::root().join(RECORD);
        let name = record.file_name().and_then(|name| name.to_str()).context("a name")?;
        fs::copy(&record, self.folder.join(name))?;
        self.browser.choose("file", &record)?;
        self.browser.wait("document.getElementById('file-name').textContent.startsWith('sample')", CONTROL)?;
        self.browser.set("nominal", "paper")?;
        self.browser.set("order", "2")?;
        self.browser.click("identify")?;
        same("identify", &self.found()?, &self.command(&["identify", name, "--order", "2"])?, CONVERGENCE)?;
        self.browser.set("order", "")?;
        for command in ["identify", "diagnose"] {
            let begin = Instant::now();
            self.browser.click(command)?;
            let page = self.found()?;
            let browser = begin.elapsed().as_secs_f64();
            let begin = Instant::now();
            let answer = self.command(&[command, name])?;
            println!(
                "{command} takes {browser:.1} s in the page, {:.1} s on the command line",
                begin.elapsed().as_secs_f64()
            );
            same(command, &page, &answer, CONVERGENCE)?;
        }
        let said = self.browser.text("record-status")?;
        ensure!(said.ends_with("\u{a0}%."), "a line may break before the unit: {said}");
        self.browser.click("use-plant")?;
        self.control().map(drop)
    }

    /// Two experiments with one hidden effect: a file, and the record that the panel has made.
    fn several(&mut self) -> Result<()> {
        let names = ["steps.csv", "record.csv"];
        self.browser.click("report-spring")?;
        self.browser.set("effect", "hysteresis")?;
        let mut truths = Vec::new();
        for (target, name) in ["step", "stair"].into_iter().zip(names) {
            self.browser.set("target", target)?;
            self.control()?;
            truths.push(self.browser.text("truth")?);
            self.save_record(name)?;
        }
        ensure!(truths[0] == truths[1], "not of one spring: {truths:?}");
        let file = self.folder.join(names[0]);
        self.browser.choose("file", &file)?;
        self.browser.wait("document.getElementById('file-name').textContent.startsWith('steps')", CONTROL)?;
        self.browser.click("add-hidden")?;
        self.browser.set("nominal", "paper")?;
        self.browser.set("effort", "quick")?;
        for (command, more) in [("identify", &[][..]), ("diagnose", &["--effort", "quick"])] {
            self.browser.click(command)?;
            let page = self.found()?;
            same(command, &page, &self.command(&[&[command][..], &names, more].concat())?, CONVERGENCE)?;
        }
        let listed = self.browser.value("[...document.getElementById('shown-record').options].map((of) => of.text)")?;
        ensure!(listed == serde_json::json!(names), "the plots offer {listed}");
        let rows = self.browser.text("answer")?;
        ensure!(names.iter().all(|name| rows.contains(name)), "the table shows {rows}");
        let drawn = "document.querySelector('#record-plot svg.live').outerHTML";
        let before = self.browser.value(drawn)?;
        self.browser.set("shown-record", "1")?;
        ensure!(self.browser.value(drawn)? != before, "the plot has not changed");
        Ok(())
    }

    /// The plan after the last diagnosis.
    fn planned(&mut self) -> Result<()> {
        self.browser.click("save-diagnosis")?;
        let diagnosis = self.browser.downloaded("diagnosis.json")?;
        self.write("diagnosis.json", &diagnosis)?;
        self.browser.set("minutes", "2")?;
        self.browser.click("plan")?;
        self.browser.wait("!document.getElementById('planned').hidden", DIAGNOSIS)?;
        let page: Value = serde_json::from_str(&self.browser.text("plan-json")?)?;
        let mut command = self.command(&["plan", "diagnosis.json", "--minutes", "2", "--out", "plan"])?;
        command["schedule"] = Value::Null;
        same("plan", &page, &command, CONVERGENCE)?;
        self.browser.click("save-schedule")?;
        let schedule = self.browser.downloaded("schedule.csv")?;
        let written = fs::read_to_string(self.folder.join("plan/schedule.csv"))?;
        let written = written.split_once('\n').map_or("", |(_, rows)| rows);
        same("schedule", &Value::from(schedule.as_str()), &Value::from(written), CONVERGENCE)?;
        self.write("schedule.csv", &schedule)?;
        self.browser.click("simulate-plan")?;
        let args = ["stair", "--input", "schedule.csv", "--controller", "none"];
        same("simulated", &self.control()?, &self.command(&args)?, ROUNDING)?;
        let legend = self.browser.text("stiffness")?;
        ensure!(legend.contains("with the report's controller"), "the plot's legend is {legend}");
        self.browser.set("minutes", "-1")?;
        self.browser.click("plan")?;
        self.browser.wait("document.getElementById('plan-error').textContent !== ''", CONTROL)?;
        let shown = self.browser.text("plan-error")?;
        let refusal = self.refusal(&["plan", "diagnosis.json", "--minutes", "-1"])?;
        ensure!(refusal == shown, "the page shows `{shown}`, the command `{refusal}`");
        self.browser.set("minutes", "")
    }

    /// Cancels a long diagnosis as soon as it has a cause.
    fn best_so_far(&mut self) -> Result<()> {
        self.browser.choose("file", &shell::root().join(RECORD))?;
        self.browser.wait("document.getElementById('file-name').textContent.startsWith('sample')", CONTROL)?;
        // With the paper's spring the search ends about as soon as the click has come.
        self.browser.set("nominal", "identify")?;
        self.browser.set("effort", "thorough")?;
        self.browser.click("diagnose")?;
        self.browser.wait("document.getElementById('so-far').textContent !== ''", DIAGNOSIS)?;
        let begin = Instant::now();
        self.browser.click("cancel")?;
        let page = self.found()?;
        println!("the best answer so far comes {:.1} s after cancel", begin.elapsed().as_secs_f64());
        ensure!(page["complete"] == false, "the answer is of a search that was finished");
        let status = self.browser.text("record-status")?;
        ensure!(status.starts_with("Ended early: the best answer so far. Verdict: "), "`{status}`");
        Ok(())
    }

    /// Cancels twice, before there is an answer.
    fn cancel(&mut self) -> Result<()> {
        self.browser.click("diagnose")?;
        self.browser.wait("document.body.dataset.record === 'running'", CONTROL)?;
        let begin = Instant::now();
        // In one turn of the page, as the first one alone ends the search.
        self.browser.value("{ const cancel = document.getElementById('cancel'); cancel.click(); cancel.click(); }")?;
        self.browser.wait("document.body.dataset.record === 'idle'", Duration::from_secs(5))?;
        let status = self.browser.text("record-status")?;
        ensure!(status.starts_with("Cancelled."), "`{status}` after {:?}", begin.elapsed());
        self.browser.set("effort", "quick")?;
        self.browser.click("diagnose")?;
        self.found().map(drop)
    }

    fn damaged(&mut self) -> Result<()> {
        for (name, text) in [
            ("column.csv", "time_s,volts\n0,0\n1,1\n"),
            ("number.csv", "time_s,voltage_v,stiffness\n0,0,0\n1,x,0\n2,0,0\n"),
            ("binary.csv", "time_s\u{0}"),
            ("empty.csv", ""),
            ("few.csv", "time_s,voltage_v,stiffness\n0,0,0\n1,100,20\n"),
        ] {
            self.write(name, text)?;
            self.browser.drop_file(name, text)?;
            self.browser
                .wait(&format!("document.getElementById('file-name').textContent.startsWith('{name}')"), CONTROL)?;
            self.browser.set("nominal", "paper")?;
            self.browser.click("diagnose")?;
            self.browser.wait("document.getElementById('record-error').textContent !== ''", CONTROL)?;
            let shown = self.browser.text("record-error")?;
            let refusal = self.refusal(&["diagnose", name])?;
            ensure!(refusal == shown, "the page shows `{shown}`, the command `{refusal}`");
        }
        Ok(())
    }

    /// Pictures on a phone and on a wide screen; nothing may be wider than the screen.
    fn screens(&mut self, pictures: &Path) -> Result<()> {
        let record = shell::root().join(RECORD);
        self.browser.choose("file", &record)?;
        self.browser.set("effort", "normal")?;
        self.browser.wait("document.getElementById('file-name').textContent.startsWith('sample')", CONTROL)?;
        self.browser.click("diagnose")?;
        self.found()?;
        self.browser.click("report-spring")?;
        self.browser.set("target", "drawn")?;
        self.browser.set("effect", "charge-leakage")?;
        self.control()?;
        for (width, scheme) in [(360, "dark"), (1400, "light"), (1920, "dark")] {
            self.browser.screen(width, scheme)?;
            self.picture(&pictures.join(format!("{width}-{scheme}.png")), width)?;
        }
        Ok(())
    }

    /// Writes a picture of what is open; it may not be wider than the screen.
    fn picture(&mut self, picture: &Path, width: u32) -> Result<()> {
        std::thread::sleep(Duration::from_millis(500));
        let wide = self.browser.value("document.documentElement.scrollWidth")?;
        fs::write(picture, STANDARD.decode(self.browser.picture()?)?)?;
        println!("{}", picture.display());
        ensure!(
            wide.as_u64() <= Some(u64::from(width)),
            "{} is {wide} pixels wide on a screen of {width}",
            picture.display()
        );
        Ok(())
    }

    /// The report pages and plots of the command on a phone and on a wide screen: tables fold where they are narrow, every plot has the
    /// width of its column, a table of its values below it and values on hover, and nothing is a white sheet on a dark screen.
    fn reports(&mut self, pictures: &Path) -> Result<()> {
        let record = shell::root().join(RECORD);
        fs::copy(&record, self.folder.join("sample.csv"))?;
        self.command(&["diagnose", "sample.csv", "--out", "diagnosis"])?;
        self.command(&["identify", "sample.csv", "--reading", "stiffness:V", "--out", "nominal"])?;
        self.command(&["stair", "--out", "stair"])?;
        let paper = "getComputedStyle(document.querySelector('svg.plot > rect')).fill";
        for (name, file) in [
            ("diagnosis", "diagnosis/report.html"),
            ("identify", "nominal/report.html"),
            ("stiffness", "stair/stiffness.svg"),
        ] {
            let is_page = file.ends_with(".html");
            // A phone shows a file of a plot as wide as a page for a desk, and scales that.
            let narrow = if is_page { 400 } else { 600 };
            for (width, scheme) in [(narrow, "light"), (narrow, "dark"), (1200, "light"), (1200, "dark")] {
                self.browser.screen(width, scheme)?;
                self.browser.open(&self.folder.join(file))?;
                self.picture(&pictures.join(format!("{name}-{width}-{scheme}.png")), width)?;
                let sheet = self.browser.value(paper)?;
                ensure!((sheet == "rgb(255, 255, 255)") == (scheme == "light"), "{name}, {scheme}: {sheet}");
                let hover = self.browser.value("document.querySelectorAll('svg.plot .hover rect > title').length")?;
                ensure!(hover.as_u64() >= Some(15), "{name}: values on hover at {hover} places");
                if !is_page {
                    continue;
                }
                let plots = "[...document.querySelectorAll('figure')].map((of) => [of.clientWidth, \
                             of.querySelector('svg.plot').getBoundingClientRect().width, \
                             of.querySelectorAll('details td').length])";
                let plots = self.browser.value(plots)?;
                let plots = plots.as_array().context("the plots of the page")?;
                ensure!(!plots.is_empty(), "{name} has no plot");
                for plot in plots {
                    let [column, plot, cells] = [0, 1, 2].map(|place| plot[place].as_f64().unwrap_or(f64::NAN));
                    ensure!((column - plot).abs() < 1.0, "{name}: a plot of {plot} pixels in a column of {column}");
                    ensure!(cells >= 4.0, "{name}: a table of {cells} cells below a plot");
                }
                let row = self.browser.value("getComputedStyle(document.querySelector('tbody tr')).display")?;
                let expected = if width < 640 { "block" } else { "table-row" };
                ensure!(row == expected, "{name}: rows of a table are {row} on a screen of {width}");
            }
        }
        Ok(())
    }

    fn write(&self, name: &str, text: &str) -> Result<PathBuf> {
        let path = self.folder.join(name);
        fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
        Ok(path)
    }
}

/// True for numbers within a relative tolerance of the larger or of 1e-6.
fn are_near(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance * a.abs().max(b.abs()).max(1e-6)
}

/// Compares two answers: the same fields and words, and near numbers; those of the fixed-point tick are equal.
fn same(place: &str, page: &Value, command: &Value, tolerance: f64) -> Result<()> {
    let at = |name: &dyn std::fmt::Display| format!("{place}.{name}");
    match (page, command) {
        (Value::Object(page), Value::Object(command)) => {
            ensure!(page.keys().eq(command.keys()), "{place}: {:?} and {:?}", page.keys(), command.keys());
            let tolerance = |name: &str| match name {
                "with_fixed" | "without_fixed" => 0.0,
                "work" => WORK,
                "held_out_rmse" | "last_40_percent_rmse" => tolerance.max(UNSEEN),
                "fixed_point_error_v" => OF_TICK,
                _ => tolerance,
            };
            page.iter().try_for_each(|(name, value)| same(&at(name), value, &command[name], tolerance(name)))
        }
        (Value::Array(page), Value::Array(command)) if page.len() == command.len() => {
            page.iter().zip(command).enumerate().try_for_each(|(index, (a, b))| same(&at(&index), a, b, tolerance))
        }
        (Value::Number(a), Value::Number(b)) => {
            let (a, b) = (a.as_f64().unwrap_or(f64::NAN), b.as_f64().unwrap_or(f64::NAN));
            ensure!(are_near(a, b, tolerance), "{place}: {a} in the page, {b} of the command");
            Ok(())
        }
        // A plant file, or a sentence with numbers.
        (Value::String(a), Value::String(b)) => {
            let words = |text: &str| -> Vec<String> {
                text.split(|letter: char| letter.is_whitespace() || "[](),;%".contains(letter))
                    .map(str::to_owned)
                    .collect()
            };
            let near = |(a, b): (&String, &String)| match (a.parse(), b.parse()) {
                (Ok(a), Ok(b)) => are_near(a, b, tolerance),
                _ => a == b,
            };
            let (words_a, words_b) = (words(a), words(b));
            let same = words_a.len() == words_b.len() && words_a.iter().zip(&words_b).all(near);
            ensure!(same, "{place}: `{a}` in the page, `{b}` of the command");
            Ok(())
        }
        _ if page == command => Ok(()),
        _ => bail!("{place}: {page} in the page, {command} of the command"),
    }
}
