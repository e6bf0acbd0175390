//! Which line of a text is the header of its table: instruments write titles above it, and units below.

use std::ops::RangeInclusive;

use super::dialect::{Numbers, Separator, is_blank};
use crate::units::{are_labels, is_unit};

/// Number of rows below a header that have to agree with it.
pub(super) const CHECKED_ROWS: usize = 10;
/// Largest number of lines above a header, without comments and blank lines.
pub(super) const MOST_TITLES: usize = 100;

/// A line that can be a header: its place in a text, in bytes, and the separator of its columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Candidate {
    pub(super) start: usize,
    pub(super) separator: Separator,
}

/// Returns the lines of a text that can be its header, among the first `most` that are neither blank nor comments: lines of
/// names without numbers, whose number of columns is that of the next rows of numbers, behind at most one line of labels and
/// one of units. Of two such lines of names above the same rows, both.
pub(super) fn candidates(text: &str, known: Option<Separator>, most: usize) -> Vec<Candidate> {
    let starts = text.split_inclusive('\n').scan(0, |next, line| {
        let start = *next;
        *next += line.len();
        Some((start, line.trim_end_matches('\n')))
    });
    let lines: Vec<(usize, &str)> = starts.filter(|(_, line)| has_content(line)).collect();
    let mut found: Vec<Candidate> = Vec::new();
    // Numbers of columns of the last header's rows, as long as its rows go on.
    let mut table = None;
    for index in 0..lines.len().min(most) {
        let below = || lines[index + 1..].iter().map(|(_, line)| *line);
        let (start, line) = lines[index];
        // A row of numbers can look like names to another separator: `high<tab>0,5<tab>0,7` to the comma.
        table = table.filter(|(columns, separator)| {
            let cells = Cells::of(line, *separator);
            cells.are_row(columns) || cells.are_units_of(columns) || cells.have_labels()
        });
        if table.is_some() {
            continue;
        }
        let Some(separator) = separators(known, line).find(|separator| is_header(line, below(), *separator)) else {
            continue;
        };
        let header = Cells::of(line, separator);
        if let Some((start, above)) = index.checked_sub(1).map(|index| lines[index])
            && let above = Cells::of(above, separator)
            && above.are_names(header.used)
            && !above.have_labels()
        {
            found.push(Candidate { start, separator });
        }
        found.push(Candidate { start, separator });
        table = Some((header.columns(), separator));
    }
    found
}

/// Returns the separator of a text that starts with its header: the one that is known, else of those that split the header
/// the first for which the rows have as many columns.
pub(super) fn separator(text: &str, known: Option<Separator>) -> Separator {
    let mut lines = text.lines().filter(|line| has_content(line));
    let header = lines.next().unwrap_or_default();
    let rows: Vec<&str> = lines.take(CHECKED_ROWS).collect();
    let splits: Vec<Separator> = separators(known, header).collect();
    let fits = |separator: &&Separator| {
        let columns = Cells::of(header, **separator).used;
        rows.iter().all(|row| Cells::of(row, **separator).used == columns)
    };
    *splits.iter().find(fits).or(splits.first()).unwrap_or(&known.unwrap_or(Separator::COMMA))
}

/// True for a line of `columns` different names that are no numbers.
pub(super) fn are_names(line: &str, separator: Separator, columns: usize) -> bool {
    Cells::of(line, separator).are_names(columns)
}

/// True for the name of a last column that rows may lack: LabVIEW ends a header with it, and rows with their last number.
pub(super) fn is_left_out(name: &str) -> bool {
    name.eq_ignore_ascii_case("comment")
}

/// False for a comment, and for a line of nothing but blanks and separators.
fn has_content(line: &str) -> bool {
    !line.starts_with('#') && !is_blank(line)
}

/// The separator that is known, else the usual ones, as far as they split a line.
fn separators(known: Option<Separator>, line: &str) -> impl Iterator<Item = Separator> {
    let is_asked = move |separator: &Separator| known.is_none_or(|known| known == *separator);
    let other = known.filter(|known| !Separator::USUAL.contains(known));
    let usual = Separator::USUAL.into_iter().filter(is_asked).chain(other);
    usual.filter(move |separator| Cells::of(line, *separator).used > 1)
}

/// True for a line of names above as many columns of numbers.
fn is_header<'t>(line: &str, below: impl Iterator<Item = &'t str>, separator: Separator) -> bool {
    let header = Cells::of(line, separator);
    let columns = header.columns();
    let mut below = below.peekable();
    below.next_if(|line| Cells::of(line, separator).have_labels());
    below.next_if(|line| Cells::of(line, separator).are_units_of(&columns));
    let mut rows = below.take(CHECKED_ROWS).map(|row| Cells::of(row, separator)).peekable();
    header.are_names(header.used) && rows.peek().is_some() && rows.all(|row| row.are_row(&columns))
}

/// A line, split at a separator.
struct Cells<'t> {
    cells: Vec<&'t str>,
    /// Number of cells without empty ones at the end.
    used: usize,
}

