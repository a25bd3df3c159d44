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

/// A table with named columns. Cells are JSON values: numbers stay numbers, `null` is an empty cell.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    columns: &'static [&'static str],
    rows: Vec<Vec<Value>>,
}

impl Grid {
    pub(super) const fn new(columns: &'static [&'static str]) -> Self {
        Self { columns, rows: Vec::new() }
    }

    pub(super) fn push(&mut self, row: Vec<Value>) {
        self.rows.push(row);
    }

    /// An array with one object a row.
    pub(super) fn to_json(&self) -> Value {
        self.rows
            .iter()
            .map(|row| {
                let cells = self.columns.iter().map(ToString::to_string).zip(row.iter().cloned());
                Value::Object(cells.collect::<Map<_, _>>())
            })
            .collect()
    }

    pub(super) fn to_text(&self) -> String {
        let mut table = Table::new();
        table.load_style(TableStyle::new()).set_header(self.columns.to_vec());
        for row in &self.rows {
            table.add_row(row.iter().map(cell_text));
        }
        for (position, column) in table.column_iter_mut().enumerate() {
            let numeric = self
                .rows
                .iter()
                .filter_map(|row| row.get(position))
                .all(|cell| matches!(cell, Value::Number(_) | Value::Null));
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
        writer.write_record(self.columns).map_err(failed)?;
        for row in &self.rows {
            writer.write_record(row.iter().map(cell_text)).map_err(failed)?;
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

    fn grid() -> Grid {
        let mut grid = Grid::new(&["name", "offset"]);
        grid.push(vec!["Busy".into(), 0.into()]);
        grid.push(vec!["a, b".into(), 12.into()]);
        grid.push(vec![Value::Null, Value::Null]);
        grid
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
