//! Runs the program `vlm` as users and scripts do.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod support;
mod bad_input;
mod baking;
mod batch;
mod watch;
mod kill;
mod authored;
mod commands;
mod checking;
mod differing;
mod relinking;
mod report_html;
mod geometry;
mod generated;
mod schemas;
