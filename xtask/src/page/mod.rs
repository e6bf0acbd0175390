//! `cargo xtask page`: the page in `page/`, as one static folder without a server.

mod browser;
mod bundle;
mod test;

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::GzEncoder;
use xtask::{build, files, setup, shell};

use bundle::bundle;

/// Target triple of WebAssembly.
pub(crate) const WASM: &str = "wasm32-unknown-unknown";
/// Sources of the page.
const WEB: &str = "page/web";
/// Style sheets in their order: those of the report pages and plots, then the page's own.
const STYLES: [&str; 3] =
    ["host-sim/src/output/page/page.css", "host-sim/src/output/chart/plot.css", "page/web/page.css"];
/// Folder of the page below the target directory; `page` is that of the profile.
const FOLDER: &str = "site";
/// Largest size of the page, compressed, in bytes.
const MOST: usize = 2_000_000;

/// Arguments of `cargo xtask page`.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Test the page in headless Chromium, which apt-get installs if it is missing
    #[arg(long)]
    test: bool,
}

/// Builds the page, and tests it if that is asked for.
pub(crate) fn run(args: &Args) -> Result<()> {
    let folder = build()?;
    if args.test {
        setup::browser()?;
        test::run(&folder)?;
    }
    Ok(())
}

/// Builds the page, prints the size of its files, and returns their folder.
pub(crate) fn build() -> Result<PathBuf> {
    setup::target(WASM)?;
    let target = shell::target_directory()?;
    let mut command = shell::cargo();
    build::without_paths(&mut command, shell::root());
    shell::run(command.args(["build", "--package", "page", "--lib", "--profile", "page", "--target", WASM]))?;
    let engine = gzip(&build::read(&target.join(WASM).join("page/page.wasm"))?)?;
    let engine = format!("window.vsjEngine = \"{}\";\n", STANDARD.encode(engine));

    let folder = target.join(FOLDER);
    files::make(&folder)?;
    let mut all = 0;
    for (name, text) in [("index.html", index()?), ("engine.js", engine)] {
        let path = folder.join(name);
        files::write(&path, &text)?;
        let size = gzip(text.as_bytes())?.len();
        println!("{}: {} bytes, compressed {size}", path.display(), text.len());
        all += size;
    }
    if all > MOST {
        bail!("the page has {all} bytes, compressed; expected at most {MOST}");
    }
    println!("compressed {all} of at most {MOST} bytes");
    Ok(folder)
}

/// The page with its style sheets and scripts in it.
fn index() -> Result<String> {
    let root = shell::root();
    let web = root.join(WEB);
    let styles = STYLES.map(|path| text(&root.join(path))).into_iter().collect::<Result<String>>()?;
    let mut page = text(&web.join("index.html"))?;
    for (place, content) in
        [("/*STYLE*/", styles), ("/*WORKER*/", bundle(&web, "worker.js")?), ("/*MAIN*/", bundle(&web, "main.js")?)]
    {
        if page.matches(place).count() != 1 {
            bail!("{WEB}/index.html: expected {place} once");
        }
        page = page.replace(place, &content);
    }
    Ok(page)
}

fn text(path: &Path) -> Result<String> {
    String::from_utf8(build::read(path)?).with_context(|| format!("{} is not UTF-8", path.display()))
}

fn gzip(bytes: &[u8]) -> Result<Vec<u8>> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(bytes)?;
    Ok(encoder.finish()?)
}
