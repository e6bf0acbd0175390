//! Colours of the plots and the page, with lighter plot colours for dark screens.

use std::fmt::Write;

/// Colour of the readings.
pub(super) const READING: &str = "#000000";
/// Colour of the original simulation.
pub(super) const BEFORE: &str = "#d55e00";
/// Colour of the extended simulation.
pub(super) const AFTER: &str = "#0072b2";
/// Colour of the commanded voltage.
pub(super) const COMMAND: &str = "#888888";

/// Colours of the plots, and their replacements on a dark screen.
const ON_DARK: [(&str, &str); 5] =
    [(READING, "#e8e8e8"), (BEFORE, "#ff9a4d"), (AFTER, "#5cb8f2"), (COMMAND, "#909090"), ("#cccccc", "#3d4248")];

const PAGE: &str = include_str!("page.css");

/// The page's style sheet.
pub(super) fn sheet() -> String {
    let mut sheet = PAGE.to_owned();
    sheet.push_str("@media screen and (prefers-color-scheme: dark) {\n");
    for (light, dark) in ON_DARK {
        // Writing to a string cannot fail.
        let _ = writeln!(sheet, "  figure svg [stroke=\"{light}\"] {{ stroke: {dark}; }}");
        let _ = writeln!(sheet, "  figure svg [fill=\"{light}\"] {{ fill: {dark}; }}");
    }
    sheet.push_str("}\n");
    sheet
}
