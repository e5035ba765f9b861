//! Tables as data, and their HTML.

use std::fmt::Write as _;

use crate::escape::escape;
use crate::number::{duration, fixed, significant};

/// One cell.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// Nothing.
    Empty,
    /// Words.
    Text(String),
    /// A number with four significant digits.
    Number(f64),
    /// A number with this many digits after the point.
    Fixed(f64, usize),
    /// A duration, s.
    Duration(f64),
}

impl Cell {
    /// Words.
    pub fn text(text: &str) -> Self {
        Cell::Text(text.to_owned())
    }

    fn shown(&self) -> String {
        match self {
            Cell::Empty => String::new(),
            Cell::Text(text) => escape(text).into_owned(),
            Cell::Number(value) => significant(*value, 4),
            Cell::Fixed(value, decimals) => fixed(*value, *decimals),
            Cell::Duration(seconds) => duration(*seconds),
        }
    }

    fn is_number(&self) -> bool {
        matches!(self, Cell::Number(_) | Cell::Fixed(..) | Cell::Duration(_))
    }
}

/// A table.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Table {
    /// Title.
    pub title: String,
    /// Heads of the columns, with the unit where there is one: `height (mm)`.
    pub columns: Vec<String>,
    /// Rows; short ones are filled with empty cells, long ones are cut.
    pub rows: Vec<Vec<Cell>>,
    /// A remark below; empty for none.
    pub note: String,
}

impl Table {
    /// An empty table.
    pub fn new(title: &str, columns: &[&str]) -> Self {
        Table {
            title: title.to_owned(),
            columns: columns.iter().map(|&c| c.to_owned()).collect(),
            ..Table::default()
        }
    }

    /// A table of rows in which each cell stands beside the head of its column; without rows it has no columns.
    pub fn of<'a, const N: usize>(
        title: &str,
        rows: impl IntoIterator<Item = [(&'a str, Cell); N]>,
    ) -> Self {
        let mut table = Table::new(title, &[]);
        for row in rows {
            let (heads, cells): (Vec<&str>, Vec<Cell>) = row.into_iter().unzip();
            table.columns = heads.into_iter().map(str::to_owned).collect();
            table.rows.push(cells);
        }
        table
    }

    /// The same with a remark below.
    #[must_use]
    pub fn noted(self, note: &str) -> Self {
        Table {
            note: note.to_owned(),
            ..self
        }
    }

    /// The table as HTML, with its title, in a frame that scrolls sideways on a narrow screen.
    pub fn to_html(&self) -> String {
        let mut html = String::new();
        // writing to a String cannot fail, here and below
        if !self.title.is_empty() {
            let _ = write!(html, "<h3>{}</h3>", escape(&self.title));
        }
        html.push_str("<div class=\"scroll\"><table><thead><tr>");
        for (i, column) in self.columns.iter().enumerate() {
            let _ = write!(
                html,
                "<th scope=\"col\"{}>{}</th>",
                self.alignment(i),
                escape(column)
            );
        }
        html.push_str("</tr></thead><tbody>");
        for row in &self.rows {
            html.push_str("<tr>");
            for i in 0..self.columns.len() {
                let cell = row.get(i).unwrap_or(&Cell::Empty);
                let _ = write!(html, "<td{}>{}</td>", self.alignment(i), cell.shown());
            }
            html.push_str("</tr>");
        }
        html.push_str("</tbody></table></div>");
        if !self.note.is_empty() {
            let _ = write!(html, "<p class=\"note\">{}</p>", escape(&self.note));
        }
        html
    }

    /// Columns of numbers stand to the right.
    fn alignment(&self, column: usize) -> &'static str {
        let cells = || self.rows.iter().filter_map(|row| row.get(column));
        let numbers = cells().any(Cell::is_number);
        let words = cells().any(|c| matches!(c, Cell::Text(_)));
        if numbers && !words {
            " class=\"n\""
        } else {
            ""
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_beside_their_heads_make_the_same_table() {
        let row = |n: f64| [("layer", Cell::Number(n)), ("remark", Cell::Empty)];
        let mut table = Table::new("Layers", &["layer", "remark"]);
        table.rows = vec![
            vec![Cell::Number(1.0), Cell::Empty],
            vec![Cell::Number(2.0), Cell::Empty],
        ];
        "noted".clone_into(&mut table.note);
        assert_eq!(
            Table::of("Layers", [1.0, 2.0].map(row)).noted("noted"),
            table
        );
        assert!(
            Table::of("Layers", [].map(row))
                .to_html()
                .contains("<tr></tr>")
        );
    }

    #[test]
    fn a_table_is_escaped_aligned_and_filled() {
        let mut table = Table::new("Layers <1>", &["layer", "height (mm)", "time", "remark"]);
        table.rows = vec![
            vec![
                Cell::Number(1.0),
                Cell::Fixed(1.649, 2),
                Cell::Duration(75.0),
                Cell::text("<b>first</b>"),
            ],
            vec![Cell::Number(2.0), Cell::Fixed(f64::NAN, 2)],
        ];
        insta::assert_snapshot!(table.to_html().replace("<t", "\n<t"));
    }
}
