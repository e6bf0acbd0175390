//! Markdown tables.

/// A table of a header and rows of cells; a vertical bar in a cell is escaped.
pub fn table(header: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let owned: Vec<String> = header.iter().map(|&cell| cell.to_owned()).collect();
    let rule: Vec<String> = header.iter().map(|_| "---".to_owned()).collect();
    let escaped = |row: Vec<String>| row.iter().map(|cell| cell.replace('|', "\\|")).collect::<Vec<_>>();
    rows.into_iter().map(escaped).fold(line(&owned) + &line(&rule), |text, row| text + &line(&row))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_magnitude_in_a_cell_does_not_end_it() {
        let text = table(&["law", "unit"], [vec!["dv = a |du|".to_owned(), "V".to_owned()]]);
        assert_eq!(text, "| law | unit |\n| --- | --- |\n| dv = a \\|du\\| | V |\n");
    }
}
