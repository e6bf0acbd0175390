//! What the page computes: requests as JSON and the bytes of a file in, an answer as JSON out.
//!
//! | module | what it is |
//! | --- | --- |
//! | [`request`] | the requests by name, answered or refused with one line |
//! | [`control`] | a target through the controller, as `vsj stair` runs it, with curves to draw |
//! | [`hide`] | a record of a spring with a known effect |
//! | [`diagnose`] | records identified and diagnosed, as `vsj identify` and `vsj diagnose` do |
//! | [`plan`] | the next experiment, as `vsj plan` computes it |
//! | [`curve`] | curves thinned for a plot |
//! | `abi` | the functions that the page's worker calls, on the target WebAssembly alone |
//!
//! Nothing here computes what a library of the workspace computes already. The page itself is in `page/web`, built by
//! `cargo xtask page`.

#[cfg(target_family = "wasm")]
mod abi;
pub mod control;
pub mod curve;
pub mod diagnose;
pub mod hide;
pub mod plan;
pub mod request;
