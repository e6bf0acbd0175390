//! Passes the git revision to `vsj --version`.

#[path = "../firmware/revision.rs"]
mod revision;

fn main() {
    revision::set();
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=../firmware/revision.rs");
}