impl<'t> Cells<'t> {
    fn of(line: &'t str, separator: Separator) -> Self {
        let mut is_quoted = false;
        let cells = line.trim_end_matches([' ', '\r']).split(|letter: char| {
            is_quoted ^= letter == '"';
            letter == char::from(separator.0) && !is_quoted
        });
        let cells = cells.map(|cell| cell.trim().trim_matches('"').trim());
        // Several blanks are one separator.
        let cells: Vec<&str> = cells.filter(|cell| separator != Separator::BLANKS || !cell.is_empty()).collect();
        let used = cells.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1);
        Self { cells, used }
    }

    /// Numbers of columns of the rows below these names.
    fn columns(&self) -> RangeInclusive<usize> {
        let may_lack_one = self.cells[..self.used].last().is_some_and(|name| is_left_out(name));
        self.used - usize::from(may_lack_one)..=self.used
    }

    /// True if these can be the cells of a number of columns; the last ones may be empty.
    fn fit(&self, columns: &RangeInclusive<usize>) -> bool {
        self.used <= *columns.end() && self.cells.len() >= *columns.start()
    }

    /// True for a row of numbers of a table with a number of columns.
    fn are_row(&self, columns: &RangeInclusive<usize>) -> bool {
        self.fit(columns) && self.have_numbers()
    }

    fn have_numbers(&self) -> bool {
        self.cells.iter().any(|cell| Numbers::any(cell))
    }

    /// True for the names of a number of columns: different ones, of which the first may be empty, as spreadsheets write indices.
    fn are_names(&self, columns: usize) -> bool {
        let is_new = |index: usize| !self.cells[index].is_empty() && !self.cells[..index].contains(&self.cells[index]);
        self.used == columns && (1..columns).all(is_new) && !self.have_numbers() && !self.are_units()
    }

    fn are_units_of(&self, columns: &RangeInclusive<usize>) -> bool {
        self.fit(columns) && self.are_units()
    }

    fn have_labels(&self) -> bool {
        are_labels(self.cells.iter().copied())
    }

    /// True if at least half of the cells that say something are units, and none is a number; false for labels.
    fn are_units(&self) -> bool {
        let said = self.cells.iter().filter(|cell| !["", "-"].contains(cell));
        let units = said.clone().filter(|cell| is_unit(cell)).count();
        units > 0 && 2 * units >= said.count() && !self.have_numbers() && !self.have_labels()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of the lines that can be the header, from 1.
    fn found(text: &str) -> Vec<usize> {
        let line = |Candidate { start, .. }: Candidate| 1 + text[..start].matches('\n').count();
        candidates(text, None, MOST_TITLES).into_iter().map(line).collect()
    }

    #[test]
    fn the_header_is_a_line_of_names_above_as_many_columns_of_numbers() {
        for (text, expected) in [
            ("t;u;x\n0;1;2\n1;1;2\n", vec![1]),
            ("a title\nt;u;x\n0;1,5;2\n1;1;2\n", vec![2]),
            ("serial;12\nrate;1000;Hz\n\n# a\nt;u;x\ns;kV;mm\n0;1;2\n1;1;2\n", vec![5]),
            ("a;b;c\n1;2;3\n2;3;4\nt;u;x\n0;1;2\n1;;\n", vec![4]),
            ("by X, of Y\nTime [s],u (V),x\n2026-01-31 10:00,0,-\n2026-01-31 10:01,0,-\n", vec![2]),
            // What is not a line of units may be a title.
            ("device;serial;name\nt;u;x\n0;1;2\n1;1;2\n", vec![1, 2]),
            ("a;b;c\n1;2;3\n2;3;4\n", vec![1]),
            (";a;b\n1;2;3\n2;3;4\n", vec![1]),
            ("a\tt\tu\tx\non\t0,1\t0,5\tn/a\non\t0,2\t0,5\t\n", vec![1]),
            ("a\tt\tu\tx\n-\ts\tV\tmm\non\t0,1\t0,5\tn/a\non\t0,2\t0,5\t\n", vec![1]),
            ("\"X\",\"7\"\n\"t\",\"u\",\"x\"\n\"s\",\"V\",\"mm\"\n\"\",\"Avg\",\"Avg\"\n0,1,2\n1,1,2\n", vec![]),
            ("0;1;2\n1;1;2\n", vec![]),
            ("a title\nt;u;x\n0;1;2\n1;1\n", vec![]),
            ("a title\n0;1;2\n", vec![]),
        ] {
            assert_eq!(found(text), expected, "{text:?}");
        }
        let table = |rows: usize| format!("channel;low;high\n{}", "1;-10;10\n".repeat(rows));
        let second = "t;u;x\n0;1;2\n1;1;2\n";
        assert_eq!(found(&(table(9) + second)), [11], "the first table is shorter than what is checked");
        assert_eq!(found(&(table(16) + second)), [1, 18]);
    }

    #[test]
    fn lines_of_units_have_units_in_half_of_their_cells() {
        for (line, expected) in [
            ("s;kV;mm", true),
            ("[ms];[furlong];-", true),
            (",;%;degC", true),
            (";;mm", true),
            ("t;u;x", false),
            ("time;V;x", false),
            ("s;1;mm", false),
            (";;", false),
        ] {
            assert_eq!(Cells::of(line, Separator(b';')).are_units(), expected, "{line}");
        }
    }
}
