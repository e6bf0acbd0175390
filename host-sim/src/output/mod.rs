//! Everything `vsj` writes: text on the terminal, files in a folder. Results come in, nothing is computed here.
//!
//! | module | what it writes |
//! | --- | --- |
//! | [`terminal`], [`screen`] | stdout and stderr; a status that is refreshed in place |
//! | [`files`], [`mod@file`] | the files of one run: all of them or none; a file alone |
//! | [`beam`], [`bound`], [`compare`], [`diagnosis`], [`dynamics`], [`identify`], [`isolate`], [`joint`], [`log`], [`plan`], [`reproduce`], [`stair`], [`tune`] | the answer of the subcommand of that name |
//! | [`export`] | spring and controller for other programs |
//! | [`log_file`] | the decoded log as MCAP or Parquet |
//! | [`ticks`] | the ticks of a run as CSV, MCAP or Parquet |
//! | [`recording`] | telemetry as CSV, MCAP or Parquet while it arrives |
//! | [`udp`] | telemetry as datagrams for PlotJuggler |
//! | [`figure`], [`plots`] | plots as SVG |
//! | `chart`, `page` | the parts of all plots and of all report pages |

pub mod adapt;
pub mod beam;
pub mod bound;
mod cells;
mod chart;
mod colours;
pub mod compare;
pub mod diagnosis;
pub mod dynamics;
pub mod export;
pub mod figure;
pub mod file;
pub mod files;
pub mod identify;
pub mod isolate;
pub mod joint;
pub mod log;
pub mod log_file;
mod page;
pub mod plan;
pub mod plots;
pub mod recording;
pub mod reproduce;
pub mod screen;
pub mod stair;
mod step_response;
pub mod terminal;
pub mod ticks;
pub mod tune;
pub mod udp;
