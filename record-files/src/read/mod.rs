//! The columns of a file. Those that the record needs are read, and those of dates, which may be the days of its times; of the others
//! only the names.

mod arrow;
mod caught;
mod compressed;
pub(crate) mod mcap;
mod messages;
mod pages;
pub(crate) mod parquet;

use simulation::record::columns::Column;

/// The columns of a file by name, and what its user should know about how it was read, one line each.
pub(crate) struct Columns {
    pub(crate) columns: Vec<(String, Column)>,
    pub(crate) remarks: Vec<String>,
}

/// Largest whole number up to which every one is a double.
const MOST_EXACT: i128 = 1 << f64::MANTISSA_DIGITS;

/// The cells of a column, which becomes one of texts with the first cell that is no double.
#[derive(Debug)]
struct Cells(Column);

impl Cells {
    fn new() -> Self {
        Self(Column::Numbers(Vec::new()))
    }

    fn len(&self) -> usize {
        match &self.0 {
            Column::Numbers(numbers) | Column::Durations(numbers) => numbers.len(),
            Column::Texts(texts) => texts.len(),
            Column::Unread => 0,
        }
    }

    fn number(&mut self, value: f64) {
        match &mut self.0 {
            Column::Numbers(numbers) | Column::Durations(numbers) => numbers.push(value),
            Column::Texts(texts) => texts.push(format!("{value:?}")),
            Column::Unread => (),
        }
    }

    fn missing(&mut self) {
        self.number(f64::NAN);
    }

    fn whole(&mut self, value: i128) {
        if value.abs() <= MOST_EXACT { self.number(value as f64) } else { self.text(value.to_string()) }
    }

    fn text(&mut self, text: String) {
        if let Column::Numbers(numbers) | Column::Durations(numbers) = &self.0 {
            self.0 = Column::Texts(numbers.iter().map(|number| format!("{number:?}")).collect());
        }
        if let Column::Texts(texts) = &mut self.0 {
            texts.push(text);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_too_long_for_a_double_makes_the_column_one_of_texts() {
        let mut cells = Cells::new();
        cells.whole(1);
        cells.missing();
        assert!(matches!(&cells.0, Column::Numbers(numbers) if numbers.len() == 2));
        cells.whole(1_767_225_600_123_456_789);
        cells.number(0.5);
        assert_eq!(cells.0, Column::Texts(["1.0", "NaN", "1767225600123456789", "0.5"].map(str::to_owned).to_vec()));
    }
}
