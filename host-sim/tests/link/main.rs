//! `vsj link` against an MCU in the test process.
#![cfg(unix)]

mod capture;
mod command;
mod containers;
mod damage;
mod manual;
mod mcu;
mod model;
#[cfg(target_os = "linux")]
mod output;
mod settings;
mod vsj;
#[cfg(target_os = "linux")]
mod watch;
