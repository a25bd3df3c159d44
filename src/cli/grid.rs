//! Rows and columns, as text for people, CSV for sheets, JSON for programs.

use std::io::{self, Write};
use std::prelude::v1::*;

use comfy_table::{CellAlignment, Table, TableStyle};
use serde_json::{Map, Value};

use super::exit::Failure;

/// How a [`Grid`] is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Text,
    Csv,
    Json,
}

impl Format {
    pub(super) const fn from_flags(csv: bool, json: bool) -> Self {
        match (csv, json) {
            (true, _) => Self::Csv,
            (_, true) => Self::Json,
            _ => Self::Text,
        }
    }
}

/// A cell with the name of its column. The value is a JSON value: numbers stay numbers, `null` is an
/// empty cell.
pub(super) type Cell = (&'static str, Value);

/// A table with named columns: every cell of the `N` in a row brings its name, so that none can come
/// to stand under another's.
#[derive(Clone, Debug)]
pub(super) struct Grid<const N: usize> {
    rows: Vec<[Cell; N]>,
}

impl<const N: usize> FromIterator<[Cell; N]> for Grid<N> {
    fn from_iter<I: IntoIterator<Item = [Cell; N]>>(rows: I) -> Self {
        Self { rows: rows.into_iter().collect() }
    }
}

impl<const N: usize> Grid<N> {
    /// Names of the columns; none where there are no rows.
    fn columns(&self) -> Vec<&'static str> {
        self.rows.first().into_iter().flatten().map(|(name, _)| *name).collect()
    }

    /// An array with one object a row.
    pub(super) fn to_json(&self) -> Value {
        self.rows
            .iter()
            .map(|row| {
                let cells = row.iter().map(|(name, value)| (name.to_string(), value.clone()));
                Value::Object(cells.collect::<Map<_, _>>())
            })
            .collect()
    }

    pub(super) fn to_text(&self) -> String {
        let mut table = Table::new();
        table.load_style(TableStyle::new()).set_header(self.columns());
        for row in &self.rows {
            table.add_row(row.iter().map(|(_, value)| cell_text(value)));
        }
        for (position, column) in table.column_iter_mut().enumerate() {
            let numeric = self
                .rows
                .iter()
                .filter_map(|row| row.get(position))
                .all(|cell| matches!(cell, (_, Value::Number(_) | Value::Null)));
            if numeric {
                column.set_cell_alignment(CellAlignment::Right);
            }
        }
        // Columns are padded with a blank on both sides; the outermost are not wanted.
        let trimmed = |line: String| line.strip_prefix(' ').unwrap_or(&line).trim_end().to_string();
        table.lines().map(|line| trimmed(line) + "\n").collect()
    }

    fn to_csv(&self) -> Result<String, Failure> {
        let failed = |error: csv::Error| Failure::internal(error.to_string());
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(self.columns()).map_err(failed)?;
        for row in &self.rows {
            writer.write_record(row.iter().map(|(_, value)| cell_text(value))).map_err(failed)?;
        }
        let bytes = writer.into_inner().map_err(|error| Failure::internal(error.to_string()))?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }

    pub(super) fn render(&self, format: Format) -> Result<String, Failure> {
        match format {
            Format::Text => Ok(self.to_text()),
            Format::Csv => self.to_csv(),
            Format::Json => pretty(&self.to_json()),
        }
    }
}

/// JSON for people, with a line end.
pub(super) fn pretty(value: &Value) -> Result<String, Failure> {
    serde_json::to_string_pretty(value)
        .map(|text| text + "\n")
        .map_err(|error| Failure::internal(error.to_string()))
}

fn cell_text(cell: &Value) -> String {
    match cell {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        Value::Bool(true) => "yes".into(),
        Value::Bool(false) => "no".into(),
        other => other.to_string(),
    }
}

/// Writes to standard output. A reader that has seen enough (`| head`) is not an error.
pub(super) fn print(text: &str) -> Result<(), Failure> {
    match io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Failure::internal(format!("cannot write to standard output: {error}")))
        }
        _ => Ok(()),
    }
}

/// A Real as a JSON number in its shortest form; JSON has no NaN and no infinities, so those are text.
pub(super) fn real(value: f32) -> Value {
    // Through the shortest decimal text: widening to f64 would show digits nobody sent.
    let text = value.to_string();
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => Value::from(number),
        _ => Value::from(text),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> Grid<2> {
        let rows = [("Busy".into(), 0.into()), ("a, b".into(), 12.into()), Default::default()];
        rows.into_iter().map(|(name, offset)| [("name", name), ("offset", offset)]).collect()
    }

    #[test]
    fn text_is_aligned_and_has_no_trailing_blanks() {
        let text = grid().to_text();
        assert!(text.lines().all(|line| !line.ends_with(' ')), "{text:?}");
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[1].len(), lines[2].len(), "numbers are right-aligned: {text}");
    }

    #[test]
    fn csv_quotes_and_json_keeps_numbers() {
        assert_eq!(grid().to_csv().unwrap(), "name,offset\nBusy,0\n\"a, b\",12\n,\n");
        assert_eq!(grid().to_json()[1]["offset"], 12);
        assert_eq!(grid().to_json()[2]["name"], Value::Null);
    }

    #[test]
    fn reals_are_written_in_their_shortest_form() {
        assert_eq!(real(0.1).to_string(), "0.1");
        assert_eq!(real(f32::NAN), Value::from("NaN"));
    }
}
